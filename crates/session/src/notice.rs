//! Messages of a session while it works, in addition to its results.

use std::path::PathBuf;
use steradian_engines::percent;
use steradian_formats::WriteReport;

/// Something that a user should know; [`Display`](std::fmt::Display) gives one line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Notice {
    /// An input is not quite right, and was mended or taken as it is.
    #[error("{name}: {what}")]
    Input {
        /// The input.
        name: String,
        /// The oddity.
        what: String,
    },
    /// An input given with a saved bake differs from the one that was baked.
    #[error("{given}: {bake} was baked {of}, {baked}")]
    NotBaked {
        /// The input given.
        given: String,
        /// The file of the bake.
        bake: String,
        /// "from another light" or "of another reflectance".
        of: &'static str,
        /// The input that was baked.
        baked: String,
    },
    /// A file's format could not hold all.
    #[error("{}: {}", path.display(), lost(report, *share))]
    Lost {
        /// The file.
        path: PathBuf,
        /// The losses.
        report: WriteReport,
        /// The part of the light, or of the picture, that was clipped; `None`: it is neither.
        share: Option<f64>,
    },
    /// A sky's sun was drawn into an image.
    #[error("the sun is part of the image now: a disk of texels")]
    SunDrawn,
    /// Samples of a GPU's picture were clipped.
    #[error("{samples} samples are beyond the GPU's 16-bit range and were clipped")]
    Clipped {
        /// Number of samples.
        samples: u32,
    },
    /// Something would be computed on a GPU and is not.
    #[error("rendering on the CPU: {why}")]
    OnCpu {
        /// Why.
        why: String,
    },
    /// The technique chosen for a material, and its error.
    #[error(transparent)]
    Technique(#[from] crate::Chosen),
    /// No technique was good enough.
    #[error("{why}: the reference computes every point, which takes longer")]
    Reference {
        /// Why.
        why: String,
    },
    /// A technique leaves something of a material out.
    #[error("{technique} leaves out {}", what.join(" and "))]
    LeftOut {
        /// The technique.
        technique: &'static str,
        /// The ignored properties.
        what: Vec<&'static str>,
    },
    /// Anything else.
    #[error("{0}")]
    Remark(String),
}

/// What a format could not hold, in words.
fn lost(report: &WriteReport, share: Option<f64>) -> String {
    let samples = |n: u64| if n == 1 { "1 sample".into() } else { format!("{n} samples") };
    let was = |n: u64| if n == 1 { "was" } else { "were" };
    let mut out = Vec::new();
    if report.clipped > 0 {
        let part = share.map(|s| format!(": {} of the light is lost", percent(s))).unwrap_or_default();
        let n = report.clipped;
        out.push(format!("{} outside the format's range {} clipped{part}", samples(n), was(n)));
    }
    if report.vanished > 0 {
        out.push(format!("{} too small for the format became 0", samples(report.vanished)));
    }
    out.join("; ")
}

impl Notice {
    /// Does the output suffer, or may it?
    pub fn is_warning(&self) -> bool {
        matches!(
            self,
            Self::Input { .. }
                | Self::NotBaked { .. }
                | Self::Lost { .. }
                | Self::SunDrawn
                | Self::Clipped { .. }
        )
    }
}

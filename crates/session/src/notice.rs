//! What a session tells while it works, beside its results.

use std::path::PathBuf;
use steradian_formats::WriteReport;

/// Something that a user should know; [`Display`](std::fmt::Display) gives one line.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Notice {
    /// An input is not quite right, and was mended or taken as it is.
    #[error("{name}: {what}")]
    Input {
        /// The input.
        name: String,
        /// What is odd.
        what: String,
    },
    /// What is given beside a saved bake is not what was baked.
    #[error("{given}: {bake} was baked {of}, {baked}")]
    NotBaked {
        /// What is given.
        given: String,
        /// The file of the bake.
        bake: String,
        /// "from another light" or "of another reflectance".
        of: &'static str,
        /// What was baked.
        baked: String,
    },
    /// A file's format could not hold all.
    #[error("{}: {} samples clipped, {} became 0, {:.4} lost in sum", path.display(), report.clipped, report.vanished, report.lost)]
    Lost {
        /// The file.
        path: PathBuf,
        /// What it lost.
        report: WriteReport,
    },
    /// A sky's sun was drawn into an image.
    #[error("the sun is part of the image now: a disk of texels")]
    SunDrawn,
    /// Samples of a GPU's picture were clipped.
    #[error("{samples} samples are beyond the GPU's 16-bit range and were clipped")]
    Clipped {
        /// How many.
        samples: u32,
    },
    /// Something would be computed on a GPU and is not.
    #[error("rendering on the CPU: {why}")]
    OnCpu {
        /// Why.
        why: String,
    },
    /// Which technique a material got, and how far it is off.
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
        /// What.
        what: Vec<&'static str>,
    },
    /// Anything else.
    #[error("{0}")]
    Remark(String),
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

//! Results of a verification, as data.

use crate::kernel::Kernel;
use crate::laws::Rule;
use crate::light::{Alteration, Reading};
use crate::measure::Error;
use crate::orientation::Orientation;
use crate::scale::Scale;
use steradian_sphere::Layout;

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq)]
pub enum Fault {
    /// Every level is turned. The names are those of conventions that would undo the turn if the light were
    /// read by them.
    Turned(Orientation, Vec<&'static str>),
    /// Channel c of the file holds channel `.0[c]` of the light.
    Channels([usize; 3]),
    /// The levels follow another curve.
    Curve(Rule),
    /// Levels with other kernels than expected: level and kernel found.
    Kernels(Vec<(usize, Kernel)>),
    /// The light was altered before it was filtered.
    Light(Alteration),
    /// The file holds the light times a factor; one number per level where levels differ.
    Scale(Scale, Vec<f64>),
    /// Values are encoded, or decoded, once too often.
    Encoded(Encoding),
    /// Texels that are no numbers, or black where light should be.
    Damaged {
        /// Index of the level.
        level: usize,
        /// Not a number, or infinite.
        invalid: usize,
        /// Black.
        black: usize,
    },
    /// Texels at the format's largest value.
    Limited {
        /// Index of the level.
        level: usize,
        /// The value.
        limit: f32,
        /// Number of texels.
        texels: usize,
    },
    /// Relative error of the texels along the faces' borders, which the others do not have.
    Seams(f64),
    /// Errors of this relative size that change from texel to texel, independent of the light.
    Noise(f64),
    /// Values are multiples of 1/255, linear or sRGB-encoded, with this relative error.
    Coarse(Encoding, f64),
    /// The file shows none of the light's detail: it was made from another light.
    OtherLight,
    /// Relative error that no hypothesis explains clearly, and the hypotheses that come nearest.
    Unexplained(f64, Vec<Nearest>),
    /// Residual that the named faults do not explain.
    Remains(f64),
}

/// A hypothesis that explains something, but not clearly.
#[derive(Debug, Clone, PartialEq)]
pub struct Nearest {
    /// Its faults.
    pub faults: Vec<Fault>,
    /// Residual under these faults, relative RMS.
    pub residual: f64,
}

/// Transfer function by which values were changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Not at all.
    Linear,
    /// sRGB's curve lies on linear values.
    Encoded,
    /// Linear values were decoded as if they were sRGB's.
    Decoded,
}

/// One level.
#[derive(Debug, Clone)]
pub struct Level {
    /// Its layout.
    pub layout: Layout,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Expected kernel.
    pub expected: Kernel,
    /// Kernel found.
    pub found: Kernel,
    /// Factors per channel.
    pub scale: [f64; 3],
    /// Relative residual of the samples under the expected kernel.
    pub expected_residual: f64,
    /// Relative residual of the samples under the kernel found.
    pub residual: f64,
    /// Error against the expected kernel.
    pub error: Error,
    /// Error against the kernel found.
    pub error_as_found: Error,
}

/// Results for a file.
#[derive(Debug, Clone)]
pub struct Report {
    /// Level by level.
    pub levels: Vec<Level>,
    /// Orientation of all levels.
    pub orientation: Orientation,
    /// Faults; empty where all is as expected.
    pub faults: Vec<Fault>,
    /// Interpretation of the light's texels, where it could be determined.
    pub reading: Option<Reading>,
}

impl Report {
    /// Is all as expected?
    pub fn is_right(&self) -> bool {
        self.faults.is_empty()
    }

    /// The largest relative RMS error of a level against the expected kernel.
    pub fn worst(&self) -> f64 {
        self.levels.iter().map(|l| l.error.rms).fold(0.0, f64::max)
    }
}

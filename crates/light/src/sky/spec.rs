//! Names of skies: `name:key=value,…`.

use steradian_base::{ParamError, unknown};

/// Why a sky could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SkyError {
    /// No sky has this name.
    #[error("{}", unknown("sky", .0, &super::NAMES))]
    UnknownName(String),
    /// A parameter that the sky does not have, or a value that cannot be used.
    #[error("{name}: {error}")]
    Param {
        /// The sky.
        name: &'static str,
        /// What is wrong.
        error: ParamError,
    },
    /// An image of no texels, or too many.
    #[error("an environment of {0}×{1} texels cannot be made: use 1 to 32768 texels per side")]
    Size(usize, usize),
}

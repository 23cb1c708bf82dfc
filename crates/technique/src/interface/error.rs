//! Why a bake is refused or fails.

use steradian_base::{Cancelled, ParamError};
use steradian_light::Unsound;

/// Why a bake is refused or fails; its message is one line that says what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BakeError {
    /// A parameter is unknown or out of range.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// The technique does not take this reflectance.
    #[error("{slug}: {why}")]
    Material {
        /// The technique.
        slug: &'static str,
        /// The reason, and what to use instead.
        why: String,
    },
    /// The technique cannot take this light.
    #[error("{slug}: {why}")]
    Light {
        /// The technique.
        slug: &'static str,
        /// The reason, and what to use instead.
        why: String,
    },
    /// Light that is not finite, or too strong.
    #[error(transparent)]
    Unsound(#[from] Unsound),
    /// The result is not finite, although light and reflectance are.
    #[error("{slug}: the result is not finite; scale the light down, or use another technique")]
    NotFinite {
        /// The technique.
        slug: &'static str,
    },
    /// A loaded bake keeps too little of its light or reflectance to measure its error with another factor.
    #[error(
        "{slug}: what this file keeps does not tell the error with another factor: bake anew from light and reflectance"
    )]
    Unmeasured {
        /// The technique.
        slug: &'static str,
    },
    /// The technique bakes per site and was given no geometry, or geometry that it cannot use.
    #[error("{slug}: {why}")]
    Geometry {
        /// The technique.
        slug: &'static str,
        /// The reason.
        why: String,
    },
    /// The transfer that a file holds is not what the technique needs.
    #[error("{slug}: {why}")]
    Transfer {
        /// The technique.
        slug: &'static str,
        /// The reason.
        why: String,
    },
    /// The bake would need more memory than the task allows.
    #[error("{slug}: needs {need} bytes, allowed are {allowed} (`max-memory`)")]
    Memory {
        /// The technique.
        slug: &'static str,
        /// Bytes needed.
        need: u64,
        /// Bytes allowed.
        allowed: u64,
    },
    /// A saved bake of another form than this technique saves.
    #[error("not a bake of {slug}: {why}")]
    Load {
        /// The technique.
        slug: &'static str,
        /// The fault.
        why: String,
    },
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl BakeError {
    /// Exit code of the command: 2 where the request cannot be met as written, 3 for a bad file or light,
    /// else 1.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Param(_) | Self::Material { .. } | Self::Light { .. } | Self::Geometry { .. } => 2,
            Self::Transfer { .. } | Self::Load { .. } | Self::Unsound(_) | Self::Unmeasured { .. } => 3,
            Self::Memory { .. } | Self::NotFinite { .. } | Self::Cancelled(_) => 1,
        }
    }
}

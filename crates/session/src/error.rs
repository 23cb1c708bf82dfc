//! The error type of all requests to a session.

use crate::Missed;
use std::fmt::Display;
use steradian_base::{Cancelled, ParamError};
use steradian_brdf::SpecError;
use steradian_engines::EngineError;
use steradian_formats::FormatError;
use steradian_light::LightError;
use steradian_light::sky::SkyError;
use steradian_reference::ReferenceError;
use steradian_render::SceneError;
use steradian_techniques::{BakeError, SavedError};
use steradian_transfer::TransferError;

/// Why a request fails; displays as one line that says what to do. [`Error::kind`] classifies it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The request cannot be met as it is written.
    #[error("{0}")]
    Usage(String),
    /// An input is unreadable or invalid.
    #[error("{0}")]
    Input(String),
    /// Anything else.
    #[error("{0}")]
    Failed(String),
    /// The result's error is larger than the tolerance.
    #[error(transparent)]
    Missed(#[from] Missed),
    /// A file.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// A light in a file.
    #[error(transparent)]
    Light(#[from] LightError),
    /// The spec of a sky.
    #[error(transparent)]
    Sky(#[from] SkyError),
    /// The spec of a reflectance.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// A scene file.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A parameter of a technique.
    #[error(transparent)]
    Param(#[from] ParamError),
    /// A technique.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// A saved bake.
    #[error(transparent)]
    Saved(#[from] SavedError),
    /// Transfer.
    #[error(transparent)]
    Transfer(TransferError),
    /// The reference.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// An engine's files.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The GPU.
    #[cfg(feature = "gpu")]
    #[error(transparent)]
    Gpu(#[from] steradian_gpu::GpuError),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Cause of an [`Error`]; front ends map it to exit codes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The request's: exit code 2.
    Usage,
    /// An input's: exit code 3.
    Input,
    /// A tolerance was missed: exit code 4.
    Missed,
    /// Anything else: exit code 1.
    Failed,
}

impl Error {
    /// The request cannot be met as it is written.
    pub fn usage(why: impl Display) -> Self {
        Self::Usage(why.to_string())
    }

    /// An input is unreadable or invalid.
    pub fn input(why: impl Display) -> Self {
        Self::Input(why.to_string())
    }

    /// Anything else.
    pub fn failed(why: impl Display) -> Self {
        Self::Failed(why.to_string())
    }

    /// Whose fault it is.
    pub fn kind(&self) -> Kind {
        let of_code = |code: u8| match code {
            2 => Kind::Usage,
            3 => Kind::Input,
            _ => Kind::Failed,
        };
        match self {
            Self::Usage(_) | Self::Param(_) | Self::Sky(_) => Kind::Usage,
            Self::Spec(SpecError::File { .. }) => Kind::Input,
            Self::Spec(_) => Kind::Usage,
            Self::Input(_) | Self::Scene(_) => Kind::Input,
            Self::Missed(_) => Kind::Missed,
            Self::Transfer(TransferError::NoTriangles | TransferError::Site { .. }) => Kind::Input,
            Self::Transfer(TransferError::Setting(_)) => Kind::Usage,
            Self::Transfer(_) => Kind::Failed,
            Self::Failed(_) | Self::Cancelled(_) => Kind::Failed,
            Self::Format(e) => of_code(e.exit_code()),
            Self::Light(e) => of_code(e.exit_code()),
            Self::Bake(e) => of_code(e.exit_code()),
            Self::Saved(SavedError::Format(e)) => of_code(e.exit_code()),
            Self::Saved(SavedError::Invalid { .. }) => Kind::Input,
            Self::Saved(SavedError::Bake { source, .. }) => of_code(source.exit_code()),
            Self::Reference(ReferenceError::Cancelled(_)) => Kind::Failed,
            Self::Reference(_) => Kind::Input,
            Self::Engine(EngineError::Request(_)) => Kind::Usage,
            Self::Engine(EngineError::Format(e)) => of_code(e.exit_code()),
            Self::Engine(_) => Kind::Failed,
            #[cfg(feature = "gpu")]
            Self::Gpu(_) => Kind::Failed,
        }
    }

    /// Did the caller ask to stop?
    pub fn is_cancelled(&self) -> bool {
        matches!(
            self,
            Self::Cancelled(_)
                | Self::Bake(BakeError::Cancelled(_))
                | Self::Reference(ReferenceError::Cancelled(_))
                | Self::Engine(EngineError::Cancelled(_))
        )
    }
}

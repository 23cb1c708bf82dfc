//! Why an engine's files are not made.

use steradian_base::Cancelled;
use steradian_formats::FormatError;

/// Why files are refused or not written; one line that says what to do.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// The request cannot be met as it is written.
    #[error("{0}")]
    Request(String),
    /// It needs more than is allowed.
    #[error("{0}")]
    Failed(String),
    /// A file cannot be written.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

impl EngineError {
    pub(crate) fn request(why: impl Into<String>) -> Self {
        Self::Request(why.into())
    }
}

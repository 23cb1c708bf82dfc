//! What may be wrong with light that is loaded.

use crate::LARGEST;
use steradian_formats::FormatError;

/// Why light cannot be loaded. Displays as one line that names file and fault.
#[derive(Debug, thiserror::Error)]
pub enum LightError {
    /// The file itself.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The pixels do not form an environment: wrong aspect ratio, missing face, no colour.
    #[error("{name}: {why}")]
    Invalid {
        /// The file or pattern as the user gave it.
        name: String,
        /// One line, with what to do where that helps.
        why: String,
    },
    /// A pixel is NaN or infinite.
    #[error(
        "{name}: pixel ({x}, {y}) is {value} in channel {channel}; radiance must be finite: mend it in an image editor, or write the file again"
    )]
    NotFinite {
        /// The file.
        name: String,
        /// Column, from 0.
        x: usize,
        /// Row, from 0 at the top.
        y: usize,
        /// The channel.
        channel: String,
        /// "NaN" or "infinite".
        value: &'static str,
    },
    /// A pixel is so bright that filters would overflow.
    #[error("{name}: pixel ({x}, {y}) is {value:e}; radiance is {LARGEST:e} at most: scale the image down")]
    TooLarge {
        /// The file.
        name: String,
        /// Column, from 0.
        x: usize,
        /// Row, from 0 at the top.
        y: usize,
        /// What it holds.
        value: f32,
    },
}

impl LightError {
    pub(crate) fn invalid(name: impl Into<String>, why: impl Into<String>) -> Self {
        Self::Invalid { name: name.into(), why: why.into() }
    }

    /// Exit code of the command: 3, for inputs.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Format(e) => e.exit_code(),
            _ => 3,
        }
    }
}

//! Errors and limits of every reader and writer.

use std::path::{Path, PathBuf};

/// What may be wrong with a file. Displays as one line that names file and fault.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// The file cannot be opened or read (missing, a directory, no permission): exit 3.
    #[error("{}: {why}", .path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// One line.
        why: String,
    },
    /// The content is not what it should be (truncated, wrong magic, NaN, beyond a limit): exit 3.
    #[error("{}: {why}", .path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// One line, with byte offset or line number where known, and what to do where that helps.
        why: String,
    },
    /// The output cannot be written (full disk, no permission): exit 1.
    #[error("{}: cannot write: {why}", .path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// One line.
        why: String,
    },
}

impl FormatError {
    /// An [`FormatError::Invalid`]. A message that quotes a long text of the file is cut.
    pub fn invalid(path: &Path, why: impl std::fmt::Display) -> Self {
        let mut why = shortened(why.to_string());
        // What is missing at the end of a file is nobody's fault but its copy's.
        let cut = ["truncated", "is cut"].iter().any(|word| why.contains(word));
        if cut && !why.contains(AGAIN) {
            why.push_str(AGAIN);
        }
        Self::Invalid { path: path.into(), why }
    }

    /// Exit code of the command: 1 for outputs, 3 for inputs.
    pub fn exit_code(&self) -> u8 {
        if matches!(self, Self::Unwritable { .. }) { 1 } else { 3 }
    }
}

/// What to do about a file that ends too early.
const AGAIN: &str = "; copy or download it again";

/// Longest message about a file, in characters: a few lines of a terminal.
const MAX_MESSAGE: usize = 400;

/// A message on one line, and only its beginning where it is too long to be read.
pub(crate) fn shortened(mut text: String) -> String {
    if text.contains(char::is_control) {
        text = text.replace(char::is_control, " ");
    }
    if let Some((at, _)) = text.char_indices().nth(MAX_MESSAGE) {
        text.truncate(at);
        text.push_str(" …");
    }
    text
}

/// Limits that hold before anything is allocated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Largest width or height of an image, in pixels.
    pub max_side: u32,
    /// Bytes that decoding one file may allocate.
    pub max_memory: u64,
    /// Largest ratio of decompressed to compressed bytes.
    pub max_ratio: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { max_side: 1 << 16, max_memory: 8 << 30, max_ratio: 20_000 }
    }
}

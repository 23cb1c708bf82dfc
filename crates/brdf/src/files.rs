//! Who may open files.

use crate::SpecError;
use std::path::{Path, PathBuf};
use steradian_formats::{FormatError, file_below, read_file};

/// Files that a spec string may open.
#[derive(Debug, Clone, Copy)]
pub enum Files<'a> {
    /// None. For specs that are data.
    None,
    /// Files in this folder or below it, by relative names. For specs in a file of that folder.
    Below(&'a Path),
    /// Any. For specs that a user writes.
    Any,
    /// None: their contents are these numbers, from [`crate::Brdf::held`].
    Held(&'a [f64]),
}

impl Files<'_> {
    /// Path and text of a file that a spec names. The file may have at most `most` bytes; messages call it
    /// `what`.
    pub(crate) fn read(self, name: &Path, most: u64, what: &str) -> Result<(PathBuf, String), SpecError> {
        let (path, bytes) = self.bytes(name, most, what)?;
        match String::from_utf8(bytes) {
            Ok(text) => Ok((path, text)),
            Err(_) => Err(FormatError::invalid(&path, "not UTF-8 text").into()),
        }
    }

    /// Path and content of a file that a spec names. The file may have at most `most` bytes; messages call it
    /// `what`.
    pub(crate) fn bytes(self, name: &Path, most: u64, what: &str) -> Result<(PathBuf, Vec<u8>), SpecError> {
        let fault = |path: PathBuf, what: String| SpecError::File { file: path.display().to_string(), what };
        let path = match self {
            Self::Any => name.to_owned(),
            Self::Below(folder) => file_below(folder, &name.to_string_lossy()).map_err(|_| {
                fault(name.into(), "must be a file below the folder of the file that names it".into())
            })?,
            Self::None | Self::Held(_) => {
                let why = "is not opened: this spec comes from a file; give it on the command line";
                return Err(fault(name.into(), why.into()));
            }
        };
        let bytes = read_file(&path, most, what)?;
        Ok((path, bytes))
    }
}

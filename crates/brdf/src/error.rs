//! Errors of spec strings.

use steradian_base::{ParamError, brief};
use steradian_formats::FormatError;

/// Why a spec string names no reflectance; displays as one line that says what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// No such model.
    #[error("no BRDF model '{}'{}; there are: {}", brief(.name), suggest(.nearest), .available.join(", "))]
    UnknownModel {
        /// The name as written.
        name: String,
        /// The nearest valid name.
        nearest: Option<&'static str>,
        /// All valid names.
        available: Vec<&'static str>,
    },
    /// A key that the model does not have, a value that cannot be used, or a key that is missing.
    #[error("BRDF {model}: {error}")]
    Param {
        /// The model.
        model: &'static str,
        /// The fault.
        error: ParamError,
    },
    /// Keys that do not go together, or a file that is missing.
    #[error("BRDF {model}: {what}")]
    Syntax {
        /// The model.
        model: &'static str,
        /// The fault and how to correct it.
        what: String,
    },
    /// No such published set or material.
    #[error("BRDF {model} has no set '{}'{}; there are: {}", brief(.name), suggest(.nearest), .available.join(", "))]
    UnknownSet {
        /// The model.
        model: &'static str,
        /// The name as written.
        name: String,
        /// The nearest valid name.
        nearest: Option<&'static str>,
        /// All valid names.
        available: Vec<&'static str>,
    },
    /// A file of parameters that cannot be read or has the wrong contents.
    #[error("{}: {what}", brief(.file))]
    File {
        /// The file.
        file: String,
        /// The fault.
        what: String,
    },
}

fn suggest(nearest: &Option<&'static str>) -> String {
    nearest.map(|n| format!(" (did you mean '{n}'?)")).unwrap_or_default()
}

impl From<FormatError> for SpecError {
    fn from(e: FormatError) -> Self {
        match e {
            FormatError::Unreadable { path, why }
            | FormatError::Invalid { path, why }
            | FormatError::Unwritable { path, why } => {
                Self::File { file: path.display().to_string(), what: why }
            }
        }
    }
}

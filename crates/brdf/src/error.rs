//! Errors of spec strings.

use steradian_base::{ParamError, brief, nearest_few};
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
    #[error("{}", no_set(.model, .name, .nearest, .available))]
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

/// Names that are listed whole in an error, at most; of more the nearest few.
pub(crate) const FEW: usize = 12;
/// The nearest names that stand for the others.
pub(crate) const NEAREST: usize = 4;

/// What there is in place of a published set or material that there is not.
fn no_set(model: &str, name: &str, nearest: &Option<&'static str>, available: &[&'static str]) -> String {
    let few = available.len() <= FEW;
    let some = if few { available.to_vec() } else { nearest_few(name, available, NEAREST) };
    let some = some.join(", ");
    let all = format!("inspect 'brdf:{model}:*' lists all {}", available.len());
    match (name.is_empty(), few) {
        (true, true) => format!("BRDF {model} needs the name of a set; there are: {some}"),
        (true, false) => format!("BRDF {model} needs a material, such as {model}:{}; {all}", available[0]),
        (_, true) => {
            format!("BRDF {model} has no set '{}'{}; there are: {some}", brief(name), suggest(nearest))
        }
        _ => format!(
            "BRDF {model} has no set '{}'{}; near it are: {some}; {all}",
            brief(name),
            suggest(nearest)
        ),
    }
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

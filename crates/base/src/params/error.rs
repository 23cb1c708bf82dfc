//! What can be wrong with a parameter.

use crate::brief;

/// A parameter or a value that is refused; one line that says what is known.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParamError {
    /// No such parameter.
    #[error("no parameter '{}'{}; there {}", brief(.name), suggest(.nearest), known(.available))]
    Unknown {
        /// What the user wrote.
        name: String,
        /// The nearest known name.
        nearest: Option<&'static str>,
        /// What exists.
        available: Vec<&'static str>,
    },
    /// A value of another kind, or out of range.
    #[error("{name} = '{}' is not {expected}", brief(.value))]
    Value {
        /// The parameter.
        name: &'static str,
        /// What the user gave.
        value: String,
        /// What is accepted.
        expected: String,
    },
    /// A parameter without default is missing.
    #[error("needs '{name}=': {doc}")]
    Missing {
        /// The parameter.
        name: &'static str,
        /// What it means.
        doc: &'static str,
    },
    /// A parameter is given more than once.
    #[error("'{0}' is given twice; give it once")]
    Twice(&'static str),
    /// An item that is not `key=value`.
    #[error("'{}' is not key=value; it takes: {}", brief(.item), .available.join(", "))]
    Syntax {
        /// The item.
        item: String,
        /// What may be given.
        available: Vec<String>,
    },
}

fn known(names: &[&str]) -> String {
    match names {
        [] => "are none".into(),
        [one] => format!("is: {one}"),
        several => format!("are: {}", several.join(", ")),
    }
}

fn suggest(nearest: &Option<&'static str>) -> String {
    nearest.map(|n| format!(" (did you mean '{n}'?)")).unwrap_or_default()
}

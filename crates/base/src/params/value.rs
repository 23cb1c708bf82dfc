//! The value of a parameter.

use std::fmt;
use std::path::PathBuf;

/// The value of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Whatever fits the other inputs.
    Auto,
    /// A number: real, whole, or an angle in degrees.
    Number(f64),
    /// On or off.
    Switch(bool),
    /// A word: one of a choice, a name, or text that nobody has read yet.
    Word(String),
    /// A colour, linear Rec. 709.
    Rgb([f64; 3]),
    /// A file.
    File(PathBuf),
}

impl From<f64> for Value {
    fn from(x: f64) -> Self {
        Self::Number(x)
    }
}

impl From<bool> for Value {
    fn from(on: bool) -> Self {
        Self::Switch(on)
    }
}

impl From<&str> for Value {
    fn from(word: &str) -> Self {
        Self::Word(word.into())
    }
}

impl From<[f64; 3]> for Value {
    fn from(rgb: [f64; 3]) -> Self {
        Self::Rgb(rgb)
    }
}

/// As users write it.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Number(x) => write!(f, "{x}"),
            Self::Switch(on) => f.write_str(if *on { "on" } else { "off" }),
            Self::Word(word) => f.write_str(word),
            Self::Rgb([r, g, b]) if r == g && g == b => write!(f, "{r}"),
            Self::Rgb([r, g, b]) => write!(f, "{r}/{g}/{b}"),
            Self::File(path) => write!(f, "{}", path.display()),
        }
    }
}

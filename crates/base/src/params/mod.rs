//! Parameters that describe themselves: one description, one parser and one printer for reflectances, skies,
//! shapes, lights and techniques. Commands, windows and the book make their controls from the descriptions.

mod error;
mod field;
mod info;
mod value;
mod values;

pub use error::ParamError;
pub use field::{Field, Params};
pub use info::{Kind, ParamInfo, Preset};
pub use value::Value;
pub use values::{ParamValues, split_spec};

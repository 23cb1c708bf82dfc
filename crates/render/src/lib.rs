//! Film, tone mapping, image metrics, contact sheets, the scene file and the CPU renderer.

pub mod film;
pub mod metrics;
pub mod sheet;
pub mod tone;

pub use film::{Display, Film};
pub use metrics::{Errors, errors};
pub use sheet::{Cell, Row, Sheet};
pub use tone::{Develop, ToneMapper};

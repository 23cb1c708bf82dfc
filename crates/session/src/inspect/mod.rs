//! What inputs are.

mod light;

pub use light::{Advice, EnvironmentFacts};

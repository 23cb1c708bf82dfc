//! What inputs are.

mod light;
mod texture;

pub use light::{Advice, EnvironmentFacts};
pub use texture::{LevelFacts, TextureFacts};

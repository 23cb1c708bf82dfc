//! Distant light prepared for filtering: its spectrum, its hierarchy, and a list of small bright lights.

pub(crate) mod cell;
mod matching_pursuit;
pub(crate) mod polar;
pub(crate) mod sampled;
pub(crate) mod small_light;
pub mod source;
mod tree;

pub use cell::Cell;
pub use matching_pursuit::MatchingPursuit;
pub use sampled::Sampled;
pub use small_light::SmallLight;
pub use source::Source;
pub use tree::Tree;

//! Distant light prepared for filtering: its spectrum, its hierarchy, and what is bright and small apart.

pub(crate) mod beam;
pub(crate) mod cell;
pub(crate) mod polar;
mod pursuit;
pub(crate) mod sampled;
pub mod source;
mod tree;

pub use beam::Beam;
pub use cell::Cell;
pub use pursuit::Pursuit;
pub use sampled::Sampled;
pub use source::Source;
pub use tree::Tree;

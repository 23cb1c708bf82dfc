//! Light convolved with a kernel as cube maps that techniques look up.

pub mod angular;
pub mod edge_cube;
pub mod filter;
mod stack;

pub use edge_cube::EdgeCube;
pub use filter::{CubeMethod, Filtered, Size};
pub use stack::{CubeStack, stack};

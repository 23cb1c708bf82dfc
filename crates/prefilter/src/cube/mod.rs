//! Light convolved with a kernel as cube maps that techniques look up.

pub mod angular;
mod cube_array;
pub mod edge_cube;
pub mod filter;
pub mod lookup;
mod small_lights;

pub use cube_array::{CubeArray, cube_array};
pub use edge_cube::EdgeCube;
pub use filter::{CubeMethod, Filtered, Size};

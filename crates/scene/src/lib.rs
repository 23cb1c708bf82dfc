//! Geometry only: meshes, tangents, BVH, visibility queries, cameras.

mod bvh;
mod camera;
mod mesh;
pub mod shapes;

pub use bvh::{Bvh, Hit};
pub use camera::{Camera, Ray};
pub use mesh::Mesh;

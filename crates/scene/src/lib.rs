//! Geometry only: meshes, tangents, BVH, visibility queries, cameras.

mod camera;
mod mesh;

pub use camera::{Camera, Ray};
pub use mesh::Mesh;

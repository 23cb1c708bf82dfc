//! Geometry only: meshes, tangents, BVH, visibility queries, cameras.

mod bvh;
mod camera;
mod load;
mod mesh;
pub mod shapes;

pub use bvh::{Bvh, Hit};
pub use camera::{Camera, Ray};
pub use load::{Loaded, from_data, load, load_with};
pub use mesh::{Mesh, MeshReport, Repairs, Surface};

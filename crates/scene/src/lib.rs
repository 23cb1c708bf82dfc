//! Geometry: meshes, tangents, BVH, visibility queries, cameras, and properties that vary over surfaces.

mod bvh;
mod camera;
mod load;
mod mesh;
pub mod shadow;
pub mod shapes;
pub mod surface;

pub use bvh::{Bvh, Hit};
pub use camera::{Camera, Framing, Ray};
pub use load::{Loaded, from_data, load, load_with};
pub use mesh::{Edge, Mesh, MeshReport, Repairs, Surface, edge};

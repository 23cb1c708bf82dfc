//! Data that vary over a surface: textures with their levels, normal maps with the moments of their normals,
//! maps of roughness, and named planes that techniques read. Plain data, and the rules by which they are
//! filtered; renderers on the CPU and on a GPU share them.

mod maps;
mod normal_map;
mod planes;
mod taps;
mod texture;

pub use maps::{Colours, NormalFiltering, SurfaceMaps, alpha2};
pub use normal_map::{NormalMap, Normals};
pub use planes::Planes;
pub use steradian_formats::mesh::Wrap;
pub use taps::{Patch, Tap};
pub use texture::Texture;

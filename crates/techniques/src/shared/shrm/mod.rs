//! What the rooms of spherical harmonic reflection maps share (Ramamoorthi & Hanrahan 2002): parameters, the choice of
//! orders and resolutions by the measured light, and the scale by elevation.

mod choose;
mod fit;
mod maps;
mod material;
mod params;
mod powers;
mod scale;

pub use choose::{Expansion, HighestP, choose};
pub use maps::{bundle, columns, diffuse_map, global_maps, grid, local_maps};
pub use material::material;
pub use params::{ORDERS, Orders, argument_of, argument_word};
pub use powers::METRIC;
pub use scale::ScaleTable;

/// Tolerance where the user gives none, over views up to 60° from the normal.
pub const TOLERANCE: f64 = 0.05;

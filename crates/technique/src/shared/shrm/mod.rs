//! Common code of the techniques of spherical harmonic reflection maps (Ramamoorthi & Hanrahan 2002):
//! parameters, the choice of orders and resolutions by the measured light, and the scale by elevation.

mod choose;
mod maps;
mod material;
mod params;
mod scale;

use crate::shared::points::central;
use std::borrow::Cow;
use steradian_brdf::ATAN2;

pub use choose::choose;
pub use maps::{bundle, columns, diffuse_map, global_maps, grid, local_maps};
pub use material::material;
pub use params::Orders;
pub use scale::{ScaleTable, table as scale_table};
pub use steradian_prefilter::shrm::choice::{ANGLES, Expansion, HighestP, TOLERANCE};

/// WGSL of the sum over harmonics of a direction.
pub const SUM: &str = include_str!("sum.wgsl");

/// The WGSL text of directions, strands among them.
pub const DIRECTIONS: [&str; 4] = [
    ATAN2,
    include_str!("../maths/harmonics.wgsl"),
    central::TANGENT,
    include_str!("../points/central.wgsl"),
];

/// The WGSL modules common to the local and the global form: directions, and the diffuse part, if there is
/// one; `own` follows.
pub fn shader(diffuse: bool, own: &[&'static str]) -> Vec<Cow<'static, str>> {
    let diffuse = if diffuse { include_str!("diffuse.wgsl") } else { include_str!("black.wgsl") };
    DIRECTIONS.into_iter().chain([diffuse]).chain(own.iter().copied()).map(Cow::from).collect()
}

//! Every room, one line each.

use crate::rooms::{diffuse_map, mirror_map, phong_diffuse_maps, sh_irradiance, split_sum};
use crate::{AnyTechnique, Erased};

const ROOMS: &[&dyn AnyTechnique] = &[
    &Erased::<mirror_map::MirrorMap>::new(),
    &Erased::<sh_irradiance::ShIrradiance>::new(),
    &Erased::<diffuse_map::DiffuseMap>::new(),
    &Erased::<phong_diffuse_maps::PhongDiffuseMaps>::new(),
    &Erased::<split_sum::SplitSum>::new(),
];

/// Every technique, in the order of menus.
pub fn registry() -> &'static [&'static dyn AnyTechnique] {
    ROOMS
}

/// The technique called `slug`; `-` and `_` are the same.
pub fn find(slug: &str) -> Option<&'static dyn AnyTechnique> {
    let slug = slug.replace('-', "_");
    registry().iter().copied().find(|t| t.card().slug == slug)
}

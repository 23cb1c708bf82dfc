//! Every room, one line each.

use crate::rooms::*;
use crate::{AnyTechnique, Erased};

/// Every technique, in the order of menus.
pub fn registry() -> &'static [&'static dyn AnyTechnique] {
    const ROOMS: &[&dyn AnyTechnique] = &[&Erased::<sh_irradiance::ShIrradiance>::new()];
    ROOMS
}

/// The technique called `slug`; `-` and `_` are the same.
pub fn find(slug: &str) -> Option<&'static dyn AnyTechnique> {
    let slug = slug.replace('-', "_");
    registry().iter().copied().find(|t| t.card().slug == slug)
}

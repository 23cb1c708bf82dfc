//! One file per reflectance model.

pub mod ggx;
pub mod lambert;
pub mod phong;

use crate::registry::Entry;

/// Every model, in the order in which it is listed.
pub(crate) static ENTRIES: &[Entry] =
    &[lambert::ENTRY, phong::PHONG, phong::PHONG_MAP, phong::PHONG_NORMALIZED, ggx::ENTRY];

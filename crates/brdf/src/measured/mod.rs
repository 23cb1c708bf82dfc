//! One file per source of measurements, read from files that the spec names.

pub mod curet;
mod curet_file;
mod materials;
pub mod merl;
pub mod nbrdf;
pub mod npf;
pub mod rgl;
mod shape;
mod zernike;

pub use materials::expand;

use crate::model::lobes;
use crate::registry::Entry;

/// Every reader, in the order in which it is listed.
pub(crate) static ENTRIES: &[Entry] =
    &[curet::ENTRY, merl::ENTRY, rgl::ENTRY, npf::ENTRY, nbrdf::ENTRY, lobes::ENTRY];

//! One file per source of measurements, read from files that the spec names.

pub mod alta;
pub mod astm;
pub mod brdflab;
pub mod cornell;
pub mod csv;
pub mod curet;
mod grid;
mod half_table;
mod materials;
pub mod merl;
pub mod merl_anisotropic;
pub mod nbrdf;
pub mod npf;
pub mod rgl;
mod scattered;
mod shape;
mod spectrum;
mod table;
mod tabulated;
pub mod utia;
mod zernike;

pub use materials::expand;

use crate::model::lobes;
use crate::registry::Entry;

/// Every reader, in the order in which it is listed.
pub(crate) static ENTRIES: &[Entry] = &[
    curet::ENTRY,
    merl::ENTRY,
    merl_anisotropic::ENTRY,
    rgl::ENTRY,
    cornell::ENTRY,
    astm::ENTRY,
    alta::ENTRY,
    utia::ENTRY,
    csv::ENTRY,
    npf::ENTRY,
    nbrdf::ENTRY,
    brdflab::ENTRY,
    lobes::ENTRY,
];

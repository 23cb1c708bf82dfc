//! One file per source of measurements, read from files that the spec names.

pub mod curet;
mod curet_file;
mod zernike;

use crate::registry::Entry;

/// Every reader, in the order in which it is listed.
pub(crate) static ENTRIES: &[Entry] = &[curet::ENTRY];

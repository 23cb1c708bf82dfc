//! Suns that are taken out of the light: as lights that are shaded exactly, and in files.

use crate::direct::Direct;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use steradian_prefilter::Sun;

/// Bytes of a sun in the data that shading reads.
pub const BYTES: usize = 4 * Sun::NUMBERS;

/// These suns as lights that are shaded exactly.
pub fn direct(suns: &[Sun]) -> Direct {
    let mut out = Direct::default();
    for sun in suns {
        match sun {
            Sun::Disk(d) => out.disks.push(*d),
            Sun::Cell(c) => out.cells.push(*c),
        }
    }
    out
}

/// Saves suns.
pub fn save_suns(suns: &[Sun], to: &mut TensorFile, name: String) {
    if !suns.is_empty() {
        put_f64(to, name, vec![suns.len(), Sun::NUMBERS], suns.iter().flat_map(Sun::numbers).collect());
    }
}

/// Reads the suns that [`save_suns`] wrote; none where the tensor is missing.
pub fn load_suns(from: &TensorFile, name: &str) -> Result<Vec<Sun>, PartError> {
    if !from.tensors.contains_key(name) {
        return Ok(Vec::new());
    }
    let (_, v) = get_f64(from, name, 2)?;
    let (suns, rest) = v.as_chunks::<{ Sun::NUMBERS }>();
    let suns: Option<Vec<Sun>> = suns.iter().map(Sun::from_numbers).collect();
    suns.filter(|_| rest.is_empty()).ok_or_else(|| PartError::Unexpected(name.to_string()))
}

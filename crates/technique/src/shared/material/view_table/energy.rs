//! Energies of a reflectance in files.

use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use steradian_brdf::views::{ANGLES, Energies, ORDER};

/// Writes them under names that begin with `prefix`.
pub(super) fn save(e: &Energies, to: &mut TensorFile, prefix: &str) {
    let [rows, errors] = e.numbers();
    put_f64(to, format!("{prefix}.energies"), vec![ANGLES, 3, ORDER + 2], rows);
    put_f64(to, format!("{prefix}.errors"), vec![errors.len()], errors);
}

/// Reads energies that [`save`] wrote.
pub(super) fn load(from: &TensorFile, prefix: &str) -> Result<Energies, PartError> {
    let name = format!("{prefix}.energies");
    let (shape, rows) = get_f64(from, &name, 3)?;
    if shape != [ANGLES, 3, ORDER + 2] {
        return Err(PartError::Unexpected(name));
    }
    let name = format!("{prefix}.errors");
    let (_, errors) = get_f64(from, &name, 1)?;
    Energies::from_numbers([rows, errors]).ok_or(PartError::Unexpected(name))
}

//! Files of measured reflectance that are text or plain numbers: plain data, whose meaning is the reader's.

mod alta;
mod astm;
mod brdflab;
mod cornell;
mod curet;
mod materials;
mod merl_anisotropic;
mod utia;

pub use alta::{AltaTable, decode_alta};
pub use astm::{AstmTable, decode_astm};
pub use brdflab::{BrdfLab, BrdfLabFit, BrdfLabLobe, decode_brdflab};
pub use cornell::{CornellTable, decode_cornell};
pub use curet::{CuretTable, decode_curet, decode_curet_directions};
pub use materials::{NBRDF_NUMBERS, NPF_BYTES, NPF_COLUMNS, decode_nbrdf, decode_npf};
pub use merl_anisotropic::{MerlAnisotropic, decode_merl_anisotropic};
pub use utia::{UTIA_BYTES, UTIA_DIRECTIONS, UTIA_ELEVATIONS, UTIA_TURNS, UtiaTable, decode_utia};

use crate::image::not_empty;
use crate::{FormatError, Limits};
use std::path::Path;
use steradian_base::brief;

/// The text of a table of numbers: each number takes two bytes at least, and eight in memory.
fn text<'a>(name: &Path, bytes: &'a [u8], limits: &Limits) -> Result<&'a str, FormatError> {
    not_empty(name, bytes)?;
    limits.memory(name, 8 * bytes.len() as u128, bytes.len() as u64)?;
    std::str::from_utf8(bytes).map_err(|_| FormatError::invalid(name, "not UTF-8 text"))
}

/// A finite number of the line `line`, counted from 1.
fn number(name: &Path, line: usize, word: &str) -> Result<f64, FormatError> {
    let value = word.parse().ok().filter(|x: &f64| x.is_finite());
    value.ok_or_else(|| {
        FormatError::invalid(name, format!("line {line}: '{}' is not a finite number", brief(word)))
    })
}

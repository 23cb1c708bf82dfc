//! Anisotropic measurements of the Institute of Information Theory and Automation in Prague (UTIA; Filip &
//! Vávra 2014, "Template-Based Sampling of Anisotropic BRDFs"): 248 832 little-endian `f64` and nothing else,
//! red, green and blue after one another, each as [θ_i][φ_i][θ_v][φ_v] with six polar angles in steps of 15°
//! and 48 azimuths in steps of 7.5°.

use crate::image::not_empty;
use crate::{FormatError, Limits};
use std::path::Path;

/// Polar angles: 0, 15, … 75 degrees.
pub const UTIA_ELEVATIONS: usize = 6;
/// Azimuths: 0, 7.5, … 352.5 degrees.
pub const UTIA_TURNS: usize = 48;
/// Directions to the light, and as many to the view.
pub const UTIA_DIRECTIONS: usize = UTIA_ELEVATIONS * UTIA_TURNS;
/// Bytes of the whole file.
pub const UTIA_BYTES: u64 = 8 * 3 * (UTIA_DIRECTIONS * UTIA_DIRECTIONS) as u64;

/// The numbers of a file as they stand in it.
#[derive(Debug, Clone, PartialEq)]
pub struct UtiaTable {
    /// Red, green, blue.
    pub channels: [Vec<f64>; 3],
}

/// Decodes such a file that lies in memory; `name` is for messages. Every number is finite.
pub fn decode_utia(name: &Path, bytes: &[u8], limits: &Limits) -> Result<UtiaTable, FormatError> {
    not_empty(name, bytes)?;
    if bytes.len() as u64 != UTIA_BYTES {
        let why = format!("has {} bytes instead of the {UTIA_BYTES} of UTIA's tables", bytes.len());
        return Err(FormatError::invalid(name, why));
    }
    limits.memory(name, u128::from(UTIA_BYTES), bytes.len() as u64)?;
    let numbers: Vec<f64> = bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    if let Some(i) = numbers.iter().position(|v| !v.is_finite()) {
        return Err(FormatError::invalid(name, format!("number {i} is {}", numbers[i])));
    }
    let plane = UTIA_DIRECTIONS * UTIA_DIRECTIONS;
    Ok(UtiaTable { channels: [0, 1, 2].map(|c| numbers[c * plane..(c + 1) * plane].to_vec()) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_length_is_its_only_head() {
        let mut bytes: Vec<u8> = (0..UTIA_BYTES / 8).flat_map(|i| (i as f64).to_le_bytes()).collect();
        let read = |bytes: &[u8]| decode_utia(Path::new("a.bin"), bytes, &Limits::default());
        let table = read(&bytes).expect("valid");
        assert_eq!(table.channels[1][5], (UTIA_DIRECTIONS * UTIA_DIRECTIONS + 5) as f64);
        for n in [0, 1, 8, bytes.len() - 1] {
            let e = read(&bytes[..n]).expect_err("cut");
            assert!(
                e.exit_code() == 3 && (n == 0 || e.to_string().contains("instead of the 1990656")),
                "{e}"
            );
        }
        bytes[80..88].copy_from_slice(&f64::NAN.to_le_bytes());
        assert!(read(&bytes).expect_err("NaN").to_string().ends_with("number 10 is NaN"));
    }
}

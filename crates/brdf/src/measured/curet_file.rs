//! CUReT's tables: rows of measurements, and the directions at which all of them were taken.

use crate::SpecError;
use crate::spec::Args;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// More than 61 rows of 205 numbers need.
const MAX_BYTES: u64 = 4 << 20;
/// Rows or columns at most.
const MAX_NUMBERS: usize = 4096;

/// One pair of directions, local frame.
pub(super) type Pair = (DVec3, DVec3);

/// A file that cannot be used.
pub(super) fn fault(path: &Path, what: String) -> SpecError {
    SpecError::File { file: path.display().to_string(), what }
}

/// The measurements of one sample: what follows the number `sample` on its row.
pub(super) fn row(path: &Path, sample: u32, a: &Args<'_>) -> Result<Vec<f64>, SpecError> {
    let fault = |what: String| fault(path, what);
    let rows = rows(path, a)?;
    let id = |row: &Vec<f64>| row.first().copied();
    if let Some(row) = rows.iter().find(|r| id(r) == Some(f64::from(sample))) {
        let values = &row[1..];
        let positive = values.iter().filter(|v| **v > 0.0).count();
        return if 2 * positive > values.len() {
            Ok(values.to_vec())
        } else {
            Err(fault(format!("sample {sample} holds {positive} positive values of {}", values.len())))
        };
    }
    let ids: Vec<String> = rows.iter().filter_map(id).map(|x| x.to_string()).take(70).collect();
    Err(fault(format!("no sample {sample}; its rows begin with {}", ids.join(", "))))
}

/// The directions: rows θ_i φ_i θ_v φ_v, or the same after a running number; radians, or degrees where a polar angle is
/// above π/2. Both directions point away from the surface.
pub(super) fn directions(path: &Path, a: &Args<'_>) -> Result<Vec<Pair>, SpecError> {
    let fault = |what: String| fault(path, what);
    let rows = rows(path, a)?;
    let angles: Option<Vec<[f64; 4]>> = rows
        .iter()
        .map(|r| r[r.len().saturating_sub(4)..].try_into().ok().filter(|_| r.len() <= 5))
        .collect();
    let form = "rows of theta_i phi_i theta_v phi_v, with or without a running number, are needed";
    let mut angles = angles.ok_or_else(|| fault(form.into()))?;
    let steepest = angles.iter().map(|a| a[0].abs().max(a[2].abs())).fold(0.0, f64::max);
    if steepest > FRAC_PI_2 + 1e-3 {
        angles.iter_mut().flatten().for_each(|a| *a = a.to_radians());
    }
    if let Some(i) = angles.iter().position(|a| a[0].abs().max(a[2].abs()) >= FRAC_PI_2) {
        return Err(fault(format!("row {}: a polar angle is not below 90 degrees", i + 1)));
    }
    let direction = |theta: f64, phi: f64| {
        let (s, c) = theta.sin_cos();
        DVec3::new(s * phi.cos(), s * phi.sin(), c)
    };
    Ok(angles.iter().map(|a| (direction(a[0], a[1]), direction(a[2], a[3]))).collect())
}

/// The numbers of a text file, by line; `#` begins a comment.
fn rows(path: &Path, a: &Args<'_>) -> Result<Vec<Vec<f64>>, SpecError> {
    let fault = |what: String| fault(path, what);
    let text = a.read(path, MAX_BYTES, "a table of CUReT's")?;
    let mut rows = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default();
        let words = line.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty());
        let numbers: Result<Vec<f64>, String> = words.take(MAX_NUMBERS + 1).map(number).collect();
        let numbers = numbers.map_err(|e| fault(format!("line {}: {e}", i + 1)))?;
        if numbers.len() > MAX_NUMBERS || rows.len() >= MAX_NUMBERS {
            return Err(fault(format!("line {}: more numbers than any table of CUReT's", i + 1)));
        }
        if !numbers.is_empty() {
            rows.push(numbers);
        }
    }
    if rows.is_empty() { Err(fault("no numbers in it".into())) } else { Ok(rows) }
}

fn number(word: &str) -> Result<f64, String> {
    word.parse()
        .ok()
        .filter(|x: &f64| x.is_finite())
        .ok_or_else(|| format!("'{word}' is not a finite number"))
}

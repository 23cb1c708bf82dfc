//! CUReT's tables as text (Dana, van Ginneken, Nayar & Koenderink 1999): rows of numbers between spaces or
//! commas, `#` begins a comment.

use super::{number, text};
use crate::{FormatError, Limits};
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// Rows or columns at most: CUReT's own have 61 rows of 206.
const MAX_NUMBERS: usize = 4096;

/// Measurements, `rbrdf.dat` and the like.
#[derive(Debug, Clone, PartialEq)]
pub struct CuretTable {
    rows: Vec<Vec<f64>>,
}

impl CuretTable {
    /// The measurements of one sample, what follows its number on its row; more than half of them are
    /// positive. `name` is for messages.
    pub fn sample(&self, name: &Path, sample: u32) -> Result<&[f64], FormatError> {
        let found = self.rows.iter().find_map(|r| r.split_first().filter(|r| *r.0 == f64::from(sample)));
        let Some((_, values)) = found else {
            let ids: Vec<String> =
                self.rows.iter().filter_map(|r| r.first()).map(f64::to_string).take(70).collect();
            let why = format!("no sample {sample}; its rows begin with {}", ids.join(", "));
            return Err(FormatError::invalid(name, why));
        };
        let positive = values.iter().filter(|v| **v > 0.0).count();
        if 2 * positive > values.len() {
            return Ok(values);
        }
        let why = format!("sample {sample} holds {positive} positive values of {}", values.len());
        Err(FormatError::invalid(name, why))
    }
}

/// Decodes measurements that lie in memory; `name` is for messages. Every number is finite.
pub fn decode_curet(name: &Path, bytes: &[u8], limits: &Limits) -> Result<CuretTable, FormatError> {
    Ok(CuretTable { rows: rows(name, bytes, limits)? })
}

/// Decodes the directions of measurements: rows θ_i φ_i θ_v φ_v, or the same after a running number; in
/// radians, or in degrees where a polar angle is above π/2. What is returned is in radians, polar angles
/// below π/2.
pub fn decode_curet_directions(
    name: &Path,
    bytes: &[u8],
    limits: &Limits,
) -> Result<Vec<[f64; 4]>, FormatError> {
    let rows = rows(name, bytes, limits)?;
    let last = |r: &Vec<f64>| r[r.len().saturating_sub(4)..].try_into().ok().filter(|_| r.len() <= 5);
    let angles: Option<Vec<[f64; 4]>> = rows.iter().map(last).collect();
    let form = "rows of theta_i phi_i theta_v phi_v, with or without a running number, are needed";
    let mut angles = angles.ok_or_else(|| FormatError::invalid(name, form))?;
    let steepest = angles.iter().map(|a| a[0].abs().max(a[2].abs())).fold(0.0, f64::max);
    if steepest > FRAC_PI_2 + 1e-3 {
        angles.iter_mut().flatten().for_each(|a| *a = a.to_radians());
    }
    match angles.iter().position(|a| a[0].abs().max(a[2].abs()) >= FRAC_PI_2) {
        Some(i) => {
            Err(FormatError::invalid(name, format!("row {}: a polar angle is not below 90 degrees", i + 1)))
        }
        None => Ok(angles),
    }
}

/// The numbers of a text, by line; at least one.
fn rows(name: &Path, bytes: &[u8], limits: &Limits) -> Result<Vec<Vec<f64>>, FormatError> {
    let mut rows = Vec::new();
    for (i, line) in text(name, bytes, limits)?.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default();
        let words = line.split(|c: char| c.is_whitespace() || c == ',').filter(|w| !w.is_empty());
        let numbers: Vec<f64> =
            words.take(MAX_NUMBERS + 1).map(|w| number(name, i + 1, w)).collect::<Result<_, _>>()?;
        if numbers.len() > MAX_NUMBERS || rows.len() >= MAX_NUMBERS {
            let why = format!("line {}: more numbers than any table of CUReT's", i + 1);
            return Err(FormatError::invalid(name, why));
        }
        if !numbers.is_empty() {
            rows.push(numbers);
        }
    }
    if rows.is_empty() { Err(FormatError::invalid(name, "no numbers in it")) } else { Ok(rows) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_and_their_directions() {
        let (name, limits) = (Path::new("a.dat"), Limits::default());
        let table =
            decode_curet(name, b"# a comment\n12 0.5, .25 0.1\n\n13 -1 -2 3\n", &limits).expect("valid");
        assert_eq!(table.sample(name, 12).expect("there"), [0.5, 0.25, 0.1]);
        let why = |e: FormatError| e.to_string();
        assert_eq!(
            table.sample(name, 13).map_err(why),
            Err("a.dat: sample 13 holds 1 positive values of 3".into())
        );
        assert_eq!(
            table.sample(name, 1).map_err(why),
            Err("a.dat: no sample 1; its rows begin with 12, 13".into())
        );

        let read = |text: &str| decode_curet_directions(name, text.as_bytes(), &limits).map_err(why);
        assert_eq!(
            read("1 0.1 0.2 0.3 0.4\n2 1 2 1.5 4"),
            Ok(vec![[0.1, 0.2, 0.3, 0.4], [1.0, 2.0, 1.5, 4.0]])
        );
        assert_eq!(read("60 180 0 0"), Ok(vec![[60f64.to_radians(), 180f64.to_radians(), 0.0, 0.0]]));
        for (text, part) in [
            ("", "empty"),
            ("# nothing", "no numbers"),
            ("1 2 3", "with or without a running number"),
            ("1 2 3 4 5 6", "with or without a running number"),
            ("95 0 0 0", "row 1: a polar angle"),
            ("0 0 0 0\n0 NaN 0 0", "line 2: 'NaN'"),
        ] {
            let e = read(text).expect_err(text);
            assert!(e.contains(part), "{text}: {e}");
        }
    }
}

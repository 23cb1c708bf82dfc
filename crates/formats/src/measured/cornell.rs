//! Spectral measurements of Cornell's Program of Computer Graphics (`.brdf`): text in which `#` begins a
//! comment and line ends mean nothing. The number of wavelengths, the wavelengths in nanometres, then
//! records: the polar angle and azimuth of the light, those of the view, in radians, and one value per
//! wavelength.

use super::{number, text};
use crate::{FormatError, Limits};
use std::path::Path;

/// The records of a `.brdf` file.
#[derive(Debug, Clone, PartialEq)]
pub struct CornellTable {
    /// Nanometres, as they stand in the file.
    pub wavelengths: Vec<f64>,
    /// θ and φ of the light, θ and φ of the view, radians.
    pub angles: Vec<[f64; 4]>,
    /// One value per wavelength, record after record.
    pub values: Vec<f64>,
}

/// More wavelengths than any instrument tells apart.
const MAX_WAVELENGTHS: f64 = 4096.0;

/// Decodes a `.brdf` file that lies in memory; `name` is for messages. Every number is finite.
pub fn decode_cornell(name: &Path, bytes: &[u8], limits: &Limits) -> Result<CornellTable, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    let lines = text(name, bytes, limits)?.lines().enumerate();
    let words = lines.flat_map(|(i, line)| {
        let line = line.split('#').next().unwrap_or_default();
        line.split_whitespace().map(move |word| (i + 1, word))
    });
    let mut numbers = words.map(|(line, word)| number(name, line, word));
    let count = numbers.next().ok_or_else(|| invalid("holds no numbers".into()))??;
    if !(1.0..=MAX_WAVELENGTHS).contains(&count) || count.fract() != 0.0 {
        return Err(invalid(format!("begins with {count}, which is no number of wavelengths")));
    }
    let count = count as usize;
    let wavelengths: Vec<f64> = numbers.by_ref().take(count).collect::<Result<_, _>>()?;
    if wavelengths.len() < count {
        return Err(invalid(format!("is cut: {} of {count} wavelengths", wavelengths.len())));
    }
    let mut table = CornellTable { wavelengths, angles: Vec::new(), values: Vec::new() };
    let rest: Vec<f64> = numbers.collect::<Result<_, _>>()?;
    let records = rest.chunks_exact(4 + count);
    let left = records.remainder().len();
    if left > 0 {
        let n = rest.len() / (4 + count);
        return Err(invalid(format!("is cut in record {}: {left} of {} numbers", n + 1, 4 + count)));
    }
    for record in records {
        let (angles, values) = record.split_at(4);
        table.angles.push([angles[0], angles[1], angles[2], angles[3]]);
        table.values.extend(values);
    }
    if table.angles.is_empty() {
        return Err(invalid("holds wavelengths but no measurements".into()));
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit::Mutator;

    fn read(text: &str) -> Result<CornellTable, String> {
        decode_cornell(Path::new("a.brdf"), text.as_bytes(), &Limits::default()).map_err(|e| e.to_string())
    }

    const WHOLE: &str = "# two\n2\r\n400\n700 # nm\n\n.1 0 .2 .3 1 2\n.4 0\n.5 .6 3 4\n";

    #[test]
    fn records_and_faults() {
        let table = read(WHOLE).expect("valid");
        assert_eq!(table.wavelengths, [400.0, 700.0]);
        assert_eq!(table.angles[1], [0.4, 0.0, 0.5, 0.6]);
        assert_eq!(table.values, [1.0, 2.0, 3.0, 4.0]);
        for (text, part) in [
            ("", "empty"),
            ("# nothing\n", "holds no numbers"),
            ("0\n", "no number of wavelengths"),
            ("1e9\n", "no number of wavelengths"),
            ("3 400 500", "cut: 2 of 3 wavelengths"),
            ("1 400", "no measurements"),
            ("1 400 0 0 0", "cut in record 1: 3 of 5"),
            ("1 400 0 0 0\n 0 nan", "line 2: 'nan'"),
            ("1 400 0 0 0 0 1e999", "not a finite number"),
        ] {
            let e = read(text).expect_err(text);
            assert!(e.contains(part) && e.starts_with("a.brdf: "), "{text}: {e}");
        }
        let mut damage = Mutator::new(3);
        for _ in 0..20_000 {
            let bytes = damage.damage(WHOLE.as_bytes(), b"-1,nan 1e39#");
            let _ = decode_cornell(Path::new("a.brdf"), &bytes, &Limits::default());
        }
    }
}

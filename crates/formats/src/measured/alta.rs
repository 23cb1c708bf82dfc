//! Data of the ALTA library in text (`.dat`, `.alta`; Belcour, Barla & Pacanowski 2014, "ALTA: A BRDF
//! Analysis Library"): a head of lines `#KEY value`, of which `#DIM nx ny` and `#PARAM_IN name` are needed,
//! and rows of nx coordinates and ny values. `#VS` says how many confidence numbers follow each value; they
//! are read and dropped. Other comments pass.

use super::{number, text};
use crate::{FormatError, Limits};
use std::path::Path;

/// The rows of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct AltaTable {
    /// Name of the coordinates, such as `RUSIN_TH_TD_PD`.
    pub input: String,
    /// Name of what the values are, such as `INV_STERADIAN`; empty where the file does not say.
    pub output: String,
    /// Coordinates and values in a row.
    pub dimensions: [usize; 2],
    /// Rows: coordinates, then values.
    pub rows: Vec<Vec<f64>>,
}

/// More numbers than a row ever has.
const MAX_COLUMNS: usize = 4096;

/// Decodes a text of ALTA's that lies in memory; `name` is for messages. Every number is finite.
pub fn decode_alta(name: &Path, bytes: &[u8], limits: &Limits) -> Result<AltaTable, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    let (mut dimensions, mut input, mut output, mut confidence) = (None, None, String::new(), Vec::new());
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (i, line) in text(name, bytes, limits)?.lines().enumerate() {
        let line = line.trim();
        if let Some(head) = line.strip_prefix('#') {
            let mut words = head.split_whitespace();
            let key = words.next().unwrap_or_default();
            let word = |word: Option<&str>| word.unwrap_or_default().to_owned();
            match key {
                "DIM" => {
                    dimensions = Some(pair(words).ok_or_else(|| {
                        invalid(format!("line {}: '#DIM' needs two small numbers, as in #DIM 3 1", i + 1))
                    })?)
                }
                "PARAM_IN" => input = Some(word(words.next())),
                "PARAM_OUT" => output = word(words.next()),
                "VS" => confidence = words.filter_map(|w| w.parse().ok().filter(|n| *n <= 4)).collect(),
                _ => {}
            }
            continue;
        }
        if line.is_empty() {
            continue;
        }
        let Some([nx, ny]) = dimensions else {
            return Err(invalid(format!("line {}: numbers before a line '#DIM nx ny'", i + 1)));
        };
        let mut row: Vec<f64> =
            line.split_whitespace().map(|w| number(name, i + 1, w)).collect::<Result<_, _>>()?;
        // One confidence for all values, or one each.
        let more: usize = match confidence.as_slice() {
            [all] => all * ny,
            each => each.iter().sum(),
        };
        if row.len() != nx + ny && row.len() != nx + ny + more {
            return Err(invalid(format!("line {}: {} numbers instead of {}", i + 1, row.len(), nx + ny)));
        }
        row.truncate(nx + ny);
        rows.push(row);
    }
    let dimensions = dimensions.ok_or_else(|| invalid("has no line '#DIM nx ny'".into()))?;
    let input =
        input.ok_or_else(|| invalid("has no line '#PARAM_IN', which names the coordinates".into()))?;
    if rows.is_empty() {
        return Err(invalid("holds no rows of numbers".into()));
    }
    Ok(AltaTable { input, output, dimensions, rows })
}

/// Two numbers of columns.
fn pair<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<[usize; 2]> {
    let mut next = || words.next()?.parse().ok().filter(|n| (1..=MAX_COLUMNS).contains(n));
    Some([next()?, next()?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit::Mutator;

    fn read(text: &str) -> Result<AltaTable, String> {
        decode_alta(Path::new("a.alta"), text.as_bytes(), &Limits::default()).map_err(|e| e.to_string())
    }

    const WHOLE: &str = "# made by hand\n#DIM 1 2\n#VS 1\n#PARAM_IN COS_TH\n#PARAM_OUT INV_STERADIAN\n\
                         1 .5 .25 .1 .1\n\n.5 .4 .2\n";

    #[test]
    fn rows_and_faults() {
        let table = read(WHOLE).expect("valid");
        assert_eq!((table.input.as_str(), table.output.as_str()), ("COS_TH", "INV_STERADIAN"));
        assert_eq!((table.dimensions, table.rows), ([1, 2], vec![vec![1.0, 0.5, 0.25], vec![0.5, 0.4, 0.2]]));
        for (text, part) in [
            ("", "empty"),
            ("1 2\n", "line 1: numbers before"),
            ("#DIM 1\n", "needs two small numbers"),
            ("#DIM 1 99999999999999999999\n", "needs two small numbers"),
            ("#DIM 1 1\n1 2\n", "no line '#PARAM_IN'"),
            ("#PARAM_IN COS_TH\n", "no line '#DIM nx ny'"),
            ("#DIM 1 1\n#PARAM_IN COS_TH\n", "no rows"),
            ("#DIM 1 1\n#PARAM_IN COS_TH\n1 2 3\n", "line 3: 3 numbers instead of 2"),
            ("#DIM 1 1\n#PARAM_IN COS_TH\n1 NaN\n", "'NaN'"),
        ] {
            let e = read(text).expect_err(text);
            assert!(e.contains(part) && e.starts_with("a.alta: "), "{text}: {e}");
        }
        let mut damage = Mutator::new(6);
        for _ in 0..20_000 {
            let bytes = damage.damage(WHOLE.as_bytes(), b"-1 nan 1e39\n#VS 18446744073709551615 3\n");
            let _ = decode_alta(Path::new("a.alta"), &bytes, &Limits::default());
        }
    }
}

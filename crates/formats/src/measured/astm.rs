//! Measurements in the manner of ASTM E1392 (`.astm`), as Cornell and ALTA write them: lines `KEY value`, of
//! which `NUM_POINTS n` and, last, `VARS name,name,…` are needed, then n rows of comma-separated numbers, one
//! per name.

use super::{number, text};
use crate::{FormatError, Limits};
use std::path::Path;
use steradian_base::brief;

/// The rows of an `.astm` file.
#[derive(Debug, Clone, PartialEq)]
pub struct AstmTable {
    /// Names of the columns, as `VARS` lists them.
    pub variables: Vec<String>,
    /// Rows of as many numbers.
    pub rows: Vec<Vec<f64>>,
}

/// More columns than a spectrum has.
const MAX_VARIABLES: usize = 4096;

/// Decodes an `.astm` file that lies in memory; `name` is for messages. Every number is finite.
pub fn decode_astm(name: &Path, bytes: &[u8], limits: &Limits) -> Result<AstmTable, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    let mut lines = text(name, bytes, limits)?.lines().map(str::trim).enumerate();
    let mut points = None;
    let variables: Vec<String> = loop {
        let Some((i, line)) = lines.next() else {
            return Err(invalid("has no line 'VARS', which names the columns".into()));
        };
        let (key, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match key {
            "NUM_POINTS" => points = Some((i + 1, value.trim())),
            "VARS" => break value.split(',').map(|v| v.trim().to_owned()).collect(),
            _ => {}
        }
    };
    if variables.len() > MAX_VARIABLES || variables.iter().any(String::is_empty) {
        return Err(invalid(format!("its line 'VARS' names {} columns", variables.len())));
    }
    let Some((line, count)) = points else {
        return Err(invalid("has no line 'NUM_POINTS' before 'VARS'".into()));
    };
    let count: usize = count
        .parse()
        .map_err(|_| invalid(format!("line {line}: '{}' is no number of points", brief(count))))?;
    let mut rows = Vec::new();
    for (i, line) in lines.filter(|l| !l.1.is_empty()) {
        if rows.len() == count {
            return Err(invalid(format!("line {}: more rows than the {count} of NUM_POINTS", i + 1)));
        }
        let words = line.split(|c: char| c == ',' || c.is_whitespace()).filter(|w| !w.is_empty());
        let row: Vec<f64> = words.map(|w| number(name, i + 1, w)).collect::<Result<_, _>>()?;
        if row.len() != variables.len() {
            let why = format!("line {}: {} numbers for {} columns", i + 1, row.len(), variables.len());
            return Err(invalid(why));
        }
        rows.push(row);
    }
    if rows.len() < count || rows.is_empty() {
        return Err(invalid(format!("is cut: {} of {count} rows", rows.len())));
    }
    Ok(AstmTable { variables, rows })
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_testkit::Mutator;

    fn read(text: &str) -> Result<AstmTable, String> {
        decode_astm(Path::new("a.astm"), text.as_bytes(), &Limits::default()).map_err(|e| e.to_string())
    }

    const WHOLE: &str = "ID\tpaint\r\nNUM_POINTS 2\nVARS theta_i,theta_s,phi_s,R,G,B\n\
                         .1,.2,.3,1,2,3\n.4, .5, .6, 4, 5, 6\n";

    #[test]
    fn rows_and_faults() {
        let table = read(WHOLE).expect("valid");
        assert_eq!(table.variables, ["theta_i", "theta_s", "phi_s", "R", "G", "B"]);
        assert_eq!(table.rows[1], [0.4, 0.5, 0.6, 4.0, 5.0, 6.0]);
        for (text, part) in [
            ("", "empty"),
            ("ID x\n", "no line 'VARS'"),
            ("VARS a,b\n1,2\n", "no line 'NUM_POINTS'"),
            ("NUM_POINTS two\nVARS a\n1\n", "line 1: 'two'"),
            ("NUM_POINTS 1\nVARS a,,b\n1,2,3\n", "names 3 columns"),
            ("NUM_POINTS 2\nVARS a\n1\n", "cut: 1 of 2 rows"),
            ("NUM_POINTS 1\nVARS a\n1\n2\n", "line 4: more rows"),
            ("NUM_POINTS 1\nVARS a,b\n1\n", "line 3: 1 numbers for 2"),
            ("NUM_POINTS 1\nVARS a\ninf\n", "'inf'"),
        ] {
            let e = read(text).expect_err(text);
            assert!(e.contains(part) && e.starts_with("a.astm: "), "{text}: {e}");
        }
        let mut damage = Mutator::new(5);
        for _ in 0..20_000 {
            let bytes = damage.damage(WHOLE.as_bytes(), b"-1,nan 1e39\n");
            let _ = decode_astm(Path::new("a.astm"), &bytes, &Limits::default());
        }
    }
}

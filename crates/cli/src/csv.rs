//! Tables of points and directions: vectors out of columns, results into new ones.

use crate::failure::Failure;
use glam::DVec3;
use std::io::Read;
use std::path::Path;
use steradian_formats::{CsvTable, FormatError, Limits, decode_csv, read_csv};

/// Reads the table `path`; `-` is standard input.
pub fn read(path: &Path, limits: &Limits) -> Result<CsvTable, Failure> {
    if path != Path::new("-") {
        return Ok(read_csv(path, limits)?);
    }
    let mut bytes = Vec::new();
    let name = Path::new("standard input");
    let read = std::io::stdin().take(limits.max_memory.saturating_add(1)).read_to_end(&mut bytes);
    read.map_err(|e| Failure::input(format!("standard input: {e}")))?;
    limits.memory(name, bytes.len() as u128, bytes.len() as u64)?;
    Ok(decode_csv(name, &bytes, limits)?)
}

/// Vectors of three columns; `None` where none of the columns exists.
pub fn optional(table: &CsvTable, columns: [&str; 3]) -> Result<Option<Vec<DVec3>>, FormatError> {
    if columns.iter().all(|c| table.column(c).is_none()) {
        return Ok(None);
    }
    Ok(Some(table.vectors(columns)?.into_iter().map(DVec3::from).collect()))
}

/// Vectors of three columns made unit; a zero one is an error that names its line.
pub fn unit(table: &CsvTable, columns: [&str; 3]) -> Result<Vec<DVec3>, FormatError> {
    let normalised = |(row, v): (usize, [f64; 3])| {
        let v = DVec3::from(v);
        // Scaled first, so that neither large nor small components leave the range of doubles when squared.
        let scale = v.abs().max_element();
        (v / scale)
            .try_normalize()
            .filter(|_| scale > 0.0)
            .ok_or_else(|| table.fault(row, format!("the vector {} is zero", columns.join(","))))
    };
    table.vectors(columns)?.into_iter().enumerate().map(normalised).collect()
}

/// Unit vectors of three columns; `None` where none of the columns exists.
pub fn optional_unit(table: &CsvTable, columns: [&str; 3]) -> Result<Option<Vec<DVec3>>, FormatError> {
    if columns.iter().all(|c| table.column(c).is_none()) { Ok(None) } else { unit(table, columns).map(Some) }
}

/// The table as text.
pub fn text(table: &CsvTable) -> String {
    let mut bytes = Vec::new();
    // Writing to memory cannot fail, and what was read as UTF-8 stays it.
    let _ = table.encode(&mut bytes);
    String::from_utf8(bytes).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_become_unit_and_zero_names_its_line() {
        let parse = |t: &str| decode_csv(Path::new("p.csv"), t.as_bytes(), &Limits::default()).unwrap();
        let good = parse("x,y,z\n0,0,2\n1e300,0,0\n1e-300,0,0\n");
        assert_eq!(unit(&good, ["x", "y", "z"]).unwrap(), [DVec3::Z, DVec3::X, DVec3::X]);
        let e = unit(&parse("x,y,z\n1,0,0\n0,0,0\n"), ["x", "y", "z"]).unwrap_err().to_string();
        assert!(e.contains("p.csv: line 3: the vector x,y,z is zero"), "{e}");
        assert!(optional(&good, ["a", "b", "c"]).unwrap().is_none());
        assert!(optional(&good, ["x", "y", "w"]).is_err());
    }
}

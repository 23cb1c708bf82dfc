//! Tables of points and directions: vectors out of columns.

use glam::DVec3;
use steradian_formats::{CsvTable, FormatError};

/// Vectors of three columns; `None` where none of the columns exists.
pub(crate) fn optional(table: &CsvTable, columns: [&str; 3]) -> Result<Option<Vec<DVec3>>, FormatError> {
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
pub(crate) fn optional_unit(table: &CsvTable, columns: [&str; 3]) -> Result<Option<Vec<DVec3>>, FormatError> {
    if columns.iter().all(|c| table.column(c).is_none()) { Ok(None) } else { unit(table, columns).map(Some) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use steradian_formats::{Limits, decode_csv};

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

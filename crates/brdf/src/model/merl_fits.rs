//! The published tables of fits to the MERL materials: CSV, one row per material, first column its name.

use crate::SpecError;
use std::sync::LazyLock;
use steradian_base::nearest;

/// One table.
pub(crate) struct Table {
    rows: Vec<(&'static str, Vec<f64>)>,
}

impl Table {
    /// Columns that are not numbers (names) are left out.
    fn new(csv: &'static str) -> Self {
        let row = |line: &'static str| {
            let mut fields = line.split(',');
            let name = fields.next().unwrap_or_default();
            (name, fields.filter_map(|f| f.trim().parse().ok()).collect())
        };
        Self { rows: csv.lines().skip(1).filter(|l| !l.is_empty()).map(row).collect() }
    }

    /// The materials.
    pub fn names(&self) -> Vec<&'static str> {
        self.rows.iter().map(|r| r.0).collect()
    }

    /// The row of a material.
    pub fn find(&self, model: &'static str, name: Option<&str>) -> Result<(&'static str, &[f64]), SpecError> {
        let wanted = name.unwrap_or_default().to_ascii_lowercase().replace('_', "-");
        match self.rows.iter().find(|r| r.0 == wanted) {
            Some((name, values)) => Ok((name, values)),
            None => {
                let available = self.names();
                let nearest = nearest(&wanted, &available);
                Err(SpecError::UnknownSet { model, name: wanted, nearest, available })
            }
        }
    }
}

/// Bagher, Soler, Holzschuch 2012.
pub(crate) static SGD: LazyLock<Table> =
    LazyLock::new(|| Table::new(include_str!("../../data/sgd_merl_bagher2012.csv")));

/// Löw, Kronander, Ynnerman, Unger 2012.
pub(crate) static ABC: LazyLock<Table> =
    LazyLock::new(|| Table::new(include_str!("../../data/abc_merl_low2012.csv")));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_tables_are_whole() {
        for (table, columns) in [(&SGD, 36), (&ABC, 9)] {
            assert_eq!(table.rows.len(), 100);
            for (name, values) in &table.rows {
                assert!(
                    values.len() == columns && values.iter().all(|v| v.is_finite()),
                    "{name} {}",
                    values.len()
                );
            }
        }
        let sorted = |t: &Table| {
            let mut names = t.names();
            names.sort_unstable();
            names
        };
        assert_eq!(sorted(&SGD), sorted(&ABC));
    }
}

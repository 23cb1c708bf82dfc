//! Any reflectance as a table of measurements.

use crate::{Error, Session};
use std::path::Path;
use steradian_brdf::measured::{csv, merl};
use steradian_formats::{write_csv, write_merl};

/// Extensions of files of measurements that are written.
pub const MEASUREMENTS: [&str; 2] = ["binary", "csv"];

impl Session {
    /// The reflectance of a spec as MERL's `.binary`, whose cells above the horizon hold f at their centres,
    /// or as scattered measurements in `.csv`.
    pub fn tabulate(&mut self, spec: &str, path: &Path) -> Result<(), Error> {
        let brdf = self.brdf(spec)?;
        self.check()?;
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            return Ok(write_csv(path, &csv::tabulate(&*brdf, path))?);
        }
        if !brdf.is_isotropic() {
            return Err(Error::usage(format!(
                "{spec} is anisotropic: MERL's tables hold isotropic reflectance; .csv holds any"
            )));
        }
        let table = merl::tabulate(&*brdf, &self.task)?;
        Ok(write_merl(path, &table)?)
    }
}

//! Any isotropic reflectance as a table of measurements.

use crate::{Error, Session};
use std::path::Path;
use steradian_brdf::measured::merl;
use steradian_formats::write_merl;

/// Extensions of files of measurements that are written.
pub const MEASUREMENTS: [&str; 1] = ["binary"];

impl Session {
    /// The reflectance of a spec as MERL's `.binary`: cells above the horizon hold f at their centres.
    pub fn tabulate(&mut self, spec: &str, path: &Path) -> Result<(), Error> {
        let brdf = self.brdf(spec)?;
        if !brdf.is_isotropic() {
            return Err(Error::usage(format!(
                "{spec} is anisotropic: MERL's tables hold isotropic reflectance"
            )));
        }
        let table = merl::tabulate(&*brdf, &self.task)?;
        Ok(write_merl(path, &table)?)
    }
}

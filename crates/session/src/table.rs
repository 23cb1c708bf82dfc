//! Tables of the split sum's second factor, with what they err by.

use crate::{Error, Session};
use steradian_brdf::dfg::{Layout, Lut};

/// Bound of the quadrature's absolute error, which the tables' tests hold it to.
const QUADRATURE: f64 = 1e-4;
/// Points per axis at which lookups are compared with exact values.
const POINTS: usize = 24;

/// A table with its errors.
pub struct LookupTable {
    /// The table.
    pub lut: Lut,
    /// Bound of the absolute error of its texels.
    pub quadrature: f64,
    /// What bilinear lookups err by, at the worst point.
    pub worst: f64,
    /// The same over all points, root mean square.
    pub rms: f64,
    /// At so many points.
    pub points: usize,
}

impl Session {
    /// A table of `size` texels a side.
    pub fn lookup_table(&mut self, layout: Layout, size: usize) -> Result<LookupTable, Error> {
        let lut = Lut::new(layout, size, &self.task)?;
        let (worst, rms) = lut.interpolation_error(POINTS);
        self.task.check()?;
        self.note_error(format!(
            "quadrature below {QUADRATURE:.0e}; bilinear lookup rms {rms:.1e}, worst {worst:.1e}"
        ));
        Ok(LookupTable { lut, quadrature: QUADRATURE, worst, rms, points: POINTS * POINTS })
    }
}

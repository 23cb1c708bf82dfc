//! Cost of a method: counted, and predicted.
//!
//! Ramamoorthi & Hanrahan 2002, 5.6: for S_L² texels of light and S_B² of the map the angular way costs W
//! S_L² S_B² (5.32), the frequency way F S_B² (5.29), and they meet at Phong's s* ~ S_L^{4/3} (5.33) if both
//! constants are the same. [`Model`] has constants of its own for each term.

use super::{Method, Shape, band_limit, reach};
use crate::Zonal;
use std::f64::consts::PI;
use steradian_sphere::Layout;

/// Work done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cost {
    /// Evaluations of the kernel, or of a table of it.
    pub kernel: u64,
    /// Texels or coefficients, red, green and blue, that were multiplied and added.
    pub taps: u64,
}

impl std::ops::Add for Cost {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { kernel: self.kernel + other.kernel, taps: self.taps + other.taps }
    }
}

/// One map to be made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Problem {
    /// Rows of the lat-long light; it has twice as many columns.
    pub rows: usize,
    /// Texels of the map.
    pub texels: usize,
    /// Rows of the map, or of the lat-long one that other layouts are looked up in: four a band.
    pub map: usize,
    /// The highest band that the kernel needs.
    pub band: usize,
    /// The angle within which the kernel counts, radians.
    pub reach: f64,
}

impl Problem {
    /// Filtering `rows` rows of light with `kernel` into a map, to a tolerance.
    pub fn new(rows: usize, (layout, width, height): Shape, kernel: &dyn Zonal, tolerance: f64) -> Self {
        let band = band_limit(&kernel.coefficients(4 * rows), 0.2 * tolerance);
        let texels = layout.faces() * width * height;
        let map = if layout == Layout::LatLong { height } else { (4 * band).max((texels / 2).isqrt()) };
        Self { rows, texels, map, band, reach: reach(kernel, 0.2 * tolerance) }
    }

    /// The part W of the sphere within reach (Ramamoorthi & Hanrahan 2002, 5.30).
    pub fn part(&self) -> f64 {
        0.5 * (1.0 - self.reach.cos())
    }
}

/// Nanoseconds of one core for each unit of work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    /// A texel of the light under a texel of the map, direct sum.
    pub pair: f64,
    /// A row of the light under a texel of the map.
    pub row: f64,
    /// A coefficient in a row of light or map: the Legendre part of a transform.
    pub legendre: f64,
    /// A texel of the light through the FFT of its row, and a texel of the map looked up.
    pub texel: f64,
    /// A frequency of a pair of rows.
    pub frequency: f64,
}

impl Default for Model {
    /// Measured by the bench `table_5_4` on one core of a server with AVX2.
    fn default() -> Self {
        Self { pair: 5.0, row: 100.0, legendre: 3.0, texel: 40.0, frequency: 10.0 }
    }
}

impl Model {
    /// Predicted nanoseconds on one core, light prepared anew; `None` for ways that do not meet a tolerance.
    pub fn predict(&self, method: Method, p: &Problem) -> Option<f64> {
        let (rows, texels, band) = (p.rows as f64, p.texels as f64, p.band as f64);
        let light = 2.0 * rows * rows;
        let map = p.map as f64;
        let seen = rows * (2.0 * p.reach / PI).min(1.0);
        match method {
            Method::Brute => Some(self.pair * light * texels),
            Method::TruncatedAngular => {
                Some(texels * (self.pair * light * p.part() + self.row * (seen + 1.0)))
            }
            Method::Frequency => {
                Some(self.legendre * band * band * (rows + map) + self.texel * (light + texels))
            }
            Method::LatLongAngular => {
                Some(self.frequency * map * seen * band + self.texel * (light + texels))
            }
            _ => None,
        }
    }

    /// The cheaper of the angular way and the frequency way.
    pub fn choose(&self, p: &Problem) -> Method {
        let time = |m| self.predict(m, p).unwrap_or(f64::INFINITY);
        let pick = |a, b| if time(b) < time(a) { b } else { a };
        [Method::LatLongAngular, Method::TruncatedAngular].into_iter().fold(Method::Frequency, pick)
    }
}

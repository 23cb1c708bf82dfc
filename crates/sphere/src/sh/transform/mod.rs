//! Forward and inverse transforms on lat-long grids in O(order · samples): an FFT along each ring, then a
//! Legendre sum over rings for each m.
//!
//! The image's poles are on y and the basis' on z: the transform works with Y(x, z, y) and exchanges y and z
//! afterwards, which is exact and small beside the rest. Rings are taken in north–south pairs, since
//! P̄_lm(−x) = (−1)^{l+m} P̄_lm(x); the three channels share the Legendre recursion; sums are f64 in a fixed
//! order whatever the number of threads.

mod fourier;
mod kernel;
mod rings;

use super::rotation::exchange_yz;
use super::{ShRgb, index};
use fourier::Fourier;
use kernel::{Analysis, Row, Scratch, Synthesis};
use rayon::prelude::*;
pub use rings::Grid;
use rings::Rings;

/// Row pairs that are in memory as spectra at a time.
const CHUNK: usize = 64;

/// A sample of an image plane.
pub trait Sample: Copy + Send + Sync {
    /// As f64.
    fn to_f64(self) -> f64;
    /// The nearest representable value.
    fn from_f64(x: f64) -> Self;
}

impl Sample for f32 {
    fn to_f64(self) -> f64 {
        self.into()
    }
    fn from_f64(x: f64) -> Self {
        x as Self
    }
}

impl Sample for f64 {
    fn to_f64(self) -> f64 {
        self
    }
    fn from_f64(x: f64) -> Self {
        x
    }
}

/// A plan for transforms between `width` × `height` lat-long samples and coefficients up to `order`.
///
/// Column i stands at φ = −π + 2π(i+½)/width with φ = atan2(z, x), rows at [`ShTransform::cos_theta`] with
/// cos θ = y, as in lat-long images. Any order fits any grid: what the samples cannot tell apart is aliased.
pub struct ShTransform {
    order: usize,
    grid: Grid,
    rings: Rings,
    fourier: Fourier,
}

impl ShTransform {
    /// Plans a transform.
    pub fn new(order: usize, width: usize, height: usize, grid: Grid) -> Self {
        Self {
            order,
            grid,
            rings: Rings::new(grid, height, order),
            fourier: Fourier::new(order, width, height),
        }
    }

    /// Highest band.
    pub fn order(&self) -> usize {
        self.order
    }

    /// cos θ of each row, from +1 (+Y) downwards.
    pub fn cos_theta(&self) -> Vec<f64> {
        self.rings.rows()
    }

    /// Is [`ShTransform::analyze`] exact for every function of band `order`?
    pub fn is_exact(&self) -> bool {
        let (width, height) = (self.fourier.width, self.fourier.height);
        let rows = match self.grid {
            Grid::Equirectangular | Grid::ClenshawCurtis => 2 * self.order + 1,
            Grid::GaussLegendre => self.order + 1,
            Grid::Cells | Grid::ExactCells => return false,
        };
        width > 2 * self.order && height >= rows
    }

    /// Analysis: coefficients ∫ f Y by the grid's quadrature; planes are row-major.
    ///
    /// # Panics
    /// If a plane is not `width·height` long.
    pub fn analyze<S: Sample>(&self, planes: [&[S]; 3]) -> ShRgb {
        let area = self.fourier.width * self.fourier.height;
        assert!(planes.iter().all(|p| p.len() == area), "planes of width·height samples");
        let mut columns = self.columns();
        if area > 0 {
            for first in (0..self.rings.pairs()).step_by(CHUNK) {
                let pairs = first..self.rings.pairs().min(first + CHUNK);
                let spectra = self.fourier.forward(planes, pairs.clone(), self.grid.sinc());
                columns.par_iter_mut().enumerate().for_each_init(Scratch::default, |scratch, (m, column)| {
                    let rings = self.rings.of_pairs(pairs.clone());
                    let (order, rows) = (self.order, &spectra[..]);
                    steradian_simd::run(Analysis { m, order, rings, rows, column, scratch });
                });
            }
        }
        let mut sh = self.gather(&columns);
        exchange_yz(self.order, sh.c.each_mut().map(Vec::as_mut_slice));
        sh
    }

    /// Synthesis: the function of `sh` (its bands above the plan's order left out) at every sample.
    ///
    /// # Panics
    /// If a plane is not `width·height` long, or the plan is one of cells, which only analyse.
    pub fn synthesize<S: Sample>(&self, sh: &ShRgb, mut planes: [&mut [S]; 3]) {
        let (width, height) = (self.fourier.width, self.fourier.height);
        assert!(planes.iter().all(|p| p.len() == width * height), "planes of width·height samples");
        assert!(self.rings.per_row == 1, "exact cells are integrals, not samples");
        let columns = self.scatter(sh);
        if width * height == 0 {
            return;
        }
        for first in (0..self.rings.pairs()).step_by(CHUNK) {
            let pairs = first..self.rings.pairs().min(first + CHUNK);
            let mut spectra = vec![[0.0; 16]; pairs.len() * columns.len()];
            let parts = spectra.par_chunks_mut(pairs.len()).zip(&columns).enumerate();
            parts.for_each_init(Scratch::default, |scratch, (m, (rows, column))| {
                let rings = self.rings.of_pairs(pairs.clone());
                steradian_simd::run(Synthesis { m, order: self.order, rings, rows, column, scratch });
            });
            self.fourier.backward(&spectra, pairs, &mut planes);
        }
    }

    /// One column per m of rows (c, s) × RGB for l = m…order.
    fn columns(&self) -> Vec<Vec<Row>> {
        (0..=self.order).map(|m| vec![[0.0; 8]; self.order + 1 - m]).collect()
    }

    fn gather(&self, columns: &[Vec<Row>]) -> ShRgb {
        let mut sh = ShRgb::zero(self.order);
        for (m, column) in columns.iter().enumerate() {
            for (l, row) in (m..).zip(column) {
                for (k, c) in sh.c.iter_mut().enumerate() {
                    c[index(l, m as isize)] = row[2 * k];
                    if m > 0 {
                        c[index(l, -(m as isize))] = row[2 * k + 1];
                    }
                }
            }
        }
        sh
    }

    fn scatter(&self, sh: &ShRgb) -> Vec<Vec<Row>> {
        let order = self.order.min(sh.order);
        let mut c = sh.c.each_ref().map(|c| c[..super::count(order)].to_vec());
        exchange_yz(order, c.each_mut().map(Vec::as_mut_slice));
        let mut columns = self.columns();
        for (m, column) in columns.iter_mut().enumerate().take(order + 1) {
            for (l, row) in (m..=order).zip(column) {
                for (k, c) in c.iter().enumerate() {
                    row[2 * k] = c[index(l, m as isize)];
                    row[2 * k + 1] = if m > 0 { c[index(l, -(m as isize))] } else { 0.0 };
                }
            }
        }
        columns
    }
}

#[cfg(test)]
mod tests;

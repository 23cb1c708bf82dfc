//! Forward and inverse transforms on lat-long grids in O(order · samples): an FFT along each ring, then a
//! Legendre sum over rings for each m.
//!
//! The image's poles are on y and the basis' on z: the transform works with Y(x, z, y) and exchanges y and z
//! afterwards, which is exact and small beside the rest. Rings are taken in north–south pairs, since
//! P̄_lm(−x) = (−1)^{l+m} P̄_lm(x); the three channels share the Legendre recursion; sums are f64 in a fixed
//! order whatever the number of threads.

mod analysis;
mod batch;
mod butterfly;
mod columns;
mod fold;
mod fourier;
mod fused;
mod kernel;
mod latitude;
mod passes;
mod pool;
mod recursion;
mod rings;
mod rows;
mod sample;
mod stored;
mod synthesis;

use super::ShRgb;
use super::rotation::exchange_yz;
pub(super) use batch::Batch;
pub use columns::ColumnsRgb;
use columns::{bands, scatter};
pub(super) use fourier::Lanes;
use fourier::{analysis_phase, synthesis_phase};
pub(super) use kernel::{Real, aligned};
use passes::Work;
use pool::Pool;
use recursion::{FindStarts, Starts, Step, steps};
pub use rings::Grid;
use rings::Rings;
use sample::Planes;
pub(in crate::sh) use sample::PlanesMut;
pub use sample::Sample;
use std::f64::consts::PI;
use std::mem::take;
use std::sync::{Mutex, PoisonError};
use steradian_parallel::prelude::*;

/// Bytes up to which a plan keeps the recursion's constants and starting values.
const KEPT: usize = 128 << 20;

/// A plan for transforms between `width` × `height` lat-long samples and coefficients up to `order`.
///
/// Column i stands at φ = −π + 2π(i+½)/width with φ = atan2(z, x), rows at [`ShTransform::cos_theta`] with
/// cos θ = y, as in lat-long images. Any order fits any grid: what the samples cannot tell apart is aliased.
pub struct ShTransform {
    order: usize,
    width: usize,
    height: usize,
    grid: Grid,
    rings: Rings,
    /// Per m, unless that takes too much memory.
    kept: Vec<(Vec<Step>, Starts)>,
    /// Of each m: [`analysis_phase`], [`synthesis_phase`].
    phases: Vec<[[f64; 2]; 2]>,
    work: AnyWork,
    /// The last coefficients that were put in order.
    columns: Mutex<ColumnsRgb>,
}

/// How sums are kept; Legendre functions are computed in f64 either way.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// f64: a round trip changes coefficients by about 1e-13 of their size.
    #[default]
    Double,
    /// f32 sums and FFTs, for images: about 1e-6, in roughly two thirds of the time.
    Image,
}

enum AnyWork {
    Double(Work<f64>),
    Image(Work<f32>),
}

impl ShTransform {
    /// Plans a transform in [`Precision::Double`].
    pub fn new(order: usize, width: usize, height: usize, grid: Grid) -> Self {
        Self::with_precision(order, width, height, grid, Precision::Double)
    }

    /// Plans a transform.
    pub fn with_precision(
        order: usize,
        width: usize,
        height: usize,
        grid: Grid,
        precision: Precision,
    ) -> Self {
        let mut plan = Self {
            order,
            width,
            height,
            grid,
            rings: Rings::new(grid, height, order),
            kept: Vec::new(),
            phases: (0..=order)
                .map(|m| [analysis_phase(m, width, grid.sinc()), synthesis_phase(m, width)])
                .collect(),
            columns: Mutex::default(),
            work: match precision {
                Precision::Double => AnyWork::Double(Work::new(order, width, height, grid)),
                Precision::Image => AnyWork::Image(Work::new(order, width, height, grid)),
            },
        };
        let bytes = (order + 1) * (24 * plan.rings.cos.len() + 10 * order);
        if bytes <= KEPT {
            plan.kept = (0..=order).into_par_iter().map(|m| plan.tables(m)).collect();
        }
        plan
    }

    fn tables(&self, m: usize) -> (Vec<Step>, Starts) {
        let (order, steps) = (self.order, steps(m, self.order));
        let negligible = match self.work {
            AnyWork::Double(_) => 2f64.powi(-60),
            AnyWork::Image(_) => 2f64.powi(-40),
        };
        let starts =
            steradian_simd::run(FindStarts { m, order, steps: &steps, rings: &self.rings, negligible });
        (steps, starts)
    }

    /// Multiplies what synthesis makes of each order m.
    pub(super) fn scale_orders(&mut self, factor: impl Fn(usize) -> f64) {
        for (m, phases) in self.phases.iter_mut().enumerate() {
            phases[1] = phases[1].map(|p| p * factor(m));
        }
    }

    /// Highest band.
    pub fn order(&self) -> usize {
        self.order
    }

    /// cos θ of each row, of cells at its middle, from +1 (+Y) downwards.
    pub fn cos_theta(&self) -> Vec<f64> {
        if self.grid == Grid::Cells {
            return (0..self.height).map(|j| (PI * (j as f64 + 0.5) / self.height as f64).cos()).collect();
        }
        self.rings.rows()
    }

    /// Is [`ShTransform::analyze`] exact for every function of band `order`?
    pub fn is_exact(&self) -> bool {
        let (width, height) = (self.width, self.height);
        let rows = match self.grid {
            Grid::Equirectangular | Grid::ClenshawCurtis => 2 * self.order + 1,
            Grid::GaussLegendre => self.order + 1,
            Grid::Cells => return false,
        };
        width > 2 * self.order && height >= rows
    }

    /// Analysis: coefficients ∫ f Y by the grid's quadrature; planes are row-major.
    ///
    /// # Panics
    /// If a plane is not `width·height` long.
    pub fn analyze<S: Sample>(&self, planes: [&[S]; 3]) -> ShRgb {
        let mut sh = ShRgb::zero(self.order);
        self.to_polar(S::planes(planes), &mut sh);
        exchange(&mut sh);
        sh
    }

    /// [`ShTransform::analyze`] with the basis' pole on the image's: coefficients of Y(x, z, y). Products per
    /// band do not care for the pole, so that a convolution needs no other basis.
    ///
    /// # Panics
    /// If a plane is not `width·height` long.
    pub fn analyze_polar<S: Sample>(&self, planes: [&[S]; 3]) -> ShRgb {
        let mut sh = ShRgb::zero(self.order);
        self.to_polar(S::planes(planes), &mut sh);
        sh
    }

    /// [`ShTransform::analyze_polar`] into the memory of earlier coefficients, whatever they are.
    ///
    /// # Panics
    /// If a plane is not `width·height` long.
    pub fn analyze_polar_into<S: Sample>(&self, planes: [&[S]; 3], sh: &mut ShRgb) {
        self.to_polar(S::planes(planes), sh);
    }

    fn to_polar(&self, planes: Planes<'_>, sh: &mut ShRgb) {
        sh.order = self.order;
        sh.c.iter_mut().for_each(|c| c.resize(super::count(self.order), 0.0));
        let mut columns = take(&mut *self.columns.lock().unwrap_or_else(PoisonError::into_inner));
        self.to_columns(planes, &mut columns);
        self.each(bands(sh), &Pool::default(), |(), _, (bands, planes)| columns.gather(bands, planes));
        *self.columns.lock().unwrap_or_else(PoisonError::into_inner) = columns;
    }

    /// [`ShTransform::analyze_polar`] in the transform's own order of coefficients, which saves an exchange;
    /// into the memory of `columns`, whatever they are.
    ///
    /// # Panics
    /// If a plane is not `width·height` long.
    pub fn analyze_columns<S: Sample>(&self, planes: [&[S]; 3], columns: &mut ColumnsRgb) {
        self.to_columns(S::planes(planes), columns);
    }

    fn to_columns(&self, planes: Planes<'_>, columns: &mut ColumnsRgb) {
        let area = self.width * self.height;
        assert!(planes.are_long(area), "planes of width·height samples");
        columns.renew(self.order);
        match (&self.work, planes) {
            _ if area == 0 => *columns = ColumnsRgb::zero(self.order),
            (AnyWork::Double(work), Planes::Single(planes)) => self.analyze_with(work, planes, columns),
            (AnyWork::Double(work), Planes::Double(planes)) => self.analyze_with(work, planes, columns),
            (AnyWork::Image(work), Planes::Single(planes)) => self.analyze_with(work, planes, columns),
            (AnyWork::Image(work), Planes::Double(planes)) => self.analyze_with(work, planes, columns),
        }
    }

    /// Synthesis: the function of `sh` (its bands above the plan's order left out) at every sample.
    ///
    /// # Panics
    /// If a plane is not `width·height` long, or the plan is one of cells, which only analyse.
    pub fn synthesize<S: Sample>(&self, sh: &ShRgb, planes: [&mut [S]; 3]) {
        let order = self.order.min(sh.order);
        let mut sh = ShRgb { order, c: sh.c.each_ref().map(|c| c[..super::count(order)].to_vec()) };
        exchange(&mut sh);
        self.polar_to(&sh, S::planes_mut(planes));
    }

    /// [`ShTransform::synthesize`] from coefficients of Y(x, z, y), see [`ShTransform::analyze_polar`].
    ///
    /// # Panics
    /// If a plane is not `width·height` long, or the plan is one of cells, which only analyse.
    pub fn synthesize_polar<S: Sample>(&self, sh: &ShRgb, planes: [&mut [S]; 3]) {
        self.polar_to(sh, S::planes_mut(planes));
    }

    fn polar_to(&self, sh: &ShRgb, planes: PlanesMut<'_>) {
        let mut columns = take(&mut *self.columns.lock().unwrap_or_else(PoisonError::into_inner));
        columns.renew(self.order);
        self.each(columns.tiles(), &Pool::default(), |(), tile, rows| scatter(sh, self.order, tile, rows));
        self.columns_to(&columns, &[], planes);
        *self.columns.lock().unwrap_or_else(PoisonError::into_inner) = columns;
    }

    /// Synthesis from coefficients in the transform's own order (bands above the plan's left out), each band
    /// multiplied with its factor: a convolution by a zonal kernel. Without factors they are all 1; bands
    /// beyond the last factor are left out.
    ///
    /// # Panics
    /// If a plane is not `width·height` long, or the plan is one of cells, which only analyse.
    pub fn synthesize_columns<S: Sample>(
        &self,
        columns: &ColumnsRgb,
        factors: &[f64],
        planes: [&mut [S]; 3],
    ) {
        self.columns_to(columns, factors, S::planes_mut(planes));
    }

    fn columns_to(&self, columns: &ColumnsRgb, factors: &[f64], planes: PlanesMut<'_>) {
        let area = self.width * self.height;
        assert!(planes.are_long(area), "planes of width·height samples");
        assert!(self.grid != Grid::Cells, "cells are integrals, not samples");
        match (&self.work, planes) {
            _ if area == 0 => {}
            (AnyWork::Double(w), PlanesMut::Single(p)) => self.synthesize_with(w, columns, factors, p),
            (AnyWork::Double(w), PlanesMut::Double(p)) => self.synthesize_with(w, columns, factors, p),
            (AnyWork::Image(w), PlanesMut::Single(p)) => self.synthesize_with(w, columns, factors, p),
            (AnyWork::Image(w), PlanesMut::Double(p)) => self.synthesize_with(w, columns, factors, p),
        }
    }
}

/// Exchanges y and z in all bands.
fn exchange(sh: &mut ShRgb) {
    exchange_yz(sh.order, sh.c.each_mut().map(Vec::as_mut_slice));
}

#[cfg(test)]
mod tests;

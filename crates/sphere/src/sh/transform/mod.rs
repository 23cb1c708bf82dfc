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
mod kernel;
mod pool;
mod recursion;
mod rings;
mod rows;
mod synthesis;

use super::ShRgb;
use super::rotation::exchange_yz;
use analysis::Analysis;
pub(super) use batch::Batch;
pub use columns::ColumnsRgb;
use columns::{bands, scatter};
use fold::Cells;
pub(super) use fourier::Lanes;
use fourier::{Buffers, Fourier, RowBlock, analysis_phase, synthesis_phase};
use kernel::{CELL, Part, Scratch};
pub(super) use kernel::{Real, aligned};
use pool::Pool;
use rayon::prelude::*;
use recursion::{FindStarts, Starts, Step, steps};
pub use rings::Grid;
use rings::{BLOCK, Rings};
use std::mem::take;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use synthesis::Synthesis;

/// Orders m whose cells of a block lie side by side, so that a block's spectra are met in long runs.
const SIDE: usize = 8;

/// Bytes of cells that are in memory at a time, about.
const CELLS: usize = 64 << 20;

/// Bytes up to which a plan keeps the recursion's constants and starting values.
const KEPT: usize = 128 << 20;

/// Legendre work (rings · order²) below which one thread is quicker than several.
const SERIAL: usize = 1 << 18;

/// A sample of an image plane.
pub trait Sample: Copy + Send + Sync {
    /// As f64.
    fn to_f64(self) -> f64;
    /// The nearest representable value.
    fn from_f64(x: f64) -> Self;
    /// The samples, if they are f32.
    fn singles(_: &[Self]) -> Option<&[f32]> {
        None
    }
    /// The samples, if they are f32.
    fn singles_mut(_: &mut [Self]) -> Option<&mut [f32]> {
        None
    }
    /// The samples, if they are f64.
    fn doubles(_: &[Self]) -> Option<&[f64]> {
        None
    }
    /// The samples, if they are f64.
    fn doubles_mut(_: &mut [Self]) -> Option<&mut [f64]> {
        None
    }
}

impl Sample for f32 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self.into()
    }
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x as Self
    }
    #[inline(always)]
    fn singles(x: &[Self]) -> Option<&[f32]> {
        Some(x)
    }
    #[inline(always)]
    fn singles_mut(x: &mut [Self]) -> Option<&mut [f32]> {
        Some(x)
    }
}

impl Sample for f64 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn doubles(x: &[Self]) -> Option<&[f64]> {
        Some(x)
    }
    #[inline(always)]
    fn doubles_mut(x: &mut [Self]) -> Option<&mut [f64]> {
        Some(x)
    }
}

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

/// What depends on the precision.
struct Work<T: Real> {
    fourier: Fourier<T>,
    /// The last transform's memory: fresh memory costs more than a pass over it.
    cells: Mutex<Vec<T>>,
    buffers: Pool<Buffers<T>>,
    scratch: Pool<Scratch<T>>,
}

impl<T: Real> Work<T> {
    fn new(order: usize, width: usize) -> Self {
        Self {
            fourier: Fourier::new(order, width),
            cells: Mutex::default(),
            buffers: Pool::default(),
            scratch: Pool::default(),
        }
    }

    fn take(&self) -> Vec<T> {
        take(&mut *self.cells.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn put_back(&self, cells: Vec<T>) {
        *self.cells.lock().unwrap_or_else(PoisonError::into_inner) = cells;
    }
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
                Precision::Double => AnyWork::Double(Work::new(order, width)),
                Precision::Image => AnyWork::Image(Work::new(order, width)),
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

    /// cos θ of each row, from +1 (+Y) downwards.
    pub fn cos_theta(&self) -> Vec<f64> {
        self.rings.rows()
    }

    /// Is [`ShTransform::analyze`] exact for every function of band `order`?
    pub fn is_exact(&self) -> bool {
        let (width, height) = (self.width, self.height);
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
        let mut sh = self.analyze_polar(planes);
        exchange_yz(self.order, sh.c.each_mut().map(Vec::as_mut_slice));
        sh
    }

    /// [`ShTransform::analyze`] with the basis' pole on the image's: coefficients of Y(x, z, y). Products per
    /// band do not care for the pole, so that a convolution needs no other basis.
    ///
    /// # Panics
    /// If a plane is not `width·height` long.
    pub fn analyze_polar<S: Sample>(&self, planes: [&[S]; 3]) -> ShRgb {
        let mut sh = ShRgb::zero(self.order);
        self.analyze_polar_into(planes, &mut sh);
        sh
    }

    /// [`ShTransform::analyze_polar`] into the memory of earlier coefficients, whatever they are.
    ///
    /// # Panics
    /// If a plane is not `width·height` long.
    pub fn analyze_polar_into<S: Sample>(&self, planes: [&[S]; 3], sh: &mut ShRgb) {
        sh.order = self.order;
        sh.c.iter_mut().for_each(|c| c.resize(super::count(self.order), 0.0));
        let mut columns = take(&mut *self.columns.lock().unwrap_or_else(PoisonError::into_inner));
        self.analyze_columns(planes, &mut columns);
        self.each(bands(sh), &Pool::default(), |(), _, (bands, planes)| columns.gather(bands, planes));
        *self.columns.lock().unwrap_or_else(PoisonError::into_inner) = columns;
    }

    /// [`ShTransform::analyze_polar`] in the transform's own order of coefficients, which saves an exchange;
    /// into the memory of `columns`, whatever they are.
    ///
    /// # Panics
    /// If a plane is not `width·height` long.
    pub fn analyze_columns<S: Sample>(&self, planes: [&[S]; 3], columns: &mut ColumnsRgb) {
        let area = self.width * self.height;
        assert!(planes.iter().all(|p| p.len() == area), "planes of width·height samples");
        columns.renew(self.order);
        match &self.work {
            _ if area == 0 => *columns = ColumnsRgb::zero(self.order),
            AnyWork::Double(work) => self.analyze_with(work, planes, columns),
            AnyWork::Image(work) => self.analyze_with(work, planes, columns),
        }
    }

    fn analyze_with<T: Real, S: Sample>(&self, work: &Work<T>, planes: [&[S]; 3], columns: &mut ColumnsRgb) {
        let mut buffer = work.take();
        for pairs in self.chunks() {
            let cells = self.forward(work, planes, pairs.clone(), &mut buffer);
            self.each(columns.split(), &work.scratch, |scratch, m, column| {
                if pairs.start == 0 {
                    column.fill([0.0; 8]);
                }
                let stride = (self.order + 1) * CELL;
                self.with_part(m, pairs.clone(), self.phases[m][0], |part| {
                    let cells = &cells[m * CELL..];
                    steradian_simd::run(Analysis { part, cells, stride, column, scratch });
                });
            });
        }
        work.put_back(buffer);
    }

    /// Synthesis: the function of `sh` (its bands above the plan's order left out) at every sample.
    ///
    /// # Panics
    /// If a plane is not `width·height` long, or the plan is one of exact cells, which only analyse.
    pub fn synthesize<S: Sample>(&self, sh: &ShRgb, planes: [&mut [S]; 3]) {
        let order = self.order.min(sh.order);
        let mut sh = ShRgb { order, c: sh.c.each_ref().map(|c| c[..super::count(order)].to_vec()) };
        exchange_yz(order, sh.c.each_mut().map(Vec::as_mut_slice));
        self.synthesize_polar(&sh, planes);
    }

    /// [`ShTransform::synthesize`] from coefficients of Y(x, z, y), see [`ShTransform::analyze_polar`].
    ///
    /// # Panics
    /// If a plane is not `width·height` long, or the plan is one of exact cells, which only analyse.
    pub fn synthesize_polar<S: Sample>(&self, sh: &ShRgb, planes: [&mut [S]; 3]) {
        let mut columns = take(&mut *self.columns.lock().unwrap_or_else(PoisonError::into_inner));
        columns.renew(self.order);
        self.each(columns.tiles(), &Pool::default(), |(), tile, rows| scatter(sh, self.order, tile, rows));
        self.synthesize_columns(&columns, &[], planes);
        *self.columns.lock().unwrap_or_else(PoisonError::into_inner) = columns;
    }

    /// Synthesis from coefficients in the transform's own order (bands above the plan's left out), each band
    /// multiplied with its factor: a convolution by a zonal kernel. Without factors they are all 1; bands beyond
    /// the last factor are left out.
    ///
    /// # Panics
    /// If a plane is not `width·height` long, or the plan is one of exact cells, which only analyse.
    pub fn synthesize_columns<S: Sample>(
        &self,
        columns: &ColumnsRgb,
        factors: &[f64],
        planes: [&mut [S]; 3],
    ) {
        let area = self.width * self.height;
        assert!(planes.iter().all(|p| p.len() == area), "planes of width·height samples");
        assert!(self.rings.per_row == 1, "exact cells are integrals, not samples");
        if area > 0 {
            match &self.work {
                AnyWork::Double(work) => self.synthesize_with(work, columns, factors, planes),
                AnyWork::Image(work) => self.synthesize_with(work, columns, factors, planes),
            }
        }
    }

    fn synthesize_with<T: Real, S: Sample>(
        &self,
        work: &Work<T>,
        columns: &ColumnsRgb,
        factors: &[f64],
        mut planes: [&mut [S]; 3],
    ) {
        let mut buffer = work.take();
        for pairs in self.chunks() {
            let blocks = pairs.len().div_ceil(BLOCK);
            let side = blocks * SIDE * CELL;
            let cells = aligned(&mut buffer, side * (self.order / SIDE + 1));
            let parts = cells.chunks_exact_mut(side).collect();
            self.each(parts, &work.scratch, |scratch, group, cells: &mut [T]| {
                for m in (group * SIDE..=self.order).take(SIDE) {
                    let (cells, stride) = (&mut cells[m % SIDE * CELL..], SIDE * CELL);
                    let column = columns.of(m);
                    let factors =
                        if factors.is_empty() { None } else { Some(factors.get(m..).unwrap_or(&[])) };
                    self.with_part(m, pairs.clone(), self.phases[m][1], |part| {
                        steradian_simd::run(Synthesis { part, column, factors, cells, stride, scratch });
                    });
                }
            });
            let rows = blocks_mut(&mut planes, self.width, self.height, pairs.clone());
            self.each(rows, &work.buffers, |buffers, b, mut rows| {
                work.fourier.backward(Cells { cells, blocks, block: b }, &mut rows, buffers);
            });
        }
        work.put_back(buffer);
    }

    /// Ranges of row pairs.
    fn chunks(&self) -> impl Iterator<Item = Range<usize>> {
        let pairs = self.height.div_ceil(2);
        let size = match self.work {
            AnyWork::Double(_) => size_of::<f64>(),
            AnyWork::Image(_) => size_of::<f32>(),
        };
        let row = (self.order + 1) * self.rings.per_row * CELL / BLOCK * size;
        let step = (CELLS / row).next_multiple_of(BLOCK).max(2 * BLOCK);
        (0..pairs).step_by(step).map(move |first| first..pairs.min(first + step))
    }

    /// Spectra of the row pairs of a range, as cells [ring block][m].
    fn forward<'a, T: Real, S: Sample>(
        &self,
        work: &Work<T>,
        planes: [&[S]; 3],
        pairs: Range<usize>,
        buffer: &'a mut Vec<T>,
    ) -> &'a [T] {
        let (width, height) = (self.width, self.height);
        let block = self.rings.per_row * (self.order + 1) * CELL;
        let cells = aligned(buffer, pairs.len().div_ceil(BLOCK) * block);
        let blocks = pairs.clone().step_by(BLOCK).zip(cells.chunks_exact_mut(block)).collect();
        self.each(blocks, &work.buffers, |buffers, _, (first, cells)| {
            let last = pairs.end.min(first + BLOCK);
            let rows = |r: Range<usize>| planes.map(|p| &p[r.start * width..r.end * width]);
            // The equator of an odd height is in the north only.
            let rows = RowBlock {
                north: rows(first..last),
                south: rows((height - last).max(height.div_ceil(2))..height - first),
            };
            work.fourier.forward(&rows, &self.rings, first * self.rings.per_row, cells, buffers);
        });
        cells
    }

    fn with_part(&self, m: usize, pairs: Range<usize>, phase: [f64; 2], f: impl FnOnce(Part<'_>)) {
        let made;
        let (steps, starts) = match self.kept.get(m) {
            Some(kept) => kept,
            None => {
                made = self.tables(m);
                &made
            }
        };
        let first = pairs.start * self.rings.per_row;
        let last = first + pairs.len().next_multiple_of(BLOCK) * self.rings.per_row;
        f(Part {
            steps,
            starts,
            x: &self.rings.cos[first..last],
            x2: &self.rings.x2[first..last],
            ring: first,
            phase,
        });
    }

    /// Runs `f` on every item, with the item's index and a worker's buffers, on all threads where that pays.
    fn each<T: Send, B: Default + Send>(
        &self,
        items: Vec<T>,
        pool: &Pool<B>,
        f: impl Fn(&mut B, usize, T) + Sync,
    ) {
        if self.rings.cos.len() * (self.order + 1).pow(2) < SERIAL || rayon::current_num_threads() == 1 {
            let mut buffers = pool.lend();
            items.into_iter().enumerate().for_each(|(i, item)| f(&mut buffers, i, item));
        } else {
            let items = items.into_par_iter().enumerate();
            items.for_each_init(|| pool.lend(), |buffers, (i, item)| f(buffers, i, item));
        }
    }
}

/// The rows of a range of pairs, by blocks.
fn blocks_mut<'a, S>(
    planes: &'a mut [&mut [S]; 3],
    width: usize,
    height: usize,
    pairs: Range<usize>,
) -> Vec<RowBlock<&'a mut [S]>> {
    let middle = height.div_ceil(2);
    let halves = planes.each_mut().map(|p| p.split_at_mut(middle * width));
    let south_end = height - pairs.start;
    let south_start = (height - pairs.end).max(middle);
    let [r, g, b] = halves.map(|(north, south)| {
        let north = north[pairs.start * width..pairs.end * width].chunks_mut(BLOCK * width);
        let south = &mut south[(south_start - middle) * width..(south_end - middle) * width];
        let south = south.rchunks_mut(BLOCK * width).chain(std::iter::repeat_with(|| &mut [] as &mut [S]));
        north.zip(south)
    });
    r.zip(g).zip(b).map(|((r, g), b)| RowBlock { north: [r.0, g.0, b.0], south: [r.1, g.1, b.1] }).collect()
}

#[cfg(test)]
mod tests;

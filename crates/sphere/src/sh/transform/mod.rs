//! Forward and inverse transforms on lat-long grids in O(order · samples): an FFT along each ring, then a
//! Legendre sum over rings for each m.
//!
//! The image's poles are on y and the basis' on z: the transform works with Y(x, z, y) and exchanges y and z
//! afterwards, which is exact and small beside the rest. Rings are taken in north–south pairs, since
//! P̄_lm(−x) = (−1)^{l+m} P̄_lm(x); the three channels share the Legendre recursion; sums are f64 in a fixed
//! order whatever the number of threads.

mod columns;
mod fourier;
mod kernel;
mod recursion;
mod rings;

use super::ShRgb;
use super::rotation::exchange_yz;
use columns::Columns;
use fourier::{Buffers, Fourier, RowBlock};
use kernel::{Analysis, CELL, Part, Scratch, Synthesis, aligned};
use rayon::prelude::*;
use recursion::{FindStarts, Starts, Step, steps};
pub use rings::Grid;
use rings::{BLOCK, Rings};
use std::mem::take;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

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
    /// Per m, unless that takes too much memory.
    kept: Vec<(Vec<Step>, Starts)>,
    /// The last transform's cells: fresh memory costs more than a pass over it.
    cells: Mutex<Vec<f64>>,
}

impl ShTransform {
    /// Plans a transform.
    pub fn new(order: usize, width: usize, height: usize, grid: Grid) -> Self {
        let mut plan = Self {
            order,
            grid,
            rings: Rings::new(grid, height, order),
            fourier: Fourier::new(order, width, height),
            kept: Vec::new(),
            cells: Mutex::default(),
        };
        let bytes = (order + 1) * (24 * plan.rings.cos.len() + 10 * order);
        if bytes <= KEPT {
            plan.kept = (0..=order).into_par_iter().map(|m| plan.tables(m)).collect();
        }
        plan
    }

    fn tables(&self, m: usize) -> (Vec<Step>, Starts) {
        let (order, steps) = (self.order, steps(m, self.order));
        let starts = steradian_simd::run(FindStarts { m, order, steps: &steps, rings: &self.rings });
        (steps, starts)
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
        let area = self.fourier.width * self.fourier.height;
        assert!(planes.iter().all(|p| p.len() == area), "planes of width·height samples");
        let mut columns = Columns::zero(self.order);
        if area > 0 {
            let mut buffer = self.buffer();
            for pairs in self.chunks() {
                let cells = self.forward(planes, pairs.clone(), &mut buffer);
                self.each(columns.split(), |scratch: &mut Scratch, m, column| {
                    let stride = (self.order + 1) * CELL;
                    self.with_part(
                        m,
                        pairs.clone(),
                        self.fourier.analysis_phase(m, self.grid.sinc()),
                        |part| {
                            let cells = &cells[m * CELL..];
                            steradian_simd::run(Analysis { part, cells, stride, column, scratch });
                        },
                    );
                });
            }
            self.put_back(buffer);
        }
        columns.gather()
    }

    fn buffer(&self) -> Vec<f64> {
        take(&mut *self.cells.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn put_back(&self, buffer: Vec<f64>) {
        *self.cells.lock().unwrap_or_else(PoisonError::into_inner) = buffer;
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
    pub fn synthesize_polar<S: Sample>(&self, sh: &ShRgb, mut planes: [&mut [S]; 3]) {
        let (width, height) = (self.fourier.width, self.fourier.height);
        assert!(planes.iter().all(|p| p.len() == width * height), "planes of width·height samples");
        assert!(self.rings.per_row == 1, "exact cells are integrals, not samples");
        if width * height == 0 {
            return;
        }
        let columns = Columns::scatter(sh, self.order);
        let mut buffer = self.buffer();
        for pairs in self.chunks() {
            let blocks = pairs.len().next_multiple_of(2 * BLOCK) / BLOCK;
            let side = blocks * SIDE * CELL;
            let cells = aligned(&mut buffer, side * (self.order / SIDE + 1));
            let parts = cells.chunks_exact_mut(side).collect();
            self.each(parts, |scratch: &mut Scratch, group, cells: &mut [f64]| {
                for m in (group * SIDE..=self.order).take(SIDE) {
                    let (cells, stride) = (&mut cells[m % SIDE * CELL..], SIDE * CELL);
                    self.with_part(m, pairs.clone(), self.fourier.synthesis_phase(m), |part| {
                        let column = columns.of(m);
                        steradian_simd::run(Synthesis { part, column, cells, stride, scratch });
                    });
                }
            });
            let rows = blocks_mut(&mut planes, width, height, pairs.clone());
            self.each(rows, |buffers: &mut Buffers, b, mut rows| {
                let cell = |m: usize| {
                    let at = ((m / SIDE * blocks + b) * SIDE + m % SIDE) * CELL;
                    &cells[at..at + CELL]
                };
                self.fourier.backward(cell, &mut rows, buffers);
            });
        }
        self.put_back(buffer);
    }

    /// Ranges of row pairs.
    fn chunks(&self) -> impl Iterator<Item = Range<usize>> {
        let pairs = self.fourier.height.div_ceil(2);
        let row = (self.order + 1) * self.rings.per_row * CELL / BLOCK * size_of::<f64>();
        let step = (CELLS / row).next_multiple_of(2 * BLOCK).max(4 * BLOCK);
        (0..pairs).step_by(step).map(move |first| first..pairs.min(first + step))
    }

    /// Spectra of the row pairs of a range, as cells [ring block][m].
    fn forward<'a, S: Sample>(
        &self,
        planes: [&[S]; 3],
        pairs: Range<usize>,
        buffer: &'a mut Vec<f64>,
    ) -> &'a [f64] {
        let (width, height) = (self.fourier.width, self.fourier.height);
        let block = self.rings.per_row * (self.order + 1) * CELL;
        let cells = aligned(buffer, pairs.len().next_multiple_of(2 * BLOCK) / BLOCK * block);
        let blocks = pairs.clone().step_by(BLOCK).zip(cells.chunks_exact_mut(block)).collect();
        self.each(blocks, |buffers: &mut Buffers, _, (first, cells)| {
            let last = pairs.end.min(first + BLOCK);
            let rows = |r: Range<usize>| planes.map(|p| &p[r.start * width..r.end * width]);
            // The equator of an odd height is in the north only.
            let rows = RowBlock {
                north: rows(first..last),
                south: rows((height - last).max(height.div_ceil(2))..height - first),
            };
            self.fourier.forward(&rows, &self.rings, first * self.rings.per_row, cells, buffers);
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
        let last = first + pairs.len().next_multiple_of(2 * BLOCK) * self.rings.per_row;
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
    fn each<T: Send, B: Default>(&self, items: Vec<T>, f: impl Fn(&mut B, usize, T) + Sync) {
        if self.rings.cos.len() * (self.order + 1).pow(2) < SERIAL || rayon::current_num_threads() == 1 {
            let mut buffers = B::default();
            items.into_iter().enumerate().for_each(|(i, item)| f(&mut buffers, i, item));
        } else {
            let items = items.into_par_iter().enumerate();
            items.for_each_init(B::default, |buffers, (i, item)| f(buffers, i, item));
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

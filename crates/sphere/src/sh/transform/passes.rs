//! The passes of a transform over its samples: FFTs of blocks of rows, Legendre sums of each m.

use super::analysis::Analysis;
use super::fold::BlockCells;
use super::fourier::{Buffers, Fourier, RowBlock};
use super::kernel::{CELL, Part, Real, Scratch, aligned};
use super::latitude::{Latitude, Sequences};
use super::pool::Pool;
use super::rings::BLOCK;
use super::synthesis::Synthesis;
use super::{AnyWork, ColumnsRgb, Grid, Sample, ShTransform};
use std::mem::take;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use steradian_parallel::prelude::*;

/// Orders m whose cells of a block lie side by side, so that a block's spectra are met in long runs.
pub(super) const SIDE: usize = 8;

/// Bytes of cells that are in memory at a time, about.
const CELLS: usize = 64 << 20;

/// Legendre work (rings · order²) below which one thread is quicker than several.
const SERIAL: usize = 1 << 18;

/// What depends on the precision.
pub(super) struct Work<T: Real> {
    fourier: Fourier<T>,
    /// The last transform's memory: fresh memory costs more than a pass over it.
    cells: Mutex<Vec<T>>,
    buffers: Pool<Buffers<T>>,
    scratch: Pool<Scratch<T>>,
    /// For texels that are constant over their cells: how they are brought to rings, and the last rings'
    /// cells.
    latitude: Option<Latitude<T>>,
    rings: Mutex<Vec<T>>,
    sequences: Pool<Sequences<T>>,
}

impl<T: Real> Work<T> {
    pub(super) fn new(order: usize, width: usize, height: usize, grid: Grid) -> Self {
        Self {
            latitude: (grid == Grid::Cells && height > 0).then(|| Latitude::new(order, height)),
            rings: Mutex::default(),
            sequences: Pool::default(),
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
    pub(super) fn analyze_with<T: Real, S: Sample>(
        &self,
        work: &Work<T>,
        planes: [&[S]; 3],
        columns: &mut ColumnsRgb,
    ) {
        let mut buffer = work.take();
        if let Some(latitude) = &work.latitude {
            let cells = self.forward(work, planes, 0..self.height.div_ceil(2), &mut buffer);
            self.analyze_cells(work, latitude, cells, columns);
            return work.put_back(buffer);
        }
        for pairs in self.chunks() {
            let cells = self.forward(work, planes, pairs.clone(), &mut buffer);
            self.each(columns.split(), &work.scratch, |scratch, m, column| {
                let (first, stride) = (pairs.start == 0, (self.order + 1) * CELL);
                self.with_part(m, pairs.clone(), self.phases[m][0], |part| {
                    let cells = &cells[m * CELL..];
                    steradian_simd::run(Analysis { part, first, cells, stride, column, scratch });
                });
            });
        }
        work.put_back(buffer);
    }

    /// Analysis of texels that are constant over their cells, from their rows' spectra.
    fn analyze_cells<T: Real>(
        &self,
        work: &Work<T>,
        latitude: &Latitude<T>,
        cells: &[T],
        columns: &mut ColumnsRgb,
    ) {
        let mut rings = take(&mut *work.rings.lock().unwrap_or_else(PoisonError::into_inner));
        self.each(latitude.split(&mut rings), &work.sequences, |sequences, group, out| {
            latitude.resample(group, &self.rings, cells, out, sequences);
        });
        let all = latitude.cells(&mut rings);
        self.each(columns.split(), &work.scratch, |scratch, m, column| {
            self.with_part(m, 0..latitude.rings() / 2, self.phases[m][0], |part| {
                let cells = &all[latitude.place(m)..];
                steradian_simd::run(Analysis { part, first: true, cells, stride: CELL, column, scratch });
            });
        });
        *work.rings.lock().unwrap_or_else(PoisonError::into_inner) = rings;
    }

    pub(super) fn synthesize_with<T: Real, S: Sample>(
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
                work.fourier.backward(BlockCells { cells, blocks, block: b }, &mut rows, buffers);
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
        let row = (self.order + 1) * CELL / BLOCK * size;
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
        let block = (self.order + 1) * CELL;
        let rings = work.latitude.is_none().then_some(&self.rings);
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
            work.fourier.forward(&rows, rings, first, cells, buffers);
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
        let first = pairs.start;
        let last = first + pairs.len().next_multiple_of(BLOCK);
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
    pub(super) fn each<T: Send, B: Default + Send>(
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

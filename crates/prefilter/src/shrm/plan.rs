//! Maps from coefficients of light and kernels: (5.23) and (5.24) of Ramamoorthi & Hanrahan 2002.

use super::fourier::{Buffers, Fourier, Target};
use super::recursion::{Column, Fill, RINGS, Rings, steps};
use super::sums::{Accumulate, CELL};
use super::{CoefficientMaps, Grid, Key};
use std::mem::take;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_sphere::sh::ColumnsRgb;

/// Bytes up to which a plan keeps the rotations' coefficients.
const KEPT: usize = 64 << 20;
/// Bytes of cells that are in memory at a time, about.
const CELLS: usize = 64 << 20;

/// One product of light and kernel: B_±q(C) = Σ_l k_l L'_l,±q(C), L' the light's coefficients in the frame
/// about C.
#[derive(Debug, Clone, Copy)]
pub struct Term<'a> {
    /// Azimuthal order; 0 makes one map, others make two.
    pub q: usize,
    /// k_l of red, green and blue from l = 0; values below q are ignored, missing ones are 0.
    pub k: [&'a [f64]; 3],
}

/// A plan for maps from light up to an order: the rotations' coefficients u±_lmq(α) and Fourier tables of a
/// grid.
///
/// Recursions are shared by all terms of a q and the three channels, north and south; sums are f64 in a fixed
/// order, so the threads' number changes no bit. A plan may serve many threads.
pub struct Plan {
    order: usize,
    grid: Grid,
    rings: Vec<Rings>,
    /// Columns of the recursion by m, by q up to the plan's, by block of rings; empty where they would take
    /// too much memory.
    kept: Vec<Vec<Vec<Column>>>,
    fourier: Fourier,
    /// Memory of the cells, kept for the next call: fresh memory costs more than a pass over it.
    cells: Mutex<Vec<f64>>,
}

impl Plan {
    /// Plans maps on `grid` of light up to band `order`; terms up to `q_max` are the fastest (higher q are
    /// allowed). Stable to order 1023 and beyond.
    pub fn new(order: usize, q_max: usize, grid: Grid) -> Self {
        let pairs = grid.rows().div_ceil(2);
        let alpha: Vec<f64> = (0..pairs).map(|i| grid.alpha(i)).collect();
        let rings: Vec<Rings> = alpha.chunks(RINGS).map(Rings::new).collect();
        let mut plan = Self {
            order,
            grid,
            rings,
            kept: Vec::new(),
            fourier: Fourier::new(order, grid.columns()),
            cells: Mutex::default(),
        };
        let q_max = q_max.min(order);
        let bytes = (order + 1) * (order + 2) / 2 * (1 + 2 * q_max) * plan.rings.len() * RINGS * 8;
        if bytes <= KEPT {
            let columns =
                |m: usize| (0..=q_max).map(|q| plan.columns_of(m, q, 0..plan.rings.len())).collect();
            plan.kept = (0..=order).into_par_iter().map(columns).collect();
        }
        plan
    }

    /// Highest band of light that counts.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Where the maps' texels stand.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// The maps of all terms (see [`Term`] and [`CoefficientMaps`]). Coefficients over world axes become
    /// columns by [`ColumnsRgb::from_world`].
    pub fn maps(
        &self,
        light: &ColumnsRgb,
        terms: &[Term<'_>],
        task: &Task,
    ) -> Result<CoefficientMaps, Cancelled> {
        let keys: Vec<Key> = terms
            .iter()
            .enumerate()
            .flat_map(|(term, t)| {
                let q = i32::try_from(t.q).unwrap_or(i32::MAX);
                let both = [q, -q].map(|q| Key { term, q });
                both.into_iter().take(if q == 0 { 1 } else { 2 })
            })
            .collect();
        let texels = self.grid.texels();
        let mut planes: Vec<[Vec<f32>; 3]> =
            keys.iter().map(|_| std::array::from_fn(|_| vec![0.0; texels])).collect();
        let mut buffer = take(&mut *self.cells.lock().unwrap_or_else(PoisonError::into_inner));
        let per_block = ((self.order + 1) * keys.len() * CELL * RINGS * 8).max(1);
        let step = (CELLS / per_block).max(1);
        for first in (0..self.rings.len()).step_by(step) {
            task.check()?;
            let blocks = first..self.rings.len().min(first + step);
            self.sums(light, terms, keys.len(), blocks.clone(), &mut buffer);
            self.texels(&buffer, blocks, &mut planes);
        }
        *self.cells.lock().unwrap_or_else(PoisonError::into_inner) = buffer;
        Ok(CoefficientMaps { grid: self.grid, keys, planes })
    }

    /// Cells [m][map][number][ring] of blocks of rings.
    fn sums(
        &self,
        light: &ColumnsRgb,
        terms: &[Term<'_>],
        maps: usize,
        blocks: Range<usize>,
        buffer: &mut Vec<f64>,
    ) {
        let stride = blocks.len() * RINGS;
        let per_m = maps * CELL * stride;
        // All cells of terms up to the order are written below; those of higher ones stay 0. Memory that is
        // not there yet comes as zeros from the system, which writes them where the threads below first touch
        // it.
        let cells = (self.order + 1) * per_m;
        if buffer.capacity() < cells {
            *buffer = vec![0.0; cells];
        }
        buffer.resize(cells, 0.0);
        if per_m == 0 {
            return;
        }
        buffer.par_chunks_mut(per_m).enumerate().for_each_init(Vec::new, |products, (m, cells)| {
            let mut made: Vec<(usize, Vec<Column>)> = Vec::new();
            let mut map = 0;
            for term in terms {
                let span = if term.q == 0 { 1 } else { 2 } * CELL * stride;
                let cells = &mut cells[map * CELL * stride..][..span];
                map += if term.q == 0 { 1 } else { 2 };
                if term.q > self.order {
                    cells.fill(0.0);
                    continue;
                }
                multiply(light, m, term, self.order, products);
                let columns = match self.kept.get(m).and_then(|kept| kept.get(term.q)) {
                    Some(columns) => &columns[..],
                    None => {
                        let at = made.iter().position(|(q, _)| *q == term.q).unwrap_or_else(|| {
                            made.push((term.q, self.columns_of(m, term.q, blocks.clone())));
                            made.len() - 1
                        });
                        &made[at].1[..]
                    }
                };
                let offset = columns.len() - blocks.len();
                let from = if offset > 0 { blocks.start } else { 0 };
                for (k, column) in columns[from..from + blocks.len()].iter().enumerate() {
                    let cells = &mut cells[k * RINGS..];
                    steradian_simd::run(Accumulate { m, q: term.q, column, products, cells, stride });
                }
            }
        });
    }

    /// The rotations' coefficients of blocks of rings.
    fn columns_of(&self, m: usize, q: usize, blocks: Range<usize>) -> Vec<Column> {
        let steps = steps(m, q, self.order);
        let fill = |rings: &Rings| {
            let mut column = Column::default();
            steradian_simd::run(Fill { m, q, steps: &steps, rings, column: &mut column });
            column
        };
        self.rings[blocks].iter().map(fill).collect()
    }

    /// Texels of blocks of rings from their cells.
    fn texels(&self, cells: &[f64], blocks: Range<usize>, planes: &mut [[Vec<f32>; 3]]) {
        let (rows, n) = (self.grid.rows(), self.grid.columns());
        let stride = blocks.len() * RINGS;
        let per_m = planes.len() * CELL * stride;
        let middle = rows.div_ceil(2);
        let pairs = blocks.start * RINGS..middle.min(blocks.end * RINGS);
        let mut items = Vec::with_capacity(planes.len() * 3 * blocks.len());
        for (map, channels) in planes.iter_mut().enumerate() {
            for (c, plane) in channels.iter_mut().enumerate() {
                let (north, south) = plane.split_at_mut(middle * n);
                let north = north[pairs.start * n..pairs.end * n].chunks_mut(RINGS * n);
                // Southern rows mirror the northern ones; an equator is northern only.
                let end = rows - middle - pairs.start;
                let start = (rows - pairs.end).max(middle) - middle;
                let south = south[start * n..end * n].rchunks_mut(RINGS * n);
                let south = south.chain(std::iter::repeat_with(|| &mut [] as &mut [f32]));
                for (block, (north, south)) in north.zip(south).enumerate() {
                    items.push((map * CELL + 2 * c, block, Target { north, south }));
                }
            }
        }
        items.into_par_iter().for_each_init(Buffers::default, |buffers, (number, block, target)| {
            let cell = |m: usize| {
                let at = m * per_m + block * RINGS;
                // Cosine north and south, then sine: numbers 2c, 2c + 1 and 6 further.
                [0, 1, 6, 7].map(|k| &cells[at + (number + k) * stride..][..RINGS])
            };
            self.fourier.rows(cell, target, buffers);
        });
    }
}

/// k_l c_lm and k_l c_l,−m by l from max(m, q) up to the order.
fn multiply(light: &ColumnsRgb, m: usize, term: &Term<'_>, order: usize, products: &mut Vec<[f64; 6]>) {
    let column = light.column(m);
    products.clear();
    products.extend((m.max(term.q)..=order).map(|l| {
        let Some(c) = column.get(l - m) else { return [0.0; 6] };
        let k = term.k.map(|k| k.get(l).copied().unwrap_or(0.0));
        std::array::from_fn(|i| k[i % 3] * c[i])
    }));
}

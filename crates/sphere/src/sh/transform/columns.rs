//! Coefficients by m, as the Legendre stage takes them.

use super::kernel::Row;
use crate::sh::{ShRgb, index};
use std::ops::Range;

/// Orders m, or bands l, that are copied together, so that memory is met in whole cache lines.
pub(super) const TILE: usize = 8;

/// Index of (m, m) in columns up to `order`.
fn start(order: usize, m: usize) -> usize {
    m * (order + 1) - m * m.saturating_sub(1) / 2
}

/// One column per m of rows for l = m…order, one after the other.
#[derive(Default)]
pub(super) struct Columns {
    order: usize,
    rows: Vec<Row>,
}

impl Columns {
    /// Columns up to `order` that may hold anything, in the memory of earlier ones.
    pub(super) fn renewed(mut self, order: usize) -> Self {
        self.order = order;
        self.rows.resize((order + 1) * (order + 2) / 2, [0.0; 6]);
        self
    }

    pub(super) fn of(&self, m: usize) -> &[Row] {
        &self.rows[start(self.order, m)..start(self.order, m + 1)]
    }

    pub(super) fn split(&mut self) -> Vec<&mut [Row]> {
        self.split_by(1)
    }

    /// The columns of `n` orders m at a time.
    fn split_by(&mut self, n: usize) -> Vec<&mut [Row]> {
        let (order, mut rest) = (self.order, &mut self.rows[..]);
        (0..=order)
            .step_by(n)
            .map(|m| {
                let length = start(order, (m + n).min(order + 1)) - start(order, m);
                let (columns, after) = std::mem::take(&mut rest).split_at_mut(length);
                rest = after;
                columns
            })
            .collect()
    }

    /// Tiles of columns, to be written by [`scatter`].
    pub(super) fn tiles(&mut self) -> Vec<&mut [Row]> {
        self.split_by(TILE)
    }

    /// Coefficients of the bands that `planes` begin with and hold.
    pub(super) fn gather(&self, bands: Range<usize>, planes: [&mut [f64]; 3]) {
        let [r, g, b] = planes;
        let first = bands.start * bands.start;
        for tile in (0..bands.end).step_by(TILE) {
            for l in bands.clone() {
                for m in tile..(l + 1).min(tile + TILE) {
                    let row = self.rows[start(self.order, m) + l - m];
                    let (p, n) = (index(l, m as isize) - first, index(l, -(m as isize)) - first);
                    // For m = 0 the cosine's is written last.
                    (r[n], g[n], b[n]) = (row[1], row[3], row[5]);
                    (r[p], g[p], b[p]) = (row[0], row[2], row[4]);
                }
            }
        }
    }
}

/// Writes the `tile`-th tile of columns up to `order` from coefficients; bands that `sh` has not are 0.
pub(super) fn scatter(sh: &ShRgb, order: usize, tile: usize, rows: &mut [Row]) {
    let [r, g, b] = &sh.c;
    let first = tile * TILE;
    let from = start(order, first);
    for l in first..=order {
        for m in first..(l + 1).min(first + TILE) {
            let (p, n) = (index(l, m as isize), index(l, -(m as isize)));
            let sine = if m > 0 { 1.0 } else { 0.0 };
            rows[start(order, m) + l - m - from] = if l <= sh.order {
                [r[p], sine * r[n], g[p], sine * g[n], b[p], sine * b[n]]
            } else {
                [0.0; 6]
            };
        }
    }
}

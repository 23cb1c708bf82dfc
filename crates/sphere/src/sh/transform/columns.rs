//! Coefficients by m, as the Legendre stage takes them.

use super::kernel::Row;
use crate::sh::{ShRgb, index};

/// Orders m that are copied together, so that memory is met in whole cache lines.
const TILE: usize = 8;

/// One column per m of rows for l = m…order, one after the other.
pub(super) struct Columns {
    order: usize,
    rows: Vec<Row>,
}

impl Columns {
    pub(super) fn zero(order: usize) -> Self {
        Self { order, rows: vec![[0.0; 6]; (order + 1) * (order + 2) / 2] }
    }

    /// Index of (m, m).
    fn start(&self, m: usize) -> usize {
        m * (self.order + 1) - m * m.saturating_sub(1) / 2
    }

    pub(super) fn of(&self, m: usize) -> &[Row] {
        &self.rows[self.start(m)..self.start(m + 1)]
    }

    pub(super) fn split(&mut self) -> Vec<&mut [Row]> {
        let mut rest = &mut self.rows[..];
        (0..=self.order)
            .map(|m| {
                let (column, after) = std::mem::take(&mut rest).split_at_mut(self.order + 1 - m);
                rest = after;
                column
            })
            .collect()
    }

    /// Calls f(l, m, index of its row), by tiles.
    fn walk(&self, order: usize, mut f: impl FnMut(usize, usize, usize)) {
        for tile in (0..=order).step_by(TILE) {
            for l in tile..=order {
                for m in tile..=l.min(tile + TILE - 1) {
                    f(l, m, self.start(m) + l - m);
                }
            }
        }
    }

    pub(super) fn gather(&self) -> ShRgb {
        let mut sh = ShRgb::zero(self.order);
        let [r, g, b] = &mut sh.c;
        self.walk(self.order, |l, m, at| {
            let row = self.rows[at];
            let (p, n) = (index(l, m as isize), index(l, -(m as isize)));
            // For m = 0 the cosine's is written last.
            (r[n], g[n], b[n]) = (row[1], row[3], row[5]);
            (r[p], g[p], b[p]) = (row[0], row[2], row[4]);
        });
        sh
    }

    pub(super) fn scatter(sh: &ShRgb, order: usize) -> Self {
        let mut columns = Self::zero(order);
        let mut rows = std::mem::take(&mut columns.rows);
        let [r, g, b] = &sh.c;
        columns.walk(order.min(sh.order), |l, m, at| {
            let (p, n) = (index(l, m as isize), index(l, -(m as isize)));
            let sine = if m > 0 { 1.0 } else { 0.0 };
            rows[at] = [r[p], sine * r[n], g[p], sine * g[n], b[p], sine * b[n]];
        });
        Self { order, rows }
    }
}

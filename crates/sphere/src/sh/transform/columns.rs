//! Coefficients by m, as the Legendre stage takes them.

use super::kernel::Row;
use crate::sh::rotation::exchange_yz;
use crate::sh::{ShRgb, index};
use std::mem::take;
use std::ops::Range;

/// Orders m, or bands l, that are copied together, so that memory is met in whole cache lines.
pub(super) const TILE: usize = 8;

/// Index of (m, m) in columns up to `order`.
fn start(order: usize, m: usize) -> usize {
    m * (order + 1) - m * m.saturating_sub(1) / 2
}

/// Coefficients of Y(x, z, y), whose pole is the image's, in the order in which [`super::ShTransform`] makes
/// and takes them: by m, then by l, cosine terms of the three channels, then sine terms. Convolution needs no
/// other order; [`ColumnsRgb::to_sh`] and [`ColumnsRgb::from_sh`] exchange it for that of [`ShRgb`].
#[derive(Debug, Clone, Default)]
pub struct ColumnsRgb {
    order: usize,
    rows: Vec<Row>,
}

impl PartialEq for ColumnsRgb {
    fn eq(&self, other: &Self) -> bool {
        let same = |a: &Row, b: &Row| a[..3] == b[..3] && a[4..7] == b[4..7];
        self.order == other.order && self.rows.iter().zip(&other.rows).all(|(a, b)| same(a, b))
    }
}

impl ColumnsRgb {
    /// Zero up to band `order`.
    pub fn zero(order: usize) -> Self {
        let mut columns = Self::default();
        columns.renew(order);
        columns
    }

    /// Highest band.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Energy of each band and channel, Σ_m c².
    pub fn band_energies(&self) -> Vec<[f64; 3]> {
        let mut energies = vec![[0.0; 3]; self.order + 1];
        for m in 0..=self.order {
            for (energy, row) in energies[m..].iter_mut().zip(self.of(m)) {
                for k in 0..3 {
                    energy[k] += row[k] * row[k] + row[4 + k] * row[4 + k];
                }
            }
        }
        energies
    }

    /// The same function in the order l² + l + m; the basis stays Y(x, z, y).
    pub fn to_sh(&self) -> ShRgb {
        let mut sh = ShRgb::zero(self.order);
        for (bands, planes) in bands(&mut sh) {
            self.gather(bands, planes);
        }
        sh
    }

    /// From coefficients of Y(x, z, y) in the order l² + l + m.
    pub fn from_sh(sh: &ShRgb) -> Self {
        let mut columns = Self::zero(sh.order);
        for (tile, rows) in columns.tiles().into_iter().enumerate() {
            scatter(sh, sh.order, tile, rows);
        }
        columns
    }

    /// From coefficients of Y(x, y, z), the basis over world axes.
    pub fn from_world(sh: &ShRgb) -> Self {
        let mut polar = sh.clone();
        exchange_yz(sh.order, polar.c.each_mut().map(Vec::as_mut_slice));
        Self::from_sh(&polar)
    }

    /// The coefficients of an order m ≤ `order`, by l from m: cosine terms of the three channels, then sine
    /// terms (0 where m = 0). Empty beyond `order`.
    pub fn column(&self, m: usize) -> Vec<[f64; 6]> {
        let rows = if m > self.order || self.rows.is_empty() { &[] } else { self.of(m) };
        rows.iter().map(|r| [r[0], r[1], r[2], r[4], r[5], r[6]]).collect()
    }

    /// Columns up to `order` that may hold anything, in the memory that there is.
    pub(super) fn renew(&mut self, order: usize) {
        self.order = order;
        self.rows.resize((order + 1) * (order + 2) / 2, [0.0; 8]);
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
                let (columns, after) = take(&mut rest).split_at_mut(length);
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
                    (r[n], g[n], b[n]) = (row[4], row[5], row[6]);
                    (r[p], g[p], b[p]) = (row[0], row[1], row[2]);
                }
            }
        }
    }
}

/// A few bands of coefficients at a time.
pub(super) fn bands(sh: &mut ShRgb) -> Vec<(Range<usize>, [&mut [f64]; 3])> {
    let last = sh.order + 1;
    let mut rest = sh.c.each_mut().map(Vec::as_mut_slice);
    (0..last)
        .step_by(TILE)
        .map(|first| {
            let bands = first..last.min(first + TILE);
            let n = bands.end * bands.end - first * first;
            let planes = rest.each_mut().map(|r| {
                let (plane, after) = take(r).split_at_mut(n);
                *r = after;
                plane
            });
            (bands, planes)
        })
        .collect()
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
                [r[p], g[p], b[p], 0.0, sine * r[n], sine * g[n], sine * b[n], 0.0]
            } else {
                [0.0; 8]
            };
        }
    }
}

//! Tables over a plane or a line whose outer entries lie on the ends of [0, 1]: linear between entries.

use crate::gpu::{Format, Level, Shape, Table};
use steradian_parallel::prelude::*;

/// A table of `C` = 2 or 4 numbers an entry; a line where `height` is 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid<const C: usize> {
    width: usize,
    height: usize,
    entries: Vec<[f32; C]>,
}

impl<const C: usize> Grid<C> {
    /// Entries by a function of u and v in [0, 1], at least 2 a row.
    pub fn new(width: usize, height: usize, f: impl Fn(f64, f64) -> [f64; C] + Sync) -> Self {
        let (width, height) = (width.max(2), height.max(1));
        let row = |j: usize| {
            let v = j as f64 / (height - 1).max(1) as f64;
            let entry = |i: usize| f(i as f64 / (width - 1) as f64, v).map(|x| x as f32);
            (0..width).map(entry).collect::<Vec<_>>()
        };
        let rows: Vec<Vec<[f32; C]>> = (0..height).into_par_iter().map(row).collect();
        Self { width, height, entries: rows.concat() }
    }

    /// Entry `i` of row `j`.
    #[inline(always)]
    pub fn entry(&self, i: usize, j: usize) -> [f32; C] {
        self.entries[j * self.width + i]
    }

    /// Bilinear; `u` and `v` are clamped.
    #[inline(always)]
    pub fn plane(&self, u: f32, v: f32) -> [f32; C] {
        let ((i, x), (j, y)) = (cell(u, self.width), cell(v, self.height));
        let k = j * self.width + i;
        let (top, bottom) = (&self.entries[k..k + 2], &self.entries[k + self.width..k + self.width + 2]);
        std::array::from_fn(|c| {
            let (a, b) = (mix(top[0][c], top[1][c], x), mix(bottom[0][c], bottom[1][c], x));
            mix(a, b, y)
        })
    }

    /// Linear along a line; `u` is clamped.
    #[inline(always)]
    pub fn line(&self, u: f32) -> [f32; C] {
        let (i, x) = cell(u, self.width);
        std::array::from_fn(|c| mix(self.entries[i][c], self.entries[i + 1][c], x))
    }

    /// Bytes of the entries.
    pub fn bytes(&self) -> usize {
        4 * C * self.entries.len()
    }

    /// As a GPU table: `fetch_NAME(uv)` of a plane, `fetch_NAME(u)` of a line.
    pub fn table(&self, name: &'static str) -> Table {
        let bytes = self.entries.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        Table {
            name,
            shape: if self.height == 1 { Shape::Line } else { Shape::Plane },
            format: if C == 2 { Format::Rg32Float } else { Format::Rgba32Float },
            level: Level { width: self.width, height: self.height, layers: 1, bytes },
        }
    }
}

/// What WGSL's mix is: a at 0, b at 1.
#[inline(always)]
fn mix(a: f32, b: f32, w: f32) -> f32 {
    a * (1.0 - w) + b * w
}

/// The entry before a place in [0, 1], and the weight of the next.
#[inline(always)]
fn cell(u: f32, count: usize) -> (usize, f32) {
    let x = u.clamp(0.0, 1.0) * (count - 1) as f32;
    let i = (x as usize).min(count - 2);
    (i, x - i as f32)
}

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

/// Planes of one size with four numbers an entry, layer by layer behind each other.
#[derive(Debug, Clone, PartialEq)]
pub struct GridStack {
    width: usize,
    height: usize,
    layers: usize,
    /// All layers of an entry, then those of the next one of its row.
    entries: Vec<[f32; 4]>,
}

/// A place in every layer of a stack.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    entry: usize,
    x: f32,
    y: f32,
}

impl GridStack {
    /// Entries by their column, row and layer; at least one layer. A single column or row is doubled, as
    /// lookups need two.
    pub fn new(
        width: usize,
        height: usize,
        layers: usize,
        f: impl Fn(usize, usize, usize) -> [f32; 4],
    ) -> Self {
        let (columns, rows) = (width.max(2), height.max(2));
        let mut entries = Vec::with_capacity(columns * rows * layers);
        for j in 0..rows {
            for i in 0..columns {
                entries.extend((0..layers).map(|k| f(i.min(width - 1), j.min(height - 1), k)));
            }
        }
        Self { width: columns, height: rows, layers, entries }
    }

    /// Layers.
    pub fn layers(&self) -> usize {
        self.layers
    }

    /// Position of u and v, clamped to [0, 1], among the entries.
    #[inline(always)]
    pub fn place(&self, [u, v]: [f32; 2]) -> Place {
        let ((i, x), (j, y)) = (cell(u, self.width), cell(v, self.height));
        Place { entry: (j * self.width + i) * self.layers, x, y }
    }

    /// Bilinear in layer `k`.
    #[inline(always)]
    pub fn layer(&self, p: Place, k: usize) -> [f32; 4] {
        let row = |i: usize| {
            let first = p.entry + i * self.layers + k;
            let two = &self.entries[first..=first + self.layers];
            (two[0], two[two.len() - 1])
        };
        let ((a, b), (c, d)) = (row(0), row(self.width));
        std::array::from_fn(|n| mix(mix(a[n], b[n], p.x), mix(c[n], d[n], p.x), p.y))
    }

    /// Bytes of the entries.
    pub fn bytes(&self) -> usize {
        16 * self.entries.len()
    }

    /// As a GPU table: `fetch_NAME_layer(uv, k)`.
    pub fn table(&self, name: &'static str) -> Table {
        let mut bytes = Vec::with_capacity(self.bytes());
        for k in 0..self.layers {
            let layer = self.entries.iter().skip(k).step_by(self.layers);
            bytes.extend(layer.flatten().flat_map(|x| x.to_le_bytes()));
        }
        let level = Level { width: self.width, height: self.height, layers: self.layers, bytes };
        Table { name, shape: Shape::PlaneStack, format: Format::Rgba32Float, level }
    }
}

/// WGSL's mix: a at w = 0, b at w = 1.
#[inline(always)]
fn mix(a: f32, b: f32, w: f32) -> f32 {
    a * (1.0 - w) + b * w
}

/// The entry before a place in [0, 1], and the weight of the next.
#[inline(always)]
fn cell(u: f32, count: usize) -> (usize, f32) {
    // Adding 1.5·2²³ rounds to an integer; exactly on an entry, either neighbouring pair gives the right
    // result. A conversion to an integer would branch on NaN.
    const ROUND: f32 = 12_582_912.0;
    let x = u.clamp(0.0, 1.0) * (count - 1) as f32;
    let i = ((x - 0.5 + ROUND).to_bits().wrapping_sub(ROUND.to_bits()) as usize).min(count - 2);
    (i, x - i as f32)
}

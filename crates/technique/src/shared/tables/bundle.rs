//! Several RGB functions on the sphere, interleaved: one lookup reads the terms of a texel in one run and
//! sums them with weights.

use crate::gpu::{Format, Level, Shape, Table};
use crate::shared::maths::harmonics::{MAX_TERMS, globe_uv};
use crate::tensors::{PartError, TensorFile};
use std::f32::consts::PI;
use steradian_formats::{Tensor, TensorData};
use steradian_parallel::prelude::*;
use steradian_prefilter::edge_cube::{direction, face_position};

/// The grid of directions that a bundle is tabulated on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Grid {
    /// Lat-long rows and columns; the first and the last row lie on the poles
    /// ([`steradian_prefilter::shrm::Grid`]).
    Globe {
        /// Rows, at least 2.
        rows: usize,
        /// Columns.
        columns: usize,
    },
    /// A cube of `size` intervals per edge whose outer texels lie on the edges.
    Cube {
        /// Intervals per edge.
        size: usize,
    },
}

impl Grid {
    /// Number of texels.
    pub fn texels(self) -> usize {
        match self {
            Self::Globe { rows, columns } => rows * columns,
            Self::Cube { size } => 6 * (size + 1) * (size + 1),
        }
    }

    /// Direction of a texel.
    pub fn direction(self, k: usize) -> [f32; 3] {
        match self {
            Self::Globe { rows, columns } => {
                let alpha = PI * (k / columns) as f32 / (rows - 1) as f32;
                let beta = 2.0 * PI * (((k % columns) as f32 + 0.5) / columns as f32 - 0.5);
                [alpha.sin() * beta.cos(), alpha.cos(), alpha.sin() * beta.sin()]
            }
            Self::Cube { size } => {
                let n = size + 1;
                direction(size, k / (n * n), k % n, k / n % n).as_vec3().to_array()
            }
        }
    }

    fn shape(self) -> Vec<usize> {
        match self {
            Self::Globe { rows, columns } => vec![rows, columns],
            Self::Cube { size } => vec![6, size + 1, size + 1],
        }
    }

    fn of_shape(shape: &[usize]) -> Option<Self> {
        match *shape {
            [rows, columns] if rows >= 2 && columns >= 1 => Some(Self::Globe { rows, columns }),
            [6, a, b] if a == b && a >= 2 => Some(Self::Cube { size: a - 1 }),
            _ => None,
        }
    }
}

/// Four texels and their weights.
#[derive(Debug, Clone, Copy)]
pub struct Taps {
    /// Texels.
    pub at: [usize; 4],
    /// Weights, sum 1.
    pub weight: [f32; 4],
}

impl Taps {
    #[inline(always)]
    fn bilinear(at: [usize; 4], u: f32, v: f32) -> Self {
        Self { at, weight: [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v] }
    }

    /// Taps of a globe at u and v of lat-long images, both in [0, 1].
    #[inline(always)]
    pub fn globe(rows: usize, columns: usize, [u, v]: [f32; 2]) -> Self {
        let x = u * columns as f32 - 0.5;
        let x = if x < 0.0 { x + columns as f32 } else { x };
        let y = v.clamp(0.0, 1.0) * (rows - 1) as f32;
        let (i, j) = ((x as usize).min(columns - 1), (y as usize).min(rows - 2));
        let e = if i + 1 == columns { 0 } else { i + 1 };
        let row = j * columns;
        let at = [row + i, row + e, row + columns + i, row + columns + e];
        Self::bilinear(at, x - i as f32, y - j as f32)
    }

    /// Taps of a cube along a direction of any length.
    #[inline(always)]
    pub fn cube(size: usize, d: [f32; 3]) -> Self {
        let (face, s, t) = face_position(d);
        let last = size as f32;
        let (x, y) = (s.clamp(0.0, 1.0) * last, t.clamp(0.0, 1.0) * last);
        let (i, j) = ((x as usize).min(size - 1), (y as usize).min(size - 1));
        let k = (face * (size + 1) + j) * (size + 1) + i;
        Self::bilinear([k, k + 1, k + size + 1, k + size + 2], x - i as f32, y - j as f32)
    }
}

/// Functions on one grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Bundle {
    grid: Grid,
    terms: usize,
    /// Texel after texel: reds, greens, blues of all terms.
    texels: Vec<f32>,
}

impl Bundle {
    /// Texel after texel: `terms` reds, greens and blues; `None` where lengths do not fit.
    pub fn new(grid: Grid, terms: usize, texels: Vec<f32>) -> Option<Self> {
        let whole = (1..=MAX_TERMS).contains(&terms) && texels.len() == grid.texels() * 3 * terms;
        whole.then_some(Self { grid, terms, texels })
    }

    /// Functions given as planes: red, green, blue of each in turn.
    pub fn from_planes(grid: Grid, planes: &[[&[f32]; 3]]) -> Option<Self> {
        let (n, terms) = (grid.texels(), planes.len());
        if planes.iter().flatten().any(|p| p.len() != n) {
            return None;
        }
        let mut texels = vec![0.0; n * 3 * terms];
        texels.par_chunks_mut((3 * terms).max(1)).with_min_len(1 << 10).enumerate().for_each(|(i, texel)| {
            for (k, plane) in planes.iter().enumerate() {
                (0..3).for_each(|c| texel[c * terms + k] = plane[c][i]);
            }
        });
        Self::new(grid, terms, texels)
    }

    /// The grid.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Number of functions.
    pub fn terms(&self) -> usize {
        self.terms
    }

    /// Texel after texel: reds, greens, blues of all terms.
    pub fn texels(&self) -> &[f32] {
        &self.texels
    }

    /// Bytes of the texels.
    pub fn bytes(&self) -> usize {
        4 * self.texels.len()
    }

    /// Rounds every value to 16 bits.
    pub fn halve(&mut self) {
        let half = |x: &f32| half::f16::from_f32(*x).to_f32();
        self.texels.iter_mut().for_each(|x| *x = half(x));
    }

    /// Σ_k weight_k · (value of function k at the taps), red, green, blue.
    #[inline(always)]
    pub fn sum(&self, taps: Taps, weight: &[f32; MAX_TERMS]) -> [f32; 3] {
        let (n, run) = (self.terms, 3 * self.terms);
        let weight = &weight[..n];
        let [a, b, c, d] = taps.at.map(|t| &self.texels[t * run..(t + 1) * run]);
        let [wa, wb, wc, wd] = taps.weight;
        let mut out = [0.0; 3];
        for (ch, out) in out.iter_mut().enumerate() {
            let r = ch * n..(ch + 1) * n;
            let (a, b, c, d) = (&a[r.clone()], &b[r.clone()], &c[r.clone()], &d[r]);
            let mut sums = [0.0f32; 4];
            let whole = n / 4 * 4;
            let mut k = 0;
            while k < whole {
                for (j, s) in sums.iter_mut().enumerate() {
                    let k = k + j;
                    *s += weight[k] * (wa * a[k] + wb * b[k] + wc * c[k] + wd * d[k]);
                }
                k += 4;
            }
            for k in whole..n {
                sums[k - whole] += weight[k] * (wa * a[k] + wb * b[k] + wc * c[k] + wd * d[k]);
            }
            *out = (sums[0] + sums[1]) + (sums[2] + sums[3]);
        }
        out
    }

    /// Sum of all functions as one function on the same grid; `weigh` computes the weights at each texel's
    /// direction.
    pub fn summed(&self, weigh: impl Fn([f32; 3], &mut [f32; MAX_TERMS]) + Sync) -> Self {
        let (n, grid) = (self.terms, self.grid);
        let mut texels = vec![0.0; 3 * grid.texels()];
        let sum = |k: usize, to: &mut [f32]| {
            let mut weight = [0.0; MAX_TERMS];
            weigh(grid.direction(k), &mut weight);
            let runs = self.texels[3 * n * k..3 * n * (k + 1)].chunks_exact(n);
            for (to, run) in to.iter_mut().zip(runs) {
                *to = run.iter().zip(&weight).map(|(a, b)| a * b).sum();
            }
        };
        texels.par_chunks_exact_mut(3).enumerate().for_each(|(k, to)| sum(k, to));
        // As many texels as the grid has, of three numbers each.
        Self { grid, terms: 1, texels }
    }

    /// Adds the bundle to a file as a tensor [grid …, 3, terms], of 16-bit floats where `halves`, else of
    /// 32-bit ones.
    pub fn save(&self, to: &mut TensorFile, name: String, halves: bool) {
        let mut shape = self.grid.shape();
        shape.extend([3, self.terms]);
        let data = if halves {
            TensorData::F16(self.texels.iter().map(|x| half::f16::from_f32(*x)).collect())
        } else {
            TensorData::F32(self.texels.clone())
        };
        to.tensors.insert(name, Tensor { shape, data });
    }

    /// Reads a bundle that [`Bundle::save`] wrote.
    pub fn load(from: &TensorFile, name: &str) -> Result<Self, PartError> {
        let bad = || PartError::Unexpected(name.into());
        let t = from.tensors.get(name).ok_or_else(|| PartError::Missing(name.into()))?;
        let [grid @ .., 3, terms] = &t.shape[..] else { return Err(bad()) };
        let texels = match &t.data {
            TensorData::F32(v) => v.clone(),
            TensorData::F16(v) => v.iter().map(|x| x.to_f32()).collect(),
            _ => return Err(bad()),
        };
        Self::new(Grid::of_shape(grid).ok_or_else(bad)?, *terms, texels).ok_or_else(bad)
    }

    /// Does the file hold this bundle in 16 bits?
    pub fn is_half(from: &TensorFile, name: &str) -> bool {
        from.tensors.get(name).is_some_and(|t| matches!(t.data, TensorData::F16(_)))
    }

    /// Does it lie on a globe?
    pub fn is_globe(&self) -> bool {
        matches!(self.grid, Grid::Globe { .. })
    }

    /// Taps along unit `d`.
    #[inline(always)]
    pub fn taps(&self, d: [f32; 3]) -> Taps {
        match self.grid {
            Grid::Globe { rows, columns } => Taps::globe(rows, columns, globe_uv(d)),
            Grid::Cube { size } => Taps::cube(size, d),
        }
    }

    /// As a GPU table, one layer (six for cubes) per function.
    pub fn table(&self, name: &'static str) -> Table {
        let (shape, width, height, faces) = match self.grid {
            Grid::Globe { rows, columns } => (Shape::GlobeStack, columns, rows, 1),
            Grid::Cube { size } => (Shape::CubeStack, size + 1, size + 1, 6),
        };
        let run = 3 * self.terms;
        let mut bytes = Vec::with_capacity(self.texels.len() / 3 * 16);
        for k in 0..self.terms {
            for t in self.texels.chunks_exact(run) {
                let texel = [t[k], t[self.terms + k], t[2 * self.terms + k], 1.0];
                bytes.extend(texel.iter().flat_map(|x| x.to_le_bytes()));
            }
        }
        let level = Level { width, height, layers: faces * self.terms, bytes };
        Table { name, shape, format: Format::Rgba32Float, level }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn globe(rows: usize, columns: usize) -> Bundle {
        let at = |k: usize| {
            let (a, b) = (
                std::f64::consts::PI * (k / columns) as f64 / (rows - 1) as f64,
                2.0 * std::f64::consts::PI * (((k % columns) as f64 + 0.5) / columns as f64 - 0.5),
            );
            DVec3::new(a.sin() * b.cos(), a.cos(), a.sin() * b.sin())
        };
        let f = |c: usize| (0..rows * columns).map(|k| f(at(k))[c] as f32).collect::<Vec<_>>();
        let (r, g, b) = (f(0), f(1), f(2));
        Bundle::from_planes(Grid::Globe { rows, columns }, &[[&r, &g, &b], [&g, &b, &r]]).unwrap()
    }

    fn f(d: DVec3) -> [f64; 3] {
        [1.0 + d.x * d.y, d.z, (d.x - 0.5 * d.z).exp()]
    }

    #[test]
    fn a_lookup_sums_the_terms() {
        let bundle = globe(65, 128);
        let mut w = [0.0; MAX_TERMS];
        (w[0], w[1]) = (2.0, 3.0);
        for k in 0..200 {
            let d = steradian_prefilter::probe::direction(k, 200);
            let uv = globe_uv(d.as_vec3().to_array());
            let got = bundle.sum(Taps::globe(65, 128, uv), &w);
            let want = f(d);
            for c in 0..3 {
                let want = 2.0 * want[c] + 3.0 * want[(c + 1) % 3];
                assert!((f64::from(got[c]) - want).abs() < 8e-3, "{d}: {got:?} {want}");
            }
        }
    }

    #[test]
    fn files_keep_it_and_refuse_others() {
        let mut bundle = globe(5, 8);
        let mut file = TensorFile::default();
        bundle.save(&mut file, "whole".into(), false);
        assert_eq!(Bundle::load(&file, "whole"), Ok(bundle.clone()));
        bundle.halve();
        bundle.save(&mut file, "half".into(), true);
        assert_eq!(Bundle::load(&file, "half"), Ok(bundle));
        file.tensors.get_mut("half").unwrap().shape = vec![1, 1];
        assert!(Bundle::load(&file, "half").is_err() && Bundle::load(&file, "none").is_err());
    }
}

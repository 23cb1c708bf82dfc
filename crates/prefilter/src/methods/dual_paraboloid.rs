//! Planar convolution of two paraboloids, once with the smallest radius and once with the largest.
//!
//! Kautz, Vázquez, Heidrich & Seidel 2000; Kautz 2004 (STAR), 7.4.2. The paraboloid map is conformal: small disks stay
//! disks, of radius (1 + ρ²)/2 · R_L in the map (dθ = 2 dρ/(1 + ρ²)), R_S = R_L/2 in the middle and R_L at the rim. "They
//! blend between both … the value depends only on the distance d and is always d²": B = (1 − ρ²) S + ρ² L. More
//! than two radii blend between neighbours and remove that part of the error; the bending of wide disks stays. Each
//! map reaches beyond its rim by the largest radius. Wide kernels are cut at 60°.

use super::grid::each;
use super::table::Table;
use super::{Card, Cost, Made, Shape, reach};
use crate::{Sampled, Zonal};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_sphere::Layout;

pub(super) const CARD: Card = Card {
    name: "dual-paraboloid",
    source: "Kautz, Vázquez, Heidrich & Seidel 2000; Kautz 2004, 7.4.2",
    equation: "(1 − ρ²) S + ρ² L, planar convolutions with radii R_S and R_L = 2 R_S",
    exact_when: "the lobe narrows and the radii are many: wide disks bend, and blends are not disks",
};

/// Smallest radius of the kernel, in texels of the map.
pub(super) const TEXELS: usize = 12;
/// Radii that are blended.
pub(super) const RADII: usize = 2;
/// Part of the kernel beyond its radius, and the largest radius, radians.
const CUT: f64 = 2e-3;
const FARTHEST: f64 = PI / 3.0;
/// Texels a side at most.
const LARGEST: usize = 1024;

/// By planar convolution of paraboloids; the kernel's smallest radius is `texels` of the map's, and `radii` ≥ 2 are
/// blended.
pub fn dual_paraboloid(
    light: &Sampled,
    kernel: &dyn Zonal,
    shape: Shape,
    (texels, radii): (usize, usize),
    task: &Task,
) -> Result<Made, Cancelled> {
    let angle = reach(kernel, CUT).min(FARTHEST);
    // In the middle an angle θ is θ/2 of the map.
    let texel = (0.5 * angle / texels as f64).max(2.0 * (1.0 + angle) / LARGEST as f64);
    let border = (angle / texel).ceil() as usize + 3;
    let side = 2 * ((1.0 / texel).ceil() as usize + border);
    let grid = Grid { texel, side };
    let source = grid.source(light);
    let table = Table::new(kernel, angle);
    let stencils: Vec<Stencil> = (0..radii.max(2))
        .map(|k| Stencil::new(&table, angle, 2.0 * texel / (1.0 + k as f64 / (radii.max(2) - 1) as f64)))
        .collect();
    let k0 = kernel.coefficients(0)[0];
    let (maps, cost) = grid.filter(&source, &stencils, k0, task)?;
    let mut made = each(shape, "looking the maps up", task, |d| (grid.bilinear(&maps, d), Cost::default()))?;
    made.cost = made.cost + cost;
    Ok(made)
}

/// Two square maps, front +Z and back −Z, that reach beyond their rims.
struct Grid {
    texel: f64,
    side: usize,
}

type Map = Vec<[f32; 3]>;

impl Grid {
    fn at(&self, k: usize) -> f64 {
        (k as f64 + 0.5 - 0.5 * self.side as f64) * self.texel
    }

    /// The light at the texels, from a cube map whose texels are as large as the map's are halfway out.
    fn source(&self, light: &Sampled) -> [Map; 2] {
        let n = ((4.0 * PI / 6.0).sqrt() / (1.5 * self.texel)).ceil() as usize;
        let n = n.clamp(8, 2 * light.image.height);
        let cube = light.mirror(Layout::Cube, n, n);
        [1.0, -1.0].map(|sign| {
            let texel = |k: usize| cube.bilinear(self.direction(sign, k % self.side, k / self.side));
            (0..self.side * self.side).into_par_iter().map(texel).collect()
        })
    }

    fn direction(&self, sign: f64, i: usize, j: usize) -> DVec3 {
        let (s, t) = (self.at(i), self.at(j));
        let r2 = s * s + t * t;
        DVec3::new(2.0 * s, 2.0 * t, sign * (1.0 - r2)) / (1.0 + r2)
    }

    /// Every texel within the rims: the blend of the two radii around its own.
    fn filter(
        &self,
        source: &[Map; 2],
        stencils: &[Stencil],
        k0: f64,
        task: &Task,
    ) -> Result<([Map; 2], Cost), Cancelled> {
        let row = |r: usize| {
            task.check()?;
            let (from, j) = (&source[r / self.side], r % self.side);
            let (mut out, mut taps) = (vec![[0.0; 3]; self.side], 0);
            for (i, v) in out.iter_mut().enumerate() {
                let rho = self.at(i).hypot(self.at(j));
                if rho > 1.0 + 2.0 * self.texel {
                    continue;
                }
                let x = (rho * rho).min(1.0) * (stencils.len() - 1) as f64;
                let k = (x as usize).min(stencils.len() - 2);
                let (small, large) = (&stencils[k], &stencils[k + 1]);
                let (s, l) = (small.sum(from, self.side, i, j), large.sum(from, self.side, i, j));
                let t = x - k as f64;
                *v = std::array::from_fn(|c| (k0 * (s[c] + (l[c] - s[c]) * t)) as f32);
                taps += small.taps + large.taps;
            }
            Ok((out, taps))
        };
        let rows: Result<Vec<_>, Cancelled> = (0..2 * self.side).into_par_iter().map(row).collect();
        let (mut maps, mut cost) = ([Map::new(), Map::new()], Cost::default());
        for (r, (row, taps)) in rows?.into_iter().enumerate() {
            maps[r / self.side].extend(row);
            cost = cost + Cost { kernel: 0, taps };
        }
        Ok((maps, cost))
    }

    fn bilinear(&self, maps: &[Map; 2], d: DVec3) -> [f64; 3] {
        let map = &maps[usize::from(d.z < 0.0)];
        let axis = |v: f64| {
            let x = v / (1.0 + d.z.abs()) / self.texel + 0.5 * self.side as f64 - 0.5;
            (x as usize, x - x.floor())
        };
        let ((i, u), (j, v)) = (axis(d.x), axis(d.y));
        let texel = |i: usize, j: usize| map[j * self.side + i].map(f64::from);
        let (a, b, c, e) = (texel(i, j), texel(i + 1, j), texel(i, j + 1), texel(i + 1, j + 1));
        std::array::from_fn(|k| {
            let (top, bottom) = (a[k] + (b[k] - a[k]) * u, c[k] + (e[k] - c[k]) * u);
            top + (bottom - top) * v
        })
    }
}

/// Weights of the texels around one, of sum 1, row by row.
struct Stencil {
    rows: Vec<Vec<f32>>,
    taps: u64,
}

impl Stencil {
    /// A kernel where a texel spans `step` radians.
    fn new(table: &Table, angle: f64, step: f64) -> Self {
        let radius = angle / step;
        let n = radius.floor() as i64;
        let weight = |x: i64, y: i64| {
            let theta = ((x * x + y * y) as f64).sqrt() * step;
            table.at((2.0 * (0.5 * theta).sin()).powi(2))
        };
        let half = |y: i64| (radius * radius - (y * y) as f64).max(0.0).sqrt().floor() as i64;
        let rows: Vec<Vec<f64>> =
            (-n..=n).map(|y| (-half(y)..=half(y)).map(|x| weight(x, y)).collect()).collect();
        let sum: f64 = rows.iter().flatten().sum();
        let taps = rows.iter().map(Vec::len).sum::<usize>() as u64;
        let scaled = |r: Vec<f64>| r.into_iter().map(|w| (w / sum) as f32).collect();
        Self { rows: rows.into_iter().map(scaled).collect(), taps }
    }

    fn sum(&self, map: &Map, side: usize, i: usize, j: usize) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let top = j - self.rows.len() / 2;
        for (y, row) in self.rows.iter().enumerate() {
            let start = (top + y) * side + i - row.len() / 2;
            let mut part = [0.0_f32; 3];
            for (w, l) in row.iter().zip(&map[start..start + row.len()]) {
                (0..3).for_each(|c| part[c] += w * l[c]);
            }
            (0..3).for_each(|c| sum[c] += f64::from(part[c]));
        }
        sum
    }
}

//! Planar convolution of two paraboloids, once with the smallest radius and once with the largest.
//!
//! Kautz, Vázquez, Heidrich & Seidel 2000; Kautz 2004 (STAR), 7.4.2. The paraboloid map is conformal: small
//! disks stay disks, of radius (1 + ρ²)/2 · R_L in the map (dθ = 2 dρ/(1 + ρ²)), R_S = R_L/2 in the middle
//! and R_L at the rim. "They blend between both … the value depends only on the distance d and is always d²":
//! B = (1 − ρ²) S + ρ² L. More than two radii blend between neighbours and remove that part of the error; the
//! bending of wide disks stays. Each map reaches beyond its rim by the largest radius. Wide kernels are cut
//! at 60°.
//!
//! Texels count alike. Outwards they stand for less solid angle, but a disk that is drawn in the plane also
//! falls off faster there than the kernel does on the sphere: the two errors nearly cancel, and weighing
//! texels by their solid angle alone is worse.

use super::grid::each;
use super::table::Table;
use super::{Card, Cost, Made, Shape, reach};
use crate::{Sampled, SmallLight, Zonal};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
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
/// Part of the kernel beyond its radius: what is left is normalised, so that the cut shows only where the
/// light beyond is much brighter.
const CUT: f64 = 2e-3;
/// Largest radius, radians. The maps reach as far beyond their rims, so that this one makes them (1 + π/3)² =
/// 4.2 times as large; and from a kernel's axis to 60° the angle of a texel falls by a quarter, so that much
/// wider disks would be none on the sphere.
const MAX_RADIUS: f64 = PI / 3.0;
/// Texels a side at most, across the disk and a kernel's radius on both sides: two maps of 12 bytes a texel
/// come to 24 MiB.
const MAX_SIDE: usize = 1024;

/// Mapping of a kernel onto paraboloids.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footprint {
    /// Smallest radius of the kernel, in texels of the map.
    pub texels: usize,
    /// Radii ≥ 2 that are blended; the paper has two.
    pub radii: usize,
    /// Largest radius of the kernel, radians: wider ones are cut.
    pub farthest: f64,
    /// Texels across the disk of the result; 0: those of the filter.
    pub size: usize,
}

impl Default for Footprint {
    fn default() -> Self {
        Self { texels: TEXELS, radii: RADII, farthest: MAX_RADIUS, size: 0 }
    }
}

/// Filters by planar convolution of two paraboloids. The kernel's smallest radius is `texels` texels of the
/// map; results of `radii` ≥ 2 radii are blended.
pub fn dual_paraboloid(
    light: &Sampled,
    kernel: &dyn Zonal,
    shape: Shape,
    (texels, radii): (usize, usize),
    task: &Task,
) -> Result<Made, Cancelled> {
    let rows = light.image.height;
    let lookup = |n: usize| -> Lookup {
        let n = n.min(2 * rows).max(8);
        let cube = light.mirror(Layout::Cube, n, n);
        Box::new(move |d| cube.bilinear(d))
    };
    let footprint = Footprint { texels, radii, ..Footprint::default() };
    let (maps, cost) = paraboloids(&lookup, &[], kernel, &footprint, task)?;
    let mut made = each(shape, "looking the maps up", task, |d| (maps.bilinear(d), Cost::default()))?;
    made.cost = made.cost + cost;
    Ok(made)
}

/// Radiance from a direction.
pub type Lookup = Box<dyn Fn(DVec3) -> [f32; 3] + Sync>;

/// ∫ L K over d as two paraboloids. `light` gives a lookup in texels like those of a cube of n × n; the flux
/// of each part of `small_lights` is distributed over the four texels around it.
pub fn paraboloids(
    light: &dyn Fn(usize) -> Lookup,
    small_lights: &[SmallLight],
    kernel: &dyn Zonal,
    footprint: &Footprint,
    task: &Task,
) -> Result<(Paraboloids, Cost), Cancelled> {
    let angle = reach(kernel, CUT).min(footprint.farthest);
    let radii = footprint.radii.max(2);
    // In the middle an angle θ is θ/2 of the map.
    let texel = (0.5 * angle / footprint.texels.max(1) as f64).max(2.0 * (1.0 + angle) / MAX_SIDE as f64);
    let target = if footprint.size > 0 { 2.0 / footprint.size as f64 } else { texel };
    // Lookups read two texels of the result beyond the rim, and there the kernel as much again as its radius.
    let rim = 1.0 + 3.0 * texel.max(target);
    let border = ((angle + rim - 1.0) / texel).ceil() as usize + 2;
    let grid = Grid { texel, side: 2 * ((1.0 / texel).ceil() as usize + border) };
    let source = grid.source(light, small_lights);
    let table = Table::new(kernel, angle);
    let stencils: Vec<Stencil> = (0..radii)
        .map(|k| Stencil::new(&table, angle, 2.0 * texel / (1.0 + k as f64 / (radii - 1) as f64)))
        .collect();
    let k0 = kernel.coefficients(0)[0];
    let (maps, cost) = grid.filter(&source, &stencils, (k0, rim), task)?;
    let whole = Paraboloids { grid, maps };
    Ok((if footprint.size > 0 { whole.resampled(target) } else { whole.cropped() }, cost))
}

/// Two square maps, front +Z and back −Z, (x, y)/(1 + |z|) from −extent to +extent at their outermost texel
/// centres.
#[derive(Debug, Clone, PartialEq)]
pub struct Paraboloids {
    grid: Grid,
    maps: [Map; 2],
}

impl Paraboloids {
    /// Texels a side.
    pub fn side(&self) -> usize {
        self.grid.side
    }

    /// Coordinate of the outermost texel centres, > 1.
    pub fn extent(&self) -> f64 {
        self.grid.at(self.grid.side - 1)
    }

    /// Front and back, rows of growing y.
    pub fn planes(&self) -> &[Vec<[f32; 3]>; 2] {
        &self.maps
    }

    /// Bilinear lookup.
    pub fn bilinear(&self, d: DVec3) -> [f64; 3] {
        let r = 1.0 + d.z.abs();
        self.at(usize::from(d.z < 0.0), d.x / r, d.y / r)
    }

    fn at(&self, map: usize, s: f64, t: f64) -> [f64; 3] {
        let (map, side) = (&self.maps[map], self.grid.side);
        let axis = |v: f64| {
            let x = (v / self.grid.texel + 0.5 * side as f64 - 0.5).clamp(0.0, (side - 1) as f64);
            let i = (x as usize).min(side - 2);
            (i, x - i as f64)
        };
        let ((i, u), (j, v)) = (axis(s), axis(t));
        let texel = |i: usize, j: usize| map[j * side + i].map(f64::from);
        let (a, b, c, e) = (texel(i, j), texel(i + 1, j), texel(i, j + 1), texel(i + 1, j + 1));
        std::array::from_fn(|k| {
            let (top, bottom) = (a[k] + (b[k] - a[k]) * u, c[k] + (e[k] - c[k]) * u);
            top + (bottom - top) * v
        })
    }

    /// The texels that lookups reach.
    fn cropped(&self) -> Self {
        self.made(self.grid.texel, |map, k, side| {
            let border = (self.grid.side - side) / 2;
            self.maps[map][(k / side + border) * self.grid.side + k % side + border]
        })
    }

    /// The maps resampled at a spacing of `texel`.
    fn resampled(&self, texel: f64) -> Self {
        let grid = |side| Grid { texel, side };
        self.made(texel, |map, k, side| {
            self.at(map, grid(side).at(k % side), grid(side).at(k / side)).map(|v| v as f32)
        })
    }

    /// Maps that reach two texels beyond the rim: one for bilinear lookups and one more.
    fn made(&self, texel: f64, f: impl Fn(usize, usize, usize) -> [f32; 3]) -> Self {
        let side = 2 * ((1.0 / texel).ceil() as usize + 2);
        let maps = [0, 1].map(|map| (0..side * side).map(|k| f(map, k, side)).collect());
        Self { grid: Grid { texel, side }, maps }
    }
}

/// Texels of two square maps that reach beyond their rims.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Grid {
    texel: f64,
    side: usize,
}

type Map = Vec<[f32; 3]>;

impl Grid {
    fn at(&self, k: usize) -> f64 {
        (k as f64 + 0.5 - 0.5 * self.side as f64) * self.texel
    }

    /// Solid angle of a texel.
    fn omega(&self, i: usize, j: usize) -> f64 {
        let (s, t) = (self.at(i), self.at(j));
        (2.0 * self.texel / (1.0 + s * s + t * t)).powi(2)
    }

    /// The light at the texels, from a cube map whose texels are as large as the map's are halfway out.
    fn source(&self, light: &dyn Fn(usize) -> Lookup, small_lights: &[SmallLight]) -> [Map; 2] {
        let lookup = light(((4.0 * PI / 6.0).sqrt() / (1.5 * self.texel)).ceil() as usize);
        let mut maps = [1.0, -1.0].map(|sign| {
            let texel = |k: usize| lookup(self.direction(sign, k % self.side, k / self.side));
            (0..self.side * self.side).into_par_iter().map(texel).collect::<Map>()
        });
        for small_light in small_lights {
            let rings = (2.0 * small_light.radius / self.texel).ceil().clamp(1.0, 64.0) as usize;
            small_light.nodes(rings, 4 * rings, |d, part| {
                for (map, z) in maps.iter_mut().zip([d.z, -d.z]) {
                    self.shares(d, z, |i, j, share| {
                        let l = part * share / self.omega(i, j);
                        let to = &mut map[j * self.side + i];
                        (0..3).for_each(|c| to[c] += (small_light.flux[c] * l) as f32);
                    });
                }
            });
        }
        maps
    }

    /// The four texels around a direction and their bilinear weights, where the map (of the pole at `z` = 1)
    /// has them.
    fn shares(&self, d: DVec3, z: f64, mut put: impl FnMut(usize, usize, f64)) {
        let axis = |v: f64| v / (1.0 + z) / self.texel + 0.5 * self.side as f64 - 0.5;
        let (x, y) = (axis(d.x), axis(d.y));
        let inside = |v: f64| (0.0..(self.side - 1) as f64).contains(&v);
        if z > -0.99 && inside(x) && inside(y) {
            let (i, j) = (x as usize, y as usize);
            let (u, v) = (x - i as f64, y - j as f64);
            for (a, b, w) in
                [(0, 0, (1.0 - u) * (1.0 - v)), (1, 0, u * (1.0 - v)), (0, 1, (1.0 - u) * v), (1, 1, u * v)]
            {
                put(i + a, j + b, w);
            }
        }
    }

    fn direction(&self, sign: f64, i: usize, j: usize) -> DVec3 {
        let (s, t) = (self.at(i), self.at(j));
        let r2 = s * s + t * t;
        DVec3::new(2.0 * s, 2.0 * t, sign * (1.0 - r2)) / (1.0 + r2)
    }

    /// Every texel within `rim`: the blend of the two radii around its own.
    fn filter(
        &self,
        source: &[Map; 2],
        stencils: &[Stencil],
        (k0, rim): (f64, f64),
        task: &Task,
    ) -> Result<([Map; 2], Cost), Cancelled> {
        let row = |r: usize| {
            task.check()?;
            let (from, j) = (&source[r / self.side], r % self.side);
            let (mut out, mut taps) = (vec![[0.0; 3]; self.side], 0);
            let reach = stencils.iter().map(|s| s.rows.len() / 2).max().unwrap_or(0);
            let within = reach..self.side.saturating_sub(reach);
            for (i, v) in out.iter_mut().enumerate() {
                let rho = self.at(i).hypot(self.at(j));
                if rho > rim || !within.contains(&i) || !within.contains(&j) {
                    continue;
                }
                let x = (rho * rho).min(1.0) * (stencils.len() - 1) as f64;
                let k = (x as usize).min(stencils.len() - 2);
                let (small, large) = (&stencils[k], &stencils[k + 1]);
                let (s, l) = (small.mean(from, self.side, i, j), large.mean(from, self.side, i, j));
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

    /// The weighted mean about texel (i, j).
    fn mean(&self, map: &Map, side: usize, i: usize, j: usize) -> [f64; 3] {
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

//! Decomposition of light into a few small lights and a smooth rest, chosen for a kernel.
//!
//! Light is R = Σ_k Φ_k D(ω_k) + rest, with D a small disk of unit flux. Truncating kernels after some bands
//! has the squared error Σ_l w_l Σ_m R_lm², so directions are found one by one where a disk reduces that norm
//! most (matching pursuit, Mallat & Zhang 1993, in a weighted norm): the score of ω is |c(ω)|²/G(0) with
//! c(ω) = Σ_lm w_l b_l R_lm Y_lm(ω), and a disk at ω_k takes Φ_k G(∠ω, ω_k) out of c, G(γ) = Σ_l (2l + 1)/4π
//! w_l b_l² P_l(cos γ), b_l the disk's own coefficients. Finally the fluxes of all disks are fitted together
//! by least squares. The decomposition is exact: the rest is R less the disks, whatever these are.

use crate::SmallLight;
use glam::DVec3;
use std::f64::consts::PI;
use std::ops::Range;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel, Single, Vector, run};
use steradian_sphere::sh::{self, Basis, ShRgb, zonal};
use steradian_sphere::{Layout, SphereImage};

/// Rows of the grid of directions per band: three to the shortest wave. With 48 disks to band 63, half as
/// many leave 0.34 of a sun's weighted norm in place of 0.031, and 0.50 in place of 0.36 of a church's; twice
/// as many, of four times the texels, leave 0.008 of the sun, and 4 % less at most of four other
/// environments.
const ROWS_PER_BAND: f64 = 1.5;
/// Where a disk's response is below this part of its peak, it is not subtracted from the field of scores. A
/// tenth finds the same disks in five environments; ten times as much leaves up to 7 % more.
const MIN_RESPONSE: f64 = 1e-3;
/// Entries of the table of G. Half as many leave 2 % more under a sun; twice as many find the same disks in
/// five environments.
const TABLE_ENTRIES: usize = 4096;
/// Rounds per disk at most: one that lies on another adds to it. One and four rounds give the same lights in
/// five environments; the second is spent only where disks pile up, in a fraction of a second.
const MAX_ROUNDS_PER_DISK: usize = 2;
/// Smallest distance of disks, in shortest waves: closer ones have nearly the same response. Twice as far
/// leaves 2.6 times as much of a sun and 1.6 times as much of a church; half as far leaves 0.8 times as much
/// of the sun, with four times as many disks.
const MIN_DISTANCE_IN_WAVES: f64 = 0.3;
/// Part of G(0) that is added to the diagonal of the normal equations, so that neighbours do not cancel each
/// other. A tenth and twice change what is left by less than 0.5 %; ten times as much takes 1.3 % from the
/// flux of a sun and leaves 6 % more.
const RIDGE: f64 = 1e-3;
/// Rounds in which disks of negative flux are left out; two are enough in five environments.
const MAX_SIGN_ROUNDS: usize = 4;

/// Directions of small disks, in the order in which they were found.
#[derive(Debug, Clone)]
pub struct MatchingPursuit {
    weight: Vec<f64>,
    spread: Vec<f64>,
    radius: f64,
    reach: Vec<f64>,
    directions: Vec<DVec3>,
}

impl MatchingPursuit {
    /// Up to `most` disks of angular radius `radius` (radians) for `light`, in the norm of `weight` by band.
    /// Fewer where nothing is left.
    pub fn new(
        light: &ShRgb,
        weight: &[f64],
        radius: f64,
        most: usize,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        let order = light.order.min(weight.len().saturating_sub(1));
        let spread = SmallLight { direction: DVec3::Y, radius, flux: [1.0; 3], cell: None }.spread(order);
        let weight = weight[..=order].to_vec();
        let k: Vec<f64> = weight.iter().zip(&spread).map(|(w, b)| w * b * b).collect();
        let at = |i: usize| {
            let x = i as f64 / (TABLE_ENTRIES - 1) as f64;
            zonal::value(&k, 1.0 - 2.0 * x * x)
        };
        let reach = (0..TABLE_ENTRIES).map(at).collect();
        let mut made = Self { weight, spread, radius, reach, directions: Vec::new() };
        if made.reach[0] > 0.0 {
            made.search(light, most, task)?;
        }
        Ok(made)
    }

    /// Number of disks.
    pub fn len(&self) -> usize {
        self.directions.len()
    }

    /// None at all?
    pub fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }

    /// G at the angle whose half has this sine.
    fn gram(&self, half_sine: f64) -> f64 {
        let x = half_sine.min(1.0) * (TABLE_ENTRIES - 1) as f64;
        let i = (x as usize).min(TABLE_ENTRIES - 2);
        let t = x - i as f64;
        self.reach[i] + (self.reach[i + 1] - self.reach[i]) * t
    }

    fn search(&mut self, light: &ShRgb, most: usize, task: &Task) -> Result<(), Cancelled> {
        let mut field = Field::new(&self.filtered(light), self.weight.len());
        let table: Vec<f32> = self.reach.iter().map(|g| *g as f32).collect();
        let first = field.best().map_or(0.0, |b| b.0);
        let small = MIN_RESPONSE * self.reach[0];
        let last = self.reach.iter().rposition(|g| g.abs() > small).unwrap_or(0);
        let reach = ((last + 1) as f64 / (TABLE_ENTRIES - 1) as f64).min(1.0);
        let apart = MIN_DISTANCE_IN_WAVES * 2.0 * PI / self.weight.len() as f64;
        for _ in 0..MAX_ROUNDS_PER_DISK * most {
            task.check()?;
            let Some((score, j, i)) = field.best() else { break };
            if self.directions.len() >= most || score <= 1e-12 * first {
                break;
            }
            let mut d = field.refined(j, i);
            let near = self.directions.iter().find(|o| (**o - d).length() < apart);
            match near {
                Some(o) => d = *o,
                None => self.directions.push(d),
            }
            let at = field.direction(j, i);
            let g = self.gram(0.5 * (at - d).length()).max(0.25 * self.reach[0]);
            let flux = field.value(j, i).map(|c| (c / g) as f32);
            field.subtract(d, flux, reach, &table);
        }
        Ok(())
    }

    /// w_l b_l R_lm.
    fn filtered(&self, light: &ShRgb) -> ShRgb {
        let order = self.weight.len() - 1;
        let mut c = light.c.each_ref().map(|c| c[..sh::count(order)].to_vec());
        for c in &mut c {
            for (l, (w, b)) in self.weight.iter().zip(&self.spread).enumerate() {
                c[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|x| *x *= w * b);
            }
        }
        ShRgb { order, c }
    }

    /// The first `count` disks with the fluxes that leave the least of `light`; those whose flux would be
    /// negative are left out.
    pub fn small_lights(&self, light: &ShRgb, count: usize) -> Vec<SmallLight> {
        let filtered = self.filtered(light);
        let basis = Basis::new(filtered.order);
        let mut y = vec![0.0; sh::count(filtered.order)];
        let mut seen = |d: &DVec3| -> (DVec3, [f64; 3]) {
            basis.eval(filtered.order, *d, &mut y);
            let value = |c: usize| filtered.c[c].iter().zip(&y).map(|(a, b)| a * b).sum();
            (*d, std::array::from_fn(value))
        };
        let mut used: Vec<(DVec3, [f64; 3])> = self.directions.iter().take(count).map(&mut seen).collect();
        let mut flux = self.least_squares(&used);
        for _ in 0..MAX_SIGN_ROUNDS {
            let positive: Vec<bool> = flux.iter().map(|f| f.iter().sum::<f64>() > 0.0).collect();
            if positive.iter().all(|p| *p) {
                break;
            }
            let kept = used.iter().zip(&positive).filter(|(_, p)| **p);
            used = kept.map(|(u, _)| *u).collect();
            flux = self.least_squares(&used);
        }
        let small_light = |((direction, _), flux): (&(DVec3, [f64; 3]), [f64; 3])| SmallLight {
            direction: *direction,
            radius: self.radius,
            flux,
            cell: None,
        };
        used.iter().zip(flux).map(small_light).collect()
    }

    /// The fluxes of disks at these directions that give c these values: Cholesky's factorisation of G(∠ω_i,
    /// ω_j) and both substitutions.
    fn least_squares(&self, used: &[(DVec3, [f64; 3])]) -> Vec<[f64; 3]> {
        let n = used.len();
        let mut x: Vec<[f64; 3]> = used.iter().map(|u| u.1).collect();
        let mut l = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..=i {
                let mut sum = self.gram(0.5 * (used[i].0 - used[j].0).length());
                if i == j {
                    sum += RIDGE * self.reach[0];
                }
                for k in 0..j {
                    sum -= l[i * n + k] * l[j * n + k];
                }
                l[i * n + j] = if i == j { sum.max(1e-9 * self.reach[0]).sqrt() } else { sum / l[j * n + j] };
            }
        }
        for c in 0..3 {
            for i in 0..n {
                let known: f64 = (0..i).map(|k| l[i * n + k] * x[k][c]).sum();
                x[i][c] = (x[i][c] - known) / l[i * n + i];
            }
            for i in (0..n).rev() {
                let known: f64 = (i + 1..n).map(|k| l[k * n + i] * x[k][c]).sum();
                x[i][c] = (x[i][c] - known) / l[i * n + i];
            }
        }
        x
    }
}

/// c over a lat-long grid, times the power of two that brings its largest value to 1 … 2: scores are squares
/// in single precision.
struct Field {
    image: SphereImage,
    width: usize,
    height: usize,
    /// The highest score of each row with its column.
    rows: Vec<(f32, usize)>,
}

impl Field {
    fn new(filtered: &ShRgb, bands: usize) -> Self {
        let height = ((ROWS_PER_BAND * bands as f64) as usize).max(8).next_multiple_of(8);
        let width = 2 * height;
        let mut image = sh::synthesize(filtered, Layout::LatLong, width, height);
        let peak = image.planes.iter().flatten().fold(f32::MIN_POSITIVE, |m, v| m.max(v.abs()));
        let scale = (-peak.log2().floor()).exp2();
        image.planes.iter_mut().flatten().for_each(|v| *v *= scale);
        let planes = &image.planes;
        let mut row = Row::default();
        let rows = (0..height)
            .map(|j| row.highest(planes.each_ref().map(|p| &p[j * width..(j + 1) * width])))
            .collect();
        Self { image, width, height, rows }
    }

    fn score(&self, j: usize, i: usize) -> f64 {
        self.value(j, i).iter().map(|c| c * c).sum()
    }

    fn value(&self, j: usize, i: usize) -> [f64; 3] {
        let k = j * self.width + i;
        std::array::from_fn(|c| f64::from(self.image.planes[c][k]))
    }

    /// The highest score, its row and column; `None` where all is 0.
    fn best(&self) -> Option<(f32, usize, usize)> {
        let (mut best, mut row) = ((0.0, 0), 0);
        for (j, r) in self.rows.iter().enumerate() {
            if r.0 > best.0 {
                (best, row) = (*r, j);
            }
        }
        (best.0 > 0.0).then_some((best.0, row, best.1))
    }

    fn at(&self, row: f64, column: f64) -> DVec3 {
        let (st, ct) = (PI * (row + 0.5) / self.height as f64).sin_cos();
        let (s, c) = (2.0 * PI * ((column + 0.5) / self.width as f64 - 0.5)).sin_cos();
        DVec3::new(st * c, ct, st * s)
    }

    fn direction(&self, j: usize, i: usize) -> DVec3 {
        self.at(j as f64, i as f64)
    }

    /// The tops of the parabolas through the scores around a maximum.
    fn refined(&self, j: usize, i: usize) -> DVec3 {
        let here = self.score(j, i);
        let top = |a: f64, b: f64| {
            let bend = a - 2.0 * here + b;
            if bend < 0.0 { (0.5 * (a - b) / bend).clamp(-0.5, 0.5) } else { 0.0 }
        };
        let w = self.width;
        let across = top(self.score(j, (i + w - 1) % w), self.score(j, (i + 1) % w));
        let inner = j > 0 && j + 1 < self.height;
        let along = if inner { top(self.score(j - 1, i), self.score(j + 1, i)) } else { 0.0 };
        self.at(j as f64 + along, i as f64 + across)
    }

    /// Takes a disk's part out of all that lies within half sine `reach` of it, by the table of G.
    ///
    /// Of the angle γ between directions of polar angles θ, θ' and azimuths β, β' it is sin²(γ/2) = sin²((θ −
    /// θ')/2) + sin θ sin θ' sin²((β − β')/2): a number for each row and one for each column.
    fn subtract(&mut self, d: DVec3, flux: [f32; 3], reach: f64, table: &[f32]) {
        let theta = d.y.clamp(-1.0, 1.0).acos();
        let (width, height) = (self.width, self.height);
        let middle = width as f64 * (d.z.atan2(d.x) / (2.0 * PI) + 0.5) - 0.5;
        let half_sine2 = |i: usize| (PI * (i as f64 - middle) / width as f64).sin().powi(2) as f32;
        let columns: Vec<f32> = (0..width).map(half_sine2).collect();
        let [red, green, blue] = self.image.planes.each_mut().map(|p| p.par_chunks_mut(width));
        let rows = red.zip(green).zip(blue).zip(&mut self.rows).enumerate().with_min_len(MIN_ROWS);
        rows.for_each_init(Row::default, |row, (j, (((red, green), blue), best))| {
            let at = PI * (j as f64 + 0.5) / height as f64;
            let (own, each) = ((0.5 * (at - theta)).sin().powi(2), at.sin() * theta.sin());
            if own > reach * reach {
                return;
            }
            // Columns on both sides of the disk's that are in reach.
            let far = ((reach * reach - own) / each.max(f64::MIN_POSITIVE)).min(1.0).sqrt().asin();
            let side = width as f64 * far / PI;
            let ranges = match 2.0 * side + 2.0 < width as f64 {
                true => around((middle - side).floor() as isize, (middle + side).ceil() as isize, width),
                false => [0..width, 0..0],
            };
            let mut planes = [red, green, blue];
            for range in ranges {
                row.responses(&columns[range.clone()], own as f32, each as f32, table);
                for (plane, flux) in planes.iter_mut().zip(flux) {
                    let (g, to) = (&row.g[..range.len()], &mut plane[range.clone()]);
                    to.iter_mut().zip(g).for_each(|(to, g)| *to -= flux * g);
                }
            }
            *best = row.highest(planes.each_ref().map(|p| &**p));
        });
    }
}

/// Columns from `first` to `last` around the sphere, as one or two ranges.
fn around(first: isize, last: isize, width: usize) -> [Range<usize>; 2] {
    let start = first.rem_euclid(width as isize) as usize;
    let end = start + (last - first) as usize + 1;
    [start..end.min(width), 0..end.saturating_sub(width)]
}

/// Rows that a thread takes at least. A disk that reaches all 384 rows of 256 bands takes 1.0 to 1.5 ms on
/// one core, so that 16 rows take 0.05 ms.
const MIN_ROWS: usize = 16;

/// Numbers of each column of a row, kept for the next one.
#[derive(Default)]
struct Row {
    /// Places in the table of G: whole numbers, and what is left of them.
    cells: Vec<u32>,
    parts: Vec<f32>,
    /// G.
    g: Vec<f32>,
    scores: Vec<f32>,
}

impl Row {
    /// G where sin²(γ/2) is `own` + `each` · column.
    fn responses(&mut self, columns: &[f32], own: f32, each: f32, table: &[f32]) {
        let n = columns.len();
        self.cells.resize(n.max(self.cells.len()), 0);
        self.parts.resize(n.max(self.parts.len()), 0.0);
        self.g.resize(n.max(self.g.len()), 0.0);
        let (cells, parts) = (&mut self.cells[..n], &mut self.parts[..n]);
        let last = table.len() - 2;
        run(Places { columns, own, each, last: last as f32, cells, parts });
        for ((g, cell), part) in self.g.iter_mut().zip(&*cells).zip(&*parts) {
            let k = (*cell as usize).min(last);
            *g = table[k] + (table[k + 1] - table[k]) * part;
        }
    }

    /// The highest score of a row, with its column.
    fn highest(&mut self, planes: [&[f32]; 3]) -> (f32, usize) {
        self.scores.resize(planes[0].len(), 0.0);
        let best = run(Scores { planes, out: &mut self.scores });
        (best, self.scores.iter().position(|s| *s == best).unwrap_or(0))
    }
}

/// Places in a table of equal steps of sin(γ/2) from 0 to 1, `last` + 1 of them.
struct Places<'a> {
    columns: &'a [f32],
    own: f32,
    each: f32,
    last: f32,
    cells: &'a mut [u32],
    parts: &'a mut [f32],
}

impl Kernel for Places<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let lanes = A::F32::LANES;
        let splat = A::F32::splat;
        let (own, each) = (splat(self.own), splat(self.each));
        let (steps, last) = (splat(self.last + 1.0), splat(self.last));
        let whole = self.columns.len() / lanes * lanes;
        let mut k = 0;
        while k < whole {
            let x = A::F32::load(&self.columns[k..]).fma(each, own).sqrt().mul(steps);
            let cell = x.truncate().min(last);
            cell.store_whole(&mut self.cells[k..]);
            x.sub(cell).store(&mut self.parts[k..]);
            k += lanes;
        }
        for k in whole..self.columns.len() {
            let x = (self.columns[k] * self.each + self.own).sqrt() * (self.last + 1.0);
            let cell = x.trunc().min(self.last);
            self.cells[k] = cell as u32;
            self.parts[k] = x - cell;
        }
    }
}

/// The sums of the squares of three channels; their largest.
struct Scores<'a> {
    planes: [&'a [f32]; 3],
    out: &'a mut [f32],
}

impl Kernel for Scores<'_> {
    type Output = f32;

    #[inline(always)]
    fn run<A: Arch>(self) -> f32 {
        let [red, green, blue] = self.planes;
        for (((s, r), g), b) in self.out.iter_mut().zip(red).zip(green).zip(blue) {
            *s = r * r + g * g + b * b;
        }
        let mut most = [0.0f32; 16];
        let (chunks, rest) = self.out.as_chunks::<16>();
        for chunk in chunks {
            for (m, s) in most.iter_mut().zip(chunk) {
                *m = if s > m { *s } else { *m };
            }
        }
        let mut best = 0.0f32;
        for s in most.iter().chain(rest) {
            best = if *s > best { *s } else { best };
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::add_small_lights;

    /// By haversines and a range of columns each texel gets what its distance from the disk says: near the
    /// poles, at the border of the image, in reach of everything; and the rows' highest scores are kept.
    #[test]
    fn a_disks_part_is_that_of_its_distance() {
        let g = |half_sine: f64| 1.0 / (1.0 + 40.0 * half_sine * half_sine);
        let table: Vec<f32> =
            (0..TABLE_ENTRIES).map(|k| g(k as f64 / (TABLE_ENTRIES - 1) as f64) as f32).collect();
        for d in [DVec3::X, DVec3::NEG_X, DVec3::new(0.02, 1.0, -0.01), DVec3::new(-0.3, -0.9, 0.2)] {
            let d = d.normalize();
            for reach in [0.02, 0.3, 1.0] {
                let mut field = Field::new(&ShRgb::zero(31), 32);
                field.subtract(d, [-1.0, 0.5, -2.0], reach, &table);
                for (j, i) in (0..field.height).flat_map(|j| (0..field.width).map(move |i| (j, i))) {
                    let x = 0.5 * (field.direction(j, i) - d).length();
                    let [red, green, blue] = field.value(j, i);
                    assert!(green == -0.5 * red && blue == 2.0 * red);
                    if red != 0.0 || x < reach - 1e-6 {
                        assert!((red - g(x)).abs() < 1e-6, "{d} {reach}: {red} at {x}");
                    }
                    // A column more on either side at most.
                    let near = x < reach + 2.0 * PI / field.width as f64;
                    assert!(red == 0.0 || near, "{d} {reach}: {red} at {x}");
                    assert!(field.score(j, i) <= f64::from(field.rows[j].0) * (1.0 + 1e-6));
                }
                let (score, j, i) = field.best().expect("not dark");
                assert!((field.score(j, i) / f64::from(score) - 1.0).abs() < 1e-6);
            }
        }
    }

    /// Three small lights over a smooth sky come out as they went in, and nearly nothing of the high bands is
    /// left.
    #[test]
    fn small_lights_are_found_with_their_fluxes() {
        let order = 63;
        let lights: Vec<SmallLight> = [(0.2, 0.9, -0.3, 3.0), (-0.7, 0.1, 0.6, 1.0), (0.1, -0.5, 0.8, 0.4)]
            .map(|(x, y, z, f)| SmallLight {
                direction: DVec3::new(x, y, z).normalize(),
                radius: 0.004,
                flux: [f, 0.8 * f, 0.5 * f],
                cell: None,
            })
            .to_vec();
        let mut light = ShRgb::zero(order);
        for (k, c) in [(0, 9.0), (1, 3.0), (6, 1.0), (11, 0.5)] {
            light.c.iter_mut().for_each(|to| to[k] = c);
        }
        add_small_lights(&mut light, &lights);
        let weight: Vec<f64> =
            (0..=order).map(|l| if l < 8 { 0.0 } else { 1.0 / (2 * l + 1) as f64 }).collect();
        let found = MatchingPursuit::new(&light, &weight, 0.004, 3, &Task::quiet()).expect("not cancelled");
        let mut small_lights = found.small_lights(&light, 3);
        assert_eq!(small_lights.len(), 3);
        for l in &lights {
            let b =
                small_lights.iter().find(|b| b.direction.dot(l.direction) > 0.02_f64.cos()).expect("found");
            assert!((b.flux[0] / l.flux[0] - 1.0).abs() < 0.05, "{:?} {:?}", b.flux, l.flux);
        }
        // Whatever the unit of radiance.
        for scale in [1e-24, 1e24] {
            let mut scaled = light.clone();
            scaled.c.iter_mut().flatten().for_each(|c| *c *= scale);
            let same =
                MatchingPursuit::new(&scaled, &weight, 0.004, 3, &Task::quiet()).expect("not cancelled");
            let near = |(a, b): (&DVec3, &DVec3)| (*a - *b).length() < 1e-3;
            assert!(same.len() == 3 && same.directions.iter().zip(&found.directions).all(near), "{scale}");
        }
        let high = |sh: &ShRgb| sh.c[0][64..].iter().map(|x| x * x).sum::<f64>();
        let before = high(&light);
        small_lights.iter_mut().for_each(|b| b.flux = b.flux.map(|f| -f));
        add_small_lights(&mut light, &small_lights);
        assert!(high(&light) < 0.03 * before, "{} {before}", high(&light));
    }
}

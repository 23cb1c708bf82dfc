//! The logarithms of the factors by least squares over samples of the reflectance.

use super::form::Form;
use crate::shared::tables::hemisphere::{Azimuths, Map, Rows};
use glam::DVec3;
use std::f64::consts::TAU;
use steradian_base::{Cancelled, Task};
use steradian_brdf::Brdf;
use steradian_brdf::Symmetry;
use steradian_numerics::lsqr::{Rgb, Sparse};
use steradian_numerics::products::{Problem, normal_bytes};
use steradian_parallel::prelude::*;

/// Reflectance below this share of its mean is clamped to it, so that its logarithm is finite.
const FLOOR: f64 = 1e-12;
/// Reflectance below this share of the mean gets the weight of that share: weights over many powers of ten
/// would take the solver too many steps.
const DIM: f64 = 1e-2;
/// Least n·l and n·v of samples: some models have no bound below.
const LOWEST: f64 = 1e-4;
/// Where n·l or n·v is lower than this, the error is weighted down in proportion: with forms such as Ward's,
/// whose f grows there, only grazing pairs would count otherwise.
const LOW: f64 = 0.02;
/// Largest weight of a sample, relative to the root mean square of all.
const HEAVIEST: f64 = 5.0;
/// Range of the weight of smoothness, relative to the weight of the samples at an unknown. A first solution
/// has the least weight; its squared relative error at the samples, clamped to this range, is the weight of
/// the second. A reflectance of the product form is thus fitted exactly; of any other the unknowns are noisy,
/// and smoothness keeps them bounded between samples.
const SMOOTH: [f64; 2] = [1e-5, 1e-1];
/// Weight of smoothness at unknowns without samples, relative to the largest weight of samples at any
/// unknown.
const NOWHERE: f64 = 1e-12;
/// Up to this number of unknowns normal equations are solved directly: 47 MB for the three channels of each
/// of sixteen blocks of rows, 750 MB in all, and n³/3 = 9e8 products a channel to factorise.
const MAX_DENSE: usize = 1400;
/// Most steps of each iterative solution, of larger problems.
const MAX_STEPS: usize = 150;
/// Gradient, relative to the first, at which an iterative solution ends earlier.
const ACCURACY: f64 = 1e-7;
/// Most refining solutions after the first.
const MAX_REFINEMENTS: usize = 4;
/// Share of the last solution's cost above which a solution is the last: the error falls by less than 0.5 %.
const SETTLED: f64 = 0.99;

/// Order of the unknowns: P at the nodes of `sides`, then Q at the nodes of `halves`, over stretched half
/// vectors.
pub struct Layout {
    pub sides: Map,
    pub halves: Map,
    pub form: Form,
}

impl Layout {
    /// Bytes of the normal equations, where they are solved directly.
    pub fn normal_bytes(&self) -> usize {
        if self.count() <= MAX_DENSE { normal_bytes(self.count()) } else { 0 }
    }

    pub fn new(symmetry: Symmetry, side: usize, form: Form) -> Self {
        // Where the half vector is stretched elliptical highlights are round: rows matter, columns do not.
        let (azimuths, over_h, columns) = match symmetry {
            Symmetry { isotropic: true, .. } => (Azimuths::One, 4 * side, 1),
            Symmetry { mirrored: true, .. } => (Azimuths::Quarter, 2 * side, side / 4 + 1),
            _ => (Azimuths::Full, 2 * side, side / 2 + 1),
        };
        let sides = Map::new(azimuths, Rows::Horizon, side);
        let halves = Map { width: columns, ..Map::new(azimuths, Rows::Pole, over_h) };
        Self { sides, halves, form }
    }

    /// Unknown of a node within its map; the first column of the circle is its last one too.
    pub fn node(&self, map: &Map, i: usize, j: usize) -> usize {
        let columns = columns(map);
        j * columns + i % columns
    }

    /// First unknown of Q.
    pub fn first_half(&self) -> usize {
        columns(&self.sides) * self.sides.height
    }

    pub fn count(&self) -> usize {
        self.first_half() + columns(&self.halves) * self.halves.height
    }

    /// Appends the entries and weights of a lookup of direction `w`.
    fn taps(&self, map: &Map, start: usize, w: DVec3, out: &mut Vec<(u32, f32)>) {
        let [u, v] = map.place(w.as_vec3().to_array());
        let cell = |u: f32, count: usize| {
            let x = u.clamp(0.0, 1.0) * (count.max(2) - 1) as f32;
            let i = (x as usize).min(count.max(2) - 2);
            (i, x - i as f32)
        };
        let ((i, x), (j, y)) = (cell(u, map.width), cell(v, map.height));
        for (a, b, w) in
            [(0, 0, (1.0 - x) * (1.0 - y)), (1, 0, x * (1.0 - y)), (0, 1, (1.0 - x) * y), (1, 1, x * y)]
        {
            if w > 0.0 {
                out.push(((start + self.node(map, i + a, j + b)) as u32, w));
            }
        }
    }

    /// The row of a sample: P(v) + Q(h) + P(l).
    pub fn row(&self, wi: DVec3, wo: DVec3, out: &mut Vec<(u32, f32)>) {
        self.taps(&self.sides, 0, wo, out);
        self.taps(&self.sides, 0, wi, out);
        self.taps(&self.halves, self.first_half(), self.form.stretched(wi + wo).normalize(), out);
    }

    /// Rows that say that an unknown lies half-way between its neighbours along an axis.
    fn smoothness(&self, mut put: impl FnMut([usize; 3])) {
        for (map, start) in [(&self.sides, 0), (&self.halves, self.first_half())] {
            let at = |i: usize, j: usize| start + self.node(map, i, j);
            for j in 0..map.height {
                for i in 0..columns(map) {
                    if j > 0 && j + 1 < map.height {
                        put([at(i, j - 1), at(i, j), at(i, j + 1)]);
                    }
                    if map.azimuths == Azimuths::Full {
                        put([at(i + map.width - 2, j), at(i, j), at(i + 1, j)]);
                    } else if i > 0 && i + 1 < map.width {
                        put([at(i - 1, j), at(i, j), at(i + 1, j)]);
                    }
                }
            }
        }
    }
}

fn columns(map: &Map) -> usize {
    if map.azimuths == Azimuths::Full { map.width - 1 } else { map.width }
}

/// Pairs of directions with their reflectance.
#[derive(Default)]
pub struct Samples {
    pub at: Vec<[DVec3; 2]>,
    /// f ((n·l)(n·v))^grazing, in which the power that f has at the horizon is cancelled.
    pub f: Vec<Rgb>,
    /// Weight: (n·l) √(dω_l dω_v) over the density of samples, reduced at the horizon, and divided by the
    /// factor that `f` was multiplied with.
    pub share: Vec<f64>,
}

/// Angle of a row's coordinate u from where rows are dense: tan(angle/2) = u².
fn angle(u: f64) -> f64 {
    2.0 * (u * u).atan()
}

/// dω/(2π du) of rows that are dense at the pole, at the cosine z with it.
fn by_pole(z: f64) -> f64 {
    let sine = (1.0 - z * z).max(0.0).sqrt();
    let t = sine / (1.0 + z);
    sine * 4.0 * t.sqrt() / (1.0 + t * t)
}

/// dω/(2π du) of rows that are dense at the horizon.
fn by_horizon(z: f64) -> f64 {
    let across = (1.0 - z * z).max(0.0).sqrt();
    let t = z / (1.0 + across);
    across * 4.0 * t.sqrt() / (1.0 + t * t)
}

impl Samples {
    /// About `count` pairs. Half of them have half vectors spread as the rows of Q, with the light about them
    /// dense at the horizon; in the other half light and view are spread as the rows of P, so that each
    /// unknown has samples. All are weighted by the density of both kinds together (Veach & Guibas 1995, the
    /// balance heuristic).
    pub fn new(
        brdf: &dyn Brdf,
        count: usize,
        isotropic: bool,
        form: Form,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        // Roberts 2018, the quasirandom sequence in four dimensions: g⁵ = g + 1.
        let g = 1.167_303_978_261_418_7_f64;
        let steps: [f64; 4] = std::array::from_fn(|k| g.powi(-(k as i32) - 1));
        // Directions that one task takes.
        const BLOCK: usize = 4096;
        let about_h = |u: [f64; 4]| {
            let (theta, elevation) = (angle(u[0]), angle(u[2]));
            let (s, c) = (if isotropic { 0.0 } else { TAU * u[1] }).sin_cos();
            let h = form.half(DVec3::new(theta.sin() * c, theta.sin() * s, theta.cos()));
            let sine = h.x.hypot(h.y);
            let (s, c) = if sine > 0.0 { (h.y / sine, h.x / sine) } else { (s, c) };
            let (t, b) = (DVec3::new(h.z * c, h.z * s, -sine), DVec3::new(-s, c, 0.0));
            let (s, c) = (TAU * u[3]).sin_cos();
            let (up, side) = (elevation.sin() * h, elevation.cos() * (c * t + s * b));
            [up + side, up - side]
        };
        let apart = |u: [f64; 4]| {
            let of = |elevation: f64, phi: f64| {
                DVec3::new(elevation.cos() * phi.cos(), elevation.cos() * phi.sin(), elevation.sin())
            };
            [of(angle(u[0]), TAU * u[1]), of(angle(u[2]), if isotropic { 0.0 } else { TAU * u[3] })]
        };
        let block = |b: usize| {
            task.check()?;
            let range = b * BLOCK..((b + 1) * BLOCK).min(count);
            let sample = |k: usize| {
                let u: [f64; 4] = std::array::from_fn(|d| (0.5 + k as f64 * steps[d]).fract());
                let [wi, wo] = if k.is_multiple_of(2) { about_h(u) } else { apart(u) };
                if wi.z <= LOWEST || wo.z <= LOWEST {
                    return None;
                }
                // (2π)² times the densities over dω_l dω_v = 4 (h·l) dω_h dω_d, dω_h = w_x w_y |h'|³ dω' of
                // h' = h stretched by 1/w.
                let up = (0.5 * (wi + wo).length()).min(1.0);
                let stretched = form.stretched((wi + wo) / (2.0 * up));
                let length = stretched.length();
                let turned = form.widths[0] * form.widths[1] * length.powi(3);
                let by_rows = by_pole((stretched.z / length).min(1.0));
                let about = (4.0 * up * turned * by_rows * by_horizon(up)).max(1e-30).recip();
                let apart = (by_horizon(wi.z) * by_horizon(wo.z)).max(1e-30).recip();
                let low = (wi.z.min(wo.z) / LOW).min(1.0);
                // Both orders of light and view count.
                let cosine2 = 0.5 * (wi.z * wi.z + wo.z * wo.z);
                let risen = if form.grazing == 0.0 { 1.0 } else { (wi.z * wo.z).powf(form.grazing) };
                let f = brdf.eval(wi, wo).map(|f| if f.is_finite() { f.max(0.0) * risen } else { 0.0 });
                Some(([wi, wo], f, low / risen * (2.0 * cosine2 / (about + apart)).sqrt()))
            };
            let mut out = Self::default();
            for (at, f, share) in range.filter_map(sample) {
                out.at.push(at);
                out.f.push(f);
                out.share.push(share);
            }
            Ok::<_, Cancelled>(out)
        };
        let blocks: Vec<Self> =
            (0..count.div_ceil(BLOCK)).into_par_iter().map(block).collect::<Result<_, _>>()?;
        let mut out = Self::default();
        for block in blocks {
            out.at.extend(block.at);
            out.f.extend(block.f);
            out.share.extend(block.share);
        }
        Ok(out)
    }
}

/// Result of the fit.
pub struct Fit {
    /// Logarithms of the factors.
    pub x: Vec<Rgb>,
    /// f where all of them are 0.
    pub scale: Rgb,
    pub residual: f64,
    pub samples: usize,
    pub steps: usize,
}

/// The samples' shares, less where one would weigh more than [`HEAVIEST`]: where f has no bound, single
/// samples would decide unknowns alone, and with small interpolation weights throw them far.
fn bounded(samples: &Samples, scale: Rgb) -> Vec<f64> {
    let over = |f: &Rgb, c: usize| if scale[c] > 0.0 { f[c] / scale[c] } else { 0.0 };
    let weight = |(f, s): (&Rgb, &f64)| s * (0..3).map(|c| over(f, c)).fold(0.0, f64::max);
    let weights: Vec<f64> = samples.f.iter().zip(&samples.share).map(weight).collect();
    let squares: f64 = weights.iter().map(|w| w * w).sum();
    let most = HEAVIEST * (squares / weights.len().max(1) as f64).sqrt();
    samples.share.iter().zip(weights).map(|(s, w)| s * (most / w.max(1e-300)).min(1.0)).collect()
}

/// Rows of the samples and then those of smoothness, which weigh nothing yet; f over `scale`.
pub fn problem(layout: &Layout, samples: &Samples, power: f64) -> (Problem, Rgb) {
    let (mut sum, mut all) = ([0.0; 3], 0.0);
    for (f, s) in samples.f.iter().zip(&samples.share) {
        (0..3).for_each(|c| sum[c] += s * s * f[c]);
        all += s * s;
    }
    let scale = sum.map(|s| if all > 0.0 { s / all } else { 0.0 });
    let over = |f: &Rgb| std::array::from_fn(|c| if scale[c] > 0.0 { f[c] / scale[c] } else { 1.0 });
    let problem = Problem {
        a: rows(layout, samples),
        values: samples.f.iter().map(over).collect(),
        share: bounded(samples, scale),
        floor: FLOOR,
        dim: DIM,
        power,
        smooth: Vec::new(),
        accuracy: ACCURACY,
        steps: MAX_STEPS,
        dense: layout.count() <= MAX_DENSE,
    };
    (problem, scale)
}

/// One row per sample, then those of smoothness.
fn rows(layout: &Layout, samples: &Samples) -> Sparse {
    let block = |at: &[[DVec3; 2]]| {
        let (mut ends, mut entries) = (Vec::with_capacity(at.len()), Vec::with_capacity(12 * at.len()));
        for [wi, wo] in at {
            layout.row(*wi, *wo, &mut entries);
            ends.push(entries.len() as u32);
        }
        (ends, entries)
    };
    let blocks: Vec<(Vec<u32>, Vec<_>)> = samples.at.par_chunks(1 << 14).map(block).collect();
    let (mut ends, mut entries) = (Vec::new(), Vec::with_capacity(blocks.iter().map(|b| b.1.len()).sum()));
    for (own, taps) in blocks {
        ends.extend(own.iter().map(|end| end + entries.len() as u32));
        entries.extend(taps);
    }
    layout.smoothness(|[a, b, c]| {
        entries.extend([(a as u32, -0.5), (b as u32, 1.0), (c as u32, -0.5)]);
        ends.push(entries.len() as u32);
    });
    Sparse::new(layout.count(), ends, entries)
}

/// Weight of the samples at the middle unknown of each row of smoothness, in the order of these rows; and the
/// largest weight at any unknown.
fn middles(layout: &Layout, p: &Problem) -> (Vec<Rgb>, Rgb) {
    let weights = p.weights(|k| p.floored(k));
    let own = p.a.column_norms(&weights);
    let most = own.iter().fold([0.0; 3], |m: Rgb, o| std::array::from_fn(|c| m[c].max(o[c])));
    let mut middles = Vec::new();
    layout.smoothness(|[_, b, _]| middles.push(own[b]));
    (middles, most)
}

/// Fits ln f ≈ P(v) + Q(h) + P(l).
pub fn fit(layout: &Layout, samples: &Samples, power: f64, task: &Task) -> Result<Fit, Cancelled> {
    let (mut problem, scale) = problem(layout, samples, power);
    let (own, most) = middles(layout, &problem);
    let smooth = |share: f64| {
        let weight = |o: &Rgb| std::array::from_fn(|c| (share * o[c] + NOWHERE * most[c]).sqrt());
        own.iter().map(weight).collect::<Vec<Rgb>>()
    };
    task.check()?;
    problem.smooth = smooth(SMOOTH[0]);
    let mut now = problem.solve();
    let error = problem.relative(&now.cost);
    if error > SMOOTH[0] {
        task.check()?;
        problem.smooth = smooth(error.min(SMOOTH[1]));
        let steps = now.steps;
        now = problem.solve();
        now.steps += steps;
    }
    for _ in 0..MAX_REFINEMENTS {
        task.check()?;
        let before = now.cost;
        problem.refine(&mut now);
        if (0..3).all(|c| now.cost[c] >= SETTLED * before[c]) {
            break;
        }
    }
    let start = layout.first_half();
    for c in 0..3 {
        // A constant factor may move from one map to the other without effect: it is chosen so that the
        // largest P is 0.
        let most = now.x[..start].iter().fold(f64::NEG_INFINITY, |m, x| m.max(x[c]));
        now.x[..start].iter_mut().for_each(|x| x[c] -= most);
        now.x[start..].iter_mut().for_each(|x| x[c] += 2.0 * most);
    }
    let of = |((m, f), s): ((&Rgb, &Rgb), &f64)| {
        let error = |c: usize| (s * (scale[c] * m[c].exp() - f[c])).powi(2);
        let square = |c: usize| (s * f[c]).powi(2);
        [(0..3).map(error).sum::<f64>(), (0..3).map(square).sum()]
    };
    let each: Vec<[f64; 2]> =
        now.model[..samples.f.len()].par_iter().zip(&samples.f).zip(&samples.share).map(of).collect();
    let [squares, all] = [0, 1].map(|k| each.iter().map(|e| e[k]).sum::<f64>());
    let residual = if all > 0.0 { (squares / all).sqrt() } else { 0.0 };
    Ok(Fit { x: now.x, scale, residual, samples: samples.at.len(), steps: now.steps })
}

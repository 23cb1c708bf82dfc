//! Scattered measurements: any pairs of directions, brought to a grid by radial-basis interpolation, as
//! Kautz, Sloan & Snyder 2002 do before they project ("tabulated data (which we interpolate using radial
//! basis functions to create a smooth BRDF)").
//!
//! Per channel g = ln(f + ε), ε a thousandth of the median of f, is interpolated at the centre of each cell
//! of a grid in half and difference angles from its K nearest measurements x_j:
//!
//! **g(x) = m + Σ s_j (g_j − m)**, s = K⁻¹ k(x), K_ij = exp(−|x_i − x_j|/ℓ) + λ δ_ij, k_j = exp(−|x −
//! x_j|/ℓ),
//!
//! m their mean in the metric of K, ℓ four times the distance of the farthest, λ = 1e-3, which lets equal
//! directions differ by noise. The result is clamped to the range of the K measurements, so that nothing is
//! extrapolated: beyond the last measured elevation f stays that of the nearest measurements.
//!
//! Directions become points such that neighbours are alike. With u = √(θ_h/(π/2)) and d = θ_d/(π/2):
//! isotropic, (3/2 u, d, u d cos 2φ_d, u d |sin 2φ_d|), in which f is reciprocal and symmetric about the
//! plane of incidence; else (3/2 u cos φ_h, 3/2 u sin φ_h, d, d cos 2ψ, d sin 2ψ), ψ the azimuth of wi − wo.

use super::grid::{Coordinates, Grid, half_angles};
use super::table::{Counts, Table};
use crate::Info;
use glam::DVec3;
use kdtree::KdTree;
use kdtree::distance::squared_euclidean;
use std::f64::consts::FRAC_PI_2;
use steradian_numerics::dense::Cholesky;
use steradian_parallel::prelude::*;

/// Number of measurements from which a cell is interpolated.
const NEAREST: usize = 28;
/// λ, added to the diagonal.
const NOISE: f64 = 1e-3;
/// Rows of a file at most.
pub(super) const MAX_ROWS: usize = 1 << 20;
/// Fewest different measurements that describe a reflectance.
const FEWEST: usize = 8;
/// Values are clamped to this: cells are single precision, and finite.
const MAX_VALUE: f64 = 1e30;

type Point = [f64; 5];

/// Measurements, and counts of those that were rejected.
#[derive(Debug, Default)]
pub(super) struct Samples {
    light: Vec<DVec3>,
    view: Vec<DVec3>,
    values: Vec<[f64; 3]>,
    counts: Counts,
}

/// A unit direction, away from the surface; `None` at the horizon or below it.
fn upper(theta: f64, phi: f64) -> Option<DVec3> {
    let w = crate::math::spherical(theta, phi);
    (theta.abs() < FRAC_PI_2 && w.z > 1e-9).then_some(w)
}

impl Samples {
    /// A measurement at θ_i, φ_i, θ_o, φ_o in radians. One at or below the horizon is missing; so is a
    /// negative one.
    pub fn push(&mut self, [ti, pi, to, po]: [f64; 4], value: [f64; 3]) {
        match (upper(ti, pi), upper(to, po)) {
            (Some(wi), Some(wo)) => self.add(wi, wo, value),
            _ => {
                self.counts.all += 1;
                self.counts.missing += 1;
            }
        }
    }

    /// Adds a measurement with unit directions.
    pub fn add(&mut self, wi: DVec3, wo: DVec3, value: [f64; 3]) {
        self.counts.all += 1;
        let negative = value.iter().filter(|v| **v < 0.0).count();
        self.counts.negative += negative;
        let there = wi.z > 1e-9 && wo.z > 1e-9;
        if negative > 0 || !there || value.iter().any(|v| v.is_nan() || *v > MAX_VALUE) {
            self.counts.missing += 1;
            return;
        }
        self.light.push(wi);
        self.view.push(wo);
        self.values.push(value);
    }

    /// Adds to the count of negative numbers, which were set to 0.
    pub fn note_negative(&mut self, count: usize) {
        self.counts.negative += count;
    }

    /// Do all measurements have the light at one azimuth, as those of isotropic materials have?
    pub fn one_azimuth(&self) -> bool {
        let turn = |w: &DVec3| (w.x.hypot(w.y) > 1e-6).then(|| w.y.atan2(w.x));
        let mut turns = self.light.iter().filter_map(turn);
        let first = turns.next().unwrap_or(0.0);
        turns.all(|t| (t - first).abs() < 1e-4)
    }

    /// The measurements on a grid; the error says why there is none.
    pub fn table(
        self,
        info: &'static Info,
        notes: fn(&Table) -> Vec<String>,
        isotropic: bool,
    ) -> Result<Table, String> {
        let counts = self.counts;
        if self.values.iter().flatten().all(|v| *v == 0.0) {
            let (n, all) = (self.values.len(), counts.all);
            return Err(format!("{n} of its {all} measurements can be used, and none of these is positive"));
        }
        let sizes = sizes(self.values.len(), isotropic);
        let grid = self.grid(sizes, isotropic);
        let grid = grid.ok_or_else(|| {
            format!("fewer than {FEWEST} different directions among its {} measurements", counts.all)
        })?;
        Ok(Table { info, notes, counts, grid })
    }

    fn grid(&self, sizes: [usize; 4], isotropic: bool) -> Option<Grid> {
        let (points, values) = self.distinct(isotropic);
        if points.len() < FEWEST {
            return None;
        }
        let offset = [0, 1, 2].map(|c| 1e-3 * median(values.iter().map(|v| v[c]).collect()));
        let logs: Vec<[f64; 3]> =
            values.iter().map(|v| std::array::from_fn(|c| (v[c] + offset[c]).ln())).collect();
        let mut tree = KdTree::with_capacity(5, 16);
        for (i, p) in points.iter().enumerate() {
            // Points are finite and of one length.
            tree.add(*p, i).ok()?;
        }
        let value = |i: usize| {
            let (wi, wo) = Grid::centre(sizes, i);
            if wi.z <= 0.0 || wo.z <= 0.0 {
                return [f32::NAN; 3];
            }
            let at = point(wi, wo, isotropic);
            let near = tree.nearest(&at, NEAREST, &squared_euclidean).unwrap_or_default();
            let near: Vec<usize> = near.iter().map(|n| *n.1).collect();
            interpolated(&at, &near, &points, &logs, offset)
        };
        let cells: Vec<[f32; 3]> =
            (0..sizes.iter().product()).into_par_iter().with_min_len(256).map(value).collect();
        Grid::filled(Coordinates::Half, sizes, cells, &[2, 0])
    }

    /// Points and values, those of equal directions as their mean, in the order of the file.
    fn distinct(&self, isotropic: bool) -> (Vec<Point>, Vec<[f64; 3]>) {
        let key = |p: &Point| p.map(|x| (x * 1e7).round() as i64);
        let mut places = std::collections::HashMap::new();
        let (mut points, mut values, mut counts) = (Vec::new(), Vec::new(), Vec::new());
        for ((wi, wo), value) in self.light.iter().zip(&self.view).zip(&self.values) {
            let at = point(*wi, *wo, isotropic);
            let i = *places.entry(key(&at)).or_insert(points.len());
            if i == points.len() {
                points.push(at);
                values.push([0.0; 3]);
                counts.push(0.0);
            }
            (0..3).for_each(|c| values[i][c] += value[c]);
            counts[i] += 1.0;
        }
        values.iter_mut().zip(&counts).for_each(|(v, n)| v.iter_mut().for_each(|v| *v /= n));
        (points, values)
    }
}

/// Cells per coordinate for `n` measurements.
fn sizes(n: usize, isotropic: bool) -> [usize; 4] {
    let of = |x: f64, least: f64, most: f64| x.clamp(least, most).round() as usize;
    if isotropic {
        let side = (n as f64).cbrt();
        [of(2.5 * side, 16.0, 64.0), 1, of(2.5 * side, 16.0, 64.0), of(1.5 * side, 12.0, 36.0)]
    } else {
        let side = (n as f64).sqrt().sqrt();
        [
            of(2.0 * side, 8.0, 20.0),
            of(3.0 * side, 16.0, 32.0),
            of(2.0 * side, 8.0, 20.0),
            of(2.0 * side, 8.0, 20.0),
        ]
    }
}

/// See the page.
fn point(wi: DVec3, wo: DVec3, isotropic: bool) -> Point {
    let [th, ph, td, pd] = half_angles(wi, wo);
    let (u, d) = ((th / FRAC_PI_2).sqrt(), td / FRAC_PI_2);
    if isotropic {
        let (s, c) = (2.0 * pd).sin_cos();
        return [1.5 * u, d, u * d * c, u * d * s.abs(), 0.0];
    }
    let (s, c) = ph.sin_cos();
    let across = wi - wo;
    let size = across.x.hypot(across.y).max(f64::MIN_POSITIVE);
    let (x, y) = (across.x / size, across.y / size);
    [1.5 * u * c, 1.5 * u * s, d, d * (x * x - y * y), d * 2.0 * x * y]
}

fn median(mut values: Vec<f64>) -> f64 {
    values.retain(|v| *v > 0.0);
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(1.0).max(1e-12)
}

/// f at the point `at`.
fn interpolated(
    at: &Point,
    near: &[usize],
    points: &[Point],
    logs: &[[f64; 3]],
    offset: [f64; 3],
) -> [f32; 3] {
    let distance = |a: &Point, b: &Point| squared_euclidean(a, b).sqrt();
    let farthest = near.iter().map(|j| distance(at, &points[*j])).fold(1e-6, f64::max);
    let kernel = |r: f64| (-r / (4.0 * farthest)).exp();
    let entry = |i: usize, j: usize| {
        kernel(distance(&points[near[i]], &points[near[j]])) + if i == j { NOISE } else { 0.0 }
    };
    let n = near.len();
    let matrix: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect();
    let Some(factors) = Cholesky::new(&matrix) else { return [f32::NAN; 3] };
    let weights = factors.solve(near.iter().map(|j| kernel(distance(at, &points[*j]))).collect());
    let ones = factors.solve(vec![1.0; n]);
    let (rest, all): (f64, f64) = (1.0 - weights.iter().sum::<f64>(), ones.iter().sum());
    std::array::from_fn(|c| {
        let values = || near.iter().map(|j| logs[*j][c]);
        let sum: f64 =
            values().zip(weights.iter().zip(&ones)).map(|(g, (s, y))| g * (s + rest * y / all)).sum();
        let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |m, g| (m.0.min(g), m.1.max(g)));
        (sum.clamp(low, high).exp() - offset[c]).max(0.0) as f32
    })
}

/// Notes of the readers of scattered measurements.
pub(super) fn notes(table: &Table) -> Vec<String> {
    let Counts { all, missing, negative } = table.counts;
    let shape = if table.grid.is_isotropic() { "isotropic" } else { "anisotropic" };
    let mut notes = vec![format!(
        "{} of {all} measurements are used, {shape}; at or below the horizon or negative: {missing}",
        all - missing.min(all)
    )];
    if negative > 0 {
        notes.push(format!("{negative} numbers are negative"));
    }
    notes.push(format!("the brightest cell is {:.4} sr⁻¹", table.brightest()));
    notes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Brdf;
    use crate::measured::tabulated::Measured;
    use crate::parse;

    static INFO: Info = Info {
        name: "test",
        source: "",
        formula: "",
        units: "",
        parameters: &[],
        reciprocity: "reciprocal",
        energy: "",
    };

    /// `n` measurements of a model at directions of the R4 sequence, below 80 degrees.
    fn measured(spec: &str, n: u32, isotropic: bool) -> (crate::SharedBrdf, Measured<Table>) {
        let brdf = parse(spec).expect(spec);
        let mut samples = Samples::default();
        for i in 0..n {
            let u = |g: f64| (0.5 + g * f64::from(i)).fract();
            let polar = |u: f64| 1.4 * u.sqrt();
            let angles = [
                polar(u(0.856_674_9)),
                if isotropic { 0.0 } else { std::f64::consts::TAU * u(0.733_891_9) },
                polar(u(0.628_706_7)),
                std::f64::consts::TAU * u(0.538_595_5),
            ];
            let at = |t: f64, p: f64| crate::math::spherical(t, p);
            samples.push(angles, brdf.eval(at(angles[0], angles[1]), at(angles[2], angles[3])));
        }
        assert_eq!(samples.one_azimuth(), isotropic);
        let table = samples.table(&INFO, notes, isotropic).expect("measured");
        (brdf, Measured::new("test".into(), table))
    }

    fn worst(a: &dyn Brdf, b: &dyn Brdf) -> f64 {
        let pairs = crate::measured::nbrdf::pairs(400);
        let off = |(i, o): (DVec3, DVec3)| {
            let (x, y) = (a.eval(i, o), b.eval(i, o));
            (x[1] / y[1]).ln().abs()
        };
        let mut all: Vec<f64> = pairs.map(off).collect();
        all.sort_by(f64::total_cmp);
        all[all.len() * 9 / 10]
    }

    #[test]
    fn models_come_back() {
        for (spec, isotropic, bound) in [
            ("lambert:albedo=0.8/0.5/0.2", true, 1e-6),
            ("ggx:alpha=0.4,f0=0.8", true, 0.06),
            ("ward:ax=0.3,ay=0.6,rd=0.3", false, 0.25),
        ] {
            let (model, table) = measured(spec, 4000, isotropic);
            assert_eq!(table.is_isotropic(), isotropic);
            let off = worst(&*model, &table);
            assert!(off < bound, "{spec}: nine tenths within {off}");
        }
    }

    #[test]
    fn what_cannot_be_used_is_counted() {
        let mut samples = Samples::default();
        for i in 0..40 {
            samples.push([0.03 * f64::from(i), 0.0, 0.5, 0.1 * f64::from(i)], [0.2; 3]);
        }
        samples.push([0.1, 0.0, 1.6, 0.0], [9.0; 3]);
        samples.push([0.1, 0.0, 0.2, 0.0], [0.1, -0.1, -0.1]);
        let table = samples.table(&INFO, notes, true).expect("measured");
        assert_eq!(table.counts, Counts { all: 42, missing: 2, negative: 2 });
        assert!((table.brightest() - 0.2).abs() < 1e-6);
        assert!(Samples::default().table(&INFO, notes, true).unwrap_err().contains("0 of its 0"));
        let mut same = Samples::default();
        (0..40).for_each(|_| same.push([0.1, 0.0, 0.2, 0.0], [1.0; 3]));
        assert!(same.table(&INFO, notes, true).unwrap_err().contains("different directions"));
    }
}

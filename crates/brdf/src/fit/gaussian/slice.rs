//! The reflectance of one elevation of the view at points of the sphere, with their solid angles.

use super::refine::{Fitted, Kind};
use super::{Axes, GaussianLobe, SliceReport, Swept, quadtree};
use crate::math::{plus, spherical};
use crate::{Brdf, Domain, Lobe};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// Gauss and Legendre's nodes on (−1, 1) and weights, 5 points.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Bounds of the panels over the azimuth about r, from the direction away from n (the plane's upper half) …
/// to that below: the grazing highlight is narrow across the plane.
const AZIMUTHS: [f64; 6] = [0.0, 0.06, 0.2, 0.6, 1.5, PI];
/// Finest resolution, radians. Half as much changes the mean error of measured chrome from 0.103 to 0.106,
/// twice as much by less than 1e-4; wider lobes do not need it.
const MIN_RESOLUTION: f64 = 2e-4;

/// T at points, each value times the root of its solid angle.
#[derive(Debug, Clone)]
pub(super) struct Slice {
    pub theta: f64,
    phi: f64,
    /// ρ_d, which T is without.
    diffuse: [f64; 3],
    /// The points: x and z in the plane of n and wo (wo at positive x), y across.
    pub d: Vec<DVec3>,
    /// Roots of the solid angles; of isotropic reflectance points lie in one half of the sphere and count
    /// twice.
    pub root: Vec<f64>,
    /// (f − ρ_d/π) n·wi per channel, times the root.
    pub t: [Vec<f64>; 3],
    /// ∫ T per channel.
    pub albedo: [f64; 3],
    /// ∫ T² of all channels, and ∫ (f n·wi)².
    pub square: [f64; 2],
    /// Narrowest width that the reflectance has here.
    pub narrow: f64,
}

/// Possible albedos of the diffuse part, ascending: π times f at low percentiles, with both directions within
/// 60° of the normal, and where lobes are stretched shares of the lowest. 0 where f is defined over the whole
/// sphere.
pub(super) fn diffuse(brdf: &dyn Brdf, stretched: bool) -> Vec<[f64; 3]> {
    if brdf.domain() == Domain::Sphere {
        return vec![[0.0; 3]];
    }
    let angles = [0.0, 0.35, 0.7, 1.0];
    let mut found: [Vec<f64>; 3] = Default::default();
    // Azimuths of the view, and of the light.
    let (views, lights) = if brdf.is_isotropic() { (1, 9) } else { (4, 16) };
    for (o, i) in angles.iter().flat_map(|o| angles.iter().map(move |i| (*o, *i))) {
        for (j, k) in (0..views).flat_map(|j| (0..lights).map(move |k| (j, k))) {
            let phi = 0.25 * PI * f64::from(j);
            let (wo, wi) = (spherical(o, phi), spherical(i, phi + PI * f64::from(k) / 8.0));
            let f = brdf.eval(wi, wo);
            (0..3).filter(|c| f[*c].is_finite()).for_each(|c| found[c].push(f[c]));
        }
    }
    found.iter_mut().for_each(|v| v.sort_by(f64::total_cmp));
    let at = |share: f64| {
        found
            .each_ref()
            .map(|v| v.get((share * v.len() as f64) as usize).map_or(0.0, |f| (PI * f).clamp(0.0, 1.0)))
    };
    let low = at(0.02);
    let mut all = Vec::new();
    if stretched {
        // Wide lobes take a share of the apparent diffuse part.
        all.extend([0.5, 0.8].map(|share| low.map(|v| share * v)));
    }
    all.push(low);
    all.extend([0.1, 0.25, 0.45].map(at));
    all
}

/// Bounds that double from `first` up to π, with one more near 0.
fn rings(first: f64) -> Vec<f64> {
    let mut bounds = vec![0.0];
    let mut at = first;
    while at < 0.7 * PI {
        bounds.push(at);
        at *= if at < 0.2 { 2.0 } else { 1.6 };
    }
    bounds.push(PI);
    bounds
}

/// The nodes of all panels, with weights.
fn nodes(bounds: &[f64]) -> Vec<(f64, f64)> {
    let panel = |w: &[f64]| {
        let (middle, half) = (0.5 * (w[0] + w[1]), 0.5 * (w[1] - w[0]));
        GAUSS.map(|(x, weight)| (middle + half * x, half * weight))
    };
    bounds.windows(2).flat_map(panel).collect()
}

impl Slice {
    /// The slice of the view at a polar angle and an azimuth.
    pub fn new(brdf: &dyn Brdf, diffuse: [f64; 3], view: [f64; 2], kind: Kind) -> Self {
        let wo = spherical(view[0], view[1]);
        let lobes = brdf.lobes(wo);
        let width = |l: &Lobe| match *l {
            Lobe::Axis { width, .. } | Lobe::Cone { width, .. } | Lobe::Arc { width, .. } => width,
        };
        let mut narrow = lobes.iter().map(width).fold(0.3, f64::min).max(MIN_RESOLUTION);
        if kind.turned {
            let rule = quadtree::rule(brdf, diffuse, wo, &lobes);
            return Self::of(brdf, diffuse, view, rule, narrow);
        }
        let mut slice = Self::resolved(brdf, diffuse, view, narrow);
        // The widths that a reflectance declares are those of other views: at grazing ones highlights may be
        // thinner.
        for _ in 0..if kind.stretched { 4 } else { 0 } {
            let thin = slice.moments().core * view[0].cos().max(0.02).sqrt();
            if thin > 0.5 * narrow || narrow <= MIN_RESOLUTION {
                break;
            }
            narrow = thin.max(0.25 * narrow).max(MIN_RESOLUTION);
            slice = Self::resolved(brdf, diffuse, view, narrow);
        }
        slice
    }

    /// The slice by a rule that resolves widths of `narrow` about the mirror direction.
    fn resolved(brdf: &dyn Brdf, diffuse: [f64; 3], view: [f64; 2], narrow: f64) -> Self {
        let wo = spherical(view[0], 0.0);
        let r = DVec3::new(-wo.x, 0.0, wo.z);
        // Towards n from r, and across.
        let up = DVec3::new(r.z, 0.0, -r.x);
        let mut d = Vec::new();
        let mut root = Vec::new();
        for (psi, dpsi) in nodes(&rings(narrow)) {
            for (phi, dphi) in nodes(&AZIMUTHS) {
                let (s, c) = psi.sin_cos();
                d.push(r * c + (up * phi.cos() + DVec3::Y * phi.sin()) * s);
                root.push((2.0 * dpsi * dphi * s).max(0.0).sqrt());
            }
        }
        Self::of(brdf, diffuse, view, (d, root), narrow)
    }

    /// The slice by given points, in the frame in which wo has no y, and the roots of their solid angles.
    fn of(
        brdf: &dyn Brdf,
        diffuse: [f64; 3],
        [theta, phi]: [f64; 2],
        (d, root): (Vec<DVec3>, Vec<f64>),
        narrow: f64,
    ) -> Self {
        let wo = spherical(theta, phi);
        let mut values = vec![[0.0; 3]; d.len()];
        if phi == 0.0 {
            brdf.f_cos_batch(&d, wo, &mut values);
        } else {
            let turn = DMat3::from_rotation_z(phi);
            let turned: Vec<DVec3> = d.iter().map(|d| turn * *d).collect();
            brdf.f_cos_batch(&turned, wo, &mut values);
        }
        let mut slice = Self {
            theta,
            phi,
            diffuse,
            t: std::array::from_fn(|_| Vec::with_capacity(d.len())),
            d,
            root,
            albedo: [0.0; 3],
            square: [0.0; 2],
            narrow,
        };
        for (i, f) in values.iter().enumerate() {
            let (cos, root) = (slice.d[i].z.max(0.0), slice.root[i]);
            for c in 0..3 {
                let f = if f[c].is_finite() { f[c] } else { 0.0 };
                let t = f - diffuse[c] / PI * cos;
                slice.t[c].push(t * root);
                slice.albedo[c] += t * root * root;
                slice.square[0] += (t * root).powi(2);
                slice.square[1] += (f * root).powi(2);
            }
        }
        slice
    }

    /// The slice without a (larger) diffuse part: `self` must be of none.
    pub fn less(&self, diffuse: [f64; 3]) -> Self {
        let mut slice = self.clone();
        slice.square[0] = 0.0;
        slice.diffuse = diffuse;
        for c in 0..3 {
            for ((t, d), root) in slice.t[c].iter_mut().zip(&self.d).zip(&self.root) {
                let part = diffuse[c] / PI * d.z.max(0.0) * root;
                *t -= part;
                slice.albedo[c] -= part * root;
                slice.square[0] += *t * *t;
            }
        }
        slice
    }

    /// The slice of anisotropic reflectance with the nine points of a cell in one where the cell is narrower
    /// than `width`, radians.
    pub fn merged(&self, width: f64) -> Self {
        let mut out = Self { d: Vec::new(), root: Vec::new(), t: Default::default(), ..self.clone() };
        for first in (0..self.len()).step_by(quadtree::POINTS) {
            let cell = first..(first + quadtree::POINTS).min(self.len());
            let solid: f64 = self.root[cell.clone()].iter().map(|r| r * r).sum();
            if solid.sqrt() >= width {
                out.d.extend(&self.d[cell.clone()]);
                out.root.extend(&self.root[cell.clone()]);
                (0..3).for_each(|c| out.t[c].extend(&self.t[c][cell.clone()]));
                continue;
            }
            let d = cell.clone().map(|i| self.d[i] * self.root[i].powi(2)).sum::<DVec3>();
            out.d.push(d.normalize_or(DVec3::Z));
            out.root.push(solid.sqrt());
            for c in 0..3 {
                let integral: f64 = cell.clone().map(|i| self.t[c][i] * self.root[i]).sum();
                out.t[c].push(integral / solid.sqrt());
            }
        }
        out
    }

    pub fn len(&self) -> usize {
        self.d.len()
    }

    /// Direction of the largest T and its value, summed over channels; mean direction's angle and spread.
    pub fn moments(&self) -> Moments {
        let (mut top, mut at, mut sum, mut total) = (0.0, self.theta, DVec3::ZERO, 0.0);
        for i in 0..self.len() {
            let t = self.t.iter().map(|t| t[i].max(0.0)).sum::<f64>();
            let (mass, value) = (t * self.root[i], t / self.root[i].max(1e-12));
            if value > top {
                (top, at) = (value, (-self.d[i].x).atan2(self.d[i].z));
            }
            sum += self.d[i] * mass;
            total += mass;
        }
        let mean = DVec3::new(sum.x, 0.0, sum.z);
        let resultant = if total > 0.0 { (mean.length() / total).min(1.0) } else { 1.0 };
        Moments {
            peak: at,
            mean: if total > 0.0 { (-mean.x).atan2(mean.z) } else { self.theta },
            core: if top > 0.0 { (total / (2.0 * PI * top)).sqrt() } else { 0.3 },
            spread: (1.0 - resultant).max(0.0).sqrt(),
        }
    }

    /// Errors of `fit` at this view.
    pub fn report(&self, fit: &Fitted) -> SliceReport {
        let lobes: Vec<Swept> = fit.lobes.iter().map(|l| l.swept(self.theta)).collect();
        let (mut square, mut below, mut sum) = (0.0, 0.0, 0.0);
        // Squared differences and squares of the logarithms and the cube roots.
        let (mut log, mut cube_root) = ([0.0; 2], [0.0; 2]);
        for i in 0..self.len() {
            let mut value = [0.0; 3];
            for (lobe, swept) in fit.lobes.iter().zip(&lobes) {
                let g = swept.value(self.d[i]);
                value = plus(value, lobe.weight.map(|w| w * g));
            }
            let root = self.root[i];
            square += (0..3).map(|c| (self.t[c][i] - value[c] * root).powi(2)).sum::<f64>();
            for c in 0..3 {
                let (even, part) = (self.diffuse[c] / PI * self.d[i].z.max(0.0), root * root);
                let (data, fitted) = (self.t[c][i] / root.max(1e-12) + even, value[c] + even);
                let add = |to: &mut [f64; 2], f: fn(f64) -> f64| {
                    let (data, fitted) = (f(data.max(0.0)), f(fitted.max(0.0)));
                    to[0] += part * (data - fitted).powi(2);
                    to[1] += part * data * data;
                };
                add(&mut log, f64::ln_1p);
                add(&mut cube_root, f64::cbrt);
            }
            let mass = value.iter().sum::<f64>() * root * root;
            sum += mass;
            below += if self.d[i].z < 0.0 { mass } else { 0.0 };
        }
        let part = |of: f64| if of > 0.0 { square / of } else { 0.0 };
        let relative = |[off, all]: [f64; 2]| if all > 0.0 { (off / all).sqrt() } else { 0.0 };
        SliceReport {
            theta: self.theta,
            phi: self.phi,
            energy: part(self.square[0]),
            of_whole: part(self.square[1]),
            log: relative(log),
            cube_root: relative(cube_root),
            albedo: self.albedo,
            leak: if sum > 0.0 { below / sum } else { 0.0 },
            converged: fit.converged,
        }
    }

    /// ‖T − fit‖/‖T‖ of these lobes: [`SliceReport::norm`] without the other errors.
    pub fn norm(&self, lobes: &[GaussianLobe]) -> f64 {
        let values: Vec<Vec<f64>> = lobes
            .iter()
            .map(|l| {
                let mut value = [Vec::new()];
                self.gaussian([self.theta + l.angle, l.aside, l.turn], l.sigma, l.sweep, &mut value);
                let [value] = value;
                value
            })
            .collect();
        let mut square = 0.0;
        for (c, t) in self.t.iter().enumerate() {
            for (i, t) in t.iter().enumerate() {
                let fitted: f64 = values.iter().zip(lobes).map(|(v, l)| l.weight[c] * v[i]).sum();
                square += (t - fitted).powi(2);
            }
        }
        if self.square[0] > 0.0 { (square / self.square[0]).sqrt() } else { 0.0 }
    }

    /// The lobe at the angles of [`Axes::new`], and its derivatives as far as `out` has places, each times
    /// the roots of the solid angles.
    pub fn gaussian(&self, [gamma, aside, turn]: [f64; 3], sigma: f64, sweep: f64, out: &mut [Vec<f64>]) {
        let lobe = Swept::new(Axes::new(gamma, aside, turn), sigma, sweep);
        lobe.columns(&Axes::motions(gamma, aside, turn), &self.d, &self.root, out);
    }

    /// Lobes to start from where they may lie anywhere: widths in two ladders, from the core's to those of
    /// all light, and a row along the core.
    pub fn turned_starts(&self, lobes: usize) -> Vec<Vec<GaussianLobe>> {
        // T² of a Gaussian is half as wide, squared.
        let core = self.gathered(self.theta, &|t, root| t * t / root.max(1e-12), 2.0);
        let all = self.gathered(self.theta, &|t, root| t * root, 1.0);
        let (a, b) = (core.spread(), all.spread());
        let count = lobes as f64;
        let ladder = |from: f64, to: [f64; 3]| -> Vec<GaussianLobe> {
            let lobe = |k: usize| {
                let t = if lobes > 1 { k as f64 / (count - 1.0) } else { 0.5 };
                let mix = |a: f64, b: f64| a + t * (b - a);
                let mut out = GaussianLobe {
                    angle: mix(core.angle, all.angle),
                    aside: mix(core.aside, all.aside),
                    ..GaussianLobe::default()
                };
                let near = [a[0] + from.ln(), a[1], a[2] + from.ln()];
                out.widen([0, 1, 2].map(|i| mix(near[i], to[i])));
                out
            };
            (0..lobes).map(lobe).collect()
        };
        let wide = [a[0] + 2.5f64.ln(), a[1], a[2] + 2.5f64.ln()];
        let (s, c) = core.turn.sin_cos();
        let row = |k: usize| {
            let at = 2.0 * ((k as f64 + 0.5) / count - 0.5) * core.along();
            let along = (1.5 * core.along() / count).max(1.1 * core.sigma);
            GaussianLobe {
                angle: core.angle + at * c,
                aside: core.aside + at * s,
                sweep: (along * along - core.sigma * core.sigma).sqrt(),
                ..core
            }
        };
        vec![ladder(0.7, b), ladder(0.5, wide), (0..lobes).map(row).collect()]
    }

    /// The lobe of the mean and the covariance of light, each point counted as `mass` of T and the root of
    /// the solid angle says.
    fn gathered(&self, theta: f64, mass: &dyn Fn(f64, f64) -> f64, times: f64) -> GaussianLobe {
        let mass = |i: usize| {
            let t = self.t.iter().map(|t| t[i].max(0.0)).sum::<f64>();
            mass(t, self.root[i]).max(0.0) * self.root[i].min(1.0)
        };
        let mean = (0..self.len()).map(|i| self.d[i] * mass(i)).sum::<DVec3>().normalize_or(DVec3::Z);
        let [gamma, aside, _] = Axes::angles(mean, DVec3::Y);
        let [_, up, side] = Axes::tangents(gamma, aside);
        let (mut all, mut square) = (0.0, [0.0; 3]);
        for i in 0..self.len() {
            let (d, mass) = (self.d[i], mass(i));
            let (x, y) = (d.dot(up), d.dot(side));
            let length = x.hypot(y);
            let scale = if length > 0.0 { length.atan2(d.dot(mean)) / length } else { 1.0 };
            let (x, y) = (x * scale, y * scale);
            [x * x, x * y, y * y].iter().zip(&mut square).for_each(|(v, s)| *s += mass * v);
            all += mass;
        }
        let [xx, xy, yy] = square.map(|s| times * s / all.max(1e-300));
        let (middle, off) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let radius = off.hypot(xy);
        let narrow = (0.5 * self.narrow).powi(2);
        let (across, along) = ((middle - radius).max(narrow), (middle + radius).max(1.2 * narrow));
        GaussianLobe {
            angle: gamma - theta,
            aside,
            sigma: across.sqrt().min(0.8),
            sweep: (along - across).max(0.05 * across).sqrt().min(0.8),
            turn: 0.5 * xy.atan2(off),
            ..GaussianLobe::default()
        }
    }
}

/// Moments from which starting values are computed; angles are polar angles in the plane, away from wo.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moments {
    pub peak: f64,
    pub mean: f64,
    /// σ of a Gaussian with this integral and this peak.
    pub core: f64,
    /// σ of a Gaussian with this mean length.
    pub spread: f64,
}

//! The reflectance of one elevation of the view at points of the sphere, with their solid angles.

use super::refine::Fitted;
use super::{SliceReport, density};
use crate::math::{plus, spherical};
use crate::{Brdf, Domain, Lobe};
use glam::DVec3;
use std::f64::consts::PI;

/// Gauss and Legendre's nodes on (−1, 1) and weights, 5 points.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Bounds of the panels over the azimuth about r, from away from n (the plane's upper half) … to below: the grazing
/// highlight is narrow across the plane.
const AZIMUTHS: [f64; 6] = [0.0, 0.06, 0.2, 0.6, 1.5, PI];
/// Nothing is resolved more finely, radians.
const FINEST: f64 = 2e-4;

/// T at points, each value times the root of its solid angle.
#[derive(Debug, Clone)]
pub(super) struct Slice {
    pub theta: f64,
    /// The points: x and z in the plane of n and wo (wo at positive x), y across.
    pub d: Vec<DVec3>,
    /// Roots of the solid angles; both halves of the sphere are counted.
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

/// Possible albedos of the diffuse part: π times f at low percentiles, with both directions within 60° of the normal. 0 where
/// f is defined over the whole sphere.
pub(super) fn diffuse(brdf: &dyn Brdf) -> Vec<[f64; 3]> {
    if brdf.domain() == Domain::Sphere {
        return vec![[0.0; 3]];
    }
    let angles = [0.0, 0.35, 0.7, 1.0];
    let mut found: [Vec<f64>; 3] = Default::default();
    for (o, i) in angles.iter().flat_map(|o| angles.iter().map(move |i| (*o, *i))) {
        for k in 0..9 {
            let (wo, wi) = (spherical(o, 0.0), spherical(i, PI * f64::from(k) / 8.0));
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
    [0.02, 0.1, 0.25, 0.45].map(at).to_vec()
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
    pub fn new(brdf: &dyn Brdf, diffuse: [f64; 3], theta: f64) -> Self {
        let wo = spherical(theta, 0.0);
        let r = DVec3::new(-wo.x, 0.0, wo.z);
        let width = |l: &Lobe| match *l {
            Lobe::Axis { width, .. } | Lobe::Cone { width, .. } | Lobe::Arc { width, .. } => width,
        };
        let narrow = brdf.lobes(wo).iter().map(width).fold(0.3, f64::min).max(FINEST);
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
        let mut values = vec![[0.0; 3]; d.len()];
        brdf.f_cos_batch(&d, wo, &mut values);
        let mut slice = Self {
            theta,
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

    /// How good `fit` is here.
    pub fn report(&self, fit: &Fitted) -> SliceReport {
        let means: Vec<DVec3> = fit.lobes.iter().map(|l| l.mean(self.theta)).collect();
        let (mut square, mut below, mut sum) = (0.0, 0.0, 0.0);
        for i in 0..self.len() {
            let mut value = [0.0; 3];
            for (lobe, mean) in fit.lobes.iter().zip(&means) {
                let g = lobe.gaussian(*mean, self.d[i]);
                value = plus(value, lobe.weight.map(|w| w * g));
            }
            let root = self.root[i];
            square += (0..3).map(|c| (self.t[c][i] - value[c] * root).powi(2)).sum::<f64>();
            let mass = value.iter().sum::<f64>() * root * root;
            sum += mass;
            below += if self.d[i].z < 0.0 { mass } else { 0.0 };
        }
        let part = |of: f64| if of > 0.0 { square / of } else { 0.0 };
        SliceReport {
            theta: self.theta,
            energy: part(self.square[0]),
            of_whole: part(self.square[1]),
            albedo: self.albedo,
            leak: if sum > 0.0 { below / sum } else { 0.0 },
            converged: fit.converged,
        }
    }

    /// G_σ about the direction at polar angle `gamma` beyond n (away from wo), and its derivatives by γ and ln σ, each times
    /// the roots of the solid angles.
    pub fn gaussian(&self, gamma: f64, sigma: f64, out: [&mut Vec<f64>; 3]) {
        let lambda = (sigma * sigma).recip();
        let (s, c) = gamma.sin_cos();
        let (mean, turned) = (DVec3::new(-s, 0.0, c), DVec3::new(-c, 0.0, -s));
        let peak = density(sigma);
        // d ln c/dλ with c the peak.
        let slope = sigma * sigma - 2.0 / (2.0 * lambda).exp_m1();
        let [g, by_gamma, by_sigma] = out;
        for o in [&mut *g, &mut *by_gamma, &mut *by_sigma] {
            o.clear();
        }
        for (d, root) in self.d.iter().zip(&self.root) {
            let below = -0.5 * (*d - mean).length_squared();
            let e = lambda * below;
            let value = if e > -60.0 { peak * e.exp() * root } else { 0.0 };
            g.push(value);
            by_gamma.push(value * lambda * d.dot(turned));
            by_sigma.push(-2.0 * lambda * value * (slope + below));
        }
    }
}

/// What starting values are made of; angles are polar angles in the plane, away from wo.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moments {
    pub peak: f64,
    pub mean: f64,
    /// σ of a Gaussian of the same integral and peak.
    pub core: f64,
    /// σ of a Gaussian of the same mean length.
    pub spread: f64,
}

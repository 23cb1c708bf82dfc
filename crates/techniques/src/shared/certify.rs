//! Measures a room's error: its shading against direct evaluation of the integral at probe points.
//!
//! With the squares E_k of the differences and B_k of the exact radiance at n probes, R = ΣE/ΣB estimates the squared
//! relative error. A ratio of sums has the variance n/(n − 1) Σ (E_k − R B_k)²/(ΣB)² (Cochran 1977, *Sampling
//! Techniques*, eq. 6.13); what is stated is **√(R + 2 σ)**, so that the error of all normals and views is hardly ever
//! larger. Probes are stratified, which makes the estimate better than σ says.

use crate::{PointsBuf, Radiance};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Certificate, Known, Task};
use steradian_brdf::{Brdf, Domain, Lobe};
use steradian_prefilter::{Tree, probe};
use steradian_sphere::Frame;

/// Probe points: normals spread over the sphere, views over the hemisphere about each, tangents over the circle.
const PROBES: usize = 256;

/// What the error is, in a certificate's words.
const METRIC: &str = "relative RMS error of outgoing radiance, normals uniform over the sphere, views uniform in \
                      solid angle over the hemisphere";

/// Prime to the number of probes, and far from the golden section, by which the normals' azimuths go round.
const STRIDE: usize = 193;

/// Probes where each costs next to nothing.
const LIMIT_PROBES: usize = 1 << 16;

/// Frame and local view direction of probe `k` of `probes`, a power of two.
fn point(k: usize, probes: usize) -> (Frame, DVec3) {
    let n = probe::direction(k, probes);
    // One view in each of as many belts of equal solid angle as there are probes, in an order that has nothing to
    // do with that of the normals.
    let belt = (k * STRIDE) % probes;
    let cosine = (belt as f64 + 0.5) / probes as f64;
    let phi = 2.0 * PI * (k as f64 * 0.569_840_291).fract();
    let s = (1.0 - cosine * cosine).sqrt();
    let level = Frame::from_normal(n);
    let wo = level.to_world(DVec3::new(s * phi.cos(), s * phi.sin(), cosine));
    // The conventional tangent is always level: fibres and anisotropic lobes must be seen in every direction.
    let turn = 2.0 * PI * (k as f64 * 0.754_877_666 + 0.5).fract();
    let frame = Frame::from_normal_tangent(n, level.t * turn.cos() + level.b * turn.sin());
    (frame, frame.to_local(wo))
}

/// A reflectance as direct evaluation needs it, in the local frame.
pub struct Model<'a> {
    /// May f_cos be non-zero below the horizon?
    pub whole: bool,
    /// Where f_cos(·, wo) is concentrated.
    pub lobes: &'a (dyn Fn(DVec3) -> Vec<Lobe> + Sync),
    /// f_cos(wi, wo).
    pub f_cos: &'a (dyn Fn(DVec3, DVec3) -> [f64; 3] + Sync),
}

/// ∫ L f_cos dwi in `frame` towards local `wo`, by the hierarchy of the light.
fn radiance(tree: &Tree, m: &Model<'_>, frame: &Frame, wo: DVec3) -> [f64; 3] {
    if wo.z <= 0.0 {
        return [0.0; 3];
    }
    let lobes = (m.lobes)(wo);
    let scale = |d: DVec3, radius: f64| {
        let wi = frame.to_local(d);
        if !m.whole && wi.z < -1.6 * radius {
            return f64::INFINITY;
        }
        lobes.iter().map(|l| distance(l, wi)).fold(0.6, f64::min)
    };
    tree.integrate(scale, |d| (m.f_cos)(frame.to_local(d), wo))
}

/// Over which angle a lobe varies at `wi`: its width there, and the more the farther away.
fn distance(lobe: &Lobe, wi: DVec3) -> f64 {
    let (angle, width) = match *lobe {
        Lobe::Axis { axis, width } => (axis.angle_between(wi), width),
        Lobe::Cone { axis, cosine, width } => {
            (axis.angle_between(wi) - cosine.clamp(-1.0, 1.0).acos(), width)
        }
        Lobe::Arc { normal, width } => (normal.dot(wi).clamp(-1.0, 1.0).asin(), width),
    };
    // Tails fall like a power of the angle: they vary over a fraction of it.
    (0.5 * angle.abs()).max(width)
}

/// Belts of view elevations: their upper ends in degrees, and the names of their errors in certificates, which are those
/// of errors at an angle: the belt's middle.
const BELTS: [(f64, &str); 4] = [
    (30.0, "error at 15 degrees (0 to 30)"),
    (60.0, "error at 45 degrees (30 to 60)"),
    (75.0, "error at 67.5 degrees (60 to 75)"),
    (90.0, "error at 82.5 degrees (75 to 90)"),
];

/// What was measured of a room's shading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Relative RMS error over all views, two standard errors above the measured one.
    pub all: f64,
    /// The same over views to 30°, 60°, 75° and 90° off the normal, each belt without those before it.
    pub belts: [f64; 4],
    /// The measured error itself.
    pub mean: f64,
    /// Negative radiance that was shaded, relative to all that was shaded.
    pub negative: f64,
}

impl Errors {
    /// The certificate of the error over all views, with that of each belt.
    pub fn certificate(&self) -> Certificate {
        let all = Certificate::new(self.all, Known::Measured).metric(METRIC);
        let all = BELTS.iter().zip(self.belts).fold(all, |c, ((_, name), error)| c.detail(*name, error));
        all.detail("error, mean of the probes", self.mean).detail("negative", self.negative)
    }

    fn of(pairs: &[([f64; 3], [f64; 3])]) -> Self {
        let degrees = |k: usize| point(k, pairs.len()).1.z.acos().to_degrees();
        let belt = |b: usize| {
            let from = if b > 0 { BELTS[b - 1].0 } else { 0.0 };
            let within = (0..pairs.len()).filter(|k| (from..BELTS[b].0).contains(&degrees(*k)));
            upper(&within.map(|k| pairs[k]).collect::<Vec<_>>())
        };
        let sum = |f: fn(f64) -> f64| pairs.iter().flat_map(|p| p.0).map(f).sum::<f64>();
        let (below, all) = (sum(|x| (-x).max(0.0)), sum(f64::abs));
        Self {
            all: upper(pairs),
            belts: std::array::from_fn(belt),
            mean: probe::relative_rms(pairs.iter().copied()),
            negative: if all > 0.0 { below / all } else { 0.0 },
        }
    }
}

/// √(R + 2σ) of pairs (shaded, exact).
fn upper(pairs: &[([f64; 3], [f64; 3])]) -> f64 {
    let square = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
    let error = |(a, b): &([f64; 3], [f64; 3])| square(std::array::from_fn(|c| a[c] - b[c]));
    let energy: f64 = pairs.iter().map(|p| square(p.1)).sum();
    if energy <= 0.0 {
        return probe::relative_rms(pairs.iter().copied());
    }
    let n = pairs.len() as f64;
    let ratio = pairs.iter().map(error).sum::<f64>() / energy;
    let rest: f64 = pairs.iter().map(|p| (error(p) - ratio * square(p.1)).powi(2)).sum();
    let sigma = (rest * n / (n - 1.0).max(1.0)).sqrt() / energy;
    (ratio + 2.0 * sigma).sqrt()
}

/// `shade` against the integral of `brdf`, over normals and views.
pub fn measure(
    tree: &Tree,
    brdf: &dyn Brdf,
    task: &Task,
    shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>),
) -> Result<Errors, Cancelled> {
    let lobes = |wo| brdf.lobes(wo);
    let f_cos = |wi, wo| brdf.f_cos(wi, wo);
    let m = Model { whole: brdf.domain() == Domain::Sphere, lobes: &lobes, f_cos: &f_cos };
    measure_model(tree, &m, task, shade)
}

/// `shade` against the integral of `m`, over normals and views.
pub fn measure_model(
    tree: &Tree,
    m: &Model<'_>,
    task: &Task,
    shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>),
) -> Result<Errors, Cancelled> {
    compare(PROBES, |frame, wo| radiance(tree, m, frame, wo), task, shade)
}

/// As [`measure`], for a reflectance so sharp that its integral is `exact(frame, wo)`: at so many probes that lamps of
/// some degrees are met by many.
pub fn measure_limit(
    exact: impl Fn(&Frame, DVec3) -> [f64; 3] + Sync,
    task: &Task,
    shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>),
) -> Result<Errors, Cancelled> {
    compare(LIMIT_PROBES, exact, task, shade)
}

fn compare(
    probes: usize,
    exact: impl Fn(&Frame, DVec3) -> [f64; 3] + Sync,
    task: &Task,
    shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>),
) -> Result<Errors, Cancelled> {
    let at = |k: usize| {
        task.check()?;
        let (frame, wo) = point(k, probes);
        Ok(exact(&frame, wo))
    };
    let exact: Vec<_> = (0..probes).into_par_iter().map(at).collect::<Result<_, _>>()?;
    Ok(Errors::of(&shaded(probes, shade).into_iter().zip(exact).collect::<Vec<_>>()))
}

/// What `shade` gives at the probe points.
fn shaded(probes: usize, shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>)) -> Vec<[f64; 3]> {
    let mut buf = PointsBuf::with_capacity(probes);
    for k in 0..probes {
        let (frame, wo) = point(k, probes);
        let p = glam::Vec3::ZERO;
        buf.push(frame.n.as_vec3(), frame.t.as_vec3(), frame.to_world(wo).as_vec3(), p);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; probes]);
    shade(&buf.as_points(), &mut Radiance::of(&mut rgb));
    (0..probes).map(|k| [rgb[0][k], rgb[1][k], rgb[2][k]].map(f64::from)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tangents go everywhere, and do not move the views of isotropic reflectance.
    #[test]
    fn tangents_cover_the_sphere() {
        let mut moment = glam::DMat3::ZERO;
        for k in 0..PROBES {
            let t = point(k, PROBES).0.t;
            moment += glam::DMat3::from_cols(t * t.x, t * t.y, t * t.z) * (3.0 / PROBES as f64);
        }
        for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
            let want = if i == j { 1.0 } else { 0.0 };
            assert!((moment.col(i)[j] - want).abs() < 0.06, "{moment}");
        }
    }

    /// Where errors are independent of each other, the stated error is above that of the whole population in nearly
    /// all samples, and not by much.
    #[test]
    fn the_stated_error_is_an_upper_one() {
        let random = |k: usize| (k as f64 * 0.618_033_988).fract().mul_add(12.9898, 0.3).sin().abs();
        let (mut below, mut sum) = (0, 0.0);
        for s in 0..200 {
            let pair = |k: usize| {
                let u = random(7919 * (s * PROBES + k));
                ([1.0 + 0.1 * u * u; 3], [1.0; 3])
            };
            let pairs: Vec<_> = (0..PROBES).map(pair).collect();
            let (stated, mean) = (upper(&pairs), probe::relative_rms(pairs.iter().copied()));
            assert!(stated > mean);
            sum += stated / mean / 200.0;
            let all = (0..40_000).map(|k| random(k).powi(4)).sum::<f64>() / 40_000.0;
            below += usize::from(stated < 0.1 * all.sqrt());
        }
        assert!(below < 12 && sum < 1.2, "{below} {sum}");
    }
}

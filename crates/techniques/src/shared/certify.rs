//! Measures a room's error: its shading against direct evaluation of the integral at probe points.

use crate::{PointsBuf, Radiance};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;
use steradian_base::{Certificate, Known};
use steradian_brdf::{Brdf, Domain, Lobe};
use steradian_prefilter::{Tree, probe};
use steradian_sphere::Frame;

/// Probe points: normals spread over the sphere, views over the hemisphere about each.
const PROBES: usize = 256;

/// What the error is, in a certificate's words.
pub const METRIC: &str = "relative RMS error of outgoing radiance, normals uniform over the sphere, views uniform in \
                          solid angle over the hemisphere";

/// Prime to `PROBES`, and far from the golden section, by which the normals' azimuths go round.
const STRIDE: usize = 193;

/// Frame and local view direction of probe `k`.
fn point(k: usize) -> (Frame, DVec3) {
    let n = probe::direction(k, PROBES);
    // One view in each of as many belts of equal solid angle as there are probes, in an order that has nothing to
    // do with that of the normals.
    let belt = (k * STRIDE) % PROBES;
    let cosine = (belt as f64 + 0.5) / PROBES as f64;
    let phi = 2.0 * PI * (k as f64 * 0.569_840_291).fract();
    let s = (1.0 - cosine * cosine).sqrt();
    (Frame::from_normal(n), DVec3::new(s * phi.cos(), s * phi.sin(), cosine))
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

/// Relative RMS error of `shade` against the integral of `brdf`, over normals and views.
pub fn error_of(
    tree: &Tree,
    brdf: &dyn Brdf,
    shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>),
) -> f64 {
    let lobes = |wo| brdf.lobes(wo);
    let f_cos = |wi, wo| brdf.f_cos(wi, wo);
    error(tree, &Model { whole: brdf.domain() == Domain::Sphere, lobes: &lobes, f_cos: &f_cos }, shade)
}

/// Relative RMS error of `shade` against the integral, over normals and views.
pub fn error(tree: &Tree, m: &Model<'_>, shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>)) -> f64 {
    let exact: Vec<_> = (0..PROBES)
        .into_par_iter()
        .map(|k| {
            let (frame, wo) = point(k);
            radiance(tree, m, &frame, wo)
        })
        .collect();
    against(&exact, shade)
}

/// Relative RMS difference of `shade` from `exact` at the probe points.
fn against(exact: &[[f64; 3]], shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>)) -> f64 {
    probe::relative_rms(shaded(shade).into_iter().zip(exact.iter().copied()))
}

/// What `shade` gives at the probe points.
fn shaded(shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>)) -> Vec<[f64; 3]> {
    let mut buf = PointsBuf::with_capacity(PROBES);
    for k in 0..PROBES {
        let (frame, wo) = point(k);
        let p = glam::Vec3::ZERO;
        buf.push(frame.n.as_vec3(), frame.t.as_vec3(), frame.to_world(wo).as_vec3(), p);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; PROBES]);
    shade(&buf.as_points(), &mut Radiance::of(&mut rgb));
    (0..PROBES).map(|k| [rgb[0][k], rgb[1][k], rgb[2][k]].map(f64::from)).collect()
}

/// Belts of view elevations: their upper ends in degrees, and the names of their errors in certificates, which are those
/// of errors at an angle: the belt's middle.
const BELTS: [(f64, &str); 4] = [
    (30.0, "error at 15 degrees (0 to 30)"),
    (60.0, "error at 45 degrees (30 to 60)"),
    (75.0, "error at 67.5 degrees (60 to 75)"),
    (90.0, "error at 82.5 degrees (75 to 90)"),
];

/// Relative RMS errors: over all views, and over belts of view elevations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Over all.
    pub all: f64,
    /// Views to 30°, 60°, 75° and 90° off the normal, each belt without those before it.
    pub belts: [f64; 4],
}

impl Errors {
    /// The certificate of the error over all views, with that of each belt.
    pub fn certificate(&self, known: Known) -> Certificate {
        let all = Certificate::new(self.all, known).metric(METRIC);
        BELTS.iter().zip(self.belts).fold(all, |c, ((_, name), error)| c.detail(*name, error))
    }
}

/// As [`error_of`], by the elevation of the view too.
pub fn by_elevation(
    tree: &Tree,
    brdf: &dyn Brdf,
    shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>),
) -> Errors {
    let lobes = |wo| brdf.lobes(wo);
    let f_cos = |wi, wo| brdf.f_cos(wi, wo);
    let m = Model { whole: brdf.domain() == Domain::Sphere, lobes: &lobes, f_cos: &f_cos };
    let exact: Vec<_> = (0..PROBES)
        .into_par_iter()
        .map(|k| {
            let (frame, wo) = point(k);
            radiance(tree, &m, &frame, wo)
        })
        .collect();
    let pairs: Vec<_> = shaded(shade).into_iter().zip(exact).collect();
    let degrees = |k: usize| point(k).1.z.acos().to_degrees();
    let belt = |b: usize| {
        let from = if b > 0 { BELTS[b - 1].0 } else { 0.0 };
        let within = |k: &usize| (from..BELTS[b].0).contains(&degrees(*k));
        probe::relative_rms((0..PROBES).filter(within).map(|k| pairs[k]))
    };
    Errors { all: probe::relative_rms(pairs.iter().copied()), belts: std::array::from_fn(belt) }
}

/// As [`error_of`], for a reflectance so sharp that the integral is `limit(frame, wo)`.
pub fn error_of_limit(
    limit: impl Fn(&Frame, DVec3) -> [f64; 3],
    shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>),
) -> f64 {
    let exact: Vec<_> = (0..PROBES).map(point).map(|(frame, wo)| limit(&frame, wo)).collect();
    against(&exact, shade)
}

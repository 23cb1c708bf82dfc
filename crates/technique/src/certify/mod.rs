//! Certificates: a technique's shading against direct evaluation of the integral at probe points.
//!
//! With the squares E_k of the differences and B_k of the exact radiance at n probes of weights w_k, R =
//! ΣwE/ΣwB estimates the squared relative error. A ratio of sums has the variance n/(n − 1) Σ w²(E_k − R
//! B_k)²/(ΣwB)² (Cochran 1977, *Sampling Techniques*, eq. 6.13); what is stated is **√(R + 2 σ)**, so that
//! the error of all normals and views is hardly ever larger. Probes are stratified, which makes the estimate
//! better than σ says; and what suns decide is looked at where they are seen ([`probes`]).

mod errors;
pub mod probes;
mod report;
pub mod sites;
#[cfg(test)]
mod tests;

pub use errors::Errors;
pub use report::{Estimate, Report};

use crate::{PointsBuf, Radiance};
use errors::ProbeSample;
use glam::DVec3;
use probes::Probe;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::atomic::{AtomicU64, Ordering};
use steradian_base::{Cancelled, Task};
use steradian_brdf::{Brdf, Domain, Lobe, SharedBrdf};
use steradian_parallel::prelude::*;
use steradian_prefilter::{Tree, angular};
use steradian_sphere::Frame;

/// Number of probes of each kind; a power of two.
const PROBES: usize = 256;
/// Fewest probes of each kind, where each is expensive to evaluate; a power of two.
const FEWEST: usize = 16;
/// Evaluations of the reflectance that all probes together may take, about: some three processor seconds.
/// Lobes about a point take a few thousand each, ridges such as a fibre's highlight as many as they are
/// longer than wide, millions where n is 1e5.
const EVALUATIONS: u64 = 20_000_000;

/// Narrowest ridge, radians, along which the integral can be summed in time: fibres of exponents up to 1e5.
/// One tenth as wide takes ten times as long along it, half a minute of one processor at n = 1e6 and hours at
/// 1e8.
const NARROWEST_RIDGE: f64 = 0.003;

/// Refuses reflectance whose error could not be measured in time.
pub fn measurable(brdf: &dyn Brdf) -> Result<(), String> {
    let ridge = |l: &Lobe| match *l {
        Lobe::Axis { .. } => f64::INFINITY,
        Lobe::Cone { width, .. } | Lobe::Arc { width, .. } => width,
    };
    let narrowest = brdf.lobes(DVec3::Z).iter().map(ridge).fold(f64::INFINITY, f64::min);
    if narrowest >= NARROWEST_RIDGE {
        return Ok(());
    }
    Err(format!(
        "takes highlights along circles {NARROWEST_RIDGE} radians wide at least (exponents up to 1e5), not {narrowest:.1e} \
         ({}): use a smaller exponent",
        brdf.spec()
    ))
}

/// Number of probes of a closed form, which costs almost nothing to evaluate: enough that many of them see a
/// lamp of some degrees.
const LIMIT_PROBES: usize = 1 << 16;

/// Where f_cos(·, wo) is concentrated.
type Lobes<'a> = Box<dyn Fn(DVec3) -> Vec<Lobe> + Sync + 'a>;
/// f_cos(wi, wo) of many wi.
type FCos<'a> = Box<dyn Fn(&[DVec3], DVec3, &mut [[f64; 3]]) + Sync + 'a>;
/// Radiance of a frame towards a local view, of a closed form.
type Exact<'a> = Box<dyn Fn(&Frame, DVec3) -> [f64; 3] + Sync + 'a>;

/// A technique's shading of points. (Not a generic parameter: certificates would be compiled anew for each
/// technique.)
pub type Shade<'a> = &'a (dyn Fn(&crate::Points<'_>, &mut Radiance<'_>) + Sync);

/// A reflectance as direct evaluation needs it, in the local frame.
pub struct Model<'a> {
    /// May f_cos be non-zero below the horizon?
    pub whole: bool,
    /// Where f_cos(·, wo) is concentrated.
    pub lobes: Lobes<'a>,
    /// f_cos(wi, wo) of many wi.
    pub f_cos: FCos<'a>,
}

/// f_cos of many directions by that of one.
pub fn one_by_one<'a>(f: impl Fn(DVec3, DVec3) -> [f64; 3] + Sync + 'a) -> FCos<'a> {
    Box::new(move |wi, wo, out| wi.iter().zip(out).for_each(|(wi, out)| *out = f(*wi, wo)))
}

impl<'a> Model<'a> {
    /// The model of a reflectance that it owns.
    pub fn owned(brdf: SharedBrdf) -> Self {
        let (whole, other) = (brdf.domain() == Domain::Sphere, brdf.clone());
        Self {
            whole,
            lobes: Box::new(move |wo| other.lobes(wo)),
            f_cos: Box::new(move |wi, wo, out| brdf.f_cos_batch(wi, wo, out)),
        }
    }

    /// The model of a reflectance.
    pub fn of(brdf: &'a dyn Brdf) -> Self {
        Self {
            whole: brdf.domain() == Domain::Sphere,
            lobes: Box::new(|wo| brdf.lobes(wo)),
            f_cos: Box::new(|wi, wo, out| brdf.f_cos_batch(wi, wo, out)),
        }
    }

    /// Lambert's, of an albedo per channel.
    pub fn diffuse(albedo: [f64; 3]) -> Self {
        let f = albedo.map(|a| a / PI);
        Self {
            whole: false,
            lobes: Box::new(|_| Vec::new()),
            f_cos: one_by_one(move |wi, _| f.map(|f| f * wi.z.max(0.0))),
        }
    }
}

/// The exact radiance that shading is compared with.
pub enum Target<'a> {
    /// The integral of a reflectance under the light as it was given.
    Integral(Model<'a>),
    /// The integral of a reflectance that varies over the surface: texture coordinates, and the reflectance
    /// there. At least one.
    Places(Vec<([f32; 2], Model<'a>)>),
    /// A reflectance so sharp that its integral has a closed form: radiance of a frame towards a local view.
    Limit(Exact<'a>),
}

impl Target<'_> {
    /// The errors of `shade` against this target, over normals and views.
    pub fn errors(&self, tree: &Tree, task: &Task, shade: Shade<'_>) -> Result<Errors, Cancelled> {
        match self {
            Self::Integral(m) => {
                let probes = probes::all(affordable(tree, m, task)?, 0.0, tree, &m.lobes);
                compare(&probes, &|_, p, coarser| radiance(tree, m, p, coarser), &[], task, shade)
            }
            Self::Places(places) => {
                let Some((_, m)) = places.first() else { return Ok(Errors::of(&[])) };
                let probes = probes::all(affordable(tree, m, task)?, 0.0, tree, &m.lobes);
                let at: Vec<[f32; 2]> = places.iter().map(|p| p.0).collect();
                let exact = |k: usize, p: &Probe, coarser| {
                    radiance(tree, &places[turn(k, places.len())].1, p, coarser)
                };
                compare(&probes, &exact, &at, task, shade)
            }
            Self::Limit(exact) => {
                let mirror =
                    |wo: DVec3| vec![Lobe::Axis { axis: DVec3::new(-wo.x, -wo.y, wo.z), width: 0.0 }];
                let probes = probes::all(LIMIT_PROBES, 0.0, tree, &mirror);
                compare(&probes, &|_, p, _| exact(&p.frame, p.wo), &[], task, shade)
            }
        }
    }
}

/// ∫ L f_cos dwi at a probe, by the hierarchy of the light, whose parts are `coarser` times as wide as usual:
/// the error goes with the square of that, and the evaluations with its inverse.
fn radiance(tree: &Tree, m: &Model<'_>, probe: &Probe, coarser: f64) -> [f64; 3] {
    let (frame, wo) = (&probe.frame, probe.wo);
    if wo.z <= 0.0 {
        return [0.0; 3];
    }
    let ridges: Vec<Ridge> = (m.lobes)(wo).iter().map(|l| Ridge::new(l, frame)).collect();
    let narrowest = ridges.iter().map(|r| r.width).fold(WIDEST, f64::min);
    let hidden = |d: DVec3, radius: f64| !m.whole && frame.n.dot(d) < -1.6 * radius;
    let scale = |d: DVec3, radius: f64| {
        if hidden(d, radius) {
            f64::INFINITY
        } else {
            coarser * ridges.iter().map(|r| r.scale(d)).fold(WIDEST, f64::min)
        }
    };
    // Most parts of the light are decided by their radius alone, or by the first ridge.
    let bound = |d: DVec3, radius: f64| {
        if hidden(d, radius) {
            return f64::INFINITY;
        }
        let needed = radius / (coarser * Tree::OPENING);
        let decided = needed > WIDEST || needed <= narrowest;
        let wide = !decided && ridges.iter().all(|r| r.scale_reaches(d, needed));
        coarser * if wide { WIDEST } else { narrowest }
    };
    tree.integrate_many(bound, scale, |at, out| {
        at.iter_mut().for_each(|d| *d = frame.to_local(*d));
        (m.f_cos)(at, wo, out);
    })
}

/// Angle, radians, over which every reflectance varies noticeably.
const WIDEST: f64 = 0.6;

/// A lobe in the world: all directions at an angle from an axis.
struct Ridge {
    axis: DVec3,
    angle: f64,
    width: f64,
}

impl Ridge {
    fn new(lobe: &Lobe, frame: &Frame) -> Self {
        let (axis, angle, width) = match *lobe {
            Lobe::Axis { axis, width } => (axis, 0.0, width),
            Lobe::Cone { axis, cosine, width } => (axis, cosine.clamp(-1.0, 1.0).acos(), width),
            Lobe::Arc { normal, width } => (normal, FRAC_PI_2, width),
        };
        Self { axis: frame.to_world(axis), angle, width }
    }

    /// Angle, radians, over which the lobe varies noticeably at direction `d`: its width near the ridge,
    /// growing with the angular distance from the ridge.
    fn scale(&self, d: DVec3) -> f64 {
        let angle = angular::angle(0.5 * self.axis.distance(d)) - self.angle;
        // Tails fall like a power of the angle: they vary over a fraction of it.
        (0.5 * angle.abs()).max(self.width)
    }

    /// Is [`Ridge::scale`] at least `needed`? About a point mostly by the chord's square alone: angles lie
    /// between the chord and π/2 times it, of chords below 1 and 1.05 times them.
    fn scale_reaches(&self, d: DVec3, needed: f64) -> bool {
        if self.width >= needed {
            return true;
        }
        if self.angle == 0.0 {
            let (quarter, square) = (0.25 * self.axis.distance_squared(d), needed * needed);
            let longer = if quarter < 0.25 { 1.05 * 1.05 } else { FRAC_PI_2 * FRAC_PI_2 };
            if quarter >= square || quarter * longer < square {
                return quarter >= square;
            }
        }
        self.scale(d) >= needed
    }
}

/// Number of probes of each kind that stay within [`EVALUATIONS`]. With fewer probes the stated error is
/// still an upper bound, only a looser one.
fn affordable(tree: &Tree, m: &Model<'_>, task: &Task) -> Result<usize, Cancelled> {
    let evaluations = AtomicU64::new(0);
    let count = |wi: &[DVec3], _, out: &mut [[f64; 3]]| {
        evaluations.fetch_add(wi.len() as u64, Ordering::Relaxed);
        out.fill([0.0; 3]);
    };
    let counted = Model { whole: m.whole, lobes: Box::new(&m.lobes), f_cos: Box::new(count) };
    let few = probes::all(FEWEST / 2, 0.0, tree, &m.lobes);
    let at = |p: &Probe| {
        task.check()?;
        radiance(tree, &counted, p, 1.0);
        Ok(())
    };
    few.par_iter().try_for_each(at)?;
    let mut probes = PROBES;
    let taken = evaluations.load(Ordering::Relaxed);
    while probes > FEWEST && taken * probes as u64 / (FEWEST / 2) as u64 > EVALUATIONS {
        probes /= 2;
    }
    Ok(probes)
}

/// Index of the place at which probe `k` stands. Probes walk through the places with a stride of their own
/// (the golden section), independent of that of the views.
fn turn(k: usize, places: usize) -> usize {
    ((k as f64 * 0.381_966_011).fract() * places as f64) as usize
}

/// Exact radiance of a probe by number, with the light's parts so many times as wide as usual.
type OfProbe<'a> = &'a (dyn Fn(usize, &Probe, f64) -> [f64; 3] + Sync);

/// Width of the light's parts, relative to the usual one, by which exact radiance is integrated first, in a
/// quarter of the evaluations.
const COARSER: f64 = 2.0;
/// One in so many probes is then integrated as usual, and as many of those that decide the error. Coarse
/// integrals err by 0.02 to 0.6 % RMS, and by 1 to 15 % where single grazing views decide.
const ONE_IN: usize = 16;
/// Part of the error found, and of its median, up to which the coarse integrals' own error is left at that:
/// they then add 1/50 of the error, as independent errors do.
const NEGLIGIBLE: f64 = 0.2;

/// The errors of `shade` against `exact`. Where `uv` is not empty, probes stand at those texture coordinates
/// in turn. Large errors need no precise integrals to be measured: all of these are made only where the
/// errors found by coarse ones are not far larger than theirs.
fn compare(
    probes: &[Probe],
    exact: OfProbe<'_>,
    uv: &[[f32; 2]],
    task: &Task,
    shade: Shade<'_>,
) -> Result<Errors, Cancelled> {
    let integrals = |which: &[usize], coarser: f64| -> Result<Vec<[f64; 3]>, Cancelled> {
        let at = |k: &usize| {
            task.check()?;
            task.advance(1);
            Ok(exact(*k, &probes[*k], coarser))
        };
        task.begin("certificate", which.len() as u64);
        let all = which.par_iter().map(at).collect();
        task.end();
        all
    };
    let all: Vec<usize> = (0..probes.len()).collect();
    let coarse = integrals(&all, COARSER)?;
    let shaded = shaded(probes, uv, task, shade)?;
    let sample = |k: usize, shaded: [f64; 3], exact: [f64; 3]| ProbeSample {
        weight: probes[k].weight,
        degrees: probes[k].wo.z.clamp(-1.0, 1.0).acos().to_degrees(),
        shaded,
        exact,
    };
    let mut samples: Vec<_> = all.iter().map(|k| sample(*k, shaded[*k], coarse[*k])).collect();
    let mut order = all.clone();
    order.sort_by(|a, b| samples[*b].squares()[0].total_cmp(&samples[*a].squares()[0]));
    let count = all.len().div_ceil(ONE_IN);
    // Those that decide the error, then one in so many of the others, then the rest.
    order[count..].sort_unstable();
    let other = |k: &usize| !k.is_multiple_of(ONE_IN);
    order[count..].sort_by_key(other);
    let pilots = order[count..].partition_point(|k| !other(k));
    let (first, rest) = order.split_at(count + pilots);
    for (k, exact) in first.iter().zip(integrals(first, 1.0)?) {
        samples[*k].exact = exact;
    }
    let own = |k: &usize| sample(*k, coarse[*k], samples[*k].exact);
    let own = Errors::of(&first[count..].iter().map(own).collect::<Vec<_>>());
    let found = Errors::of(&samples);
    let negligible = |own: f64, found: f64| own <= NEGLIGIBLE * found;
    if negligible(own.mean, found.mean) && negligible(own.spread.median, found.spread.median) {
        return Ok(found);
    }
    for (k, exact) in rest.iter().zip(integrals(rest, 1.0)?) {
        samples[*k].exact = exact;
    }
    Ok(Errors::of(&samples))
}

/// The radiance that `shade` returns at the probes.
fn shaded(
    probes: &[Probe],
    uv: &[[f32; 2]],
    task: &Task,
    shade: Shade<'_>,
) -> Result<Vec<[f64; 3]>, Cancelled> {
    let mut buf = PointsBuf::with_capacity(probes.len());
    for (k, p) in probes.iter().enumerate() {
        let wo = p.frame.to_world(p.wo);
        buf.push(p.frame.n.as_vec3(), p.frame.t.as_vec3(), wo.as_vec3(), glam::Vec3::ZERO);
        if !uv.is_empty() {
            buf.locate(uv[turn(k, uv.len())].into(), [0; 3], [0.0; 2]);
        }
    }
    let seen = buf.shaded(&|q, out| {
        task.check()?;
        shade(q, out);
        Ok(())
    })?;
    Ok(seen.into_iter().map(|l| l.map(f64::from)).collect())
}

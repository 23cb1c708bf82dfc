//! Measures a room's error: its shading against direct evaluation of the integral at probe points.
//!
//! With the squares E_k of the differences and B_k of the exact radiance at n probes of weights w_k, R = ΣwE/ΣwB
//! estimates the squared relative error. A ratio of sums has the variance n/(n − 1) Σ w²(E_k − R B_k)²/(ΣwB)² (Cochran 1977,
//! *Sampling Techniques*, eq. 6.13); what is stated is **√(R + 2 σ)**, so that the error of all normals and views is hardly
//! ever larger. Probes are stratified, which makes the estimate better than σ says; and what suns decide is looked at where
//! they are seen ([`super::probes`]).

use super::probes::{self, Probe};
use crate::{PointsBuf, Radiance};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;
use std::sync::atomic::{AtomicU64, Ordering};
use steradian_base::{Cancelled, Certificate, Known, Spread, Task};
use steradian_brdf::{Brdf, Domain, Lobe};
use steradian_prefilter::{Tree, angular};
use steradian_sphere::Frame;

/// Probe points of each kind, and the fewest where each is expensive; powers of two.
const PROBES: usize = 256;
const FEWEST: usize = 16;
/// Evaluations of the reflectance that all probes together may take, about: some three processor seconds. Lobes about a point take a few
/// thousand each, ridges such as a fibre's highlight as many as they are longer than wide, millions where n is 1e5.
const EVALUATIONS: u64 = 20_000_000;

/// Narrowest ridge, radians, along which the integral can be summed in time: fibres of exponents up to 1e5. One tenth as
/// wide takes ten times as long along it, half a minute of one processor at n = 1e6 and hours at 1e8.
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

/// What the error is, in a certificate's words.
const METRIC: &str = "relative RMS error of outgoing radiance, normals uniform over the sphere, views uniform in \
                      solid angle over the hemisphere";

/// Probes where each costs next to nothing.
const LIMIT_PROBES: usize = 1 << 16;

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
    let ridges: Vec<Ridge> = (m.lobes)(wo).iter().map(|l| Ridge::new(l, frame)).collect();
    let scale = |d: DVec3, radius: f64| {
        if !m.whole && frame.n.dot(d) < -1.6 * radius {
            return f64::INFINITY;
        }
        ridges.iter().map(|r| r.distance(d)).fold(0.6, f64::min)
    };
    tree.integrate(scale, |d| (m.f_cos)(frame.to_local(d), wo))
}

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

    /// Over which angle it varies at `d`: its width there, and the more the farther away.
    fn distance(&self, d: DVec3) -> f64 {
        let angle = angular::angle(0.5 * self.axis.distance(d)) - self.angle;
        // Tails fall like a power of the angle: they vary over a fraction of it.
        (0.5 * angle.abs()).max(self.width)
    }
}

/// Belts of view elevations: their upper ends in degrees, and the names of their errors in certificates, which are those
/// of errors at an angle: the belt's middle.
const BELTS: [(f64, &str); 5] = [
    (30.0, "error at 15 degrees (0 to 30)"),
    (60.0, "error at 45 degrees (30 to 60)"),
    (75.0, "error at 67.5 degrees (60 to 75)"),
    (85.0, "error at 80 degrees (75 to 85)"),
    (90.0, "error at 87.5 degrees (85 to 90)"),
];
/// Views beyond those of which rooms compute the error, degrees, and the name of theirs.
const LAST: (f64, &str) = (88.0, "error at 89 degrees (88 to 90)");
/// Where less than this part of the mean radiance is seen, errors of single points are relative to that.
const DARK: f64 = 1e-3;

/// What was measured of a room's shading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Relative RMS error over all views, two standard errors above the measured one.
    pub all: f64,
    /// The same over views to 30°, 60°, 75°, 85° and 90° off the normal, each belt without those before it.
    pub belts: [f64; 5],
    /// The same over views from 88° to 90° off the normal.
    pub last: f64,
    /// What single points err by.
    pub spread: Spread,
    /// The measured error itself.
    pub mean: f64,
    /// One standard error below it.
    pub least: f64,
    /// Negative radiance that was shaded, relative to all that was shaded.
    pub negative: f64,
}

impl Errors {
    /// The certificate of the error over all views, with that of each belt.
    pub fn certificate(&self) -> Certificate {
        let all = Certificate::new(self.all, Known::Measured).metric(METRIC);
        let all = BELTS.iter().zip(self.belts).fold(all, |c, ((_, name), error)| c.detail(*name, error));
        self.figures(all)
    }

    /// What a room computed of its error, held against what was measured: it stands where it lies between one standard
    /// error below the measured error and the upper bound, else the nearer of the two does.
    pub fn held_against(&self, computed: Certificate) -> Certificate {
        let error = computed.error.max(self.least).min(self.all);
        let c = Certificate { error, known: Known::Measured, ..computed.clone() }.metric(METRIC);
        self.figures(c.detail(LAST.1, self.last).detail("error, computed from the spectra", computed.error))
    }

    fn figures(&self, c: Certificate) -> Certificate {
        c.detail("error, mean of the probes", self.mean).detail("negative", self.negative).spread(self.spread)
    }

    fn of(looks: &[Look]) -> Self {
        let belt = |b: usize| {
            let from = if b > 0 { BELTS[b - 1].0 } else { 0.0 };
            let within = |l: &&Look| (from..BELTS[b].0).contains(&l.degrees);
            upper(&looks.iter().filter(within).collect::<Vec<_>>())
        };
        let sum =
            |f: fn(f64) -> f64| looks.iter().flat_map(|l| l.shaded.map(|x| l.weight * f(x))).sum::<f64>();
        let (below, all) = (sum(|x| (-x).max(0.0)), sum(f64::abs));
        let last: Vec<&Look> = looks.iter().filter(|l| l.degrees >= LAST.0).collect();
        let looks: Vec<&Look> = looks.iter().collect();
        Self {
            all: upper(&looks),
            belts: std::array::from_fn(belt),
            last: upper(&last),
            spread: spread(&looks),
            mean: ratio(&looks).0.sqrt(),
            least: bound(&looks, -1.0),
            negative: if all > 0.0 { below / all } else { 0.0 },
        }
    }
}

/// What was seen at a probe.
#[derive(Debug, Clone, Copy)]
struct Look {
    weight: f64,
    /// The view's angle from the normal.
    degrees: f64,
    shaded: [f64; 3],
    exact: [f64; 3],
}

impl Look {
    /// Squares of the difference and of the exact radiance.
    fn squares(&self) -> [f64; 2] {
        let square = |v: [f64; 3]| self.weight * v.iter().map(|x| x * x).sum::<f64>();
        [square(std::array::from_fn(|c| self.shaded[c] - self.exact[c])), square(self.exact)]
    }
}

/// R (the squared error itself where everything is black), and the energy that it is relative to.
fn ratio(looks: &[&Look]) -> (f64, f64) {
    let [error, energy] = looks.iter().map(|l| l.squares()).fold([0.0; 2], |s, x| [s[0] + x[0], s[1] + x[1]]);
    (if energy > 0.0 { error / energy } else { error }, energy)
}

/// √(R + 2σ).
fn upper(looks: &[&Look]) -> f64 {
    bound(looks, 2.0)
}

/// √(R + so many σ).
fn bound(looks: &[&Look], sigmas: f64) -> f64 {
    let (ratio, energy) = ratio(looks);
    if energy <= 0.0 {
        return ratio.sqrt();
    }
    let n = looks.len() as f64;
    let off = |l: &&Look| {
        let [error, exact] = l.squares();
        (error - ratio * exact).powi(2)
    };
    let rest: f64 = looks.iter().map(off).sum();
    let sigma = (rest * n / (n - 1.0).max(1.0)).sqrt() / energy;
    (ratio + sigmas * sigma).max(0.0).sqrt()
}

/// What single points err by.
fn spread(looks: &[&Look]) -> Spread {
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let luminance = |v: [f64; 3]| 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2];
    let whole: f64 = looks.iter().map(|l| l.weight).sum();
    let mean = |f: &dyn Fn(&Look) -> f64| looks.iter().map(|l| l.weight * f(l)).sum::<f64>() / whole;
    let (dark, dim) = (DARK * mean(&|l| length(l.exact)), DARK * mean(&|l| luminance(l.exact).abs()));
    let off = |l: &Look| length(std::array::from_fn(|c| l.shaded[c] - l.exact[c]));
    let relative = |l: &Look| off(l) / length(l.exact).max(dark).max(f64::MIN_POSITIVE);
    let stops = |l: &Look| {
        let [a, b] = [l.shaded, l.exact].map(|v| luminance(v).max(dim).max(f64::MIN_POSITIVE));
        (a / b).log2().abs()
    };
    let sorted = |f: &dyn Fn(&Look) -> f64| {
        let mut all: Vec<(f64, f64)> = looks.iter().map(|l| (f(l), l.weight / whole)).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        all
    };
    let errors = sorted(&relative);
    let quantile = |share: f64| {
        let mut below = 0.0;
        let reached = errors.iter().find(|(_, w)| {
            below += w;
            below >= share
        });
        reached.or(errors.last()).map_or(0.0, |e| e.0)
    };
    let squares = sorted(&|l| off(l).powi(2));
    let (mut room, mut top) = (0.01, 0.0);
    for (square, w) in squares.iter().rev() {
        top += square * w.min(room);
        room = (room - w).max(0.0);
    }
    let all: f64 = squares.iter().map(|(square, w)| square * w).sum();
    Spread {
        median: quantile(0.5),
        ninetieth: quantile(0.9),
        stops: mean(&stops),
        top_hundredth: if all > 0.0 { top / all } else { 0.0 },
    }
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
    let probes = probes::all(affordable(tree, m, task)?, 0.0, tree, &m.lobes);
    compare(&probes, |frame, wo| radiance(tree, m, frame, wo), task, shade)
}

/// How many probes of each kind [`EVALUATIONS`] allow. Fewer of them make the stated error an upper one all the same.
fn affordable(tree: &Tree, m: &Model<'_>, task: &Task) -> Result<usize, Cancelled> {
    let evaluations = AtomicU64::new(0);
    let count = |_, _| {
        evaluations.fetch_add(1, Ordering::Relaxed);
        [0.0; 3]
    };
    let counted = Model { whole: m.whole, lobes: m.lobes, f_cos: &count };
    let few = probes::all(FEWEST / 2, 0.0, tree, &m.lobes);
    let at = |p: &Probe| {
        task.check()?;
        radiance(tree, &counted, &p.frame, p.wo);
        Ok(())
    };
    few.par_iter().try_for_each(at)?;
    let mut probes = PROBES;
    let taken = evaluations.into_inner();
    while probes > FEWEST && taken * probes as u64 / (FEWEST / 2) as u64 > EVALUATIONS {
        probes /= 2;
    }
    Ok(probes)
}

/// As [`measure`], for a reflectance so sharp that its integral is `exact(frame, wo)`: at so many probes that lamps of
/// some degrees are met by many.
pub fn measure_limit(
    tree: &Tree,
    exact: impl Fn(&Frame, DVec3) -> [f64; 3] + Sync,
    task: &Task,
    shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>),
) -> Result<Errors, Cancelled> {
    let mirror = |wo: DVec3| vec![Lobe::Axis { axis: DVec3::new(-wo.x, -wo.y, wo.z), width: 0.0 }];
    compare(&probes::all(LIMIT_PROBES, 0.0, tree, &mirror), exact, task, shade)
}

fn compare(
    probes: &[Probe],
    exact: impl Fn(&Frame, DVec3) -> [f64; 3] + Sync,
    task: &Task,
    shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>),
) -> Result<Errors, Cancelled> {
    let at = |p: &Probe| {
        task.check()?;
        task.advance(1);
        Ok(exact(&p.frame, p.wo))
    };
    task.begin("certificate", probes.len() as u64);
    let exact: Result<Vec<_>, Cancelled> = probes.par_iter().map(at).collect();
    task.end();
    let exact = exact?;
    let seen = shaded(probes, shade).into_iter().zip(exact);
    let look = |(p, (shaded, exact)): (&Probe, _)| {
        let degrees = p.wo.z.clamp(-1.0, 1.0).acos().to_degrees();
        Look { weight: p.weight, degrees, shaded, exact }
    };
    Ok(Errors::of(&probes.iter().zip(seen).map(look).collect::<Vec<_>>()))
}

/// What `shade` gives at the probe points.
fn shaded(probes: &[Probe], shade: impl FnOnce(&crate::Points<'_>, &mut Radiance<'_>)) -> Vec<[f64; 3]> {
    let mut buf = PointsBuf::with_capacity(probes.len());
    for p in probes {
        let wo = p.frame.to_world(p.wo);
        buf.push(p.frame.n.as_vec3(), p.frame.t.as_vec3(), wo.as_vec3(), glam::Vec3::ZERO);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; probes.len()]);
    shade(&buf.as_points(), &mut Radiance::of(&mut rgb));
    (0..probes.len()).map(|k| [rgb[0][k], rgb[1][k], rgb[2][k]].map(f64::from)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_brdf::parse;
    use steradian_light::{DiskLight, Lights};
    use steradian_prefilter::Beam;

    /// Where errors are independent of each other, the stated error is above that of the whole population in nearly
    /// all samples, and not by much.
    #[test]
    fn the_stated_error_is_an_upper_one() {
        let random = |k: usize| (k as f64 * 0.618_033_988).fract().mul_add(12.9898, 0.3).sin().abs();
        let (mut below, mut sum) = (0, 0.0);
        for s in 0..200 {
            let look = |k: usize| {
                let u = random(7919 * (s * PROBES + k));
                Look { weight: 1.0, degrees: 0.0, shaded: [1.0 + 0.1 * u * u; 3], exact: [1.0; 3] }
            };
            let looks: Vec<Look> = (0..PROBES).map(look).collect();
            let looks: Vec<&Look> = looks.iter().collect();
            let (stated, mean) = (upper(&looks), ratio(&looks).0.sqrt());
            assert!(stated > mean);
            sum += stated / mean / 200.0;
            let all = (0..40_000).map(|k| random(k).powi(4)).sum::<f64>() / 40_000.0;
            below += usize::from(stated < 0.1 * all.sqrt());
        }
        assert!(below < 12 && sum < 1.2, "{below} {sum}");
    }

    /// Lobes about a point are looked at from all probes, a ridge that is far longer than wide from fewer.
    #[test]
    fn expensive_reflectance_is_probed_at_fewer_points() {
        let image = crate::shared::lights::furnace().environment.unwrap().image.clone();
        let tree = Tree::new(Some(&image), &[], &Task::quiet()).unwrap();
        let probes = |lobe: Lobe| {
            let m = Model { whole: true, lobes: &|_| vec![lobe], f_cos: &|_, _| [1.0; 3] };
            affordable(&tree, &m, &Task::quiet()).unwrap()
        };
        assert_eq!(probes(Lobe::Axis { axis: DVec3::Z, width: 0.003 }), PROBES);
        let ridge = probes(Lobe::Arc { normal: DVec3::X, width: 0.003 });
        assert!((FEWEST..PROBES).contains(&ridge), "{ridge}");
    }

    #[test]
    fn ridges_that_take_hours_are_refused() {
        let of = |spec: &str| measurable(&*parse(spec).unwrap());
        for spec in ["banks:n=1e5", "banks-map:n=30", "kajiya-kay:s=1e5", "ggx:alpha=1e-4", "phong:n=1e8"] {
            assert_eq!(of(spec), Ok(()), "{spec}");
        }
        for spec in ["banks:n=1e6", "banks-map:n=1e8", "kajiya-kay:s=1e6", "kajiya-kay:s=1e8"] {
            let why = of(spec).unwrap_err();
            assert!(why.contains("use a smaller exponent") && !why.contains('\n'), "{why}");
        }
    }

    /// A room that does not see a small sun at all errs by what the sun holds of the mean square, which is nearly all;
    /// among the probes without sun its error is nothing.
    #[test]
    fn what_a_sun_decides_is_stated() {
        let brdf = parse("ggx:alpha=0.1,f0=0.9").unwrap();
        let direction = DVec3::new(0.3, 0.8, -0.5).normalize();
        let sun = DiskLight { direction, angular_radius: 0.004, radiance: [3e4; 3] };
        let sky = crate::shared::lights::smooth();
        let lights = Lights { disks: vec![sun], ..sky.clone() };
        let image = |l: &Lights| l.environment.as_ref().map(|e| e.image.clone());
        let [tree, dark] = [&lights, &sky].map(|l| {
            let suns: Vec<Beam> = l.disks.iter().map(Beam::from).collect();
            Tree::new(image(l).as_ref(), &suns, &Task::quiet()).unwrap()
        });
        let f_cos = |wi, wo| brdf.f_cos(wi, wo);
        let m = Model { whole: false, lobes: &|wo| brdf.lobes(wo), f_cos: &f_cos };
        let blind = |q: &crate::Points<'_>, out: &mut Radiance<'_>| {
            for i in 0..q.len() {
                let at = |v: &[&[f32]; 3]| DVec3::from_array(v.map(|c| f64::from(c[i])));
                let frame = Frame::from_normal_tangent(at(&q.n), at(&q.t));
                let l = radiance(&dark, &m, &frame, frame.to_local(at(&q.wo)));
                (0..3).for_each(|c| out.rgb[c][i] = l[c] as f32);
            }
        };
        let seen = measure(&tree, &*brdf, &Task::quiet(), blind).unwrap();
        assert!((0.8..1.0).contains(&seen.mean) && (0.85..1.1).contains(&seen.all), "{seen:?}");
        // Most points see no sun: what single points err by tells.
        let s = seen.spread;
        assert!(s.median < 0.02 && s.stops < 1.0 && s.top_hundredth > 0.9, "{s:?}");
        // What was computed stands between the measured error and its upper bound.
        let mut stated = [0.1, 0.5 * (seen.mean + seen.all), 2.0]
            .map(|error| seen.held_against(Certificate::new(error, Known::Estimated)).error);
        assert!(stated[0] == seen.least && seen.least < seen.mean && stated[2] == seen.all, "{stated:?}");
        stated.sort_by(f64::total_cmp);
        assert!(stated[0] < stated[1] && stated[1] < stated[2], "{stated:?}");
        let plain = probes::all(PROBES, 0.0, &dark, &m.lobes);
        let same = compare(&plain, |f, wo| radiance(&dark, &m, f, wo), &Task::quiet(), blind).unwrap();
        assert!(plain.len() == PROBES + PROBES / 8 && same.all < 1e-6, "{same:?}");
    }
}

//! Common code of the checks: probe points, bakes, the reference.

use super::table;
use glam::{DMat3, DVec3, Vec2, Vec3};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::{Arc, Mutex, OnceLock};
use steradian_base::{Certificate, ParamValues, Task};
use steradian_light::{DiskLight, Environment, Lights};
use steradian_prefilter::probe;
use steradian_reference::{Lookup, Reference, ReferencePoint};
use steradian_scene::shapes;
use steradian_sphere::{Frame, Layout, SphereImage};
use steradian_techniques::certify::probes;
use steradian_techniques::shared::{light::distant, trials::lights};
use steradian_techniques::{
    AnyBake, AnyTechnique, Check, Geometry, Material, PointsBuf, Radiance, Sites, registry,
};
use steradian_testkit::full;

/// Techniques to which `check` applies; for all others the reason in their Card is printed.
/// `STERADIAN_TECHNIQUES=split_sum,shrm` restricts them to these.
pub fn techniques(check: Check) -> impl Iterator<Item = &'static dyn AnyTechnique> {
    let only = std::env::var("STERADIAN_TECHNIQUES").ok();
    let asked = move |t: &&'static dyn AnyTechnique| {
        only.as_deref().is_none_or(|only| only.split(',').any(|s| s == t.card().slug))
    };
    registry().iter().copied().filter(asked).filter(move |t| match t.card().waived(check) {
        Some(why) => {
            println!("{}: {check:?} left out: {why}", t.card().slug);
            false
        }
        None => true,
    })
}

/// The material of a spec.
pub fn material(spec: &str) -> Material {
    Material::new(steradian_brdf::parse(spec).expect("a specimen's spec"))
}

/// A bake with these parameters, without a measurement of its error, which most checks do not use and which
/// takes most of the time.
pub fn draft(t: &dyn AnyTechnique, lights: &Lights, spec: &str, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    let params: ParamValues = params.iter().copied().collect();
    let geometry = t.card().needs.sites.then(|| around(&[]));
    t.draft(lights, &material(spec), geometry.as_ref(), &params, &Task::quiet())
        .expect("a bake that the Card promises")
}

/// The certificate of a bake, measured now where it has not been.
pub fn certified(b: &dyn AnyBake) -> &Certificate {
    b.certify(&Task::quiet()).expect("a certificate");
    b.certificate()
}

/// Sites at unoccluded points: above a small ball that none of them sees, so that V ≡ 1 and a technique with
/// sites gives what it would give without them. Where `points` is empty, the vertices of the ball, so many
/// that radiance between them is nearly linear, since certificates measure at points between vertices.
pub fn around(points: &[ReferencePoint]) -> Geometry {
    let ball = Arc::new(shapes::icosphere(3));
    if points.is_empty() {
        return Geometry::new(ball, Sites::Vertices);
    }
    let n: Arc<[Vec3]> = points.iter().map(|p| p.frame.n.as_vec3()).collect();
    let p: Arc<[Vec3]> = n.iter().map(|n| 1.5 * *n).collect();
    Geometry::new(ball, Sites::Points { p, n })
}

/// The lights that bakes are shared under.
pub const LIGHTS: [(&str, Formula); 6] = [
    ("smooth", lights::smooth),
    ("studio", lights::studio),
    ("sunny", lights::sunny),
    ("furnace", lights::furnace),
    ("bright", bright),
    ("tiny", tiny),
];

/// Those of them under which errors are recorded.
pub const RECORDED_UNDER: [&str; 3] = ["smooth", "studio", "sunny"];

/// A studio with one texel and a sun of radiance 10⁵.
fn bright() -> Lights {
    let mut l = lights::studio();
    let mut image =
        l.environment.take().map_or_else(|| SphereImage::new(Layout::LatLong, 8, 4), |e| e.image.clone());
    let k = image.index(0, 40, 50);
    image.planes.iter_mut().for_each(|p| p[k] = 1e5);
    let disk = DiskLight { direction: DVec3::Y, angular_radius: 1e-4, radiance: [1e5; 3] };
    Lights { environment: Some(Arc::new(Environment { image })), disks: vec![disk], ..Lights::default() }
}

/// Two texels.
fn tiny() -> Lights {
    Environment { image: SphereImage::from_fn(Layout::LatLong, 2, 1, |_| [0.3; 3]) }.into()
}

/// A light by its name in [`LIGHTS`].
pub fn light(name: &str) -> Lights {
    LIGHTS.iter().find(|l| l.0 == name).expect("a light of the list").1()
}

/// The technique's specimens, each with lights to try it under: the first under all of [`RECORDED_UNDER`],
/// the others under one of them in turn; all under all where the table is recorded and with STERADIAN_FULL=1.
pub fn tried(t: &dyn AnyTechnique) -> impl Iterator<Item = (&'static str, &'static [&'static str])> {
    let all = full() || table::recording();
    let one = |k: usize| std::slice::from_ref(&RECORDED_UNDER[k % RECORDED_UNDER.len()]);
    let lights = move |k: usize| if all || k == 0 { &RECORDED_UNDER[..] } else { one(k) };
    t.card().specimens.iter().enumerate().map(move |(k, spec)| (*spec, lights(k)))
}

/// A bake with the usual parameters, made once for all checks of this process: under two texels a [`draft`],
/// and under other lights that with its light replaced, which shares what is made of reflectance and
/// geometry. (That this is the same as a bake from nothing is checked by `a_changed_factor_rebakes_alone`.)
pub fn shared(t: &dyn AnyTechnique, name: &'static str, spec: &'static str) -> &'static dyn AnyBake {
    const FIRST: &str = "tiny";
    static MADE: Made<3, dyn AnyBake> = Mutex::new(BTreeMap::new());
    once(&MADE, [t.card().slug, name, spec], || match name {
        FIRST => draft(t, &light(FIRST), spec, &[]),
        _ => relit(shared(t, FIRST, spec), &light(name)),
    })
}

/// What is made once in this process, by `N` names.
pub type Made<const N: usize, T> = Mutex<BTreeMap<[&'static str; N], &'static OnceLock<Box<T>>>>;

/// What `made` holds under the names, made now where nobody asked for it before.
pub fn once<const N: usize, T: ?Sized>(
    made: &Made<N, T>,
    names: [&'static str; N],
    make: impl FnOnce() -> Box<T>,
) -> &'static T {
    let cell = *made
        .lock()
        .expect("nobody panics in between")
        .entry(names)
        .or_insert_with(|| Box::leak(Box::default()));
    cell.get_or_init(make)
}

/// The bake under another light, without a measurement of its error.
pub fn relit(b: &dyn AnyBake, light: &Lights) -> Box<dyn AnyBake> {
    b.preview(Some(light), None, &Task::quiet()).expect("a light that the Card promises")
}

/// `n` surface points: normals spread over the sphere, views from the normal to 80° off it.
pub fn points(n: usize) -> Vec<ReferencePoint> {
    let point = |k: usize| {
        // A spiral other than that of the techniques' own certificates.
        let normal = DMat3::from_rotation_x(0.7) * probe::direction(k, n);
        let level = Frame::from_normal(normal);
        // Not by the golden section, by which the normals' azimuths go round.
        let cosine = 1.0 - 0.83 * (k as f64 * 0.754_877_666 + 0.2).fract();
        let phi = 2.0 * PI * (k as f64 * 0.569_840_291 + 0.1).fract();
        let s = (1.0 - cosine * cosine).sqrt();
        let wo = level.to_world(DVec3::new(s * phi.cos(), s * phi.sin(), cosine));
        // Tangents all round: the conventional one is always level.
        let turn = 2.0 * PI * (k as f64 * 0.671_043_606 + 0.3).fract();
        let frame = Frame::from_normal_tangent(normal, level.t * turn.cos() + level.b * turn.sin());
        ReferencePoint { frame, wo, position: None }
    };
    (0..n).map(point).collect()
}

/// `points` rotated by `r`.
pub fn turned(points: &[ReferencePoint], r: DMat3) -> Vec<ReferencePoint> {
    let turn = |p: &ReferencePoint| ReferencePoint {
        frame: Frame { t: r * p.frame.t, b: r * p.frame.b, n: r * p.frame.n },
        wo: r * p.wo,
        position: None,
    };
    points.iter().map(turn).collect()
}

/// Radiance of a bake at `points`.
pub fn shade(b: &dyn AnyBake, points: &[ReferencePoint]) -> Vec<[f64; 3]> {
    let there = b.card().needs.sites.then(|| {
        b.with_geometry(&around(points), &Task::quiet().with_tolerance(None)).expect("points in the open")
    });
    let b = there.as_deref().unwrap_or(b);
    let mut q = PointsBuf::with_capacity(points.len());
    for (k, p) in (0..).zip(points) {
        q.push(p.frame.n.as_vec3(), p.frame.t.as_vec3(), p.wo.as_vec3(), Vec3::ZERO);
        q.locate(Vec2::ZERO, [k; 3], [0.0; 2]);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; points.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    (0..points.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from)).collect()
}

/// The reference's values at `points`.
pub fn judged(lights: &Lights, spec: &str, points: &[ReferencePoint]) -> Vec<[f64; 3]> {
    let reference = Reference::new(lights, Lookup::Constant, &Task::quiet()).expect("a sound light");
    let brdf = steradian_brdf::parse(spec).expect("a specimen's spec");
    let values = reference.radiance_batch(&*brdf, points, 1e-3, &Task::quiet()).expect("nobody cancels");
    values.iter().map(|e| e.rgb).collect()
}

/// Relative RMS difference.
pub fn difference(got: &[[f64; 3]], expected: &[[f64; 3]]) -> f64 {
    probe::relative_rms(got.iter().copied().zip(expected.iter().copied()))
}

/// A measured error.
#[derive(Clone, Copy)]
pub struct Found {
    /// Relative RMS error.
    pub error: f64,
    /// Standard error of `error`.
    pub sigma: f64,
}

/// Points of the kinds at which certificates compare, and the reference's values there.
pub struct Judged {
    probes: Vec<probes::Probe>,
    points: Vec<ReferencePoint>,
    exact: Vec<[f64; 3]>,
}

impl Judged {
    /// `count` points of each kind.
    pub fn new(lights: &Lights, spec: &str, count: usize, shift: f64) -> Self {
        let tree = distant::tree(lights, &Task::quiet()).expect("nobody cancels");
        let brdf = material(spec).brdf;
        let probes = probes::all(count, shift, &tree, &|wo| brdf.lobes(wo));
        let point =
            |p: &probes::Probe| ReferencePoint { frame: p.frame, wo: p.frame.to_world(p.wo), position: None };
        let points: Vec<ReferencePoint> = probes.iter().map(point).collect();
        let exact = judged(lights, spec, &points);
        Self { probes, points, exact }
    }

    /// The error of a bake at the points.
    pub fn error(&self, b: &dyn AnyBake) -> Found {
        let (got, exact) = (shade(b, &self.points), &self.exact);
        let squares = |k: usize| {
            let square = |v: [f64; 3]| self.probes[k].weight * v.iter().map(|x| x * x).sum::<f64>();
            [square(std::array::from_fn(|c| got[k][c] - exact[k][c])), square(exact[k])]
        };
        let all: Vec<[f64; 2]> = (0..self.points.len()).map(squares).collect();
        let [error, energy] = all.iter().fold([0.0; 2], |s, x| [s[0] + x[0], s[1] + x[1]]);
        let energy = if energy > 0.0 { energy } else { 1.0 };
        let ratio = error / energy;
        // Variance of a ratio of sums (Cochran 1977, eq. 6.13), and the standard error of its square root.
        let variance = all.iter().map(|[e, x]| (e - ratio * x).powi(2)).sum::<f64>() / (energy * energy);
        Found { error: ratio.sqrt(), sigma: 0.5 * (variance / ratio.max(f64::MIN_POSITIVE)).sqrt() }
    }
}

/// A light by formula.
type Formula = fn() -> Lights;

/// Twice the light.
pub fn doubled(l: &Lights) -> Lights {
    let image = l.environment.as_ref().map(|e| {
        let mut image = e.image.clone();
        image.planes.iter_mut().flatten().for_each(|x| *x *= 2.0);
        Arc::new(Environment { image })
    });
    let disk = |d: &DiskLight| DiskLight { radiance: d.radiance.map(|l| 2.0 * l), ..*d };
    Lights { environment: image, disks: l.disks.iter().map(disk).collect(), ..Lights::default() }
}

/// Both lights; their images have one size.
pub fn sum(a: &Lights, b: &Lights) -> Lights {
    let (x, y) = (a.environment.as_ref().expect("an image"), b.environment.as_ref().expect("an image"));
    let mut image = x.image.clone();
    for (p, q) in image.planes.iter_mut().zip(&y.image.planes) {
        p.iter_mut().zip(q).for_each(|(p, q)| *p += q);
    }
    let disks = a.disks.iter().chain(&b.disks).copied().collect();
    Lights { environment: Some(Arc::new(Environment { image })), disks, ..Lights::default() }
}

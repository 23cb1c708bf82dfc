//! Figure 11's columns, tried: a claim counts where it was seen to hold.

use super::{COLUMNS, Chapter, GLOSSY, MATTE, Plan, Row, Stage, near, shadowing, takes, usual_specimen};
use crate::compare::{Answer, Plan as Comparison};
use crate::{Error, Method, Paths, Renderer, Session};
use glam::{DVec3, Vec2, Vec3};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::Instant;
use steradian_base::{Cancelled, ParamValues, Task};
use steradian_brdf::{Domain, SharedBrdf, parse};
use steradian_parallel::prelude::*;
use steradian_reference::{Lookup, Reference, ReferencePoint};
use steradian_scene::shapes;
use steradian_sphere::Frame;
use steradian_techniques::local::AnyLocal;
use steradian_techniques::shared::trials::{lights, specimens};
use steradian_techniques::{
    AnyBake, AnyTechnique, Geometry, Material, PointLobe, PointsBuf, Radiance, Sites, TexelReflectance,
    locals, registry,
};

/// Outcome of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// It was seen to hold, and how well.
    Holds(String),
    /// It was seen not to.
    Fails(String),
    /// It was not tried, and why.
    Untried(String),
}

/// A column of a technique.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// Does the technique claim it?
    pub claimed: bool,
    /// Outcome of the trial.
    pub outcome: Outcome,
}

/// A diffuse reflectance, and ones with a diffuse part under a glossy one.
const DIFFUSE: [&str; 4] = [
    "lambert:albedo=0.5",
    "dielectric:alpha=0.2,f0=0.04,albedo=0.5",
    "ward:ax=0.2,ay=0.2,rs=0.3,rd=0.3",
    "lafortune:@skin",
];
/// Isotropic reflectances of all kinds: Lambertian and rough, lobes, microfacets, layers, sheen, fits to
/// measurements.
const ISOTROPIC: [&str; 14] = [
    "lambert:albedo=0.5",
    "oren-nayar:sigma=0.5",
    "minnaert:k=0.65",
    "phong:n=20",
    "phong-normalized:s=50",
    "blinn-phong:n=40",
    "ggx:alpha=0.2",
    "cook-torrance:m=0.2",
    "microfacet:sigma=0.2",
    "dielectric:alpha=0.2,f0=0.04,albedo=0.5",
    "charlie:alpha=0.4",
    "lafortune:@skin",
    "sgd:alum-bronze",
    "abc:alum-bronze",
];
/// Anisotropic reflectances: microfacets, empirical, fibres.
const ANISOTROPIC: [&str; 6] = [
    "ggx:ax=0.2,ay=0.5",
    "ward:ax=0.15,ay=0.4",
    "ashikhmin-shirley:nu=12,nv=48",
    "poulin-fournier:n=20,d=3,h=0.3",
    "kajiya-kay:s=16",
    "banks:n=30",
];
/// Number of points at which shading is tried, spread over a sphere, some 25° apart.
const POINTS: usize = 64;
/// Relative error of the reference at them.
const TOLERANCE: f64 = 1e-2;
/// Angle between turned normals and the surface's, radians: a bump of usual steepness.
const TILT: f64 = 0.3;
/// The error with turned normals may be larger than with the surface's own by this factor and this much.
pub(super) const BUMPED: [f64; 2] = [1.5, 0.02];
/// Width of the lobe that a point brings with itself: not that of [`GLOSSY`], 0.25, which a technique that
/// ignores it would show.
const OWN_WIDTH: f64 = 0.4;
/// Relative error up to which its shading counts as that of a bake of that width.
const OWN_WIDTH_WITHIN: f64 = 0.05;
/// A technique with self-shadowing passes if its error is at most this part of that of the integral without
/// shadows: smaller by more than the noise of the path tracer.
const SHADOWED: f64 = 0.95;
/// Size, pixels, of the pictures in constant light: shadows matter ten times as much there, so that few
/// pixels tell.
const FURNACE_SIZE: [usize; 2] = [32, 24];
/// Relative noise of their paths at least, for the same reason.
const COARSE_NOISE: f64 = 0.05;
/// Size, pixels, of the pictures with interreflection, of which each technique has two.
const BOUNCED_SIZE: [usize; 2] = [64, 48];
/// Their scattering events.
const BOUNCES: u32 = 3;

impl Session {
    /// Every column of every technique.
    pub(super) fn tried(&mut self, plan: &Plan, chapters: &[Chapter]) -> Result<Vec<Row>, Error> {
        let mut rows = Vec::new();
        let mut bounced = self.bounces(plan)?;
        let mut truths = Truths::default();
        for t in registry().iter().copied().filter(|t| plan.has(t.card())) {
            let mut outcomes = reflectances(t.card());
            let shaded = Shaded::new(t, &self.task)?;
            outcomes.extend([
                shaded.varying(&self.task)?,
                shaded.bumped(&mut truths, &self.task)?,
                self.shadows(plan, t, chapters)?,
                bounced
                    .remove(t.card().slug)
                    .unwrap_or_else(|| Outcome::Untried("no parameter for it".into())),
                shaded.relit(&self.task)?,
                moved(t),
            ]);
            rows.push(row(t.card(), outcomes));
        }
        let mut photographs = None;
        for t in locals().iter().copied().filter(|t| plan.has(t.card())) {
            let mut outcomes = reflectances(t.card());
            let scattered = match self.scattered(plan, t)? {
                None => self.shadows_of_bumps(plan, t, &mut photographs)?,
                both => both,
            };
            outcomes.extend(near::columns(t, chapters, scattered, &self.task)?);
            rows.push(row(t.card(), outcomes));
        }
        Ok(rows)
    }

    /// Shadows: the picture against the path tracer. Where the technique's error from cutting off the light
    /// exceeds the effect of shadows, the picture is inconclusive: then the comparison is repeated under
    /// constant light.
    fn shadows(
        &mut self,
        plan: &Plan,
        t: &'static dyn AnyTechnique,
        chapters: &[Chapter],
    ) -> Result<Outcome, Error> {
        let seen = shadows(t.card().slug, chapters);
        let (Outcome::Fails(under), Some(params)) = (&seen, shadowing(t)) else { return Ok(seen) };
        let [with, without] = self.under_constant_light(t, params, plan)?.map(|e| 100.0 * e);
        let text = format!(
            "under constant light {with:.1} % off, without shadows {without:.1} %; by its own {under}"
        );
        Ok(if with < SHADOWED * without { Outcome::Holds(text) } else { Outcome::Fails(text) })
    }

    /// Errors of a technique, and of the integral without shadows, in constant light.
    fn under_constant_light(
        &mut self,
        t: &'static dyn AnyTechnique,
        params: ParamValues,
        plan: &Plan,
    ) -> Result<[f64; 2], Error> {
        let card = t.card();
        let spec = if takes(card, MATTE) { MATTE } else { usual_specimen(card) };
        let noise = plan.noise.max(COARSE_NOISE);
        let mut scene = self.knot(&Plan { size: FURNACE_SIZE, ..plan.clone() }, spec)?;
        scene.lights = lights::furnace();
        scene.materials[0].params = params;
        self.paths = Paths { bounces: 1, noise };
        let comparison =
            Comparison { reference_tolerance: TOLERANCE, paths: true, ev: 0.0, certificates: false };
        let methods = [Method::Technique(t), Method::Reference];
        let answers = self.compared(&scene, &methods, &[Renderer::Cpu], &comparison)?;
        let error = |k: usize| {
            let found = answers.get(k).and_then(|a| a.rendering()?.errors.as_ref().map(|e| e.0.relative_rms));
            found.unwrap_or(f64::NAN)
        };
        Ok([error(1), error(2)])
    }

    /// Light from surface to surface: does it bring a technique nearer to paths of several scattering events?
    /// Techniques of one reflectance share the paths.
    fn bounces(&mut self, plan: &Plan) -> Result<BTreeMap<&'static str, Outcome>, Error> {
        let has = |t: &&'static dyn AnyTechnique| {
            let scatters = t.card().capabilities.interreflections;
            plan.has(t.card()) && scatters && t.params().iter().any(|p| p.name == "bounces")
        };
        let mut groups: BTreeMap<&str, Vec<&'static dyn AnyTechnique>> = BTreeMap::new();
        for t in registry().iter().copied().filter(has) {
            let spec = if takes(t.card(), MATTE) { MATTE } else { usual_specimen(t.card()) };
            groups.entry(spec).or_default().push(t);
        }
        let small = Plan { size: BOUNCED_SIZE, ..plan.clone() };
        let comparison =
            Comparison { reference_tolerance: TOLERANCE, paths: true, ev: 0.0, certificates: false };
        let mut out = BTreeMap::new();
        for (spec, techniques) in groups {
            let mut scene = self.knot(&small, spec)?;
            self.paths = Paths { bounces: BOUNCES, noise: plan.noise };
            let methods: Vec<Method> = techniques.iter().map(|t| Method::Technique(*t)).collect();
            let mut pictures = Vec::new();
            for bounces in [1.0, f64::from(BOUNCES)] {
                scene.materials[0].params = [("bounces", bounces)].into_iter().collect();
                pictures.push(self.compared(&scene, &methods, &[Renderer::Cpu], &comparison)?);
            }
            for (k, t) in techniques.iter().enumerate() {
                let error = |all: &Vec<Answer>| {
                    let found = all.get(k + 1).and_then(|a| a.rendering()?.errors.as_ref());
                    found.map_or(f64::NAN, |e| 100.0 * e.0.relative_rms)
                };
                let [direct, bounced] = [0, 1].map(|i| error(&pictures[i]));
                let text = format!("{direct:.1} % off without, {bounced:.1} % with");
                let held = if bounced < direct { Outcome::Holds(text) } else { Outcome::Fails(text) };
                out.insert(t.card().slug, held);
            }
        }
        Ok(out)
    }
}

impl Session {
    /// Shadows and interreflection of a technique for directional and point lights: does either reduce the
    /// error against paths?
    fn scattered(&mut self, plan: &Plan, t: &'static dyn AnyLocal) -> Result<Option<[Outcome; 2]>, Error> {
        if !super::scatters(t) {
            return Ok(None);
        }
        let small = Plan { size: BOUNCED_SIZE, ..plan.clone() };
        let comparison =
            Comparison { reference_tolerance: TOLERANCE, paths: true, ev: 0.0, certificates: false };
        let mut error = |params: &str| -> Result<f64, Error> {
            let (_, scene, other) = self.near(&small, t, &format!("{}{params}", t.card().slug))?;
            let answers = self.compared(&scene, &[other], &[Renderer::Cpu], &comparison)?;
            let found = answers.get(1).and_then(|a| a.rendering()?.errors.as_ref());
            Ok(found.map_or(f64::NAN, |e| 100.0 * e.0.relative_rms))
        };
        let whole = error("")?;
        let mut less = |params: &str| -> Result<Outcome, Error> {
            let without = error(params)?;
            let text = format!("{without:.1} % off without, {whole:.1} % with");
            Ok(if whole < without { Outcome::Holds(text) } else { Outcome::Fails(text) })
        };
        Ok(Some([less(":shadow=none")?, less(":bounces=0")?]))
    }
}

fn row(card: &'static steradian_techniques::Card, outcomes: Vec<Outcome>) -> Row {
    let mut outcomes = outcomes.into_iter();
    let tried = COLUMNS.map(|(_, claims)| Tried {
        claimed: claims(&card.capabilities),
        outcome: outcomes.next().unwrap_or_else(|| Outcome::Untried(String::new())),
    });
    Row { card, tried }
}

/// The five columns of reflectances: of the lists, and for single models of the technique's own specimens
/// too, which it takes. "All" are those of light from above the surface: lobes of the whole sphere, as fibres
/// and maps have them, are no BRDFs.
pub(super) fn reflectances(card: &steradian_techniques::Card) -> Vec<Outcome> {
    let own = |isotropic: bool| {
        let is = move |s: &&&str| parse(s).is_ok_and(|b| b.is_isotropic() == isotropic);
        card.specimens.iter().filter(is).copied().collect::<Vec<_>>()
    };
    let some = |list: &[&str]| match list.iter().find(|s| takes(card, s)) {
        Some(taken) => Outcome::Holds(format!("takes {taken}")),
        None => Outcome::Fails(format!("takes none of {}", list.len())),
    };
    let all = |list: &[&str]| {
        let above = |s: &&str| parse(s).is_ok_and(|b| b.domain() == Domain::Hemisphere);
        let list: Vec<&str> = list.iter().copied().filter(above).collect();
        let refused: Vec<&str> = list.iter().copied().filter(|s| !takes(card, s)).collect();
        if refused.is_empty() {
            return Outcome::Holds(format!("takes all {}", list.len()));
        }
        let taken = list.len() - refused.len();
        Outcome::Fails(format!(
            "takes {taken} of {}, refuses {}",
            list.len(),
            refused[..refused.len().min(3)].join(", ")
        ))
    };
    vec![
        some(&DIFFUSE),
        some(&[&ISOTROPIC[1..], &own(true)].concat()),
        some(&[&ANISOTROPIC, &own(false)[..]].concat()),
        all(&ISOTROPIC),
        all(&ANISOTROPIC),
    ]
}

/// Shadows: the picture against the path tracer.
fn shadows(slug: &str, chapters: &[Chapter]) -> Outcome {
    let found = chapters.iter().filter(|c| c.stage == Stage::Shadowed).find_map(|c| {
        let error = c.entries.iter().find(|e| e.card.slug == slug)?.error()?;
        Some((error, c.unshadowed?))
    });
    let Some((error, without)) = found else { return Outcome::Fails("knows nothing of the mesh".into()) };
    let text = format!("{:.1} % off; without shadows {:.1} %", 100.0 * error, 100.0 * without);
    if error < SHADOWED * without { Outcome::Holds(text) } else { Outcome::Fails(text) }
}

/// Objects that move or deform: a bake that has seen no mesh does not care.
fn moved(t: &dyn AnyTechnique) -> Outcome {
    if t.card().needs.sites {
        return Outcome::Fails("bakes on the mesh".into());
    }
    Outcome::Holds("bakes without a mesh".into())
}

/// The reference of each reflectance at the points, with the surface's normals and with turned ones.
type Truths = BTreeMap<String, [Vec<[f64; 3]>; 2]>;

/// A bake, and points at which it shades: in the open, so that nothing is in the way.
struct Shaded {
    technique: &'static dyn AnyTechnique,
    brdf: SharedBrdf,
    bake: Box<dyn AnyBake>,
    points: Vec<ReferencePoint>,
}

impl Shaded {
    fn new(technique: &'static dyn AnyTechnique, task: &Task) -> Result<Self, Error> {
        let card = technique.card();
        let spec = if takes(card, GLOSSY) { GLOSSY } else { usual_specimen(card) };
        let (brdf, points) = (parse(spec)?, points());
        let geometry = card.needs.sites.then(|| {
            let n: Arc<[Vec3]> = points.iter().map(|p| p.frame.n.as_vec3()).collect();
            // Above a ball that none of them sees.
            let p = n.iter().map(|n| 1.5 * *n).collect();
            Geometry::new(Arc::new(shapes::icosphere(3)), Sites::Points { p, n })
        });
        let (light, none) = (lights::studio(), ParamValues::default());
        let bake = technique.bake(&light, &Material::new(brdf.clone()), geometry.as_ref(), &none, task)?;
        Ok(Self { technique, brdf, bake, points })
    }

    /// Another light, and back again.
    fn relit(&self, task: &Task) -> Result<Outcome, Error> {
        let start = Instant::now();
        let other = self.bake.preview(Some(&lights::sunny()), None, task)?;
        let seconds = start.elapsed().as_secs_f64();
        let back = other.preview(Some(&lights::studio()), None, task)?;
        let [first, there, again] = [&self.bake, &other, &back].map(|b| shade(&**b, &self.points, None));
        let text = format!("another light takes {:.0} ms", 1e3 * seconds);
        Ok(if first == again && first != there { Outcome::Holds(text) } else { Outcome::Fails(text) })
    }

    /// Shading with normals other than the surface's.
    fn bumped(&self, truths: &mut Truths, task: &Task) -> Result<Outcome, Error> {
        let tilted: Vec<ReferencePoint> = self.points.iter().map(tilted).collect();
        let truth = match truths.entry(self.brdf.spec()) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(new) => {
                let reference = Reference::new(&lights::studio(), Lookup::Constant, task)?;
                let of = |points: &[ReferencePoint]| -> Result<Vec<[f64; 3]>, Error> {
                    let all = reference.radiance_batch(&*self.brdf, points, TOLERANCE, task)?;
                    Ok(all.iter().map(|e| e.rgb).collect())
                };
                new.insert([of(&self.points)?, of(&tilted)?])
            }
        };
        let error =
            |points: &[ReferencePoint], k: usize| difference(&shade(&*self.bake, points, None), &truth[k]);
        let errors = [error(&self.points, 0), error(&tilted, 1)];
        let [plain, turned] = errors;
        let text = format!("{:.1} % off, {:.1} % with turned normals", 100.0 * plain, 100.0 * turned);
        let holds = turned < BUMPED[0] * plain + BUMPED[1];
        Ok(if holds { Outcome::Holds(text) } else { Outcome::Fails(text) })
    }

    /// Reflectance that varies: a width of each point's own, or else a colour that multiplies.
    fn varying(&self, task: &Task) -> Result<Outcome, Error> {
        let preview = |brdf: SharedBrdf| self.bake.preview(None, Some(&Material::new(brdf)), task);
        if self.bake.varies().alpha && self.brdf.spec() == parse(GLOSSY)?.spec() {
            let wide = preview(parse(&GLOSSY.replace("alpha=0.25", &format!("alpha={OWN_WIDTH}")))?)?;
            let truth = shade(&*wide, &self.points, None);
            let found = shade(&*self.bake, &self.points, Some(OWN_WIDTH as f32));
            let error = difference(&found, &truth);
            let text = format!("width of each point: {:.2} % off a bake of that width", 100.0 * error);
            return Ok(if error < OWN_WIDTH_WITHIN { Outcome::Holds(text) } else { Outcome::Fails(text) });
        }
        if !takes(self.technique.card(), MATTE) {
            return self.by_texel(task);
        }
        // Linear in the albedo, so that a texture may multiply.
        let albedo = |a: &str| preview(parse(&format!("lambert:albedo={a}"))?).map_err(Error::from);
        let [whole, half] = [albedo("0.8")?, albedo("0.4")?].map(|b| shade(&*b, &self.points, None));
        let doubled: Vec<[f64; 3]> = half.iter().map(|v| v.map(|x| 2.0 * x)).collect();
        let error = difference(&doubled, &whole);
        let text = format!("colours multiply, to {error:.0e}");
        Ok(if error < 1e-4 { Outcome::Holds(text) } else { Outcome::Fails(text) })
    }
}

impl Shaded {
    /// Parameters of the reflectance from images, sampled at a different place for each point, against the
    /// integral with the point's own parameters.
    fn by_texel(&self, task: &Task) -> Result<Outcome, Error> {
        let planes = specimens::planes(self.technique.planes());
        let material = Material::new(self.brdf.clone()).with_textures(planes);
        let Some(texels) = TexelReflectance::of(&material) else {
            return Ok(Outcome::Fails("one reflectance".into()));
        };
        let bake = self.bake.preview(None, Some(&material), task)?;
        let light = lights::studio();
        let reference = Reference::new(&light, Lookup::Constant, task)?;
        let uv =
            |k: usize| [0.754_877_666, 0.569_840_291].map(|by: f64| ((k as f64 + 0.5) * by).fract() as f32);
        let of = |brdf: &SharedBrdf, p: &ReferencePoint| {
            reference.radiance(&**brdf, &p.frame, p.wo, p.position, TOLERANCE).rgb
        };
        let both = |k: usize| -> Result<[[f64; 3]; 2], Cancelled> {
            task.check()?;
            Ok([of(&texels.at(uv(k)), &self.points[k]), of(&self.brdf, &self.points[k])])
        };
        let both: Vec<_> =
            (0..self.points.len()).into_par_iter().with_max_len(1).map(both).collect::<Result<_, _>>()?;
        let [own, plain] = [0, 1].map(|i| both.iter().map(|b| b[i]).collect::<Vec<_>>());
        let found = shade_at(&*bake, &self.points, None, |k| uv(k).into());
        let [error, usual] =
            [difference(&found, &own), difference(&shade(&*self.bake, &self.points, None), &plain)];
        let text = format!(
            "numbers of each point: {:.1} % off, {:.1} % where all are one",
            100.0 * error,
            100.0 * usual
        );
        let holds = error < BUMPED[0] * usual + BUMPED[1];
        Ok(if holds { Outcome::Holds(text) } else { Outcome::Fails(text) })
    }
}

/// Normals spread over the sphere, views up to 70 degrees off them.
pub(super) fn points() -> Vec<ReferencePoint> {
    let one = |k: usize| {
        let u = |by: f64| ((k as f64 + 0.5) * by).fract();
        let (y, phi) = (1.0 - 2.0 * (k as f64 + 0.5) / POINTS as f64, TAU * u(0.618_033_989));
        let r = (1.0 - y * y).sqrt();
        let frame = Frame::from_normal(DVec3::new(r * phi.cos(), y, r * phi.sin()));
        let (cosine, turn) = (1.0 - 0.65 * u(0.754_877_666), TAU * u(0.569_840_291));
        let sine = (1.0 - cosine * cosine).sqrt();
        let wo = frame.to_world(DVec3::new(sine * turn.cos(), sine * turn.sin(), cosine));
        ReferencePoint { frame, wo, position: None }
    };
    (0..POINTS).map(one).collect()
}

/// The normal turned by [`TILT`] towards the view, so that it stays above the horizon.
pub(super) fn tilted(p: &ReferencePoint) -> ReferencePoint {
    let across = (p.wo - p.wo.dot(p.frame.n) * p.frame.n).try_normalize().unwrap_or(p.frame.t);
    let (s, c) = TILT.sin_cos();
    let n = p.frame.n * c + across * s;
    ReferencePoint { frame: Frame::from_normal_tangent(n, p.frame.t), ..*p }
}

/// Radiance of a bake at points, with the width of the lobe that they bring along, if any.
fn shade(bake: &dyn AnyBake, points: &[ReferencePoint], alpha: Option<f32>) -> Vec<[f64; 3]> {
    shade_at(bake, points, alpha, |_| Vec2::ZERO)
}

/// Radiance of a bake at points with these texture coordinates.
fn shade_at(
    bake: &dyn AnyBake,
    points: &[ReferencePoint],
    alpha: Option<f32>,
    uv: impl Fn(usize) -> Vec2,
) -> Vec<[f64; 3]> {
    let mut buf = PointsBuf::with_capacity(points.len());
    for (k, p) in (0..).zip(points) {
        let [n, t, wo] = [p.frame.n, p.frame.t, p.wo].map(|v| v.as_vec3());
        match alpha {
            Some(alpha) => buf.push_lobe([n, t, wo, Vec3::ZERO], PointLobe { alpha, ..PointLobe::PLAIN }),
            None => buf.push(n, t, wo, Vec3::ZERO),
        }
        buf.locate(uv(k as usize), [k; 3], [0.0; 2]);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
    bake.shade(&buf.as_points(), &mut Radiance::of(&mut rgb));
    (0..points.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from)).collect()
}

/// Relative RMS difference.
pub(super) fn difference(found: &[[f64; 3]], truth: &[[f64; 3]]) -> f64 {
    let square = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
    let (mut error, mut energy) = (0.0, 0.0);
    for (a, b) in found.iter().zip(truth) {
        error += square([0, 1, 2].map(|c| a[c] - b[c]));
        energy += square(*b);
    }
    (error / energy.max(f64::MIN_POSITIVE)).sqrt()
}

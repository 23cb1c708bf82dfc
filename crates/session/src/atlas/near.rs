//! Columns of figure 11 of techniques for directional and point lights, tried at points: shading is compared
//! with the reflectance itself under the same lights.

use super::trials::{BUMPED, Outcome, difference, points, tilted};
use super::{Chapter, Stage, scatters, usual_specimen};
use crate::Error;
use glam::{Vec2, Vec3};
use steradian_base::{ParamValues, Task};
use steradian_brdf::parse;
use steradian_reference::ReferencePoint;
use steradian_techniques::local::{AnyLocal, LocalBake, LocalFrame};
use steradian_techniques::shared::trials::{lights, specimens};
use steradian_techniques::{LocalLights, Material, PointsBuf, Radiance, TexelReflectance, View};

/// The least change of a picture by data per texel that counts as one: less is no more than an error that
/// pictures do not show.
const CHANGED: f64 = 0.01;
/// Where points lie, their normals times this: off a point light that is 1.6 from the origin.
const RADIUS: f32 = 1.0;
/// How far points are moved.
const MOVED: Vec3 = Vec3::new(0.3, -0.2, 0.1);

/// The six columns behind those of reflectances: varying reflectance, bumps, shadows and reflections (which
/// `scattered` has), light and objects that change.
pub(super) fn columns(
    t: &'static dyn AnyLocal,
    chapters: &[Chapter],
    scattered: Option<[Outcome; 2]>,
    task: &Task,
) -> Result<Vec<Outcome>, Error> {
    let slug = t.card().slug;
    let changed = chapters.iter().filter(|c| c.stage == Stage::Textured).find_map(|c| {
        let error = c.entries.iter().find(|e| e.card.slug == slug)?.error()?;
        let text = format!("data per texel change the picture by {:.0} %", 100.0 * error);
        Some(if error > CHANGED { Outcome::Holds(text) } else { Outcome::Fails(text) })
    });
    let data = || changed.clone().unwrap_or_else(|| Outcome::Fails("no data per texel".into()));
    let plain = AtPoints::new(t, Material::new(parse(usual_specimen(t.card()))?), task);
    let varying = varying(t, task)?.unwrap_or_else(data);
    let knows_neither = || Outcome::Fails("knows nothing of the surface around a point".into());
    let [shadows, bounces] = scattered.unwrap_or_else(|| [knows_neither(), knows_neither()]);
    let (bumps, relit, moved) = match &plain {
        Some(plain) => {
            let [bumps, relit, moved] = plain.tried()?;
            (if t.planes().is_empty() { bumps } else { data() }, relit, moved)
        }
        // What has no plain form is made of the reflectance or of its images alone.
        None => (
            data(),
            Outcome::Holds("its bake takes no light".into()),
            Outcome::Holds("its bake takes no mesh".into()),
        ),
    };
    let moved = if scatters(t) { Outcome::Fails("bakes on the mesh".into()) } else { moved };
    Ok(vec![varying, bumps, shadows, bounces, relit, moved])
}

/// Reflectance that varies by images, tried against the exact one; `None` where there is no exact one other
/// than the technique's own.
fn varying(t: &'static dyn AnyLocal, task: &Task) -> Result<Option<Outcome>, Error> {
    let brdf = parse(usual_specimen(t.card()))?;
    // Normals and tangents of each point's own are bumps.
    let planes: Vec<_> = t.planes().iter().copied().filter(|p| TexelReflectance::reads(p.name)).collect();
    let material = specimens::material(brdf.clone(), &planes);
    let Some(texels) = TexelReflectance::of(&material) else { return Ok(None) };
    let (Some(plain), Some(own)) =
        (AtPoints::new(t, Material::new(brdf.clone()), task), AtPoints::new(t, material, task))
    else {
        return Ok(None);
    };
    let all = points();
    let uv = |k: usize| {
        let part = |by: f64| ((k as f64 + 0.5) * by).fract() as f32;
        Vec2::new(part(0.754_877_666), part(0.569_840_291))
    };
    let light = local(&lights::three_directionals());
    let direct = light.direct(&View::default());
    let mut truth = Vec::new();
    for k in 0..all.len() {
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0]);
        let point = buffer(&all[k..=k], Vec3::ZERO, |_| uv(k));
        direct.add(&*texels.at(uv(k).into()), &point.as_points(), &mut Radiance::of(&mut rgb));
        truth.push([0, 1, 2].map(|c| f64::from(rgb[c][0])));
    }
    let error = difference(&own.shade(&light, &buffer(&all, Vec3::ZERO, uv))?, &truth);
    let usual = plain.error(&light, &all, Vec3::ZERO)?;
    let text = format!(
        "numbers of each point: {:.1} % off, {:.1} % where all are one",
        100.0 * error,
        100.0 * usual
    );
    Ok(Some(judged(error, usual, text)))
}

fn judged(error: f64, usual: f64, text: String) -> Outcome {
    if error < BUMPED[0] * usual + BUMPED[1] { Outcome::Holds(text) } else { Outcome::Fails(text) }
}

fn local(l: &steradian_light::Lights) -> LocalLights {
    LocalLights { directionals: l.directionals.clone(), points: l.points.clone() }
}

/// Points of a ball, moved.
fn buffer(points: &[ReferencePoint], by: Vec3, uv: impl Fn(usize) -> Vec2) -> PointsBuf {
    let mut q = PointsBuf::with_capacity(points.len());
    for (k, p) in points.iter().enumerate() {
        let [n, t, wo] = [p.frame.n, p.frame.t, p.wo].map(|v| v.as_vec3());
        q.push(n, t, wo, RADIUS * n + by);
        q.locate(uv(k), [0; 3], [0.0; 2]);
    }
    q
}

/// A bake that needs no mesh.
struct AtPoints {
    material: Material,
    bake: Box<dyn LocalBake>,
}

impl AtPoints {
    /// `None` where the technique takes the material with images, or with a mesh, alone.
    fn new(t: &'static dyn AnyLocal, material: Material, task: &Task) -> Option<Self> {
        let params: ParamValues = t.per_point().iter().copied().collect();
        let bake = t.bake(&material, None, &params, task).ok()?;
        Some(Self { material, bake })
    }

    fn shade(&self, lights: &LocalLights, q: &PointsBuf) -> Result<Vec<[f64; 3]>, Error> {
        let frame = LocalFrame { lights, view: &View::default(), mesh: None, shadowed: false };
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
        self.bake.lit(&frame)?.add(None, &q.as_points(), &mut Radiance::of(&mut rgb));
        Ok((0..q.len()).map(|i| [0, 1, 2].map(|c| f64::from(rgb[c][i]))).collect())
    }

    /// Relative RMS difference to the reflectance itself.
    fn error(&self, lights: &LocalLights, points: &[ReferencePoint], by: Vec3) -> Result<f64, Error> {
        let q = buffer(points, by, |_| Vec2::ZERO);
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
        let direct = lights.direct(&View::default());
        direct.add(&*self.material.brdf, &q.as_points(), &mut Radiance::of(&mut rgb));
        let truth: Vec<[f64; 3]> = (0..q.len()).map(|i| [0, 1, 2].map(|c| f64::from(rgb[c][i]))).collect();
        Ok(difference(&self.shade(lights, &q)?, &truth))
    }

    /// Normals that are not the surface's, other lights, other places, by one bake.
    fn tried(&self) -> Result<[Outcome; 3], Error> {
        let (far, near) = (local(&lights::three_directionals()), local(&lights::near_point()));
        let all = points();
        let turned: Vec<ReferencePoint> = all.iter().map(tilted).collect();
        let usual = self.error(&far, &all, Vec3::ZERO)?;
        let outcome = |error: f64, what: &str| {
            let text = format!("{:.1} % off, {:.1} % {what}", 100.0 * usual, 100.0 * error);
            judged(error, usual, text)
        };
        Ok([
            outcome(self.error(&far, &turned, Vec3::ZERO)?, "with turned normals"),
            outcome(self.error(&near, &all, Vec3::ZERO)?, "under another light"),
            outcome(self.error(&near, &all, MOVED)?, "under it elsewhere"),
        ])
    }
}

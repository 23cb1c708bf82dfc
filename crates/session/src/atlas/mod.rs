//! The atlas: every technique on the same scenes, and figure 11 of Kautz, *Hardware Lighting and Shading: a
//! Survey* (2004), with a test of each of its claims.
//!
//! Techniques for environments shade a knot under one light, glossy and matte, and are compared with the
//! reference. Those with self-shadowing are compared with the path tracer, next to the integral without
//! shadows, which shows the effect of visibility. A technique that accepts neither reflectance shows one of
//! its own. Techniques for directional and point lights shade the knot under three.

mod advice;
mod bumps;
mod forms;
mod near;
mod survey;
mod trials;

pub use advice::Advice;
pub use survey::{COLUMNS, published};
pub use trials::{Outcome, Tried};

use crate::compare::{Answer, Plan as Comparison, Rendering};
use crate::{Error, Local, Method, Paths, Renderer, Scene, Session};
use glam::DVec3;
use std::time::Instant;
use steradian_base::{Kind, ParamValues, Value};
use steradian_brdf::parse;
use steradian_light::{DirectionalLight, Lights};
use steradian_techniques::local::AnyLocal;
use steradian_techniques::shared::trials::specimens;
use steradian_techniques::{AnyTechnique, Card, locals, registry};

/// The light of techniques for environments.
pub const LIGHT: &str = "studio";
/// Shape in all pictures.
pub const SHAPE: &str = "knot";
/// The two reflectances that most techniques are shown with.
const GLOSSY: &str = "ggx:alpha=0.25,f0=1/0.77/0.34";
const MATTE: &str = "lambert:albedo=0.8/0.5/0.3";
/// Reflectances for techniques that accept neither the glossy nor the matte one, in order of preference.
const OTHERS: [&str; 2] = ["phong:n=40,scale=1/0.77/0.34", "banks:n=30,scale=0.15/0.11/0.05"];
/// Relative error of the reference at each sample: below the steps of eight bits.
const TOLERANCE: f64 = 2e-3;

/// Settings of an atlas.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Size of each picture, pixels.
    pub size: [usize; 2],
    /// Relative noise of traced pictures.
    pub noise: f64,
    /// Slugs of the techniques; empty for all.
    pub only: Vec<String>,
    /// The object.
    pub shape: &'static str,
}

/// Light of a chapter's pictures, and the reference that they are compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Environment without occlusion; compared with the integral.
    Open,
    /// Environment with shadows; compared with the path tracer.
    Shadowed,
    /// Three directional lights; compared with the sum over them.
    Local,
    /// Three directional lights with shadows and interreflection of the mesh, for techniques that compute
    /// these; compared with the path tracer.
    Scattered,
    /// Three directional lights, for techniques with data per texel; shown next to the surface without these
    /// data, which no reference supports.
    Textured,
}

/// A technique's answers, one for each renderer.
pub struct Entry {
    /// The technique.
    pub card: &'static Card,
    /// The pictures, or why there are none.
    pub answers: Vec<Answer>,
}

impl Entry {
    /// The first picture.
    pub fn rendering(&self) -> Option<&Rendering> {
        self.answers.first().and_then(Answer::rendering)
    }

    /// Relative RMS error of radiance over the object's pixels.
    pub fn error(&self) -> Option<f64> {
        self.rendering()?.errors.as_ref().map(|e| e.0.relative_rms)
    }
}

/// Techniques side by side on one scene.
pub struct Chapter {
    /// Light and reference.
    pub stage: Stage,
    /// Spec of the reflectance.
    pub brdf: String,
    /// The reference's picture.
    pub truth: Answer,
    /// Under [`Stage::Shadowed`] the relative RMS error of the integral without shadows.
    pub unshadowed: Option<f64>,
    /// The techniques.
    pub entries: Vec<Entry>,
}

/// A row of figure 11: the technique, and the outcome in each column of [`COLUMNS`].
pub struct Row {
    /// The technique.
    pub card: &'static Card,
    /// Outcomes by column.
    pub tried: [Tried; COLUMNS.len()],
}

/// Everything that was found.
pub struct Atlas {
    /// Pictures and their numbers.
    pub chapters: Vec<Chapter>,
    /// Figure 11.
    pub rows: Vec<Row>,
    /// The survey's advice, held against the numbers.
    pub advice: Vec<Advice>,
    /// Duration in seconds.
    pub seconds: f64,
}

/// Scattering events of the paths with which techniques with a single interreflection are compared.
pub const SCATTERED: u32 = 2;

/// Does a technique for directional and point lights compute shadows and interreflection of the mesh?
pub fn scatters(t: &dyn AnyLocal) -> bool {
    t.card().capabilities.interreflections && t.needs_sites(&ParamValues::default())
}

/// A reflectance that a technique accepts: the first of `preferred` whose model is among its specimens (so
/// that a mirror's technique shows a mirror), or else one of its own specimens.
pub fn specimen(card: &Card, preferred: &[&'static str]) -> &'static str {
    if let [only] = card.specimens {
        return only;
    }
    let found = preferred.iter().find(|s| shows(card, s)).or(card.specimens.first());
    found.copied().unwrap_or(MATTE)
}

/// [`specimen`] from the reflectances of the atlas.
pub fn usual_specimen(card: &Card) -> &'static str {
    specimen(card, &[GLOSSY, OTHERS[0], MATTE, OTHERS[1]])
}

/// Does a technique take a reflectance, and is it tested with its model?
fn shows(card: &Card, spec: &str) -> bool {
    let model = |spec: &str| spec.split(':').next().map(str::to_owned);
    card.specimens.iter().any(|s| model(s) == model(spec)) && takes(card, spec)
}

fn takes(card: &Card, spec: &str) -> bool {
    parse(spec).is_ok_and(|b| (card.materials)(&*b).is_ok())
}

/// Light of techniques for directional and point lights: a key, a fill and a rim light.
pub fn three_lights() -> Lights {
    let from = |x: f64, y: f64, z: f64, rgb: [f64; 3]| DirectionalLight {
        direction: DVec3::new(x, y, z).normalize(),
        irradiance: rgb,
    };
    Lights {
        directionals: vec![
            from(0.6, 0.7, 0.5, [3.0, 2.8, 2.4]),
            from(-0.8, 0.3, 0.4, [0.8, 1.0, 1.4]),
            from(0.1, 0.4, -0.9, [0.6, 0.6, 0.7]),
        ],
        ..Lights::default()
    }
}

/// Parameters with which a technique has self-shadowing: its defaults, or a single choice that enables it;
/// `None` where it has none.
fn shadowing(t: &dyn AnyTechnique) -> Option<ParamValues> {
    let plain = ParamValues::default();
    if t.self_shadowing(&plain) || t.card().needs.sites {
        return Some(plain);
    }
    let choices = t.params().iter().filter_map(|p| match p.kind {
        Kind::Choice(words) => Some((p.name, words)),
        _ => None,
    });
    let all = choices.flat_map(|(name, words)| words.iter().rev().map(move |w| (name, *w)));
    let mut with = all.map(|(name, word)| {
        let mut values = ParamValues::default();
        values.0.insert(name.into(), Value::from(word));
        values
    });
    with.find(|values| t.self_shadowing(values))
}

impl Session {
    /// Every technique on the same scenes, each on each renderer.
    pub fn atlas(&mut self, plan: &Plan, renderers: &[Renderer]) -> Result<Atlas, Error> {
        let start = Instant::now();
        let kept = self.paths;
        let made = self.chapters(plan, renderers).and_then(|chapters| {
            let rows = self.tried(plan, &chapters)?;
            Ok((chapters, rows))
        });
        self.paths = kept;
        let (chapters, rows) = made?;
        let advice = advice::all(&chapters, &rows);
        Ok(Atlas { chapters, rows, advice, seconds: start.elapsed().as_secs_f64() })
    }

    fn chapters(&mut self, plan: &Plan, renderers: &[Renderer]) -> Result<Vec<Chapter>, Error> {
        let global: Vec<&'static dyn AnyTechnique> =
            registry().iter().copied().filter(|t| plan.has(t.card())).collect();
        let mut out = Vec::new();
        let open: Vec<_> = global.iter().copied().filter(|t| !t.card().needs.sites).collect();
        for (spec, all) in by_reflectance(&open) {
            out.push(self.chapter(plan, Stage::Open, &spec, &all, renderers)?);
        }
        let shadowed: Vec<_> = global.iter().copied().filter(|t| shadowing(*t).is_some()).collect();
        for (spec, all) in by_reflectance(&shadowed) {
            out.push(self.chapter(plan, Stage::Shadowed, &spec, &all, renderers)?);
        }
        for t in locals().iter().copied().filter(|t| plan.has(t.card())) {
            let (stage, spec, truth, entry) = self.local(plan, t, renderers)?;
            match out.iter_mut().find(|c: &&mut Chapter| c.stage == stage && c.brdf == spec) {
                Some(chapter) => chapter.entries.push(entry),
                None => out.push(Chapter {
                    stage,
                    brdf: spec.into(),
                    truth,
                    unshadowed: None,
                    entries: vec![entry],
                }),
            }
        }
        out.sort_by_key(|c| c.stage);
        Ok(out)
    }

    /// Techniques for environments on one scene.
    fn chapter(
        &mut self,
        plan: &Plan,
        stage: Stage,
        spec: &str,
        techniques: &[&'static dyn AnyTechnique],
        renderers: &[Renderer],
    ) -> Result<Chapter, Error> {
        let mut scene = self.knot(plan, spec)?;
        let paths = stage == Stage::Shadowed;
        self.paths = Paths { bounces: 1, noise: plan.noise };
        if paths {
            // No other technique has parameters of these names.
            let values = techniques.iter().filter_map(|t| shadowing(*t)).flat_map(|v| v.0);
            scene.materials[0].params.0.extend(values);
        }
        let mut methods: Vec<Method> = techniques.iter().map(|t| Method::Technique(*t)).collect();
        if paths {
            methods.insert(0, Method::Reference);
        }
        let comparison = Comparison { reference_tolerance: TOLERANCE, paths, ev: 0.0, certificates: true };
        let mut answers = self.compared(&scene, &methods, renderers, &comparison)?.into_iter();
        let truth = answers.next().ok_or_else(no_answer)?;
        let error = |a: Answer| a.rendering()?.errors.as_ref().map(|e| e.0.relative_rms);
        let unshadowed = if paths { answers.next().and_then(error) } else { None };
        let mut each = || -> Vec<Answer> { answers.by_ref().take(renderers.len()).collect() };
        let entries = techniques.iter().map(|t| Entry { card: t.card(), answers: each() }).collect();
        Ok(Chapter { stage, brdf: spec.into(), truth, unshadowed, entries })
    }

    /// A technique for directional and point lights: its stage, reflectance, reference picture, and answers.
    fn local(
        &mut self,
        plan: &Plan,
        technique: &'static dyn AnyLocal,
        renderers: &[Renderer],
    ) -> Result<(Stage, &'static str, Answer, Entry), Error> {
        let card = technique.card();
        let planes = technique.planes();
        let stage = match scatters(technique) {
            true => Stage::Scattered,
            false if planes.is_empty() && !specimens::is_bidirectional(planes) => Stage::Local,
            false => Stage::Textured,
        };
        let (spec, scene, other) = self.near(plan, technique, card.slug)?;
        let paths = stage == Stage::Scattered;
        let comparison = Comparison { reference_tolerance: TOLERANCE, paths, ev: 0.0, certificates: true };
        let answers = self.compared(&scene, &[other], renderers, &comparison)?;
        let mut answers = answers.into_iter();
        let truth = answers.next().ok_or_else(no_answer)?;
        Ok((stage, spec, truth, Entry { card, answers: answers.collect() }))
    }

    /// The knot under three directional lights by a technique for them, with its parameters: the reflectance,
    /// the scene, and the picture it is shown with. Paths have as many scattering events as its light.
    fn near(
        &mut self,
        plan: &Plan,
        technique: &'static dyn AnyLocal,
        local: &str,
    ) -> Result<(&'static str, Scene, Method), Error> {
        let (spec, planes) = (usual_specimen(technique.card()), technique.planes());
        self.paths = Paths { bounces: SCATTERED, noise: plan.noise };
        let mut scene = self.knot(plan, spec)?;
        scene.lights = three_lights();
        let mut local = Local::parse(local)?.map(|l| l.with_planes(specimens::planes(planes)));
        if specimens::is_bidirectional(planes) {
            local = local.map(|l| l.with_apparent(specimens::apparent()));
        }
        scene.materials.iter_mut().for_each(|m| m.local.clone_from(&local));
        let brdf = &scene.materials[0].brdf;
        let idle =
            |t: &&&'static dyn AnyTechnique| !t.card().needs.sites && (t.card().materials)(&**brdf).is_ok();
        let other = registry().iter().find(idle);
        let other = other.ok_or_else(|| Error::failed(format!("{spec}: no technique takes it")))?;
        Ok((spec, scene, Method::Technique(*other)))
    }

    fn knot(&mut self, plan: &Plan, spec: &str) -> Result<Scene, Error> {
        let mut scene = Scene::of(plan.shape, Some(spec), LIGHT, self)?;
        [scene.settings.width, scene.settings.height] = plan.size;
        Ok(scene)
    }
}

impl Plan {
    fn has(&self, card: &Card) -> bool {
        self.only.is_empty() || self.only.iter().any(|s| s.replace('-', "_") == card.slug)
    }
}

fn no_answer() -> Error {
    Error::failed("a comparison without an answer")
}

/// Techniques grouped by the reflectances that they are shown with: glossy, matte, and for techniques that
/// accept neither one of their own.
fn by_reflectance(all: &[&'static dyn AnyTechnique]) -> Vec<(String, Vec<&'static dyn AnyTechnique>)> {
    let mut out: Vec<(String, Vec<&'static dyn AnyTechnique>)> = Vec::new();
    for spec in [GLOSSY, MATTE] {
        let some: Vec<_> = all.iter().copied().filter(|t| shows(t.card(), spec)).collect();
        if !some.is_empty() {
            out.push((spec.into(), some));
        }
    }
    // A technique with a glossy reflectance of its own is shown with that in addition to the matte one.
    let own = |card| OTHERS.iter().any(|s| shows(card, s)) || !shows(card, MATTE);
    for t in all.iter().copied().filter(|t| !shows(t.card(), GLOSSY) && own(t.card())) {
        let spec = specimen(t.card(), &OTHERS);
        match out.iter_mut().find(|(s, _)| s == spec) {
            Some((_, some)) => some.push(t),
            None => out.push((spec.into(), vec![t])),
        }
    }
    out
}

#[cfg(test)]
mod tests;

//! Techniques beside the reference: one picture each, and how far it is from the judge's.

use crate::context::Context;
use crate::failure::Failure;
use crate::inputs::Method;
use crate::studio::{self, Look};
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Instant;
use steradian_base::{Certificate, ParamValues};
use steradian_brdf::SharedBrdf;
use steradian_light::Lights;
use steradian_render::metrics::{DEFAULT_PPD, Errors, errors, flip_displays};
use steradian_render::{
    Backdrop, Background, Cell, Develop, Display, Film, Settings, Stage, ToneMapper, render,
};
use steradian_scene::{Bvh, Camera, Mesh};

/// One light, one material, one mesh.
pub struct Case {
    /// Lines that name it; the first is the material or the scene.
    pub label: Vec<String>,
    pub mesh: Arc<(Mesh, Bvh)>,
    pub camera: Camera,
    pub lights: Arc<Lights>,
    pub brdf: SharedBrdf,
    /// What is seen beside the mesh.
    pub background: Arc<Background>,
    /// Exposure value on top of the automatic one.
    pub ev: f32,
}

/// One technique's picture of a case.
pub struct Shown {
    pub slug: &'static str,
    pub picture: Display,
    /// `None` for the reference itself.
    pub errors: Option<(Errors, f64)>,
    pub certificate: Option<Certificate>,
    pub bake_seconds: f64,
    pub shade_seconds: f64,
    pub bytes: usize,
}

/// A technique's answer to a case: a picture, or why there is none.
pub enum Answer {
    Shown(Box<Shown>),
    Refused { slug: &'static str, why: String },
}

/// How pictures of a study are made.
pub struct Plan {
    pub settings: Settings,
    pub tone_mapper: ToneMapper,
    /// Relative error of the reference at each sample.
    pub tolerance: f64,
}

/// The backdrop of a case.
pub fn backdrop(lights: &Lights, camera: &Camera, height: usize, blur: f64) -> Background {
    Background::Sky(Backdrop::new(lights, studio::footprint(camera, height).max(blur)))
}

/// The reference first, then each technique.
pub fn run(case: &Case, methods: &[Method], plan: &Plan, context: &Context) -> Result<Vec<Answer>, Failure> {
    let (reference, seconds, _) = film(case, Method::Reference, plan, context)?;
    let develop =
        Develop { ev: case.ev + crate::commands::render::expose(&reference), mapper: plan.tone_mapper };
    let truth = develop.film(&reference);
    let mut out = Vec::new();
    for method in methods {
        out.push(match film(case, *method, plan, context) {
            Ok((film, shade_seconds, baked)) => {
                let picture = develop.film(&film);
                let errors = compare(&film, &picture, &reference, &truth);
                Answer::Shown(Box::new(Shown {
                    slug: method.slug(),
                    picture,
                    errors: Some(errors),
                    certificate: baked.certificate,
                    bake_seconds: baked.seconds,
                    shade_seconds,
                    bytes: baked.bytes,
                }))
            }
            Err(f) if f.code == 2 => Answer::Refused { slug: method.slug(), why: f.message },
            Err(f) => return Err(f),
        });
    }
    let shown = Shown {
        slug: "reference",
        picture: truth,
        errors: None,
        certificate: None,
        bake_seconds: 0.0,
        shade_seconds: seconds,
        bytes: 0,
    };
    out.insert(0, Answer::Shown(Box::new(shown)));
    Ok(out)
}

fn film(
    case: &Case,
    method: Method,
    plan: &Plan,
    context: &Context,
) -> Result<(Film, f64, studio::Baked), Failure> {
    let look = Look { brdf: case.brdf.clone(), method, params: ParamValues::default(), texture: None };
    let tolerance = matches!(method, Method::Reference).then_some(plan.tolerance);
    let baked = studio::bake(&look, &case.lights, &case.camera, tolerance, context)?;
    let surfaces = [baked.surface.clone()];
    let stage = Stage {
        mesh: &case.mesh.0,
        bvh: &case.mesh.1,
        surfaces: &surfaces,
        background: &case.background,
        camera: case.camera,
    };
    let start = Instant::now();
    let film = render(&stage, &plan.settings, &context.task)?;
    Ok((film, start.elapsed().as_secs_f64(), baked))
}

/// Relative RMS error of radiance and mean FLIP, over the pixels that the mesh covers.
fn compare(film: &Film, picture: &Display, reference: &Film, truth: &Display) -> (Errors, f64) {
    let covered = |i: usize| reference.alpha[i] > 0.999;
    let e = errors(film, reference, covered);
    let map = flip_displays(truth, picture, DEFAULT_PPD).map;
    let (sum, n) = (0..map.len())
        .filter(|&i| covered(i))
        .fold((0.0, 0usize), |(s, n), i| (s + f64::from(map[i]), n + 1));
    (e, sum / n.max(1) as f64)
}

impl Answer {
    /// The technique's slug.
    pub fn slug(&self) -> &'static str {
        match self {
            Self::Shown(s) => s.slug,
            Self::Refused { slug, .. } => slug,
        }
    }

    /// The cell of a contact sheet; nothing for a refusal. `named` puts the technique's name into the caption.
    pub fn cell(&self, named: bool) -> Option<Cell> {
        let Self::Shown(s) = self else { return None };
        let error = s.errors.as_ref().map(|(e, flip)| {
            let percent = 100.0 * e.relative_rms;
            if percent < 9.95 {
                format!("{percent:.1} %  FLIP {flip:.3}")
            } else {
                format!("{percent:.0} %  FLIP {flip:.3}")
            }
        });
        let name = match (named, &error) {
            (false, _) => None,
            (true, Some(_)) => Some(s.slug.replace('_', " ")),
            (true, None) => Some("reference".into()),
        };
        Some(Cell { picture: s.picture.clone(), caption: name.into_iter().chain(error).collect() })
    }

    /// The entry of a JSON document.
    pub fn json(&self) -> Value {
        match self {
            Self::Refused { slug, why } => json!({"technique": slug, "refused": why}),
            Self::Shown(s) => json!({
                "technique": s.slug,
                "relative_rms": s.errors.as_ref().map(|e| e.0.relative_rms),
                "rmse": s.errors.as_ref().map(|e| e.0.rmse),
                "rel_mse": s.errors.as_ref().map(|e| e.0.rel_mse),
                "flip": s.errors.as_ref().map(|e| e.1),
                "certificate": s.certificate.as_ref().map(|c| json!({"error": c.error, "known": c.known.word()})),
                "bake_seconds": s.bake_seconds,
                "shade_seconds": s.shade_seconds,
                "bytes": s.bytes,
            }),
        }
    }
}

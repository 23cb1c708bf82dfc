//! Techniques beside the reference: one picture each, and how far it is from the judge's.

use crate::context::Context;
use crate::engine::Engine;
use crate::failure::Failure;
use crate::inputs::Method;
use crate::looks::{self, Wanted};
use crate::studio::{self, Baked};
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Instant;
use steradian_base::{Certificate, ParamValues};
use steradian_brdf::SharedBrdf;
use steradian_light::Lights;
use steradian_render::metrics::{DEFAULT_PPD, Errors, difference_picture, errors, flip_displays};
use steradian_render::{
    Backdrop, Background, Cell, Develop, Display, Film, Maps, Settings, Stage, ToneMapper,
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

/// A mesh of any number of materials under one light.
pub struct Subject {
    /// The mesh, whose material slots are indices into `looks`.
    pub mesh: Arc<(Mesh, Bvh)>,
    pub camera: Camera,
    pub lights: Arc<Lights>,
    /// The materials; their techniques are not looked at.
    pub looks: Vec<Wanted>,
    /// What is seen beside the mesh.
    pub background: Arc<Background>,
    /// Exposure value on top of the automatic one.
    pub ev: f32,
}

impl Subject {
    fn of(case: &Case) -> Self {
        let look = Wanted {
            brdf: case.brdf.clone(),
            method: None,
            params: ParamValues::default(),
            texture: None,
            maps: Maps::default(),
        };
        Self {
            mesh: case.mesh.clone(),
            camera: case.camera,
            lights: case.lights.clone(),
            looks: vec![look],
            background: case.background.clone(),
            ev: case.ev,
        }
    }
}

/// One technique's picture of a case.
pub struct Shown {
    /// Technique, with the file of a saved bake.
    pub label: String,
    /// Where it was computed: cpu or gpu.
    pub backend: &'static str,
    pub picture: Display,
    /// `None` for the reference itself.
    pub errors: Option<(Errors, f64)>,
    /// Where the picture differs from the reference (FLIP); `None` for the reference itself.
    pub difference: Option<Display>,
    /// Mean FLIP to the CPU's picture, where both were asked for.
    pub flip_to_cpu: Option<f64>,
    pub certificate: Option<Certificate>,
    pub bake_seconds: f64,
    pub shade_seconds: f64,
    pub bytes: usize,
}

/// A technique's answer to a case: a picture, or why there is none.
pub enum Answer {
    Shown(Box<Shown>),
    Refused { label: String, backend: &'static str, why: String },
}

/// How pictures of a study are made.
pub struct Plan {
    pub settings: Settings,
    pub tone_mapper: ToneMapper,
    /// Relative error of the reference at each sample.
    pub tolerance: f64,
    /// Relative RMS error that techniques are asked for.
    pub asked: Option<f64>,
}

/// The backdrop of a case.
pub fn backdrop(lights: &Lights, camera: &Camera, height: usize, blur: f64) -> Background {
    Background::Sky(Backdrop::new(lights, studio::footprint(camera, height).max(blur)))
}

/// The reference first, then each technique on each engine.
pub fn run(
    case: &Case,
    methods: &[Method],
    plan: &Plan,
    engines: &[Engine],
    context: &Context,
) -> Result<Vec<Answer>, Failure> {
    run_subject(&Subject::of(case), methods, plan, engines, context)
}

/// [`run`] for any number of materials: a technique shades those that it takes, the reference the others.
pub fn run_subject(
    case: &Subject,
    methods: &[Method],
    plan: &Plan,
    engines: &[Engine],
    context: &Context,
) -> Result<Vec<Answer>, Failure> {
    let baked = bake(case, &Method::Reference, plan, context)?;
    let (reference, _, seconds) = film(case, &baked, plan, &Engine::Cpu, context)?;
    let develop =
        Develop { ev: case.ev + crate::commands::render::expose(&reference), mapper: plan.tone_mapper };
    let truth = develop.film(&reference);
    let mut out = Vec::new();
    for method in methods {
        let label = method.label();
        let baked = match bake(case, method, plan, context) {
            Ok(baked) => baked,
            Err(f) if f.code == 2 => {
                let refused = |e: &Engine| Answer::Refused {
                    label: label.clone(),
                    backend: e.name(),
                    why: f.message.clone(),
                };
                out.extend(engines.iter().map(refused));
                continue;
            }
            Err(f) => return Err(f),
        };
        let mut on_cpu: Option<Display> = None;
        for engine in engines {
            let (film, backend, shade_seconds) = film(case, &baked, plan, engine, context)?;
            let picture = develop.film(&film);
            let flip_to_cpu = on_cpu.as_ref().map(|cpu| flip_displays(cpu, &picture, DEFAULT_PPD).mean);
            if engines.len() > 1 && backend == "cpu" {
                on_cpu = Some(picture.clone());
            }
            let (e, flip, difference) = compare(&film, &picture, &reference, &truth);
            out.push(Answer::Shown(Box::new(Shown {
                label: label.clone(),
                backend,
                errors: Some((e, flip)),
                difference: Some(difference),
                picture,
                flip_to_cpu,
                certificate: worst(&baked),
                bake_seconds: baked.iter().map(|b| b.seconds).sum(),
                shade_seconds,
                bytes: baked.iter().map(|b| b.bytes).sum(),
            })));
        }
    }
    let shown = Shown {
        label: Method::Reference.label(),
        backend: Engine::Cpu.name(),
        picture: truth,
        errors: None,
        difference: None,
        flip_to_cpu: None,
        certificate: None,
        bake_seconds: 0.0,
        shade_seconds: seconds,
        bytes: 0,
    };
    out.insert(0, Answer::Shown(Box::new(shown)));
    Ok(out)
}

/// The certificate of the largest error.
fn worst(baked: &[Baked]) -> Option<Certificate> {
    let all = baked.iter().filter_map(|b| b.certificate.clone());
    all.max_by(|a, b| a.error.total_cmp(&b.error))
}

/// Bakes `method` for the materials that it takes and the reference for the others; fails where it takes none.
fn bake(case: &Subject, method: &Method, plan: &Plan, context: &Context) -> Result<Vec<Baked>, Failure> {
    let one = |look: &Wanted, method: &Method| {
        let tolerance = match method {
            Method::Reference => Some(plan.tolerance),
            _ => plan.asked,
        };
        let mut look = look.with(method.clone());
        if let Method::Technique(t) = method {
            // What is given for several techniques goes to those that have it.
            look.params.0.retain(|name, _| t.params().iter().any(|p| p.name == name));
        }
        let baked = studio::bake(&look, &case.lights, &case.camera, tolerance, context)?;
        looks::say_left_out((&look, &baked), context);
        Ok::<_, Failure>(baked)
    };
    let mut out: Vec<Baked> = Vec::new();
    let mut refused = None;
    for (i, look) in case.looks.iter().enumerate() {
        if let Some(k) = case.looks[..i]
            .iter()
            .position(|l| l.brdf.spec() == look.brdf.spec() && l.maps.is_empty() == look.maps.is_empty())
        {
            out.push(looks::shared(&out[k], look.texture.clone(), look.maps.clone()));
            continue;
        }
        out.push(match one(look, method) {
            Err(f) if f.code == 2 => {
                refused = Some(f);
                one(look, &Method::Reference)?
            }
            other => other?,
        });
    }
    match refused {
        Some(f) if out.iter().all(|b| b.certificate.is_none()) => Err(f),
        _ => Ok(out),
    }
}

/// The picture, the engine that made it, and its seconds.
fn film(
    case: &Subject,
    baked: &[Baked],
    plan: &Plan,
    engine: &Engine,
    context: &Context,
) -> Result<(Film, &'static str, f64), Failure> {
    let surfaces: Vec<_> = baked.iter().map(|b| b.surface.clone()).collect();
    let rooms: Vec<&Baked> = baked.iter().collect();
    let stage = Stage {
        mesh: &case.mesh.0,
        bvh: &case.mesh.1,
        surfaces: &surfaces,
        background: &case.background,
        camera: case.camera,
    };
    let start = Instant::now();
    let (film, backend) = engine.film(&stage, &rooms, &plan.settings, context)?;
    Ok((film, backend, start.elapsed().as_secs_f64()))
}

/// Relative RMS error of radiance and mean FLIP, over the pixels that the mesh covers, and a picture of FLIP.
fn compare(film: &Film, picture: &Display, reference: &Film, truth: &Display) -> (Errors, f64, Display) {
    let covered = |i: usize| reference.alpha[i] > 0.999;
    let e = errors(film, reference, covered);
    let map = flip_displays(truth, picture, DEFAULT_PPD).map;
    let (sum, n) = (0..map.len())
        .filter(|&i| covered(i))
        .fold((0.0, 0usize), |(s, n), i| (s + f64::from(map[i]), n + 1));
    (e, sum / n.max(1) as f64, difference_picture(&map, truth.width, truth.height))
}

impl Answer {
    /// The technique's slug, and the GPU where it computed.
    pub fn name(&self) -> String {
        let (label, backend) = match self {
            Self::Shown(s) => (&s.label, s.backend),
            Self::Refused { label, backend, .. } => (label, *backend),
        };
        if backend == "cpu" { label.clone() } else { format!("{label} ({backend})") }
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
            (true, Some(_)) => Some(self.name().replace('_', " ")),
            (true, None) => Some("reference".into()),
        };
        Some(Cell { picture: s.picture.clone(), caption: name.into_iter().chain(error).collect() })
    }

    /// The entry of a JSON document.
    pub fn json(&self) -> Value {
        match self {
            Self::Refused { label, backend, why } => {
                json!({"technique": label, "backend": backend, "refused": why})
            }
            Self::Shown(s) => json!({
                "technique": s.label,
                "backend": s.backend,
                "relative_rms": s.errors.as_ref().map(|e| e.0.relative_rms),
                "rmse": s.errors.as_ref().map(|e| e.0.rmse),
                "rel_mse": s.errors.as_ref().map(|e| e.0.rel_mse),
                "flip": s.errors.as_ref().map(|e| e.1),
                "flip_to_cpu": s.flip_to_cpu,
                "certificate": s.certificate.as_ref().map(|c| json!({"error": c.error, "known": c.known.word()})),
                "bake_seconds": s.bake_seconds,
                "shade_seconds": s.shade_seconds,
                "bytes": s.bytes,
            }),
        }
    }
}

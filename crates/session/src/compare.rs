//! Comparison of techniques with the reference: a picture of each, and its difference from the reference's.

use crate::material::Under;
use crate::picture::{auto_exposure, background};
use crate::probes::has_no_light;
use crate::scene::{Sited, given_to};
use crate::{Error, Kind, Material, Method, Outcome, Prepared, Renderer, Scene, Session};
use std::sync::Arc;
use std::time::Instant;
use steradian_base::Certificate;
use steradian_light::Lights;
use steradian_reference::{Lookup, Reference};
use steradian_render::metrics::{DEFAULT_PPD, Errors, difference_picture, errors, flip_displays};
use steradian_render::{
    Background, Develop, Display, Film, ReferenceShader, Settings, Stage, Surface, SurfaceMaps, render,
};
use steradian_scene::surface::Planes;
use steradian_scene::{Bvh, Camera};
use steradian_techniques::{Capabilities, find};

/// Separator between the names of a technique and of that for directional and point lights.
const BESIDE: &str = " + ";

/// Settings of a comparison.
#[derive(Debug, Clone, Copy)]
pub struct Plan {
    /// Relative error of the reference at each sample.
    pub reference_tolerance: f64,
    /// Is the reference the path tracer ([`Session::paths`]), with shadows and interreflection? Its noise is
    /// subtracted from relative RMS errors.
    pub paths: bool,
    /// Exposure value on top of the automatic one.
    pub ev: f32,
    /// Are errors over all views measured too, beside those of the pictures?
    pub certificates: bool,
}

/// Limits of the reference at each point: the relative error, as the reference estimates it, and a number of
/// evaluations of the reflectance at which it stops in any case.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Effort {
    pub tolerance: f64,
    pub evaluations: u64,
}

impl Effort {
    /// Pixels a side of the small picture by which the error of an effort is measured.
    const CHECK_SIDE: usize = 20;
    /// Factor of the greater effort that it is compared with: the reference's own estimate, which adds up
    /// cells whose errors cancel, asks for 30,000 to 250,000 evaluations a point of a measured table where
    /// 5,000 to 10,000 are 0.01 % off.
    const FINER: u64 = 5;

    fn finer(self) -> Self {
        Self { tolerance: self.tolerance / Self::FINER as f64, evaluations: self.evaluations * Self::FINER }
    }
}

/// One technique's picture.
pub struct Rendering {
    /// Technique, with the file of a saved bake.
    pub label: String,
    /// Where it was computed: cpu or gpu.
    pub backend: &'static str,
    /// Tone-mapped.
    pub picture: Display,
    /// Errors of radiance and mean FLIP over the pixels that the mesh covers; `None` for the reference
    /// itself.
    pub errors: Option<(Errors, f64)>,
    /// Where the picture differs from the reference (FLIP); `None` for the reference itself.
    pub difference: Option<Display>,
    /// Mean FLIP to the CPU's picture, where both back ends were used.
    pub flip_to_cpu: Option<f64>,
    /// The technique's certificate; of several materials that with the largest error.
    pub certificate: Option<Certificate>,
    /// Seconds of the bakes.
    pub bake_seconds: f64,
    /// Seconds of the picture.
    pub shade_seconds: f64,
    /// Bytes that shading reads.
    pub bytes: usize,
}

/// A technique's answer: a picture, or why there is none.
pub enum Answer {
    /// A picture.
    Rendered(Box<Rendering>),
    /// A refusal.
    Refused {
        /// Technique, with the file of a saved bake.
        label: String,
        /// Where it was to be computed: cpu or gpu.
        backend: &'static str,
        /// Why.
        why: String,
    },
}

impl Answer {
    fn label(&self) -> &str {
        match self {
            Self::Rendered(r) => &r.label,
            Self::Refused { label, .. } => label,
        }
    }

    fn on_backend(&self, name: &str) -> String {
        let backend = match self {
            Self::Rendered(r) => r.backend,
            Self::Refused { backend, .. } => backend,
        };
        if backend == "cpu" { name.into() } else { format!("{name} ({backend})") }
    }

    /// The technique's name, and the GPU where it computed.
    pub fn name(&self) -> String {
        self.on_backend(self.label())
    }

    /// [`Self::name`] split in two: the technique's, and that of the technique for directional and point
    /// lights, if there is one.
    pub fn names(&self) -> (String, Option<String>) {
        match self.label().split_once(BESIDE) {
            Some((technique, local)) => (self.on_backend(technique), Some(local.into())),
            None => (self.name(), None),
        }
    }

    /// Capabilities of the technique; `None` for the reference.
    pub fn capabilities(&self) -> Option<Capabilities> {
        let label = self.label();
        let slug = label.split_once(BESIDE).map_or(label, |(technique, _)| technique);
        let slug = slug.split_once(' ').map_or(slug, |(technique, _)| technique);
        Some(find(slug)?.card().capabilities)
    }

    /// Relative RMS error of a technique's picture.
    pub fn error(&self) -> Option<f64> {
        Some(self.rendering()?.errors.as_ref()?.0.relative_rms)
    }

    /// The picture.
    pub fn rendering(&self) -> Option<&Rendering> {
        match self {
            Self::Rendered(r) => Some(r),
            Self::Refused { .. } => None,
        }
    }
}

/// A scene on its way to pictures.
pub(crate) struct Subject<'a> {
    scene: &'a Scene,
    /// The scene's light, or the mean of its light field.
    lights: Lights,
    bvh: Bvh,
    camera: Camera,
    background: Background,
    settings: Settings,
}

impl Session {
    /// The reference's picture of a scene first, then each technique's on each renderer. A technique shades
    /// the materials that it accepts, the reference all other ones. The materials' own techniques are
    /// ignored. Where the scene has a tolerance, the relative RMS errors of all pictures are compared with
    /// it.
    pub fn compare(
        &self,
        scene: &Scene,
        methods: &[Method],
        renderers: &[Renderer],
        plan: &Plan,
    ) -> Result<Outcome<Vec<Answer>>, Error> {
        let answers = self.compared(scene, methods, renderers, plan)?;
        let errors = answers.iter().filter_map(Answer::error);
        // NaN counts as worse than any error.
        let worst = errors.fold(0.0, |w: f64, e| if w.is_nan() || e.is_nan() { f64::NAN } else { w.max(e) });
        Ok(Outcome::new(answers, scene.tolerance, worst))
    }

    /// [`Session::compare`] without a tolerance.
    pub(crate) fn compared(
        &self,
        scene: &Scene,
        methods: &[Method],
        renderers: &[Renderer],
        plan: &Plan,
    ) -> Result<Vec<Answer>, Error> {
        let camera = scene.camera_or_framed()?;
        let scene = &*scene.staged(&camera, &scene.sited_by(methods), &self.task)?;
        let renderers = if scene.probes.is_some() {
            methods.iter().chain(plan.paths.then_some(&Method::Path)).try_for_each(has_no_light)?;
            &[Renderer::Cpu]
        } else {
            renderers
        };
        let case = &self.subject(scene, camera)?;
        let (truth, first) = self.true_picture(case, plan)?;
        let mut out = vec![first];
        for method in methods {
            // The integral runs on the CPU alone.
            let on = if matches!(method, Method::Reference) { &[Renderer::Cpu] } else { renderers };
            self.answers(case, method, on, plan, &truth, &mut out)?;
        }
        Ok(out)
    }

    /// A staged scene on its way to pictures.
    pub(crate) fn subject<'a>(&self, scene: &'a Scene, camera: Camera) -> Result<Subject<'a>, Error> {
        Ok(Subject {
            scene,
            lights: self.in_mean_light(scene)?.lights.clone(),
            bvh: Bvh::build(&scene.mesh),
            camera,
            background: background(scene, &camera),
            settings: Settings { inner: 1, share: true, ..scene.settings },
        })
    }

    /// The reference's picture.
    pub(crate) fn true_picture(&self, case: &Subject<'_>, plan: &Plan) -> Result<(Truth, Answer), Error> {
        let (scene, camera) = (case.scene, case.camera);
        let start = Instant::now();
        if plan.paths && scene.materials.iter().any(|m| !m.planes.is_empty()) {
            let why = "paths know one reflectance of a material: leave out `path` beside images of a technique's numbers";
            return Err(Error::usage(why));
        }
        let (reference, certificate) = if plan.paths {
            let traced = self.trace(scene, camera, &case.background, case.settings, self.paths)?;
            let certificate = traced.certificate();
            (traced.film, Some(certificate))
        } else {
            let exact = self.prepare_by(case, &Method::Reference, plan)?;
            (self.film_of(case, &exact, &Renderer::Cpu)?.0, None)
        };
        let seconds = start.elapsed().as_secs_f64();
        let truth = Truth::new(reference, certificate, scene, plan.ev);
        let answer = Answer::Rendered(Box::new(truth.rendering(seconds)));
        Ok((truth, answer))
    }

    /// The reference's picture of a scene's first material with a limited effort, and its error: the relative
    /// RMS difference from five times the effort, measured at the points of a small picture. The reference's
    /// own estimate adds up errors of many cells that largely cancel: of tabulated reflectance, which has a
    /// crease at every cell, it is 10 to 1000 times too large.
    pub(crate) fn true_picture_by(&self, case: &Subject<'_>, effort: Effort) -> Result<(Truth, f64), Error> {
        let reference = Reference::new(&case.lights, Lookup::Bilinear, &self.task)?;
        let film = |e: Effort, settings: Settings| -> Result<Film, Error> {
            let reference = Arc::new(reference.clone().with_budget(e.evaluations));
            let brdf = case.scene.materials[0].brdf.clone();
            let shader = Arc::new(ReferenceShader::new(reference, brdf, e.tolerance));
            let stage = Stage {
                mesh: &case.scene.mesh,
                bvh: &case.bvh,
                surfaces: &[Surface { shader, base_colour: None, maps: SurfaceMaps::default() }],
                background: &case.background,
                camera: case.camera,
            };
            Ok(render(&stage, &settings, &self.task)?)
        };
        let small = Settings { inner: 1, edge: 1, ..Settings::new(Effort::CHECK_SIDE, Effort::CHECK_SIDE) };
        let (coarse, fine) = (film(effort, small)?, film(effort.finer(), small)?);
        let own = errors(&coarse, &fine, |i| fine.alpha[i] > 0.999).relative_rms;
        Ok((Truth::new(film(effort, case.settings)?, None, case.scene, 0.0), own))
    }

    /// A technique's pictures, or why there are none.
    pub(crate) fn answers(
        &self,
        case: &Subject<'_>,
        method: &Method,
        renderers: &[Renderer],
        plan: &Plan,
        truth: &Truth,
        out: &mut Vec<Answer>,
    ) -> Result<(), Error> {
        match self.prepare_by(case, method, plan) {
            Ok(prepared) => self.answer(case, method, &prepared, renderers, truth, out),
            Err(e) if e.kind() == Kind::Usage => {
                out.extend(renderers.iter().map(|r| Answer::Refused {
                    label: method.label(),
                    backend: r.name(),
                    why: e.to_string(),
                }));
                Ok(())
            }
            Err(e) => Err(e),
        }
    }

    fn answer(
        &self,
        case: &Subject<'_>,
        method: &Method,
        prepared: &[Prepared],
        renderers: &[Renderer],
        truth: &Truth,
        out: &mut Vec<Answer>,
    ) -> Result<(), Error> {
        let mut on_cpu: Option<Display> = None;
        for renderer in renderers {
            let (film, backend, shade_seconds) = self.film_of(case, prepared, renderer)?;
            let picture = truth.develop.film(&film);
            let flip_to_cpu = on_cpu.as_ref().map(|cpu| flip_displays(cpu, &picture, DEFAULT_PPD).mean);
            if renderers.len() > 1 && backend == "cpu" {
                on_cpu = Some(picture.clone());
            }
            let (mut e, flip, difference) = differences(&film, &picture, &truth.film, &truth.display);
            // The noise of the reference is no error of the technique: both are independent, and squares add.
            let noise = truth.certificate.as_ref().map_or(0.0, |c| c.error);
            e.relative_rms = (e.relative_rms.powi(2) - noise.powi(2)).max(0.0).sqrt();
            out.push(Answer::Rendered(Box::new(Rendering {
                label: with_local(method, prepared),
                backend,
                errors: Some((e, flip)),
                difference: Some(difference),
                picture,
                flip_to_cpu,
                // That of a draft states an infinite error.
                certificate: worst(prepared).filter(|c| c.error.is_finite()),
                bake_seconds: prepared.iter().map(|p| p.seconds).sum(),
                shade_seconds,
                bytes: prepared.iter().map(|p| p.bytes).sum(),
            })));
        }
        Ok(())
    }

    /// Bakes `method` for the materials that it accepts and the reference for all other ones; fails where it
    /// accepts none.
    fn prepare_by(&self, case: &Subject<'_>, method: &Method, plan: &Plan) -> Result<Vec<Prepared>, Error> {
        let one = |m: &Material, method: &Method| {
            let tolerance = match method {
                Method::Reference => Some(plan.reference_tolerance),
                _ => case.scene.tolerance,
            };
            let mut m = m.with(method.clone());
            m.params = given_to(method, &m.params);
            if let Method::Technique(t) = method
                && !t.planes().iter().any(|p| m.planes.has(p.name))
            {
                m.planes = Planes::default();
            }
            let under = Under {
                lights: &case.lights,
                camera: &case.camera,
                tolerance,
                scene: case.scene,
                sites: &Sited::ALL,
            };
            let mut prepared = self.draft(&m, method, under, &self.task)?;
            if plan.certificates {
                prepared.certify(under, &self.task)?;
            }
            self.tell_left_out(&prepared);
            Ok::<_, Error>(prepared)
        };
        let materials = &case.scene.materials;
        let mut out: Vec<Prepared> = Vec::new();
        let mut refused = None;
        for (i, m) in materials.iter().enumerate() {
            let alike = |l: &Material| {
                l.brdf.spec() == m.brdf.spec() && l.maps.is_empty() == m.maps.is_empty() && l.local == m.local
            };
            if let Some(k) = materials[..i].iter().position(alike) {
                let shared = out[k].shared(m);
                out.push(shared);
                continue;
            }
            out.push(match one(m, method) {
                Err(e) if e.kind() == Kind::Usage => {
                    refused = Some(e);
                    one(m, &Method::Reference)?
                }
                other => other?,
            });
        }
        match refused {
            Some(e) if out.iter().all(|p| p.certificate.is_none()) => Err(e),
            _ if case.scene.probes.is_none() => Ok(out),
            _ => {
                let mut scene = case.scene.clone();
                if matches!(method, Method::Reference) {
                    scene.tolerance = Some(plan.reference_tolerance);
                }
                self.in_field(&scene, out)
            }
        }
    }

    /// The picture, where it was made, and its seconds.
    fn film_of(
        &self,
        case: &Subject<'_>,
        prepared: &[Prepared],
        renderer: &Renderer,
    ) -> Result<(Film, &'static str, f64), Error> {
        let surfaces: Vec<_> = prepared.iter().map(|p| p.surface.clone()).collect();
        let stage = Stage {
            mesh: &case.scene.mesh,
            bvh: &case.bvh,
            surfaces: &surfaces,
            background: &case.background,
            camera: case.camera,
        };
        let start = Instant::now();
        let (film, backend) = renderer.film(&stage, prepared, &case.settings, self)?;
        Ok((film, backend, start.elapsed().as_secs_f64()))
    }
}

/// The reference's picture.
pub(crate) struct Truth {
    pub film: Film,
    display: Display,
    develop: Develop,
    /// For the path tracer: its noise.
    certificate: Option<Certificate>,
}

impl Truth {
    fn new(film: Film, certificate: Option<Certificate>, scene: &Scene, ev: f32) -> Self {
        let develop = Develop { ev: ev + auto_exposure(&film), mapper: scene.tone_mapper };
        Self { display: develop.film(&film), film, develop, certificate }
    }

    /// Tone-mapped.
    pub fn picture(&self) -> &Display {
        &self.display
    }

    fn rendering(&self, shade_seconds: f64) -> Rendering {
        Rendering {
            label: if self.certificate.is_some() { Method::Path } else { Method::Reference }.label(),
            backend: Renderer::Cpu.name(),
            picture: self.display.clone(),
            errors: None,
            difference: None,
            flip_to_cpu: None,
            certificate: self.certificate.clone(),
            bake_seconds: 0.0,
            shade_seconds,
            bytes: 0,
        }
    }
}

/// The method, and the technique for directional and point lights where one of the materials has it.
fn with_local(method: &Method, prepared: &[Prepared]) -> String {
    let local = prepared.iter().filter(|p| p.certificate.is_some()).find_map(|p| p.material.local.as_ref());
    local.map_or_else(|| method.label(), |l| format!("{}{BESIDE}{}", method.label(), l.label()))
}

/// The certificate of the largest error.
pub(crate) fn worst(prepared: &[Prepared]) -> Option<Certificate> {
    let all = prepared.iter().filter_map(|p| p.certificate.clone());
    all.max_by(|a, b| a.error.total_cmp(&b.error))
}

/// Relative RMS error of radiance and mean FLIP, over the pixels that the mesh covers, and a picture of FLIP.
pub(crate) fn differences(
    film: &Film,
    picture: &Display,
    reference: &Film,
    truth: &Display,
) -> (Errors, f64, Display) {
    let covered = |i: usize| reference.alpha[i] > 0.999;
    let e = errors(film, reference, covered);
    let map = flip_displays(truth, picture, DEFAULT_PPD).map;
    let (sum, n) = (0..map.len())
        .filter(|&i| covered(i))
        .fold((0.0, 0usize), |(s, n), i| (s + f64::from(map[i]), n + 1));
    (e, sum / n.max(1) as f64, difference_picture(&map, truth.width, truth.height))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The stated error of a limited effort is the difference of its whole picture from an unlimited one.
    #[test]
    fn the_reference_knows_its_own_error() {
        let mut session = Session::new();
        let mut scene =
            Scene::of("sphere:segments=24", Some("ggx:alpha=0.05"), "studio", &mut session).expect("a scene");
        (scene.settings.width, scene.settings.height) = (24, 24);
        let case = session.subject(&scene, scene.camera_or_framed().expect("framed")).expect("light");
        let by = |tolerance, evaluations| {
            session.true_picture_by(&case, Effort { tolerance, evaluations }).expect("a picture")
        };
        let (truth, nothing) = by(1e-4, 4_000_000);
        for evaluations in [4000, 10_000] {
            let (picture, own) = by(1e-2, evaluations);
            let e = errors(&picture.film, &truth.film, |i| truth.film.alpha[i] > 0.999).relative_rms;
            assert!(nothing < 1e-5 && (0.3..3.0).contains(&(own / e)), "{evaluations}: {own} {e} {nothing}");
        }
    }
}

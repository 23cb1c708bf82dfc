//! Pages as plain data, and their files.

use crate::compare::{differences, worst};
use crate::gpu_scene::{scene_by, technique, unlit};
use crate::material::Under;
use crate::page::encoded;
use crate::picture::{auto_exposure, background};
use crate::scene::Sited;
use crate::web::{Request, Truth, Written};
use crate::{Error, Kind, Material, Method, Outcome, Prepared, Renderer, Scene, Session};
use std::f64::consts::TAU;
use std::path::Path;
use steradian_base::ParamValues;
use steradian_formats::{write_atomic, write_dir_atomic};
use steradian_render::scenefile::SceneBackground;
use steradian_render::{Background, Develop, Film, Settings, Stage};
use steradian_scene::{Bvh, Camera};
use steradian_techniques::{AnyTechnique, GpuTechnique};
use steradian_web::{File, Light, Numbers, Page, Reference, Technique, Variant, WebError};

/// Width, texels, of the backdrop's image in a page, which is most of the page's size.
const BACKDROP: f64 = 512.0;

impl From<WebError> for Error {
    fn from(e: WebError) -> Self {
        match e {
            WebError::Shader { .. } => Self::failed(e.to_string()),
            _ => Self::usage(e.to_string()),
        }
    }
}

/// A scene under one light.
struct Lit<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh,
    camera: Camera,
    background: Background,
}

impl Session {
    /// Bakes the contents of a page and writes it to a folder. Where the scene has a tolerance, the
    /// certificates are compared with it.
    pub(super) fn write_page(&mut self, request: &Request, folder: &Path) -> Result<Outcome<Written>, Error> {
        let page = self.web_page(request)?;
        let files = steradian_web::files(&page)?;
        self.check()?;
        write_dir_atomic(folder, |at| {
            let one = |f: &File| write_atomic(&at.join(&f.name), |w| w.write_all(&f.bytes));
            files.iter().try_for_each(one)
        })?;
        let mut variants = Vec::new();
        for light in &page.lights {
            for (t, v) in page.techniques.iter().zip(&light.variants) {
                let error = |v: &Variant| v.numbers.map(|n| n.relative_rms);
                variants.extend(v.as_ref().map(|v| (t.slug.clone(), light.name.clone(), error(v))));
            }
        }
        let all = page.lights.iter().flat_map(|l| &l.variants).flatten();
        let error = all.filter_map(|v| v.certificate.as_ref()).map(|c| c.0).fold(0.0, f64::max);
        let files = files.into_iter().map(|f| (f.name, f.bytes.len())).collect();
        Ok(Outcome::new(Written { files, variants }, request.scene.tolerance, error))
    }

    /// A page as plain data.
    pub fn web_page(&mut self, request: &Request) -> Result<Page, Error> {
        refuse(&request.methods)?;
        crate::probes::refuse(&request.scene)?;
        let mut scene = request.scene.clone();
        let camera = scene.camera_or_framed()?;
        scene.camera = Some(camera);
        if let SceneBackground::Environment(blur) = &mut scene.background {
            *blur = blur.max(TAU / BACKDROP);
        }
        for m in &request.methods {
            if let Method::Technique(t) = m
                && let Some(why) = refusal(*t, &scene)
            {
                return Err(Error::usage(format!("{}: {why}", t.card().slug)));
            }
        }
        for m in scene.materials.iter().chain(&scene.ground) {
            for method in request.methods.iter().chain(&m.method) {
                if let Method::Technique(t) = method {
                    refuse_views(*t, m)?;
                }
            }
        }
        let sited = match &request.methods[..] {
            [] => scene.sited(),
            methods => scene.sited_by(methods),
        };
        let mut staged = scene.staged(&camera, &sited, &self.task)?.into_owned();
        let bvh = Bvh::build(&staged.mesh);
        let (mut techniques, mut lights) = (Vec::new(), Vec::new());
        for (name, light) in &request.lights {
            staged.lights = light.clone();
            let lit = Lit { scene: &staged, bvh: &bvh, camera, background: background(&staged, &camera) };
            let (light, of) = self.web_light(request, name, &lit)?;
            techniques = if techniques.is_empty() { of } else { techniques };
            lights.push(light);
        }
        if let Some(k) = (0..techniques.len()).find(|&k| lights.iter().all(|l| l.variants[k].is_none())) {
            let slug = &techniques[k].slug;
            return Err(Error::usage(format!(
                "{slug}: takes none of the scene's materials under these lights"
            )));
        }
        let (Camera::Pinhole { at, .. } | Camera::Orthographic { at, .. }) = camera;
        Ok(Page {
            title: request.title.clone(),
            subtitle: subtitle(&scene),
            tone_mapper: scene.tone_mapper.name().into(),
            size: [scene.settings.width, scene.settings.height],
            at: at.to_array(),
            ground: scene.ground.is_some(),
            techniques,
            lights,
            version: env!("CARGO_PKG_VERSION").into(),
        })
    }

    fn web_light(
        &mut self,
        request: &Request,
        name: &str,
        lit: &Lit<'_>,
    ) -> Result<(Light, Vec<Technique>), Error> {
        let (mut shaded, mut techniques) = (Vec::new(), Vec::new());
        if request.methods.is_empty() {
            let prepared = self.prepare_all(lit.scene, lit.bvh, lit.camera)?;
            techniques.push(as_the_scene_says(&prepared));
            shaded.push(Some(prepared));
        }
        for method in &request.methods {
            techniques.push(described(method));
            shaded.push(self.web_materials(method, lit)?);
        }
        let mut films = Vec::new();
        for prepared in &shaded {
            films.push(prepared.as_ref().map(|p| self.web_film(p, lit)).transpose()?);
        }
        let truth = self.web_truth(request.truth, lit)?;
        let first = truth.as_ref().map(|t| &t.0).or_else(|| films.iter().flatten().next());
        let ev = lit.scene.exposure.unwrap_or_else(|| first.map_or(0.0, auto_exposure));
        let develop = Develop { ev, mapper: lit.scene.tone_mapper };
        let shown = truth.as_ref().map(|(film, noise)| (film, develop.film(film), *noise));
        let mut variants = Vec::new();
        for (prepared, film) in shaded.iter().zip(&films) {
            let (Some(prepared), Some(film)) = (prepared, film) else {
                variants.push(None);
                continue;
            };
            let picture = develop.film(film);
            let numbers = shown.as_ref().map(|(truth, display, noise)| {
                let (e, flip, _) = differences(film, &picture, truth, display);
                // The noise of the reference is no error of the technique.
                let relative_rms = (e.relative_rms.powi(2) - noise.powi(2)).max(0.0).sqrt();
                Numbers { relative_rms, stops: e.stops, flip }
            });
            variants.push(Some(Variant {
                scene: scene_by(&lit.stage(&[]), prepared, lean),
                picture: encoded(&picture)?,
                certificate: worst(prepared).map(|c| (c.error, c.known.word().into())),
                numbers,
            }));
        }
        let reference = shown.map(|(film, display, _)| {
            let texel = |i: usize| {
                let [r, g, b] = film.pixel(i);
                [r, g, b, film.alpha[i]]
            };
            let texels = (0..film.len()).map(texel).collect();
            encoded(&display).map(|picture| Reference { texels, picture })
        });
        Ok((Light { name: name.into(), ev, variants, reference: reference.transpose()? }, techniques))
    }

    /// The materials as `method` shades them, and those that it refuses as the scene says; `None` where it
    /// takes none.
    fn web_materials(&self, method: &Method, lit: &Lit<'_>) -> Result<Option<Vec<Prepared>>, Error> {
        let scene = lit.scene;
        let under = Under {
            lights: &scene.lights,
            camera: &lit.camera,
            tolerance: scene.tolerance,
            scene,
            sites: &Sited::ALL,
        };
        let mut out: Vec<Option<Prepared>> = Vec::new();
        for m in &scene.materials {
            let mut m = m.with(method.clone());
            if let Method::Technique(t) = method {
                m.params = own_params(*t, &m);
            }
            match self.prepare(&m, method, under, &self.task) {
                Ok(p) => out.push(Some(p)),
                Err(e) if e.kind() == Kind::Usage => out.push(None),
                Err(e) => return Err(e),
            }
        }
        if out.iter().all(Option::is_none) {
            return Ok(None);
        }
        if out.iter().any(Option::is_none) {
            let others = self.prepare_all(scene, lit.bvh, lit.camera)?;
            out.iter_mut().zip(others).for_each(|(p, other)| {
                p.get_or_insert(other);
            });
        }
        Ok(Some(out.into_iter().flatten().collect()))
    }

    /// The CPU's picture, for checking browsers' pictures.
    fn web_film(&self, prepared: &[Prepared], lit: &Lit<'_>) -> Result<Film, Error> {
        let without = prepared.iter().find(|p| p.bake.is_none());
        if let Some(p) = without {
            let why = format!("no technique shades {}: name one with `technique`", p.material.brdf.spec());
            return Err(Error::usage(why));
        }
        refuse(&prepared.iter().map(|p| p.method.clone()).collect::<Vec<_>>())?;
        let shadowed = || prepared.iter().any(|p| p.shadowed);
        let rays = || shadowed().then(|| "rays that shadow suns and points are for the CPU".into());
        if let Some(why) = unlit(prepared).or_else(rays) {
            return Err(Error::usage(format!("{why}: use `suns` fold for a page")));
        }
        let surfaces: Vec<_> = prepared.iter().map(|p| p.surface.clone()).collect();
        let film = Renderer::Cpu.film(&lit.stage(&surfaces), prepared, &lit.scene.settings, self)?.0;
        finite(film)
    }

    /// The reference's picture, and its noise.
    fn web_truth(&self, truth: Truth, lit: &Lit<'_>) -> Result<Option<(Film, f64)>, Error> {
        let scene = lit.scene;
        let settings = Settings { inner: 1, share: true, ..scene.settings };
        match truth {
            Truth::None => Ok(None),
            Truth::Paths => {
                let traced = self.trace(scene, lit.camera, &lit.background, settings, self.paths)?;
                let noise = traced.certificate().error;
                Ok(Some((finite(traced.film)?, noise)))
            }
            Truth::Integral(tolerance) => {
                let tolerance = Some(tolerance);
                let under = Under {
                    lights: &scene.lights,
                    camera: &lit.camera,
                    tolerance,
                    scene,
                    sites: &Sited::ALL,
                };
                let exact = |m: &Material| self.prepare(m, &Method::Reference, under, &self.task);
                let prepared = scene.materials.iter().map(exact).collect::<Result<Vec<_>, _>>()?;
                let surfaces: Vec<_> = prepared.iter().map(|p| p.surface.clone()).collect();
                let settings = Settings { interpolate: true, ..settings };
                let film = Renderer::Cpu.film(&lit.stage(&surfaces), &prepared, &settings, self)?.0;
                Ok(Some((finite(film)?, 0.0)))
            }
        }
    }
}

impl Lit<'_> {
    fn stage<'s>(&'s self, surfaces: &'s [steradian_render::Surface]) -> Stage<'s> {
        Stage {
            mesh: &self.scene.mesh,
            bvh: self.bvh,
            surfaces,
            background: &self.background,
            camera: self.camera,
        }
    }
}

/// A material's technique; levels of filtered light that are never looked up are black.
fn lean(p: &Prepared) -> Option<GpuTechnique> {
    let mut out = technique(p)?;
    if let Some(tables) = p.light_tables() {
        tables.blacken_unused(&mut out);
    }
    Some(out)
}

/// Why a technique takes none of the scene's materials, where it takes none.
fn refusal(t: &dyn AnyTechnique, scene: &Scene) -> Option<String> {
    let mut why = None;
    for m in scene.materials.iter().chain(&scene.ground) {
        why = Some(t.takes(&*m.brdf, &own_params(t, m)).err()?.to_string());
    }
    why
}

/// The parameters of a material that are a technique's.
fn own_params(t: &dyn AnyTechnique, m: &Material) -> ParamValues {
    let mut params = m.params.clone();
    params.0.retain(|name, _| t.params().iter().any(|p| p.name == name));
    params
}

/// Refuses a technique whose parameters make it prepare every view anew.
fn refuse_views(t: &dyn AnyTechnique, m: &Material) -> Result<(), Error> {
    if t.needs_view(&own_params(t, m)) {
        let why = "prepares every view anew, which a page cannot";
        return Err(Error::usage(format!("{}: {why}", t.card().slug)));
    }
    Ok(())
}

/// Refuses methods that browsers cannot shade.
fn refuse(methods: &[Method]) -> Result<(), Error> {
    for m in methods {
        match m {
            Method::Reference | Method::Path => {
                let why = "shades on the CPU alone: name a technique, and bake its picture in with `reference` or `path`";
                return Err(Error::usage(format!("{}: {why}", m.slug())));
            }
            Method::File(f) if f.needs_view() => {
                let why = "prepares every view anew, which a page cannot";
                return Err(Error::usage(format!("{}: {why}", f.technique.card().slug)));
            }
            _ => {}
        }
    }
    Ok(())
}

fn finite(film: Film) -> Result<Film, Error> {
    if film.rgb.iter().flatten().all(|x| x.is_finite()) {
        return Ok(film);
    }
    Err(Error::failed("a picture came out not finite: scale the light down"))
}

fn described(method: &Method) -> Technique {
    let card = match method {
        Method::Technique(t) => Some(t.card()),
        Method::File(f) => Some(f.technique.card()),
        _ => None,
    };
    Technique {
        slug: method.slug().into(),
        title: card.map_or(method.slug(), |c| c.title).into(),
        source: card.map_or("", |c| c.citation).into(),
    }
}

fn as_the_scene_says(prepared: &[Prepared]) -> Technique {
    let mut all: Vec<Technique> = Vec::new();
    for t in prepared.iter().map(|p| described(&p.method)) {
        if !all.contains(&t) {
            all.push(t);
        }
    }
    let join = |f: fn(&Technique) -> &str, by: &str| all.iter().map(f).collect::<Vec<_>>().join(by);
    Technique {
        slug: join(|t| &t.slug, "+"),
        title: join(|t| &t.title, ", "),
        source: join(|t| &t.source, "; "),
    }
}

/// The reflectances in a line.
fn subtitle(scene: &Scene) -> String {
    let mut specs: Vec<String> = Vec::new();
    for m in scene.materials.iter().chain(&scene.ground) {
        let spec = m.brdf.spec();
        if !specs.contains(&spec) {
            specs.push(spec);
        }
    }
    match specs.len() {
        0..=3 => specs.join(" · "),
        n => format!("{} materials", n),
    }
}

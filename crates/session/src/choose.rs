//! The choice of a technique: the smallest error within a few seconds, among those that honour the material.

use crate::material::Under;
use crate::{Backend, Error, Kind, Local, Material, Method, Notice, Prepared, Scene, Session, Shadows};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::{Duration, Instant};
use steradian_base::{Evidence, Task};
use steradian_brdf::Brdf;
use steradian_reference::{Lookup, Reference};
use steradian_render::{
    Background, Film, ReferenceShader, Settings, Stage, Surface, SurfaceMaps, errors, render,
};
use steradian_scene::{Bvh, Camera};
use steradian_techniques::{AnyTechnique, Card};

/// Time of a single bake and of all among which a technique is chosen: a bake that takes longer gives the others their
/// turn, and where none is good enough those that were stopped get more.
const BUDGETS: [[Duration; 2]; 2] =
    [[Duration::from_secs(2), Duration::from_secs(4)], [Duration::from_secs(10), Duration::from_secs(15)]];
/// Seconds for the reference to look at a few hundred points of a picture.
const LOOK: Duration = Duration::from_secs(3);
/// Pixels a side of the sample of a picture: some hundred points, of which the object covers a part.
const SAMPLE: usize = 24;
/// Relative error of the reference at these points: far below the errors that are compared.
const SAMPLE_TOLERANCE: f64 = 1e-2;
/// Evaluations of the reflectance at one of them.
const SAMPLE_EVALUATIONS: u64 = 100_000;
/// An error that no picture shows: the first technique to reach it is taken.
const INVISIBLE: f64 = 5e-3;
/// Techniques of a larger error need a specimen like the material, where no tolerance is given.
const USEFUL: f64 = 0.25;
/// An error from which on the reference is worth a hint.
const VISIBLE: f64 = 0.05;

/// Which technique a material got, and how far it is off.
#[derive(Debug, Clone, PartialEq)]
pub struct Chosen {
    /// The technique.
    pub technique: &'static str,
    /// The reflectance.
    pub brdf: String,
    /// Relative RMS error over normals and views, or over points of the mesh, as certified.
    pub error: f64,
    /// Was it baked at sites of the mesh?
    pub sites: bool,
    /// How that is known.
    pub known: Evidence,
    /// Are there lights beside the technique's data, of which its certificate says nothing?
    pub beside: bool,
    /// Relative RMS error over points of this picture, where it was measured.
    pub picture: Option<f64>,
    /// Was it the session that chose?
    pub automatic: bool,
}

impl std::error::Error for Chosen {}

impl std::fmt::Display for Chosen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { technique, brdf, error, sites, known, beside, picture, automatic } = self;
        write!(f, "technique {technique} for {brdf}: relative RMS error ")?;
        if let Some(p) = picture {
            write!(f, "{:.2} % in this picture (at a sample of its points), ", 100.0 * p)?;
        }
        let over =
            if *sites { "over points of the mesh, against paths" } else { "over all normals and views" };
        let without = if *beside { ", without the lights that are shaded beside it" } else { "" };
        write!(f, "{:.2} % {over}{without} ({})", 100.0 * error, known.word())?;
        if *automatic && picture.unwrap_or(*error) > VISIBLE {
            write!(f, "; --technique reference is exact, and slow")?;
        }
        Ok(())
    }
}

/// A sample of a picture's points, and the reference's radiance there.
pub(crate) struct Sample<'a> {
    scene: &'a Scene,
    bvh: &'a Bvh,
    camera: Camera,
    truth: Option<Film>,
}

impl<'a> Sample<'a> {
    /// The points of `scene` with the reference's radiance of `material`; none where that takes too long.
    fn new(
        session: &Session,
        scene: &'a Scene,
        bvh: &'a Bvh,
        camera: Camera,
        material: &Material,
    ) -> Result<Self, Error> {
        let mut sample = Self { scene, bvh, camera, truth: None };
        // The sample is shaded without shadow rays, so that under `--shadows lobe` certificates decide.
        let shadowed = session.shadows == Shadows::Lobe;
        if shadowed || matches!(material.method, Some(Method::File(_) | Method::Reference)) {
            return Ok(sample);
        }
        let task = session.task.clone().without_progress().with_deadline(Instant::now() + LOOK);
        let truth = Reference::new(&scene.lights, Lookup::Bilinear, &task).map_err(Error::from).and_then(
            |reference| {
                let reference = Arc::new(reference.with_budget(SAMPLE_EVALUATIONS));
                let shader =
                    Arc::new(ReferenceShader::new(reference, material.brdf.clone(), SAMPLE_TOLERANCE));
                sample.film(&Surface { shader, base_colour: None, maps: SurfaceMaps::default() }, &task)
            },
        );
        sample.truth = match truth {
            Ok(film) => Some(film),
            Err(e) if e.is_cancelled() => {
                session.check()?;
                None
            }
            Err(e) => return Err(e),
        };
        Ok(sample)
    }

    /// Radiance of a surface at the points, without its textures: the reference knows no maps.
    fn film(&self, surface: &Surface, task: &Task) -> Result<Film, Error> {
        let plain = Surface { base_colour: None, maps: SurfaceMaps::default(), ..surface.clone() };
        let s = &self.scene.settings;
        let longest = s.width.max(s.height).max(1);
        let side = |n: usize| (n * SAMPLE).div_ceil(longest).max(1);
        let settings = Settings { inner: 1, edge: 1, ..Settings::new(side(s.width), side(s.height)) };
        let background = Background::Colour([0.0; 3]);
        let stage = Stage {
            mesh: &self.scene.mesh,
            bvh: self.bvh,
            surfaces: &[plain],
            background: &background,
            camera: self.camera,
        };
        Ok(render(&stage, &settings, task)?)
    }

    /// The relative RMS error of `prepared` at the points.
    fn error(&self, prepared: &Prepared, task: &Task) -> Result<Option<f64>, Error> {
        let Some(truth) = &self.truth else { return Ok(None) };
        // The reference sees no shadows, and knows nothing of data per texel.
        let m = &prepared.material;
        if m.local.as_ref().is_some_and(|l| l.is_textured(m.maps.normal.is_some())) {
            return Ok(None);
        }
        let far = matches!(&prepared.method, Method::Technique(t) if t.self_shadowing(&m.params));
        if far || m.local.as_ref().is_some_and(Local::knows_mesh) {
            return Ok(None);
        }
        let film = self.film(&prepared.surface, &task.clone().without_progress())?;
        let e = errors(&film, truth, |i| truth.alpha[i] > 0.999);
        Ok((e.pixels > 0 && e.relative_rms.is_finite()).then_some(e.relative_rms))
    }
}

/// What came of a technique.
enum Tried {
    /// It may be taken.
    Fits(Box<Candidate>),
    /// It refuses, or is not good enough.
    Unfit,
    /// It took too long.
    Stopped,
}

/// A technique that was baked.
struct Candidate {
    prepared: Prepared,
    /// What counts against it, the smallest first: does it leave inputs out, and its error or size.
    rank: (bool, f64),
}

impl Session {
    /// Prepares every material of a scene; those that differ in their textures only share a bake.
    pub(crate) fn prepare_all(
        &self,
        scene: &Scene,
        bvh: &Bvh,
        camera: Camera,
    ) -> Result<Vec<Prepared>, Error> {
        let mut out: Vec<Prepared> = Vec::new();
        for m in &scene.materials {
            if let Some(done) = out.iter().find(|p| m.shades_like(p)) {
                let shared = done.shared(m);
                self.tell_left_out(&shared);
                out.push(shared);
                continue;
            }
            let prepared = self.prepare_or_choose(scene, bvh, camera, m, true)?;
            self.tell_chosen(&prepared);
            self.tell_left_out(&prepared);
            out.push(prepared);
        }
        Ok(out)
    }

    /// Bakes a material by its method, or by the technique that is chosen for it. Of a named method the error in this
    /// picture is `measured` only where that is asked for.
    pub(crate) fn prepare_or_choose(
        &self,
        scene: &Scene,
        bvh: &Bvh,
        camera: Camera,
        m: &Material,
        measured: bool,
    ) -> Result<Prepared, Error> {
        let under = Under { lights: &scene.lights, camera: &camera, tolerance: scene.tolerance, scene };
        if let (Some(method), false) = (&m.method, measured) {
            return self.prepare(m, method, under, &self.task);
        }
        let sample = Sample::new(self, scene, bvh, camera, m)?;
        let Some(method) = &m.method else { return self.choose(m, under, &sample) };
        let mut p = self.prepare(m, method, under, &self.task)?;
        p.picture_error = sample.error(&p, &self.task)?;
        Ok(p)
    }

    fn tell_chosen(&self, p: &Prepared) {
        let (Some(c), Method::Technique(t)) = (&p.certificate, &p.method) else { return };
        self.tell(Notice::Technique(Chosen {
            technique: t.card().slug,
            brdf: p.material.brdf.spec(),
            error: c.error,
            sites: t.self_shadowing(&p.material.params),
            known: c.known,
            beside: p.lit,
            picture: p.picture_error,
            automatic: p.material.method.is_none(),
        }));
    }

    /// Without a tolerance the technique of the smallest error in this picture, with one the smallest data that meet it;
    /// else the reference. Techniques that leave out what the material gives come last.
    fn choose(&self, m: &Material, under: Under<'_>, sample: &Sample<'_>) -> Result<Prepared, Error> {
        let mut found: Vec<Candidate> = Vec::new();
        let mut left = candidates(&*m.brdf);
        // With a tolerance all that is found meets it.
        let below = |found: &[Candidate], error: f64| {
            found.iter().any(|c| !c.rank.0 && (under.tolerance.is_some() || c.rank.1 <= error))
        };
        for [limit, all] in BUDGETS {
            let (end, mut stopped) = (Instant::now() + all, Vec::new());
            for t in left {
                let now = Instant::now();
                let invisible = under.tolerance.is_none() && below(&found, INVISIBLE);
                if invisible || (now >= end && below(&found, USEFUL)) {
                    break;
                }
                match self.candidate(t, m, under, sample, now + limit)? {
                    Tried::Fits(c) => found.push(*c),
                    Tried::Unfit => {}
                    Tried::Stopped => stopped.push(t),
                }
            }
            left = stopped;
            if below(&found, USEFUL) {
                break;
            }
        }
        let best =
            found.into_iter().min_by(|a, b| a.rank.0.cmp(&b.rank.0).then(a.rank.1.total_cmp(&b.rank.1)));
        match best {
            Some(c) => Ok(c.prepared),
            None => self.fall_back(m, under),
        }
    }

    /// `t` baked and looked at.
    fn candidate(
        &self,
        t: &'static dyn AnyTechnique,
        m: &Material,
        under: Under<'_>,
        sample: &Sample<'_>,
        deadline: Instant,
    ) -> Result<Tried, Error> {
        let task = self.task.clone().with_deadline(deadline);
        let done = self.prepare(m, &Method::Technique(t), under, &task).and_then(|mut p| {
            p.picture_error = sample.error(&p, &task)?;
            Ok(p)
        });
        let mut prepared = match done {
            Ok(p) => p,
            Err(e) if e.is_cancelled() => {
                self.check()?;
                return Ok(Tried::Stopped);
            }
            // These lights or parameters are not for it.
            Err(e) if e.kind() == Kind::Usage => return Ok(Tried::Unfit),
            Err(e) => return Err(e),
        };
        prepared.material.method = None;
        let error = prepared.picture_error.unwrap_or(prepared.error());
        let fits = match under.tolerance {
            Some(t) => prepared.error() <= t,
            None => error <= USEFUL || stands_for(t.card(), &*m.brdf),
        };
        let cost = if under.tolerance.is_some() { prepared.bytes as f64 } else { error };
        let rank = (!prepared.left_out().is_empty(), cost);
        Ok(if fits { Tried::Fits(Box::new(Candidate { prepared, rank })) } else { Tried::Unfit })
    }

    fn fall_back(&self, m: &Material, under: Under<'_>) -> Result<Prepared, Error> {
        let spec = m.brdf.spec();
        let why = match under.tolerance {
            Some(t) => format!("no technique takes {spec} to an error of {t}"),
            None => format!("no technique is made for {spec}"),
        };
        if self.backend == Backend::Gpu {
            return Err(Error::usage(format!(
                "{why}: name a technique, or use --backend cpu for the reference"
            )));
        }
        self.tell(Notice::Reference { why });
        self.prepare(m, &Method::Reference, under, &self.task)
    }
}

/// The techniques that take a reflectance, in the order in which they are tried: those made for its model (specimens of
/// two models at most) as they are listed, then those for any, the last of the list first, which err least.
fn candidates(brdf: &dyn Brdf) -> Vec<&'static dyn AnyTechnique> {
    let takes = |t: &&'static dyn AnyTechnique| !t.card().needs.sites && (t.card().materials)(brdf).is_ok();
    let all = steradian_techniques::registry().iter().copied().filter(takes);
    let made_for = |t: &&'static dyn AnyTechnique| {
        let model = |s: &&'static str| s.split(':').next().unwrap_or(s);
        let models: BTreeSet<&str> = t.card().specimens.iter().map(model).collect();
        models.len() <= 2 && stands_for(t.card(), brdf)
    };
    let (mut first, any): (Vec<_>, Vec<_>) = all.partition(made_for);
    first.extend(any.into_iter().rev());
    first
}

/// Is one of the technique's specimens of the same model, and as isotropic? Otherwise it takes the material as something
/// else, a mirror for example.
fn stands_for(card: &Card, brdf: &dyn Brdf) -> bool {
    let like = |b: &dyn Brdf| b.info().name == brdf.info().name && b.is_isotropic() == brdf.is_isotropic();
    card.specimens.iter().any(|s| steradian_brdf::parse(s).is_ok_and(|b| like(&*b)))
}

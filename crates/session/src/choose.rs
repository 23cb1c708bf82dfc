//! The choice of a technique: the smallest error within a few processor seconds, among those that honour the
//! material.

use crate::choice::{Choice, Trial, Verdict};
use crate::effort::{processor_seconds, within};
use crate::material::Under;
use crate::sample::Sample;
use crate::{Backend, Error, Kind, Material, Method, Notice, PictureError, Prepared, Scene, Session};
use glam::DVec3;
use std::sync::Arc;
use steradian_base::{Certificate, Evidence, Task};
use steradian_brdf::{Brdf, Lobe};
use steradian_scene::{Bvh, Camera};
use steradian_techniques::{AnyTechnique, Card};

/// Limits of the processor seconds of all bakes by which a technique is chosen: where one was found whose
/// error is hardly visible (three seconds on two cores with the rest of a picture), where a useful one was or
/// nothing was tried yet, and where none was: what the reference would take, within the last two.
const BUDGETS_SECONDS: [f64; 4] = [3.0, 15.0, 30.0, 60.0];
/// Where the reference would take more processor seconds than the last of [`BUDGETS_SECONDS`], the best
/// technique is taken, if it errs less than this.
const MAX_STOPGAP_ERROR: f64 = 0.5;
/// What is expected to take more than so many times the seconds that are left is not tried. Expected are the
/// technique's usual seconds times how much dearer than usual those before it were, which was too much for
/// shrm_slices: of sgd:chrome-steel 12.3 seconds where 11.7 were left and it took 8.2, of abc:black-obsidian
/// 7.1 where it took 5.5. With this factor it tries five of six measured files (`rgl:`), in 4 to 13 seconds.
const MAX_EXPECTED_OF_LEFT: f64 = 1.2;
/// A technique that takes at most so many processor seconds counts as cheap. It is tried before dearer ones
/// where these may have to be stopped, so that there is something to take.
const CHEAP_SECONDS: f64 = 1.0;
/// An error too small to be seen in a picture: the first technique to reach it is chosen.
const INVISIBLE_ERROR: f64 = 0.02;
/// Where no tolerance is given, a technique with a larger error is chosen only if one of its specimens is
/// like the material.
const MAX_USEFUL_ERROR: f64 = 0.25;
/// With a larger error, a notice suggests the reference, and more time is spent on better techniques.
const VISIBLE_ERROR: f64 = 0.1;
/// Angle from the normal, degrees, from which on views count as grazing.
const GRAZING_DEGREES: f64 = 80.0;
/// Error of such views from which on silhouettes show it as rings and specks: what [`MAX_USEFUL_ERROR`]
/// allows of all views.
const GRAZING_ERROR: f64 = 0.25;
/// Widths of lobes count as alike if they differ at most by this factor: GGX of alpha 0.004 is like a mirror,
/// of 0.3 it is not.
const MAX_WIDTH_RATIO: f64 = 10.0;

/// The technique that was chosen for a material, and its error.
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
    /// How the error is known: measured, computed or estimated.
    pub known: Evidence,
    /// The technique for directional and point lights, and its error.
    pub local: Option<(&'static str, f64)>,
    /// Are there lights shaded in addition to the technique's data, which its certificate does not cover?
    pub beside: bool,
    /// Errors at points of this picture, where they were measured.
    pub picture: Option<PictureError>,
    /// Why the error in this picture was not measured, where it would have been.
    pub unmeasured: Option<&'static str>,
    /// The largest error that the certificate states for grazing views, from 80° off the normal on, which
    /// silhouettes show as rings and specks; `None` unless it is far larger than that of all views.
    pub grazing: Option<f64>,
    /// Was it the session that chose?
    pub automatic: bool,
}

impl std::error::Error for Chosen {}

impl std::fmt::Display for Chosen {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self {
            technique,
            brdf,
            error,
            sites,
            known,
            local,
            beside,
            picture,
            unmeasured,
            grazing,
            automatic,
        } = self;
        write!(f, "technique {technique} for {brdf}: ")?;
        match (picture, unmeasured) {
            (Some(p), _) => write!(f, "in this picture {p}, at a sample of its points; ")?,
            (None, Some(why)) => write!(f, "error in this picture not measured ({why}); ")?,
            (None, None) => {}
        }
        write!(f, "relative RMS error ")?;
        let over =
            if *sites { "over points of the mesh, against paths" } else { "over all normals and views" };
        let without = if *beside { ", without the lights that are shaded beside it" } else { "" };
        write!(f, "{:.2} % {over}{without} ({})", 100.0 * error, known.word())?;
        if let Some((slug, error)) = local {
            write!(f, "; {slug}, of directional and point lights: {:.2} %", 100.0 * error)?;
        }
        if let Some(g) = grazing {
            write!(f, "; silhouettes may show rings and specks: {:.0} % at grazing views", 100.0 * g)?;
        }
        if *automatic && picture.map_or(*error, |p| p.apparent()) > VISIBLE_ERROR {
            write!(f, "; `technique` reference is exact, and slow")?;
        }
        Ok(())
    }
}

/// Result of trying a technique.
enum Tried {
    /// It may be chosen.
    Fits(Box<Candidate>),
    /// Its error is too large.
    Misses(Box<Candidate>),
    /// It refuses, or took too long, or misses the tolerance.
    Unfit(Verdict),
}

/// A technique that was baked.
struct Candidate {
    prepared: Prepared,
    /// Rank, the smallest first: does it ignore inputs, then its error or size.
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

    /// Bakes a material by its method, or by a technique that is chosen for it. `measured` asks for the error
    /// in this picture where the method is named; where it is chosen, that is measured anyway.
    pub(crate) fn prepare_or_choose(
        &self,
        scene: &Scene,
        bvh: &Bvh,
        camera: Camera,
        m: &Material,
        measured: bool,
    ) -> Result<Prepared, Error> {
        let sites = &scene.sited();
        let under =
            Under { lights: &scene.lights, camera: &camera, tolerance: scene.tolerance, scene, sites };
        if let (Some(method), false) = (&m.method, measured) {
            return self.prepare(m, method, under, &self.task);
        }
        let sample = Sample::new(self, scene, bvh, camera, m)?;
        let Some(method) = &m.method else { return self.choose(m, under, &sample) };
        let mut p = self.prepare(m, method, under, &self.task)?;
        sample.judge(&mut p, &self.task)?;
        Ok(p)
    }

    fn tell_chosen(&self, p: &Prepared) {
        let (Some(c), Method::Technique(t)) = (&p.certificate, &p.method) else { return };
        let error = p.bake.as_ref().map_or(c.error, |b| b.0.certificate().error);
        let local = p.material.local.as_ref().zip(p.others.local());
        self.tell(Notice::Technique(Chosen {
            technique: t.card().slug,
            brdf: p.material.brdf.spec(),
            error,
            local: local.map(|(l, c)| (l.technique.card().slug, c.error)),
            sites: t.self_shadowing(&p.material.params),
            known: c.known,
            beside: p.lit,
            picture: p.picture_error,
            unmeasured: p.picture_unmeasured,
            grazing: grazing(c),
            automatic: p.material.method.is_none(),
        }));
        if let Some(choice) = &p.choice {
            self.say(choice);
        }
    }

    /// Chooses, without a tolerance, the technique of the smallest error in this picture; with one, the
    /// smallest data that meet it; else the reference. Techniques that ignore inputs of the material come
    /// last. Where the error in the picture decides, the error over all views is measured for the chosen
    /// technique alone.
    fn choose(&self, m: &Material, under: Under<'_>, sample: &Sample<'_>) -> Result<Prepared, Error> {
        let start = processor_seconds();
        let mut best: Option<Candidate> = None;
        let mut stopgap: Option<Candidate> = None;
        let less = |c: &Candidate, than: &Option<Candidate>| {
            let worse = |b: &Candidate| b.rank.0.cmp(&c.rank.0).then(b.rank.1.total_cmp(&c.rank.1)).is_le();
            !than.as_ref().is_some_and(worse)
        };
        let (mut trials, mut spent, mut usual) = (Vec::new(), 0.0, 0.0);
        for t in candidates(m, under.tolerance.is_some()) {
            // With a tolerance, every technique that fits meets it.
            let below = |error: f64| {
                let fits = |c: &Candidate| !c.rank.0 && (under.tolerance.is_some() || c.rank.1 <= error);
                best.as_ref().is_some_and(fits)
            };
            let limit = match &best {
                _ if below(VISIBLE_ERROR) => BUDGETS_SECONDS[0],
                _ if below(MAX_USEFUL_ERROR) || trials.is_empty() => BUDGETS_SECONDS[1],
                _ => BUDGETS_SECONDS[2].max(BUDGETS_SECONDS[3].min(sample.whole)),
            };
            let left = limit - spent;
            let mut trial = Trial::new(t.card().slug);
            trial.left_out = m.left_out_by(t.varies());
            let whole = best.as_ref().is_some_and(|c| !c.rank.0);
            let spared = match under.tolerance {
                None if below(INVISIBLE_ERROR) || is_refined(t, &trial, &trials) => Some(Verdict::Unneeded),
                _ if whole && !trial.left_out.is_empty() => Some(Verdict::LeavesOut),
                // Reflectance that takes long to evaluate makes all of them dearer than usual.
                _ if t.effort() * f64::max(1.0, spent / f64::max(usual, f64::MIN_POSITIVE))
                    > MAX_EXPECTED_OF_LEFT * left =>
                {
                    Some(Verdict::TooDear)
                }
                _ => None,
            };
            let tried = match spared {
                Some(verdict) => Tried::Unfit(verdict),
                None => {
                    let (tried, seconds) =
                        within(&self.task, left, |task| self.candidate(t, m, under, sample, task));
                    spent += seconds;
                    usual += t.effort();
                    trial.seconds = seconds;
                    tried?
                }
            };
            match tried {
                Tried::Unfit(verdict) => trial.verdict = verdict,
                Tried::Fits(c) => {
                    let certified = c.prepared.certificate.as_ref().map(|c| c.error);
                    trial.error = c.prepared.picture_error.map(|e| e.apparent()).or(certified);
                    trial.left_out = c.prepared.left_out();
                    if less(&c, &best) {
                        best = Some(*c);
                    }
                }
                Tried::Misses(c) => {
                    trial.verdict = Verdict::Missed(c.rank.1);
                    trial.error = Some(c.rank.1);
                    if less(&c, &stopgap) {
                        stopgap = Some(*c);
                    }
                }
            }
            trials.push(trial);
        }
        if sample.whole > BUDGETS_SECONDS[3] {
            best = best.or(stopgap.filter(|c| c.rank.1 < MAX_STOPGAP_ERROR));
        }
        let Some(Candidate { mut prepared, .. }) = best else {
            let choice = Choice { seconds: sample.seconds + processor_seconds() - start, trials };
            return Ok(Prepared {
                choice: Some(Arc::new(choice.clone())),
                ..self.fall_back(m, under, &choice)?
            });
        };
        let taken = prepared.method.slug();
        trials.iter_mut().filter(|t| t.technique == taken).for_each(|t| t.verdict = Verdict::Taken);
        prepared.certify(under, &self.task)?;
        let seconds = processor_seconds() - start;
        let choice = Choice { seconds: sample.seconds + seconds, trials };
        prepared.choice = Some(Arc::new(choice));
        Ok(prepared)
    }

    /// Bakes `t` and measures its error in the picture; its error over all views is measured where the
    /// picture's does not decide.
    fn candidate(
        &self,
        t: &'static dyn AnyTechnique,
        m: &Material,
        under: Under<'_>,
        sample: &Sample<'_>,
        task: &Task,
    ) -> Result<Tried, Error> {
        let done = self.draft(m, &Method::Technique(t), under, task).and_then(|mut p| {
            sample.judge(&mut p, task)?;
            if under.tolerance.is_some() || p.picture_error.is_none() {
                p.certify(under, task)?;
            }
            Ok(p)
        });
        let mut prepared = match done {
            Ok(p) => p,
            Err(e) if e.is_cancelled() => {
                self.check()?;
                return Ok(Tried::Unfit(Verdict::Stopped));
            }
            // The technique does not accept these lights or parameters.
            Err(e) if e.kind() == Kind::Usage => return Ok(Tried::Unfit(Verdict::Refused(e.to_string()))),
            Err(e) => return Err(e),
        };
        prepared.material.method = None;
        let error = prepared.picture_error.map_or(prepared.error(), |e| e.apparent());
        let fits = match under.tolerance {
            Some(t) => prepared.error() <= t,
            None => error <= MAX_USEFUL_ERROR || stands_for(t.card(), &*m.brdf),
        };
        if !fits && under.tolerance.is_some() {
            return Ok(Tried::Unfit(Verdict::Missed(error)));
        }
        let cost = if under.tolerance.is_some() { prepared.bytes as f64 } else { error };
        let rank = (!prepared.left_out().is_empty(), cost);
        let candidate = Box::new(Candidate { prepared, rank });
        Ok(if fits { Tried::Fits(candidate) } else { Tried::Misses(candidate) })
    }

    fn fall_back(&self, m: &Material, under: Under<'_>, choice: &Choice) -> Result<Prepared, Error> {
        let spec = m.brdf.spec();
        let why = match under.tolerance {
            Some(t) => format!("no technique takes {spec} to an error of {t}"),
            None => format!("no technique is ready and good enough for {spec} in time"),
        };
        if self.backend == Backend::Gpu {
            return Err(Error::usage(format!(
                "{why}: name a technique, or use `backend` cpu for the reference"
            )));
        }
        self.say(choice);
        self.tell(Notice::Reference { why });
        self.prepare(m, &Method::Reference, under, &self.task)
    }
}

/// The largest error of grazing views, where silhouettes may show it.
fn grazing(c: &Certificate) -> Option<f64> {
    let grazing = c.elevations.iter().filter(|e| e.theta_o >= GRAZING_DEGREES.to_radians());
    let worst = grazing.map(|e| e.error).fold(0.0, f64::max);
    (worst > GRAZING_ERROR && worst > 2.0 * c.error).then_some(worst)
}

/// The techniques that take a material, in the order in which they are tried: those made for its reflectance
/// as they are listed; the last of the list, which errs least; the cheapest of the others that errs least;
/// then all, the last of the list first. Where a tolerance is asked for, and where measurements make all of
/// them take several times as long as usual, the cheap one comes before the others. Where nothing varies over
/// the surface those made for the reflectance have to be cheap as well; where something does, those that
/// leave it out come behind the others.
fn candidates(m: &Material, tolerance: bool) -> Vec<&'static dyn AnyTechnique> {
    let takes =
        |t: &&'static dyn AnyTechnique| !t.card().needs.sites && (t.card().materials)(&*m.brdf).is_ok();
    let all = steradian_techniques::registry().iter().copied().filter(takes);
    let plain = m.maps.is_empty();
    let made_for = |t: &&'static dyn AnyTechnique| {
        (!plain || t.effort() <= CHEAP_SECONDS) && is_special(t.card()) && stands_for(t.card(), &*m.brdf)
    };
    let (mut first, mut any): (Vec<_>, Vec<_>) = all.partition(made_for);
    any.reverse();
    if !tolerance && !m.brdf.is_interpolated() && !any.is_empty() {
        first.push(any.remove(0));
    }
    if let Some(k) = any.iter().position(|t| t.effort() <= CHEAP_SECONDS) {
        first.push(any.remove(k));
    }
    first.extend(any);
    first.sort_by_key(|t| !m.left_out_by(t.varies()).is_empty());
    first
}

/// Was a technique tried that represents the same by more numbers, and leaves out no more of the material?
fn is_refined(t: &dyn AnyTechnique, trial: &Trial, before: &[Trial]) -> bool {
    let finer = |o: &Trial| {
        t.refined_by() == Some(o.technique) && o.error.is_some() && o.left_out.len() <= trial.left_out.len()
    };
    before.iter().any(finer)
}

/// Is it made for reflectances of two models at most?
fn is_special(card: &Card) -> bool {
    let specimens: Vec<_> = card.specimens.iter().filter_map(|s| steradian_brdf::parse(s).ok()).collect();
    let mut models: Vec<&dyn Brdf> = Vec::new();
    for s in &specimens {
        if !models.iter().any(|m| same_model(*m, &**s)) {
            models.push(&**s);
        }
    }
    models.len() <= 2
}

/// Is one of the technique's specimens of the same model, equally isotropic, and about as sharp? Otherwise
/// the technique approximates the material by something else, a mirror for example.
fn stands_for(card: &Card, brdf: &dyn Brdf) -> bool {
    let like = |b: &dyn Brdf| {
        let (a, b_) = (narrowest(b), narrowest(brdf));
        same_model(b, brdf)
            && b.is_isotropic() == brdf.is_isotropic()
            && a <= MAX_WIDTH_RATIO * b_
            && b_ <= MAX_WIDTH_RATIO * a
    };
    card.specimens.iter().any(|s| steradian_brdf::parse(s).is_ok_and(|b| like(&*b)))
}

/// Are both of one model (one page of documentation)?
fn same_model(a: &dyn Brdf, b: &dyn Brdf) -> bool {
    std::ptr::eq(a.info(), b.info())
}

/// Width of the narrowest lobe at normal view, radians; π for a reflectance without lobes.
fn narrowest(brdf: &dyn Brdf) -> f64 {
    let width = |l: Lobe| match l {
        Lobe::Axis { width, .. } | Lobe::Cone { width, .. } | Lobe::Arc { width, .. } => width,
    };
    brdf.lobes(DVec3::Z).into_iter().map(width).fold(std::f64::consts::PI, f64::min)
}

#[cfg(test)]
mod tests;

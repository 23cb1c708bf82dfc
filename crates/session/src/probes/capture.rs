//! Capturing the light of a scene.

use super::kept::{self, Parts};
use super::refuse;
use crate::{Error, Outcome, Scene, Session};
use glam::{DVec3, UVec3};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::time::Instant;
use steradian_light::{LARGEST, MAX_BANDS, Places, Probe, Probes};
use steradian_reference::path::{PathOptions, ProbeEstimate, trace_environments, trace_probes};
use steradian_render::PathStage;
use steradian_scene::Bvh;
use steradian_transfer::Store;

/// Where light is captured.
#[derive(Debug, Clone, PartialEq)]
pub enum Where {
    /// Numbers of probes along x, y and z, between two corners; without corners at the centres of equal parts
    /// of the scene's bounds.
    Grid([u32; 3], Option<[DVec3; 2]>),
    /// At given points.
    Points(Vec<DVec3>),
}

/// Request for a capture.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Where.
    pub at: Where,
    /// Bands of spherical harmonics.
    pub bands: usize,
    /// Reflections of a path at most.
    pub bounces: u32,
    /// Standard error over the light of a probe at which to stop, all coefficients together.
    pub noise: f64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Rows of a lat-long image of each probe, and the paths of its texels.
    pub image: Option<(usize, u32)>,
    /// Output file; finished probes are kept next to it until it is written.
    pub output: Option<PathBuf>,
}

impl Default for Request {
    /// One probe in the middle, five bands, four reflections, 2 % of noise, no images.
    fn default() -> Self {
        let at = Where::Grid([1; 3], None);
        Self { at, bands: 5, bounces: 4, noise: 0.02, seed: 0, image: None, output: None }
    }
}

/// A captured light field.
#[derive(Debug)]
pub struct Captured {
    /// The field.
    pub field: Probes,
    /// The largest relative standard error of a probe's coefficients.
    pub noise: f64,
    /// The largest of an image's texels, RMS over the sphere.
    pub image_noise: Option<f64>,
    /// Paths of all probes.
    pub paths: u64,
    /// Seconds that it took.
    pub seconds: f64,
    /// Parts that an interrupted capture had left: a probe has one of each round of paths, and one of its
    /// image.
    pub resumed: usize,
    pub(super) store: Option<Store>,
}

impl Captured {
    /// Number of probes inside solids.
    pub fn inside(&self) -> usize {
        self.field.light.iter().filter(|l| l.is_none()).count()
    }
}

/// Most probes of a field.
const MOST: usize = 1 << 16;
/// Paths of a probe at first, and at most.
const PATHS: [u32; 2] = [256, 1 << 20];
/// Most rows of a probe's image.
const ROWS: usize = 1024;

impl Session {
    /// The light that arrives at places of a scene: unoccluded distant light, and light reflected by
    /// surfaces, by path tracing. Probes that mostly see surfaces from behind are inside solids and are left
    /// out. The number of paths is doubled until each probe's noise is at most that of the request. The bits
    /// do not depend on the number of threads, nor on interruptions.
    pub fn capture(&mut self, scene: &Scene, request: &Request) -> Result<Outcome<Captured>, Error> {
        let start = Instant::now();
        refuse(scene)?;
        let scene = &*scene.grounded(&scene.camera_or_framed()?);
        self.check_capture(request)?;
        let places = places(scene, &request.at)?;
        scene.lights.check().map_err(Error::input)?;
        let mesh = Arc::new(scene.mesh.clone());
        let stage = PathStage {
            bvh: Arc::new(Bvh::build(&mesh)),
            mesh,
            materials: scene.materials.iter().map(|m| (m.brdf.clone(), m.base_colour.clone())).collect(),
            lights: scene.lights.clone(),
            bounces: request.bounces,
            samples: 1,
            seed: AtomicU64::new(request.seed),
        };
        let positions = places.positions();
        let store = kept::store(scene, request)?;
        let resumed = store.as_ref().map_or(0, Store::found);
        if resumed > 0 {
            self.say(format_args!("goes on after {resumed} finished parts of {} probes", positions.len()));
        }
        let (known, paths) = self.estimates(&stage, &positions, request, store.as_ref())?;
        let open: Vec<usize> = (0..known.len()).filter(|k| !known[*k].inside()).collect();
        if open.is_empty() {
            // The finished parts are of no use to a later run.
            store.map_or(Ok(()), Store::finish)?;
            return Err(Error::input(format!(
                "all {} probes are inside solids: they see surfaces from behind, or nothing but black; move them, or \
                 turn the triangles over",
                known.len()
            )));
        }
        let images = self.images(&stage, &positions, &open, request, store.as_ref())?;
        let image_noise = images.as_ref().map(|all| all.iter().map(|i| i.1).fold(0.0, f64::max));
        let mut images = images.map(|all| all.into_iter().map(|i| i.0));
        let noise = open.iter().map(|k| known[*k].noise()).fold(0.0, f64::max);
        let mut light = Vec::with_capacity(known.len());
        for e in known {
            let outside = !e.inside();
            let image = images.as_mut().filter(|_| outside).and_then(Iterator::next);
            light.push(outside.then_some(Probe { sh: e.light, image }));
        }
        let field = Probes { places, light };
        let too_bright = |x: f64| x.is_nan() || x.abs() > LARGEST;
        if field.light.iter().flatten().any(|p| p.sh.c.iter().flatten().any(|x| too_bright(*x))) {
            return Err(Error::failed(format!(
                "light beyond {LARGEST:e} arrives at a probe: scale the light down"
            )));
        }
        self.note_error(format!("relative noise {noise:.3e} (estimated)"));
        let seconds = start.elapsed().as_secs_f64();
        let done = Captured { field, noise, image_noise, paths, seconds, resumed, store };
        Ok(Outcome::new(done, Some(request.noise), noise))
    }

    /// Refuses requests that cannot be computed, or kept in memory.
    fn check_capture(&self, r: &Request) -> Result<(), Error> {
        let [x, y, z] = match &r.at {
            Where::Grid(n, _) => n.map(u64::from),
            Where::Points(p) => [p.len() as u64, 1, 1],
        };
        let count = x.checked_mul(y).and_then(|n| n.checked_mul(z)).filter(|n| *n <= MOST as u64);
        let Some(count) = count.filter(|n| *n > 0) else {
            return Err(Error::usage(format!("a field has 1 to {MOST} probes, not {x} x {y} x {z}")));
        };
        if !(1..=MAX_BANDS).contains(&r.bands) {
            return Err(Error::usage(format!("probes have 1 to {MAX_BANDS} bands, not {}", r.bands)));
        }
        let rows = r.image.map_or(1, |i| i.0);
        if !(1..=ROWS).contains(&rows) {
            return Err(Error::usage(format!("images of probes have 1 to {ROWS} rows, not {rows}")));
        }
        // Coefficients with their variances as computed and as written; texels twice, and in halves while
        // they are traced.
        let image = r.image.map_or(0, |(rows, _)| 4 * 3 * 2 * rows * rows * 4);
        let bytes = count * (4 * 3 * r.bands * r.bands * 8 + image) as u64;
        if bytes > self.task.max_memory() {
            return Err(Error::usage(format!(
                "{count} probes take {} MiB: fewer of them, fewer bands, smaller images, or a larger `max-memory`",
                bytes >> 20
            )));
        }
        Ok(())
    }

    /// Harmonics, with as many paths as each probe needs, and the number of paths.
    fn estimates(
        &self,
        stage: &PathStage,
        positions: &[DVec3],
        r: &Request,
        store: Option<&Store>,
    ) -> Result<(Vec<ProbeEstimate>, u64), Error> {
        let mut known: Vec<ProbeEstimate> = Vec::new();
        let mut counts = vec![0.0; positions.len()];
        let (mut open, mut samples, mut round, mut paths) =
            ((0..positions.len()).collect::<Vec<_>>(), PATHS[0], 0, 0);
        while !open.is_empty() && samples <= PATHS[1] {
            let some: Vec<DVec3> = open.iter().map(|k| positions[*k]).collect();
            // Each round has its own random numbers.
            let options = PathOptions { bounces: r.bounces, samples, seed: r.seed.wrapping_add(round << 48) };
            let kept = Parts::new(store, round as u32, r.bands * r.bands);
            let new = stage.with_scene(|s| trace_probes(s, &some, r.bands, options, &kept, &self.task))?;
            kept.check()?;
            paths += u64::from(samples) * open.len() as u64;
            if known.is_empty() {
                known = new;
                counts.fill(f64::from(samples));
            } else {
                for (k, new) in open.iter().zip(&new) {
                    known[*k].join(new, counts[*k], f64::from(samples));
                    counts[*k] += f64::from(samples);
                }
            }
            open.retain(|k| !known[*k].inside() && known[*k].noise() > r.noise);
            round += 1;
            samples *= 2;
        }
        Ok((known, paths))
    }

    fn images(
        &self,
        stage: &PathStage,
        positions: &[DVec3],
        open: &[usize],
        r: &Request,
        store: Option<&Store>,
    ) -> Result<Option<Vec<(steradian_sphere::SphereImage, f64)>>, Error> {
        let Some((rows, samples)) = r.image else { return Ok(None) };
        let some: Vec<DVec3> = open.iter().map(|k| positions[*k]).collect();
        let options = PathOptions { bounces: r.bounces, samples, seed: r.seed };
        let kept = Parts::new(store, Parts::IMAGES, rows);
        let all = stage.with_scene(|s| trace_environments(s, &some, rows, options, &kept, &self.task))?;
        kept.check()?;
        Ok(Some(all.into_iter().map(|i| (i.image, i.noise)).collect()))
    }
}

fn places(scene: &Scene, at: &Where) -> Result<Places, Error> {
    Ok(match at {
        Where::Points(p) => Places::Points(p.clone()),
        Where::Grid(n, Some(bounds)) => Places::Grid { bounds: *bounds, size: UVec3::from(*n) },
        Where::Grid(n, None) => {
            let (lo, hi) = scene.mesh.bounds().ok_or_else(|| Error::input("the mesh has no triangles"))?;
            let half = (hi - lo).as_dvec3() * 0.5 / UVec3::from(*n).as_dvec3();
            Places::Grid { bounds: [lo.as_dvec3() + half, hi.as_dvec3() - half], size: UVec3::from(*n) }
        }
    })
}

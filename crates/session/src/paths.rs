//! Pictures and radiance by the path tracer: the reference where surfaces shadow and light each other.

use crate::eval::{Answers, Points, Request};
use crate::{Error, Scene, Session};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use steradian_base::{Certificate, Evidence};
use steradian_reference::path::{PathEstimate, PathOptions, PathPoint, PathScene, trace_points};
use steradian_render::{Background, Film, PathShader, PathStage, Settings, Stage, Surface, SurfaceMaps};
use steradian_scene::{Bvh, Camera};
use steradian_sphere::Frame;

/// Settings of the path tracer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paths {
    /// Reflections at most; 1 is direct light with shadows.
    pub bounces: u32,
    /// Noise at which to stop: the standard error over the radiance, in the RMS over the surfaces of a
    /// picture, or of each point.
    pub noise: f64,
}

impl Default for Paths {
    /// Four reflections, 1 % of noise.
    fn default() -> Self {
        Self { bounces: 4, noise: 0.01 }
    }
}

/// A path-traced picture.
pub struct Traced {
    /// The mean.
    pub film: Film,
    /// Estimated variance of that mean, per channel and pixel.
    pub variance: [Vec<f32>; 3],
    /// RMS of the standard error over the RMS of radiance, where surfaces cover the picture.
    pub noise: f64,
    /// Paths of a pixel inside surfaces.
    pub samples: u64,
}

impl Traced {
    /// Certificate of a path-traced picture: its noise.
    pub fn certificate(&self) -> Certificate {
        let metric = "standard error of path tracing over radiance, RMS over the pixels that surfaces cover";
        let certificate = Certificate::new(self.noise, Evidence::Estimated).metric(metric);
        certificate.detail("paths per pixel", self.samples as f64)
    }
}

/// Paths per shaded point in one of the pictures that are averaged.
const SAMPLES: u32 = 2;
/// Fewest pictures, so that their spread gives the variance: of eight the standard error is known to a
/// quarter (1/√14).
const MIN_PICTURES: u64 = 8;
/// Pictures at most: 16,384 paths per point, which is a noise of 1/128 of a single path's.
const MAX_PICTURES: u64 = 8192;
/// Paths of a point of a list: the first number, and the most, whose noise is a thousandth of a single
/// path's.
const POINT_PATHS: [u32; 2] = [64, 1 << 20];

impl Session {
    /// The picture of a scene by paths: independent pictures are averaged until their spread shows that the
    /// mean's noise is at most that of the settings.
    pub(crate) fn trace(
        &self,
        scene: &Scene,
        camera: Camera,
        background: &Background,
        settings: Settings,
        paths: Paths,
    ) -> Result<Traced, Error> {
        let mesh = Arc::new(scene.mesh.clone());
        let bvh = Arc::new(Bvh::build(&mesh));
        let materials = scene.materials.iter().map(|m| (m.brdf.clone(), m.base_colour.clone())).collect();
        let stage = Arc::new(PathStage {
            mesh,
            bvh,
            materials,
            lights: scene.lights.clone(),
            bounces: paths.bounces,
            samples: SAMPLES,
            seed: AtomicU64::new(0),
        });
        let surface = |m: &crate::Material| Surface {
            shader: Arc::new(PathShader { stage: stage.clone(), brdf: m.brdf.clone() }),
            base_colour: m.base_colour.clone(),
            // Of properties that vary over a surface the path tracer supports normals and base colours.
            maps: SurfaceMaps { normal: m.maps.normal.clone(), ..SurfaceMaps::default() },
        };
        let surfaces: Vec<Surface> = scene.materials.iter().map(surface).collect();
        let picture = Stage { mesh: &stage.mesh, bvh: &stage.bvh, surfaces: &surfaces, background, camera };
        // Shadows have edges inside surfaces: points in a pixel are shaded one by one.
        let settings =
            Settings { inner: settings.inner.max(2), share: false, interpolate: false, ..settings };
        let quiet = self.task.clone().without_progress();
        let (mut sum, mut wanted, mut done) = (None::<Sum>, MIN_PICTURES, 0);
        self.task.begin("path tracing", wanted);
        let noise = loop {
            stage.seed.store(done, Ordering::Relaxed);
            let film = steradian_render::render(&picture, &settings, &quiet)?;
            match &mut sum {
                None => sum = Some(Sum::new(film)),
                Some(sum) => sum.add(&film),
            }
            done += 1;
            self.task.advance(1);
            if done < wanted {
                continue;
            }
            let noise = sum.as_ref().map_or(0.0, Sum::noise);
            if noise <= paths.noise || done >= MAX_PICTURES {
                break noise;
            }
            // Noise falls with the root of their number.
            let needed = (done as f64 * (noise / paths.noise).powi(2) * 1.05).ceil() as u64;
            let more = needed.clamp(done + 1, 4 * done).min(MAX_PICTURES) - done;
            wanted = done + more;
            self.task.end();
            self.task.begin("path tracing", more);
        };
        self.task.end();
        let Some(sum) = sum else { return Err(Error::usage("no picture was traced")) };
        let variance = sum.variance();
        let points = (settings.inner * settings.inner) as u64;
        Ok(Traced { film: sum.film(), variance, noise, samples: done * points * u64::from(SAMPLES) })
    }
}

/// Mean and spread of pictures (Welford 1962).
struct Sum {
    first: Film,
    mean: [Vec<f64>; 3],
    squares: [Vec<f64>; 3],
    count: f64,
}

impl Sum {
    fn new(first: Film) -> Self {
        let mean = first.rgb.each_ref().map(|p| p.iter().map(|v| f64::from(*v)).collect());
        let squares = first.rgb.each_ref().map(|p| vec![0.0; p.len()]);
        Self { first, mean, squares, count: 1.0 }
    }

    fn add(&mut self, film: &Film) {
        self.count += 1.0;
        for c in 0..3 {
            let sums = self.mean[c].iter_mut().zip(&mut self.squares[c]);
            for ((mean, square), v) in sums.zip(&film.rgb[c]) {
                let from = f64::from(*v) - *mean;
                *mean += from / self.count;
                *square += from * (f64::from(*v) - *mean);
            }
        }
    }

    /// Variance of the mean.
    fn variance(&self) -> [Vec<f32>; 3] {
        let by = 1.0 / (self.count * (self.count - 1.0).max(1.0));
        self.squares.each_ref().map(|s| s.iter().map(|s| (s * by) as f32).collect())
    }

    fn noise(&self) -> f64 {
        let by = 1.0 / (self.count * (self.count - 1.0).max(1.0));
        let covered = |i: usize| self.first.alpha[i] > 0.0;
        let over = |v: &[Vec<f64>; 3], f: &dyn Fn(f64) -> f64| -> f64 {
            v.iter().map(|p| (0..p.len()).filter(|i| covered(*i)).map(|i| f(p[i])).sum::<f64>()).sum()
        };
        let (noise, all) = (over(&self.squares, &|s| s * by), over(&self.mean, &|m| m * m));
        if all > 0.0 { (noise / all).sqrt() } else { 0.0 }
    }

    fn film(self) -> Film {
        let rgb = self.mean.map(|p| p.into_iter().map(|v| v as f32).collect());
        Film { rgb, ..self.first }
    }
}

/// Radiance that leaves points on or near a mesh: paths are added until the noise of each is at most that of
/// the settings.
pub(crate) fn points(r: &Request, q: &Points, paths: Paths, session: &Session) -> Result<Answers, Error> {
    if !r.params.0.is_empty() {
        return Err(Error::usage("the path tracer takes no `param`: see `bounces` and `noise`"));
    }
    let mesh = r.mesh.as_ref();
    let mesh = mesh.ok_or_else(|| Error::usage("path traces rays through a mesh: give one with `mesh`"))?;
    let places = q.p.as_ref();
    let places =
        places.ok_or_else(|| Error::usage("path needs the columns px,py,pz: where the points lie"))?;
    let bvh = Bvh::build(mesh);
    let scene = PathScene {
        mesh,
        bvh: &bvh,
        materials: std::slice::from_ref(&r.brdf),
        tint: None,
        lights: &r.lights,
        offset: PathScene::OFFSET,
    };
    let all: Vec<PathPoint<'_>> = (0..q.n.len())
        .map(|i| PathPoint {
            position: places[i],
            frame: Frame { n: q.n[i], t: q.t[i], b: q.n[i].cross(q.t[i]) },
            wo: q.wo[i],
            brdf: &*r.brdf,
        })
        .collect();
    // Sums of samples: radiance and its variance, weighted by how many.
    let mut known: Vec<(PathEstimate, f64)> =
        vec![(PathEstimate { rgb: [0.0; 3], variance: [0.0; 3] }, 0.0); all.len()];
    let (mut open, mut samples, mut seed): (Vec<usize>, u32, u64) =
        ((0..all.len()).collect(), POINT_PATHS[0], 0);
    while !open.is_empty() && samples <= POINT_PATHS[1] {
        let some: Vec<PathPoint<'_>> = open.iter().map(|i| all[*i]).collect();
        let options = PathOptions { bounces: paths.bounces, samples, seed };
        let new = trace_points(&scene, &some, options, &session.task)?;
        for (i, e) in open.iter().zip(&new) {
            join(&mut known[*i], e, f64::from(samples));
        }
        open.retain(|i| error(&known[*i].0) > paths.noise);
        seed += 1;
        samples *= 2;
    }
    let rows: Vec<_> = known.iter().map(|(e, _)| (e.rgb, error(e))).collect();
    let error = rows.iter().map(|a| a.1).fold(0.0, f64::max);
    Ok(Answers { rows, error, certificate: None })
}

/// The mean of two means, `n` samples being new.
fn join((to, count): &mut (PathEstimate, f64), new: &PathEstimate, n: f64) {
    let [a, b] = [*count, n].map(|k| k / (*count + n));
    for c in 0..3 {
        to.rgb[c] = a * to.rgb[c] + b * new.rgb[c];
        to.variance[c] = a * a * to.variance[c] + b * b * new.variance[c];
    }
    *count += n;
}

/// Standard error over radiance, all channels together.
fn error(e: &PathEstimate) -> f64 {
    let (noise, all): (f64, f64) = (e.variance.iter().sum(), e.rgb.iter().map(|x| x * x).sum());
    if all > 0.0 { (noise / all).sqrt() } else { 0.0 }
}

//! Incident light at points, as spherical harmonics.

use super::random::Random;
use super::sampler::{Sampler, row_solid_angle, row_solid_angle_of};
use super::tracer::Tracer;
use super::{PathOptions, PathScene};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_scene::Ray;
use steradian_sphere::sh::{self, ShRgb};
use steradian_sphere::{Layout, SphereImage};

/// Incident light at a point.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeEstimate {
    /// ∫ L y_i dw over world axes, W sr⁻¹ m⁻² times steradians.
    pub light: ShRgb,
    /// Estimated variance of each coefficient; infinite with fewer than two samples.
    pub variance: ShRgb,
    /// The share of directions that meet a surface from behind: 1 inside a solid.
    pub behind: f64,
}

/// Results that are kept from an interrupted computation, and those that are finished now, by number; `()`
/// keeps none.
pub trait Kept<T>: Sync {
    /// Reads result `number`, if it was kept.
    fn read(&self, number: usize) -> Option<T>;
    /// A result is finished.
    fn write(&self, number: usize, result: &T);
}

impl<T> Kept<T> for () {
    fn read(&self, _: usize) -> Option<T> {
        None
    }

    fn write(&self, _: usize, _: &T) {}
}

impl ProbeEstimate {
    /// Is the point inside a solid? Most directions meet surfaces from behind.
    pub fn inside(&self) -> bool {
        self.behind > 0.5
    }

    /// Averages this mean of `n` samples with another, independent one of `more`.
    pub fn join(&mut self, other: &Self, n: f64, more: f64) {
        let [a, b] = [n, more].map(|k| k / (n + more));
        for c in 0..3 {
            let means = self.light.c[c].iter_mut().zip(&other.light.c[c]);
            means.for_each(|(x, y)| *x = a * *x + b * y);
            let variances = self.variance.c[c].iter_mut().zip(&other.variance.c[c]);
            variances.for_each(|(x, y)| *x = a * a * *x + b * b * y);
        }
        self.behind = a * self.behind + b * other.behind;
    }

    /// The standard error of the light over its size, all coefficients together; 0 of darkness.
    pub fn noise(&self) -> f64 {
        let all: f64 = self.light.c.iter().flatten().map(|c| c * c).sum();
        let off: f64 = self.variance.c.iter().flatten().sum();
        if all > 0.0 { (off / all).sqrt() } else { 0.0 }
    }

    /// The largest standard error of a coefficient.
    pub fn error(&self) -> f64 {
        self.variance.c.iter().flatten().fold(0.0, |w, v| f64::max(w, v.sqrt()))
    }
}

/// Harmonics, in `bands` bands, of the radiance that arrives at `points`: unoccluded distant light with
/// disks, directional and point lights, and light that surfaces reflect in at most `bounces` reflections. A
/// sample is a direction of the sphere, stratified in height, and one drawn from distant light; the balance
/// heuristic combines both. The bits do not depend on the number of threads. Probes that are `kept` are not
/// traced again.
///
/// # Errors
/// If the task was cancelled.
pub fn trace_probes(
    scene: &PathScene<'_>,
    points: &[DVec3],
    bands: usize,
    options: PathOptions,
    kept: &dyn Kept<ProbeEstimate>,
    task: &Task,
) -> Result<Vec<ProbeEstimate>, Cancelled> {
    let tracer = Tracer { scene, sampler: Sampler::new(scene.lights) };
    task.begin("probes", points.len() as u64);
    let one = |(k, p): (usize, &DVec3)| {
        task.check()?;
        let e = kept.read(k).unwrap_or_else(|| {
            let e = probe(&tracer, *p, bands.max(1) - 1, options, k as u64);
            kept.write(k, &e);
            e
        });
        task.advance(1);
        Ok(e)
    };
    let out = points.par_iter().enumerate().with_max_len(1).map(one).collect();
    task.end();
    out
}

/// Number of directions drawn from distant light, relative to those of texels: light varies less within a
/// texel than over the sphere.
const LIGHT_PATHS: f64 = 0.125;

/// Incident light at a point as an image.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeImage {
    /// Lat-long means of radiance over texels.
    pub image: SphereImage,
    /// Estimated standard error of texels over radiance, RMS over the sphere.
    pub noise: f64,
}

/// Lat-long images of `height` rows and twice as many columns, in texel means, of the radiance that arrives
/// at `points`, under the light that [`trace_probes`] takes. `samples` is the number of paths per texel
/// (even, at least two), in random directions within it; an eighth as many directions of the whole sphere are
/// drawn from distant light, and the power heuristic combines both. Directional and point lights go to the
/// texel of their direction. The bits do not depend on the number of threads. Images that are `kept` are not
/// traced again.
///
/// # Errors
/// If the task was cancelled.
pub fn trace_environments(
    scene: &PathScene<'_>,
    points: &[DVec3],
    height: usize,
    options: PathOptions,
    kept: &dyn Kept<ProbeImage>,
    task: &Task,
) -> Result<Vec<ProbeImage>, Cancelled> {
    let tracer = Tracer { scene, sampler: Sampler::new(scene.lights) };
    task.begin("environments of probes", points.len() as u64);
    let one = |(k, p): (usize, &DVec3)| {
        let e = match kept.read(k) {
            Some(e) => e,
            None => {
                let e = environment(&tracer, *p, height.max(1), options, k as u64, task)?;
                kept.write(k, &e);
                e
            }
        };
        task.advance(1);
        Ok(e)
    };
    let out = points.par_iter().enumerate().with_max_len(1).map(one).collect();
    task.end();
    out
}

/// Two independent halves, whose difference tells the noise of their mean.
fn environment(
    tracer: &Tracer<'_>,
    p: DVec3,
    height: usize,
    options: PathOptions,
    index: u64,
    task: &Task,
) -> Result<ProbeImage, Cancelled> {
    let blank = || SphereImage::new(Layout::LatLong, 2 * height, height);
    let mut halves = [blank(), blank()];
    for (half, image) in halves.iter_mut().enumerate() {
        let options = PathOptions { samples: options.samples.div_ceil(2).max(1), ..options };
        half_environment(tracer, p, image, options, 2 * index + half as u64, task)?;
    }
    let [mut image, other] = halves;
    let (mut off, mut all) = (0.0, 0.0);
    for j in 0..height {
        let area = row_solid_angle(&image, j);
        for i in 0..2 * height {
            let k = j * 2 * height + i;
            for (plane, other) in image.planes.iter_mut().zip(&other.planes) {
                let (a, b) = (f64::from(plane[k]), f64::from(other[k]));
                off += area * (0.5 * (a - b)).powi(2);
                all += area * (0.5 * (a + b)).powi(2);
                plane[k] = (0.5 * (a + b)) as f32;
            }
        }
    }
    delta_lights(tracer, p, |d, e| {
        let (_, i, j) = image.texel_of(d);
        let (k, area) = (image.index(0, i, j), row_solid_angle(&image, j));
        image.planes.iter_mut().zip(e).for_each(|(plane, e)| plane[k] += (e / area) as f32);
    });
    Ok(ProbeImage { image, noise: if all > 0.0 { (off / all).sqrt() } else { 0.0 } })
}

fn half_environment(
    tracer: &Tracer<'_>,
    p: DVec3,
    to: &mut SphereImage,
    options: PathOptions,
    index: u64,
    task: &Task,
) -> Result<(), Cancelled> {
    let (w, h) = (to.width, to.height);
    let n = f64::from(options.samples);
    let lights = (w * h) as f64 * n * LIGHT_PATHS;
    // Expected numbers of directions in a steradian that are drawn from a texel and from the light, over the
    // sum of their squares: the power heuristic (Veach & Guibas 1995).
    let weights = |j: usize, pdf: f64| {
        let (a, b) = (n / row_solid_angle_of(w, h, j), lights * pdf);
        let all = a * a + b * b;
        (a / all, b / all)
    };
    let mut sums = vec![[0.0; 3]; w * h];
    for j in 0..h {
        task.check()?;
        let edge = |j: usize| (PI * j as f64 / h as f64).cos();
        let (top, bottom) = (edge(j), edge(j + 1));
        for i in 0..w {
            let k = j * w + i;
            for s in 0..options.samples {
                let mut random = Random::new(options.seed, index, u64::from(s) * (w * h) as u64 + k as u64);
                let u = random.pair();
                let y = top + (bottom - top) * (f64::from(s) + u.x) / n;
                let phi = ((i as f64 + u.y) / w as f64 - 0.5) * 2.0 * PI;
                let r = (1.0 - y * y).max(0.0).sqrt();
                let d = DVec3::new(r * phi.cos(), y, r * phi.sin());
                let (l, pdf) = match tracer.arriving(&ray(p, d), options.bounces, &mut random).0 {
                    Some(l) => (l, 0.0),
                    None => tracer.sampler.at(d),
                };
                let by = weights(j, pdf).0;
                (0..3).for_each(|c| sums[k][c] += l[c] * by);
            }
        }
    }
    for s in 0..lights as u64 {
        let mut random = Random::new(!options.seed, index, s);
        let Some(d) = tracer.sampler.sample(random.next(), random.pair()) else { continue };
        if !tracer.scene.bvh.occluded(&ray(p, d), f32::INFINITY) {
            let ((l, pdf), (_, i, j)) = (tracer.sampler.at(d), to.texel_of(d));
            let by = weights(j, pdf).1;
            (0..3).for_each(|c| sums[j * w + i][c] += l[c] * by);
        }
    }
    for (k, sum) in sums.iter().enumerate() {
        let by = 1.0 / row_solid_angle_of(w, h, k / w);
        (0..3).for_each(|c| to.planes[c][k] = (sum[c] * by) as f32);
    }
    Ok(())
}

/// Means and variances of coefficients (Welford 1962).
fn probe(tracer: &Tracer<'_>, p: DVec3, order: usize, options: PathOptions, index: u64) -> ProbeEstimate {
    let count = sh::count(order);
    let (mut mean, mut squares) = (ShRgb::zero(order), ShRgb::zero(order));
    let (mut y, mut sample) = (vec![0.0; count], ShRgb::zero(order));
    let mut behind = 0u32;
    let n = f64::from(options.samples);
    for s in 0..options.samples {
        let mut random = Random::new(options.seed, index, u64::from(s));
        sample.c.iter_mut().for_each(|c| c.fill(0.0));
        let mut add = |d: DVec3, l: [f64; 3]| {
            sh::eval(order, d, &mut y);
            for (to, l) in sample.c.iter_mut().zip(l) {
                to.iter_mut().zip(&y).for_each(|(t, y)| *t += l * y);
            }
        };
        let u = random.pair();
        let height = 1.0 - 2.0 * (f64::from(s) + u.x) / n;
        let (sin, cos) = (2.0 * PI * u.y).sin_cos();
        let r = (1.0 - height * height).max(0.0).sqrt();
        let d = DVec3::new(r * cos, height, r * sin);
        let uniform = 1.0 / (4.0 * PI);
        let (from, away) = tracer.arriving(&ray(p, d), options.bounces, &mut random);
        match from {
            Some(l) => add(d, l.map(|l| l / uniform)),
            None => {
                let (l, pdf) = tracer.sampler.at(d);
                add(d, l.map(|l| l / (uniform + pdf)));
            }
        }
        behind += u32::from(away);
        if let Some(d) = tracer.sampler.sample(random.next(), random.pair()) {
            let (l, pdf) = tracer.sampler.at(d);
            if !tracer.scene.bvh.occluded(&ray(p, d), f32::INFINITY) {
                add(d, l.map(|l| l / (uniform + pdf)));
            }
        }
        for c in 0..3 {
            for i in 0..count {
                let from = sample.c[c][i] - mean.c[c][i];
                mean.c[c][i] += from / f64::from(s + 1);
                squares.c[c][i] += from * (sample.c[c][i] - mean.c[c][i]);
            }
        }
    }
    let over = if options.samples > 1 { 1.0 / (n * (n - 1.0)) } else { f64::INFINITY };
    squares.c.iter_mut().flatten().for_each(|q| *q = if over.is_finite() { *q * over } else { over });
    delta_lights(tracer, p, |d, e| {
        sh::eval(order, d, &mut y);
        for (to, e) in mean.c.iter_mut().zip(e) {
            to.iter_mut().zip(&y).for_each(|(t, y)| *t += e * y);
        }
    });
    ProbeEstimate { light: mean, variance: squares, behind: f64::from(behind) / n.max(1.0) }
}

/// Directional and point lights, which have no extent: their directions and irradiances, where nothing stands
/// before them.
fn delta_lights(tracer: &Tracer<'_>, p: DVec3, mut add: impl FnMut(DVec3, [f64; 3])) {
    let mut open = |d: DVec3, e: [f64; 3], distance: f64| {
        if d != DVec3::ZERO && !tracer.scene.bvh.occluded(&ray(p, d), distance as f32) {
            add(d, e);
        }
    };
    for light in &tracer.scene.lights.directionals {
        open(light.direction.normalize_or_zero(), light.irradiance, f64::INFINITY);
    }
    for light in &tracer.scene.lights.points {
        let away = light.position.as_dvec3() - p;
        let d2 = away.length_squared();
        if d2 > 0.0 {
            open(away / d2.sqrt(), light.intensity.map(|i| f64::from(i) / d2), d2.sqrt());
        }
    }
}

fn ray(p: DVec3, d: DVec3) -> Ray {
    Ray { origin: p.as_vec3(), direction: d.as_vec3().normalize() }
}

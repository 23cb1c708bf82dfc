//! Incident light at points, as spherical harmonics.

use super::random::Random;
use super::sampler::Sampler;
use super::tracer::Tracer;
use super::{PathOptions, PathScene};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_scene::Ray;
use steradian_sphere::sh::{self, ShRgb};

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

impl ProbeEstimate {
    /// Is the point inside a solid? Most directions meet surfaces from behind.
    pub fn inside(&self) -> bool {
        self.behind > 0.5
    }

    /// The largest standard error of a coefficient.
    pub fn error(&self) -> f64 {
        self.variance.c.iter().flatten().fold(0.0, |w, v| f64::max(w, v.sqrt()))
    }
}

/// Harmonics of `bands` of the radiance that arrives at `points`: distant light where nothing stands in its way, disks,
/// directional and point lights among it, and what surfaces reflect in `bounces` reflections at most. A sample is a direction
/// of the sphere, stratified in height, and one drawn from distant light; the balance heuristic joins them. The same bits
/// whatever the number of threads.
///
/// # Errors
/// If the task was cancelled.
pub fn trace_probes(
    scene: &PathScene<'_>,
    points: &[DVec3],
    bands: usize,
    options: PathOptions,
    task: &Task,
) -> Result<Vec<ProbeEstimate>, Cancelled> {
    let tracer = Tracer { scene, sampler: Sampler::new(scene.lights) };
    task.begin("probes", points.len() as u64);
    let one = |(k, p): (usize, &DVec3)| {
        task.check()?;
        let e = probe(&tracer, *p, bands.max(1) - 1, options, k as u64);
        task.advance(1);
        Ok(e)
    };
    let out = points.par_iter().enumerate().with_max_len(1).map(one).collect();
    task.end();
    out
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
    delta_lights(tracer, p, order, &mut mean);
    ProbeEstimate { light: mean, variance: squares, behind: f64::from(behind) / n.max(1.0) }
}

/// Adds directional and point lights, which have no extent: E y(d).
fn delta_lights(tracer: &Tracer<'_>, p: DVec3, order: usize, to: &mut ShRgb) {
    let mut y = vec![0.0; sh::count(order)];
    let mut add = |d: DVec3, e: [f64; 3], distance: f64| {
        if d == DVec3::ZERO || tracer.scene.bvh.occluded(&ray(p, d), distance as f32) {
            return;
        }
        sh::eval(order, d, &mut y);
        for (to, e) in to.c.iter_mut().zip(e) {
            to.iter_mut().zip(&y).for_each(|(t, y)| *t += e * y);
        }
    };
    for light in &tracer.scene.lights.directionals {
        add(light.direction.normalize_or_zero(), light.irradiance, f64::INFINITY);
    }
    for light in &tracer.scene.lights.points {
        let away = light.position.as_dvec3() - p;
        let d2 = away.length_squared();
        if d2 > 0.0 {
            add(away / d2.sqrt(), light.intensity.map(|i| f64::from(i) / d2), d2.sqrt());
        }
    }
}

fn ray(p: DVec3, d: DVec3) -> Ray {
    Ray { origin: p.as_vec3(), direction: d.as_vec3().normalize() }
}

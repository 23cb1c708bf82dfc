//! Photographs of a periodic surface, under one directional light after another.
//!
//! A path is followed once for all lights: at each of its vertices every light that reaches it is added. Rays
//! that leave a period at its side enter the next one there, so that the surface is endless.

use super::random::Random;
use super::tracer::Vertex;
use super::{PathOptions, Tint};
use glam::{DVec2, DVec3};
use steradian_base::{Cancelled, Task};
use steradian_brdf::Brdf;
use steradian_parallel::prelude::*;
use steradian_scene::{Bvh, Mesh, Ray, Surface};
use steradian_sphere::Frame;

/// Most periods that a ray passes through.
const MOST_PERIODS: usize = 256;
/// Offset from a pixel's centre, in pixels, at which a single path samples it: vertices of height fields lie
/// at the centres.
const ASIDE: DVec2 = DVec2::new(1.1e-3, 1.7e-3);

/// A surface over the plane of x and y, seen from z, that repeats.
#[derive(Clone, Copy)]
pub struct Patch<'a> {
    /// One period: it covers a rectangle of the plane, and its sides fit each other.
    pub mesh: &'a Mesh,
    /// Acceleration structure of the mesh.
    pub bvh: &'a Bvh,
    /// Sides of the period along x and y.
    pub period: DVec2,
    /// Lower left corner of pictures, which are of one period.
    pub corner: DVec2,
    /// Height of the plane whose points pixels represent; a pixel shows the surface point on the line of
    /// sight through its point, in front of the plane or behind it.
    pub plane: f64,
    /// Reflectance.
    pub brdf: &'a dyn Brdf,
    /// Multiplies it at a point of the mesh.
    pub tint: Option<&'a Tint<'a>>,
    /// Distance that rays start off the surface.
    pub offset: f64,
}

/// Photographs of one view.
#[derive(Debug, Clone, PartialEq)]
pub struct Photographs {
    /// Radiance under an irradiance of 1 across the direction of each light, sr⁻¹: `[pixel][light]`, rows
    /// from the top.
    pub rgb: Vec<[f32; 3]>,
    /// Estimated variance of these numbers, the mean over pixels and colours, for each light; 0 where nothing
    /// is random.
    pub variance: Vec<f64>,
}

/// The pictures of `width` · `height` pixels of a patch from the unit direction `view` under a directional
/// light from each of the unit directions `lights`, all above the plane. A single path per pixel samples its
/// centre, several sample random points of it. Random numbers depend on the seed, `picture` and the pixel, so
/// the bits do not depend on the number of threads.
///
/// # Errors
/// If the task was cancelled.
pub fn photograph(
    patch: &Patch<'_>,
    (width, height): (usize, usize),
    (view, picture): (DVec3, u64),
    lights: &[DVec3],
    options: PathOptions,
    task: &Task,
) -> Result<Photographs, Cancelled> {
    let walk = Walk::new(patch);
    let row = |j: usize| {
        task.check()?;
        let mut out = (Vec::with_capacity(width * lights.len()), vec![0.0; lights.len()]);
        for i in 0..width {
            let index = (picture * height as u64 + j as u64) * width as u64 + i as u64;
            let place = |u: DVec2| {
                let at = DVec2::new((i as f64 + u.x) / width as f64, 1.0 - (j as f64 + u.y) / height as f64);
                patch.corner + at * patch.period
            };
            walk.pixel(place, view, lights, options, index, &mut out);
        }
        Ok(out)
    };
    let rows: Result<Vec<_>, Cancelled> = (0..height).into_par_iter().with_max_len(1).map(row).collect();
    let rows = rows?;
    let mut variance = vec![0.0; lights.len()];
    for (_, v) in &rows {
        variance.iter_mut().zip(v).for_each(|(a, v)| *a += v);
    }
    variance.iter_mut().for_each(|v| *v /= (3 * width * height) as f64);
    Ok(Photographs { rgb: rows.into_iter().flat_map(|r| r.0).collect(), variance })
}

struct Walk<'a> {
    patch: &'a Patch<'a>,
    /// Lower left corner of the mesh.
    low: DVec2,
    /// Smallest and largest height.
    range: [f64; 2],
}

impl<'a> Walk<'a> {
    fn new(patch: &'a Patch<'a>) -> Self {
        let (lo, hi) = patch.mesh.bounds().unwrap_or_default();
        Self { patch, low: lo.truncate().as_dvec2(), range: [f64::from(lo.z), f64::from(hi.z)] }
    }

    /// Adds the values of a pixel, and its share of the variances.
    fn pixel(
        &self,
        place: impl Fn(DVec2) -> DVec2,
        view: DVec3,
        lights: &[DVec3],
        options: PathOptions,
        index: u64,
        (out, variance): &mut (Vec<[f32; 3]>, Vec<f64>),
    ) {
        let (mut means, mut squares) = (vec![[0.0; 3]; lights.len()], vec![[0.0; 3]; lights.len()]);
        let mut values = vec![[0.0f64; 3]; lights.len()];
        for s in 0..options.samples {
            let mut random = Random::new(options.seed, index, u64::from(s));
            let u = if options.samples == 1 { DVec2::splat(0.5) + ASIDE } else { random.pair() };
            values.fill([0.0; 3]);
            // The ray starts above the whole surface.
            let up = (self.range[1] - self.patch.plane).max(0.0) + self.patch.offset;
            let from = place(u).extend(self.patch.plane) + view * (up / view.z);
            if let Some(v) = self.closest(from, -view) {
                self.follow(v, lights, options.bounces, &mut random, &mut values);
            }
            for (k, value) in values.iter().enumerate() {
                for c in 0..3 {
                    let off = value[c] - means[k][c];
                    means[k][c] += off / f64::from(s + 1);
                    squares[k][c] += off * (value[c] - means[k][c]);
                }
            }
        }
        out.extend(means.iter().map(|m| m.map(|x| x as f32)));
        if options.samples > 1 {
            let n = f64::from(options.samples);
            for (to, s) in variance.iter_mut().zip(squares) {
                *to += s.iter().sum::<f64>() / (n * (n - 1.0));
            }
        }
    }

    /// Contribution of a path under each light.
    fn follow(
        &self,
        mut v: Vertex<'a>,
        lights: &[DVec3],
        bounces: u32,
        random: &mut Random,
        to: &mut [[f64; 3]],
    ) {
        let mut throughput = [1.0; 3];
        let (mut rays, mut lit) = (Vec::with_capacity(lights.len()), Vec::with_capacity(lights.len()));
        for bounce in 0..bounces {
            if v.wo.is_nan() || v.wo.z <= 0.0 {
                return;
            }
            rays.clear();
            lit.clear();
            for (k, l) in lights.iter().enumerate() {
                let f = v.brdf.f_cos(v.frame.to_local(*l), v.wo);
                if f != [0.0; 3] && f.iter().all(|x| x.is_finite()) {
                    rays.push(self.ray(&v, *l));
                    lit.push((k, f));
                }
            }
            let mut dark = vec![false; rays.len()];
            self.patch.bvh.occluded_each(&rays, f32::INFINITY, &mut dark);
            for ((ray, dark), (k, f)) in rays.iter().zip(dark).zip(&lit) {
                if !dark && !self.hidden_beyond(ray) {
                    (0..3).for_each(|c| to[*k][c] += throughput[c] * v.tint[c] * f[c]);
                }
            }
            if bounce + 1 == bounces {
                return;
            }
            let Some(drawn) = v.brdf.sample(v.wo, random.pair()) else { return };
            if !(drawn.pdf > 0.0 && drawn.pdf.is_finite()) {
                return;
            }
            let f = v.brdf.f_cos(drawn.wi, v.wo).map(|f| f / drawn.pdf);
            if f.iter().any(|x| !x.is_finite()) || f == [0.0; 3] {
                return;
            }
            throughput = std::array::from_fn(|c| throughput[c] * f[c] * v.tint[c]);
            let ray = self.ray(&v, v.frame.to_world(drawn.wi));
            match self.closest(ray.origin.as_dvec3(), ray.direction.as_dvec3()) {
                Some(next) => v = next,
                None => return,
            }
        }
    }

    /// The ray that leaves a vertex towards `d`.
    fn ray(&self, v: &Vertex<'_>, d: DVec3) -> Ray {
        let side = if d.dot(v.side) < 0.0 { -v.side } else { v.side };
        let origin = v.position + side * self.patch.offset;
        Ray { origin: origin.as_vec3(), direction: d.as_vec3().normalize() }
    }

    /// The first result of `f` over the periods along a line; `f` gets each period's offset from the mesh.
    fn along<T>(&self, o: DVec3, d: DVec3, mut f: impl FnMut(DVec2) -> Option<T>) -> Option<T> {
        let [bottom, top] = self.range;
        let reach = |z: f64| (z - o.z) / d.z;
        let (from, to) = match d.z {
            z if z > 0.0 => (0.0, reach(top)),
            z if z < 0.0 => (reach(top).max(0.0), reach(bottom)),
            _ => (0.0, f64::INFINITY),
        };
        let period = self.patch.period;
        let start = (o + from * d).truncate();
        let mut cell = ((start - self.low) / period).floor();
        let step = DVec2::new(d.x.signum(), d.y.signum());
        for _ in 0..MOST_PERIODS {
            let found = f(cell * period);
            if found.is_some() {
                return found;
            }
            // Where the line leaves this period.
            let edge = self.low + (cell + step.max(DVec2::ZERO)) * period;
            let leave = |edge: f64, o: f64, d: f64| if d == 0.0 { f64::INFINITY } else { (edge - o) / d };
            let (x, y) = (leave(edge.x, o.x, d.x), leave(edge.y, o.y, d.y));
            if x.min(y) > to {
                return None;
            }
            if x < y {
                cell.x += step.x;
            } else {
                cell.y += step.y;
            }
        }
        None
    }

    /// Does anything stand between a point and a light in another period than that of the mesh?
    fn hidden_beyond(&self, ray: &Ray) -> bool {
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let hit = |off: DVec2| {
            let there = Ray { origin: (o - off.extend(0.0)).as_vec3(), ..*ray };
            (off != DVec2::ZERO && self.patch.bvh.occluded(&there, f32::INFINITY)).then_some(())
        };
        self.along(o, d, hit).is_some()
    }

    /// The first surface point on a line.
    fn closest(&self, o: DVec3, d: DVec3) -> Option<Vertex<'a>> {
        let d = d.normalize();
        let hit = |off: DVec2| {
            let ray = Ray { origin: (o - off.extend(0.0)).as_vec3(), direction: d.as_vec3() };
            let hit = self.patch.bvh.closest(&ray, f32::INFINITY)?;
            Some(self.vertex(d, &self.patch.mesh.surface(&hit)))
        };
        self.along(o, d, hit)
    }

    /// A point of the surface, in the period of the mesh. Where the interpolated normal turns away from the
    /// path, the triangle's own takes its place.
    fn vertex(&self, d: DVec3, s: &Surface) -> Vertex<'a> {
        let side = s.geometric_normal.as_dvec3();
        let smooth = s.normal.as_dvec3().normalize();
        let normal = if smooth.dot(d) < 0.0 { smooth } else { side };
        let frame = Frame::from_normal_tangent(normal, s.tangent.truncate().as_dvec3());
        Vertex {
            position: s.position.as_dvec3(),
            side,
            wo: frame.to_local(-d),
            frame,
            brdf: self.patch.brdf,
            tint: self.patch.tint.map_or([1.0; 3], |tint| tint(s)),
        }
    }
}

//! Paths: light sampling and reflectance sampling, combined at every vertex.

use super::PathScene;
use super::random::Random;
use super::sampler::Sampler;
use glam::DVec3;
use steradian_brdf::Brdf;
use steradian_scene::{Ray, Surface};
use steradian_sphere::Frame;

/// A point that reflects.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex<'a> {
    /// Position, metres.
    pub position: DVec3,
    /// Geometric normal, on the frame's side: rays start on the side that they leave to.
    pub side: DVec3,
    /// Shading frame.
    pub frame: Frame,
    /// Local direction to where the path came from.
    pub wo: DVec3,
    /// Reflectance.
    pub brdf: &'a dyn Brdf,
    /// Multiplies it.
    pub tint: [f64; 3],
}

/// Follows paths through one scene.
pub(super) struct Tracer<'a> {
    pub scene: &'a PathScene<'a>,
    pub sampler: Sampler<'a>,
}

impl<'a> Tracer<'a> {
    /// Radiance along a ray: light reflected at most `bounces` times where it hits a surface, else distant
    /// light.
    pub fn along(&self, ray: &Ray, bounces: u32, random: &mut Random) -> [f64; 3] {
        match self.hit(ray) {
            Some(v) => self.reflected(v, bounces, random),
            None => self.sampler.at(ray.direction.as_dvec3().normalize()).0,
        }
    }

    /// Radiance of the surface that a ray meets, `None` where it meets none; and whether it is met from
    /// behind.
    pub fn arriving(&self, ray: &Ray, bounces: u32, random: &mut Random) -> (Option<[f64; 3]>, bool) {
        let Some(hit) = self.scene.bvh.closest(ray, f32::INFINITY) else { return (None, false) };
        let surface = self.scene.mesh.surface(&hit);
        let behind = surface.geometric_normal.dot(ray.direction) > 0.0;
        let light = self.vertex(ray, &surface).map_or([0.0; 3], |v| self.reflected(v, bounces, random));
        (Some(light), behind)
    }

    fn hit(&self, ray: &Ray) -> Option<Vertex<'a>> {
        let hit = self.scene.bvh.closest(ray, f32::INFINITY)?;
        self.vertex(ray, &self.scene.mesh.surface(&hit))
    }

    /// The vertex at a ray's hit; `None` where nothing is reflected.
    fn vertex(&self, ray: &Ray, s: &Surface) -> Option<Vertex<'a>> {
        let frame =
            Frame::from_normal_tangent(s.normal.as_dvec3().normalize(), s.tangent.truncate().as_dvec3());
        let materials = self.scene.materials;
        let brdf = materials.get(s.material as usize).or(materials.first())?;
        Some(Vertex {
            position: s.position.as_dvec3(),
            side: s.geometric_normal.as_dvec3(),
            wo: frame.to_local(-ray.direction.as_dvec3()),
            frame,
            brdf: brdf.as_ref(),
            tint: self.scene.tint.map_or([1.0; 3], |tint| tint(s)),
        })
    }

    /// Radiance that leaves a vertex after `bounces` reflections at most.
    pub fn reflected(&self, mut v: Vertex<'a>, bounces: u32, random: &mut Random) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut throughput = [1.0; 3];
        for bounce in 0..bounces {
            if v.wo.is_nan() || v.wo.z <= 0.0 {
                break;
            }
            let lit = self.by_light(&v, random);
            add(&mut sum, lit, std::array::from_fn(|c| throughput[c] * v.tint[c]));
            let Some(drawn) = v.brdf.sample(v.wo, random.pair()) else { break };
            if !(drawn.pdf > 0.0 && drawn.pdf.is_finite()) {
                break;
            }
            let f = v.brdf.f_cos(drawn.wi, v.wo).map(|f| f / drawn.pdf);
            if f.iter().any(|x| !x.is_finite()) || f == [0.0; 3] {
                break;
            }
            throughput = std::array::from_fn(|c| throughput[c] * f[c] * v.tint[c]);
            let d = v.frame.to_world(drawn.wi);
            match self.hit(&self.ray(&v, d)) {
                Some(next) if bounce + 1 < bounces => v = next,
                Some(_) => break,
                None => {
                    let (l, pdf) = self.sampler.at(d);
                    add(&mut sum, l.map(|x| x * drawn.pdf / (drawn.pdf + pdf)), throughput);
                    break;
                }
            }
        }
        sum
    }

    /// One distant light sample, weighed against reflectance sampling by the balance heuristic (Veach 1997,
    /// eq. 9.8), and every directional and point light.
    fn by_light(&self, v: &Vertex<'_>, random: &mut Random) -> [f64; 3] {
        let mut sum = [0.0; 3];
        if let Some(d) = self.sampler.sample(random.next(), random.pair()) {
            let wi = v.frame.to_local(d);
            let (l, pdf) = self.sampler.at(d);
            let weight = 1.0 / (pdf + v.brdf.pdf(wi, v.wo));
            if weight.is_finite() {
                self.lit(&mut sum, v, d, f64::INFINITY, l.map(|x| x * weight));
            }
        }
        for light in &self.scene.lights.directionals {
            self.lit(&mut sum, v, light.direction.normalize_or_zero(), f64::INFINITY, light.irradiance);
        }
        for light in &self.scene.lights.points {
            let to = light.position.as_dvec3() - v.position;
            let d2 = to.length_squared();
            if d2 > 0.0 {
                let e = light.intensity.map(|i| f64::from(i) / d2);
                self.lit(&mut sum, v, to / d2.sqrt(), d2.sqrt(), e);
            }
        }
        sum
    }

    /// Adds f_cos · E from world direction `d` where nothing stands within `distance`.
    fn lit(&self, sum: &mut [f64; 3], v: &Vertex<'_>, d: DVec3, distance: f64, e: [f64; 3]) {
        let f = v.brdf.f_cos(v.frame.to_local(d), v.wo);
        let seen = |f: &[f64; 3]| *f != [0.0; 3] && f.iter().all(|x| x.is_finite());
        if seen(&f) && !self.scene.bvh.occluded(&self.ray(v, d), (distance - self.scene.offset) as f32) {
            add(sum, f, e);
        }
    }

    /// The ray that leaves a vertex towards `d`, off the surface by the scene's offset.
    fn ray(&self, v: &Vertex<'_>, d: DVec3) -> Ray {
        let side = if d.dot(v.side) < 0.0 { -v.side } else { v.side };
        Ray { origin: (v.position + side * self.scene.offset).as_vec3(), direction: d.as_vec3().normalize() }
    }
}

fn add(sum: &mut [f64; 3], a: [f64; 3], b: [f64; 3]) {
    for c in 0..3 {
        sum[c] += a[c] * b[c];
    }
}

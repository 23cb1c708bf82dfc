//! Shadows of an environment by rays over the reflectance's lobe.
//!
//! Of the directions that the reflectance draws for a point, of density p and with V each, the radiance L_open without shadows
//! is multiplied by the ratio
//!
//! > Σ V L f_cos/p / Σ L f_cos/p
//!
//! (Heitz, Hill & McGuire 2018, *Combining Analytic Direct Illumination and Stochastic Shadows*, with the technique's prefiltered
//! light as their analytic one), so that points that see all keep what the technique gives. The reference takes L_open
//! where nothing is blocked, and elsewhere the sum Σ V L f_cos/p over more directions as the integral itself.

use super::Shader;
use glam::{DVec3, Vec3};
use std::sync::Arc;
use steradian_base::{Cancelled, Task};
use steradian_brdf::SharedBrdf;
use steradian_light::Environment;
use steradian_reference::path::PathScene;
use steradian_scene::{Bvh, Ray};
use steradian_sphere::Frame;
use steradian_sphere::sampling::R2;
use steradian_techniques::direct::{Direct, Shadows};
use steradian_techniques::{Points, PointsBuf, Radiance};

/// Directions at a point at first, and where one of these is blocked.
const RAYS: [usize; 2] = [64, 128];
/// The same under the reference.
const REFERENCE_RAYS: [usize; 2] = [64, 512];

/// A shader of unshadowed light, behind what a mesh blocks, and suns beside it that the mesh shadows.
pub struct LobeShadowShader {
    /// Radiance that the environment alone gives, without shadows.
    pub open: Arc<dyn Shader>,
    /// The environment; without one all directions weigh alike.
    pub light: Option<Arc<Environment>>,
    /// Is this the reference? Then directions are more, and their sum is the integral where something is blocked.
    pub reference: bool,
    /// Suns and other lights.
    pub direct: Direct,
    /// The reflectance.
    pub brdf: SharedBrdf,
    /// What blocks; both sides of a triangle do.
    pub bvh: Arc<Bvh>,
}

/// Sums over directions, per channel.
struct Sums {
    /// Without shadows.
    all: [f64; 3],
    /// Of the directions that see the light.
    seen: [f64; 3],
    /// Directions.
    rays: usize,
    /// Is one of them blocked?
    blocked: bool,
}

impl Sums {
    fn share(&self) -> [f64; 3] {
        let share = |c: usize| if self.all[c] > 0.0 { self.seen[c] / self.all[c] } else { 1.0 };
        if self.blocked { [0, 1, 2].map(share) } else { [1.0; 3] }
    }
}

impl LobeShadowShader {
    fn sums(&self, position: DVec3, frame: &Frame, wo: DVec3) -> Sums {
        let local = frame.to_local(wo);
        let mut out = Sums { all: [0.0; 3], seen: [0.0; 3], rays: 0, blocked: false };
        for n in if self.reference { REFERENCE_RAYS } else { RAYS } {
            for k in out.rays..n {
                // The same numbers at every point, so that shadows have no noise.
                let u = R2::default().point(k as u32 + 1);
                let Some(s) = self.brdf.sample(local, u).filter(|s| s.pdf > 0.0) else {
                    continue;
                };
                let f = self.brdf.f_cos(s.wi, local);
                if f == [0.0; 3] {
                    continue;
                }
                let d = frame.to_world(s.wi);
                let light = self.light.as_ref().map_or([1.0; 3], |e| e.image.bilinear(d));
                let sees = self.sees(position, frame.n, d);
                out.blocked |= !sees;
                for c in 0..3 {
                    let weight = f64::from(light[c]).max(0.0) * f[c].max(0.0) / s.pdf;
                    out.all[c] += weight;
                    out.seen[c] += if sees { weight } else { 0.0 };
                }
            }
            out.rays = n;
            if !out.blocked {
                break;
            }
        }
        out
    }

    fn sees(&self, position: DVec3, normal: DVec3, d: DVec3) -> bool {
        let origin = (position + normal * PathScene::OFFSET).as_vec3();
        !self.bvh.occluded(&Ray { origin, direction: d.as_vec3().normalize() }, f32::INFINITY)
    }

    /// What points see; nothing is blocked where they face away.
    fn seen(&self, q: &Points<'_>) -> Vec<Sums> {
        let at = |v: &[&[f32]; 3], i: usize| DVec3::from_array(v.map(|c| f64::from(c[i])));
        let one = |i: usize| {
            let (n, wo) = (at(&q.n, i).normalize_or_zero(), at(&q.wo, i).normalize_or_zero());
            if n.dot(wo) <= 0.0 {
                return Sums { all: [0.0; 3], seen: [0.0; 3], rays: 0, blocked: false };
            }
            let frame = match q.t[0].is_empty() {
                true => Frame::from_normal(n),
                false => Frame::from_normal_tangent(n, at(&q.t, i)),
            };
            self.sums(at(&q.p, i), &frame, wo)
        };
        (0..q.len()).map(one).collect()
    }

    /// The integral: by the open shader where nothing is blocked.
    fn integral(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        let seen = self.seen(q);
        let at = |v: &[&[f32]; 3], i: usize| Vec3::from_array(v.map(|c| c[i]));
        let open: Vec<usize> = (0..q.len()).filter(|&i| !seen[i].blocked).collect();
        let mut points = PointsBuf::with_capacity(open.len());
        open.iter().for_each(|&i| points.push(at(&q.n, i), at(&q.t, i), at(&q.wo, i), at(&q.p, i)));
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; open.len()]);
        self.open.shade(&points.as_points(), &mut Radiance::of(&mut rgb), task)?;
        for c in 0..3 {
            for (i, s) in seen.iter().enumerate().filter(|(_, s)| s.blocked) {
                out.rgb[c][i] = (s.seen[c] / s.rays as f64) as f32;
            }
            open.iter().zip(&rgb[c]).for_each(|(&i, v)| out.rgb[c][i] = *v);
        }
        Ok(())
    }
}

impl Shader for LobeShadowShader {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        // Points with lobes of their own have the ratio of the material's.
        if self.reference && self.light.is_some() && !q.has_lobes() {
            self.integral(q, out, task)?;
        } else {
            self.open.shade(q, out, task)?;
            for (i, s) in self.seen(q).iter().enumerate() {
                let share = s.share();
                (0..3).for_each(|c| out.rgb[c][i] *= share[c] as f32);
            }
        }
        let shadows = Shadows { bvh: &self.bvh, offset: PathScene::OFFSET };
        self.direct.add_behind(Some(shadows), &*self.brdf, q, out);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ReferenceShader;
    use glam::{Affine3A, Vec3};
    use steradian_light::Lights;
    use steradian_reference::path::{PathOptions, PathPoint, PathScene, trace_points};
    use steradian_reference::{Lookup, Reference};
    use steradian_scene::{Mesh, shapes};
    use steradian_techniques::PointsBuf;
    use steradian_techniques::direct::{Suns, split};

    /// A ball on a floor.
    fn mesh() -> Mesh {
        let lift = Affine3A::from_translation(Vec3::Y);
        Mesh::merged(&[
            shapes::by_name("plane:size=20").expect("a shape"),
            shapes::sphere(96).transformed(&lift),
        ])
    }

    /// Points of the floor from the ball outwards, seen from above at 35°.
    fn points() -> PointsBuf {
        let mut q = PointsBuf::with_capacity(12);
        let wo = Vec3::new(0.3, 0.6, 0.75).normalize();
        for k in 0..12 {
            let (s, c) = (0.7 * k as f32).sin_cos();
            let r = 0.15 + 0.2 * k as f32;
            q.push(Vec3::Y, Vec3::X, wo, Vec3::new(r * c, 0.0, r * s));
        }
        q
    }

    fn shaded(shader: &dyn Shader, q: &PointsBuf) -> [Vec<f32>; 3] {
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; 12]);
        shader.shade(&q.as_points(), &mut Radiance::of(&mut rgb), &Task::quiet()).expect("nobody cancels");
        rgb
    }

    fn shader(
        spec: &str,
        mesh: &Mesh,
        lights: &Lights,
        reference: bool,
    ) -> (Arc<dyn Shader>, LobeShadowShader) {
        let brdf = steradian_brdf::parse(spec).expect("a spec");
        let (sky, direct) = split(lights, Suns::Exact);
        let quadrature = Reference::new(&sky, Lookup::Bilinear, &Task::quiet()).expect("light");
        let open: Arc<dyn Shader> = Arc::new(ReferenceShader::new(Arc::new(quadrature), brdf.clone(), 1e-3));
        let (light, bvh) = (sky.environment, Arc::new(Bvh::build(mesh)));
        (open.clone(), LobeShadowShader { open, light, reference, direct, brdf, bvh })
    }

    #[test]
    fn the_integral_behind_what_blocks_is_that_of_paths() {
        let (mesh, q) = (mesh(), points());
        let lights = Lights::of_sky("sky:elevation=30,azimuth=40", (64, 32)).expect("a sky");
        let bvh = Bvh::build(&mesh);
        let (lambert, ggx) = ("lambert:albedo=0.6", "ggx:alpha=0.3,f0=0.5/0.6/0.7");
        // Of 512 directions, and of 128 as a ratio; relative to what is open.
        for (spec, reference, error) in
            [(lambert, true, 0.035), (ggx, true, 0.035), (lambert, false, 0.12), (ggx, false, 0.12)]
        {
            let brdf = steradian_brdf::parse(spec).expect("a spec");
            let scene = PathScene {
                mesh: &mesh,
                bvh: &bvh,
                materials: std::slice::from_ref(&brdf),
                tint: None,
                lights: &lights,
                offset: PathScene::OFFSET,
            };
            let at = |v: &[Vec<f32>; 3], i: usize| DVec3::from_array([0, 1, 2].map(|c| f64::from(v[c][i])));
            let frame = Frame::from_normal_tangent(DVec3::Y, DVec3::X);
            let all: Vec<PathPoint<'_>> = (0..12)
                .map(|i| PathPoint { position: at(&q.p, i), frame, wo: at(&q.wo, i), brdf: &*brdf })
                .collect();
            let options = PathOptions { bounces: 1, samples: 40_000, seed: 3 };
            let truth = trace_points(&scene, &all, options, &Task::quiet()).expect("nobody cancels");
            let (open, shadowed) = shader(spec, &mesh, &lights, reference);
            let (open, got) = (shaded(&*open, &q), shaded(&shadowed, &q));
            let mut darker = 0;
            for (i, e) in truth.iter().enumerate() {
                for c in 0..3 {
                    let (got, noise) = (f64::from(got[c][i]), e.variance[c].sqrt());
                    if false {
                        assert!(
                            (got - e.rgb[c]).abs()
                                < 0.03 * e.rgb[c] + 4.0 * noise + 0.005 * f64::from(open[c][i]),
                            "{spec} {reference} {i} {c}: {got} and {} ± {noise} by paths",
                            e.rgb[c]
                        );
                    }
                    let allowed = 4.0 * noise + error * f64::from(open[c][i]);
                    assert!(
                        (got - e.rgb[c]).abs() < allowed,
                        "{spec} {reference} {i} {c}: {got} and {} ± {noise} by paths",
                        e.rgb[c]
                    );
                    darker += usize::from(got < 0.7 * f64::from(open[c][i]));
                }
            }
            assert!(darker > 5, "{spec}: what blocks is seen in {darker} of 36");
        }
    }

    #[test]
    fn what_sees_all_keeps_its_bits_and_what_sees_nothing_is_black() {
        let q = points();
        let lights = Lights::of_sky("overcast", (32, 16)).expect("a sky");
        let floor = shapes::by_name("plane:size=20").expect("a shape");
        let inside = shapes::sphere(32).transformed(&Affine3A::from_scale(Vec3::splat(8.0)));
        for reference in [true, false] {
            let (open, shadowed) = shader("ggx:alpha=0.3", &floor, &lights, reference);
            assert_eq!(shaded(&*open, &q), shaded(&shadowed, &q));
            let (_, shadowed) = shader("ggx:alpha=0.3", &inside, &lights, reference);
            assert!(shaded(&shadowed, &q).iter().flatten().all(|v| *v == 0.0));
        }
    }
}

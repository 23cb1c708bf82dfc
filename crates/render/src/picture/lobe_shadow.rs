//! Shadows of all light by rays over the reflectance's lobe.
//!
//! The radiance L_open without shadows is multiplied, channel by channel, by the share of it that arrives. With directions, V each,
//! one half drawn by the reflectance and one by the light's brightness, of density p together (the balance heuristic of Veach &
//! Guibas 1995), and what suns and lamps give without shadows (D_open, in closed form) and with them (D, by rays to their disks), this
//! is
//!
//! > (mean V L f_cos/p + D) / (mean L f_cos/p + D_open)
//!
//! (Heitz, Hill & McGuire 2018, *Combining Analytic Direct Illumination and Stochastic Shadows*, with the technique's prefiltered
//! light as their analytic one), so that points that see all keep what the technique gives. The reference has the integral as
//! L_open, more directions, and none of those that techniques get: with their number it tends to the integral with visibility.
//!
//! All points get the same numbers, so that shadows have no noise, and [`Shader::lights_seen`] says where suns' shadows have edges:
//! between them the share may be interpolated, and so may the radiance that it multiplies ([`Shader::factors`]).

use super::Shader;
use super::shader::lights_seen;
use glam::{DVec2, DVec3};
use std::sync::Arc;
use steradian_base::{Cancelled, Task};
use steradian_brdf::SharedBrdf;
use steradian_light::Environment;
use steradian_reference::path::PathScene;
use steradian_scene::{Bvh, Ray};
use steradian_sphere::Frame;
use steradian_sphere::sampling::{R2, SphereDistribution};
use steradian_techniques::direct::{Direct, Shadows};
use steradian_techniques::{Points, Radiance};

/// Directions at a point at first, and where one of these is blocked.
const RAYS: [usize; 2] = [64, 128];
/// The same under the reference, and the first of them in their sequence.
const REFERENCE_RAYS: [usize; 2] = [64, 256];
const REFERENCE_FIRST: usize = 1 << 16;

/// A shader of unshadowed light, behind what a mesh blocks.
pub struct LobeShadowShader {
    open: Arc<dyn Shader>,
    share: LobeShadow,
}

impl LobeShadowShader {
    /// `open` times what `share` says.
    pub fn new(open: Arc<dyn Shader>, share: LobeShadow) -> Self {
        Self { open, share }
    }
}

/// The share of the light that arrives, in place of radiance.
pub struct LobeShadow {
    sky: Option<Sky>,
    reference: bool,
    direct: Direct,
    brdf: SharedBrdf,
    bvh: Arc<Bvh>,
    points: Vec<DVec2>,
}

/// The environment, and directions that are drawn by its brightness.
struct Sky {
    light: Arc<Environment>,
    density: SphereDistribution,
    drawn: Vec<DVec3>,
}

/// Means over directions, per channel.
struct Means {
    /// Without shadows.
    all: [f64; 3],
    /// Of the directions that see the light.
    seen: [f64; 3],
}

/// Directions of one point.
#[derive(Default)]
struct Batch {
    rays: Vec<Ray>,
    weights: Vec<[f64; 3]>,
    blocked: Vec<bool>,
}

impl LobeShadow {
    /// Directions at a point, where one is blocked.
    pub const RAYS: usize = RAYS[1];
    /// The same under the reference.
    pub const REFERENCE_RAYS: usize = REFERENCE_RAYS[1];

    /// What `bvh` blocks of `light` and of the lights of `direct`, as `brdf` sees it; both sides of a triangle block. For the
    /// `reference`, directions are more, and others.
    pub fn new(
        light: Option<Arc<Environment>>,
        direct: Direct,
        brdf: SharedBrdf,
        bvh: Arc<Bvh>,
        reference: bool,
    ) -> Self {
        let (first, count) = match reference {
            true => (REFERENCE_FIRST, REFERENCE_RAYS[1] / 2),
            false => (1, RAYS[1] / 2),
        };
        let points: Vec<DVec2> = (0..count).map(|k| R2::default().point((first + k) as u32)).collect();
        let sky = light.and_then(|light| {
            let density = SphereDistribution::new(&light.image)?;
            let drawn = points.iter().map(|u| density.sample(*u).0).collect();
            Some(Sky { light, density, drawn })
        });
        Self { sky, reference, direct, brdf, bvh, points }
    }

    fn counts(&self) -> [usize; 2] {
        if self.reference { REFERENCE_RAYS } else { RAYS }
    }

    /// The means; `None` where nothing is blocked and they are not `wanted` all the same.
    fn means(
        &self,
        position: DVec3,
        frame: &Frame,
        wo: DVec3,
        wanted: bool,
        batch: &mut Batch,
    ) -> Option<Means> {
        let local = frame.to_local(wo);
        let origin = (position + frame.n * PathScene::OFFSET).as_vec3();
        let (mut out, mut blocked, mut done) = (Means { all: [0.0; 3], seen: [0.0; 3] }, false, 0);
        let Some(sky) = &self.sky else { return wanted.then_some(out) };
        for n in self.counts() {
            batch.rays.clear();
            batch.weights.clear();
            let mut push = |d: DVec3, wi: DVec3, own: f64| {
                let (f, density) = (self.brdf.f_cos(wi, local), 0.5 * (own + sky.density.pdf(d)));
                if f == [0.0; 3] || density <= 0.0 {
                    return;
                }
                let light = sky.light.image.bilinear(d);
                batch.rays.push(Ray { origin, direction: d.as_vec3().normalize() });
                batch.weights.push([0, 1, 2].map(|c| f64::from(light[c]).max(0.0) * f[c].max(0.0) / density));
            };
            for k in done / 2..n / 2 {
                if let Some(s) = self.brdf.sample(local, self.points[k]) {
                    push(frame.to_world(s.wi), s.wi, s.pdf);
                }
                let wi = frame.to_local(sky.drawn[k]);
                push(sky.drawn[k], wi, self.brdf.pdf(wi, local));
            }
            batch.blocked.resize(batch.rays.len(), false);
            self.bvh.occluded_each(&batch.rays, f32::INFINITY, &mut batch.blocked);
            for (weight, hidden) in batch.weights.iter().zip(&batch.blocked) {
                blocked |= hidden;
                for c in 0..3 {
                    out.all[c] += weight[c];
                    out.seen[c] += if *hidden { 0.0 } else { weight[c] };
                }
            }
            done = n;
            if !blocked {
                break;
            }
        }
        let mean = |sum: [f64; 3]| sum.map(|s| s / done as f64);
        (blocked || wanted).then(|| Means { all: mean(out.all), seen: mean(out.seen) })
    }
}

impl Shader for LobeShadow {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        task.check()?;
        let shadows = Shadows { bvh: &self.bvh, offset: PathScene::OFFSET, reference: self.reference };
        // What suns and lamps give without shadows, and with them.
        let direct = [None, Some(shadows)].map(|shadows| {
            let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
            self.direct.add_behind(shadows, &*self.brdf, q, &mut Radiance::of(&mut rgb));
            rgb
        });
        let at = |v: &[&[f32]; 3], i: usize| DVec3::from_array(v.map(|c| f64::from(c[i])));
        let mut batch = Batch::default();
        for i in 0..q.len() {
            out.rgb.iter_mut().for_each(|plane| plane[i] = 1.0);
            let (n, wo) = (at(&q.n, i).normalize_or_zero(), at(&q.wo, i).normalize_or_zero());
            if n.dot(wo) <= 0.0 {
                continue;
            }
            let frame = match q.t[0].is_empty() {
                true => Frame::from_normal(n),
                false => Frame::from_normal_tangent(n, at(&q.t, i)),
            };
            let wanted = (0..3).any(|c| direct[0][c][i] != direct[1][c][i]);
            let Some(m) = self.means(at(&q.p, i), &frame, wo, wanted, &mut batch) else { continue };
            for c in 0..3 {
                let [open, behind] = [0, 1].map(|k| f64::from(direct[k][c][i]));
                let all = m.all[c] + open;
                out.rgb[c][i] = if all > 0.0 { ((m.seen[c] + behind) / all) as f32 } else { 1.0 };
            }
        }
        Ok(())
    }

    /// One direction's.
    fn difference(&self) -> f32 {
        0.5 / self.points.len() as f32
    }
}

impl Shader for LobeShadowShader {
    fn shade(&self, q: &Points<'_>, out: &mut Radiance<'_>, task: &Task) -> Result<(), Cancelled> {
        let mut share: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
        self.share.shade(q, &mut Radiance::of(&mut share), task)?;
        self.open.shade(q, out, task)?;
        for (plane, share) in out.rgb.iter_mut().zip(share) {
            plane.iter_mut().zip(share).for_each(|(v, s)| *v *= s);
        }
        Ok(())
    }

    fn is_textured(&self) -> bool {
        self.open.is_textured()
    }

    fn lights_seen(&self, q: &Points<'_>) -> Vec<u64> {
        lights_seen(&self.share.direct, &self.share.bvh, q)
    }

    fn factors(&self) -> Option<[&dyn Shader; 2]> {
        Some([&*self.open, &self.share])
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
        let quadrature = Reference::new(lights, Lookup::Bilinear, &Task::quiet()).expect("light");
        let open: Arc<dyn Shader> = Arc::new(ReferenceShader::new(Arc::new(quadrature), brdf.clone(), 1e-3));
        let share = LobeShadow::new(sky.environment, direct, brdf, Arc::new(Bvh::build(mesh)), reference);
        (open.clone(), LobeShadowShader::new(open, share))
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

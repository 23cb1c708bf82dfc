//! The model at the vertices once a frame, interpolated at points; `shade.wgsl` interpolates the same values.

use super::VertexAnalytic;
use crate::direct::{Direct, Shadows};
use crate::gpu::{Buffer, Uniform, Value, shadow};
use crate::local::{
    self, Light, LocalBaked, LocalFrame, LocalLights, LocalShading, LocalTechnique, LocalText, PerPoint,
};
use crate::{GpuTechnique, Points, PointsBuf, Radiance};
use glam::{DVec3, Vec3};
use steradian_base::{Certificate, Evidence};
use steradian_brdf::SharedBrdf;
use steradian_scene::Mesh;

pub(super) fn lit(b: &LocalBaked<VertexAnalytic>, frame: &LocalFrame<'_>) -> Box<dyn LocalShading> {
    let brdf = b.material.brdf.clone();
    let Some(mesh) = frame.mesh.filter(|_| !b.params.pixel()) else {
        let direct = frame.lights.direct(frame.view);
        return Box::new(EveryPoint { direct, brdf, per_point: PerPoint::new(b, frame) });
    };
    let (lights, certificate) = (frame.lights.rows(frame.view), b.certificate.clone());
    let mut corners = Corners { groups: groups(frame), lights, certificate };
    let vertices = vertices(mesh, frame.view.eye);
    for g in &mut corners.groups {
        g.at = shaded(&g.direct, &brdf, &vertices);
    }
    let all = frame.lights.direct(frame.view);
    let error = corners.error(mesh, frame.view.eye, |q| shaded(&all, &brdf, q));
    corners.certificate = Certificate::new(error, Evidence::Measured)
        .metric("relative RMS error of radiance at the middles of triangles that face the viewer");
    Box::new(corners)
}

/// Shading at every point, exact.
struct EveryPoint {
    direct: Direct,
    brdf: SharedBrdf,
    per_point: PerPoint<VertexAnalytic>,
}

impl LocalShading for EveryPoint {
    fn add(&self, shadows: Option<Shadows<'_>>, q: &Points<'_>, out: &mut Radiance<'_>) {
        self.direct.add_behind(shadows, &*self.brdf, q, out);
    }

    fn gpu(&self) -> Option<GpuTechnique> {
        self.per_point.gpu()
    }

    fn certificate(&self) -> &Certificate {
        self.per_point.certificate()
    }
}

/// Lights with a common shadow, and the radiance that each vertex reflects of them.
struct Group {
    direct: Direct,
    at: [Vec<f32>; 3],
}

/// Radiance of the vertices.
struct Corners {
    /// One, or one for each of `lights`, in their order.
    groups: Vec<Group>,
    lights: Vec<Light>,
    certificate: Certificate,
}

/// One group of all lights, or where shadows are needed one for each light.
fn groups(frame: &LocalFrame<'_>) -> Vec<Group> {
    let group = |lights: LocalLights| Group { direct: lights.direct(frame.view), at: Default::default() };
    if !frame.shadowed || frame.lights.is_empty() {
        return vec![group(frame.lights.clone())];
    }
    let directional = |d| LocalLights { directionals: vec![d], ..LocalLights::default() };
    let point = |p| LocalLights { points: vec![p], ..LocalLights::default() };
    let directionals = frame.lights.directionals.iter().copied().map(directional);
    directionals.chain(frame.lights.points.iter().copied().map(point)).map(group).collect()
}

/// The vertices of a mesh, seen from `eye`.
fn vertices(mesh: &Mesh, eye: Vec3) -> PointsBuf {
    let mut q = PointsBuf::with_capacity(mesh.positions.len());
    for (v, (&p, &n)) in mesh.positions.iter().zip(&mesh.normals).enumerate() {
        let t = mesh.tangents.get(v).map_or_else(|| conventional(n), |t| t.truncate());
        q.push(n, t, (eye - p).normalize_or_zero(), p);
    }
    q
}

/// The tangent of surfaces that have none.
fn conventional(n: Vec3) -> Vec3 {
    steradian_sphere::Frame::from_normal(n.as_dvec3().normalize_or(DVec3::Z)).t.as_vec3()
}

/// Points of a batch that one core takes at a time.
const BLOCK: usize = 1024;

fn shaded(direct: &Direct, brdf: &SharedBrdf, q: &PointsBuf) -> [Vec<f32>; 3] {
    use steradian_parallel::prelude::*;
    let blocks: Vec<[Vec<f32>; 3]> = (0..q.len().div_ceil(BLOCK))
        .into_par_iter()
        .map(|k| {
            let points = q.slice(k * BLOCK..(k + 1) * BLOCK);
            let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
            direct.add(&**brdf, &points, &mut Radiance::of(&mut rgb));
            rgb
        })
        .collect();
    std::array::from_fn(|c| blocks.iter().flat_map(|b| b[c].iter().copied()).collect())
}

impl Corners {
    /// Relative RMS difference to `exact` at the centres of triangles that face the viewer, with equal
    /// weights.
    fn error(&self, mesh: &Mesh, eye: Vec3, exact: impl Fn(&PointsBuf) -> [Vec<f32>; 3]) -> f64 {
        // Evenly spaced in the order of the mesh; of a closed one about half face the viewer.
        const MAX_TRIANGLES: usize = 4096;
        let step = mesh.triangles.len().div_ceil(MAX_TRIANGLES).max(1);
        let mut q = PointsBuf::default();
        for &corners in mesh.triangles.iter().step_by(step) {
            let mean = |v: &[Vec3]| corners.iter().map(|&k| v[k as usize]).sum::<Vec3>() / 3.0;
            let (p, n) = (mean(&mesh.positions), mean(&mesh.normals).normalize_or_zero());
            let wo = (eye - p).normalize_or_zero();
            if n.dot(wo) > 0.0 {
                q.push(n, conventional(n), wo, p);
                q.locate(glam::Vec2::ZERO, corners, [1.0 / 3.0; 2]);
            }
        }
        let exact = exact(&q);
        let mut own: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
        self.add(None, &q.as_points(), &mut Radiance::of(&mut own));
        let (mut squares, mut energy) = (0.0, 0.0);
        for (a, b) in own.iter().flatten().zip(exact.iter().flatten()) {
            squares += (f64::from(*a) - f64::from(*b)).powi(2);
            energy += f64::from(*b).powi(2);
        }
        if energy > 0.0 { (squares / energy).sqrt() } else { squares.sqrt() }
    }
}

impl Group {
    /// The part of the group's lights that reaches a point: the least of any.
    fn arriving(&self, shadows: Shadows<'_>, p: DVec3, n: DVec3) -> f64 {
        let directional = self.direct.directionals.iter().map(|d| (d.direction, f64::INFINITY));
        let points = self.direct.points.iter().map(|l| l.position.as_dvec3() - p);
        let points = points.map(|to| (to.normalize_or_zero(), to.length()));
        let lights = directional.chain(points).filter(|l| l.0 != DVec3::ZERO);
        lights.map(|(d, distance)| shadows.arriving(p, n, d, distance)).fold(1.0, f64::min)
    }
}

impl LocalShading for Corners {
    fn add(&self, shadows: Option<Shadows<'_>>, q: &Points<'_>, out: &mut Radiance<'_>) {
        let fits = q.is_consistent() && out.rgb.iter().all(|p| p.len() == q.len());
        let sited = q.site.index.iter().all(|s| s.len() == q.len());
        if !fits || !sited || q.site.weight.iter().any(|w| w.len() != q.len()) {
            return;
        }
        let at = |v: &[&[f32]; 3], i: usize| Vec3::from_array(v.map(|s| s[i]));
        for i in 0..q.len() {
            let (n, wo) = (at(&q.n, i), at(&q.wo, i));
            // False for NaN too.
            let facing = n.dot(wo) > 0.0;
            let corners = q.site.index.map(|s| s[i] as usize);
            let [v, w] = q.site.weight.map(|s| s[i]);
            if !facing {
                continue;
            }
            for g in self.groups.iter().filter(|g| corners.iter().all(|&k| k < g.at[0].len())) {
                let part = match shadows.filter(|_| !q.p[0].is_empty()) {
                    Some(shadows) => g.arriving(shadows, at(&q.p, i).as_dvec3(), n.as_dvec3()) as f32,
                    None => 1.0,
                };
                for c in (0..3).filter(|_| part > 0.0) {
                    let [a, b, d] = corners.map(|k| g.at[c][k]);
                    out.rgb[c][i] += part * ((1.0 - v - w) * a + v * b + w * d);
                }
            }
        }
    }

    fn gpu(&self) -> Option<GpuTechnique> {
        let (groups, vertices) = (&self.groups, self.groups.first().map_or(0, |g| g.at[0].len()));
        let corner = |k: usize| groups.iter().flat_map(move |g| [0, 1, 2].map(|c| g.at[c][k]));
        let number = |name, x: usize| Uniform { name, value: Value::F32(x as f32) };
        let text = LocalText {
            module: "".into(),
            tables: Vec::new(),
            uniforms: vec![
                number("local_groups", groups.len()),
                number("local_shadowed", usize::from(groups.len() == self.lights.len())),
            ],
            buffers: vec![Buffer::new(
                "local_corners",
                3 * groups.len(),
                (0..vertices).flat_map(corner).collect(),
            )],
        };
        let run = (include_str!("shade.wgsl"), true);
        let mut technique = local::run_by(VertexAnalytic::CARD.slug, text, &self.lights, run);
        technique.modules.push(shadow::OPEN.into());
        Some(technique)
    }

    fn certificate(&self) -> &Certificate {
        &self.certificate
    }
}

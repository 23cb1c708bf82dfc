//! What a ray finds, ready for shading.

use super::Stage;
use glam::{Vec2, Vec3};
use steradian_scene::{Hit, Ray};
use steradian_sphere::Frame;

/// A surface point under a sample.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    /// Index of the surface.
    pub surface: usize,
    /// Distance.
    pub t: f32,
    /// Unit shading normal, on the viewer's side.
    pub n: Vec3,
    /// Unit geometric normal, on the viewer's side.
    pub ng: Vec3,
    /// Unit tangent.
    pub tangent: Vec3,
    /// Unit direction to the viewer.
    pub wo: Vec3,
    /// Position.
    pub p: Vec3,
    /// Texture coordinates; 0 where the mesh has none.
    pub uv: Vec2,
    /// Texture coordinates per metre of this triangle.
    pub uv_density: f32,
}

/// Smallest n·wo of a shading normal: interpolated normals that turn away from the viewer are bent back.
const GRAZING: f32 = 0.01;

/// The nearest surface point along `ray`.
pub fn find(stage: &Stage<'_>, ray: &Ray) -> Option<Found> {
    let hit = stage.bvh.closest(ray, f32::INFINITY)?;
    let mesh = stage.mesh;
    let corners = mesh.triangles.get(hit.triangle as usize)?.map(|i| i as usize);
    let [a, b, c] = corners.map(|i| mesh.positions[i]);
    let wo = -ray.direction;
    let ng = (b - a).cross(c - a).normalize_or(wo);
    let side = if ng.dot(wo) < 0.0 { -1.0 } else { 1.0 };
    let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
    let n = if mesh.normals.len() == mesh.positions.len() {
        side * mix(corners.map(|i| mesh.normals[i]), weights).normalize_or(ng)
    } else {
        side * ng
    };
    let n = facing(n, wo);
    let (uv, uv_density) = texture_coordinates(stage, corners, &hit, (b - a).cross(c - a).length());
    Some(Found {
        surface: slot(stage, hit.triangle),
        t: hit.t,
        n,
        ng: side * ng,
        tangent: tangent(stage, corners, weights, n),
        wo,
        p: ray.origin + ray.direction * hit.t,
        uv,
        uv_density,
    })
}

fn slot(stage: &Stage<'_>, triangle: u32) -> usize {
    let slot = stage.mesh.materials.get(triangle as usize).copied().unwrap_or(0) as usize;
    slot.min(stage.surfaces.len().saturating_sub(1))
}

fn mix(v: [Vec3; 3], w: [f32; 3]) -> Vec3 {
    v[0] * w[0] + v[1] * w[1] + v[2] * w[2]
}

/// The normal bent towards the viewer so far that n·wo is not below [`GRAZING`].
fn facing(n: Vec3, wo: Vec3) -> Vec3 {
    let c = n.dot(wo);
    if c >= GRAZING {
        return n;
    }
    // Within the plane of n and wo: wo·cos + s·sin has the cosine asked for, s being the unit part of n across wo.
    let across = (n - wo * c).normalize_or_zero();
    if across == Vec3::ZERO {
        return wo;
    }
    wo * GRAZING + across * (1.0 - GRAZING * GRAZING).sqrt()
}

fn tangent(stage: &Stage<'_>, corners: [usize; 3], w: [f32; 3], n: Vec3) -> Vec3 {
    let tangents = &stage.mesh.tangents;
    let n = n.as_dvec3();
    if tangents.len() == stage.mesh.positions.len() {
        let t = mix(corners.map(|i| tangents[i].truncate()), w);
        return Frame::from_normal_tangent(n, t.as_dvec3()).t.as_vec3();
    }
    Frame::from_normal(n).t.as_vec3()
}

fn texture_coordinates(stage: &Stage<'_>, corners: [usize; 3], hit: &Hit, area: f32) -> (Vec2, f32) {
    let uvs = &stage.mesh.uvs;
    if uvs.len() != stage.mesh.positions.len() {
        return (Vec2::ZERO, 0.0);
    }
    let [a, b, c] = corners.map(|i| uvs[i]);
    let uv = a * (1.0 - hit.u - hit.v) + b * hit.u + c * hit.v;
    let density = if area > 0.0 { ((b - a).perp_dot(c - a).abs() / area).sqrt() } else { 0.0 };
    (uv, density)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bent_normals_face_the_viewer_and_stay_unit() {
        let wo = Vec3::Z;
        for n in [Vec3::X, Vec3::NEG_Z, Vec3::new(0.8, 0.0, -0.6), Vec3::new(0.6, 0.0, 0.8)] {
            let b = facing(n, wo);
            assert!((b.length() - 1.0).abs() < 1e-6 && b.dot(wo) >= GRAZING - 1e-6);
        }
        assert_eq!(facing(Vec3::new(0.6, 0.0, 0.8), wo), Vec3::new(0.6, 0.0, 0.8));
    }
}

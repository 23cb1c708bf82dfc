//! Hits of rays, with the attributes that shading needs.

use super::Stage;
use glam::{Vec2, Vec3, Vec4};
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
    /// Unit outward normal as interpolated.
    pub outward: Vec3,
    /// Interpolated tangent and the sign of the bitangent; 0 without tangents.
    pub along: Vec4,
    /// 1 where the viewer sees the outside, else −1.
    pub side: f32,
    /// Change of the normal per metre over this triangle, root mean square over directions.
    pub bend: f32,
    /// Vertex colours; 1 where there are none.
    pub colour: Vec3,
    /// Unit direction to the viewer.
    pub wo: Vec3,
    /// Position.
    pub p: Vec3,
    /// Texture coordinates; 0 where the mesh has none.
    pub uv: Vec2,
    /// Texture coordinates per metre of this triangle.
    pub uv_density: f32,
    /// The triangle's vertices.
    pub corners: [u32; 3],
    /// Weights of the second and third.
    pub weights: [f32; 2],
    /// Small lights that it sees, a bit each ([`super::Shader::lights_seen`]).
    pub lights: u64,
}

/// Least n·wo of a shading normal: interpolated normals that turn away from the viewer are bent back.
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
    let smooth = mesh.normals.len() == mesh.positions.len();
    let outward = if smooth { mix(corners.map(|i| mesh.normals[i]), weights).normalize_or(ng) } else { ng };
    let n = facing(side * outward, wo);
    let bend = if smooth { bend([b - a, c - a], corners.map(|i| mesh.normals[i])) } else { 0.0 };
    let along = along(stage, corners, weights);
    let (uv, uv_density) = texture_coordinates(stage, corners, &hit, (b - a).cross(c - a).length());
    Some(Found {
        surface: slot(stage, hit.triangle),
        t: hit.t,
        n,
        ng: side * ng,
        tangent: tangent(along, n),
        outward,
        along,
        side,
        bend,
        colour: colour(stage, corners, weights),
        wo,
        p: ray.origin + ray.direction * hit.t,
        uv,
        uv_density,
        corners: mesh.triangles[hit.triangle as usize],
        weights: [hit.u, hit.v],
        lights: 0,
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
pub fn facing(n: Vec3, wo: Vec3) -> Vec3 {
    let c = n.dot(wo);
    if c >= GRAZING {
        return n;
    }
    // In the plane of n and wo, wo·cos + s·sin has the wanted cosine, s being the unit part of n
    // perpendicular to wo.
    let across = (n - wo * c).normalize_or_zero();
    if across == Vec3::ZERO {
        return wo;
    }
    wo * GRAZING + across * (1.0 - GRAZING * GRAZING).sqrt()
}

fn along(stage: &Stage<'_>, corners: [usize; 3], w: [f32; 3]) -> Vec4 {
    let tangents = &stage.mesh.tangents;
    if tangents.len() != stage.mesh.positions.len() {
        return Vec4::W;
    }
    corners.map(|i| tangents[i]).iter().zip(w).map(|(t, w)| *t * w).sum()
}

/// `along` projected to the plane of n; where there is none, the tangent of a surface without tangents.
pub fn tangent(along: Vec4, n: Vec3) -> Vec3 {
    Frame::from_normal_tangent(n.as_dvec3(), along.truncate().as_dvec3()).t.as_vec3()
}

/// Frobenius norm of the normal's gradient over √2: with the Gram matrices G of the edges and H of the
/// normals' differences along them, ‖∇n‖² = tr(G⁻¹H).
fn bend(edges: [Vec3; 2], n: [Vec3; 3]) -> f32 {
    let d = [n[1] - n[0], n[2] - n[0]];
    let gram = |v: [Vec3; 2]| [v[0].dot(v[0]), v[0].dot(v[1]), v[1].dot(v[1])];
    let (g, h) = (gram(edges), gram(d));
    let det = g[0] * g[2] - g[1] * g[1];
    let trace = h[0] * g[2] - 2.0 * h[1] * g[1] + h[2] * g[0];
    if det > 0.0 { (0.5 * trace.max(0.0) / det).sqrt() } else { 0.0 }
}

fn colour(stage: &Stage<'_>, corners: [usize; 3], w: [f32; 3]) -> Vec3 {
    let colors = &stage.mesh.colors;
    if colors.len() == stage.mesh.positions.len() { mix(corners.map(|i| colors[i]), w) } else { Vec3::ONE }
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

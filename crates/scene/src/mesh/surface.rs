//! A point of a mesh's surface.

use super::Mesh;
use crate::Hit;
use glam::{Vec2, Vec3, Vec4};

/// Everything that shading needs to know about a point of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Position, from the triangle (not from the ray): metres.
    pub position: Vec3,
    /// Unit shading normal, interpolated.
    pub normal: Vec3,
    /// Unit normal of the triangle's plane, on the side of its counter-clockwise winding.
    pub geometric_normal: Vec3,
    /// Unit tangent perpendicular to the shading normal; w is the sign of the bitangent w · (n × t).
    pub tangent: Vec4,
    /// Texture coordinates, 0 where there are none.
    pub uv: Vec2,
    /// Material slot.
    pub material: u32,
}

impl Mesh {
    /// The surface at a hit of this mesh. Without tangents the frame is that of a surface without tangents.
    pub fn surface(&self, hit: &Hit) -> Surface {
        let i = hit.triangle as usize;
        let t = self.triangles[i].map(|v| v as usize);
        let weights = [1.0 - hit.u - hit.v, hit.u, hit.v];
        let mix = |values: &[Vec3]| (0..3).map(|k| values[t[k]] * weights[k]).sum::<Vec3>();
        let geometric_normal = self.cross(i).normalize_or(glam::DVec3::Y).as_vec3();
        let normal = mix(&self.normals).normalize_or(geometric_normal);
        let (along, sign) = if self.tangents.is_empty() {
            (Vec3::ZERO, 1.0)
        } else {
            let sum: Vec4 = (0..3).map(|k| self.tangents[t[k]] * weights[k]).sum();
            (sum.truncate(), if sum.w < 0.0 { -1.0 } else { 1.0 })
        };
        let uv =
            if self.uvs.is_empty() { Vec2::ZERO } else { (0..3).map(|k| self.uvs[t[k]] * weights[k]).sum() };
        Surface {
            position: mix(&self.positions),
            normal,
            geometric_normal,
            tangent: super::tangents::orthogonal(normal, along).extend(sign),
            uv,
            material: self.material(i),
        }
    }
}

//! Meshes of surfaces given by two parameters.

use crate::Mesh;
use glam::{DVec3, Vec2};

/// A point of a surface and its frame.
#[derive(Debug, Clone, Copy)]
pub struct Sample {
    /// Position.
    pub p: DVec3,
    /// Unit normal, outward.
    pub n: DVec3,
    /// Direction of growing u in the surface; need not be unit.
    pub t: DVec3,
}

/// Tessellation of a parametric surface.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    /// Cells along u.
    pub nu: u32,
    /// Cells along v.
    pub nv: u32,
    /// Does u = 1 meet u = 0?
    pub wrap_u: bool,
    /// Does v = 1 meet v = 0?
    pub wrap_v: bool,
    /// Texture coordinates at the first corner.
    pub uv_min: [f64; 2],
    /// Texture coordinates at the opposite corner.
    pub uv_max: [f64; 2],
}

impl Grid {
    /// `nu` × `nv` cells, texture coordinates from 0 to 1, closed in neither direction.
    pub fn new(nu: u32, nv: u32) -> Self {
        Self {
            nu: nu.max(1),
            nv: nv.max(1),
            wrap_u: false,
            wrap_v: false,
            uv_min: [0.0; 2],
            uv_max: [1.0; 2],
        }
    }

    /// Appends the surface `f` on the unit square. As seen from outside u grows to the right and v downwards,
    /// so that the bitangent's sign is +1. Cells that collapse at a pole lose a triangle.
    pub fn append(&self, mesh: &mut Mesh, f: impl Fn(f64, f64) -> Sample) {
        let first = mesh.positions.len() as u32;
        let at = |i: u32, n: u32, wrap: bool| if wrap && i == n { 0.0 } else { f64::from(i) / f64::from(n) };
        for j in 0..=self.nv {
            for i in 0..=self.nu {
                // Both sides of a seam have bitwise equal positions.
                let s = f(at(i, self.nu, self.wrap_u), at(j, self.nv, self.wrap_v));
                let t = (s.t - s.n * s.n.dot(s.t)).normalize_or(s.n.any_orthonormal_vector());
                mesh.positions.push(s.p.as_vec3());
                mesh.normals.push(s.n.as_vec3());
                mesh.tangents.push(t.as_vec3().extend(1.0));
                let uv = [(i, self.nu, 0), (j, self.nv, 1)].map(|(i, n, k)| {
                    let x = f64::from(i) / f64::from(n);
                    (self.uv_min[k] + x * (self.uv_max[k] - self.uv_min[k])) as f32
                });
                mesh.uvs.push(Vec2::from(uv));
            }
        }
        for j in 0..self.nv {
            for i in 0..self.nu {
                let a = first + j * (self.nu + 1) + i;
                let (b, c, d) = (a + 1, a + self.nu + 1, a + self.nu + 2);
                self.triangle(mesh, [a, c, b]);
                self.triangle(mesh, [b, c, d]);
            }
        }
    }

    fn triangle(&self, mesh: &mut Mesh, t: [u32; 3]) {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        if a != b && b != c && c != a {
            mesh.triangles.push(t);
        }
    }
}

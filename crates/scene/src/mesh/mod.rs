//! Indexed triangle meshes.

mod clean;
mod normals;
mod split;
mod surface;
mod tangents;

pub use clean::{MeshReport, Repairs};
pub use split::{Edge, edge};
pub use surface::Surface;

use glam::{Affine3A, Mat3A, Vec2, Vec3, Vec3A, Vec4};

/// An indexed triangle mesh with normals and tangents at every vertex.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, metres.
    pub positions: Vec<Vec3>,
    /// Unit vertex normals.
    pub normals: Vec<Vec3>,
    /// Unit tangents; w is the sign of the bitangent: b = w · (n × t). Empty until made.
    pub tangents: Vec<Vec4>,
    /// Texture coordinates, v downwards (glTF). Empty where the mesh has none.
    pub uvs: Vec<Vec2>,
    /// Linear RGB at every vertex, which multiplies the base colour. Empty where the mesh has none.
    pub colors: Vec<Vec3>,
    /// Three vertex indices a triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Material slot of each triangle; empty where there is one material.
    pub materials: Vec<u32>,
}

impl Mesh {
    /// The smallest and largest coordinates of all vertices that triangles use; `None` without triangles.
    pub fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let used = || self.triangles.iter().flatten().map(|&i| self.positions[i as usize]);
        let first = used().next()?;
        Some(used().fold((first, first), |(lo, hi), p| (lo.min(p), hi.max(p))))
    }

    /// Length of the bounding box's diagonal, metres; 0 without triangles.
    pub fn diagonal(&self) -> f32 {
        self.bounds().map_or(0.0, |(lo, hi)| (hi - lo).length())
    }

    /// Sum of the triangles' areas, m².
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|i| 0.5 * self.cross(i).length()).sum()
    }

    /// Twice the signed area of triangle `i` along its outward normal: (b − a) × (c − a).
    fn cross(&self, i: usize) -> glam::DVec3 {
        let [a, b, c] = self.triangles[i].map(|v| self.positions[v as usize].as_dvec3());
        (b - a).cross(c - a)
    }

    /// The three corners of triangle `i`.
    pub fn corners(&self, i: usize) -> [Vec3; 3] {
        self.triangles[i].map(|v| self.positions[v as usize])
    }

    /// The mesh after an affine map: normals go by the inverse transpose, and one that mirrors turns the
    /// winding and the bitangent over.
    pub fn transformed(mut self, map: &Affine3A) -> Self {
        let m = map.matrix3;
        // The cofactors are det · inverse transpose, and exist for singular maps too.
        let cofactors =
            Mat3A::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
        let sign = if m.determinant() < 0.0 { -1.0 } else { 1.0 };
        self.positions.iter_mut().for_each(|p| *p = map.transform_point3(*p));
        self.normals
            .iter_mut()
            .for_each(|n| *n = Vec3::from(cofactors * Vec3A::from(*n) * sign).normalize_or(*n));
        for (t, n) in self.tangents.iter_mut().zip(&self.normals) {
            let along = map.transform_vector3(t.truncate());
            *t = tangents::orthogonal(*n, along).extend(t.w * sign);
        }
        if sign < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        self
    }

    /// The meshes as one. Texture coordinates and tangents survive where every mesh has them, colours and
    /// material slots where any has.
    pub fn merged(meshes: &[Self]) -> Self {
        let with = |f: fn(&Self) -> bool| !meshes.is_empty() && meshes.iter().all(f);
        let (uvs, tangents) = (with(|m| !m.uvs.is_empty()), with(|m| !m.tangents.is_empty()));
        let materials = meshes.iter().any(|m| !m.materials.is_empty());
        let colors = meshes.iter().any(|m| !m.colors.is_empty());
        let mut out = Self::default();
        for m in meshes {
            let first = out.positions.len() as u32;
            out.positions.extend_from_slice(&m.positions);
            out.normals.extend_from_slice(&m.normals);
            out.triangles.extend(m.triangles.iter().map(|t| t.map(|i| i + first)));
            if uvs {
                out.uvs.extend_from_slice(&m.uvs);
            }
            if tangents {
                out.tangents.extend_from_slice(&m.tangents);
            }
            if colors {
                out.colors.extend_from_slice(&m.colors);
                out.colors.resize(out.positions.len(), Vec3::ONE);
            }
            if materials {
                out.materials.extend_from_slice(&m.materials);
                out.materials.resize(out.triangles.len(), 0);
            }
        }
        out
    }

    /// The mesh with every triangle in material slot `slot`.
    pub fn with_material(mut self, slot: u32) -> Self {
        self.materials = vec![slot; self.triangles.len()];
        self
    }

    /// The material slot of triangle `i`: 0 where there is one material.
    pub fn material(&self, i: usize) -> u32 {
        self.materials.get(i).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::sphere;
    use glam::Quat;

    #[test]
    fn the_sphere_has_its_area_and_bounds() {
        let m = sphere(256);
        assert!((m.area() / (4.0 * std::f64::consts::PI) - 1.0).abs() < 2e-4);
        assert_eq!(m.bounds(), Some((-Vec3::ONE, Vec3::ONE)));
        assert_eq!(Mesh::default().bounds(), None);
    }

    #[test]
    fn ellipsoids_keep_normals_perpendicular_and_outward_even_mirrored() {
        let q = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 1.0, -0.7);
        for scale in [Vec3::new(1.0, 3.0, 0.5), Vec3::new(-1.0, 3.0, 0.5)] {
            let map = Affine3A::from_scale_rotation_translation(scale, q, Vec3::new(1.0, 2.0, 3.0));
            let m = sphere(48).transformed(&map);
            let inverse = map.inverse();
            for ((p, n), t) in m.positions.iter().zip(&m.normals).zip(&m.tangents) {
                // The gradient of |A⁻¹p|² points along the normal.
                let g = inverse.matrix3.transpose() * Vec3A::from(inverse.transform_point3(*p));
                assert!((Vec3::from(g).normalize() - *n).length() < 1e-5);
                assert!(t.truncate().dot(*n).abs() < 1e-5);
            }
            for (i, t) in m.triangles.iter().enumerate() {
                assert!(m.cross(i).as_vec3().dot(m.normals[t[0] as usize]) > 0.0);
            }
        }
    }

    #[test]
    fn merging_shifts_indices_and_fills_material_slots() {
        let m = Mesh::merged(&[sphere(8), sphere(8).with_material(3)]);
        let half = sphere(8).triangles.len();
        assert_eq!((m.material(0), m.material(half)), (0, 3));
        assert_eq!(m.corners(0), m.corners(half));
        assert_eq!(m.uvs.len(), m.positions.len());
    }
}

//! Tangents: MikkTSpace where there are texture coordinates, a brushing direction where there are none.

use super::Mesh;
use glam::{Vec3, Vec4};
use steradian_sphere::Frame;

/// `v` projected to the plane of the unit normal `n`, unit length; the frame that a surface without tangents
/// gets where `v` is parallel to `n` or not finite.
pub fn orthogonal(n: Vec3, v: Vec3) -> Vec3 {
    Frame::from_normal_tangent(n.as_dvec3().normalize_or(glam::DVec3::Y), v.as_dvec3()).t.as_vec3()
}

impl Mesh {
    /// Makes the tangents: MikkTSpace where there are texture coordinates, else those of a surface without
    /// tangents (t = normalize(a × n), a = +Y if |n·y| < 0.99 else +X). Vertices whose triangles
    /// disagree about the tangent (mirrored seams) are split; their number is returned.
    pub fn make_tangents(&mut self) -> usize {
        if self.uvs.is_empty() {
            self.tangents = self.normals.iter().map(|n| orthogonal(*n, Vec3::ZERO).extend(1.0)).collect();
            return 0;
        }
        let mut mikk = Mikk { mesh: self, corners: vec![[None; 3]; self.triangles.len()] };
        // The error type has no values.
        let _ = bevy_mikktspace::generate_tangents(&mut mikk);
        let corners = mikk.corners;
        self.adopt(&corners)
    }

    /// Makes tangents of one constant brushing direction, projected to each tangent plane (KSS02, section 6:
    /// brushed metal); where the direction is the normal itself, as in [`Mesh::make_tangents`].
    pub fn brush(&mut self, direction: Vec3) {
        self.tangents = self.normals.iter().map(|n| orthogonal(*n, direction).extend(1.0)).collect();
    }

    /// Stores tangents per corner at the vertices and splits those that need two.
    fn adopt(&mut self, corners: &[[Option<Vec4>; 3]]) -> usize {
        let before = self.positions.len();
        self.tangents = vec![Vec4::ZERO; before];
        // The next copy of each vertex with another tangent: a chain that starts at the vertex itself.
        let mut next = vec![u32::MAX; before];
        for i in 0..self.triangles.len() {
            for k in 0..3 {
                let tangent = corners[i][k].unwrap_or(Vec4::ZERO);
                let at = self.place(self.triangles[i][k], tangent, &mut next);
                self.triangles[i][k] = at;
            }
        }
        for (t, n) in self.tangents.iter_mut().zip(&self.normals) {
            *t = orthogonal(*n, t.truncate()).extend(if t.w < 0.0 { -1.0 } else { 1.0 });
        }
        self.positions.len() - before
    }

    /// The copy of vertex `v` that has this tangent, made where there is none.
    fn place(&mut self, v: u32, tangent: Vec4, next: &mut Vec<u32>) -> u32 {
        let mut at = v as usize;
        loop {
            if self.tangents[at] == Vec4::ZERO {
                self.tangents[at] = tangent;
            }
            if tangent == Vec4::ZERO || self.tangents[at] == tangent {
                return at as u32;
            }
            if next[at] == u32::MAX {
                break;
            }
            at = next[at] as usize;
        }
        let new = self.positions.len() as u32;
        next[at] = new;
        next.push(u32::MAX);
        self.positions.push(self.positions[at]);
        self.normals.push(self.normals[at]);
        self.uvs.push(self.uvs[at]);
        if let Some(c) = self.colors.get(at) {
            self.colors.push(*c);
        }
        self.tangents.push(tangent);
        new
    }
}

/// A mesh as MikkTSpace sees it (Mikkelsen 2008, Simulation of Wrinkled Surfaces Revisited; the reference
/// implementation, ported).
struct Mikk<'a> {
    mesh: &'a Mesh,
    corners: Vec<[Option<Vec4>; 3]>,
}

impl Mikk<'_> {
    fn at(&self, face: usize, vert: usize) -> usize {
        self.mesh.triangles[face][vert] as usize
    }
}

impl bevy_mikktspace::Geometry for Mikk<'_> {
    fn num_faces(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn num_vertices_of_face(&self, _: usize) -> usize {
        3
    }

    fn position(&self, face: usize, vert: usize) -> [f32; 3] {
        self.mesh.positions[self.at(face, vert)].to_array()
    }

    fn normal(&self, face: usize, vert: usize) -> [f32; 3] {
        self.mesh.normals[self.at(face, vert)].to_array()
    }

    fn tex_coord(&self, face: usize, vert: usize) -> [f32; 2] {
        self.mesh.uvs[self.at(face, vert)].to_array()
    }

    fn set_tangent(&mut self, space: Option<bevy_mikktspace::TangentSpace>, face: usize, vert: usize) {
        // MikkTSpace counts v upwards, glTF downwards: the bitangent's sign changes.
        self.corners[face][vert] = space.map(|s| {
            let [x, y, z, w] = s.tangent_encoded();
            Vec4::new(x, y, z, -w)
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::sphere;
    use glam::Vec2;

    #[test]
    fn mikktspace_meets_the_spheres_analytic_tangents() {
        let analytic = sphere(96);
        let mut made = analytic.clone();
        assert_eq!(made.make_tangents(), 0);
        for (i, (a, b)) in analytic.tangents.iter().zip(&made.tangents).enumerate() {
            assert!((*a - *b).length() < 0.04, "{i}: {a} {b}");
        }
    }

    #[test]
    fn a_mirrored_texture_has_the_other_sign_and_its_seam_is_split() {
        // Two squares in z = 0; u runs to the right in the one and to the left in the other.
        let positions =
            [[0., 0.], [1., 0.], [2., 0.], [0., 1.], [1., 1.], [2., 1.]].map(|[x, y]| Vec3::new(x, y, 0.));
        let uvs = [[0., 1.], [1., 1.], [0., 1.], [0., 0.], [1., 0.], [0., 0.]].map(Vec2::from);
        let mut m = Mesh {
            positions: positions.into(),
            normals: vec![Vec3::Z; 6],
            uvs: uvs.into(),
            triangles: vec![[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]],
            ..Mesh::default()
        };
        assert_eq!(m.make_tangents(), 2);
        assert_eq!(m.tangents[0], Vec4::new(1.0, 0.0, 0.0, 1.0));
        assert_eq!(m.tangents[2], Vec4::new(-1.0, 0.0, 0.0, -1.0));
        assert_eq!((m.positions.len(), m.uvs.len(), m.normals.len()), (8, 8, 8));
        // The bitangent points up in the texture on both sides.
        for (t, n) in m.tangents.iter().zip(&m.normals) {
            assert!((n.cross(t.truncate()) * t.w - Vec3::Y).length() < 1e-6);
        }
    }

    #[test]
    fn without_texture_coordinates_and_along_a_brush() {
        let mut m = sphere(24);
        m.uvs.clear();
        m.make_tangents();
        for (t, n) in m.tangents.iter().zip(&m.normals) {
            let want = Frame::from_normal(n.as_dvec3()).t.as_vec3();
            assert!((t.truncate() - want).length() < 1e-6);
        }
        m.brush(Vec3::X);
        for (t, n) in m.tangents.iter().zip(&m.normals) {
            assert!(t.truncate().dot(*n).abs() < 1e-6 && (t.truncate().length() - 1.0).abs() < 1e-5);
            assert!(n.x.abs() > 0.999 || t.x > 0.0);
        }
    }
}

//! Vertex normals.

use super::Mesh;
use glam::{DVec3, Vec3};
use std::collections::HashMap;

/// Vertex normals weighted by the angle of each incident triangle (Thürmer and Wüthrich 1998, Computing
/// Vertex Normals from Polygonal Facets). Vertices at one position share their triangles, so that seams of
/// the texture do not show; where the shared sum vanishes (two sheets back to back) the vertex's own
/// triangles count. Zero where a vertex has no triangle.
pub fn angle_weighted(mesh: &Mesh) -> Vec<Vec3> {
    let own = sums(mesh, None);
    let groups = same_position(&mesh.positions);
    let shared = sums(mesh, Some(&groups));
    own.iter()
        .enumerate()
        .map(|(i, own)| {
            let sum = shared[groups[i] as usize];
            let best = if sum.length_squared() > 1e-12 { sum } else { *own };
            // A vertex without triangles does not borrow a normal from its double: it stays flagged.
            if *own == DVec3::ZERO { Vec3::ZERO } else { best.normalize_or_zero().as_vec3() }
        })
        .collect()
}

fn sums(mesh: &Mesh, groups: Option<&[u32]>) -> Vec<DVec3> {
    let mut out = vec![DVec3::ZERO; mesh.positions.len()];
    for (i, t) in mesh.triangles.iter().enumerate() {
        let normal = mesh.cross(i).normalize_or_zero();
        let p = t.map(|v| mesh.positions[v as usize].as_dvec3());
        for k in 0..3 {
            let (a, b) = (p[(k + 1) % 3] - p[k], p[(k + 2) % 3] - p[k]);
            let angle = a.cross(b).length().atan2(a.dot(b));
            let v = t[k] as usize;
            out[groups.map_or(v, |g| g[v] as usize)] += normal * angle;
        }
    }
    out
}

/// For each vertex the first one at the same position (bit for bit; −0 is 0).
pub fn same_position(positions: &[Vec3]) -> Vec<u32> {
    let mut first: HashMap<[u32; 3], u32> = HashMap::with_capacity(positions.len());
    let key = |p: &Vec3| (*p + Vec3::ZERO).to_array().map(f32::to_bits);
    (0u32..).zip(positions).map(|(i, p)| *first.entry(key(p)).or_insert(i)).collect()
}

/// Gives every triangle vertices of its own with its plane's normal; other data are copied.
pub fn split_flat(mesh: &mut Mesh) {
    let corners: Vec<usize> = mesh.triangles.iter().flatten().map(|&i| i as usize).collect();
    let normals: Vec<Vec3> =
        (0..mesh.triangles.len()).map(|i| mesh.cross(i).normalize_or_zero().as_vec3()).collect();
    mesh.positions = corners.iter().map(|&i| mesh.positions[i]).collect();
    if !mesh.uvs.is_empty() {
        mesh.uvs = corners.iter().map(|&i| mesh.uvs[i]).collect();
    }
    if !mesh.colors.is_empty() {
        mesh.colors = corners.iter().map(|&i| mesh.colors[i]).collect();
    }
    if !mesh.tangents.is_empty() {
        mesh.tangents = corners.iter().map(|&i| mesh.tangents[i]).collect();
    }
    mesh.normals = normals.iter().flat_map(|n| [*n; 3]).collect();
    mesh.triangles = (0..normals.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::sphere;

    /// A cube of eight vertices: each normal is a diagonal, however its faces are cut.
    #[test]
    fn a_cubes_normals_are_its_diagonals() {
        let mut m = Mesh::default();
        for i in 0..8u32 {
            m.positions.push(Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0);
        }
        for [a, b, c, d] in
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
        {
            m.triangles.extend([[a, b, c], [a, c, d]]);
        }
        for (n, p) in angle_weighted(&m).iter().zip(&m.positions) {
            assert!((*n - p.normalize()).length() < 1e-6, "{n} {p}");
        }
        split_flat(&mut m);
        assert_eq!((m.positions.len(), m.triangles.len()), (36, 12));
        assert!(m.normals.iter().zip(&m.positions).all(|(n, p)| n.dot(*p) > 0.99 && n.length() > 0.99));
    }

    #[test]
    fn a_spheres_normals_tend_to_its_radii_across_the_seam() {
        let m = sphere(128);
        let worst =
            angle_weighted(&m).iter().zip(&m.normals).map(|(a, b)| (*a - *b).length()).fold(0.0, f32::max);
        assert!(worst < 2e-3, "{worst}");
    }

    #[test]
    fn two_sheets_back_to_back_keep_their_own_normals() {
        let p = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let m = Mesh { positions: [p, p].concat(), triangles: vec![[0, 1, 2], [3, 5, 4]], ..Mesh::default() };
        let n = angle_weighted(&m);
        assert_eq!((n[0], n[3]), (Vec3::Z, Vec3::NEG_Z));
    }
}

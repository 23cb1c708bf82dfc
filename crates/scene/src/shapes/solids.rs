//! Shapes with edges, and the icosphere.

use super::grid::{Grid, Sample};
use crate::Mesh;
use glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::f64::consts::TAU;

/// A square of side `size` in the plane y = `height`, facing +Y, cut into `segments`² cells. Texture: u to
/// +X, v to +Z.
pub fn plane(size: f64, height: f64, segments: u32) -> Mesh {
    let mut mesh = Mesh::default();
    quad(&mut mesh, segments, DVec3::Y * height, DVec3::X * size, DVec3::Z * size, [0.0; 2], [1.0; 2]);
    mesh
}

/// The axis-parallel box of the given size about the origin, each face with its own vertices, cut into
/// `segments`² cells.
pub fn cuboid(size: [f64; 3], segments: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let size = DVec3::from(size);
    // Seen from outside: u to the right, v down.
    for (n, u, v) in [
        (DVec3::X, DVec3::NEG_Z, DVec3::NEG_Y),
        (DVec3::NEG_X, DVec3::Z, DVec3::NEG_Y),
        (DVec3::Y, DVec3::X, DVec3::Z),
        (DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z),
        (DVec3::Z, DVec3::X, DVec3::NEG_Y),
        (DVec3::NEG_Z, DVec3::NEG_X, DVec3::NEG_Y),
    ] {
        quad(&mut mesh, segments, 0.5 * size * n, u * size, v * size, [0.0; 2], [1.0; 2]);
    }
    mesh
}

/// A parallelogram about `centre` with the sides `u` and `v`.
fn quad(mesh: &mut Mesh, n: u32, centre: DVec3, u: DVec3, v: DVec3, uv_min: [f64; 2], uv_max: [f64; 2]) {
    let grid = Grid { uv_min, uv_max, ..Grid::new(n, n) };
    let normal = v.cross(u).normalize_or(DVec3::Y);
    grid.append(mesh, |a, b| Sample { p: centre + u * (a - 0.5) + v * (b - 0.5), n: normal, t: u });
}

/// The closed cylinder about +Y, centred at the origin: `segments` cells around, as many cells along the
/// height as keep them square, caps of rings.
pub fn cylinder(radius: f64, height: f64, segments: u32) -> Mesh {
    let n = segments.max(3);
    let side = TAU * radius / f64::from(n);
    let mut mesh = Mesh::default();
    let rows = (height / side).ceil().clamp(1.0, 4096.0) as u32;
    let ring = |u: f64| {
        let (s, c) = (-TAU * u).sin_cos();
        (DVec3::new(c, 0.0, s), DVec3::new(s, 0.0, -c))
    };
    Grid { wrap_u: true, ..Grid::new(n, rows) }.append(&mut mesh, |u, v| {
        let (n, t) = ring(u);
        Sample { p: n * radius + DVec3::Y * (height * (0.5 - v)), n, t }
    });
    // Caps: v from the centre to the rim above, from the rim to the centre below.
    let rings = (radius / side).ceil().clamp(1.0, 4096.0) as u32;
    for up in [1.0, -1.0] {
        Grid { wrap_u: true, ..Grid::new(n, rings) }.append(&mut mesh, |u, v| {
            let (r, t) = ring(u);
            let reach = if up > 0.0 { v } else { 1.0 - v };
            Sample { p: r * (radius * reach) + DVec3::Y * (0.5 * height * up), n: DVec3::Y * up, t }
        });
    }
    mesh.compact();
    mesh
}

/// The unit sphere from an icosahedron whose triangles are cut in four `level` times: nearly equal triangles,
/// no poles, no texture coordinates. 20·4^level triangles.
pub fn icosphere(level: u32) -> Mesh {
    let g = 0.5 * (1.0 + 5.0f64.sqrt());
    let mut points: Vec<DVec3> = Vec::new();
    for s in [-1.0, 1.0] {
        for t in [-g, g] {
            points.extend([DVec3::new(0.0, s, t), DVec3::new(s, t, 0.0), DVec3::new(t, 0.0, s)]);
        }
    }
    points.iter_mut().for_each(|p| *p = p.normalize());
    // The faces are the triples of mutual neighbours.
    let near = |a: usize, b: usize| points[a].distance(points[b]) < 1.1;
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = points[a].dot(points[b].cross(points[c])) > 0.0;
                    let (b, c) = if outward { (b, c) } else { (c, b) };
                    triangles.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    for _ in 0..level {
        triangles = subdivide(&mut points, &triangles);
    }
    let positions: Vec<Vec3> = points.iter().map(|p| p.as_vec3()).collect();
    Mesh {
        normals: positions.iter().map(|p| p.normalize()).collect(),
        positions,
        triangles,
        ..Mesh::default()
    }
}

/// Cuts every triangle in four; new vertices lie on the unit sphere.
fn subdivide(points: &mut Vec<DVec3>, triangles: &[[u32; 3]]) -> Vec<[u32; 3]> {
    let mut middles: HashMap<(u32, u32), u32> = HashMap::with_capacity(triangles.len() * 3 / 2);
    let mut middle = |a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            points.push((points[a as usize] + points[b as usize]).normalize());
            points.len() as u32 - 1
        })
    };
    let mut out = Vec::with_capacity(4 * triangles.len());
    for &[a, b, c] in triangles {
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        out.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::tests::check_shape;
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn solids_have_their_volumes() {
        assert!((check_shape(&cuboid([1.0, 2.0, 3.0], 3), true) - 6.0).abs() < 1e-6);
        assert!((check_shape(&cylinder(0.5, 2.0, 128), true) / (PI * 0.5) - 1.0).abs() < 1e-3);
        assert!((check_shape(&icosphere(5), true) / (4.0 / 3.0 * PI) - 1.0).abs() < 2e-3);
        assert_eq!(icosphere(3).triangles.len(), 1280);
        assert_eq!(icosphere(3).positions.len(), 642);
    }

    #[test]
    fn a_plane_faces_up_and_has_its_area() {
        let m = plane(3.0, -1.0, 4);
        check_shape(&m, false);
        assert!((m.area() - 9.0).abs() < 1e-6);
        assert!(m.normals.iter().all(|n| *n == Vec3::Y) && m.positions.iter().all(|p| p.y == -1.0));
    }
}

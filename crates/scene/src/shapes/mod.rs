//! Built-in shapes: all lie in the unit ball about the origin unless asked otherwise, have analytic normals,
//! and (but for the icosphere) texture coordinates and tangents.

mod grid;
mod registry;
mod solids;
mod sphere;
mod teapot;
mod torus;

pub use registry::{SHAPES, ShapeError, ShapeInfo, by_name};
pub use solids::{cuboid, cylinder, icosphere, plane};
pub use sphere::sphere;
pub use teapot::teapot;
pub use torus::{knot, torus};

#[cfg(test)]
mod tests {
    use crate::Mesh;
    use std::collections::HashMap;

    /// Checks a shape's arrays, frames and winding, and (if closed) that every edge has its twin; returns the
    /// enclosed volume.
    pub fn check_shape(m: &Mesh, closed: bool) -> f64 {
        let n = m.positions.len();
        assert_eq!(m.normals.len(), n);
        assert!(m.tangents.is_empty() || m.tangents.len() == n && m.uvs.len() == n);
        assert!(m.used().iter().all(|u| *u), "unused vertices");
        for (i, normal) in m.normals.iter().enumerate() {
            assert!((normal.length() - 1.0).abs() < 1e-5, "{i} {normal}");
            if let Some(t) = m.tangents.get(i) {
                assert!(
                    (t.truncate().length() - 1.0).abs() < 1e-5 && t.truncate().dot(*normal).abs() < 1e-5,
                    "{i} {t}"
                );
            }
        }
        let mut volume = 0.0;
        let mut edges: HashMap<([u32; 3], [u32; 3]), i32> = HashMap::new();
        for (i, t) in m.triangles.iter().enumerate() {
            let p = m.corners(i);
            let d = p.map(|p| p.as_dvec3());
            volume += d[0].dot(d[1].cross(d[2])) / 6.0;
            let plane = (p[1] - p[0]).cross(p[2] - p[0]);
            let mean = t.iter().map(|&v| m.normals[v as usize]).sum::<glam::Vec3>();
            assert!(plane.dot(mean) > 0.0, "triangle {i} is wound the wrong way");
            let key = |k: usize| (p[k] + glam::Vec3::ZERO).to_array().map(f32::to_bits);
            for k in 0..3 {
                let (a, b) = (key(k), key((k + 1) % 3));
                *edges.entry((a.min(b), a.max(b))).or_default() += if a < b { 1 } else { -1 };
            }
        }
        assert!(!closed || edges.values().all(|&e| e == 0), "open edges");
        volume
    }
}

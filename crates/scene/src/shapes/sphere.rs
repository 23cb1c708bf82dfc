//! The sphere of latitudes and longitudes.

use crate::Mesh;
use glam::{Vec2, Vec3, Vec4};
use std::f64::consts::{PI, TAU};

/// The unit sphere of `segments` slices around +Y and half as many stacks (at least 3 and 2), with analytic
/// normals (n = p), texture coordinates and tangents.
///
/// v = acos(y)/π runs from 0 at +Y to 1 at −Y and u = 0.5 − atan2(z, x)/2π, so that a texture reads
/// unmirrored from outside. The tangent, along growing u, is normalize(+Y × n): the one that a surface
/// without tangents gets.
pub fn sphere(segments: u32) -> Mesh {
    let slices = segments.max(3);
    let stacks = (slices / 2).max(2);
    let mut m = Mesh::default();
    for j in 0..=stacks {
        let (sin, cos) = polar(j, stacks);
        // At a pole one vertex serves the triangle between two columns, its u in their middle.
        let pole = j == 0 || j == stacks;
        let (count, shift) = if pole { (slices, 0.5) } else { (slices + 1, 0.0) };
        for i in 0..count {
            let u = (f64::from(i) + shift) / f64::from(slices);
            // Both sides of the seam have bitwise equal positions.
            let turn = if i == slices { 0.0 } else { u };
            let (s, c) = (TAU * (0.5 - turn)).sin_cos();
            let n = Vec3::new((sin * c) as f32, cos as f32, (sin * s) as f32).normalize();
            m.positions.push(n);
            m.normals.push(n);
            m.tangents.push(Vec4::new(s as f32, 0.0, -c as f32, 1.0));
            m.uvs.push(Vec2::new(u as f32, j as f32 / stacks as f32));
        }
    }
    // First vertex of row j: the pole's row is one vertex shorter than all other rows.
    let row = |j: u32| if j == 0 { 0 } else { slices + (j - 1) * (slices + 1) };
    for j in 0..stacks {
        for i in 0..slices {
            let (a, c) = (row(j) + i, row(j + 1) + i);
            if j > 0 {
                m.triangles.push([a, c, a + 1]);
            }
            if j + 1 < stacks {
                m.triangles.push([if j == 0 { a } else { a + 1 }, c, c + 1]);
            }
        }
    }
    m
}

/// Sine and cosine of the polar angle of row `j`, exact at the poles and the equator.
fn polar(j: u32, stacks: u32) -> (f64, f64) {
    if j == 0 || j == stacks {
        return (0.0, if j == 0 { 1.0 } else { -1.0 });
    }
    (PI * f64::from(j) / f64::from(stacks)).sin_cos()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sphere_is_closed_outward_and_converges_to_its_volume() {
        for (n, tolerance) in [(8, 0.25), (128, 2e-3)] {
            let m = sphere(n);
            let p = |i: u32| m.positions[i as usize].as_dvec3();
            let volume: f64 = m.triangles.iter().map(|&[a, b, c]| p(a).dot(p(b).cross(p(c))) / 6.0).sum();
            assert!((volume / (4.0 / 3.0 * PI) - 1.0).abs() < tolerance, "{n} {volume}");
            let used: std::collections::BTreeSet<u32> = m.triangles.iter().flatten().copied().collect();
            assert_eq!(used.len(), m.positions.len());
        }
    }

    #[test]
    fn tangents_are_those_of_a_surface_without_tangents_away_from_the_poles() {
        let m = sphere(64);
        for (n, t) in m.normals.iter().zip(&m.tangents) {
            assert!(n.dot(t.truncate()).abs() < 1e-6 && (t.truncate().length() - 1.0).abs() < 1e-6);
            if n.y.abs() < 0.99 {
                assert!((Vec3::Y.cross(*n).normalize() - t.truncate()).length() < 1e-5);
            }
        }
    }
}

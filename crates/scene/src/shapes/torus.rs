//! The torus and the torus knot.

use super::grid::{Grid, Sample};
use crate::Mesh;
use glam::DVec3;
use std::f64::consts::TAU;

/// The torus about +Y: a circle of radius `minor` around one of radius `major`, `segments` cells around the
/// axis and half as many around the tube. Analytic normals and tangents.
pub fn torus(major: f64, minor: f64, segments: u32) -> Mesh {
    let mut mesh = Mesh::default();
    let grid = Grid { wrap_u: true, wrap_v: true, ..Grid::new(segments.max(3), (segments / 2).max(3)) };
    grid.append(&mut mesh, |u, v| {
        let (s, c) = (-TAU * u).sin_cos();
        let (st, ct) = (-TAU * v).sin_cos();
        let n = DVec3::new(ct * c, st, ct * s);
        let p = DVec3::new(c, 0.0, s) * major + n * minor;
        Sample { p, n, t: DVec3::new(s, 0.0, -c) }
    });
    mesh
}

/// A torus knot: the tube of radius `tube` around the closed curve that winds `p` times about the axis (+Y)
/// and `q` times about the core circle of a torus of radii `major` and `minor`. `segments` cells along each
/// winding, an eighth of them (at least 8) around the tube.
///
/// The normal of a tube of constant radius lies in the plane across the curve, so it is exact for any frame
/// there; the one used follows the torus' own normal and closes.
pub fn knot(p: u32, q: u32, major: f64, minor: f64, tube: f64, segments: u32) -> Mesh {
    let along = segments.max(8) * p.max(q).max(1);
    let around = (segments / 8).max(8);
    let curve = Knot { p: f64::from(p), q: f64::from(q), major, minor };
    let mut mesh = Mesh::default();
    let turns = f64::from(along) / f64::from(around);
    let grid = Grid {
        wrap_u: true,
        wrap_v: true,
        uv_max: [1.0, turns.round().max(1.0)],
        ..Grid::new(around, along)
    };
    grid.append(&mut mesh, |u, v| {
        let (c, across, beside) = curve.frame(TAU * v);
        let (sin, cos) = (TAU * u).sin_cos();
        let n = across * cos - beside * sin;
        Sample { p: c + n * tube, n, t: -across * sin - beside * cos }
    });
    mesh
}

struct Knot {
    p: f64,
    q: f64,
    major: f64,
    minor: f64,
}

impl Knot {
    /// The curve's point and two unit vectors across it: N along the torus' normal, and B = T × N.
    fn frame(&self, t: f64) -> (DVec3, DVec3, DVec3) {
        let (sp, cp) = (self.p * t).sin_cos();
        let (sq, cq) = (self.q * t).sin_cos();
        let radial = DVec3::new(cp, 0.0, sp);
        let round = DVec3::new(-sp, 0.0, cp);
        let r = self.major + self.minor * cq;
        let c = radial * r + DVec3::Y * (self.minor * sq);
        let tangent =
            (round * (self.p * r) + (DVec3::Y * cq - radial * sq) * (self.q * self.minor)).normalize();
        let outward = radial * cq + DVec3::Y * sq;
        let across = (outward - tangent * outward.dot(tangent)).normalize();
        (c, across, tangent.cross(across))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::check_shape;
    use super::*;

    #[test]
    fn the_torus_has_the_volume_and_area_of_pappus() {
        let (major, minor) = (0.7, 0.3);
        let m = torus(major, minor, 256);
        let volume = check_shape(&m, true);
        assert!(
            (volume / (TAU * major * std::f64::consts::PI * minor * minor) - 1.0).abs() < 1e-3,
            "{volume}"
        );
        assert!((m.area() / (TAU * major * TAU * minor) - 1.0).abs() < 1e-3);
    }

    #[test]
    fn a_tubes_volume_is_its_length_times_its_section() {
        let (major, minor, tube) = (1.0, 0.5, 0.2);
        let m = knot(2, 3, major, minor, tube, 256);
        let volume = check_shape(&m, true);
        let curve = Knot { p: 2.0, q: 3.0, major, minor };
        let at = |i: u32| curve.frame(TAU * f64::from(i) / 10_000.0).0;
        let length: f64 = (0..10_000).map(|i| (at(i + 1) - at(i)).length()).sum();
        // The tube's section is a polygon of 32 sides.
        let want = length * 16.0 * tube * tube * (TAU / 32.0).sin();
        assert!((volume / want - 1.0).abs() < 2e-3, "{volume} {want}");
    }
}

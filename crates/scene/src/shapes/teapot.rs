//! The Utah teapot (Newell 1975, with the rim, lid and bottom as commonly distributed): 32 bicubic Bézier
//! patches.
//!
//! Its 290 distinct control points follow from the six profiles and the fourteen sections below: the body,
//! the lid and the bottom are made of quarter turns, handle and spout of mirrored halves.

use super::grid::{Grid, Sample};
use crate::Mesh;
use glam::DVec3;

/// A control point of a profile: radius, sideways reach of the quarter turn's inner control points, height.
type Ring = [f64; 3];

/// The published data round a quarter circle's 0.5523 to 0.56 of the radius.
const fn ring(radius: f64, height: f64) -> Ring {
    [radius, 0.56 * radius, height]
}

/// Rim, upper and lower body, knob, lid, bottom: each from the inside over the top to the outside and down,
/// the bottom from its centre outward.
const PROFILES: [[Ring; 4]; 6] = [
    [ring(1.4, 2.4), ring(1.3375, 2.53125), ring(1.4375, 2.53125), ring(1.5, 2.4)],
    [ring(1.5, 2.4), ring(1.75, 1.875), ring(2.0, 1.35), ring(2.0, 0.9)],
    [ring(2.0, 0.9), ring(2.0, 0.45), ring(1.5, 0.225), ring(1.5, 0.15)],
    [ring(0.0, 3.15), [0.8, 0.45, 3.15], ring(0.0, 2.85), ring(0.2, 2.7)],
    [ring(0.2, 2.7), ring(0.4, 2.55), ring(1.3, 2.55), ring(1.3, 2.4)],
    [ring(0.0, 0.0), ring(1.425, 0.0), ring(1.5, 0.075), ring(1.5, 0.15)],
];

/// Index of the lid's lower profile and of the bottom in [`PROFILES`].
const LID: usize = 4;
const BOTTOM: usize = 5;

/// A cross-section of handle or spout: x and height at either side, and half its width.
type Section = [f64; 5];

/// From the body's upper joint to the lower one.
const HANDLE: [Section; 7] = [
    [-1.6, 2.025, -1.5, 2.25, 0.3],
    [-2.3, 2.025, -2.5, 2.25, 0.3],
    [-2.7, 2.025, -3.0, 2.25, 0.3],
    [-2.7, 1.8, -3.0, 1.8, 0.3],
    [-2.7, 1.575, -3.0, 1.35, 0.3],
    [-2.5, 1.125, -2.65, 0.9375, 0.3],
    [-2.0, 0.9, -1.9, 0.6, 0.3],
];

/// From the body to the mouth.
const SPOUT: [Section; 7] = [
    [1.7, 1.425, 1.7, 0.6, 0.66],
    [2.6, 1.425, 3.1, 0.825, 0.66],
    [2.3, 2.1, 2.4, 2.025, 0.25],
    [2.7, 2.4, 3.3, 2.4, 0.25],
    [2.8, 2.475, 3.525, 2.49375, 0.25],
    [2.9, 2.475, 3.45, 2.5125, 0.15],
    [2.8, 2.4, 3.2, 2.4, 0.15],
];

/// Sixteen control points, the first index along v.
type Patch = [[DVec3; 4]; 4];

/// The published patches in their own frame and size: +Y up, standing on y = 0, 3.15 high, the spout at +X.
/// With `fit_lid` the lid is as wide as the opening (1.4 instead of 1.3), so that one cannot look inside.
fn patches(fit_lid: bool) -> Vec<Patch> {
    let mut out = Vec::with_capacity(32);
    for (i, mut profile) in PROFILES.into_iter().enumerate() {
        if i == LID && fit_lid {
            profile[2] = ring(1.4, profile[2][2]);
            profile[3] = ring(1.4, profile[3][2]);
        }
        for quarter in 0..4 {
            out.push(profile.map(|r| quarter_turn(r, quarter, i == BOTTOM)));
        }
    }
    for sections in [&HANDLE, &SPOUT] {
        for half in [0, 3] {
            for side in [1.0, -1.0] {
                out.push([0, 1, 2, 3].map(|k| half_section(sections[half + k], side)));
            }
        }
    }
    out
}

/// Four control points of a quarter turn, clockwise as seen from above, or counter-clockwise.
fn quarter_turn([r, reach, y]: Ring, quarter: usize, reversed: bool) -> [DVec3; 4] {
    [(r, 0.0), (r, -reach), (reach, -r), (0.0, -r)].map(|(x, z)| {
        // Rotation by quarters keeps every number exact.
        let (x, z) = (0..quarter).fold((x, z), |(x, z), _| (z, -x));
        DVec3::new(x, y, if reversed { -z } else { z })
    })
}

/// Four control points of half a section of handle or spout.
fn half_section([x0, y0, x1, y1, w]: Section, side: f64) -> [DVec3; 4] {
    let half = [
        DVec3::new(x0, y0, 0.0),
        DVec3::new(x0, y0, w * side),
        DVec3::new(x1, y1, w * side),
        DVec3::new(x1, y1, 0.0),
    ];
    if side > 0.0 { half } else { [half[3], half[2], half[1], half[0]] }
}

/// Bernstein polynomials of degree 3.
fn bernstein(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [s * s * s, 3.0 * s * s * t, 3.0 * s * t * t, t * t * t]
}

/// Derivatives of the Bernstein polynomials.
fn derivative(t: f64) -> [f64; 4] {
    let s = 1.0 - t;
    [-3.0 * s * s, 3.0 * s * (s - 2.0 * t), 3.0 * t * (2.0 * s - t), 3.0 * t * t]
}

fn blend(patch: &Patch, along_u: [f64; 4], along_v: [f64; 4]) -> DVec3 {
    (0..4).map(|j| (0..4).map(|i| patch[j][i] * along_u[i]).sum::<DVec3>() * along_v[j]).sum()
}

/// The patch at (u, v). Where it collapses to a point (the poles of knob and bottom) ∂p/∂u is zero and the
/// normal its limit, ∂p/∂v × ∂²p/∂u∂v.
fn sample(patch: &Patch, u: f64, v: f64) -> Sample {
    let (bu, bv, du, dv) = (bernstein(u), bernstein(v), derivative(u), derivative(v));
    let pv = blend(patch, bu, dv);
    let mut pu = blend(patch, du, bv);
    if pu.length_squared() < 1e-20 {
        pu = blend(patch, du, dv);
    }
    Sample { p: blend(patch, bu, bv), n: pv.cross(pu).normalize_or(DVec3::Y), t: pu }
}

/// The teapot, each patch cut into `segments`² cells, with the patches' own normals, tangents along their u,
/// and texture coordinates that run over every patch once.
///
/// It is centred and scaled so that its bounding box fits the unit ball; the spout points to +X. With
/// `fit_lid` the lid is widened from 1.3 to 1.4 of its units, which closes the gap of the published data.
pub fn teapot(segments: u32, fit_lid: bool) -> Mesh {
    let mut mesh = Mesh::default();
    for patch in patches(fit_lid) {
        Grid::new(segments, segments).append(&mut mesh, |u, v| sample(&patch, u, v));
    }
    mesh.compact();
    let Some((lo, hi)) = mesh.bounds() else { return mesh };
    let (centre, scale) = (0.5 * (lo + hi), 2.0 / (hi - lo).length());
    mesh.positions.iter_mut().for_each(|p| *p = (*p - centre) * scale);
    mesh
}

#[cfg(test)]
mod tests {
    use super::super::tests::check_shape;
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn there_are_32_patches_of_the_published_290_points() {
        let all = patches(false);
        assert_eq!(all.len(), 32);
        let distinct: BTreeSet<[i64; 3]> =
            all.iter().flatten().flatten().map(|p| p.to_array().map(|c| (c * 1e6).round() as i64)).collect();
        assert_eq!(distinct.len(), 290);
    }

    #[test]
    fn normals_point_outward_and_are_vertical_at_the_poles() {
        let m = teapot(10, true);
        check_shape(&m, false);
        // As many triangles as the classic tessellation of the same degree.
        assert_eq!(m.triangles.len(), 6320);
        let poles =
            |y: f32| m.positions.iter().zip(&m.normals).filter(move |(p, n)| p.x.abs() < 2.0 && n.y == y);
        let (lo, hi) = m.bounds().unwrap();
        assert!(poles(1.0).any(|(p, _)| (p.y - hi.y).abs() < 1e-6));
        assert!(poles(-1.0).any(|(p, _)| (p.y - lo.y).abs() < 1e-6));
    }

    #[test]
    fn normals_are_those_of_the_finite_differences() {
        let h = 1e-6;
        for patch in patches(true) {
            for (u, v) in [(0.2, 0.3), (0.7, 0.9), (0.5, 0.5)] {
                let s = sample(&patch, u, v);
                let pu = sample(&patch, u + h, v).p - sample(&patch, u - h, v).p;
                let pv = sample(&patch, u, v + h).p - sample(&patch, u, v - h).p;
                assert!(s.n.dot(pv.cross(pu).normalize()) > 1.0 - 1e-9);
            }
        }
    }
}

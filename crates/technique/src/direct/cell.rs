//! Suns that are texels of a photograph: the integral of f_cos over a cell of a lat-long image; `cell.wgsl`
//! has the same rule.
//!
//! In polar coordinates about the image's pole a cell is a rectangle, dω = sin θ dθ dφ, and the horizon cuts
//! from each meridian an interval: with the pole's height A and that of the meridian's point on the equator
//! B, n·wi = A cos θ + B sin θ > 0 lies within π/2 of atan2(B, A). So Gauss–Legendre's nodes on the meridians
//! and on what is left of them integrate the part above the horizon without its kink.

use super::adaptive::{self, Patch};
use super::horizon::Horizon;
use super::rule::{POINT, REACH, nodes};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use steradian_brdf::{Brdf, Domain};
use steradian_light::CellLight;
use steradian_sphere::Frame;

/// Least number of nodes along a side that the horizon crosses.
const CROSSED: usize = 8;

/// ∫ f_cos over a cell, per channel.
pub fn integral(cell: &CellLight, brdf: &dyn Brdf, frame: &Frame, wo: DVec3) -> [f64; 3] {
    let local =
        CellLight { pole: frame.to_local(cell.pole), meridian: frame.to_local(cell.meridian), ..*cell };
    let whole = brdf.domain() == Domain::Sphere;
    let ([height, width], centre) = (cell.halves(), local.centre());
    let radius = height.hypot(width);
    if !whole && centre.z <= -radius {
        return [0.0; 3];
    }
    let scale = brdf.peak().scale(centre, wo, radius);
    let f = |wi: DVec3| brdf.f_cos(wi, wo);
    if let Some(h) = Horizon::of(brdf, centre, radius, scale, wo) {
        let (sides, breaks) = (sides(&local), breaks(&local));
        return h.polygon(&sides, &breaks, &f);
    }
    let least = if !whole && centre.z < radius { CROSSED } else { 1 };
    let [Some(n), Some(m)] = [height, width].map(|side| across(side / scale)) else {
        let at = |theta, phi| local.direction(theta, phi);
        let patch = Patch {
            theta: cell.theta,
            phi: [-1.0, -0.5, 0.0, 0.5].map(|x| [x * cell.half, (x + 0.5) * cell.half]),
            size: radius,
            at: &at,
        };
        let scale = |wi, radius| brdf.peak().scale(wi, wo, radius);
        return adaptive::integrate(&patch, &scale, &|wi, out| brdf.f_cos_batch(wi, wo, out));
    };
    product(&local, n.max(least), m.max(least), whole, f)
}

/// Four pairs (a, k): a direction d lies in the cell where d·a ≥ k for each of them, unless the cell is
/// wider than half of the sphere.
fn sides(cell: &CellLight) -> [(DVec3, f64); 4] {
    let across = cell.pole.cross(cell.meridian);
    let (s, c) = cell.half.sin_cos();
    let [top, bottom] = cell.theta.map(f64::cos);
    [
        (across * c + cell.meridian * s, 0.0),
        (cell.meridian * s - across * c, 0.0),
        (cell.pole, bottom),
        (-cell.pole, -top),
    ]
}

/// Elevations above z = 0 at which the outline has a corner or an extremum, radians, ascending.
fn breaks(cell: &CellLight) -> Vec<f64> {
    let across = cell.pole.cross(cell.meridian);
    let mut out = Vec::with_capacity(16);
    let mut put = |d: DVec3| out.push(d.z.clamp(-1.0, 1.0).asin());
    for theta in cell.theta {
        let highest = across.z.atan2(cell.meridian.z);
        for phi in [-cell.half, cell.half, highest, highest - PI, highest + PI] {
            if phi.abs() <= cell.half {
                put(cell.direction(theta, phi));
            }
        }
    }
    for phi in [-cell.half, cell.half] {
        let highest = cell.direction(FRAC_PI_2, phi).z.atan2(cell.pole.z);
        for theta in [highest, highest + PI] {
            if theta > cell.theta[0] && theta < cell.theta[1] {
                put(cell.direction(theta, phi));
            }
        }
    }
    out.sort_by(f64::total_cmp);
    out
}

/// `m` meridians of `n` nodes each.
fn product(cell: &CellLight, n: usize, m: usize, whole: bool, f: impl Fn(DVec3) -> [f64; 3]) -> [f64; 3] {
    let side = cell.pole.cross(cell.meridian);
    let mut sum = [0.0; 3];
    for &(x, wx) in nodes(m) {
        let (s, c) = (cell.half * (2.0 * x - 1.0)).sin_cos();
        let equator = cell.meridian * c + side * s;
        let [low, high] = if whole { cell.theta } else { above(cell.pole.z, equator.z, cell.theta) };
        if high <= low {
            continue;
        }
        for &(y, wy) in nodes(n) {
            let (s, c) = (low + (high - low) * y).sin_cos();
            let v = f(cell.pole * c + equator * s);
            let weight = 2.0 * cell.half * wx * wy * (high - low) * s;
            (0..3).for_each(|k| sum[k] += weight * v[k]);
        }
    }
    sum
}

/// The part of `theta` where a cos θ + b sin θ > 0.
fn above(a: f64, b: f64, theta: [f64; 2]) -> [f64; 2] {
    let top = b.atan2(a);
    let top = if top < -0.5 * PI { top + TAU } else { top };
    [theta[0].max(top - 0.5 * PI), theta[1].min(top + 0.5 * PI)]
}

/// Nodes along a side whose half is `ratio` times the reflectance's width: as many as the rings of a disk
/// have across it.
fn across(ratio: f64) -> Option<usize> {
    if ratio < POINT {
        return Some(1);
    }
    REACH.iter().position(|reach| ratio < *reach).map(|k| 2 << k)
}

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
use glam::{DMat3, DVec3};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use steradian_brdf::{Brdf, Domain};
use steradian_sphere::Frame;

/// Least number of nodes along a side that the horizon crosses.
const CROSSED: usize = 8;

/// A cell of constant radiance, turned in any way: a light. (The rectangle in latitude and longitude alone is
/// [`steradian_prefilter::Cell`].)
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellLight {
    /// Unit axis of the image, its upper pole.
    pub pole: DVec3,
    /// Unit direction on the equator below the cell's middle.
    pub meridian: DVec3,
    /// Angles from the pole, radians.
    pub theta: [f64; 2],
    /// Half of its extent in azimuth, radians.
    pub half: f64,
    /// Radiance, W sr⁻¹ m⁻².
    pub radiance: [f64; 3],
}

impl CellLight {
    /// Texel (i, j) of a lat-long image of `width` × `height`, with radiance 0.
    pub fn texel(i: usize, j: usize, width: usize, height: usize) -> Self {
        let (s, c) = (TAU * ((i as f64 + 0.5) / width as f64 - 0.5)).sin_cos();
        let theta = [j, j + 1].map(|j| PI * j as f64 / height as f64);
        let meridian = DVec3::new(c, 0.0, s);
        Self { pole: DVec3::Y, meridian, theta, half: PI / width as f64, radiance: [0.0; 3] }
    }

    /// Solid angle.
    pub fn solid_angle(&self) -> f64 {
        let [a, b] = self.theta;
        4.0 * self.half * (0.5 * (a + b)).sin() * (0.5 * (b - a)).sin()
    }

    /// The direction at θ and at the azimuth φ from its middle.
    pub fn direction(&self, theta: f64, phi: f64) -> DVec3 {
        let equator = self.meridian * phi.cos() + self.pole.cross(self.meridian) * phi.sin();
        self.pole * theta.cos() + equator * theta.sin()
    }

    /// The direction that is at x, y of the unit square, where areas are solid angles.
    pub fn inside(&self, x: f64, y: f64) -> DVec3 {
        let [a, b] = self.theta.map(f64::cos);
        self.direction((a + (b - a) * x).clamp(-1.0, 1.0).acos(), self.half * (2.0 * y - 1.0))
    }

    /// The middle of its ranges.
    pub fn centre(&self) -> DVec3 {
        self.direction(0.5 * (self.theta[0] + self.theta[1]), 0.0)
    }

    /// Half of its height and of its width.
    pub fn halves(&self) -> [f64; 2] {
        let [middle, height] = [0.5 * (self.theta[0] + self.theta[1]), 0.5 * (self.theta[1] - self.theta[0])];
        // The longer of its upper and its lower side.
        [height, self.half.min(0.5 * PI) * (middle.sin() + height * middle.cos().abs())]
    }

    /// This cell in the rotated image.
    pub fn turned(&self, by: &DMat3) -> Self {
        let [pole, meridian] = [self.pole, self.meridian].map(|v| (*by * v).normalize_or(v));
        Self { pole, meridian, ..*self }
    }

    /// ∫ f_cos over it, per channel.
    pub fn integral(&self, brdf: &dyn Brdf, frame: &Frame, wo: DVec3) -> [f64; 3] {
        let local =
            Self { pole: frame.to_local(self.pole), meridian: frame.to_local(self.meridian), ..*self };
        let whole = brdf.domain() == Domain::Sphere;
        let ([height, width], centre) = (self.halves(), local.centre());
        let radius = height.hypot(width);
        if !whole && centre.z <= -radius {
            return [0.0; 3];
        }
        let scale = brdf.peak().scale(centre, wo, radius);
        let f = |wi: DVec3| brdf.f_cos(wi, wo);
        if let Some(h) = Horizon::of(brdf, centre, radius, scale, wo) {
            let (sides, breaks) = (local.sides(), local.breaks());
            return h.polygon(&sides, &breaks, &f);
        }
        let least = if !whole && centre.z < radius { CROSSED } else { 1 };
        let [Some(n), Some(m)] = [height, width].map(|side| across(side / scale)) else {
            let at = |theta, phi| local.direction(theta, phi);
            let patch = Patch {
                theta: self.theta,
                phi: [-1.0, -0.5, 0.0, 0.5].map(|x| [x * self.half, (x + 0.5) * self.half]),
                size: radius,
                at: &at,
            };
            return adaptive::integrate(&patch, &|wi, radius| brdf.peak().scale(wi, wo, radius), &f);
        };
        local.product(n.max(least), m.max(least), whole, f)
    }

    /// Four pairs (a, k): a direction d lies in the cell where d·a ≥ k for each of them, unless the cell is
    /// wider than half of the sphere.
    fn sides(&self) -> [(DVec3, f64); 4] {
        let across = self.pole.cross(self.meridian);
        let (s, c) = self.half.sin_cos();
        let [top, bottom] = self.theta.map(f64::cos);
        [
            (across * c + self.meridian * s, 0.0),
            (self.meridian * s - across * c, 0.0),
            (self.pole, bottom),
            (-self.pole, -top),
        ]
    }

    /// Elevations above z = 0 at which the outline has a corner or an extremum, radians, ascending.
    fn breaks(&self) -> Vec<f64> {
        let across = self.pole.cross(self.meridian);
        let mut out = Vec::with_capacity(16);
        let mut put = |d: DVec3| out.push(d.z.clamp(-1.0, 1.0).asin());
        for theta in self.theta {
            let highest = across.z.atan2(self.meridian.z);
            for phi in [-self.half, self.half, highest, highest - PI, highest + PI] {
                if phi.abs() <= self.half {
                    put(self.direction(theta, phi));
                }
            }
        }
        for phi in [-self.half, self.half] {
            let highest = self.direction(FRAC_PI_2, phi).z.atan2(self.pole.z);
            for theta in [highest, highest + PI] {
                if theta > self.theta[0] && theta < self.theta[1] {
                    put(self.direction(theta, phi));
                }
            }
        }
        out.sort_by(f64::total_cmp);
        out
    }

    /// `m` meridians of `n` nodes each.
    pub fn product(&self, n: usize, m: usize, whole: bool, f: impl Fn(DVec3) -> [f64; 3]) -> [f64; 3] {
        let side = self.pole.cross(self.meridian);
        let mut sum = [0.0; 3];
        for &(x, wx) in nodes(m) {
            let (s, c) = (self.half * (2.0 * x - 1.0)).sin_cos();
            let equator = self.meridian * c + side * s;
            let [low, high] = if whole { self.theta } else { above(self.pole.z, equator.z, self.theta) };
            if high <= low {
                continue;
            }
            for &(y, wy) in nodes(n) {
                let (s, c) = (low + (high - low) * y).sin_cos();
                let v = f(self.pole * c + equator * s);
                let weight = 2.0 * self.half * wx * wy * (high - low) * s;
                (0..3).for_each(|k| sum[k] += weight * v[k]);
            }
        }
        sum
    }
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

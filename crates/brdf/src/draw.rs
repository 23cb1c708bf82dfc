//! Sampling: cosine, power-cosine lobes and GGX's visible normals, and mixtures of them.

use crate::Sample;
use crate::math::{INV_PI, around, half, power_cosine, turn};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// A density over directions for a given wo.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Draw {
    /// cos θ/π above the horizon.
    Cosine,
    /// 1/4π.
    Uniform,
    /// (n + 1)/2π cos^n about a unit axis.
    Power { axis: DVec3, n: f64 },
    /// Reflection about the visible normals of a GGX surface (Heitz 2018; Dupuy & Benyoub 2023). Directions
    /// below the horizon are part of the density. For a Beckmann-like lobe of the same slope width the weight
    /// is bounded by 4/e, since exp(−x)(1 + x)² ≤ 4/e.
    Visible { ax: f64, ay: f64 },
}

impl Draw {
    /// Density at `wi`, per steradian of the whole sphere.
    pub fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        match *self {
            Self::Cosine => wi.z.max(0.0) * INV_PI,
            Self::Uniform => 0.25 * INV_PI,
            Self::Power { axis, n } => (n + 1.0) / (2.0 * PI) * power_cosine(axis, wi, n),
            Self::Visible { ax, ay } => {
                let h = half(wi, wo);
                if h.z <= 0.0 || wo.z <= 0.0 {
                    return 0.0;
                }
                0.5 * ggx_d(h, ax, ay) / (wo.z + stretched_length(wo, ax, ay))
            }
        }
    }

    /// The direction of two uniform numbers.
    pub fn direction(&self, wo: DVec3, u: DVec2) -> DVec3 {
        match *self {
            Self::Cosine => {
                let r = u.x.sqrt();
                let (s, c) = turn(u.y).sin_cos();
                DVec3::new(r * c, r * s, (1.0 - u.x).max(0.0).sqrt())
            }
            Self::Uniform => about(DVec3::Z, 2.0 * u.x, u.y),
            Self::Power { axis, n } => {
                // 1 − cos θ = 1 − (1 − u)^(1/(n+1)), without cancellation.
                about(axis, -((-u.x).ln_1p() / (n + 1.0)).exp_m1(), u.y)
            }
            Self::Visible { ax, ay } => {
                let h = visible_normal(wo, ax, ay, u);
                (2.0 * wo.dot(h) * h - wo).normalize_or(DVec3::Z)
            }
        }
    }
}

/// The unit direction with 1 − cos = `versine` about `axis`.
fn about(axis: DVec3, versine: f64, u: f64) -> DVec3 {
    let (s, c) = turn(u).sin_cos();
    let r = (versine * (2.0 - versine)).max(0.0).sqrt();
    let (a, b) = around(axis);
    (a * (r * c) + b * (r * s) + axis * (1.0 - versine)).normalize_or(axis)
}

/// √(ax² x² + ay² y² + z²): the length of the stretched direction.
pub(crate) fn stretched_length(w: DVec3, ax: f64, ay: f64) -> f64 {
    DVec3::new(ax * w.x, ay * w.y, w.z).length()
}

/// Trowbridge & Reitz 1975 / Walter et al. 2007 eq. 33, anisotropic:
/// D = 1/(π ax ay (h_x²/ax² + h_y²/ay² + h_z²)²), per steradian, with ∫ D cos θ_h dh = 1.
pub(crate) fn ggx_d(h: DVec3, ax: f64, ay: f64) -> f64 {
    let q = DVec3::new(h.x / ax, h.y / ay, h.z).length_squared();
    1.0 / (PI * ax * ay * q * q)
}

/// Dupuy & Benyoub 2023, Sampling Visible GGX Normals with Spherical Caps, listing 3.
fn visible_normal(wo: DVec3, ax: f64, ay: f64, u: DVec2) -> DVec3 {
    let v = DVec3::new(ax * wo.x, ay * wo.y, wo.z).normalize_or(DVec3::Z);
    let z = (1.0 - u.x) * (1.0 + v.z) - v.z;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (s, c) = turn(u.y).sin_cos();
    let h = DVec3::new(r * c, r * s, z) + v;
    DVec3::new(ax * h.x, ay * h.y, h.z.max(0.0)).normalize_or(DVec3::Z)
}

/// Draws from `parts` with their weights (which sum to 1); the first number also picks the part.
pub(crate) fn sample(parts: &[(f64, Draw)], wo: DVec3, u: DVec2) -> Option<Sample> {
    if wo.z <= 0.0 {
        return None;
    }
    let mut x = u.x;
    let mut chosen = None;
    for &(weight, draw) in parts.iter().filter(|p| p.0 > 0.0) {
        chosen = Some((draw, (x / weight).clamp(0.0, 1.0 - f64::EPSILON / 2.0)));
        if x < weight {
            break;
        }
        x -= weight;
    }
    let (draw, x) = chosen?;
    let wi = draw.direction(wo, DVec2::new(x, u.y));
    let pdf = pdf(parts, wi, wo);
    (pdf > 0.0 && pdf.is_finite()).then_some(Sample { wi, pdf })
}

/// Density of [`sample`].
pub(crate) fn pdf(parts: &[(f64, Draw)], wi: DVec3, wo: DVec3) -> f64 {
    if wo.z <= 0.0 {
        return 0.0;
    }
    parts.iter().filter(|p| p.0 > 0.0).map(|(weight, draw)| weight * draw.pdf(wi, wo)).sum()
}

//! Equirectangular: u = 0.5 + atan2(z, x)/2π, v = acos(y)/π.

use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// The direction at (u, v); u repeats, and v beyond [0, 1] goes over the pole.
pub fn direction(u: f64, v: f64) -> DVec3 {
    let (sin_phi, cos_phi) = (TAU * (u - 0.5)).sin_cos();
    let (sin_theta, cos_theta) = (PI * v).sin_cos();
    DVec3::new(sin_theta * cos_phi, cos_theta, sin_theta * sin_phi)
}

/// (u, v) of a direction, both in [0, 1]. θ by atan2, which acos loses near the poles.
pub fn position(d: DVec3) -> (f64, f64) {
    let u = 0.5 + d.z.atan2(d.x) / TAU;
    let v = DVec2::new(d.x, d.z).length().atan2(d.y) / PI;
    (u, v)
}

/// Δφ (cos θ₀ − cos θ₁) = Δφ · 2 sin(θ_centre) sin(Δθ/2).
pub fn solid_angle(w: f64, h: f64, j: f64) -> f64 {
    TAU / w * 2.0 * (PI * (j + 0.5) / h).sin() * (0.5 * PI / h).sin()
}

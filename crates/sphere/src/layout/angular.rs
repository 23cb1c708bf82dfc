//! Debevec's angular map: r = θ/π, θ the angle from −Z.

use glam::DVec3;
use std::f64::consts::PI;

/// 1 − cos θ at the rim.
pub const RIM: f64 = 2.0;

/// The direction at (s, t), t upwards; beyond the rim θ runs on past +Z to the opposite side.
pub fn direction(s: f64, t: f64) -> DVec3 {
    let r = s.hypot(t);
    let (sin, cos) = (PI * r).sin_cos();
    let k = if r > 1e-9 { sin / r } else { PI };
    DVec3::new(k * s, k * t, -cos)
}

/// (s, t), t upwards; +Z, which every point of the rim shows, is put at its right.
pub fn position(d: DVec3) -> (f64, f64) {
    let rho = d.x.hypot(d.y);
    if rho == 0.0 {
        return (if d.z > 0.0 { 1.0 } else { 0.0 }, 0.0);
    }
    let r = rho.atan2(-d.z) / PI;
    (d.x / rho * r, d.y / rho * r)
}

/// ∫ c (1 − cos πr)/r² dy, an entire function of y: Gauss–Legendre of ten points on pieces no longer than ¼ is
/// exact to rounding (the remainder's factor is (π/8)²⁰ · 10!⁴/(21 · 20!³) < 1e-27).
pub fn edge(c: f64, a: f64, b: f64) -> f64 {
    const X: [f64; 5] =
        [0.1488743389816312, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845, 0.9739065285171717];
    const W: [f64; 5] =
        [0.2955242247147529, 0.2692667193099963, 0.2190863625159821, 0.1494513491505806, 0.0666713443086881];
    let pieces = ((b - a).abs() / 0.25).ceil().max(1.0) as usize;
    let half = 0.5 * (b - a) / pieces as f64;
    let mut total = 0.0;
    for p in 0..pieces {
        let middle = a + (2 * p + 1) as f64 * half;
        for (x, w) in X.iter().zip(W) {
            total += w * (kernel(c, middle - half * x) + kernel(c, middle + half * x));
        }
    }
    c * half * total
}

/// (1 − cos πr)/r² = 2 sin²(πr/2)/r².
fn kernel(c: f64, y: f64) -> f64 {
    let r = c.hypot(y);
    if r < 1e-9 {
        return 0.5 * PI * PI;
    }
    let s = (0.5 * PI * r).sin() / r;
    2.0 * s * s
}

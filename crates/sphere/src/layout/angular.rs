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

/// ∫ c (1 − cos πr)/r² dy, an entire function of y, by Gauss–Legendre, exact to rounding: of ten points on
/// pieces no longer than ¼ (the remainder's factor is (π/8)²⁰ · 10!⁴/(21 · 20!³) < 1e-27), and of three on
/// pieces shorter than 1/256, those of images of more than 512 rows (3e-20: Bernstein's inequality bounds the
/// sixth derivative by π⁶ · π²/2).
pub fn edge(c: f64, a: f64, b: f64) -> f64 {
    const SHORT: f64 = 1.0 / 256.0;
    let length = (b - a).abs();
    if length < SHORT {
        return c * piece(c, a, b, [0.774_596_669_241_483_4], [5.0 / 9.0], 8.0 / 9.0);
    }
    const X: [f64; 5] =
        [0.1488743389816312, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845, 0.9739065285171717];
    const W: [f64; 5] =
        [0.2955242247147529, 0.2692667193099963, 0.2190863625159821, 0.1494513491505806, 0.0666713443086881];
    let pieces = (length / 0.25).ceil().max(1.0) as usize;
    let at = |p: usize| a + (b - a) * p as f64 / pieces as f64;
    c * (0..pieces).map(|p| piece(c, at(p), at(p + 1), X, W, 0.0)).sum::<f64>()
}

/// ∫ (1 − cos πr)/r² dy from a to b by nodes ±x with weights `w` and the middle's.
fn piece<const N: usize>(c: f64, a: f64, b: f64, x: [f64; N], w: [f64; N], middle: f64) -> f64 {
    let (m, half) = (0.5 * (a + b), 0.5 * (b - a));
    let centre = if middle > 0.0 { middle * kernel(c, m) } else { 0.0 };
    let pairs = x.iter().zip(w).map(|(x, w)| w * (kernel(c, m - half * x) + kernel(c, m + half * x)));
    half * (centre + pairs.sum::<f64>())
}

/// (1 − cos πr)/r² = 2 sin²(πr/2)/r².
fn kernel(c: f64, y: f64) -> f64 {
    // r is at most √2: nothing overflows, and `hypot` would take longer than the sine.
    let r = (c * c + y * y).sqrt();
    if r < 1e-9 {
        return 0.5 * PI * PI;
    }
    let s = (0.5 * PI * r).sin() / r;
    2.0 * s * s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn short_pieces_are_as_exact_as_long_ones() {
        for (c, a) in [(0.0, 0.3), (0.1, -0.05), (-0.5, 0.6), (0.9, 0.2), (0.003, 0.0)] {
            let long = edge(c, a, a + 0.125);
            let at = |k: usize| a + 0.125 * k as f64 / 33.0;
            let short: f64 = (0..33).map(|k| edge(c, at(k), at(k + 1))).sum();
            assert!((long - short).abs() < 2e-16, "{c} {a}: {long} {short}");
        }
    }
}

//! Small formulas that several models share. Local frame: t = x, b = y, n = z.

use glam::DVec3;
use std::f64::consts::PI;

/// 1/π.
pub(crate) const INV_PI: f64 = std::f64::consts::FRAC_1_PI;

/// The mirror direction of `wo` about n = z.
pub(crate) fn mirror(wo: DVec3) -> DVec3 {
    DVec3::new(-wo.x, -wo.y, wo.z)
}

/// Are both directions above the horizon?
pub(crate) fn above(wi: DVec3, wo: DVec3) -> bool {
    wi.z > 0.0 && wo.z > 0.0
}

/// The half vector; n where wi = −wo.
pub(crate) fn half(wi: DVec3, wo: DVec3) -> DVec3 {
    (wi + wo).try_normalize().unwrap_or(DVec3::Z)
}

/// wi·h = wo·h = |wi + wo|/2, which stays positive where wi nears −wo.
pub(crate) fn half_cosine(wi: DVec3, wo: DVec3) -> f64 {
    (0.5 * (wi + wo).length()).clamp(1e-150, 1.0)
}

/// θ_h = ∠(n, h), accurate for small angles too.
pub(crate) fn polar_angle(h: DVec3) -> f64 {
    (h.x * h.x + h.y * h.y).sqrt().atan2(h.z)
}

/// x⁵.
pub(crate) fn pow5(x: f64) -> f64 {
    let x2 = x * x;
    x2 * x2 * x
}

/// Schlick 1994, An Inexpensive BRDF Model for Physically-based Rendering, eq. 15: f0 + (1 − f0)(1 − u)⁵.
pub(crate) fn schlick(f0: [f64; 3], u: f64) -> [f64; 3] {
    let w = pow5((1.0 - u).clamp(0.0, 1.0));
    f0.map(|f0| f0 + (1.0 - f0) * w)
}

/// max(0, x)^n with 0⁰ = 1 for x > 0 only.
pub(crate) fn positive_pow(x: f64, n: f64) -> f64 {
    if x > 0.0 { x.powf(n) } else { 0.0 }
}

/// cos^n of the angle between two unit vectors, accurate for n up to 1e12 where the angle is small:
/// ln cos α = ½ ln(1 − sin²α) with sin α from the cross product. 0 where the cosine is not positive.
pub(crate) fn power_cosine(a: DVec3, b: DVec3, n: f64) -> f64 {
    let c = a.dot(b);
    if c <= 0.0 {
        return 0.0;
    }
    if c < 0.9 {
        return c.powf(n);
    }
    (0.5 * n * (-a.cross(b).length_squared().min(1.0)).ln_1p()).exp()
}

/// `v` times `s`.
pub(crate) fn times(v: [f64; 3], s: f64) -> [f64; 3] {
    v.map(|x| x * s)
}

/// Sum per channel.
pub(crate) fn plus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] + b[c])
}

/// The largest channel.
pub(crate) fn largest(v: [f64; 3]) -> f64 {
    v[0].max(v[1]).max(v[2])
}

/// The unit direction at polar angle θ and azimuth φ.
pub(crate) fn spherical(theta: f64, phi: f64) -> DVec3 {
    let (s, c) = theta.sin_cos();
    DVec3::new(s * phi.cos(), s * phi.sin(), c)
}

/// Two unit vectors that complete `n` to a right-handed frame.
pub(crate) fn around(n: DVec3) -> (DVec3, DVec3) {
    n.any_orthonormal_pair()
}

/// The angle of a uniform number.
pub(crate) fn turn(u: f64) -> f64 {
    2.0 * PI * u
}

/// The error function. Abramowitz & Stegun 1964, 7.1.6 (all terms positive, so no cancellation):
/// erf x = 2/√π e^(−x²) Σ 2^k x^(2k+1)/(1·3·…·(2k+1)); 1 − erf 6 < 3e-17.
pub(crate) fn erf(x: f64) -> f64 {
    let a = x.abs();
    if a >= 6.0 {
        return x.signum();
    }
    let (mut term, mut sum, mut odd) = (a, a, 1.0);
    while term > 1e-17 * sum {
        odd += 2.0;
        term *= 2.0 * a * a / odd;
        sum += term;
    }
    x.signum() * 2.0 / PI.sqrt() * (-a * a).exp() * sum
}

/// Fresnel 1823: unpolarised reflectance of a dielectric of relative index `ior`, seen from outside; u = cos
/// θ.
pub(crate) fn dielectric(u: f64, ior: f64) -> f64 {
    let g2 = ior * ior - 1.0 + u * u;
    if g2 <= 0.0 {
        return 1.0;
    }
    let g = g2.sqrt();
    let a = (g - u) / (g + u);
    let b = (u * (g + u) - 1.0) / (u * (g - u) + 1.0);
    0.5 * a * a * (1.0 + b * b)
}

//! Angles in single precision; `local.wgsl` and the shaders of techniques have the same functions.

use std::f32::consts::{FRAC_2_PI, FRAC_PI_2};

/// The functions for local techniques in WGSL, `local_arccos` and `local_angle`.
pub const WGSL: &str = include_str!("angle.wgsl");

/// arccos of 0 ≤ x ≤ 1 within 2e-8: Abramowitz & Stegun 1964, Handbook of Mathematical Functions, 4.4.46.
#[inline(always)]
pub fn arccos(x: f32) -> f32 {
    let a = -0.017_088_126 + x * (0.006_670_09 - x * 0.001_262_491_1);
    let b = 0.088_978_99 + x * (-0.050_174_303 + x * (0.030_891_88 + x * a));
    (1.0 - x).max(0.0).sqrt() * (FRAC_PI_2 + x * (-0.214_598_8 + x * b))
}

/// The angle in 0 … π/2 of a sine and a cosine in 0 … 1, computed from the smaller of both, which is the one
/// that loses no digits.
#[inline(always)]
pub fn angle(sine: f32, cosine: f32) -> f32 {
    if cosine < sine { arccos(cosine) } else { FRAC_PI_2 - arccos(sine) }
}

/// Sine and cosine of |x| ≤ 100 within 2e-7 (5e-6 at 100), without a branch: the series about the nearest
/// multiple of π/2.
#[inline(always)]
pub fn sin_cos(x: f32) -> [f32; 2] {
    // Adding 1.5 · 2²³ rounds to a whole number, which the lowest bits then hold.
    const WHOLE: f32 = 12_582_912.0;
    // π/2 minus its single-precision value.
    const REST: f32 = -4.371_139e-8;
    let rounded = x * FRAC_2_PI + WHOLE;
    let (quarter, turns) = (rounded.to_bits(), rounded - WHOLE);
    let y = (x - turns * FRAC_PI_2) - turns * REST;
    let t = y * y;
    let s = y * (1.0 + t * (-1.0 / 6.0 + t * (1.0 / 120.0 + t * (-1.0 / 5040.0 + t * (1.0 / 362_880.0)))));
    let c = 1.0 + t * (-0.5 + t * (1.0 / 24.0 + t * (-1.0 / 720.0 + t * (1.0 / 40_320.0))));
    let (s, c) = if quarter & 1 == 1 { (c, s) } else { (s, c) };
    let sign = |bit: u32| f32::from_bits((bit & 2) << 30);
    [
        f32::from_bits(s.to_bits() ^ sign(quarter).to_bits()),
        f32::from_bits(c.to_bits() ^ sign(quarter + 1).to_bits()),
    ]
}

#[cfg(test)]
mod tests {
    use super::sin_cos;

    #[test]
    fn sines_and_cosines_of_any_quarter() {
        for k in -40_000..=40_000 {
            let x = k as f32 * 2.5e-3;
            let (s, c) = f64::from(x).sin_cos();
            let [a, b] = sin_cos(x).map(f64::from);
            let most = if x.abs() < 4.0 { 2e-7 } else { 5e-6 };
            assert!((a - s).abs() < most && (b - c).abs() < most, "{x}: {a} {s}, {b} {c}");
        }
    }
}

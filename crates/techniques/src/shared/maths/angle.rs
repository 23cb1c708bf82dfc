//! Angles in single precision; `local.wgsl` and the shaders of techniques have the same functions.

use std::f32::consts::FRAC_PI_2;

/// arccos of 0 ≤ x ≤ 1 within 2e-8: Abramowitz & Stegun 1964, Handbook of Mathematical Functions, 4.4.46.
#[inline(always)]
pub fn arccos(x: f32) -> f32 {
    let a = -0.017_088_126 + x * (0.006_670_09 - x * 0.001_262_491_1);
    let b = 0.088_978_99 + x * (-0.050_174_303 + x * (0.030_891_88 + x * a));
    (1.0 - x).max(0.0).sqrt() * (FRAC_PI_2 + x * (-0.214_598_8 + x * b))
}

/// The angle in 0 … π/2 of a sine and a cosine in 0 … 1, from the one that keeps its digits.
#[inline(always)]
pub fn angle(sine: f32, cosine: f32) -> f32 {
    if cosine < sine { arccos(cosine) } else { FRAC_PI_2 - arccos(sine) }
}

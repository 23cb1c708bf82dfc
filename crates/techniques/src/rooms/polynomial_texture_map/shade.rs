//! The polynomial; `shade.wgsl`, or `harmonics.wgsl`, has the same functions.

use super::bake::Polynomials;
use crate::local::{LocalText, Place};
use std::f32::consts::FRAC_1_PI;
use steradian_relight::polynomial::Basis;

/// The coefficients at a point, as many as the basis has.
pub type Texel = [[f32; 3]; 16];

#[inline(always)]
pub(super) fn texel(t: &Polynomials, at: Place) -> Texel {
    let mut out = [[0.0; 3]; 16];
    for (k, to) in out.iter_mut().enumerate().take(t.basis.terms()) {
        *to = t.texels.sample(k, at.uv, at.footprint);
    }
    out
}

/// Real spherical harmonics up to order 3.
#[inline(always)]
fn harmonics([x, y, z]: [f32; 3]) -> [f32; 16] {
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [
        0.282_094_8,
        0.488_602_52 * y,
        0.488_602_52 * z,
        0.488_602_52 * x,
        1.092_548_5 * x * y,
        1.092_548_5 * y * z,
        0.315_391_57 * (3.0 * zz - 1.0),
        1.092_548_5 * x * z,
        0.546_274_24 * (xx - yy),
        0.590_043_6 * y * (3.0 * xx - yy),
        2.890_611_4 * x * y * z,
        0.457_045_8 * y * (5.0 * zz - 1.0),
        0.373_176_34 * z * (5.0 * zz - 3.0),
        0.457_045_8 * x * (5.0 * zz - 1.0),
        1.445_305_7 * z * (xx - yy),
        0.590_043_6 * x * (xx - 3.0 * yy),
    ]
}

#[inline(always)]
fn sum(terms: &[f32], x: &[[f32; 3]]) -> [f32; 3] {
    std::array::from_fn(|c| FRAC_1_PI * terms.iter().zip(x).map(|(t, a)| t * a[c]).sum::<f32>().max(0.0))
}

#[inline(always)]
pub(super) fn f_cos(t: &Polynomials, x: &Texel, wi: [f32; 3]) -> [f32; 3] {
    let [u, v, z] = wi;
    // False for NaN too.
    if z > 0.0 {
        match t.basis {
            Basis::Biquadratic => sum(&[u * u, v * v, u * v, u, v, 1.0], x),
            Basis::Harmonics9 => sum(&harmonics(wi)[..9], x),
            Basis::Harmonics16 => sum(&harmonics(wi), x),
        }
    } else {
        [0.0; 3]
    }
}

pub(super) fn text(t: &Polynomials) -> LocalText {
    let module = match t.basis {
        Basis::Biquadratic => include_str!("shade.wgsl").into(),
        basis => {
            let terms = basis.terms();
            format!("const LOCAL_TERMS: u32 = {terms}u;\n{}", include_str!("harmonics.wgsl")).into()
        }
    };
    LocalText {
        module,
        tables: vec![t.texels.table("local_polynomials")],
        uniforms: Vec::new(),
        buffers: Vec::new(),
    }
}

//! The polynomial; `shade.wgsl`, or `harmonics.wgsl`, has the same functions.

use super::bake::Polynomials;
use crate::local::{LocalText, Place};
use std::f32::consts::FRAC_1_PI;
use steradian_relight::polynomial::{self, Basis};

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
            Basis::Harmonics9 | Basis::Harmonics16 => {
                let y = polynomial::harmonics(wi.map(f64::from)).map(|y| y as f32);
                sum(&y[..t.basis.terms()], x)
            }
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

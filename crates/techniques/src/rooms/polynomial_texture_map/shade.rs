//! The polynomial; `shade.wgsl` has the same functions.

use super::bake::Polynomials;
use crate::local::{LocalText, Place};
use std::f32::consts::FRAC_1_PI;

#[inline(always)]
pub(super) fn texel(t: &Polynomials, at: Place) -> [[f32; 3]; 6] {
    std::array::from_fn(|k| t.texels.sample(k, at.uv, at.footprint))
}

#[inline(always)]
pub(super) fn f_cos(x: &[[f32; 3]; 6], [u, v, z]: [f32; 3]) -> [f32; 3] {
    // False for NaN too.
    if z > 0.0 {
        let terms = [u * u, v * v, u * v, u, v, 1.0];
        std::array::from_fn(|c| FRAC_1_PI * terms.iter().zip(x).map(|(t, a)| t * a[c]).sum::<f32>().max(0.0))
    } else {
        [0.0; 3]
    }
}

pub(super) fn text(t: &Polynomials) -> LocalText {
    LocalText {
        module: include_str!("shade.wgsl").into(),
        tables: vec![t.texels.table("local_polynomials")],
        uniforms: Vec::new(),
        buffers: Vec::new(),
    }
}

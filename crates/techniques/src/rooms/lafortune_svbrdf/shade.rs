//! The equation with the averages over a footprint; `shade.wgsl` has the same functions.

use crate::gpu::{Uniform, Value};
use crate::local::LocalText;
use crate::shared::surface::cosine_lobes::{CosineLobes, Texel, WGSL};
use steradian_brdf::wgsl::scoped;

#[inline(always)]
pub(super) fn f_cos(t: &CosineLobes, x: &Texel, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    let v = [wi[0] * wo[0], wi[1] * wo[1], wi[2] * wo[2]];
    let mut f = x.rho_d;
    for lobe in x.lobes.iter().take(t.count) {
        for c in 0..3 {
            let cosine = lobe.c[0][c] * v[0] + lobe.c[1][c] * v[1] + lobe.c[2][c] * v[2];
            if cosine > 0.0 {
                f[c] += lobe.rho[c] * cosine.powf(lobe.n[c]);
            }
        }
    }
    // False for NaN too.
    if wi[2] > 0.0 { f.map(|f| (f * wi[2]).min(f32::MAX)) } else { [0.0; 3] }
}

pub(super) fn text(t: &CosineLobes) -> LocalText {
    LocalText {
        // Names are prefixed: a technique for environments in the same shader may contain the same lobes.
        module: (scoped("local", WGSL) + include_str!("shade.wgsl")).into(),
        tables: vec![t.texels.table("local_lobes")],
        uniforms: vec![Uniform { name: "local_lobe_count", value: Value::F32(t.count as f32) }],
        buffers: Vec::new(),
    }
}

//! The equation with what a footprint holds; `shade.wgsl` has the same functions.

use super::bake::{LAYERS, Lobes, MOST};
use crate::gpu::{Uniform, Value};
use crate::local::{LocalText, Place};
use std::f32::consts::FRAC_1_PI;

/// Scatter of the axes below which they are one.
const ONE: f32 = 1e-5;

/// A lobe of a point, for red, green and blue.
#[derive(Debug, Clone, Copy, Default)]
pub struct Lobe {
    pub rho: [f32; 3],
    pub c: [[f32; 3]; 3],
    pub n: [f32; 3],
}

/// What a point has.
#[derive(Debug, Clone, Copy, Default)]
pub struct Texel {
    pub rho_d: [f32; 3],
    pub lobes: [Lobe; MOST],
}

#[inline(always)]
pub(super) fn texel(t: &Lobes, at: Place) -> Texel {
    let layer = |k: usize| t.texels.sample(k, at.uv, at.footprint);
    let mut out = Texel { rho_d: layer(0).map(|x| x * FRAC_1_PI), ..Texel::default() };
    for (k, lobe) in out.lobes.iter_mut().enumerate().take(t.count) {
        let [rho, x, y, z, s, q] = std::array::from_fn(|j| layer(1 + LAYERS * k + j));
        lobe.rho = rho;
        for c in 0..3 {
            let weight = rho[c].max(1e-30).recip();
            let [x, y, z, s, q] = [x, y, z, s, q].map(|v| v[c] * weight);
            let square = x * x + y * y + z * z;
            let scatter = 1.0 - square / q.max(1e-30);
            let (mut wide, mut longer) = (s.max(1e-30), 1.0);
            if scatter > ONE {
                wide += 0.5 * scatter;
                longer = (q / square.max(1e-30)).sqrt();
                // 1/(n + 1) of both.
                lobe.rho[c] *= s * (1.0 + wide) / (wide * (1.0 + s));
            }
            lobe.c.iter_mut().zip([x, y, z]).for_each(|(to, v)| to[c] = longer * v);
            lobe.n[c] = wide.recip();
        }
    }
    out
}

#[inline(always)]
pub(super) fn f_cos(t: &Lobes, x: &Texel, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
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

pub(super) fn text(t: &Lobes) -> LocalText {
    LocalText {
        module: include_str!("shade.wgsl").into(),
        tables: vec![t.texels.table("local_lobes")],
        uniforms: vec![Uniform { name: "local_lobe_count", value: Value::F32(t.count as f32) }],
        buffers: Vec::new(),
    }
}

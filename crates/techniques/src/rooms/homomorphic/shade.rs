//! Three lookups, a sum and an exponential; `shade.wgsl` has the same function.

use super::bake::Tables;
use crate::gpu::{Uniform, Value};
use crate::local::LocalText;
use crate::shared::tables::hemisphere;

/// f of two directions above the horizon: light and view are exchanged without a difference.
#[inline(always)]
pub(super) fn f(t: &Tables, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    let sum: [f32; 3] = std::array::from_fn(|k| wi[k] + wo[k]);
    let scale = (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]).sqrt().max(1e-18).recip();
    let side = |w: [f32; 3]| t.side.layer(t.side.place(t.sides.place(w)), 0);
    let (a, b) = (side(wi), side(wo));
    let h = t.half.layer(t.half.place(t.halves.place(sum.map(|x| x * scale))), 0);
    std::array::from_fn(|c| t.scale[c] * ((a[c] + b[c]) + h[c]).min(60.0).exp())
}

#[inline(always)]
pub(super) fn f_cos(t: &Tables, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    // False for NaN too.
    if wi[2] > 0.0 { f(t, wi, wo).map(|f| wi[2] * f) } else { [0.0; 3] }
}

pub(super) fn text(t: &Tables) -> LocalText {
    let [r, g, b] = t.scale;
    LocalText {
        module: [hemisphere::WGSL, include_str!("shade.wgsl")].concat().into(),
        tables: vec![t.side.table("local_side"), t.half.table("local_half")],
        uniforms: vec![Uniform {
            name: "local_scale",
            value: Value::Vec4([r, g, b, t.sides.azimuths.code()]),
        }],
        buffers: Vec::new(),
    }
}

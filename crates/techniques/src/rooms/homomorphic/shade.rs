//! Three lookups, a sum and an exponential; `shade.wgsl` has the same function.

use super::bake::Tables;
use crate::gpu::{Uniform, Value};
use crate::local::LocalText;
use crate::shared::tables::hemisphere;
use steradian_simd::functions::{exp, ln};

/// f of two directions above the horizon: light and view are exchanged without a difference.
#[inline(always)]
pub(super) fn f(t: &Tables, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    let sum = [t.stretch[0] * (wi[0] + wo[0]), t.stretch[1] * (wi[1] + wo[1]), wi[2] + wo[2]];
    let across = sum[0] * sum[0] + sum[1] * sum[1];
    let (across, length) = (across.sqrt(), (across + sum[2] * sum[2]).sqrt().max(1e-18));
    // Underflow would be a logarithm without bound.
    let risen = if t.grazing == 0.0 { 0.0 } else { t.grazing * ln((wi[2] * wo[2]).max(1e-30)) };
    let side = |w: [f32; 3]| t.side.layer(t.side.place(t.sides.place(w)), 0);
    let (a, b) = (side(wi), side(wo));
    let h = t.half.layer(t.half.place(t.halves.place_along(sum, across, length)), 0);
    // Four in a register.
    let e: [f32; 4] = std::array::from_fn(|c| exp((((a[c] + b[c]) + h[c]) - risen).min(60.0)));
    std::array::from_fn(|c| t.scale[c] * e[c])
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
        uniforms: vec![
            Uniform { name: "local_scale", value: Value::Vec4([r, g, b, t.sides.azimuths.code()]) },
            Uniform { name: "local_form", value: Value::Vec4([t.stretch[0], t.stretch[1], t.grazing, 0.0]) },
        ],
        buffers: Vec::new(),
    }
}

//! Two places, and a sum of products of the values there; `shade.wgsl` has the same functions.

use super::bake::Tables;
use super::coordinates::Form;
use crate::gpu::{Uniform, Value};
use crate::local::LocalText;
use crate::shared::tables::hemisphere;

#[inline(always)]
pub(super) fn f_cos(t: &Tables, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    // False for NaN too.
    if wi[2] > 0.0 {
        let [x, y] = t.coordinates.places(wi, wo);
        let (x, y) = (t.left.place(x), t.right.place(y));
        let mut sum = [0.0f32; 3];
        if let Some(tint) = t.tint {
            let mut s = 0.0;
            for k in 0..t.left.layers() {
                let (g, h) = (t.left.layer(x, k), t.right.layer(y, k));
                s += (g[0] * h[0] + g[1] * h[1]) + (g[2] * h[2] + g[3] * h[3]);
            }
            sum = tint.map(|c| c * s);
        } else if t.fours {
            let mut s = [[0.0f32; 4]; 3];
            for layer in 0..t.left.layers() {
                let g = t.left.layer(x, layer);
                for c in 0..3 {
                    let h = t.right.layer(y, 3 * layer + c);
                    (0..4).for_each(|k| s[c][k] += g[k] * h[k]);
                }
            }
            sum = s.map(|s| (s[0] + s[1]) + (s[2] + s[3]));
        } else {
            for layer in 0..t.left.layers() {
                let g = t.left.layer(x, layer);
                for (k, g) in g.iter().enumerate().take(t.right.layers() - 4 * layer) {
                    let h = t.right.layer(y, 4 * layer + k);
                    (0..3).for_each(|c| sum[c] += g * h[c]);
                }
            }
        }
        let mut scale = wi[2];
        if t.coordinates.over_half() {
            // (h·l)² = (1 + l·v)/2.
            scale *= 2.0 / (1.0 + (wi[0] * wo[0] + wi[1] * wo[1] + wi[2] * wo[2])).max(1e-6);
        }
        // No reflectance is negative: where a sum is, 0 is nearer.
        sum.map(|f| scale * f.max(0.0))
    } else {
        [0.0; 3]
    }
}

pub(super) fn text(t: &Tables) -> LocalText {
    let places = match t.coordinates.form {
        Form::ViewLight => include_str!("view_light.wgsl"),
        Form::HalfView => include_str!("half_view.wgsl"),
        Form::HalfDifference => include_str!("half_difference.wgsl"),
        Form::IsotropicHalfDifference => include_str!("isotropic.wgsl"),
    };
    let sum = match (&t.tint, t.fours) {
        (Some(_), _) => include_str!("grey.wgsl"),
        (None, true) => include_str!("fours.wgsl"),
        (None, false) => include_str!("colours.wgsl"),
    };
    let module = [hemisphere::WGSL, places, sum, include_str!("shade.wgsl")].concat();
    let [r, g, b] = t.tint.unwrap_or([1.0; 3]);
    let azimuths = [t.coordinates.x.azimuths.code(), t.coordinates.y.azimuths.code()];
    let counts = [t.left.layers() as f32, t.right.layers() as f32];
    let over = f32::from(u8::from(t.coordinates.over_half()));
    LocalText {
        module: module.into(),
        tables: vec![t.left.table("local_left"), t.right.table("local_right")],
        uniforms: vec![
            Uniform { name: "local_tint", value: Value::Vec4([r, g, b, over]) },
            Uniform {
                name: "local_maps",
                value: Value::Vec4([azimuths[0], azimuths[1], counts[0], counts[1]]),
            },
        ],
        buffers: Vec::new(),
    }
}

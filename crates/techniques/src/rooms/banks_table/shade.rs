//! One lookup for each light; `shade.wgsl` has the same functions.

use super::table::Table;
use crate::gpu::{Uniform, Value};
use crate::local::LocalText;
use crate::shared::maths::angle::{self, angle};
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2};

/// The table's coordinate of a direction: a of sin a = w·t, from −π/2 to π/2 as 0 to 1, or w·t from −1 to 1.
#[inline(always)]
fn coordinate(t: &Table, w: [f32; 3]) -> f32 {
    if !t.angles {
        return 0.5 + 0.5 * w[0];
    }
    let c = (w[1] * w[1] + w[2] * w[2]).sqrt().min(1.0);
    let a = angle(w[0].abs().min(1.0), c).min(FRAC_PI_2);
    0.5 + FRAC_1_PI * a.copysign(w[0])
}

#[inline(always)]
pub(super) fn f_cos(t: &Table, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    // False for NaN too.
    if wi[2] > 0.0 {
        let [d, s] = t.grid.plane(coordinate(t, wi), coordinate(t, wo));
        let m = &t.model;
        std::array::from_fn(|c| wi[2] * (m.diffuse[c] as f32 * d + m.specular[c] as f32 * s))
    } else {
        [0.0; 3]
    }
}

pub(super) fn text(t: &Table) -> LocalText {
    let four = |v: [f64; 3], w: f32| Value::Vec4([v[0] as f32, v[1] as f32, v[2] as f32, w]);
    LocalText {
        module: [angle::WGSL, include_str!("shade.wgsl")].concat().into(),
        tables: vec![t.grid.table("local_banks")],
        uniforms: vec![
            Uniform { name: "local_diffuse", value: four(t.model.diffuse, f32::from(u8::from(t.angles))) },
            Uniform { name: "local_specular", value: four(t.model.specular, 0.0) },
        ],
        buffers: Vec::new(),
    }
}

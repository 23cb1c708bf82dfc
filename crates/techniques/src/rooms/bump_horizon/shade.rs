//! The reflectance about a texel's normal and the part of a light that the texel sees; `shade.wgsl` has the
//! same functions.

use super::bake::{Kept, Relief};
use super::horizon::{Texel, seen};
use super::scatter;
use crate::gpu::{Uniform, Value, own_reflectance};
use crate::local::LocalText;
use crate::shared::maths::angle;
use crate::shared::maths::vector::dot;
use crate::shared::surface::bumps;
use glam::DVec3;

/// f · ⟨n·wi⟩ with shadows, and the light that bumps reflect to the point.
#[inline(always)]
pub(super) fn f_cos(t: &Relief, x: &Texel, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    let direct = direct(t, x, wi, wo);
    match &t.scatter {
        Some(s) if wi[2] > 0.0 => {
            let more = scatter::bounced(t, s, x, wi, wo);
            std::array::from_fn(|c| direct[c] + more[c])
        }
        _ => direct,
    }
}

#[inline(always)]
fn direct(t: &Relief, x: &Texel, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    // False for NaN too.
    let v = if wi[2] > 0.0 { seen(t, x.at, wi) } else { 0.0 };
    if v == 0.0 {
        return [0.0; 3];
    }
    let unit = |w: [f32; 3]| DVec3::from_array(x.frame.map(|e| f64::from(dot(e, w)))).normalize_or_zero();
    t.brdf.f_cos(unit(wi), unit(wo)).map(|f| v * f as f32)
}

/// The model's own text, if it has one.
pub(super) fn text(t: &Relief) -> Option<LocalText> {
    // It brings local_brdf_atan2.
    let (own, mut tables) = own_reflectance(&t.brdf.shader()?, "local", "local_cells", "");
    tables.extend([t.normals.table("local_normals"), t.horizons.table("local_horizons")]);
    let kind = match t.kept {
        Kept::Open => [0.0, 1.0],
        Kept::Azimuths(n) => [1.0, n as f32],
        Kept::Ellipse => [2.0, 1.0],
    };
    let end = if t.scatter.is_some() { include_str!("scatter.wgsl") } else { include_str!("direct.wgsl") };
    let shadow = Uniform { name: "local_shadow", value: Value::Vec4([kind[0], kind[1], t.width, 0.0]) };
    Some(LocalText {
        module: [&own, angle::WGSL, bumps::TEXT, include_str!("shade.wgsl"), end].concat().into(),
        tables,
        uniforms: std::iter::once(shadow).chain(t.scatter.as_ref().map(|s| s.uniform())).collect(),
        buffers: t.scatter.iter().map(|s| s.buffer()).collect(),
    })
}

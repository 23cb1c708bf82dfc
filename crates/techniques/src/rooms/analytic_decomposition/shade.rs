//! Two or three lookups for each light; `shade.wgsl` and `three.wgsl` have the same functions.

use super::tables::Tables;
use crate::local::LocalText;
use crate::shared::maths::angle::{self, angle};
use std::f32::consts::FRAC_2_PI;

/// The half vector's h·l and θ_h/(π/2).
#[inline(always)]
fn half(wi: [f32; 3], wo: [f32; 3]) -> (f32, f32) {
    let v: [f32; 3] = std::array::from_fn(|k| wi[k] + wo[k]);
    // |wi + wo| = 2 h·l.
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt().max(1e-18);
    let side = (v[0] * v[0] + v[1] * v[1]).sqrt();
    let theta = FRAC_2_PI * angle((side / length).min(1.0), (v[2] / length).min(1.0));
    ((0.5 * length).min(1.0), theta)
}

/// φ_h over π/2, folded to the first quadrant.
#[inline(always)]
fn azimuth(wi: [f32; 3], wo: [f32; 3]) -> f32 {
    let [x, y] = [wi[0] + wo[0], wi[1] + wo[1]];
    let side = (x * x + y * y).sqrt();
    if side > 0.0 { FRAC_2_PI * angle((y.abs() / side).min(1.0), (x.abs() / side).min(1.0)) } else { 0.0 }
}

#[inline(always)]
pub(super) fn f_cos(t: &Tables, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    let (nl, nv) = (wi[2], wo[2]);
    // False for NaN too.
    if nl > 0.0 {
        let (hl, theta) = half(wi, wo);
        match t {
            Tables::Two { facets, masking, .. } => {
                let [r, g, b, _] = facets.plane(hl, theta);
                let ratio = nl / masking.plane(nl, nv)[0].max(1e-36);
                [r * ratio, g * ratio, b * ratio]
            }
            Tables::Three { power, fresnel, base, .. } => {
                let p = power.plane(azimuth(wi, wo), theta)[0];
                let f = fresnel.line(hl);
                let d = base.plane(nl.min(nv), nl.max(nv));
                let ratio = p * (nl / d[3].max(1e-36)) / hl;
                std::array::from_fn(|c| f[c] * ratio + nl * d[c])
            }
        }
    } else {
        [0.0; 3]
    }
}

pub(super) fn text(t: &Tables) -> LocalText {
    let (own, tables) = match t {
        Tables::Two { facets, masking, .. } => {
            (include_str!("shade.wgsl"), vec![facets.table("local_facets"), masking.table("local_masking")])
        }
        Tables::Three { power, fresnel, base, .. } => {
            let tables =
                vec![power.table("local_power"), fresnel.table("local_fresnel"), base.table("local_base")];
            (include_str!("three.wgsl"), tables)
        }
    };
    let module = [angle::WGSL, include_str!("half.wgsl"), own].concat();
    LocalText { module: module.into(), tables, uniforms: Vec::new(), buffers: Vec::new() }
}

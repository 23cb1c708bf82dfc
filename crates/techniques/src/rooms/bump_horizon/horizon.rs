//! A texel's normal, and the part of a light that it sees; `shade.wgsl` has the same functions.

use super::bake::{Kept, Relief};
use crate::local::Place;
use crate::shared::maths::angle::{angle, arccos};
use crate::shared::surface::bumps;
use std::f32::consts::{PI, TAU};

/// Data of a point.
#[derive(Debug, Clone, Copy)]
pub struct Texel {
    /// Tangent, bitangent and normal of the bump.
    pub frame: [[f32; 3]; 3],
    /// Where its horizon is looked up.
    pub at: Place,
}

#[inline(always)]
pub(super) fn texel(t: &Relief, at: Place, wo: [f32; 3]) -> Texel {
    let n = bumps::facing(bumps::unit(t.normals.sample(0, at.uv, at.footprint)).0, wo);
    let [a, b] = bumps::frame(n);
    Texel { frame: [a, b, n], at }
}

/// The part of a light in the direction `wi` above the surface that a place sees.
#[inline(always)]
pub(super) fn seen(t: &Relief, at: Place, wi: [f32; 3]) -> f32 {
    let [x, y, z] = wi;
    match t.kept {
        Kept::Open => 1.0,
        Kept::Ellipse => {
            let [a, b, c] = t.horizons.sample(0, at.uv, at.footprint);
            let [d, e, _] = t.horizons.sample(1, at.uv, at.footprint);
            let q = a * x * x + b * x * y + c * y * y + d * x + e * y;
            if q <= 1.0 { 1.0 } else { 0.0 }
        }
        Kept::Azimuths(n) => {
            let place = (y.atan2(x) / TAU + 1.0).fract() * n as f32;
            let k = (place as usize).min(n - 1);
            let next = if k + 1 < n { k + 1 } else { 0 };
            let of = |k: usize| t.horizons.sample(k / 3, at.uv, at.footprint)[k % 3];
            let (e, f) = (of(k), of(next));
            let horizon = e + (place - k as f32) * (f - e);
            let above = angle(z.min(1.0), (x * x + y * y).sqrt().min(1.0)) - horizon;
            disk(above, t.width)
        }
    }
}

/// The part of a disk of angular radius `width` whose middle stands `above` a straight horizon.
#[inline(always)]
fn disk(above: f32, width: f32) -> f32 {
    if above.abs() >= width {
        return if above > 0.0 { 1.0 } else { 0.0 };
    }
    let x = above / width;
    let acute = arccos(x.abs());
    let acos = if x < 0.0 { PI - acute } else { acute };
    1.0 - (acos - x * (1.0 - x * x).sqrt()) / PI
}

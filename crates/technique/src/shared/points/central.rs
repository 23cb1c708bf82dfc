//! Central directions of points, and the tangent of those that have none.

use crate::Points;
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::points::batch::Point;
use steradian_brdf::central::Centre;

/// `tangent(n, t)` in WGSL: [`tangent`].
pub const TANGENT: &str = include_str!("tangent.wgsl");

/// The point's tangent; where the batch has none, that of surfaces without tangents: t = normalize(a × n),
/// a = +Y if
/// |n·y| < 0.99, else +X.
#[inline(always)]
pub fn tangent(q: &Points<'_>, p: &Point) -> [f32; 3] {
    let t = q.t.map(|s| s.get(p.index).copied().unwrap_or(0.0));
    let square = t[0] * t[0] + t[1] * t[1] + t[2] * t[2];
    if square > 0.25 {
        let s = 1.0 / square.sqrt();
        return t.map(|x| x * s);
    }
    let [x, y, z] = p.n;
    // a × n
    let v = if y.abs() < 0.99 { [z, 0.0, -x] } else { [0.0, -z, y] };
    let s = 1.0 / (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    v.map(|x| x * s)
}

/// C of a point, in the light's frame.
#[inline(always)]
pub fn central(centre: Centre, turn: &LightRotation, q: &Points<'_>, p: &Point) -> [f32; 3] {
    turn.apply(match centre {
        Centre::Reflection => p.r,
        Centre::Normal => p.n,
        Centre::Tangent => tangent(q, p),
    })
}

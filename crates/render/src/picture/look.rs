//! Evaluation of a surface's maps at a hit, for shaders; the GPU's `maps.wgsl` has the same functions.

use super::hits::{Found, facing, tangent};
use glam::Vec3;
use steradian_scene::surface::{NormalFiltering, SurfaceMaps};
use steradian_technique::PointLobe;

/// Normal, tangent and lobe of a point.
pub struct ShadingPoint {
    pub n: Vec3,
    pub t: Vec3,
    pub lobe: PointLobe,
}

/// Least z of a mean normal with which covariances are projected.
const LEAST_Z: f32 = 0.1;

/// The shading point of a hit whose sample covers a square of side `uv` in texture coordinates and of
/// `length` metres on the surface; `angle` is the angle that it covers of the view, radians.
pub fn look(f: &Found, maps: &SurfaceMaps, uv: f32, length: f32, angle: f32) -> ShadingPoint {
    let t = tangent(f.along, f.outward);
    let b = f.outward.cross(t) * if f.along.w < 0.0 { -1.0 } else { 1.0 };
    let (mean, spread) = match &maps.normal {
        Some(map) => {
            let s = map.sample(f.uv, uv);
            (s.mean, s.spread)
        }
        None => (Vec3::Z, [0.0; 3]),
    };
    let n = facing(f.side * (mean.x * t + mean.y * b + mean.z * f.outward).normalize_or(f.outward), f.wo);
    let tangent = tangent(f.along, n);
    let alpha = maps.alpha2.as_ref().map_or(-1.0, |m| m.sample(f.uv.x, f.uv.y, uv)[0].max(0.0).sqrt());
    let mut lobe = PointLobe { alpha, ..PointLobe::PLAIN };
    if let Some(c) = &maps.colours {
        [lobe.albedo, lobe.f0] = [&c.albedo, &c.f0].map(|t| t.sample(f.uv.x, f.uv.y, uv).map(|x| x.max(0.0)));
    }
    if maps.filtering != NormalFiltering::None {
        // A tilt of (dx, dy) of a unit normal tilts its z by −(x dx + y dy)/z.
        let z = mean.z.max(LEAST_Z);
        let (x, y) = (t - f.outward * (mean.x / z), b - f.outward * (mean.y / z));
        let spread = turned(spread, [x, y], [tangent, n.cross(tangent)]);
        lobe.least = least(f.bend * length, angle);
        match maps.filtering {
            NormalFiltering::Isotropic => lobe.widen = spread[0] + spread[2],
            _ => lobe.spread = spread,
        }
    }
    ShadingPoint { n, t: tangent, lobe }
}

/// J Σ Jᵀ, J from the axes `from` to the components along `to`.
fn turned([xx, xy, yy]: [f32; 3], from: [Vec3; 2], to: [Vec3; 2]) -> [f32; 3] {
    let row = |e: Vec3| (from[0].dot(e), from[1].dot(e));
    let ((a, b), (c, d)) = (row(to[0]), row(to[1]));
    [
        a * a * xx + 2.0 * a * b * xy + b * b * yy,
        a * c * xx + (a * d + b * c) * xy + b * d * yy,
        c * c * xx + 2.0 * c * d * xy + d * d * yy,
    ]
}

/// The alpha whose lobe is as wide as the reflection of the sample: a normal that turns by `tilt` across it
/// and a view that turns by `angle` sweep r over w = 2 tilt + angle, of variance w²/12; a lobe of alpha has 2
/// alpha².
fn least(tilt: f32, angle: f32) -> f32 {
    ((2.0 * tilt + angle) / 24.0f32.sqrt()).min(1.0)
}

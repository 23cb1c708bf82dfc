//! Two lookups in the stack; `shade.wgsl` has the same functions.

use super::bake::ConeMaps;
use crate::gpu::{Entry, Uniform, Value};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::maths::angle::angle;
use crate::shared::maths::vector::{cross, dot, tangent};
use crate::{GpuTechnique, Points, Radiance, Technique};
use std::f32::consts::FRAC_PI_2;

/// The angle between t and ±wo, 0 … π/2; `y` = |t·wo|.
#[inline(always)]
fn alpha(t: [f32; 3], wo: [f32; 3], y: f32) -> f32 {
    let c = cross(t, wo);
    let s = dot(c, c).sqrt().min(1.0);
    angle(s, y)
}

/// G(±t, α).
#[inline(always)]
fn radiance(m: &ConeMaps, turn: &LightRotation, t: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    let y = dot(t, wo);
    let sign = if y < 0.0 { -m.sign } else { m.sign };
    let d = turn.apply(t.map(|x| sign * x));
    let (a, b, w) = m.maps.around(alpha(t, wo, y.abs().min(1.0)) * (m.maps.last() / FRAC_PI_2));
    let (a, b) = (a.sample(d), b.sample(d));
    std::array::from_fn(|c| m.scale[c] * (a[c] + (b[c] - a[c]) * w))
}

pub(super) fn shade(m: &ConeMaps, turn: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
    let tangents = !q.t.iter().any(|t| t.is_empty());
    steradian_simd::dispatch(|| {
        for i in 0..out.len() {
            let at = |v: &[&[f32]; 3]| v.map(|s| s[i]);
            let (n, wo) = (at(&q.n), at(&q.wo));
            let t = if tangents { at(&q.t) } else { tangent(n) };
            // False for NaN too.
            let l = if dot(n, wo) > 0.0 { radiance(m, turn, t, wo) } else { [0.0; 3] };
            (0..3).for_each(|c| out.rgb[c][i] = l[c]);
        }
    });
}

pub(super) fn gpu(m: &ConeMaps, turn: &LightRotation) -> GpuTechnique {
    let [r, g, b] = m.scale;
    let slices = m.maps.last() / FRAC_PI_2;
    GpuTechnique {
        slug: super::BanksEnv::CARD.slug,
        modules: vec![include_str!("shade.wgsl").into()],
        entry: Entry::PLAIN,
        tables: vec![m.maps.table("cones")],
        uniforms: vec![
            turn.uniform(),
            Uniform { name: "scale", value: Value::Vec4([r, g, b, m.sign]) },
            Uniform { name: "per_angle", value: Value::F32(slices) },
        ],
        buffers: Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_exact_at_both_ends() {
        for k in 0..=10_000 {
            let a = std::f64::consts::FRAC_PI_2 * f64::from(k) / 1e4;
            let wo = [a.cos() as f32, (a.sin() * 0.6) as f32, (a.sin() * 0.8) as f32];
            let got = alpha([1.0, 0.0, 0.0], wo, wo[0]);
            assert!((f64::from(got) - a).abs() < 3e-7, "{a}: {got}");
        }
    }

    #[test]
    fn the_tangent_of_nothing_is_that_of_the_conventions() {
        for n in [glam::DVec3::new(0.2, 0.5, -0.8), glam::DVec3::Y, glam::DVec3::NEG_Y, glam::DVec3::X] {
            let n = n.normalize();
            let (t, f) = (tangent(n.as_vec3().to_array()), steradian_sphere::Frame::from_normal(n));
            assert!((0..3).all(|k| (f64::from(t[k]) - f.t[k]).abs() < 1e-6), "{n}: {t:?} {:?}", f.t);
        }
    }
}

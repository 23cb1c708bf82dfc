//! The error at texels, against the sums in double precision or the reflectance.

use super::bake::Polynomials;
use super::shade;
use crate::Material;
use crate::local::{Place, error_at, texel};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_relight::polynomial::{Basis, evaluate};

/// The sum at a texel in double precision.
fn summed<const N: usize>(t: &Polynomials, at: Place, wi: DVec3) -> [f64; 3] {
    let all: [[f32; 3]; N] = std::array::from_fn(|k| t.texels.sample(k, at.uv, 0.0));
    [0, 1, 2].map(|c| evaluate(&all.map(|a| f64::from(a[c])), wi))
}

pub(super) fn error(t: &Polynomials, m: &Material) -> f64 {
    let size = t.texels.size();
    let shaded = |at, wi, _: [f32; 3]| shade::f_cos(t, &shade::texel(t, at), wi);
    let place = |k| texel(k, size).0;
    if !t.mapped {
        return error_at(&*m.brdf, place, |_, wi, wo| m.brdf.f_cos(wi, wo), shaded);
    }
    let exact = |at: Place, wi: DVec3, _: DVec3| {
        let value = match t.basis {
            Basis::Biquadratic => summed::<6>(t, at, wi),
            Basis::Harmonics9 => summed::<9>(t, at, wi),
            Basis::Harmonics16 => summed::<16>(t, at, wi),
        };
        value.map(|v| v.max(0.0) / PI)
    };
    error_at(&*m.brdf, place, exact, shaded)
}

//! The models by the covariance of their slopes; `shade.wgsl` has the same functions.

use super::bake::{Model, Varied};
use crate::gpu::{Uniform, Value};
use crate::local::{LocalText, Place};
use crate::shared::maths::vector::dot;
use crate::shared::surface::bumps;
use std::f32::consts::{FRAC_1_PI, TAU};

/// Keeps divisors from zero; a square of it is no denormal number.
const TINY: f32 = 1e-18;

/// Data of a point.
#[derive(Debug, Clone, Copy)]
pub struct Texel {
    /// Tangent, bitangent and normal of the bump.
    frame: [[f32; 3]; 3],
    /// The direction to the viewer in this frame.
    wo: [f32; 3],
    /// Covariance of the slopes: xx, xy, yy; its inverse; and the root of its determinant.
    sigma: [f32; 3],
    inverse: [f32; 3],
    root: f32,
    /// For (n·h)ᴺ: the factor by which widening lowers the peak.
    peak: f32,
    /// For Lafortune's lobe: C along the normal, and n.
    lobe: [f32; 2],
    specular: [f32; 3],
    albedo: [f32; 3],
}

/// sᵀ M s.
#[inline(always)]
fn form([xx, xy, yy]: [f32; 3], [x, y]: [f32; 2]) -> f32 {
    xx * x * x + 2.0 * xy * x * y + yy * y * y
}

#[inline(always)]
pub(super) fn texel(t: &Varied, at: Place, wo: [f32; 3]) -> Texel {
    let layer = |k: usize| t.texels.sample(k, at.uv, at.footprint);
    let [x, y, _] = layer(0);
    let (moments, own) = (layer(1), layer(2));
    let length = (x * x + y * y + 1.0).sqrt();
    let n = bumps::facing([x / length, y / length, 1.0 / length], wo);
    let [a, b] = bumps::frame(n);
    let frame = [a, b, n];
    // Covariance of the normals' slopes; of a single normal it is rounding.
    let scatter = [moments[0] - x * x, moments[1] - x * y, moments[2] - y * y];
    let real = scatter[0] + scatter[2] > 1e-5 * (1e-3 + moments[0] + moments[2]);
    let sigma: [f32; 3] = if real { std::array::from_fn(|k| own[k] + scatter[k]) } else { own };
    if t.model == Model::Lafortune {
        let [cz, inverse_n, _] = layer(5);
        // A mirror turns light twice as far as the normal.
        let wide = if real { inverse_n + 2.0 * (scatter[0] + scatter[2]) } else { inverse_n };
        // 1/(n + 1) of both.
        let peak = if real { inverse_n * (1.0 + wide) / (wide * (1.0 + inverse_n)) } else { 1.0 };
        return Texel {
            frame,
            wo: frame.map(|e| dot(e, wo)),
            sigma: own,
            inverse: [0.0; 3],
            root: 1.0,
            peak,
            lobe: [cz, wide.max(1e-30).recip()],
            specular: layer(3),
            albedo: layer(4),
        };
    }
    let det = (sigma[0] * sigma[2] - sigma[1] * sigma[1]).max(1e-36);
    let root = det.sqrt();
    let narrow = (own[0] * own[2] - own[1] * own[1]).max(1e-36).sqrt();
    let inverse = [sigma[2] / det, -sigma[1] / det, sigma[0] / det];
    let scale = |v: [f32; 3]| -> [f32; 3] { std::array::from_fn(|c| v[c] * t.scale[c] as f32) };
    let (specular, albedo) = (layer(3), layer(4));
    // A scaled GGX has its factor behind Fresnel's term.
    let specular = if t.model == Model::Ggx { specular } else { scale(specular) };
    Texel {
        frame,
        wo: frame.map(|e| dot(e, wo)),
        sigma,
        inverse,
        root,
        peak: narrow / root,
        lobe: [0.0; 2],
        specular,
        albedo,
    }
}

/// The lobe times the cosine, without its factor, and wi·h.
#[inline(always)]
fn lobe(model: Model, x: &Texel, wi: [f32; 3]) -> f32 {
    let wo = x.wo;
    let h: [f32; 3] = std::array::from_fn(|k| wi[k] + wo[k]);
    let square = dot(h, h).max(TINY);
    match model {
        Model::Ggx => {
            let s = h.map(|v| v / square.sqrt());
            let q = 0.5 * form(x.inverse, [s[0], s[1]]) + s[2] * s[2];
            let long = |w: [f32; 3]| (2.0 * form(x.sigma, [w[0], w[1]]) + w[2] * w[2]).sqrt();
            let masking = long(wi) * wo[2] + long(wo) * wi[2];
            0.5 * wi[2] / ((TAU * x.root * q * q) * masking.max(TINY))
        }
        Model::Lafortune => {
            let [xx, xy, yy] = x.sigma;
            let axis = [xx * wo[0] + xy * wo[1], xy * wo[0] + yy * wo[1], x.lobe[0] * wo[2]];
            let cosine = dot(axis, wi);
            if cosine > 0.0 { x.peak * cosine.powf(x.lobe[1]) * wi[2] } else { 0.0 }
        }
        Model::Blinn => {
            let s = h.map(|v| v / square.sqrt());
            let sine = s[0] * s[0] + s[1] * s[1];
            let exponent = if sine > 1e-12 { form(x.inverse, [s[0], s[1]]) / sine } else { x.inverse[0] };
            if s[2] > 0.0 { x.peak * (0.5 * exponent * bumps::log_less(sine.min(1.0))).exp() } else { 0.0 }
        }
        _ => {
            let z = h[2].max(TINY);
            let e = (-0.5 * form(x.inverse, [h[0] / z, h[1] / z])).exp() / (TAU * x.root);
            if e == 0.0 {
                return 0.0;
            }
            let cosines = (wi[2] * wo[2]).max(1e-37);
            let z2 = (z * z).max(TINY);
            wi[2]
                * match model {
                    Model::Duer => 0.25 * e / cosines,
                    Model::Ward => 0.25 * e / cosines.sqrt(),
                    _ => e * (square / z2) / z2,
                }
        }
    }
}

#[inline(always)]
pub(super) fn f_cos(t: &Varied, x: &Texel, wi: [f32; 3]) -> [f32; 3] {
    let w = x.frame.map(|e| dot(e, wi));
    // False for NaN too.
    if !(wi[2] > 0.0 && w[2] > 0.0 && x.wo[2] > 0.0) {
        return [0.0; 3];
    }
    let lobe = lobe(t.model, x, w);
    let sum: [f32; 3] = std::array::from_fn(|k| w[k] + x.wo[k]);
    let away = (1.0 - 0.5 * dot(sum, sum).sqrt()).clamp(0.0, 1.0);
    let fresnel = away * away * away * away * away;
    std::array::from_fn(|c| {
        let factor = match t.model {
            Model::Ggx => t.scale[c] as f32 * (x.specular[c] + (1.0 - x.specular[c]) * fresnel),
            _ => x.specular[c],
        };
        (factor * lobe + x.albedo[c] * FRAC_1_PI * w[2]).min(f32::MAX)
    })
}

pub(super) fn text(t: &Varied) -> LocalText {
    let [r, g, b] = t.scale.map(|x| x as f32);
    LocalText {
        module: [bumps::TEXT, include_str!("shade.wgsl")].concat().into(),
        tables: vec![t.texels.table("local_varied")],
        uniforms: vec![Uniform {
            name: "local_model",
            value: Value::Vec4([r, g, b, f32::from(t.model as u8)]),
        }],
        buffers: Vec::new(),
    }
}

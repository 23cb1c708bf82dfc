//! The equation at a texel; `shade.wgsl` has the same functions.

use super::bake::{Bumped, MEAN, TOKSVIG};
use crate::gpu::{Uniform, Value};
use crate::local::{LocalText, Place};
use crate::shared::maths::vector::dot;
use crate::shared::surface::bumps;

/// Least z of a mean normal with which covariances are projected.
const LEAST_Z: f32 = 0.1;

/// Data of a point.
#[derive(Debug, Clone, Copy)]
pub struct Texel {
    /// Mean normal, as long as the normals under the point agree.
    pub mean: [f32; 3],
    /// Unit normal of the highlight, tangent and bitangent across it.
    pub frame: [[f32; 3]; 3],
    /// Exponents of the highlight along tangent and bitangent: tt, tb, bb of (I/N + Σ)⁻¹.
    pub lobe: [f32; 3],
    /// Height of the highlight's peak.
    pub peak: f32,
}

/// Covariance of the unit normals' x and y as that of their parts along tangent and bitangent: a tilt of (dx,
/// dy) tilts z by −(x dx + y dy)/z.
#[inline(always)]
fn turned([xx, xy, yy]: [f32; 3], n: [f32; 3], [t, b]: [[f32; 3]; 2]) -> [f32; 3] {
    let z = n[2].max(LEAST_Z);
    let row = |e: [f32; 3]| [e[0] - e[2] * n[0] / z, e[1] - e[2] * n[1] / z];
    let ([p, q], [r, s]) = (row(t), row(b));
    [
        p * p * xx + 2.0 * p * q * xy + q * q * yy,
        p * r * xx + (p * s + q * r) * xy + q * s * yy,
        r * r * xx + 2.0 * r * s * xy + s * s * yy,
    ]
}

#[inline(always)]
pub(super) fn texel(t: &Bumped, at: Place) -> Texel {
    let mean = t.texels.sample(0, at.uv, at.footprint);
    let (n, length) = bumps::unit(mean);
    let [a, b] = bumps::frame(n);
    let e = t.n as f32;
    let (mut lobe, mut peak) = ([e, 0.0, e], 1.0);
    if t.filter == TOKSVIG {
        let less = e * length / (length + e * (1.0 - length).max(0.0));
        (lobe, peak) = ([less, 0.0, less], (1.0 + less) / (1.0 + e));
    } else if t.filter != MEAN {
        let [xx, xy, yy] = turned(t.texels.sample(1, at.uv, at.footprint), n, [a, b]).map(|s| s * e);
        let det = (1.0 + xx) * (1.0 + yy) - xy * xy;
        (lobe, peak) = ([(1.0 + yy) * e / det, -xy * e / det, (1.0 + xx) * e / det], 1.0 / det.sqrt());
    }
    Texel { mean: if t.filter == MEAN { n } else { mean }, frame: [n, a, b], lobe, peak }
}

#[inline(always)]
pub(super) fn f_cos(t: &Bumped, x: &Texel, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    let [n, a, b] = x.frame;
    // False for NaN too.
    if !(wi[2] > 0.0 && dot(n, wi) > 0.0) {
        return [0.0; 3];
    }
    let s = if t.ramp { (8.0 * wi[2]).min(1.0) } else { 1.0 };
    let sum = [wi[0] + wo[0], wi[1] + wo[1], wi[2] + wo[2]];
    let length = dot(sum, sum).sqrt();
    let h = sum.map(|v| v / length);
    let (u, v) = (dot(h, a), dot(h, b));
    let square = u * u + v * v;
    let [uu, uv, vv] = x.lobe;
    let exponent = if square > 1e-12 { (uu * u * u + 2.0 * uv * u * v + vv * v * v) / square } else { uu };
    let power = if dot(n, h) > 0.0 {
        x.peak * (0.5 * exponent * bumps::log_less(square.min(1.0))).exp()
    } else {
        0.0
    };
    let diffuse = std::f32::consts::FRAC_1_PI * dot(x.mean, wi).max(0.0);
    std::array::from_fn(|c| s * (t.kd[c] as f32 * diffuse + t.ks[c] as f32 * power))
}

pub(super) fn text(t: &Bumped) -> LocalText {
    let four = |v: [f64; 3], w: f64| Value::Vec4([v[0] as f32, v[1] as f32, v[2] as f32, w as f32]);
    LocalText {
        module: [bumps::TEXT, include_str!("shade.wgsl")].concat().into(),
        tables: vec![t.texels.table("local_normals")],
        uniforms: vec![
            Uniform { name: "local_kd", value: four(t.kd, f64::from(u8::from(t.ramp))) },
            Uniform { name: "local_ks", value: four(t.ks, t.n) },
            Uniform { name: "local_filter", value: Value::F32(t.filter as f32) },
        ],
        buffers: Vec::new(),
    }
}

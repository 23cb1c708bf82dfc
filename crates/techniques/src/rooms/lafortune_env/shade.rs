//! Irradiance, and per term one lookup in the stack; `shade.wgsl` has the same functions.

use super::bake::{COLUMNS, LafortuneMaps, STRIDE};
use crate::gpu::{Buffer, Entry, Format, Level, Shape, Table, Uniform, Value};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::maths::vector::{cross, dot, tangent};
use crate::shared::tables::{cube_table, texel_bytes};
use crate::{GpuTechnique, Points, Radiance, Technique};

/// The cosine's mean over the lobe of `level` at n·r̂ = `cosine`, bilinear.
#[inline(always)]
fn mean_cosine(m: &LafortuneMaps, cosine: f32, level: f32) -> f32 {
    let rows = m.means.len() / COLUMNS;
    let x = (0.5 + 0.5 * cosine).clamp(0.0, 1.0) * (COLUMNS - 1) as f32;
    let y = level.clamp(0.0, (rows - 1) as f32);
    let (i, j) = ((x as usize).min(COLUMNS - 2), (y as usize).min(rows - 2));
    let (u, v) = (x - i as f32, y - j as f32);
    let at = |i: usize, j: usize| m.means[j * COLUMNS + i];
    let top = at(i, j) + (at(i + 1, j) - at(i, j)) * u;
    let bottom = at(i, j + 1) + (at(i + 1, j + 1) - at(i, j + 1)) * u;
    top + (bottom - top) * v
}

/// ⟨n·wi⟩ of a lobe whose axis has n·r̂ = `cosine`.
#[inline(always)]
fn foreshortening(m: &LafortuneMaps, cosine: f32, cos_o: f32, level: f32) -> f32 {
    match m.factors[3] {
        0.0 => cosine.max(0.0),
        1.0 => cos_o,
        _ => mean_cosine(m, cosine, level),
    }
}

#[inline(always)]
fn radiance(m: &LafortuneMaps, turn: &LightRotation, n: [f32; 3], t: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
    let cos_o = dot(n, wo);
    if cos_o <= 0.0 || cos_o.is_nan() {
        return [0.0; 3];
    }
    let b = cross(n, t);
    let local = [dot(wo, t), dot(wo, b), cos_o];
    let e = m.diffuse.sample(turn.apply(n));
    let mut sum: [f32; 3] = std::array::from_fn(|c| m.factors[c] * e[c]);
    for term in &m.terms {
        let c: [f32; 3] = std::array::from_fn(|k| term[k] * local[k]);
        let length = dot(c, c).sqrt();
        if length > 0.0 {
            let (level, axis) = (term[4], c.map(|x| x / length));
            let r = std::array::from_fn(|k| axis[0] * t[k] + axis[1] * b[k] + axis[2] * n[k]);
            let (near, far, w) = m.chain.around(level);
            let (l0, l1) = (near.sample(turn.apply(r)), far.sample(turn.apply(r)));
            let factor = foreshortening(m, axis[2], cos_o, level) * length.powf(term[3]);
            (0..3).for_each(|c| sum[c] += factor * term[5 + c] * (l0[c] + (l1[c] - l0[c]) * w));
        }
    }
    sum
}

pub(super) fn shade(m: &LafortuneMaps, turn: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
    steradian_simd::dispatch(|| {
        for i in 0..out.len() {
            let at = |v: &[&[f32]; 3]| v.map(|s| s[i]);
            let n = at(&q.n);
            let t = if q.t[0].is_empty() { tangent(n) } else { at(&q.t) };
            let l = radiance(m, turn, n, t, at(&q.wo));
            (0..3).for_each(|c| out.rgb[c][i] = l[c]);
        }
    });
}

pub(super) fn gpu(m: &LafortuneMaps, turn: &LightRotation) -> GpuTechnique {
    let rows = m.means.len() / COLUMNS;
    let texels: Vec<[f32; 4]> = m.means.iter().map(|v| [*v; 4]).collect();
    let level = Level { width: COLUMNS, height: rows, layers: 1, bytes: texel_bytes(texels.iter()) };
    let cosines = Table { name: "cosines", shape: Shape::Plane, format: Format::Rgba32Float, level };
    let counts = [m.terms.len() as f32, (rows - 1) as f32, 0.0, 0.0];
    GpuTechnique {
        slug: super::LafortuneEnv::CARD.slug,
        modules: vec![include_str!("shade.wgsl").into()],
        entry: Entry::PLAIN,
        tables: vec![m.chain.table("phong"), cube_table("irradiance", &m.diffuse), cosines],
        uniforms: vec![
            turn.uniform(),
            Uniform { name: "factors", value: Value::Vec4(m.factors) },
            Uniform { name: "counts", value: Value::Vec4(counts) },
        ],
        buffers: vec![Buffer::new("terms", STRIDE, m.terms.as_flattened().to_vec())],
    }
}

//! Irradiance, and per term one lookup in the stack; `shade.wgsl` has the same functions, `texels.wgsl` those
//! of lobes that vary by texel.

use super::bake::{COLUMNS, LafortuneMaps, STRIDE};
use crate::gpu::{Buffer, Entry, Format, Level, Shape, Table, Uniform, Value};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::maths::vector::{cross, dot, tangent};
use crate::shared::surface::cosine_lobes::{CosineLobes, Lobe, Texel};
use crate::shared::tables::{cube_table, texel_bytes};
use crate::{GpuTechnique, Points, Radiance, Technique};
use std::f32::consts::TAU;

/// Relative difference below which parameters of two channels count as equal.
const ALIKE: f32 = 1e-5;

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

/// Radiance of a lobe: `k` times the filtered light about `c`, at a point with these axes; `c` need not be
/// unit.
#[inline(always)]
fn lit(
    m: &LafortuneMaps,
    turn: &LightRotation,
    [t, b, n]: [[f32; 3]; 3],
    c: [f32; 3],
    [exponent, level, cos_o]: [f32; 3],
    k: [f32; 3],
) -> [f32; 3] {
    let length = dot(c, c).sqrt();
    if length > 0.0 {
        let axis = c.map(|x| x / length);
        let r = std::array::from_fn(|k| axis[0] * t[k] + axis[1] * b[k] + axis[2] * n[k]);
        let (near, far, w) = m.chain.around(level);
        let (l0, l1) = (near.sample(turn.apply(r)), far.sample(turn.apply(r)));
        let factor = foreshortening(m, axis[2], cos_o, level) * length.powf(exponent);
        std::array::from_fn(|c| factor * k[c] * (l0[c] + (l1[c] - l0[c]) * w))
    } else {
        [0.0; 3]
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
        let l = lit(m, turn, [t, b, n], c, [term[3], term[4], cos_o], [term[5], term[6], term[7]]);
        (0..3).for_each(|c| sum[c] += l[c]);
    }
    sum
}

/// Do the channels of a lobe have one axis and one exponent, up to single-precision rounding?
#[inline(always)]
fn alike(lobe: &Lobe) -> bool {
    let size = ALIKE * (lobe.c[0][0].abs() + lobe.c[1][0].abs() + lobe.c[2][0].abs());
    (1..3).all(|c| {
        (lobe.n[c] - lobe.n[0]).abs() <= ALIKE * lobe.n[0]
            && lobe.c.iter().all(|v| (v[c] - v[0]).abs() <= size)
    })
}

#[inline(always)]
fn radiance_of(
    m: &LafortuneMaps,
    turn: &LightRotation,
    lobes: (usize, &Texel),
    n: [f32; 3],
    t: [f32; 3],
    wo: [f32; 3],
) -> [f32; 3] {
    let cos_o = dot(n, wo);
    if cos_o <= 0.0 || cos_o.is_nan() {
        return [0.0; 3];
    }
    let b = cross(n, t);
    let local = [dot(wo, t), dot(wo, b), cos_o];
    let e = m.diffuse.sample(turn.apply(n));
    let (count, texel) = lobes;
    let mut sum: [f32; 3] = std::array::from_fn(|c| texel.rho_d[c] * e[c]);
    for lobe in texel.lobes.iter().take(count) {
        let of = |c: usize, k: [f32; 3]| {
            let (axis, exponent) = (std::array::from_fn(|j| lobe.c[j][c] * local[j]), lobe.n[c]);
            let level = ((m.ladder[0] - (exponent + 1.0).ln()) * m.ladder[1]).clamp(0.0, m.chain.last());
            let k = k.map(|k| k * (TAU / (exponent + 1.0)));
            lit(m, turn, [t, b, n], axis, [exponent, level, cos_o], k)
        };
        if alike(lobe) {
            let l = of(0, lobe.rho);
            (0..3).for_each(|c| sum[c] += l[c]);
        } else {
            for c in (0..3).filter(|c| lobe.rho[*c] > 0.0) {
                sum[c] += of(c, lobe.rho)[c];
            }
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

/// [`shade`] with the lobes of each point; those without texture coordinates have the ones at (0, 0).
pub(super) fn shade_texels(
    m: &LafortuneMaps,
    lobes: &CosineLobes,
    turn: &LightRotation,
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    steradian_simd::dispatch(|| {
        for i in 0..out.len() {
            let at = |v: &[&[f32]; 3]| v.map(|s| s[i]);
            let n = at(&q.n);
            let t = if q.t[0].is_empty() { tangent(n) } else { at(&q.t) };
            let of = |v: &[f32]| v.get(i).copied().unwrap_or(0.0);
            // Charts end with the footprint.
            let texel = lobes.at(q.uv.map(of), q.chart.last().map_or(0.0, |v| of(v)));
            let l = radiance_of(m, turn, (lobes.count, &texel), n, t, at(&q.wo));
            (0..3).for_each(|c| out.rgb[c][i] = l[c]);
        }
    });
}

pub(super) fn gpu_texels(m: &LafortuneMaps, lobes: &CosineLobes, turn: &LightRotation) -> GpuTechnique {
    let mut technique = gpu(m, turn);
    let text = lobes.text("lobes");
    technique.modules.push(text.module.into());
    technique.modules.push(include_str!("texels.wgsl").into());
    technique.entry = Entry::SITE;
    technique.tables.push(text.table);
    technique.uniforms.extend(text.uniforms);
    let numbers = [m.ladder[0], m.ladder[1], m.chain.last(), 0.0];
    technique.uniforms.push(Uniform { name: "ladder", value: Value::Vec4(numbers) });
    technique
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

//! Two lookups and their blend; `shade.wgsl` has the same functions, `shade_lobe.wgsl` those of points with
//! lobes of their own.

use super::bake::PhongMaps;
use crate::gpu::{Entry, Uniform, Value};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::points::batch::{self, Point};
use crate::shared::surface::lobe::{self, Taps};
use crate::shared::tables::chain::Chain;
use crate::shared::tables::cube_table;
use crate::{GpuTechnique, Points, Radiance, Technique};
use std::f32::consts::PI;

/// F = f0 + (1 − f0)(1 − n·wo)⁵.
#[inline(always)]
fn fresnel(f: [f32; 2], cos_o: f32) -> f32 {
    let u = 1.0 - cos_o;
    f[0] + f[1] * ((u * u) * (u * u) * u)
}

pub(super) fn shade(m: &PhongMaps, turn: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
    batch::shade(q, out, |p: Point| {
        let f = fresnel(m.f, p.cos_o);
        let diffuse = m.diffuse.sample(turn.apply(p.n));
        let phong = m.phong.sample(turn.apply(p.r));
        std::array::from_fn(|c| (1.0 - f) * m.k_d_over_pi[c] * diffuse[c] + f * m.k_s[c] * phong[c])
    });
}

/// The material's alpha, the chain's first perceptual roughness, levels per perceptual roughness.
fn widths(m: &PhongMaps, lobes: &Chain) -> [f32; 3] {
    [m.alpha(), m.first(), lobes.last() / (1.0 - m.first()).max(1e-6)]
}

/// [`shade`] where every point has its own lobe: alpha determines the exponent n = 1/(2 alpha²), so the
/// lobe's own alpha gives ∫ (r·wi)^n = 2π/(n + 1); widening the lookup keeps that integral.
pub(super) fn shade_lobe(
    m: &PhongMaps,
    lobes: &Chain,
    turn: &LightRotation,
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    let [own, first, per] = widths(m, lobes);
    lobe::shade(q, out, |p| {
        let taps = Taps::new(p, own, own.min(first * first));
        let alpha = lobe::alpha_of(&p.lobe, own);
        let integral = integral(alpha, own, m.n);
        let (sharp, blurred, w) = lobes.around((taps.alpha.sqrt() - first) * per);
        let specular = taps.sum(p, |tap| {
            let (r, f) = (turn.apply(tap.r), fresnel(m.f, tap.cos_o));
            let (l0, l1) = (sharp.sample(r), blurred.sample(r));
            std::array::from_fn(|c| f * m.k_s[c] * integral * (l0[c] + (l1[c] - l0[c]) * w))
        });
        let diffuse = lobe::normals(p).map(|n| m.diffuse.sample(turn.apply(n)));
        let f = 1.0 - fresnel(m.f, p.cos_o);
        std::array::from_fn(|c| {
            let d = 0.25 * (diffuse[0][c] + diffuse[1][c] + diffuse[2][c] + diffuse[3][c]);
            f * m.k_d_over_pi[c] * d + specular[c]
        })
    });
}

/// ∫ (r·wi)₊^n dwi = 2π/(n + 1) of the exponent that `alpha` determines; where `alpha` is the material's
/// `own`, of the material's exponent `n`.
#[inline(always)]
fn integral(alpha: f32, own: f32, n: f32) -> f32 {
    let n = if alpha == own { n } else { 0.5 / (alpha * alpha).max(1e-8) };
    2.0 * PI / (n + 1.0)
}

/// [`gpu`] with a lobe per point.
pub(super) fn gpu_lobe(m: &PhongMaps, lobes: &Chain, turn: &LightRotation) -> GpuTechnique {
    let mut technique = gpu(m, turn);
    let [own, first, per] = widths(m, lobes);
    technique.modules =
        vec![lobe::WGSL.into(), include_str!("fresnel.wgsl").into(), include_str!("shade_lobe.wgsl").into()];
    technique.entry = Entry::LOBE;
    technique.tables[0] = lobes.table("lobes");
    technique.uniforms.push(Uniform { name: "widths", value: Value::Vec4([own, first, per, m.n]) });
    technique
}

pub(super) fn gpu(m: &PhongMaps, turn: &LightRotation) -> GpuTechnique {
    let vec = |name, v: [f32; 3], w: f32| Uniform { name, value: Value::Vec4([v[0], v[1], v[2], w]) };
    GpuTechnique {
        slug: super::PhongDiffuseMaps::CARD.slug,
        modules: vec![include_str!("fresnel.wgsl").into(), include_str!("shade.wgsl").into()],
        entry: Entry::PLAIN,
        tables: vec![cube_table("phong", &m.phong), cube_table("irradiance", &m.diffuse)],
        uniforms: vec![turn.uniform(), vec("k_s", m.k_s, m.f[0]), vec("k_d_over_pi", m.k_d_over_pi, m.f[1])],
        buffers: Vec::new(),
    }
}

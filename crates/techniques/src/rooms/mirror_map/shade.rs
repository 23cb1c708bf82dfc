//! One lookup along r; `shade.wgsl` has the same functions, `shade_lobe.wgsl` those of points with normals of
//! their own.

use super::bake::Mirror;
use crate::gpu::{Entry, Uniform, Value};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::points::batch::{self, Point};
use crate::shared::surface::lobe::{self, Taps};
use crate::shared::tables::chain::Chain;
use crate::shared::tables::cube_table;
use crate::{GpuTechnique, PointLobe, Points, Radiance, Technique};
use std::f32::consts::SQRT_2;
use steradian_prefilter::EdgeCube;
use steradian_prefilter::edge_cube::spacing;

/// Schlick's Fresnel term.
#[inline(always)]
fn fresnel(f0: f32, cos_o: f32) -> f32 {
    let u = 1.0 - cos_o;
    f0 + (1.0 - f0) * (u * u) * (u * u) * u
}

pub(super) fn shade(
    map: &EdgeCube,
    m: &Mirror,
    turn: &LightRotation,
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    batch::shade(q, out, |p: Point| {
        let l = map.sample(turn.apply(p.r));
        std::array::from_fn(|c| m.scale[c] * fresnel(m.f0[c], p.cos_o) * l[c])
    });
}

/// Standard deviation of a lookup of the map itself.
fn finest(map: &Chain) -> f32 {
    0.5 * spacing(map.levels()[0].size()) as f32
}

/// [`shade`] where every point has its own normals. A mirror has no width of its own: a lookup whose lobe has
/// the variance 2 alpha² per axis takes the level of that deviation, which doubles from level to level.
pub(super) fn shade_lobe(
    map: &Chain,
    m: &Mirror,
    turn: &LightRotation,
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    let finest = finest(map);
    lobe::shade(q, out, |p| {
        let p = &lobe::Point { lobe: PointLobe { alpha: -1.0, ..p.lobe }, ..*p };
        let taps = Taps::new(p, 0.0, finest);
        let (sharp, blurred, w) = map.around((SQRT_2 * taps.alpha / finest).max(1.0).log2());
        taps.sum(p, |tap| {
            let r = turn.apply(tap.r);
            let (l0, l1) = (sharp.sample(r), blurred.sample(r));
            std::array::from_fn(|c| m.scale[c] * fresnel(m.f0[c], tap.cos_o) * (l0[c] + (l1[c] - l0[c]) * w))
        })
    });
}

/// [`gpu`] with normals per point.
pub(super) fn gpu_lobe(map: &Chain, m: &Mirror, turn: &LightRotation) -> GpuTechnique {
    GpuTechnique {
        modules: vec![
            lobe::WGSL.into(),
            include_str!("fresnel.wgsl").into(),
            include_str!("shade_lobe.wgsl").into(),
        ],
        entry: Entry::LOBE,
        tables: vec![map.table("environment")],
        uniforms: uniforms(m, turn, finest(map)),
        ..gpu(&map.levels()[0], m, turn)
    }
}

fn uniforms(m: &Mirror, turn: &LightRotation, finest: f32) -> Vec<Uniform> {
    let vec = |name, [r, g, b]: [f32; 3], w| Uniform { name, value: Value::Vec4([r, g, b, w]) };
    vec![turn.uniform(), vec("f0", m.f0, finest), vec("scale", m.scale, 0.0)]
}

pub(super) fn gpu(map: &EdgeCube, m: &Mirror, turn: &LightRotation) -> GpuTechnique {
    GpuTechnique {
        slug: super::MirrorMap::CARD.slug,
        modules: vec![include_str!("fresnel.wgsl").into(), include_str!("shade.wgsl").into()],
        entry: Entry::PLAIN,
        tables: vec![cube_table("environment", map)],
        uniforms: uniforms(m, turn, 0.0),
        buffers: Vec::new(),
    }
}

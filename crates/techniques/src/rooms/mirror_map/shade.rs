//! One lookup along r; `shade.wgsl` has the same functions.

use super::bake::Mirror;
use crate::gpu::{Uniform, Value};
use crate::shared::batch::{self, Point};
use crate::shared::tables::cube_table;
use crate::shared::turn::Turn;
use crate::{GpuRoom, Points, Radiance, Technique};
use steradian_prefilter::EdgeCube;

/// Schlick's Fresnel term.
#[inline(always)]
fn fresnel(f0: f32, cos_o: f32) -> f32 {
    let u = 1.0 - cos_o;
    f0 + (1.0 - f0) * (u * u) * (u * u) * u
}

pub(super) fn shade(map: &EdgeCube, m: &Mirror, turn: &Turn, q: &Points<'_>, out: &mut Radiance<'_>) {
    batch::shade(q, out, |p: Point| {
        let l = map.sample(turn.apply(p.r));
        std::array::from_fn(|c| m.scale[c] * fresnel(m.f0[c], p.cos_o) * l[c])
    });
}

pub(super) fn gpu(map: &EdgeCube, m: &Mirror, turn: &Turn) -> GpuRoom {
    let vec = |name, v: [f32; 3]| Uniform { name, value: Value::Vec4([v[0], v[1], v[2], 0.0]) };
    GpuRoom {
        slug: super::MirrorMap::CARD.slug,
        wgsl: include_str!("shade.wgsl"),
        tables: vec![cube_table("environment", map)],
        uniforms: vec![turn.uniform(), vec("f0", m.f0), vec("scale", m.scale)],
        buffers: Vec::new(),
    }
}

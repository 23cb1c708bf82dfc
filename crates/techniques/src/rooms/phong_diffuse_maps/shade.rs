//! Two lookups and their blend; `shade.wgsl` has the same functions.

use super::bake::Maps;
use crate::gpu::{Uniform, Value};
use crate::shared::batch::{self, Point};
use crate::shared::tables::cube_table;
use crate::shared::turn::Turn;
use crate::{GpuRoom, Points, Radiance, Technique};

/// F = f0 + (1 − f0)(1 − n·wo)⁵.
#[inline(always)]
fn fresnel(f: [f32; 2], cos_o: f32) -> f32 {
    let u = 1.0 - cos_o;
    f[0] + f[1] * ((u * u) * (u * u) * u)
}

pub(super) fn shade(m: &Maps, turn: &Turn, q: &Points<'_>, out: &mut Radiance<'_>) {
    batch::shade(q, out, |p: Point| {
        let f = fresnel(m.f, p.cos_o);
        let diffuse = m.diffuse.sample(turn.apply(p.n));
        let phong = m.phong.sample(turn.apply(p.r));
        std::array::from_fn(|c| (1.0 - f) * m.k_d_over_pi[c] * diffuse[c] + f * m.k_s[c] * phong[c])
    });
}

pub(super) fn gpu(m: &Maps, turn: &Turn) -> GpuRoom {
    let vec = |name, v: [f32; 3], w: f32| Uniform { name, value: Value::Vec4([v[0], v[1], v[2], w]) };
    GpuRoom {
        slug: super::PhongDiffuseMaps::CARD.slug,
        wgsl: include_str!("shade.wgsl"),
        tables: vec![cube_table("phong", &m.phong), cube_table("irradiance", &m.diffuse)],
        uniforms: vec![turn.uniform(), vec("k_s", m.k_s, m.f[0]), vec("k_d_over_pi", m.k_d_over_pi, m.f[1])],
        buffers: Vec::new(),
    }
}

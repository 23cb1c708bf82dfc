//! One trilinear lookup along r, one in the albedo table; `shade.wgsl` has the same functions.

use super::bake::Specular;
use crate::gpu::{Format, Level, Shape, Table, Uniform, Value};
use crate::shared::batch::{self, Point};
use crate::shared::chain::Chain;
use crate::shared::quadric::Quadric;
use crate::shared::tables::texel_bytes;
use crate::shared::turn::Turn;
use crate::{GpuRoom, Points, Radiance, Technique};

/// Fdez-Agüera 2019: F_ms E_ms = E_ss F_avg/(1 − F_avg E_ms) · E_ms with E_ms = 1 − (A + B), E_ss = f0 A + B and
/// F_avg = f0 + (1 − f0)/21.
#[inline(always)]
pub(super) fn multiscatter(s: &Specular, [a, b]: [f32; 2]) -> [f32; 3] {
    let e_ms = 1.0 - (a + b);
    std::array::from_fn(|c| {
        let f_avg = s.f0[c] + (1.0 - s.f0[c]) / 21.0;
        s.multiscatter * (s.f0[c] * a + b) * f_avg / (1.0 - f_avg * e_ms) * e_ms
    })
}

pub(super) fn shade(
    chain: &Chain,
    s: &Specular,
    (turn, mean_radiance): &(Turn, Quadric),
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    let (sharp, blurred, w) = chain.around(s.level);
    batch::shade(q, out, |p: Point| {
        let r = turn.apply(p.r);
        let (l0, l1) = (sharp.sample(r), blurred.sample(r));
        let [a, b] = s.albedo_at(p.cos_o);
        let ms = multiscatter(s, [a, b]);
        let e = mean_radiance.value(p.n);
        std::array::from_fn(|c| {
            let l = l0[c] + (l1[c] - l0[c]) * w;
            s.scale[c] * ((s.f0[c] * a + b) * l + ms[c] * e[c])
        })
    });
}

pub(super) fn gpu(chain: &Chain, s: &Specular, (turn, mean_radiance): &(Turn, Quadric)) -> GpuRoom {
    let vec = |name, v: [f32; 3], w: f32| Uniform { name, value: Value::Vec4([v[0], v[1], v[2], w]) };
    let level = Level { width: s.albedo.len(), height: 1, layers: 1, bytes: texel_bytes(s.albedo.iter()) };
    let albedo = Table { name: "albedo", shape: Shape::Line, format: Format::Rgba32Float, level };
    let mut uniforms = vec![turn.uniform(), vec("f0", s.f0, s.level), vec("scale", s.scale, s.multiscatter)];
    uniforms.extend(mean_radiance.uniforms(["red", "green", "blue"]));
    GpuRoom {
        slug: super::SplitSum::CARD.slug,
        wgsl: include_str!("shade.wgsl"),
        tables: vec![chain.table("chain"), albedo],
        uniforms,
        buffers: Vec::new(),
    }
}

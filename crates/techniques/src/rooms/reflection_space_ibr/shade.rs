//! Three lookups along r in the maps of the three nearest views; `shade.wgsl` has the same functions.

use super::bake::Maps;
use super::icosahedron::around;
use crate::gpu::{Format, Level, Shape, Table, Uniform, Value};
use crate::shared::batch::{self, Point};
use crate::shared::tables::{cube_table, texel_bytes};
use crate::shared::turn::Turn;
use crate::{GpuRoom, Points, Radiance, Technique};

pub(super) fn shade(m: &Maps, turn: &Turn, q: &Points<'_>, out: &mut Radiance<'_>) {
    let views = m.views.levels();
    batch::shade(q, out, |p: Point| {
        let wo = turn.apply(std::array::from_fn(|k| 2.0 * p.cos_o * p.n[k] - p.r[k]));
        let (r, n) = (turn.apply(p.r), turn.apply(p.n));
        let ([i, j, k], w) = around(wo);
        let (a, b, c) = (views[i].sample(r), views[j].sample(r), views[k].sample(r));
        let e = m.irradiance.sample(n);
        std::array::from_fn(|x| w[0] * a[x] + w[1] * b[x] + w[2] * c[x] + m.diffuse[x] * e[x])
    });
}

pub(super) fn gpu(m: &Maps, turn: &Turn) -> GpuRoom {
    let [r, g, b] = m.diffuse;
    let views = m.views.levels();
    let n = views[0].size() + 1;
    let bytes = texel_bytes(views.iter().flat_map(|c| c.texels()));
    let level = Level { width: n, height: n, layers: 6 * views.len(), bytes };
    let views = Table { name: "views", shape: Shape::CubeStack, format: Format::Rgba32Float, level };
    GpuRoom {
        slug: super::ReflectionSpaceIbr::CARD.slug,
        wgsl: include_str!("shade.wgsl"),
        tables: vec![views, cube_table("irradiance", &m.irradiance)],
        uniforms: vec![turn.uniform(), Uniform { name: "diffuse", value: Value::Vec4([r, g, b, 0.0]) }],
        buffers: Vec::new(),
    }
}

//! Three lookups in the maps of the three nearest views; `shade.wgsl` has the same functions.

use super::bake::ViewMaps;
use super::icosahedron::{around, view};
use crate::gpu::{Entry, Format, Level, Shape, Table, Uniform, Value};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::points::batch::{self, Point};
use crate::shared::tables::{cube_table, texel_bytes};
use crate::{GpuTechnique, Points, Radiance, Technique};

/// Views that see a surface at a cosine below this get less weight, and none from behind.
const SEEN: f32 = 0.1;

/// Direction in which the map of view `k` holds the normal `n`, and the share of its weight that counts.
#[inline(always)]
fn same_normal(k: usize, n: [f32; 3]) -> ([f32; 3], f32) {
    let v = view(k);
    let c = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];
    (std::array::from_fn(|x| 2.0 * c * n[x] - v[x]), (c / SEEN).clamp(0.0, 1.0))
}

/// Σ w_i B_i(n) over the views that see the surface.
#[inline(always)]
fn by_normal(m: &ViewMaps, index: [usize; 3], weight: [f32; 3], n: [f32; 3]) -> [f32; 3] {
    let (mut sum, mut all) = ([0.0; 3], 0.0);
    for k in 0..3 {
        let (r, share) = same_normal(index[k], n);
        let (w, l) = (weight[k] * share, m.views.levels()[index[k]].sample(r));
        (0..3).for_each(|c| sum[c] += w * l[c]);
        all += w;
    }
    sum.map(|l| if all > 0.0 { l / all } else { 0.0 })
}

pub(super) fn shade(m: &ViewMaps, turn: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
    let views = m.views.levels();
    batch::shade(q, out, |p: Point| {
        let wo = turn.apply(std::array::from_fn(|k| 2.0 * p.cos_o * p.n[k] - p.r[k]));
        let (r, n) = (turn.apply(p.r), turn.apply(p.n));
        let ([i, j, k], w) = around(wo);
        if !m.mirror {
            let (l, e) = (by_normal(m, [i, j, k], w, n), m.irradiance.sample(n));
            return std::array::from_fn(|c| l[c] + m.diffuse[c] * e[c]);
        }
        let (a, b, c) = (views[i].sample(r), views[j].sample(r), views[k].sample(r));
        let e = m.irradiance.sample(n);
        std::array::from_fn(|x| w[0] * a[x] + w[1] * b[x] + w[2] * c[x] + m.diffuse[x] * e[x])
    });
}

pub(super) fn gpu(m: &ViewMaps, turn: &LightRotation) -> GpuTechnique {
    let [r, g, b] = m.diffuse;
    let views = m.views.levels();
    let n = views[0].size() + 1;
    let bytes = texel_bytes(views.iter().flat_map(|c| c.texels()));
    let level = Level { width: n, height: n, layers: 6 * views.len(), bytes };
    let views = Table { name: "views", shape: Shape::CubeStack, format: Format::Rgba32Float, level };
    GpuTechnique {
        slug: super::ReflectionSpaceIbr::CARD.slug,
        modules: vec![include_str!("shade.wgsl").into()],
        entry: Entry::PLAIN,
        tables: vec![views, cube_table("irradiance", &m.irradiance)],
        uniforms: vec![
            turn.uniform(),
            Uniform { name: "diffuse", value: Value::Vec4([r, g, b, if m.mirror { 1.0 } else { 0.0 }]) },
        ],
        buffers: Vec::new(),
    }
}

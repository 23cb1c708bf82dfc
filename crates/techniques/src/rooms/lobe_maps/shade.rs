//! Per lobe one lookup in the table of views and one in the stack of maps; `shade.wgsl` has the same
//! functions.

use super::bake::LobeChains;
use crate::gpu::{Entry, Format, Level, Shape, Table, Uniform, Value};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::points::batch::{self, Point};
use crate::shared::tables::texel_bytes;
use crate::{GpuTechnique, Points, Radiance, Technique};

/// A per channel and b of lobe `i` at x = √(1 − √(n·wo)), linear.
#[inline(always)]
fn view(m: &LobeChains, i: usize, x: f32) -> [f32; 4] {
    let count = m.views.len() / m.lobes;
    let at = x.clamp(0.0, 1.0) * (count - 1) as f32;
    let k = (at as usize).min(count - 2);
    let w = at - k as f32;
    let (a, b) = (m.views[i * count + k], m.views[i * count + k + 1]);
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * w)
}

/// o = a n + b r of length 1, a by |o|² = a² + 2ab n·r + b².
#[inline(always)]
fn axis(p: &Point, b: f32) -> [f32; 3] {
    let sine2 = 1.0 - p.cos_o * p.cos_o;
    let a = (1.0 - b * b * sine2).max(0.0).sqrt() - b * p.cos_o;
    std::array::from_fn(|k| a * p.n[k] + b * p.r[k])
}

pub(super) fn shade(m: &LobeChains, turn: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
    let levels = m.levels();
    batch::shade(q, out, |p: Point| {
        let x = (1.0 - p.cos_o.sqrt()).max(0.0).sqrt();
        let mut sum = [0.0; 3];
        for i in 0..m.lobes {
            let [red, green, blue, b] = view(m, i, x);
            let o = turn.apply(axis(&p, b));
            let (near, far, w) = m.chain.around(i as f32 * levels as f32 + x * (levels - 1) as f32);
            let (l0, l1) = (near.sample(o), far.sample(o));
            let a = [red, green, blue];
            (0..3).for_each(|c| sum[c] += a[c] * (l0[c] + (l1[c] - l0[c]) * w));
        }
        sum
    });
}

pub(super) fn gpu(m: &LobeChains, turn: &LightRotation) -> GpuTechnique {
    let level = Level { width: m.views.len(), height: 1, layers: 1, bytes: texel_bytes(m.views.iter()) };
    let views = Table { name: "views", shape: Shape::Line, format: Format::Rgba32Float, level };
    let count = m.views.len() / m.lobes;
    let counts = [m.lobes as f32, m.levels() as f32, count as f32, (m.views.len() - 1) as f32];
    GpuTechnique {
        slug: super::LobeMaps::CARD.slug,
        modules: vec![include_str!("shade.wgsl").into()],
        entry: Entry::PLAIN,
        tables: vec![m.chain.table("maps"), views],
        uniforms: vec![turn.uniform(), Uniform { name: "counts", value: Value::Vec4(counts) }],
        buffers: Vec::new(),
    }
}

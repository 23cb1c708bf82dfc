//! One lookup in one of two paraboloids; `shade.wgsl` has the same functions.

use super::bake::FilteredParaboloids;
use crate::gpu::{Entry, Format, Level, Shape, Table, Uniform, Value};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::points::batch::{self, Point};
use crate::shared::tables::texel_bytes;
use crate::{GpuTechnique, Points, Radiance, Technique};

/// Texture coordinates of d in the front map (z ≥ 0) or the back one.
#[inline(always)]
fn position(m: &FilteredParaboloids, d: [f32; 3]) -> [f32; 2] {
    let scale = 0.5 / (m.extent * (1.0 + d[2].abs()));
    [d[0] * scale + 0.5, d[1] * scale + 0.5]
}

/// Bilinear lookup; the outer texels lie on the ends of [0, 1]².
#[inline(always)]
fn fetch(plane: &[[f32; 4]], side: usize, [u, v]: [f32; 2]) -> [f32; 3] {
    let last = (side - 1) as f32;
    let (x, y) = (u.clamp(0.0, 1.0) * last, v.clamp(0.0, 1.0) * last);
    let (i, j) = ((x as usize).min(side - 2), (y as usize).min(side - 2));
    let (u, v) = (x - i as f32, y - j as f32);
    let t = &plane[j * side + i..j * side + i + side + 2];
    let (a, b, c, d) = (t[0], t[1], t[side], t[side + 1]);
    std::array::from_fn(|k| {
        let (top, bottom) = (a[k] + (b[k] - a[k]) * u, c[k] + (d[k] - c[k]) * u);
        top + (bottom - top) * v
    })
}

pub(super) fn shade(m: &FilteredParaboloids, turn: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
    batch::shade(q, out, |p: Point| {
        let d = turn.apply(if m.about_normal > 0.5 { p.n } else { p.r });
        let plane = if d[2] < 0.0 { &m.planes[1] } else { &m.planes[0] };
        let l = fetch(plane, m.side, position(m, d));
        std::array::from_fn(|c| m.factor[c] * l[c])
    });
}

fn table(name: &'static str, m: &FilteredParaboloids, plane: usize) -> Table {
    let bytes = texel_bytes(m.planes[plane].iter());
    let level = Level { width: m.side, height: m.side, layers: 1, bytes };
    Table { name, shape: Shape::Plane, format: Format::Rgba32Float, level }
}

pub(super) fn gpu(m: &FilteredParaboloids, turn: &LightRotation) -> GpuTechnique {
    let [r, g, b] = m.factor;
    GpuTechnique {
        slug: super::ParaboloidFilter::CARD.slug,
        modules: vec![include_str!("shade.wgsl").into()],
        entry: Entry::PLAIN,
        tables: vec![table("front", m, 0), table("back", m, 1)],
        uniforms: vec![
            turn.uniform(),
            Uniform { name: "factor", value: Value::Vec4([r, g, b, m.about_normal]) },
            Uniform { name: "extent", value: Value::F32(m.extent) },
        ],
        buffers: Vec::new(),
    }
}

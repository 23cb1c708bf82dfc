//! A lookup per factor, their sum, one exponential; `shade.wgsl` has the same function.

use super::bake::Factors;
use crate::gpu::{Entry, Format, Level, Shape, Table, Uniform, Value};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::points::batch::{self, Point};
use crate::shared::tables::{cube_table, texel_bytes};
use crate::{GpuTechnique, Points, Radiance, Technique};

impl Factors {
    /// Logarithm of the factor over n·wo.
    #[inline(always)]
    fn elevation(&self, cos_o: f32) -> [f32; 3] {
        let last = self.line.len() - 1;
        let x = cos_o.clamp(0.0, 1.0).sqrt() * last as f32;
        let i = (x as usize).min(last - 1);
        let (a, b, w) = (self.line[i], self.line[i + 1], x - i as f32);
        std::array::from_fn(|c| a[c] + (b[c] - a[c]) * w)
    }
}

pub(super) fn shade(f: &Factors, turn: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
    batch::shade(q, out, |p: Point| {
        let wo = std::array::from_fn(|k| 2.0 * p.cos_o * p.n[k] - p.r[k]);
        let mut log = [0.0; 3];
        for (k, d) in [p.n, p.r, wo].into_iter().enumerate() {
            if f.used[k] {
                let v = f.cubes[k].sample(turn.apply(d));
                (0..3).for_each(|c| log[c] += v[c]);
            }
        }
        if f.used[3] {
            let v = f.elevation(p.cos_o);
            (0..3).for_each(|c| log[c] += v[c]);
        }
        std::array::from_fn(|c| f.scale[c] * log[c].exp())
    });
}

pub(super) fn gpu(f: &Factors, turn: &LightRotation) -> GpuTechnique {
    let [r, g, b] = f.scale;
    let used = f.used.map(|u| if u { 1.0 } else { 0.0 });
    let level = Level { width: f.line.len(), height: 1, layers: 1, bytes: texel_bytes(f.line.iter()) };
    let elevation = Table { name: "elevation", shape: Shape::Line, format: Format::Rgba32Float, level };
    let [n, m, v] = &f.cubes;
    GpuTechnique {
        slug: super::FactoredLighting::CARD.slug,
        modules: vec![include_str!("shade.wgsl").into()],
        entry: Entry::PLAIN,
        tables: vec![cube_table("normal", n), cube_table("mirror", m), cube_table("viewer", v), elevation],
        uniforms: vec![
            turn.uniform(),
            Uniform { name: "scale", value: Value::Vec4([r, g, b, 0.0]) },
            Uniform { name: "used", value: Value::Vec4(used) },
        ],
        buffers: Vec::new(),
    }
}

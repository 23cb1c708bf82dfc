//! albedo · L_a · ao; `shade.wgsl` has the same function.

use super::Ambient;
use crate::gpu::{Buffer, Entry, Uniform, Value};
use crate::shared::geometry::transport;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique};

pub(super) fn shade(b: &Bake<Ambient>, q: &Points<'_>, out: &mut Radiance<'_>) {
    let full = b.linked.0.map(|x| x as f32);
    for i in 0..q.len() {
        let value = |s: u32| b.transfer.at(s).map_or([0.0; 3], |ao| full.map(|l| l * ao[0]));
        let l = transport::gather(q, i, value);
        (0..3).for_each(|c| out.rgb[c][i] = l[c]);
    }
}

pub(super) fn gpu(b: &Bake<Ambient>) -> GpuTechnique {
    let [red, green, blue] = b.linked.0.map(|x| x as f32);
    GpuTechnique {
        slug: Ambient::CARD.slug,
        modules: vec![include_str!("shade.wgsl").into()],
        entry: Entry::SITE,
        tables: Vec::new(),
        uniforms: vec![Uniform { name: "full", value: Value::Vec4([red, green, blue, 0.0]) }],
        buffers: vec![Buffer::new("occlusion", 1, b.transfer.data.clone())],
    }
}

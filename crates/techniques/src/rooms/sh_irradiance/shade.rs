//! nᵀMn over batches; `shade.wgsl` has the same functions.

use crate::shared::quadric::{self, Quadric};
use crate::{GpuRoom, Points, Radiance, Technique};
use glam::Mat4;

pub(super) fn shade(f: &Quadric, q: &Points<'_>, out: &mut Radiance<'_>) {
    steradian_simd::dispatch(|| {
        for (m, out) in f.0.iter().zip(&mut out.rgb) {
            plane(m, q, out);
        }
    });
}

#[inline(always)]
fn plane(m: &Mat4, q: &Points<'_>, out: &mut [f32]) {
    let len = out.len();
    let [nx, ny, nz] = q.n.map(|s| &s[..len]);
    let [vx, vy, vz] = q.wo.map(|s| &s[..len]);
    for i in 0..len {
        let facing = nx[i] * vx[i] + ny[i] * vy[i] + nz[i] * vz[i];
        let l = quadric::value(m, [nx[i], ny[i], nz[i]]);
        out[i] = if facing > 0.0 { l } else { 0.0 };
    }
}

pub(super) fn gpu(f: &Quadric) -> GpuRoom {
    GpuRoom {
        slug: super::ShIrradiance::CARD.slug,
        wgsl: include_str!("shade.wgsl"),
        tables: Vec::new(),
        uniforms: f.uniforms(["red", "green", "blue"]).collect(),
        buffers: Vec::new(),
    }
}

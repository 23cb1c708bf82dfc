//! nᵀMn over batches; `shade.wgsl` has the same functions.

use crate::gpu::{Entry, LightTables};
use crate::shared::maths::quadric::{self, Quadric};
use crate::shared::surface::lobe;
use crate::{GpuTechnique, Points, Radiance, Technique};
use glam::Mat4;

pub(super) fn shade(f: &Quadric, q: &Points<'_>, out: &mut Radiance<'_>) {
    steradian_simd::dispatch(|| {
        for (m, out) in f.0.iter().zip(&mut out.rgb) {
            plane(m, q, out);
        }
    });
}

/// [`shade`] where every point has its own normals: their mean by four of them, exact for order 2.
pub(super) fn shade_lobe(f: &Quadric, q: &Points<'_>, out: &mut Radiance<'_>) {
    lobe::shade(q, out, |p| {
        let l = lobe::normals(p).map(|n| f.value(n));
        std::array::from_fn(|c| 0.25 * (l[0][c] + l[1][c] + l[2][c] + l[3][c]))
    });
}

/// [`gpu`] with a lobe per point.
pub(super) fn gpu_lobe(f: &Quadric) -> GpuTechnique {
    let modules =
        vec![lobe::WGSL.into(), include_str!("shade.wgsl").into(), include_str!("shade_lobe.wgsl").into()];
    GpuTechnique { modules, entry: Entry::LOBE, ..gpu(f) }
}

#[inline(always)]
fn plane(m: &Mat4, q: &Points<'_>, out: &mut [f32]) {
    let len = out.len();
    let [nx, ny, nz] = q.n.map(|s| &s[..len]);
    let [vx, vy, vz] = q.wo.map(|s| &s[..len]);
    for i in 0..len {
        let facing = nx[i] * vx[i] + ny[i] * vy[i] + nz[i] * vz[i];
        let l = Quadric::form(m, [nx[i], ny[i], nz[i]]);
        out[i] = if facing > 0.0 { l } else { 0.0 };
    }
}

pub(super) fn gpu(f: &Quadric) -> GpuTechnique {
    GpuTechnique {
        slug: super::ShIrradiance::CARD.slug,
        modules: vec![include_str!("shade.wgsl").into()],
        entry: Entry::PLAIN,
        tables: Vec::new(),
        uniforms: quadric::uniforms(f, LightTables::QUADRICS).collect(),
        buffers: Vec::new(),
    }
}

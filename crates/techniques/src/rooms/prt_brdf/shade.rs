//! Transferred light of every site once a frame; then as with fixed light.

use super::{PrtBrdf, bake};
use crate::gpu::{Buffer, Entry};
use crate::shared::material::view_table::{self, LightLanes, LocalLight};
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};
use glam::Mat3;
use steradian_sphere::sh::Rotation;

/// The transferred light of a frame.
#[derive(Default)]
pub struct Frame {
    turn: Option<Mat3>,
    local: LocalLight,
}

impl Frame {
    /// Made anew where the light turns.
    pub(super) fn renew(&mut self, b: &Bake<PrtBrdf>, v: &View) {
        if self.turn == Some(v.light_rotation) {
            return;
        }
        self.turn = Some(v.light_rotation);
        let sh = bake::first(&b.light, &b.params);
        let turned = Rotation::new(sh.order, v.light_rotation.as_dmat3()).apply_rgb(&sh);
        let light = LightLanes::new(&b.material.table, &turned);
        let l = light.coefficients();
        let n = l.len();
        let local = LocalLight::of(b.transfer.frames.len(), n, |site, to| {
            let Some(m) = b.transfer.all.at(site as u32).filter(|m| m.len() == n * n) else { return };
            steradian_simd::dispatch(|| multiply(m, l, to));
        });
        self.local = if b.params.halves { local.shortened(&b.material.table) } else { local };
    }
}

/// Σ_j A_ij L_j of three channels.
#[inline(always)]
fn multiply(m: &[f32], l: &[[f32; 3]], to: &mut [f32]) {
    let n = l.len();
    for (i, row) in m.chunks_exact(n).enumerate() {
        let mut sum = [0.0f32; 3];
        for (a, l) in row.iter().zip(l) {
            (0..3).for_each(|c| sum[c] += a * l[c]);
        }
        (0..3).for_each(|c| to[c * n + i] = sum[c]);
    }
}

pub(super) fn shade(b: &Bake<PrtBrdf>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    view_table::shade_local(&b.material.table, &b.transfer.frames, &f.local, q, out);
}

pub(super) fn gpu(b: &Bake<PrtBrdf>, f: &Frame) -> GpuTechnique {
    let table = &b.material.table;
    let n = table.bands() * table.bands();
    let mut modules = view_table::local_modules(table);
    modules.push(include_str!("shade.wgsl").into());
    GpuTechnique {
        slug: PrtBrdf::CARD.slug,
        modules,
        entry: Entry::SITE,
        tables: Vec::new(),
        uniforms: Vec::new(),
        buffers: vec![
            view_table::views_buffer(table, b.params.halves),
            Buffer::new("frames", 6, b.transfer.frames.numbers()),
            Buffer::new("light", 3 * n, f.local.numbers()),
        ],
    }
}

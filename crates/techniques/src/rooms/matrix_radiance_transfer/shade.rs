//! Radiance of every cluster's matrices at every hat once a frame; at a point the four hats of the view in the frame of each
//! corner, summed by the weights of the site.

use super::MatrixRadianceTransfer;
use super::bake::{Compressed, axes};
use super::hats::Hats;
use crate::gpu::{Buffer, Entry, Numbers};
use crate::shared::geometry::site_sum::MOST;
use crate::shared::light::sh_light::ShLight;
use crate::shared::maths::vector::dot;
use crate::shared::points::batch;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};
use steradian_parallel::prelude::*;

/// The light of a frame through the matrices of the clusters.
#[derive(Default)]
pub struct Frame {
    /// Cluster after cluster, hat after hat: of the mean and of each component red, green, blue and 0.
    radiance: Vec<[f32; 4]>,
}

impl Frame {
    pub(super) fn new(light: &ShLight, t: &Compressed, v: &View) -> Self {
        let n = t.n;
        if n == 0 {
            return Self::default();
        }
        let light = light.turned(n.isqrt(), v.light_rotation, [1.0; 3]);
        let (hats, row) = (t.rows.len() / (3 * n), t.components + 1);
        let cluster = |basis: &[f32]| {
            let mut out = vec![[0.0; 4]; hats * row];
            for (k, matrix) in basis.chunks_exact(n * n).enumerate() {
                let through: Vec<[f32; 3]> = matrix.chunks_exact(n).map(|m| product(m, &light)).collect();
                for c in 0..3 {
                    let rows = t.rows[c * hats * n..][..hats * n].chunks_exact(n);
                    for (hat, r) in rows.enumerate() {
                        out[hat * row + k][c] = r.iter().zip(&through).map(|(r, l)| r * l[c]).sum();
                    }
                }
            }
            out
        };
        Self { radiance: t.basis.par_chunks_exact(row * n * n).flat_map_iter(cluster).collect() }
    }
}

fn product(row: &[f32], light: &[[f32; 3]]) -> [f32; 3] {
    let mut out = [0.0; 3];
    for (m, l) in row.iter().zip(light) {
        (0..3).for_each(|c| out[c] += m * l[c]);
    }
    out
}

pub(super) fn shade(hats: Hats, t: &Compressed, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    let there =
        q.site.index.iter().all(|s| s.len() == q.len()) && q.site.weight.iter().all(|s| s.len() == q.len());
    if !there {
        return out.rgb.iter_mut().for_each(|c| c.fill(0.0));
    }
    batch::shade(q, out, |p| {
        let [u, v] = q.site.weight.map(|w| w[p.index]);
        let mut sum = [0.0; 3];
        for (s, w) in q.site.index.iter().zip([1.0 - u - v, u, v]) {
            if w != 0.0 {
                let l = corner(hats, t, f, s[p.index], p.wo);
                (0..3).for_each(|c| sum[c] += w * l[c]);
            }
        }
        sum
    });
}

/// Radiance of a site; 0 beyond the end.
#[inline(always)]
fn corner(hats: Hats, t: &Compressed, f: &Frame, site: u32, wo: [f32; 3]) -> [f32; 4] {
    let row = t.components + 1;
    let site = site as usize;
    let (Some(own), Some(n)) =
        (t.sites.get(site * row..(site + 1) * row), t.normals.get(3 * site..3 * site + 3))
    else {
        return [0.0; 4];
    };
    let mut weights = [1.0; MOST + 1];
    own.iter().enumerate().skip(1).for_each(|(k, w)| weights[k] = w.to_f32());
    let n = [n[0], n[1], n[2]];
    let [x, y] = axes(n);
    let (places, values) = hats.at([dot(x, wo), dot(y, wo), dot(n, wo)]);
    let first = own[0].to_f32() as usize * hats.len();
    let mut sum = [0.0; 4];
    for (hat, g) in places.iter().zip(values) {
        let Some(parts) = f.radiance.get((first + hat) * row..(first + hat + 1) * row) else {
            return [0.0; 4];
        };
        for (part, w) in parts.iter().zip(&weights) {
            let gw = g * w;
            (0..4).for_each(|c| sum[c] += gw * part[c]);
        }
    }
    sum
}

pub(super) fn gpu(b: &Bake<MatrixRadianceTransfer>, f: &Frame) -> GpuTechnique {
    let t = &*b.transfer;
    let row = t.components + 1;
    let hats = b.material.hats;
    let head = format!("const HATS: u32 = {}u;\nconst ROW: u32 = {row}u;\n", hats.side);
    let radiance: Vec<f32> = f.radiance.iter().flat_map(|l| [l[0], l[1], l[2]]).collect();
    GpuTechnique {
        slug: MatrixRadianceTransfer::CARD.slug,
        modules: vec![head.into(), include_str!("shade.wgsl").into()],
        entry: Entry::SITE,
        tables: Vec::new(),
        uniforms: Vec::new(),
        buffers: vec![
            Buffer { name: "weights", stride: row, data: Numbers::F16(t.sites.clone()) },
            Buffer { name: "normals", stride: 3, data: Numbers::F32(t.normals.clone()) },
            Buffer { name: "radiance", stride: 3 * row, data: Numbers::F32(radiance) },
        ],
    }
}

//! The light of every cluster's matrices once a frame, summed by the weights of the sites around a point.

use super::ClusteredPca;
use crate::gpu::{Buffer, Entry, Numbers};
use crate::shared::geometry::clustered::{ClusterVectors, Clustered};
use crate::shared::geometry::matrices::padded;
use crate::shared::light::sh_light::ShLight;
use crate::shared::material::glossy::{Glossy, each};
use crate::shared::tables::aligned::Aligned;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};

/// The clusters' matrices times the light of a frame.
#[derive(Default)]
pub struct Frame {
    /// (M_ki L)_i of each matrix, in the order of [`Glossy::order`].
    vectors: Aligned<f32>,
}

impl Frame {
    pub(super) fn update(&mut self, light: &ShLight, m: &Glossy, clustered: &Clustered, v: &View) {
        let basis = clustered.basis();
        let bands = basis.coefficients().isqrt();
        let light = light.turned(bands, v.light_rotation, m.factor());
        let (scale, place) = m.order(bands);
        if self.vectors.len() != basis.len() * each(bands) {
            self.vectors = Aligned::zeros(basis.len() * each(bands));
        }
        basis.transfer(&light, &scale, &place, &mut self.vectors);
    }
}

pub(super) fn shade(b: &Bake<ClusteredPca>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    let clustered = &*b.transfer;
    let bands = clustered.basis().coefficients().isqrt();
    let vectors = ClusterVectors { clustered, vectors: &f.vectors, each: each(bands) };
    b.material.shade(bands, &vectors, q, out);
}

/// WGSL text of the light that reaches a corner of the triangle, for `n` coefficients and `components`.
fn wgsl(n: usize, components: usize) -> String {
    format!(
        "// Radiance of a site: its cluster's mean and weighted components, times coefficients.
fn at_corner(s: u32, coefficients: array<f32, {n}>) -> vec3<f32> {{
    var y = coefficients;
    let k = u32(fetch_weights(s, 0u));
    var sum = vec3<f32>(0.0);
    for (var j = 0u; j <= {components}u; j++) {{
        var part = vec3<f32>(0.0);
        for (var i = 0u; i < {n}u; i++) {{
            let at = j * {row}u + 3u * i;
            part += y[i] * vec3<f32>(fetch_clusters(k, at), fetch_clusters(k, at + 1u), fetch_clusters(k, at + 2u));
        }}
        sum += select(fetch_weights(s, j), 1.0, j == 0u) * part;
    }}
    return sum;
}}
// The clusters of the three sites around a point.
fn transferred(site: Site, y: array<f32, {n}>) -> vec3<f32> {{
    return site.weight.x * at_corner(site.index.x, y) + site.weight.y * at_corner(site.index.y, y)
        + site.weight.z * at_corner(site.index.z, y);
}}
",
        row = 3 * n,
    )
}

pub(super) fn gpu(b: &Bake<ClusteredPca>, f: &Frame) -> GpuTechnique {
    let clustered = &*b.transfer;
    let n = clustered.basis().coefficients();
    let (stride, (_, place)) = (padded(n), b.material.order(n.isqrt()));
    // k_l of a lobe is in the vectors.
    let vector = |v: &[f32]| -> Vec<f32> {
        (0..n).flat_map(|i| [0, 1, 2].map(|c| v[c * stride + place[i]])).collect()
    };
    let vectors: Vec<f32> = f.vectors.chunks_exact(3 * stride).flat_map(vector).collect();
    let row = clustered.components() + 1;
    let (mut modules, mut buffers) = b.material.wgsl(n.isqrt(), false);
    modules.push(wgsl(n, clustered.components()).into());
    buffers.extend([
        Buffer { name: "weights", stride: row, data: Numbers::F16(clustered.sites().to_vec()) },
        Buffer { name: "clusters", stride: row * 3 * n, data: Numbers::F32(vectors) },
    ]);
    GpuTechnique {
        slug: ClusteredPca::CARD.slug,
        modules,
        entry: Entry::SITE,
        tables: Vec::new(),
        uniforms: Vec::new(),
        buffers,
    }
}

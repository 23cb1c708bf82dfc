//! The light of every cluster's matrices once a frame, summed by the weights of the sites around a point.

use super::ClusteredPca;
use crate::gpu::{Buffer, Entry, Numbers};
use crate::shared::clustered::{ClusterVectors, Clustered};
use crate::shared::harmonics::{self, Harmonics};
use crate::shared::matrices::padded;
use crate::shared::phong_lobe::PhongLobe;
use crate::shared::sh_light::ShLight;
use crate::shared::site_sum;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};

/// The clusters' matrices times the light of a frame.
#[derive(Default)]
pub struct Frame {
    harmonics: Option<Harmonics>,
    /// k_l (M_ki L)_i of each matrix, in the order of [`Harmonics`].
    vectors: Vec<f32>,
}

impl Frame {
    pub(super) fn update(&mut self, light: &ShLight, lobe: &PhongLobe, clustered: &Clustered, v: &View) {
        let basis = clustered.basis();
        let bands = basis.coefficients().isqrt();
        let light = light.turned(bands, v.light_rotation, lobe.factor);
        self.harmonics = Some(Harmonics::new(bands - 1, bands - 1));
        self.vectors.resize(basis.len() * 3 * padded(bands * bands), 0.0);
        basis.transfer(&light, &lobe.scale(bands), &harmonics::places(bands - 1), &mut self.vectors);
    }
}

pub(super) fn shade(clustered: &Clustered, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    let Some(h) = &f.harmonics else { return out.rgb.iter_mut().for_each(|c| c.fill(0.0)) };
    let each = 3 * padded(h.len());
    site_sum::at_mirror(h, &ClusterVectors { clustered, vectors: &f.vectors, each }, q, out);
}

/// What a corner of the triangle sees, for so many coefficients and components.
fn wgsl(n: usize, components: usize) -> String {
    format!(
        "// Radiance of a site: its cluster's mean and weighted components, times harmonics y.
fn at_corner(s: u32, at_mirror: array<f32, {n}>) -> vec3<f32> {{
    var y = at_mirror;
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
",
        row = 3 * n,
    )
}

pub(super) fn gpu(b: &Bake<ClusteredPca>, f: &Frame) -> GpuTechnique {
    let clustered = &*b.transfer;
    let n = clustered.basis().coefficients();
    let (stride, place) = (padded(n), harmonics::places(n.isqrt() - 1));
    // k_l is in the vectors: harmonics alone, coefficient by coefficient.
    let vector = |v: &[f32]| -> Vec<f32> {
        (0..n).flat_map(|i| [0, 1, 2].map(|c| v[c * stride + place[i]])).collect()
    };
    let vectors: Vec<f32> = f.vectors.chunks_exact(3 * stride).flat_map(vector).collect();
    let row = clustered.components() + 1;
    GpuTechnique {
        slug: ClusteredPca::CARD.slug,
        modules: vec![
            harmonics::wgsl(n.isqrt() - 1).into(),
            wgsl(n, clustered.components()).into(),
            include_str!("shade.wgsl").into(),
        ],
        entry: Entry::SITE,
        tables: Vec::new(),
        uniforms: Vec::new(),
        buffers: vec![
            Buffer { name: "weights", stride: row, data: Numbers::F16(clustered.sites().to_vec()) },
            Buffer { name: "clusters", stride: row * 3 * n, data: Numbers::F32(vectors) },
        ],
    }
}

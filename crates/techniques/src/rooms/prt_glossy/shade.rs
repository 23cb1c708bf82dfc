//! Transferred light of every site once a frame, its convolution looked up at the mirror direction of points; `shade.wgsl`
//! does the same with the matrices of the three sites around each point.

use super::PrtGlossy;
use crate::gpu::{Buffer, Entry};
use crate::shared::harmonics::{self, Harmonics};
use crate::shared::matrices::{Matrices, packed, padded};
use crate::shared::phong_lobe::PhongLobe;
use crate::shared::sh_light::{self, ShLight};
use crate::shared::site_sum::{self, Vectors, Weights};
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};

/// The light of a frame, and what of it reaches each site.
#[derive(Default)]
pub struct Frame {
    /// factor · L_i, turned.
    pub(super) light: Vec<[f32; 3]>,
    harmonics: Option<Harmonics>,
    /// k_l (M L)_i of each site, in the order of [`Harmonics`].
    sites: Vec<f32>,
}

impl Frame {
    pub(super) fn update(&mut self, light: &ShLight, lobe: &PhongLobe, matrices: &Matrices, v: &View) {
        let bands = matrices.coefficients().isqrt();
        self.light = light.turned(bands, v.light_rotation, lobe.factor);
        let scale = lobe.scale(bands);
        self.harmonics = Some(Harmonics::new(bands - 1, bands - 1));
        self.sites.resize(matrices.len() * 3 * padded(bands * bands), 0.0);
        matrices.transfer(&self.light, &scale, &harmonics::places(bands - 1), &mut self.sites);
    }
}

/// One vector a site.
struct Plain<'a>(&'a [f32], usize);

impl Vectors for Plain<'_> {
    #[inline(always)]
    fn at(&self, site: u32, _: &mut Weights) -> Option<&[f32]> {
        let start = site as usize * self.1;
        self.0.get(start..start + self.1)
    }
}

pub(super) fn shade(f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    let Some(h) = &f.harmonics else { return out.rgb.iter_mut().for_each(|c| c.fill(0.0)) };
    site_sum::at_mirror(h, &Plain(&f.sites, 3 * padded(h.len())), q, out);
}

/// The sum over the triangle of a matrix, for so many bands.
fn wgsl(bands: usize) -> String {
    let n = bands * bands;
    let light: Vec<String> = (0..n).map(sh_light::uniform).collect();
    format!(
        "// Sum of c_i M_ij L_j over the lower triangle of the matrix, which is symmetric (STAR04 eq. 54).
fn transferred(site: Site, lobe: array<f32, {n}>) -> vec3<f32> {{
    var c = lobe;
    var light = array<vec3<f32>, {n}>({light});
    var sum = vec3<f32>(0.0);
    var k = 0u;
    for (var i = 0u; i < {n}u; i++) {{
        for (var j = 0u; j < i; j++) {{
            sum += fetch_matrices_at(site, k) * (c[i] * light[j] + c[j] * light[i]);
            k++;
        }}
        sum += fetch_matrices_at(site, k) * c[i] * light[i];
        k++;
    }}
    return sum;
}}
",
        light = light.join(", "),
    )
}

pub(super) fn gpu(b: &Bake<PrtGlossy>, f: &Frame) -> GpuTechnique {
    let n = b.transfer.coefficients();
    let bands = n.isqrt();
    GpuTechnique {
        slug: PrtGlossy::CARD.slug,
        modules: vec![b.material.wgsl(bands).into(), wgsl(bands).into(), include_str!("shade.wgsl").into()],
        entry: Entry::SITE,
        tables: Vec::new(),
        uniforms: sh_light::uniforms(&f.light),
        buffers: vec![Buffer { name: "matrices", stride: packed(n), data: b.transfer.by_site() }],
    }
}

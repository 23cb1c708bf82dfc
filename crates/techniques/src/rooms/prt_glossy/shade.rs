//! Transferred light of every site once a frame, summed with the reflectance at points ([`Glossy`]); on GPUs
//! with the matrices of the three sites around each point.

use super::PrtGlossy;
use crate::gpu::{Buffer, Entry};
use crate::shared::geometry::matrices::{Matrices, packed};
use crate::shared::geometry::site_sum::{Vectors, Weights};
use crate::shared::light::sh_light::{self, ShLight};
use crate::shared::material::glossy::{Glossy, each};
use crate::shared::tables::aligned::Aligned;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};
use steradian_simd::Arch;

/// The light of a frame, and the transferred light of each site.
#[derive(Default)]
pub struct Frame {
    /// factor · L_i, turned.
    pub(super) light: Vec<[f32; 3]>,
    /// (M L)_i of each site, in the order of [`Glossy::order`].
    sites: Aligned<f32>,
}

impl Frame {
    pub(super) fn update(&mut self, light: &ShLight, m: &Glossy, matrices: &Matrices, v: &View) {
        let bands = matrices.coefficients().isqrt();
        self.light = light.turned(bands, v.light_rotation, m.factor());
        let (scale, place) = m.order(bands);
        if self.sites.len() != matrices.len() * each(bands) {
            self.sites = Aligned::zeros(matrices.len() * each(bands));
        }
        matrices.transfer(&self.light, &scale, &place, &mut self.sites);
    }
}

/// One vector a site.
struct Plain<'a>(&'a [f32], usize);

impl Vectors for Plain<'_> {
    #[inline(always)]
    fn at<A: Arch>(&self, site: u32, _: &mut Weights) -> Option<&[f32]> {
        let start = site as usize * self.1;
        self.0.get(start..start + self.1)
    }
}

pub(super) fn shade(b: &Bake<PrtGlossy>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    let bands = b.transfer.coefficients().isqrt();
    b.material.shade(bands, &Plain(&f.sites, each(bands)), q, out);
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
    let (mut modules, mut buffers) = b.material.wgsl(bands, true);
    modules.push(wgsl(bands).into());
    buffers.push(Buffer { name: "matrices", stride: packed(n), data: b.transfer.by_site() });
    GpuTechnique {
        slug: PrtGlossy::CARD.slug,
        modules,
        entry: Entry::SITE,
        tables: Vec::new(),
        uniforms: sh_light::uniforms(&f.light),
        buffers,
    }
}

//! Transferred light of every site once a frame, summed with the reflectance at points ([`Glossy`]); on GPUs with the
//! matrices of the three sites around each point.

use super::PrtGlossy;
use crate::gpu::{Buffer, Entry};
use crate::shared::geometry::matrices::{Matrices, packed};
use crate::shared::geometry::site_sum::{Vectors, Weights};
use crate::shared::light::sh_light::{self, ShLight};
use crate::shared::material::glossy::{Glossy, each};
use crate::shared::maths::number::Number;
use crate::shared::tables::aligned::Aligned;
use crate::{Bake, GpuTechnique, Points, Radiance, Technique, View};
use steradian_simd::Arch;

/// The light of a frame, and what of it reaches each site.
#[derive(Default)]
pub struct Frame {
    /// factor · L_i, turned.
    pub(super) light: Vec<[f32; 3]>,
    /// (M L)_i of each site, in the order of [`Glossy::order`].
    sites: Reaching,
}

/// Light that reaches sites.
enum Reaching {
    Single(Aligned<f32>),
    /// Bits of 16-bit floats, and what they are multiplied with: beside matrices of such numbers, whose time is that of memory.
    Half(Aligned<u16>, f32),
}

impl Default for Reaching {
    fn default() -> Self {
        Self::Single(Aligned::default())
    }
}

/// Zeros, or as many numbers of an earlier frame.
fn room<T: Copy + Default>(before: Option<Aligned<T>>, len: usize) -> Aligned<T> {
    before.filter(|b| b.len() == len).unwrap_or_else(|| Aligned::zeros(len))
}

impl Frame {
    pub(super) fn update(&mut self, light: &ShLight, m: &Glossy, matrices: &Matrices, v: &View) {
        let bands = matrices.coefficients().isqrt();
        self.light = light.turned(bands, v.light_rotation, m.factor());
        let (mut scale, place) = m.order(bands);
        let len = matrices.len() * each(bands);
        let before = std::mem::take(&mut self.sites);
        self.sites = if matrices.is_half() {
            let mut sites = room(if let Reaching::Half(b, _) = before { Some(b) } else { None }, len);
            let unit = unit(&self.light, &scale);
            scale.iter_mut().for_each(|s| *s /= unit);
            matrices.transfer(&self.light, &scale, &place, &mut sites);
            Reaching::Half(sites, unit)
        } else {
            let mut sites = room(if let Reaching::Single(b) = before { Some(b) } else { None }, len);
            matrices.transfer(&self.light, &scale, &place, &mut sites);
            Reaching::Single(sites)
        };
    }
}

/// The power of two in which transferred light stays below some thousands: matrices lengthen no vector of coefficients, but for
/// the ringing of a V of few bands, which is far less than the factor of eight that 16-bit floats still have.
fn unit(light: &[[f32; 3]], scale: &[f32]) -> f32 {
    let length = |c: usize| light.iter().map(|l| f64::from(l[c]).powi(2)).sum::<f64>().sqrt();
    let longest = (0..3).map(length).fold(0.0, f64::max);
    let most = scale.iter().fold(0.0f64, |a, s| a.max(f64::from(s.abs())));
    let exponent = (longest * most / 4096.0).log2().ceil();
    if exponent.is_finite() { exponent.clamp(-100.0, 100.0).exp2() as f32 } else { 1.0 }
}

/// One vector a site.
struct Plain<'a, T> {
    all: &'a [T],
    each: usize,
    scale: f32,
}

impl<T: Number> Vectors for Plain<'_, T> {
    type Number = T;

    #[inline(always)]
    fn at<A: Arch>(&self, site: u32, _: &mut Weights) -> Option<&[T]> {
        let start = site as usize * self.each;
        self.all.get(start..start + self.each)
    }

    fn scale(&self) -> f32 {
        self.scale
    }
}

pub(super) fn shade(b: &Bake<PrtGlossy>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
    let bands = b.transfer.coefficients().isqrt();
    let each = each(bands);
    match &f.sites {
        Reaching::Single(all) => b.material.shade(bands, &Plain { all, each, scale: 1.0 }, q, out),
        Reaching::Half(all, scale) => b.material.shade(bands, &Plain { all, each, scale: *scale }, q, out),
    }
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

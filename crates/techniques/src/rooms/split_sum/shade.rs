//! One trilinear lookup along r, one in the albedo table; `shade.wgsl` has the same functions,
//! `shade_lobe.wgsl` those of points with lobes of their own.

use super::bake::Specular;
use super::stretched::{Frame, Stretched};
use crate::gpu::{Entry, Format, Kernel, Level, LightCube, LightTables, Shape, Table, Uniform, Value};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::material::albedo;
use crate::shared::maths::quadric::{self, Quadric};
use crate::shared::points::batch::{self, Point};
use crate::shared::points::central;
use crate::shared::surface::lobe::{self, Taps};
use crate::shared::tables::chain::Chain;
use crate::shared::tables::texel_bytes;
use crate::{GpuTechnique, Points, Radiance, Technique};
use steradian_prefilter::edge_cube::spacing;

/// Fdez-Agüera 2019: F_ms E_ms = E_ss F_avg/(1 − F_avg E_ms) · E_ms with E_ms = 1 − (A + B), E_ss = f0 A + B
/// and F_avg = f0 + (1 − f0)/21.
#[inline(always)]
pub(super) fn multiscatter(strength: f32, f0: [f32; 3], [a, b]: [f32; 2]) -> [f32; 3] {
    let e_ms = 1.0 - (a + b);
    f0.map(|f0| {
        let f_avg = f0 + (1.0 - f0) / 21.0;
        strength * (f0 * a + b) * f_avg / (1.0 - f_avg * e_ms) * e_ms
    })
}

/// Factor of the irradiance over π: energy returned by multiple scattering, and the diffuse base attenuated
/// by the energy that the specular layer reflects.
#[inline(always)]
fn diffuse(strength: f32, f0: [f32; 3], base: [f32; 3], ab: [f32; 2]) -> [f32; 3] {
    let ms = multiscatter(strength, f0, ab);
    std::array::from_fn(|c| ms[c] + base[c] * (1.0 - f0[c] * ab[0] - ab[1]))
}

pub(super) fn shade(
    chain: &Chain,
    s: &Specular,
    (turn, mean_radiance): &(LightRotation, Quadric),
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    if let Some(lobe) = &s.stretched {
        return batch::shade(q, out, |p: Point| {
            let frame = Frame::new(p.n, central::tangent(q, &p), p.wo, p.cos_o);
            let l = lobe.radiance(chain, turn, s.f0, &frame);
            let e = mean_radiance.value(p.n);
            std::array::from_fn(|c| s.scale[c] * (l[c] + s.base[c] * e[c]))
        });
    }
    let (sharp, blurred, w) = chain.around(s.level);
    batch::shade(q, out, |p: Point| {
        let r = turn.apply(p.r);
        let (l0, l1) = (sharp.sample(r), blurred.sample(r));
        let [a, b] = s.albedo_at(p.cos_o);
        let d = diffuse(s.multiscatter, s.f0, s.base, [a, b]);
        let e = mean_radiance.value(p.n);
        std::array::from_fn(|c| {
            let l = l0[c] + (l1[c] - l0[c]) * w;
            s.scale[c] * ((s.f0[c] * a + b) * l + d[c] * e[c])
        })
    });
}

/// The material's alpha, and the width of the sharpest map (half the spacing of its texels: the deviation of
/// a bilinear lookup of texel means).
fn widths(chain: &Chain, s: &Specular) -> (f32, f32) {
    let own = s.level / chain.last();
    (own * own, 0.5 * spacing(chain.levels()[0].size()) as f32)
}

/// `own`, or the material's where it is negative.
#[inline(always)]
fn colour(own: [f32; 3], material: [f32; 3]) -> [f32; 3] {
    if own[0] < 0.0 { material } else { own }
}

/// [`shade`] where every point has its own lobe: the albedo is that of the point's alpha, whatever widens the
/// lookup.
pub(super) fn shade_lobe(
    chain: &Chain,
    s: &Specular,
    (turn, mean_radiance): &(LightRotation, Quadric),
    q: &Points<'_>,
    out: &mut Radiance<'_>,
) {
    let (own, finest) = widths(chain, s);
    let table = albedo::table();
    lobe::shade(q, out, |p| {
        let albedo_at = |cos_o: f32| {
            if p.lobe.alpha < 0.0 { s.albedo_at(cos_o) } else { albedo::lookup(table, cos_o, p.lobe.alpha) }
        };
        let (f0, base) = (colour(p.lobe.f0, s.f0), colour(p.lobe.albedo, s.base));
        let taps = Taps::new(p, own, finest);
        let (sharp, blurred, w) = chain.around(taps.alpha.sqrt() * chain.last());
        let l = taps.sum(p, |tap| {
            let r = turn.apply(tap.r);
            let (l0, l1) = (sharp.sample(r), blurred.sample(r));
            let [a, b] = albedo_at(tap.cos_o);
            std::array::from_fn(|c| (f0[c] * a + b) * (l0[c] + (l1[c] - l0[c]) * w))
        });
        let d = diffuse(s.multiscatter, f0, base, albedo_at(p.cos_o));
        let e = mean_radiance.value(p.n);
        std::array::from_fn(|c| s.scale[c] * (l[c] + d[c] * e[c]))
    });
}

/// [`gpu`] with a lobe per point.
pub(super) fn gpu_lobe(chain: &Chain, s: &Specular, frame: &(LightRotation, Quadric)) -> GpuTechnique {
    let mut technique = gpu(chain, s, frame);
    let (own, finest) = widths(chain, s);
    technique.modules =
        vec![lobe::WGSL.into(), include_str!("shade.wgsl").into(), include_str!("shade_lobe.wgsl").into()];
    technique.entry = Entry::LOBE;
    technique.tables.push(albedo::gpu("albedo_of"));
    technique.uniforms.push(Uniform { name: "widths", value: Value::Vec4([own, finest, chain.last(), 0.0]) });
    technique
}

/// The uniforms that change with the frame.
pub(super) fn frame_uniforms(
    (turn, mean_radiance): &(LightRotation, Quadric),
) -> impl Iterator<Item = Uniform> {
    std::iter::once(turn.uniform()).chain(quadric::uniforms(mean_radiance, LightTables::QUADRICS))
}

/// The data that are filtered light: the chain, of which a single roughness reads two levels, and E/π.
pub(super) fn light_tables(chain: &Chain, s: &Specular, varied: bool) -> LightTables {
    let first = s.level.floor();
    let used = |k: f32| varied || s.stretched.is_some() || k == first || k == first + 1.0 && s.level > first;
    let kernel = |k: f32| match k {
        0.0 => Kernel::Mirror,
        _ => Kernel::Ggx { alpha: f64::from(k / chain.last()).powi(2) },
    };
    let levels = (0..chain.levels().len()).map(|k| used(k as f32).then(|| (kernel(k as f32), 1.0)));
    let chain = LightCube { table: "chain", levels: levels.collect() };
    LightTables { cubes: vec![chain], irradiance: Some([std::f32::consts::FRAC_1_PI; 3]) }
}

pub(super) fn gpu(chain: &Chain, s: &Specular, frame: &(LightRotation, Quadric)) -> GpuTechnique {
    let vec = |name, v: [f32; 3], w: f32| Uniform { name, value: Value::Vec4([v[0], v[1], v[2], w]) };
    let level = Level { width: s.albedo.len(), height: 1, layers: 1, bytes: texel_bytes(s.albedo.iter()) };
    let albedo = Table { name: "albedo", shape: Shape::Line, format: Format::Rgba32Float, level };
    let mut uniforms =
        vec![vec("f0", s.f0, s.level), vec("scale", s.scale, s.multiscatter), vec("base", s.base, 0.0)];
    uniforms.extend(frame_uniforms(frame));
    let mut out = GpuTechnique {
        slug: super::SplitSum::CARD.slug,
        modules: vec![include_str!("shade.wgsl").into()],
        entry: Entry::PLAIN,
        tables: vec![chain.table("chain"), albedo],
        uniforms,
        buffers: Vec::new(),
    };
    if let Some(lobe) = &s.stretched {
        let (table, numbers, taps) = lobe.gpu(chain);
        out.modules.push(include_str!("stretched.wgsl").into());
        out.entry = Stretched::ENTRY;
        out.tables.push(table);
        out.uniforms.extend(numbers);
        out.buffers.push(taps);
    }
    out
}

//! The maps of all components.

use super::ShrmSlices;
use super::choose::{Choice, choose};
use super::components::Component;
use super::material::Params;
use crate::certify::Report;
use crate::shared::light::sun::{self, load_suns, save_suns};
use crate::shared::light::sunlit_spectrum::SunlitSpectrum;
use crate::shared::material::kernels::Kernels;
use crate::shared::maths::harmonics::MAX_TERMS;
use crate::shared::shrm::{bundle, columns, grid};
use crate::shared::tables::bundle::{Bundle, Grid};
use crate::tensors::{PartError, TensorFile, get_f32, get_f64, put_f32, put_f64};
use crate::{BakeError, Part, Technique};
use steradian_base::Task;
use steradian_brdf::central::Centre;
use steradian_prefilter::Sun;
use steradian_prefilter::shrm::{Plan, Term};
use steradian_sphere::sh::ShRgb;

/// Numbers of a row before the components' weights: γ and the scale.
pub const HEAD: usize = 4;

/// Components of one resolution.
#[derive(Debug, Clone, PartialEq)]
pub struct Level {
    /// q of each component, ascending.
    pub q: Vec<u32>,
    /// Maps of these: one for q = 0, else two, for cosine and sine.
    pub maps: Bundle,
}

/// Data that shading reads.
#[derive(Debug, Clone, PartialEq)]
pub struct SliceMaps {
    /// Centre of the expansion: the tangent, or a direction at or near the mirror direction.
    pub centre: Centre,
    /// Numbers of an elevation: γ, the scale, and the weight of each component of all levels.
    pub stride: usize,
    /// Elevation after elevation.
    pub curve: Vec<f32>,
    /// The maps.
    pub levels: Vec<Level>,
    /// Light that no map holds.
    pub suns: Vec<Sun>,
    halves: bool,
}

impl SliceMaps {
    /// Number of elevations.
    pub fn elevations(&self) -> usize {
        self.curve.len() / self.stride
    }
}

/// Joins light and slices; the error is computed from both.
pub fn link(
    light: &SunlitSpectrum,
    material: &Kernels,
    p: &Params,
    task: &Task,
) -> Result<(SliceMaps, Report), BakeError> {
    let slug = ShrmSlices::CARD.slug;
    let chosen = choose(light, material, p, task)?;
    let need = 2 * chosen.expansion.bytes() as u64;
    if need > task.max_memory() {
        return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
    }
    let Choice { apart, expansion, scale, report, .. } = chosen;
    let s = &material.slices;
    let (stride, mut curve) = (HEAD + expansion.components.len(), Vec::new());
    for (i, a) in scale.iter().enumerate() {
        curve.extend([s.slices[i].gamma, a[0], a[1], a[2]].map(|x| x as f32));
        curve.extend(expansion.components.iter().map(|c| c.u[i] as f32));
    }
    let mut levels = Vec::new();
    for members in expansion.components.chunk_by(|a, b| a.size == b.size) {
        levels.extend(level(slug, &apart.rest, expansion.f, members, task)?);
    }
    if p.halves {
        levels.iter_mut().for_each(|l| l.maps.halve());
    }
    let stack = SliceMaps { centre: s.centre, stride, curve, levels, suns: apart.suns, halves: p.halves };
    Ok((stack, report))
}

/// The maps of components of one size, in bundles of as many as shading sums at a time.
fn level(
    slug: &'static str,
    light: &ShRgb,
    f: usize,
    members: &[Component],
    task: &Task,
) -> Result<Vec<Level>, BakeError> {
    let Some(size) = members.first().map(|c| c.size) else { return Ok(Vec::new()) };
    // Higher bands are lost between the texels anyway.
    let order = f.min(light.order).min(size);
    let most_q = members.iter().map(|c| c.q).max().unwrap_or(0);
    let plan = Plan::new(order, most_q, grid(size));
    let light = columns(light, order);
    let mut out = Vec::new();
    for part in members.chunks(MAX_TERMS / 2) {
        let row =
            |c: &'_ Component, k: usize| -> Vec<f64> { c.v[k].iter().take(order + 1).copied().collect() };
        let rows: Vec<[Vec<f64>; 3]> = part.iter().map(|c| std::array::from_fn(|k| row(c, k))).collect();
        let terms = part.iter().zip(&rows).map(|(c, k)| Term { q: c.q, k: [&k[0][..], &k[1], &k[2]] });
        let terms: Vec<_> = terms.collect();
        let maps = bundle(slug, &plan.maps(&light, &terms, task)?)?;
        out.push(Level { q: part.iter().map(|c| c.q as u32).collect(), maps });
    }
    Ok(out)
}

impl Part for SliceMaps {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f64(to, format!("{prefix}.centre"), vec![1], vec![self.centre.number()]);
        let shape = vec![self.elevations(), self.stride];
        put_f32(to, format!("{prefix}.curve"), shape, self.curve.clone());
        for (i, l) in self.levels.iter().enumerate() {
            l.maps.save(to, format!("{prefix}.maps{i:02}"), self.halves);
            let q = l.q.iter().map(|q| f64::from(*q)).collect();
            put_f64(to, format!("{prefix}.orders{i:02}"), vec![l.q.len()], q);
        }
        save_suns(&self.suns, to, format!("{prefix}.suns"));
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let bad = |name: &str| PartError::Unexpected(format!("{prefix}.{name}"));
        let (_, head) = get_f64(from, &format!("{prefix}.centre"), 1)?;
        let centre = head.first().and_then(|w| Centre::from_number(*w)).ok_or_else(|| bad("centre"))?;
        let (shape, curve) = get_f32(from, &format!("{prefix}.curve"), 2)?;
        let mut levels = Vec::new();
        let has = |i: usize| from.tensors.contains_key(&format!("{prefix}.maps{i:02}"));
        for i in (0..).take_while(|i| has(*i)) {
            let maps = Bundle::load(from, &format!("{prefix}.maps{i:02}"))?;
            let (_, q) = get_f64(from, &format!("{prefix}.orders{i:02}"), 1)?;
            let q: Vec<u32> = q.iter().map(|q| *q as u32).collect();
            let terms: usize = q.iter().map(|q| if *q == 0 { 1 } else { 2 }).sum();
            let small = q.iter().all(|q| (*q as usize) < MAX_ORDERS);
            if !maps.is_globe() || terms != maps.terms() || !q.is_sorted() || !small {
                return Err(bad("maps"));
            }
            levels.push(Level { q, maps });
        }
        let components: usize = levels.iter().map(|l| l.q.len()).sum();
        if shape[0] < 3 || shape[1] != HEAD + components {
            return Err(bad("curve"));
        }
        // Earlier versions saved suns as disks, under another name; such a bake would be shaded without its
        // suns.
        if from.tensors.contains_key(&format!("{prefix}.disks")) {
            return Err(bad("disks"));
        }
        let suns = load_suns(from, &format!("{prefix}.suns"))?;
        let halves = Bundle::is_half(from, &format!("{prefix}.maps00"));
        Ok(Self { centre, stride: HEAD + components, curve, levels, suns, halves })
    }

    fn bytes(&self) -> usize {
        let maps: usize = self.levels.iter().map(|l| l.maps.bytes() + 4 * l.q.len()).sum();
        maps + 4 * self.curve.len() + sun::BYTES * self.suns.len()
    }
}

/// Number of azimuthal orders q.
pub const MAX_ORDERS: usize = 256;

/// Extent of a level's maps: rows and columns.
pub fn extent(maps: &Bundle) -> [usize; 2] {
    match maps.grid() {
        Grid::Globe { rows, columns } => [rows, columns],
        Grid::Cube { size } => [size, size],
    }
}

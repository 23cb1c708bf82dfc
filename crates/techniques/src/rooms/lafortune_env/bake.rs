//! The maps of the exponents.

use super::LafortuneEnv;
use super::material::{Cosines, Term};
use crate::certify::Report;
use crate::shared::light::distant::DistantLight;
use crate::shared::tables::chain::Chain;
use crate::shared::tables::{cube_bytes, load_cube, save_cube};
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Part, Technique};
use std::f64::consts::PI;
use steradian_base::{ParamInfo, Task, params};
use steradian_prefilter::{Cosine, EdgeCube, Lobe, filter};
use steradian_sphere::quadrature::gauss_legendre;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// What stands for n·wi: 0 the lobe's axis, 1 the mirror direction, 2 the mean.
        pub cosine: usize = ParamInfo::choice("cosine", &["axis", "mirror-direction", "mean"], "what stands for n·wi: n·r̂ at the lobe's axis, n·r of the mirror direction (eq. 39), or its mean over the lobe").numbered(0.0).preset("mean"),
        /// Maps of the stack; one for each exponent where `None`.
        pub exponents: Option<usize> = ParamInfo::whole("exponents", [1.0, 64.0], 0.0, "maps of the stack, their exponents spaced geometrically over the lobes'; auto: one for each exponent").auto(0.0),
        /// Intervals per cube edge; what the tolerance needs where `None`.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 1024.0], 0.0, "intervals per cube edge of each map; auto: what the tolerance needs, at most 256").auto(0.0).unit("texels"),
    }
}

/// Tolerance where the user gives none.
const TOLERANCE: f64 = 5e-3;
/// Intervals per cube edge where the user gives none.
const LARGEST: usize = 256;
/// Columns of the table of cosines, over n·r̂ from −1 to 1.
pub const COLUMNS: usize = 257;
/// Numbers of a term: C, n, level, k 2π/(n + 1).
pub const STRIDE: usize = 8;

/// What shading reads.
#[derive(Debug, Clone, PartialEq)]
pub struct LafortuneMaps {
    /// ∫ (n+1)/2π (r·wi)₊^n L, from the largest exponent to the smallest.
    pub chain: Chain,
    /// Irradiance over n.
    pub diffuse: EdgeCube,
    /// Terms of [`STRIDE`] numbers.
    pub terms: Vec<[f32; STRIDE]>,
    /// The cosine's mean over the lobe of each map, [`COLUMNS`] a row; at least two rows.
    pub means: Vec<f32>,
    /// ρ_d/π, and what stands for n·wi.
    pub factors: [f32; 4],
}

/// The exponents of the stack, from the largest.
fn exponents(terms: &[Term], count: usize) -> Vec<f64> {
    let mut own: Vec<f64> = terms.iter().map(|t| t.n).collect();
    own.sort_by(|a, b| b.total_cmp(a));
    own.dedup();
    let (Some(&most), Some(&least)) = (own.first(), own.last()) else { return vec![1.0] };
    if count == 0 || own.len() == 1 {
        return own;
    }
    let last = (count.max(2) - 1) as f64;
    let step = ((least + 1.0) / (most + 1.0)).ln() / last;
    (0..count.max(2)).map(|k| (most + 1.0) * (step * k as f64).exp() - 1.0).collect()
}

/// Where exponent `n` lies in the stack; the maps between are mixed linearly in ln(n + 1).
fn level(stack: &[f64], n: f64) -> f64 {
    let b = stack.partition_point(|s| *s > n);
    if b == 0 || b == stack.len() {
        return b.min(stack.len() - 1) as f64;
    }
    let (most, least) = (stack[b - 1] + 1.0, stack[b] + 1.0);
    (b - 1) as f64 + (most / (n + 1.0)).ln() / (most / least).ln()
}

/// ∫ (r̂·wi)₊^n ⟨n·wi⟩₊ dwi / ∫ (r̂·wi)₊^n dwi where n·r̂ = `cosine`.
///
/// With u = cos^{n+1} ψ uniform in 0 … 1, what is left is the mean of ⟨a + b cos φ⟩₊ over φ, a = cos γ cos ψ, b =
/// sin γ sin ψ: a where a ≥ b, 0 where a ≤ −b, else (a φ₀ + b sin φ₀)/π with cos φ₀ = −a/b.
pub(super) fn mean_cosine(n: f64, cosine: f64) -> f64 {
    let (nodes, weights) = gauss_legendre(48);
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let ring = |u: f64| {
        let c = u.powf(1.0 / (n + 1.0));
        let (a, b) = (cosine * c, sine * (1.0 - c * c).max(0.0).sqrt());
        if a >= b {
            return a;
        }
        if a <= -b {
            return 0.0;
        }
        let phi = (-a / b).acos();
        (a * phi + b * phi.sin()) / PI
    };
    // u = v²(3 − 2v): the ends, where ψ runs like a root, lie denser.
    let at = |v: f64| ring(v * v * (3.0 - 2.0 * v)) * 6.0 * v * (1.0 - v);
    nodes.iter().zip(&weights).map(|(z, w)| 0.5 * w * at(0.5 + 0.5 * z)).sum()
}

fn means(stack: &[f64]) -> Vec<f32> {
    let row = |n: f64| {
        (0..COLUMNS).map(move |i| mean_cosine(n, 2.0 * i as f64 / (COLUMNS - 1) as f64 - 1.0) as f32)
    };
    let twice = stack.len().max(2);
    (0..twice).flat_map(|k| row(stack[k.min(stack.len() - 1)])).collect()
}

/// Filters the light by every exponent of the stack.
pub fn link(
    light: &DistantLight,
    m: &Cosines,
    p: &Params,
    task: &Task,
) -> Result<(LafortuneMaps, Report), BakeError> {
    let slug = LafortuneEnv::CARD.slug;
    let terms = m.terms();
    let stack = exponents(&terms, p.exponents.unwrap_or(0));
    let tolerance = task.tolerance().unwrap_or(TOLERANCE).min(0.1);
    let largest = p.size.unwrap_or(LARGEST);
    let need = (stack.len() * 6 * 16 * (largest + 1) * (largest + 1)) as u64;
    if need > task.max_memory() {
        return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
    }
    let size = p.size.map_or(filter::Size::UpTo(LARGEST), filter::Size::Fixed);
    task.begin("prefilter", stack.len() as u64);
    let (mut order, mut clipped) = (0, 0.0_f64);
    let mut cubes = Vec::new();
    for n in &stack {
        let cube = if terms.is_empty() {
            EdgeCube::from_fn(1, |_| [0.0; 3])
        } else {
            let f = filter(light.source(), &light.tree, &Lobe::phong(*n), size, tolerance, task)?;
            clipped = clipped.max(f.clipped);
            if let filter::CubeMethod::Frequency { order: o } = f.way {
                order = order.max(o);
            }
            f.cube
        };
        cubes.push(cube);
        task.advance(1);
    }
    task.end();
    let largest = cubes.iter().map(EdgeCube::size).max().unwrap_or(0);
    let diffuse = if m.0.kd == [0.0; 3] {
        EdgeCube::from_fn(1, |_| [0.0; 3])
    } else {
        filter(light.source(), &light.tree, &Cosine, filter::Size::UpTo(64), tolerance, task)?.cube
    };
    let chain = Chain::new(cubes).ok_or_else(|| BakeError::Light { slug, why: "no maps".into() })?;
    let numbers = |t: &Term| {
        let k = t.k.map(|k| k * 2.0 * PI / (t.n + 1.0));
        [t.c.x, t.c.y, t.c.z, t.n, level(&stack, t.n), k[0], k[1], k[2]].map(|x| x as f32)
    };
    let mut table: Vec<_> = terms.iter().map(numbers).collect();
    if table.is_empty() {
        // A GPU takes no empty buffer.
        table.push([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    }
    let [red, green, blue] = m.0.kd.map(|k| (k / PI) as f32);
    let factors = [red, green, blue, p.cosine as f32];
    let maps = LafortuneMaps { chain, diffuse, terms: table, means: means(&stack), factors };
    let report = Report::default()
        .detail("lookups", terms.len() as f64)
        .detail("maps", stack.len() as f64)
        .detail("order", order as f64)
        .detail("size", largest as f64)
        .detail("clipped", clipped);
    Ok((maps, report))
}

impl Part for LafortuneMaps {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.chain.save(to, &format!("{prefix}.phong"));
        save_cube(&self.diffuse, to, format!("{prefix}.irradiance"));
        let terms = self.terms.iter().flatten().copied().collect();
        put_f32(to, format!("{prefix}.terms"), vec![self.terms.len(), STRIDE], terms);
        let shape = vec![self.means.len() / COLUMNS, COLUMNS];
        put_f32(to, format!("{prefix}.cosines"), shape, self.means.clone());
        put_f32(to, format!("{prefix}.factors"), vec![4], self.factors.to_vec());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let chain = Chain::load(from, &format!("{prefix}.phong"))?;
        let name = |n: &str| format!("{prefix}.{n}");
        let (shape, terms) = get_f32(from, &name("terms"), 2)?;
        if shape[0] == 0 || shape[1] != STRIDE {
            return Err(PartError::Unexpected(name("terms")));
        }
        let (shape, means) = get_f32(from, &name("cosines"), 2)?;
        if shape != [chain.levels().len().max(2), COLUMNS] {
            return Err(PartError::Unexpected(name("cosines")));
        }
        let (_, factors) = get_f32(from, &name("factors"), 1)?;
        Ok(Self {
            chain,
            diffuse: load_cube(from, &name("irradiance"))?,
            terms: terms.chunks_exact(STRIDE).map(|t| std::array::from_fn(|i| t[i])).collect(),
            means,
            factors: factors.try_into().map_err(|_| PartError::Unexpected(name("factors")))?,
        })
    }

    fn bytes(&self) -> usize {
        self.chain.bytes()
            + cube_bytes(&self.diffuse)
            + 4 * STRIDE * self.terms.len()
            + 4 * self.means.len()
            + 16
    }
}

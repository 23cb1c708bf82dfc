//! The maps of the exponents.

use super::LafortuneEnv;
use super::material::{Cosines, Term};
use crate::certify::Report;
use crate::local::FileName;
use crate::shared::light::distant::DistantLight;
use crate::shared::surface::cosine_lobes::{CosineLobes, PLANES};
use crate::shared::tables::chain::Chain;
use crate::shared::tables::{cube_bytes, load_cube, save_cube};
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Material, Part, Technique};
use std::collections::BTreeSet;
use std::f64::consts::PI;
use steradian_base::{ParamInfo, Task, params};
use steradian_parallel::prelude::*;
use steradian_prefilter::{Cosine, EdgeCube, Lobe, Source, Zonal, filter};
use steradian_sphere::quadrature::gauss_legendre;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Approximation of n·wi outside the integral: 0 at the lobe's axis, 1 at the mirror direction, 2 the
        /// mean.
        pub cosine: usize = ParamInfo::choice("cosine", &["axis", "mirror-direction", "mean"], "what stands for n·wi: n·r̂ at the lobe's axis, n·r of the mirror direction (eq. 39), or its mean over the lobe").numbered(0.0).preset("mean"),
        /// Maps of the stack; one for each exponent where `None`, or as many as keep the error between them
        /// small.
        pub exponents: Option<usize> = ParamInfo::whole("exponents", [1.0, 64.0], 0.0, "maps of the stack, their exponents spaced geometrically over the lobes'; auto: one for each exponent, or where these vary by texel as many as bring the error between them to half the tolerance or 1 %, 33 at most").auto(0.0),
        /// Intervals per cube edge; where `None`, as many as the tolerance needs.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 1024.0], 0.0, "intervals per cube edge of each map; auto: what the tolerance needs, at most 256").auto(0.0).unit("texels"),
        /// Albedo of the diffuse part by texel.
        pub rho_d: Option<FileName> = ParamInfo::file("rho_d", "image of the diffuse albedo; auto: that of the reflectance").auto(f64::NAN),
        /// Factor of the first lobe by texel.
        pub rho_1: Option<FileName> = ParamInfo::file("rho_1", "image of the first lobe's factor; auto: that of the reflectance, or 0").auto(f64::NAN),
        /// C of the first lobe by texel.
        pub c_1: Option<FileName> = ParamInfo::file("c_1", "image of the first lobe's C, as red, green and blue (.exr or .pfm); auto: that of the reflectance, or -1, -1, 1").auto(f64::NAN),
        /// Exponent of the first lobe by texel.
        pub n_1: Option<FileName> = ParamInfo::file("n_1", "image of the first lobe's exponent, 0.001 at least (.exr or .pfm); auto: that of the reflectance, or 1").auto(f64::NAN),
        /// Factor of the second lobe by texel.
        pub rho_2: Option<FileName> = ParamInfo::file("rho_2", "the same of the second lobe").auto(f64::NAN),
        /// C of the second lobe by texel.
        pub c_2: Option<FileName> = ParamInfo::file("c_2", "the same of the second lobe").auto(f64::NAN),
        /// Exponent of the second lobe by texel.
        pub n_2: Option<FileName> = ParamInfo::file("n_2", "the same of the second lobe").auto(f64::NAN),
    }
}

impl Params {
    /// Refuses a material that lacks an image which these parameters name.
    pub(super) fn check_read(&self, m: &Material) -> Result<(), BakeError> {
        let named = [&self.rho_d, &self.rho_1, &self.c_1, &self.n_1, &self.rho_2, &self.c_2, &self.n_2];
        let missing = PLANES.iter().zip(named).find(|(p, file)| file.is_some() && !m.textures.has(p.name));
        missing.map_or(Ok(()), |(p, _)| {
            let why = format!("the file of {} was not read", p.name);
            Err(BakeError::Material { slug: LafortuneEnv::CARD.slug, why })
        })
    }
}

/// Tolerance where the user gives none.
const TOLERANCE: f64 = 5e-3;
/// Intervals per cube edge where the user gives none.
const LARGEST: usize = 256;
/// Most maps where exponents vary by texel and the user gives no number.
const MOST_MAPS: usize = 33;
/// Target relative RMS error between maps, by which their number is chosen where the user gives no tolerance.
const BETWEEN: f64 = 0.01;
/// Exponents whose ln(n + 1) differ by less than this share a map.
const NEAR: f64 = 1e-4;
/// Columns of the table of cosines, over n·r̂ from −1 to 1.
pub const COLUMNS: usize = 257;
/// Numbers of a term: C, n, level, k 2π/(n + 1).
pub const STRIDE: usize = 8;

/// Data that shading reads.
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
    /// ρ_d/π, and the number of the approximation of n·wi.
    pub factors: [f32; 4],
    /// For exponents by texel: ln(n + 1) of the first map, and maps for a step of 1 in it; 0, 0 else.
    pub ladder: [f32; 4],
}

/// The exponents that lobes by texel have at the texels of all levels and at the corners between them, where
/// lobes of different axes mix and are wider: their logarithms ln(n + 1) in steps of [`NEAR`], except for the
/// least and the largest, which are exact.
struct Varied {
    steps: BTreeSet<i64>,
    least: f64,
    most: f64,
}

impl Varied {
    fn of(lobes: &CosineLobes, task: &Task) -> Result<Self, BakeError> {
        let (width, height) = lobes.patch.size();
        let side = width.max(height);
        let row = |level: u32, j: usize| {
            let (w, h) = ((width >> level).max(1), (height >> level).max(1));
            let footprint = if level == 0 { 0.0 } else { (1usize << level) as f32 / side as f32 };
            let mut found = Vec::new();
            for i in 0..2 * w {
                let uv = [(i as f32 + 1.0) / (2 * w) as f32, (j as f32 + 1.0) / (2 * h) as f32];
                let texel = lobes.at(uv, footprint);
                for lobe in texel.lobes.iter().take(lobes.count) {
                    let there = (0..3).filter(|c| lobe.rho[*c] > 0.0);
                    found.extend(there.map(|c| (f64::from(lobe.n[c]) + 1.0).ln()));
                }
            }
            let ends =
                found.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(*x), b.max(*x)]);
            (found.iter().map(|x| (x / NEAR).round() as i64).collect::<BTreeSet<_>>(), ends)
        };
        let mut out = Self { steps: BTreeSet::new(), least: f64::INFINITY, most: f64::NEG_INFINITY };
        for level in 0..usize::BITS - side.leading_zeros() {
            task.check().map_err(BakeError::from)?;
            let rows: Vec<_> =
                (0..2 * (height >> level).max(1)).into_par_iter().map(|j| row(level, j)).collect();
            for (steps, [least, most]) in rows {
                out.steps.extend(steps);
                (out.least, out.most) = (out.least.min(least), out.most.max(most));
            }
        }
        Ok(out)
    }

    /// The exponents of a stack of `count` maps.
    fn stack(&self, count: usize) -> Vec<f64> {
        let step = (self.least - self.most) / (count - 1).max(1) as f64;
        (0..count).map(|k| (self.most + step * k as f64).exp() - 1.0).collect()
    }

    /// Would each exponent have a map of its own in a stack of `count`?
    fn are_maps(&self, count: usize) -> bool {
        let step = (self.most - self.least) / (count - 1).max(1) as f64;
        self.steps.len() <= 3 * count
            && self.steps.iter().all(|s| {
                let from = *s as f64 * NEAR - self.least;
                (from - (from / step).round() * step).abs() <= 2.0 * NEAR
            })
    }

    /// The stack: so many maps, or as few as keep the error between them to `goal`; and that error.
    fn choose(&self, asked: Option<usize>, source: &Source, goal: f64) -> (Vec<f64>, f64) {
        if !self.least.is_finite() {
            return (vec![1.0], 0.0);
        }
        if self.most - self.least <= 2.0 * NEAR {
            return (self.stack(1), 0.0);
        }
        if let Some(n) = asked {
            let stack = self.stack(n.max(2));
            let error = between(&stack, source);
            return (stack, error);
        }
        let mut count = 2;
        loop {
            let stack = self.stack(count);
            if self.are_maps(count) {
                return (stack, 0.0);
            }
            let error = between(&stack, source);
            if error <= goal || count == MOST_MAPS {
                return (stack, error);
            }
            count += 1;
        }
    }
}

/// Largest relative RMS error, over directions, of the mean of two neighbouring maps in place of the map of
/// the exponent half way between, from the light's energy by band and the kernels' coefficients.
fn between(stack: &[f64], source: &Source) -> f64 {
    let coefficients = |n: f64| Lobe::phong(n).coefficients(source.order());
    let pairs: Vec<[f64; 2]> = stack.windows(2).map(|w| [w[0], w[1]]).collect();
    let error = |[a, b]: &[f64; 2]| {
        let middle = ((a + 1.0) * (b + 1.0)).sqrt() - 1.0;
        let [a, b, exact] = [*a, *b, middle].map(coefficients);
        let mut sums = [0.0; 2];
        for (l, energy) in source.bands.iter().enumerate().take(exact.len()) {
            sums[0] += energy * (0.5 * (a[l] + b[l]) - exact[l]).powi(2);
            sums[1] += energy * exact[l].powi(2);
        }
        if sums[1] > 0.0 { (sums[0] / sums[1]).sqrt() } else { 0.0 }
    };
    let all: Vec<f64> = pairs.par_iter().map(error).collect();
    all.into_iter().fold(0.0, f64::max)
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

/// Position of exponent `n` in the stack; the maps between are mixed linearly in ln(n + 1).
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
/// With u = cos^{n+1} ψ uniform in 0 … 1, the inner mean is that of ⟨a + b cos φ⟩₊ over φ, a = cos γ cos ψ,
/// b = sin γ sin ψ: a where a ≥ b, 0 where a ≤ −b, else (a φ₀ + b sin φ₀)/π with cos φ₀ = −a/b.
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
    let terms = if m.varied.is_some() { Vec::new() } else { m.terms() };
    let tolerance = task.tolerance().unwrap_or(TOLERANCE).min(0.1);
    let (stack, between) = match &m.varied {
        Some(lobes) => {
            let goal = task.tolerance().map_or(BETWEEN, |t| 0.5 * t);
            Varied::of(lobes, task)?.choose(p.exponents, light.source(), goal)
        }
        None => (exponents(&terms, p.exponents.unwrap_or(0)), 0.0),
    };
    let lobes = m.varied.as_ref().map_or(!terms.is_empty(), |v| v.count > 0);
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
        let cube = if !lobes {
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
    let diffuse = if m.own.kd == [0.0; 3] && !m.has("rho_d") {
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
    let [red, green, blue] = m.own.kd.map(|k| (k / PI) as f32);
    let factors = [red, green, blue, p.cosine as f32];
    let mut ladder = [0.0; 4];
    if let (true, Some(first), Some(last)) = (m.varied.is_some(), stack.first(), stack.last()) {
        let [first, last] = [first, last].map(|n| (n + 1.0).ln());
        let steps = (stack.len() - 1) as f64;
        ladder[0] = first as f32;
        ladder[1] = if first > last { (steps / (first - last)) as f32 } else { 0.0 };
    }
    let maps = LafortuneMaps { chain, diffuse, terms: table, means: means(&stack), factors, ladder };
    let mut report = Report::default();
    report = match &m.varied {
        Some(v) => report
            .detail("lobes", v.count as f64)
            .detail("bytes a texel", v.stride() as f64)
            .detail("error between maps", between),
        None => report.detail("lookups", terms.len() as f64),
    };
    let report = report
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
        put_f32(to, format!("{prefix}.ladder"), vec![4], self.ladder.to_vec());
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
        let (_, ladder) = get_f32(from, &name("ladder"), 1)?;
        Ok(Self {
            chain,
            diffuse: load_cube(from, &name("irradiance"))?,
            terms: terms.chunks_exact(STRIDE).map(|t| std::array::from_fn(|i| t[i])).collect(),
            means,
            factors: factors.try_into().map_err(|_| PartError::Unexpected(name("factors")))?,
            ladder: ladder.try_into().map_err(|_| PartError::Unexpected(name("ladder")))?,
        })
    }

    fn bytes(&self) -> usize {
        self.chain.bytes()
            + cube_bytes(&self.diffuse)
            + 4 * STRIDE * self.terms.len()
            + 4 * self.means.len()
            + 32
    }
}

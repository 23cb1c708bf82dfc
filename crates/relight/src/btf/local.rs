//! Clusters of texels, and principal components of each.
//!
//! Müller, Meseth & Klein (2003), *Compression and Real-Time Rendering of Measured BTFs Using Local PCA*:
//! texels are points; two steps take turns, each texel goes to the cluster with the least error on it, and
//! each cluster takes the mean and the principal components of its texels ([`Clusters`]). Points of many
//! dimensions are first taken to a subspace that holds most of them, by random sums of texels (Halko,
//! Martinsson & Tropp 2011; Clarkson & Woodruff 2013): the part outside it is equal for all clusters, and no
//! step raises the part inside. Then means and components are refined in all dimensions, by orthogonal
//! iteration, which never raises the error either: the squares that a subspace holds are a convex function of
//! it, and each step goes to where its tangent is highest.

use super::linear::{BLOCK, add, dot, orthonormal, products};
use super::{Btf, GoOn, Levels};
use steradian_numerics::clusters::{Clusters, Settings};
use steradian_parallel::prelude::*;

/// Clusters of texels.
#[derive(Debug, Clone, PartialEq)]
pub struct Local {
    /// Tables of a cluster in addition to its mean.
    pub components: usize,
    /// Numbers of a table: three for each pair of view and light, view after view.
    pub dimension: usize,
    /// `[cluster][mean, then components][pair][colour]`.
    pub tables: Vec<f32>,
    /// The cluster of each texel of all levels.
    pub cluster: Vec<u32>,
    /// Weights of the components, `[texel][component]`.
    pub weights: Vec<f32>,
}

/// Where texels, or the numbers of a texel, are at most this many, the clustering uses all dimensions. 192
/// and 768 give the same error of a bumpy surface (32² texels, 25 views and 25 lights).
const MAX_FULL: usize = 384;
/// Dimensions of the clustering otherwise. On that surface, in 12 clusters of 5 components, half as many
/// leave 0.152 in place of 0.154 in 0.65 of the time, twice as many 0.154 in 1.9 of it.
const SKETCH_DIMENSIONS: usize = 160;
/// Number of random sums that a texel is part of. Two and eight give the same error of that surface.
const SUMS_PER_TEXEL: usize = 4;
/// Rounds of clustering at most: a guard. 12 and 48 give the same there.
const MAX_ROUNDS: usize = 24;
/// Steps of refinement at most: a guard. 4 and 16 give the same there.
const MAX_STEPS: usize = 8;
/// Refinement ends where a step reduces the error by less than this part. Half and twice give the same there.
const MIN_GAIN: f64 = 1e-3;
/// Texels that a task takes: they are sorted by cluster, so that a cluster's tables stay in the cache.
const TEXELS_PER_TASK: usize = 16;

impl Local {
    /// The clusters of a function, and the squared errors after each step.
    pub(super) fn new(
        of: &Btf,
        levels: &Levels,
        [clusters, components]: [usize; 2],
        go_on: GoOn<'_>,
    ) -> Option<(Self, Vec<f64>)> {
        let (texels, d) = (of.texels(), of.dimension());
        let components = components.min(d);
        let basis = basis(of, go_on);
        let points = coordinates(of, basis.as_deref(), go_on);
        if !go_on() {
            return None;
        }
        let r = points.len() / texels;
        let settings = Settings { clusters, components, rounds: MAX_ROUNDS };
        let coarse = Clusters::new(&points, r, settings, go_on);
        if !go_on() {
            return None;
        }
        let inside: f64 = points.chunks_exact(r).map(|p| dot(p, p)).sum();
        let outside = if basis.is_some() { (of.energy() - inside).max(0.0) } else { 0.0 };
        let mut errors: Vec<f64> = coarse.errors.iter().map(|e| e * texels as f64 + outside).collect();
        drop(points);
        let mut out = Self {
            components,
            dimension: d,
            tables: vec![0.0; coarse.len() * (components + 1) * d],
            cluster: coarse.cluster.clone(),
            weights: Vec::new(),
        };
        let means = out.means(of, coarse.len(), go_on);
        for (k, table) in out.tables.chunks_exact_mut((components + 1) * d).enumerate() {
            table[..d].copy_from_slice(&means[k * d..][..d]);
            let own = &coarse.basis(k)[r..];
            for (to, e) in table[d..].chunks_exact_mut(d).zip(own.chunks_exact(r)) {
                match &basis {
                    Some(basis) => {
                        basis.chunks_exact(d).zip(e).for_each(|(b, e)| add(to, *e as f32, b));
                    }
                    None => to.iter_mut().zip(e).for_each(|(t, e)| *t = *e as f32),
                }
            }
        }
        out.refine(of, &mut errors, go_on)?;
        for level in 1..levels.len() {
            out.coarser(levels, level, go_on);
        }
        go_on().then_some((out, errors))
    }

    /// Clusters.
    pub fn len(&self) -> usize {
        self.tables.len() / ((self.components + 1) * self.dimension)
    }

    /// Are there none?
    pub fn is_empty(&self) -> bool {
        self.tables.is_empty()
    }

    /// Mean and components of a cluster.
    fn tables(&self, cluster: usize) -> &[f32] {
        let n = (self.components + 1) * self.dimension;
        &self.tables[cluster * n..][..n]
    }

    /// Numbers that are kept of so many texels.
    pub(super) fn numbers(&self, texels: usize) -> f64 {
        self.tables.len() as f64 + texels as f64 * (self.components as f64 + 0.5)
    }

    pub(super) fn decode(&self, texel: usize, pair: usize) -> [f32; 3] {
        let tables = self.tables(self.cluster[texel] as usize);
        let w = &self.weights[texel * self.components..][..self.components];
        let at = |k: usize, c: usize| tables[k * self.dimension + 3 * pair + c];
        std::array::from_fn(|c| w.iter().zip(1..).map(|(w, k)| w * at(k, c)).sum::<f32>() + at(0, c))
    }

    /// All numbers of a texel.
    fn row(&self, texel: usize, to: &mut [f32]) {
        let tables = self.tables(self.cluster[texel] as usize);
        to.copy_from_slice(&tables[..self.dimension]);
        let w = &self.weights[texel * self.components..][..self.components];
        tables[self.dimension..].chunks_exact(self.dimension).zip(w).for_each(|(e, w)| add(to, *w, e));
    }

    /// Means of the clusters' texels.
    fn means(&self, of: &Btf, clusters: usize, go_on: GoOn<'_>) -> Vec<f32> {
        let mut counts = vec![0.0f64; clusters];
        self.cluster.iter().for_each(|k| counts[*k as usize] += 1.0);
        by_columns(of, clusters, go_on, |columns, first| {
            let mut sums = vec![0.0f64; clusters * columns];
            let mut part = vec![0.0; columns];
            for (x, k) in self.cluster.iter().enumerate() {
                of.part(x, first, &mut part);
                let to = &mut sums[*k as usize * columns..][..columns];
                to.iter_mut().zip(&part).for_each(|(s, v)| *s += f64::from(*v));
            }
            let each = sums.iter().enumerate().map(|(i, s)| (s / counts[i / columns].max(1.0)) as f32);
            each.collect()
        })
    }

    /// Weights of the finest texels, and the squared error.
    fn weigh(&self, of: &Btf, go_on: GoOn<'_>) -> Option<(Vec<f32>, f64)> {
        let (d, c) = (self.dimension, self.components);
        // Texels of a cluster one after the other, so that its tables stay in the cache.
        let mut order: Vec<usize> = (0..of.texels()).collect();
        order.sort_by_key(|x| self.cluster[*x]);
        let some = |texels: &[usize]| {
            let (mut row, mut weights) = (vec![0.0; d], Vec::with_capacity(texels.len() * c));
            let mut errors = Vec::with_capacity(texels.len());
            for x in texels.iter().take_while(|_| go_on()) {
                of.part(*x, 0, &mut row);
                let tables = self.tables(self.cluster[*x] as usize);
                add(&mut row, -1.0, &tables[..d]);
                let w: Vec<f32> = products(&row, &tables[d..], d).into_iter().map(|w| w as f32).collect();
                tables[d..].chunks_exact(d).zip(&w).for_each(|(e, w)| add(&mut row, -w, e));
                errors.push(dot(&row, &row));
                weights.extend(w);
            }
            (weights, errors)
        };
        let all: Vec<(Vec<f32>, Vec<f64>)> = order.par_chunks(TEXELS_PER_TASK).map(some).collect();
        if !go_on() {
            return None;
        }
        let (mut weights, mut error) = (vec![0.0; of.texels() * c], 0.0);
        for (texels, (w, e)) in order.chunks(TEXELS_PER_TASK).zip(&all) {
            for (i, x) in texels.iter().enumerate() {
                weights[x * c..][..c].copy_from_slice(&w[i * c..][..c]);
                error += e[i];
            }
        }
        Some((weights, error))
    }

    /// Orthogonal iteration (Bauer 1957): components become the texels' sums with their weights, made
    /// orthonormal.
    fn refine(&mut self, of: &Btf, errors: &mut Vec<f64>, go_on: GoOn<'_>) -> Option<()> {
        let (d, c, clusters) = (self.dimension, self.components, self.len());
        let (mut weights, mut error) = self.weigh(of, go_on)?;
        errors.push(error);
        for _ in 0..MAX_STEPS {
            if c == 0 || error == 0.0 {
                break;
            }
            let moved = by_columns(of, clusters * c, go_on, |columns, first| {
                let mut sums = vec![0.0f32; clusters * c * columns];
                let mut part = vec![0.0; columns];
                for (x, k) in self.cluster.iter().enumerate() {
                    let k = *k as usize;
                    of.part(x, first, &mut part);
                    add(&mut part, -1.0, &self.tables(k)[first..first + columns]);
                    for j in 0..c {
                        add(&mut sums[(k * c + j) * columns..][..columns], weights[x * c + j], &part);
                    }
                }
                sums
            });
            if !go_on() {
                return None;
            }
            let before = self.tables.clone();
            for (k, table) in self.tables.chunks_exact_mut((c + 1) * d).enumerate() {
                table[d..].copy_from_slice(&orthonormal(&moved[k * c * d..][..c * d], d));
            }
            let (w, e) = self.weigh(of, go_on)?;
            // Rounding alone may raise it, once nothing is left to gain.
            if e >= error {
                self.tables = before;
                break;
            }
            let gained = error - e;
            (weights, error) = (w, e);
            errors.push(e);
            if gained < MIN_GAIN * error {
                break;
            }
        }
        self.weights = weights;
        Some(())
    }

    /// Texels of a coarser level: means of the compressed finer ones, in that of their clusters that has the
    /// least error.
    fn coarser(&mut self, levels: &Levels, level: usize, go_on: GoOn<'_>) {
        let (d, c) = (self.dimension, self.components);
        let this = &*self;
        let one = |texel: usize| {
            let (mut mean, mut row) = (vec![0.0; d], vec![0.0; d]);
            let mut near: Vec<u32> = Vec::new();
            for (from, w) in levels.covers(level, texel).into_iter().take_while(|_| go_on()) {
                this.row(from, &mut row);
                add(&mut mean, w, &row);
                near.push(this.cluster[from]);
            }
            near.sort_unstable();
            near.dedup();
            let mut best = (f64::INFINITY, 0, Vec::new());
            for k in near {
                let tables = this.tables(k as usize);
                row.copy_from_slice(&mean);
                add(&mut row, -1.0, &tables[..d]);
                let w = products(&row, &tables[d..], d);
                let error = dot(&row, &row) - w.iter().map(|w| w * w).sum::<f64>();
                if error < best.0 {
                    best = (error, k, w.into_iter().map(|w| w as f32).collect());
                }
            }
            (best.1, best.2)
        };
        let all: Vec<(u32, Vec<f32>)> = (0..levels.texels(level)).into_par_iter().map(one).collect();
        for (k, w) in all {
            self.cluster.push(k);
            self.weights.extend(w);
            self.weights.resize(self.cluster.len() * c, 0.0);
        }
    }
}

/// Rows of sums over texels, a block of columns at a time: `block` gets columns and the first, and gives
/// `rows` rows of them. Zeros once `go_on` returns false.
fn by_columns(
    of: &Btf,
    rows: usize,
    go_on: GoOn<'_>,
    block: impl Fn(usize, usize) -> Vec<f32> + Sync + Send,
) -> Vec<f32> {
    let d = of.dimension();
    let columns = |b: usize| BLOCK.min(d - b * BLOCK);
    let blocks: Vec<Vec<f32>> = (0..d.div_ceil(BLOCK))
        .into_par_iter()
        .with_max_len(1)
        .map(|b| if go_on() { block(columns(b), b * BLOCK) } else { Vec::new() })
        .collect();
    let mut out = vec![0.0; rows * d];
    for (b, block) in blocks.iter().enumerate() {
        for (to, from) in out.chunks_exact_mut(d).zip(block.chunks_exact(columns(b))) {
            to[b * BLOCK..][..from.len()].copy_from_slice(from);
        }
    }
    out
}

/// Orthonormal vectors that hold most of the texels; `None` for all dimensions.
fn basis(of: &Btf, go_on: GoOn<'_>) -> Option<Vec<f32>> {
    let (texels, d) = (of.texels(), of.dimension());
    if d <= MAX_FULL {
        return None;
    }
    if texels <= MAX_FULL {
        let mut rows = vec![0.0; texels * d];
        rows.chunks_exact_mut(d).enumerate().for_each(|(x, row)| of.part(x, 0, row));
        return Some(orthonormal(&rows, d));
    }
    let sums = by_columns(of, SKETCH_DIMENSIONS, go_on, |columns, first| {
        let mut sums = vec![0.0f32; SKETCH_DIMENSIONS * columns];
        let mut part = vec![0.0; columns];
        for x in 0..texels {
            of.part(x, first, &mut part);
            for s in 0..SUMS_PER_TEXEL {
                let z = mixed((x * SUMS_PER_TEXEL + s) as u64);
                let sign = if z >> 63 == 0 { 1.0 } else { -1.0 };
                add(&mut sums[(z % SKETCH_DIMENSIONS as u64) as usize * columns..][..columns], sign, &part);
            }
        }
        sums
    });
    go_on().then(|| orthonormal(&sums, d))
}

/// Steele, Lea & Flood 2014, SplitMix.
pub(super) fn mixed(k: u64) -> u64 {
    let mut z = (k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The texels in a basis, or unchanged; incomplete once `go_on` returns false.
fn coordinates(of: &Btf, basis: Option<&[f32]>, go_on: GoOn<'_>) -> Vec<f32> {
    let (texels, d) = (of.texels(), of.dimension());
    let some = |b: usize| {
        if !go_on() {
            return Vec::new();
        }
        let rows = TEXELS_PER_TASK.min(texels - b * TEXELS_PER_TASK);
        let mut part = vec![0.0; rows * d];
        part.chunks_exact_mut(d).enumerate().for_each(|(i, row)| of.part(b * TEXELS_PER_TASK + i, 0, row));
        match basis {
            Some(basis) => products(&part, basis, d).into_iter().map(|x| x as f32).collect(),
            None => part,
        }
    };
    let all: Vec<Vec<f32>> =
        (0..texels.div_ceil(TEXELS_PER_TASK)).into_par_iter().with_max_len(4).map(some).collect();
    all.concat()
}

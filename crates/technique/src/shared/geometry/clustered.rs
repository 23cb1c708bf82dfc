//! Transfer matrices as a few of each cluster of sites, and weights.
//!
//! Sloan, Hall, Hart & Snyder (2003), *Clustered Principal Components for Precomputed Radiance Transfer*: M ≈
//! M_k0 + Σ_i w_i M_ki with k the site's cluster, orthonormal M_ki in Frobenius' product, found by local
//! principal component analysis ([`steradian_numerics::clusters`]).
//!
//! The paper analyses the matrices, bands⁴ numbers each. Shadowing alone makes them linear in the (2·bands −
//! 1)² coefficients of V, M = Σ_k Γ_k V_k, and Σ_ij (Γ_k)_ij (Γ_l)_ij = g_l δ_kl depends on the band alone,
//! because turning V turns M and no product of matrices notices. So the analysis of √g_l V_k is that of the
//! matrices, exactly, on 81 numbers in place of 625 at 5 bands.

use crate::shared::geometry::by_group::MOST_GROUPS;
use crate::shared::geometry::matrices::{
    Accuracy, Below, Matrices, affordable, matrix, packed, seen, visibility,
};
use crate::shared::geometry::site_sum::{MOST, Vectors, Weights};
use crate::tensors::{PartError, TensorFile, get_f32, get_f64, put_f64};
use crate::{BakeError, Geometry, Part, Sites};
use half::f16;
use half::slice::HalfFloatSliceExt;
use steradian_base::Task;
use steradian_formats::{Tensor, TensorData};
use steradian_numerics::clusters::{self, Clusters};
use steradian_parallel::prelude::*;
use steradian_scene::Mesh;
use steradian_simd::{Arch, Single, Vector};
use steradian_transfer::Products;

/// Most clusters: their indices are stored in half precision, which is exact up to 2048.
pub const MAX_CLUSTERS: usize = MOST_GROUPS;
/// Most iterations of the clustering, of two steps each.
const ROUNDS: usize = 30;

/// Errors of the compression, measured at the sites.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Lost {
    /// √(Σ‖M̃ − M‖²/Σ‖M‖²) over all sites.
    pub matrices: f64,
    /// Along edges of the mesh whose ends are in different clusters: RMS of the step that the error takes,
    /// relative to that of the matrices. 0 where there are no edges.
    pub seams: f64,
    /// The same RMS, along edges whose ends are in one cluster.
    pub within: f64,
}

/// Matrices of clusters, and each site's cluster and weights.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Clustered {
    /// For each cluster the mean and the components.
    basis: Matrices,
    /// Components of a cluster.
    components: usize,
    /// For each site its cluster and the weights of the components.
    sites: Vec<f16>,
    /// Errors of this compression.
    pub lost: Lost,
}

/// Number of clusters, and of components in each.
#[derive(Debug, Clone, Copy)]
pub struct Size {
    /// Clusters.
    pub clusters: usize,
    /// Components in addition to the mean.
    pub components: usize,
}

impl Clustered {
    /// The matrices of the sites of `g`.
    pub fn bake(
        slug: &'static str,
        g: &Geometry,
        of: Accuracy,
        below: Below,
        size: Size,
        task: &Task,
    ) -> Result<Self, BakeError> {
        let d = (2 * of.bands - 1).pow(2);
        let (sites, transfer) = visibility(slug, g, of, task)?;
        // Memory for the coordinates, as f32, and for a while also as f64.
        affordable(slug, (12 * d * sites.len()) as u64, task)?;
        let products = Products::new(of.bands);
        let scale = scale(&products);
        let coordinates = |(s, site): (usize, &_)| -> Vec<f32> {
            let v = seen(site, transfer.visibility(s), below);
            v.iter().zip(&scale).map(|(v, g)| (v * g) as f32).collect()
        };
        let points: Vec<f32> = sites.par_iter().enumerate().flat_map_iter(coordinates).collect();
        task.begin("clusters", 1);
        let settings =
            clusters::Settings { clusters: size.clusters, components: size.components, rounds: ROUNDS };
        let found = Clusters::new(&points, d, settings, || task.check().is_ok());
        task.end();
        task.check()?;
        let mesh = matches!(g.sites, Sites::Vertices).then_some(&*g.mesh);
        Ok(Self {
            basis: basis(&products, &found, &scale),
            components: found.components,
            sites: rows(&found),
            lost: lost(&found, &points, mesh),
        })
    }

    /// Components of a cluster in addition to its mean.
    pub fn components(&self) -> usize {
        self.components
    }

    /// The matrices of all clusters: mean and components, cluster after cluster.
    pub fn basis(&self) -> &Matrices {
        &self.basis
    }

    /// For each site its cluster and its weights, `components` + 1 numbers.
    pub fn sites(&self) -> &[f16] {
        &self.sites
    }
}

/// √g_l for each coefficient: the norm of the matrix of a V that is one harmonic.
fn scale(products: &Products) -> Vec<f64> {
    let wide = 2 * products.bands() - 1;
    let norm = |l: usize| {
        let mut v = vec![0.0; wide * wide];
        v[l * l + l] = 1.0;
        products.matrix(&v).iter().map(|x| x * x).sum::<f64>().sqrt()
    };
    let norms: Vec<f64> = (0..wide).map(norm).collect();
    (0..wide * wide).map(|k: usize| norms[k.isqrt()]).collect()
}

fn basis(products: &Products, found: &Clusters, scale: &[f64]) -> Matrices {
    let n = products.bands().pow(2);
    let rows: Vec<&[f64]> = found.bases.chunks_exact(found.dimension.max(1)).collect();
    let of = |row: &&[f64]| {
        let v: Vec<f64> = row.iter().zip(scale).map(|(x, g)| x / g).collect();
        matrix(products, &v)
    };
    let all: Vec<f32> = rows.par_iter().flat_map_iter(of).collect();
    assert_eq!(all.len(), rows.len() * packed(n));
    Matrices::from_sites(n, &all, false)
}

fn rows(found: &Clusters) -> Vec<f16> {
    let weights = |s: usize| &found.weights[s * found.components..][..found.components];
    let row = |(s, k): (usize, &u32)| {
        std::iter::once(*k as f32).chain(weights(s).iter().copied()).map(f16::from_f32).collect::<Vec<_>>()
    };
    found.cluster.iter().enumerate().flat_map(row).collect()
}

fn lost(found: &Clusters, points: &[f32], mesh: Option<&Mesh>) -> Lost {
    let d = found.dimension;
    let point = |s: usize| &points[s * d..][..d];
    let off: Vec<Vec<f64>> = (0..found.cluster.len())
        .into_par_iter()
        .map(|s| found.value(s).iter().zip(point(s)).map(|(a, b)| a - f64::from(*b)).collect())
        .collect();
    let square = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
    let ratio = |a: f64, b: f64| if b > 0.0 { (a / b).sqrt() } else { 0.0 };
    let all: f64 = points.iter().map(|x| f64::from(*x).powi(2)).sum();
    let matrices = ratio(off.iter().map(|o| square(o)).sum(), all);
    // Sums of squares over edges within a cluster, and between two.
    let mut sums = [[0.0f64; 2]; 2];
    for t in mesh.iter().flat_map(|m| &m.triangles) {
        for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
            let (a, b) = (a as usize, b as usize);
            let to = &mut sums[usize::from(found.cluster[a] != found.cluster[b])];
            to[0] += off[a].iter().zip(&off[b]).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            to[1] += point(a).iter().zip(point(b)).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
        }
    }
    let [within, seams] = sums.map(|s| ratio(s[0], s[1]));
    Lost { matrices, seams, within }
}

/// Vectors of sites as weighted sums of the vectors of their clusters.
pub struct ClusterVectors<'a> {
    /// The clusters of sites.
    pub clustered: &'a Clustered,
    /// For each matrix of the basis, three channels of padded coefficients.
    pub vectors: &'a [f32],
    /// Number of values of a matrix in `vectors`.
    pub each: usize,
}

/// A whole number from 0 to 2048 (conversions of single numbers take longer than all else that a group
/// needs).
#[inline(always)]
fn whole(x: f16) -> usize {
    let (exponent, digits) = (u32::from(x.to_bits() >> 10), u32::from(x.to_bits() & 1023));
    // (1 + digits/1024) · 2^(exponent − 15)
    if exponent == 0 { 0 } else { (2 * (1024 + digits)) as usize >> (26 - exponent.min(26)) }
}

impl Vectors for ClusterVectors<'_> {
    #[inline(always)]
    fn at<A: Arch>(&self, site: u32, weights: &mut Weights) -> Option<&[f32]> {
        let row = self.clustered.components + 1;
        let start = site as usize * row;
        let sites = self.clustered.sites.get(start..)?;
        if sites.len() < row {
            return None;
        }
        let bits: &[u16] = sites.reinterpret_cast();
        let lanes = A::F32::LANES;
        for at in (0..row).step_by(lanes) {
            if let Some(bits) = bits.get(at..at + lanes) {
                A::F32::load_half(bits).store(&mut weights[at..]);
            } else {
                let mut last = [0u16; MOST];
                last[..bits.len() - at].copy_from_slice(&bits[at..]);
                A::F32::load_half(&last).store(&mut weights[at..]);
            }
        }
        let all = row * self.each;
        let first = whole(sites[0]) * all;
        self.vectors.get(first..first + all)
    }

    fn groups(&self) -> usize {
        self.vectors.len() / ((self.clustered.components + 1) * self.each).max(1)
    }

    #[inline(always)]
    fn group(&self, site: u32) -> Option<usize> {
        let first = site as usize * (self.clustered.components + 1);
        self.clustered.sites.get(first).map(|k| whole(*k))
    }
}

impl Part for Clustered {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.basis.save(to, &format!("{prefix}.clusters"));
        let row = self.components + 1;
        let shape = vec![self.sites.len() / row, row];
        to.tensors
            .insert(format!("{prefix}.weights"), Tensor { shape, data: TensorData::F16(self.sites.clone()) });
        let Lost { matrices, seams, within } = self.lost;
        put_f64(to, format!("{prefix}.lost"), vec![3], vec![matrices, seams, within]);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let basis = Matrices::load(from, &format!("{prefix}.clusters"))?;
        let name = format!("{prefix}.weights");
        let (shape, rows) = get_f32(from, &name, 2)?;
        let components = shape[1].checked_sub(1).filter(|c| *c <= MOST);
        let components = components.ok_or_else(|| PartError::Unexpected(name.clone()))?;
        let clusters = basis.len() / (components + 1);
        let known = |row: &[f32]| row[0] >= 0.0 && row[0].fract() == 0.0 && (row[0] as usize) < clusters;
        if basis.len() != clusters * (components + 1) || !rows.chunks_exact(components + 1).all(known) {
            return Err(PartError::Unexpected(name));
        }
        let name = format!("{prefix}.lost");
        let [matrices, seams, within] = get_f64(from, &name, 1)?.1[..] else {
            return Err(PartError::Unexpected(name));
        };
        let sites = rows.into_iter().map(f16::from_f32).collect();
        Ok(Self { basis, components, sites, lost: Lost { matrices, seams, within } })
    }

    fn bytes(&self) -> usize {
        self.basis.bytes() + 2 * self.sites.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_clusters_are_read_as_they_were_written() {
        for k in 0..=MAX_CLUSTERS {
            assert_eq!(whole(f16::from_f32(k as f32)), k);
        }
    }
}

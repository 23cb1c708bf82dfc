//! Parameters; the matrices of sites as components of clusters.

use super::MatrixRadianceTransfer;
use super::reflected::Reflected;
use crate::shared::geometry::by_group::MOST_GROUPS;
use crate::shared::geometry::matrices::{Accuracy, Below, affordable, seen, visibility};
use crate::shared::geometry::site_sum::MOST;
use crate::tensors::{PartError, TensorFile, get_f32, get_f64, put_f32, put_f64};
use crate::{BakeError, Geometry, Part, Technique};
use glam::{DMat3, Vec3};
use half::f16;
use steradian_base::{ParamInfo, Task, params};
use steradian_formats::{Tensor, TensorData};
use steradian_numerics::clusters::{self, Clusters};
use steradian_numerics::eigen;
use steradian_parallel::prelude::*;
use steradian_sphere::sh::Rotation;
use steradian_transfer::{Products, Site};

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Bands of light and reflectance.
        pub bands: usize = ParamInfo::whole("bands", [1.0, 6.0], 5.0, "bands of spherical harmonics, of light and reflectance alike"),
        /// Hats along an edge.
        pub hats: usize = ParamInfo::whole("hats", [4.0, 16.0], 8.0, "edge of the grid of hats over outgoing directions"),
        /// Clusters of sites.
        pub clusters: usize = ParamInfo::whole("clusters", [1.0, 2048.0], 64.0, "clusters of sites, each with components of its own; 1: principal components of all sites"),
        /// Components of a cluster.
        pub components: usize = ParamInfo::whole("components", [0.0, 16.0], 8.0, "matrices of a cluster beside their mean, each with a weight per site"),
        /// Absolute error of the coefficients of transfer.
        pub precision: f64 = ParamInfo::real("precision", [1e-4, 0.1], 5e-3, "absolute error of the coefficients of transfer, before compression"),
        /// Where the window ends; 0 for none.
        pub window: f64 = ParamInfo::real("window", [0.0, 32.0], 0.0, "band at which a window of Hann ends that takes ringing off the light; 0: none"),
    }
}

/// Most iterations of the clustering.
const ROUNDS: usize = 6;
/// Most numbers of a site's matrix in the coordinates in which sites are analysed.
const MOST_NUMBERS: usize = 36 * 36;

/// The frame of a site: axes x and y perpendicular to its normal, the conventional ones of a surface without
/// tangents.
#[inline(always)]
pub fn axes(n: [f32; 3]) -> [[f32; 3]; 2] {
    let n = Vec3::from_array(n);
    let a = if n.y.abs() < 0.99 { Vec3::Y } else { Vec3::X };
    let t = a.cross(n).normalize_or_zero();
    [t.to_array(), n.cross(t).to_array()]
}

/// Matrices of clusters, each site's cluster and weights, and the change of basis to hats.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Compressed {
    /// Coefficients.
    pub n: usize,
    /// Components in addition to the mean.
    pub components: usize,
    /// For each cluster the mean and the components: n × n numbers in the coordinates of the analysis.
    pub basis: Vec<f32>,
    /// By channel, for hat after hat: the factors of these coordinates in the radiance that the hat reflects.
    pub rows: Vec<f32>,
    /// For each site its cluster and its weights.
    pub sites: Vec<f16>,
    /// For each site its unit normal.
    pub normals: Vec<f32>,
    /// √(Σ‖Ã − A‖²/Σ‖A‖²) over the sites.
    pub lost: f64,
}

impl Compressed {
    pub(super) fn bake(g: &Geometry, m: &Reflected, p: &Params, task: &Task) -> Result<Self, BakeError> {
        let slug = MatrixRadianceTransfer::CARD.slug;
        let n = p.bands * p.bands;
        let (sites, transfer) =
            visibility(slug, g, Accuracy { bands: p.bands, precision: p.precision }, task)?;
        affordable(slug, (8 * n * n * sites.len()) as u64, task)?;
        let products = Products::new(p.bands);
        let [root, inverse] = metric(m, n);
        let points: Vec<f32> = sites
            .par_iter()
            .enumerate()
            .flat_map_iter(|(s, site)| {
                let full = products.matrix(&seen(site, transfer.visibility(s), Below::Open));
                coordinates(&turned(site, &full, p.bands), &root, n)
            })
            .collect();
        task.begin("clusters", 1);
        let of = clusters::Settings { clusters: p.clusters, components: p.components, rounds: ROUNDS };
        let found = Clusters::new(&points, n * n, of, || task.check().is_ok());
        task.end();
        task.check()?;
        let all: f64 = points.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>() / sites.len().max(1) as f64;
        let left = found.errors.last().copied().unwrap_or(0.0);
        let row = |(s, k): (usize, &u32)| {
            let weights = &found.weights[s * found.components..][..found.components];
            let all = std::iter::once(*k as f32).chain(weights.iter().copied());
            all.map(f16::from_f32).collect::<Vec<_>>()
        };
        Ok(Self {
            n,
            components: found.components,
            basis: found.bases.iter().map(|x| *x as f32).collect(),
            rows: m.rows.iter().flat_map(|r| times(r, &inverse, n)).collect(),
            sites: found.cluster.iter().enumerate().flat_map(row).collect(),
            normals: sites.iter().flat_map(|s| s.n.normalize_or_zero().to_array()).collect(),
            lost: if all > 0.0 { (left / all).sqrt() } else { 0.0 },
        })
    }
}

/// R M of a site: the matrix, with the transferred light in the frame of the site. Row after row.
fn turned(site: &Site, matrix: &[f64], bands: usize) -> Vec<f64> {
    let n = bands * bands;
    let normal = site.n.normalize_or_zero();
    let [t, b] = axes(normal.to_array()).map(|a| Vec3::from_array(a).as_dvec3());
    if site.is_absent() {
        return vec![0.0; n * n];
    }
    let to_local = DMat3::from_cols(t, b, normal.as_dvec3()).transpose();
    let turn = Rotation::new(bands - 1, to_local);
    let (mut out, mut column) = (vec![0.0; n * n], vec![0.0; n]);
    for j in 0..n {
        // The matrix is symmetric: its rows are its columns.
        turn.apply(&matrix[j * n..][..n], &mut column);
        column.iter().enumerate().for_each(|(i, x)| out[i * n + j] = *x);
    }
    out
}

/// W^½ and its pseudo-inverse, W = Σ rowsᵀ rows over hats and channels. The sum of squares of W^½ R M is that
/// of the matrices A = rows R M of all channels, which the light is multiplied with, so that a fit in these
/// coordinates minimises the error of A.
fn metric(m: &Reflected, n: usize) -> [Vec<f64>; 2] {
    let mut w = vec![vec![0.0; n]; n];
    for row in m.rows.iter().flat_map(|r| r.chunks_exact(n)) {
        for (to, a) in w.iter_mut().zip(row) {
            to.iter_mut().zip(row).for_each(|(to, b)| *to += a * b);
        }
    }
    let values = eigen::symmetric(w);
    let least = 1e-12 * values.first().map_or(0.0, |v| v.0);
    let power = |by: f64| {
        let mut out = vec![0.0; n * n];
        for (value, v) in values.iter().filter(|v| v.0 > least) {
            for (i, a) in v.iter().enumerate() {
                v.iter().enumerate().for_each(|(j, b)| out[i * n + j] += value.powf(by) * a * b);
            }
        }
        out
    };
    [power(0.5), power(-0.5)]
}

/// a b of n columns each, b square.
fn times(a: &[f64], b: &[f64], n: usize) -> Vec<f32> {
    let row = |a: &[f64]| -> Vec<f32> {
        let mut out = vec![0.0; n];
        for (a, b) in a.iter().zip(b.chunks_exact(n)) {
            out.iter_mut().zip(b).for_each(|(o, b)| *o += a * b);
        }
        out.into_iter().map(|x| x as f32).collect()
    };
    a.chunks_exact(n).flat_map(row).collect()
}

fn coordinates(matrix: &[f64], root: &[f64], n: usize) -> Vec<f32> {
    times(root, matrix, n)
}

impl Part for Compressed {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let (n, row) = (self.n, self.components + 1);
        let square = (n * n).max(1);
        let basis = vec![self.basis.len() / square, n, n];
        put_f32(to, format!("{prefix}.basis"), basis, self.basis.clone());
        put_f32(to, format!("{prefix}.rows"), vec![self.rows.len() / n.max(1), n], self.rows.clone());
        let shape = vec![self.sites.len() / row, row];
        to.tensors
            .insert(format!("{prefix}.weights"), Tensor { shape, data: TensorData::F16(self.sites.clone()) });
        put_f32(to, format!("{prefix}.normals"), vec![self.normals.len() / 3, 3], self.normals.clone());
        put_f64(to, format!("{prefix}.lost"), vec![1], vec![self.lost]);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = |k: &str| format!("{prefix}.{k}");
        let bad = |k: &str| PartError::Unexpected(name(k));
        let (shape, basis) = get_f32(from, &name("basis"), 3)?;
        let n = shape[1];
        if shape[2] != n || n == 0 || n * n > MOST_NUMBERS || n.isqrt().pow(2) != n {
            return Err(bad("basis"));
        }
        let (rows_shape, rows) = get_f32(from, &name("rows"), 2)?;
        let side = (rows_shape[0] / 3).isqrt();
        if rows_shape != [3 * side * side, n] || side < 2 {
            return Err(bad("rows"));
        }
        let (weights_shape, weights) = get_f32(from, &name("weights"), 2)?;
        let components = weights_shape[1].checked_sub(1).filter(|c| *c <= MOST);
        let components = components.ok_or_else(|| bad("weights"))?;
        let clusters = shape[0] / (components + 1);
        let known = |row: &[f32]| row[0] >= 0.0 && row[0].fract() == 0.0 && (row[0] as usize) < clusters;
        if clusters > MOST_GROUPS
            || shape[0] != clusters * (components + 1)
            || !weights.chunks_exact(components + 1).all(known)
        {
            return Err(bad("weights"));
        }
        let (normals_shape, normals) = get_f32(from, &name("normals"), 2)?;
        if normals_shape != [weights_shape[0], 3] {
            return Err(bad("normals"));
        }
        let [lost] = get_f64(from, &name("lost"), 1)?.1[..] else { return Err(bad("lost")) };
        let sites = weights.into_iter().map(f16::from_f32).collect();
        Ok(Self { n, components, basis, rows, sites, normals, lost })
    }

    fn bytes(&self) -> usize {
        4 * (self.basis.len() + self.rows.len() + self.normals.len()) + 2 * self.sites.len()
    }
}

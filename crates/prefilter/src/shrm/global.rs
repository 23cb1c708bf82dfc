//! Global maps: coefficients over world directions of the viewer, for a viewer far away.
//!
//! Ramamoorthi & Hanrahan 2002, 5.11–5.14: Σ_s B_ps(C) y_ps(R_C⁻¹ wo) = Σ_q B̂_pq(C) y_pq(wo). Unlike B_pq,
//! which turns with the frame, B̂_pq is one function of the sphere, of the band of the light plus p: it fits
//! any layout.

use super::combine::combine;
use super::{CoefficientMaps, Grid, Key, Plan, Term, pairs};
use crate::EdgeCube;
use glam::{DMat3, DVec3};
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;
use steradian_simd::{Arch, Kernel};
use steradian_sphere::sh::{self, ColumnsRgb, PointSynthesis, Rotation, ShTransform};
use steradian_sphere::{Layout, SphereImage};

/// B̂_pq on a grid of central directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Global {
    /// Where the texels stand.
    pub grid: Grid,
    /// P.
    pub p: usize,
    /// Planes of linear RGB in the order p² + p + q, y_pq over world x, y, z.
    pub planes: Vec<[Vec<f32>; 3]>,
}

/// The keys of complete local maps up to P: those of the terms of [`pairs`].
fn keys(p: usize) -> Vec<Key> {
    let both = |(term, (_, q)): (usize, (usize, usize))| {
        let q = q as i32;
        [q, -q].into_iter().take(if q == 0 { 1 } else { 2 }).map(move |q| Key { term, q })
    };
    pairs(p).into_iter().enumerate().flat_map(both).collect()
}

/// Position of y_pq among world harmonics, p² + p + q, for every key.
pub(super) fn places(p: usize) -> Vec<usize> {
    let pairs = pairs(p);
    keys(p).iter().map(|k| sh::index(pairs[k.term].0, k.q as isize)).collect()
}

/// Are these maps complete up to P?
pub(super) fn is_complete(maps: &CoefficientMaps, p: usize) -> bool {
    maps.keys == keys(p) && maps.planes.len() == maps.keys.len()
}

/// Complete local maps from planes in the order p² + p + q.
pub(super) fn local_maps(grid: Grid, p: usize, mut planes: Vec<[Vec<f32>; 3]>) -> CoefficientMaps {
    let planes = places(p).into_iter().map(|at| std::mem::take(&mut planes[at])).collect();
    CoefficientMaps { grid, keys: keys(p), planes }
}

/// Global from local maps (5.14). `None` unless the maps are those of the terms of [`pairs`] of `p`.
pub fn from_local(maps: &CoefficientMaps, p: usize) -> Option<Global> {
    if !is_complete(maps, p) {
        return None;
    }
    let places = places(p);
    let mut planes: Vec<&[Vec<f32>; 3]> = vec![&maps.planes[0]; places.len()];
    places.iter().zip(&maps.planes).for_each(|(at, plane)| planes[*at] = plane);
    Some(Global { grid: maps.grid, p, planes: FrameRotation::new(p).apply(maps.grid, &planes, false) })
}

/// Local from global maps.
pub fn to_local(global: &Global) -> CoefficientMaps {
    let planes: Vec<&[Vec<f32>; 3]> = global.planes.iter().collect();
    local_maps(global.grid, global.p, FrameRotation::new(global.p).apply(global.grid, &planes, true))
}

/// A grid on whose samples functions of a band are exactly determined.
pub fn exact_grid(band: usize) -> Grid {
    Grid::new(2 * band + 1, (2 * band + 1).next_multiple_of(4))
}

/// B̂_pq as coefficients, in the order p² + p + q, of terms ρ̂_lpq in the order of [`pairs`] of `p`: the
/// input of [`cube`], [`image()`] and [`PointSynthesis`].
///
/// Each is of band `order` + p, `order` the highest band of light that counts. Empty where the terms are not
/// those of `pairs(p)`.
pub fn coefficients(
    light: &ColumnsRgb,
    order: usize,
    terms: &[Term<'_>],
    p: usize,
    task: &Task,
) -> Result<Vec<ColumnsRgb>, Cancelled> {
    let band = order + p;
    let grid = exact_grid(band);
    let maps = Plan::new(order, p, grid).maps(light, terms, task)?;
    let Some(global) = from_local(&maps, p) else { return Ok(Vec::new()) };
    Ok(global.coefficients(band))
}

impl Global {
    /// Coefficients of each plane's function up to `band`: exact if the function has no higher band and the
    /// grid is at least [`exact_grid`]'s.
    pub fn coefficients(&self, band: usize) -> Vec<ColumnsRgb> {
        let (width, height) = (self.grid.columns(), self.grid.rows());
        let plan = ShTransform::new(band, width, height, sh::Grid::ClenshawCurtis);
        let analyze = |planes: &[Vec<f32>; 3]| {
            let mut columns = ColumnsRgb::default();
            plan.analyze_columns(planes.each_ref().map(Vec::as_slice), &mut columns);
            columns
        };
        self.planes.iter().map(analyze).collect()
    }

    /// The one reflection map of a far viewer in unit direction `wo` (5.35), on the grid.
    pub fn frame(&self, wo: DVec3) -> [Vec<f32>; 3] {
        let row = vec![harmonics(self.p, wo)];
        combine(&row, &self.planes).pop().unwrap_or_default()
    }
}

/// y_pq(d) for all p ≤ P.
pub(super) fn harmonics(p: usize, d: DVec3) -> Vec<f64> {
    let mut y = vec![0.0; sh::count(p)];
    sh::eval(p, d, &mut y);
    y
}

/// A function from its coefficients as a cube of shared edges, to about 1e-6 of its range.
pub fn cube(columns: &ColumnsRgb, size: usize) -> EdgeCube {
    let size = size.max(1);
    let n = size + 1;
    let at = |k: usize| crate::cube::edge_cube::direction(size, k / (n * n), k % n, k / n % n);
    let directions: Vec<DVec3> = (0..6 * n * n).map(at).collect();
    let mut planes: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; directions.len()]);
    PointSynthesis::new(columns, &[], SYNTHESIS_ERROR)
        .at(&directions, planes.each_mut().map(Vec::as_mut_slice));
    let [r, g, b] = &planes;
    let texels = (0..directions.len()).map(|k| [r[k], g[k], b[k], 1.0]).collect();
    EdgeCube::from_texels(size, texels).unwrap_or_default()
}

/// A function from its coefficients at every texel centre of a layout, to about 1e-6 of its range.
pub fn image(columns: &ColumnsRgb, (layout, width, height): (Layout, usize, usize)) -> SphereImage {
    crate::image::synthesize(
        columns,
        &vec![1.0; columns.order() + 1],
        (layout, width, height),
        0.5 * SYNTHESIS_ERROR,
    )
}

/// Error of synthesis, relative to the range of the function: 17 times the rounding of single precision, in
/// which texels are kept, and far below any tolerance of the maps.
const SYNTHESIS_ERROR: f64 = 1e-6;

/// Turns coefficients of each texel between its frame and the world.
struct FrameRotation {
    p: usize,
    /// For each band, row-major: the exchange of y and z.
    exchange: Vec<Vec<f64>>,
}

impl FrameRotation {
    fn new(p: usize) -> Self {
        let mirror = DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y);
        let rotation = Rotation::new(p, mirror);
        let n = sh::count(p);
        let mut exchange: Vec<Vec<f64>> = (0..=p).map(|l| vec![0.0; (2 * l + 1).pow(2)]).collect();
        for (l, matrix) in exchange.iter_mut().enumerate() {
            let side = 2 * l + 1;
            for m in 0..side {
                let (mut unit, mut out) = (vec![0.0; n], vec![0.0; n]);
                unit[l * l + m] = 1.0;
                rotation.apply(&unit, &mut out);
                matrix[m * side..(m + 1) * side].copy_from_slice(&out[l * l..l * l + side]);
            }
        }
        Self { p, exchange }
    }

    /// All texels, to the world or back.
    fn apply(&self, grid: Grid, planes: &[&[Vec<f32>; 3]], back: bool) -> Vec<[Vec<f32>; 3]> {
        let n = grid.columns();
        let turns: Vec<[Vec<f64>; 2]> = (0..=self.p)
            .map(|m| {
                let of = |f: fn(f64) -> f64| (0..n).map(|j| f(m as f64 * grid.beta(j))).collect();
                [of(f64::cos), of(f64::sin)]
            })
            .collect();
        // Rows of all planes, one after the other, for each row of the grid and channel.
        let rows: Vec<Vec<f32>> = (0..3 * grid.rows())
            .into_par_iter()
            .map_init(Default::default, |buffers, k| {
                let (i, c) = (k / 3, k % 3);
                let matrices: Vec<Vec<f64>> = (0..=self.p).map(|l| row_matrix(l, grid.alpha(i))).collect();
                let ins: Vec<&[f32]> = planes.iter().map(|p| &p[c][i * n..(i + 1) * n]).collect();
                let mut out = vec![0.0; planes.len() * n];
                let row = RotatedRow { rotation: self, matrices: &matrices, turns: &turns, ins: &ins, back };
                steradian_simd::run(WithBuffers { row, buffers, out: &mut out });
                out
            })
            .collect();
        (0..planes.len())
            .map(|k| {
                std::array::from_fn(|c| {
                    let mut plane = Vec::with_capacity(grid.texels());
                    let of_channel = rows.iter().skip(c).step_by(3);
                    of_channel.for_each(|row| plane.extend_from_slice(&row[k * n..(k + 1) * n]));
                    plane
                })
            })
            .collect()
    }
}

/// One row and channel of all planes.
struct RotatedRow<'a> {
    rotation: &'a FrameRotation,
    matrices: &'a [Vec<f64>],
    /// cos mβ and sin mβ by m.
    turns: &'a [[Vec<f64>; 2]],
    ins: &'a [&'a [f32]],
    back: bool,
}

struct WithBuffers<'a, 'b> {
    row: RotatedRow<'a>,
    buffers: &'b mut [Vec<f64>; 2],
    out: &'b mut [f32],
}

impl Kernel for WithBuffers<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Self { row, buffers: [now, next], out } = self;
        let n = row.turns[0][0].len();
        now.resize((2 * row.rotation.p + 1) * n, 0.0);
        next.resize(now.len(), 0.0);
        for l in 0..=row.rotation.p {
            let side = 2 * l + 1;
            for k in 0..side {
                let (to, from) = (&mut now[k * n..(k + 1) * n], &row.ins[l * l + k][..n]);
                for j in 0..n {
                    to[j] = f64::from(from[j]);
                }
            }
            // All three steps are orthogonal; the middle one is its own inverse.
            let [first, last] = if row.back {
                [(&row.rotation.exchange[l], false), (&row.matrices[l], true)]
            } else {
                [(&row.matrices[l], false), (&row.rotation.exchange[l], true)]
            };
            multiply(first, side, n, now, next);
            for m in 1..=l {
                let [cos, sin] = &row.turns[m];
                let (cos, sin) = (&cos[..n], &sin[..n]);
                let (low, high) = next.split_at_mut((l + m) * n);
                let (b, a) = (&mut low[(l - m) * n..(l - m + 1) * n], &mut high[..n]);
                // (a, b) ← (a cos mβ + b sin mβ, a sin mβ − b cos mβ).
                for j in 0..n {
                    let (x, y) = (a[j], b[j]);
                    a[j] = x * cos[j] + y * sin[j];
                    b[j] = x * sin[j] - y * cos[j];
                }
            }
            multiply(last, side, n, next, now);
            let (to, from) = (&mut out[l * l * n..(l + 1) * (l + 1) * n], &now[..side * n]);
            for j in 0..from.len() {
                to[j] = from[j] as f32;
            }
        }
    }
}

/// out ← M in, or Mᵀ in, column by column.
#[inline(always)]
fn multiply((matrix, transposed): (&Vec<f64>, bool), side: usize, n: usize, x: &[f64], out: &mut [f64]) {
    for i in 0..side {
        let to = &mut out[i * n..(i + 1) * n];
        to.fill(0.0);
        for k in 0..side {
            let factor = if transposed { matrix[k * side + i] } else { matrix[i * side + k] };
            if factor == 0.0 {
                continue;
            }
            let from = &x[k * n..(k + 1) * n];
            for j in 0..n {
                to[j] += factor * from[j];
            }
        }
    }
}

/// u± of band l at α: rows +m from +q by u⁺, −m from −q by u⁻ (see the recursion's module).
fn row_matrix(l: usize, alpha: f64) -> Vec<f64> {
    let side = 2 * l + 1;
    let d = sh::wigner_d(l, alpha);
    let odd = |n: usize| if n.is_multiple_of(2) { 1.0 } else { -1.0 };
    let mut out = vec![0.0; side * side];
    for m in 0..=l {
        for q in 0..=l {
            let plus = odd(m + q) * d[(l + m) * side + l + q];
            let minus = odd(m) * d[(l + m) * side + l - q];
            let norm = if m == 0 { std::f64::consts::FRAC_1_SQRT_2 } else { 1.0 };
            out[(l + m) * side + l + q] =
                if q == 0 { norm * std::f64::consts::SQRT_2 * plus } else { norm * (plus + minus) };
            if m > 0 && q > 0 {
                out[(l - m) * side + l - q] = plus - minus;
            }
        }
    }
    out
}

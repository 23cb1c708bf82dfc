//! The reflectance at all pairs of nodes, and its decomposition.

use super::coordinates::{Coordinates, Node};
use crate::BakeError;
use steradian_base::Task;
use steradian_brdf::Brdf;
use steradian_numerics::low_rank::{Factors, Weighted};
use steradian_numerics::matrix::Matrix;
use steradian_numerics::svd::{self, Svd};
use steradian_parallel::prelude::*;

/// M and the weights of its errors: a row a node of x, a column a node of y. M is f times
/// [`Coordinates::over`].
pub struct Samples {
    pub coordinates: Coordinates,
    /// One matrix where all channels are multiples of one, else three.
    pub colours: Vec<Matrix>,
    /// Colour that the single matrix is multiplied with, where there is one.
    pub tint: [f64; 3],
    /// (n·l)² dω_l dω_v, of sum 1, and next to nothing where a direction lies below the horizon.
    weights: Matrix,
    /// Sums of the weights of rows and of columns.
    marginals: [Vec<f64>; 2],
}

/// Reflectance is clamped to this, sr⁻¹: its square is finite in single precision.
const MAX_REFLECTANCE: f64 = 1e18;
/// Weight of a missing pair, relative to its node's mean weight: enough to define a node without any other
/// pair.
const FILL: f64 = 1e-7;
/// Relative difference up to which channels count as proportional.
const GREY: f64 = 1e-6;
/// Most alternating steps of one decomposition.
const MAX_STEPS: usize = 12;
/// Relative decrease of the squared error at which they end: the error falls by less than 0.5 %.
const ACCURACY: f64 = 1e-2;

impl Samples {
    pub fn new(brdf: &dyn Brdf, coordinates: Coordinates, task: &Task) -> Result<Self, BakeError> {
        let (rows, columns) = (coordinates.x.len(), coordinates.y.len());
        let (x, y) = (Node::all(&coordinates.x), Node::all(&coordinates.y));
        let row = |i: usize| {
            task.check()?;
            let entry = |j: usize| {
                let p = coordinates.pair(&x[i], &y[j]);
                let f = brdf
                    .eval(p.wi, p.wo)
                    .map(|f| if f.is_finite() { f.clamp(-MAX_REFLECTANCE, MAX_REFLECTANCE) } else { 0.0 });
                let over = coordinates.over(&y[j]);
                (f.map(|f| (over * f) as f32), p.weight / (over * over))
            };
            Ok::<_, BakeError>((0..columns).map(entry).collect::<Vec<_>>())
        };
        let entries: Vec<_> = (0..rows).into_par_iter().map(row).collect::<Result<_, _>>()?;
        let total: f64 = entries.iter().flatten().map(|e| e.1).sum();
        let mut marginals = [vec![0.0; rows], vec![0.0; columns]];
        for (i, row) in entries.iter().enumerate() {
            for (j, e) in row.iter().enumerate() {
                let w = e.1 / total;
                marginals[0][i] += w;
                marginals[1][j] += w;
            }
        }
        // A node all of whose pairs are missing weighs as little as a missing pair does.
        let least = [FILL / rows as f64, FILL / columns as f64];
        for (m, least) in marginals.iter_mut().zip(least) {
            m.iter_mut().for_each(|m| *m = m.max(least));
        }
        let mut weights = Vec::with_capacity(rows * columns);
        for (i, row) in entries.iter().enumerate() {
            let fill =
                |j: usize| FILL * (marginals[0][i] / columns as f64).max(marginals[1][j] / rows as f64);
            weights.extend(row.iter().enumerate().map(|(j, e)| (e.1 / total).max(fill(j)) as f32));
        }
        let tint = tint(&entries);
        let colour = |c: usize| {
            let data = entries.iter().flatten().map(|e| e.0[c]).collect();
            Matrix::new(rows, columns, data).unwrap_or_default()
        };
        let brightest = tint.map_or(0, |t| (0..3).max_by(|a, b| t[*a].total_cmp(&t[*b])).unwrap_or(0));
        let colours = if tint.is_some() { vec![colour(brightest)] } else { (0..3).map(colour).collect() };
        let weights = Matrix::new(rows, columns, weights).unwrap_or_default();
        Ok(Self { coordinates, colours, tint: tint.unwrap_or([1.0; 3]), weights, marginals })
    }

    /// Singular values and vectors of √w M, w the product of the weights of rows and columns; all colours
    /// side by side.
    pub fn svd(&self, count: usize) -> Svd {
        let [rows, columns] = &self.marginals;
        let root = |v: &[f64]| v.iter().map(|x| x.sqrt()).collect::<Vec<_>>();
        let (rows, columns) = (root(rows), root(columns));
        let mut data = Vec::with_capacity(self.colours.len() * rows.len() * columns.len());
        for (i, r) in rows.iter().enumerate() {
            for m in &self.colours {
                data.extend(m.row(i).iter().zip(&columns).map(|(m, c)| (f64::from(*m) * r * c) as f32));
            }
        }
        let all = Matrix::new(rows.len(), self.colours.len() * columns.len(), data).unwrap_or_default();
        svd::leading(&all, count, 1e-5)
    }

    /// Are no pairs missing, so that the weight of a pair is the product of those of its nodes?
    fn complete(&self) -> bool {
        self.coordinates.form == super::coordinates::Form::ViewLight
    }

    /// The first `count` terms of the decomposition, as factors of M itself.
    fn terms(&self, s: &Svd, count: usize) -> Factors {
        let count = count.min(s.values.len());
        let [rows, columns] = &self.marginals;
        let n = columns.len();
        let left = (0..count).map(|k| s.left[k].iter().zip(rows).map(|(u, r)| u / r.sqrt()).collect());
        let right = |c: usize, k: usize| {
            let v = &s.right[k][c * n..(c + 1) * n];
            v.iter().zip(columns).map(|(v, w)| s.values[k] * v / w.sqrt()).collect()
        };
        let right = (0..self.colours.len()).map(|c| (0..count).map(|k| right(c, k)).collect()).collect();
        let residual = if s.square > 0.0 { s.rest(count) / s.square } else { 0.0 };
        Factors { left: left.collect(), right, residual }
    }

    /// The fewest terms, `least` to `most`, whose error relative to M is at most `tolerance`, else `most`;
    /// and σ₁/σ₀ where they are singular vectors.
    pub fn decompose(
        &self,
        [least, most]: [usize; 2],
        tolerance: f64,
        task: &Task,
    ) -> Result<(Factors, Option<f64>), BakeError> {
        if self.complete() {
            let s = self.svd(most.max(2));
            let enough = |n: &usize| (s.rest(*n) / s.square.max(1e-300)).sqrt() <= tolerance;
            let count = (least..most).find(enough).unwrap_or(most);
            let ratio = if s.values.len() > 1 { s.values[1] / s.values[0] } else { 0.0 };
            return Ok((self.terms(&s, count), Some(ratio)));
        }
        let Some(weighted) = Weighted::new(self.weights.clone(), &self.colours) else {
            return Ok((self.terms(&self.svd(most), least), None));
        };
        let mut f = weighted.nothing();
        while f.left.len() < least || (f.left.len() < most && f.residual.sqrt() > tolerance) {
            task.check()?;
            let count = f.left.len();
            f = weighted.extend(f, MAX_STEPS, ACCURACY);
            if f.left.len() == count {
                break;
            }
        }
        Ok((f, None))
    }

    /// Normalised decomposition: g the mean of M over y, and h that of M/g over x, both over the pairs that
    /// are not missing.
    pub fn normalised(&self) -> Factors {
        let (rows, columns) = (self.weights.rows(), self.weights.columns());
        let share = 1.0 / self.colours.len() as f64;
        let mut g = vec![0.0; rows];
        for (i, g) in g.iter_mut().enumerate() {
            let (mut sum, mut weight) = (0.0, 0.0);
            for (j, w) in self.weights.row(i).iter().enumerate() {
                let mean: f64 = self.colours.iter().map(|m| f64::from(m.row(i)[j].abs())).sum();
                sum += f64::from(*w) * share * mean;
                weight += f64::from(*w);
            }
            *g = sum / weight;
        }
        let mut right = vec![vec![0.0; columns]; self.colours.len()];
        let mut weight = vec![0.0; columns];
        for (i, g) in g.iter().enumerate().filter(|g| *g.1 > 0.0) {
            for (j, w) in self.weights.row(i).iter().map(|w| f64::from(*w)).enumerate() {
                weight[j] += w;
                for (h, m) in right.iter_mut().zip(&self.colours) {
                    h[j] += w * f64::from(m.row(i)[j]) / g;
                }
            }
        }
        right.iter_mut().for_each(|h| h.iter_mut().zip(&weight).for_each(|(h, w)| *h /= w.max(1e-300)));
        let (mut squares, mut all) = (0.0, 0.0);
        for (i, g) in g.iter().enumerate() {
            for (m, h) in self.colours.iter().zip(&right) {
                for ((w, m), h) in self.weights.row(i).iter().zip(m.row(i)).zip(h) {
                    let (w, m) = (f64::from(*w), f64::from(*m));
                    squares += w * (m - g * h).powi(2);
                    all += w * m * m;
                }
            }
        }
        let residual = if all > 0.0 { squares / all } else { 0.0 };
        Factors { left: vec![g], right: right.into_iter().map(|h| vec![h]).collect(), residual }
    }
}

/// The colour of which all entries are multiples, its largest channel 1; `None` where they are not.
fn tint(entries: &[Vec<([f32; 3], f64)>]) -> Option<[f64; 3]> {
    let mut sum = [0.0; 3];
    let values = || entries.iter().flatten().filter(|e| e.1 > 0.0).map(|e| e.0.map(f64::from));
    values().for_each(|f| (0..3).for_each(|c| sum[c] += f[c].abs()));
    let largest = sum.iter().fold(0.0_f64, |a, b| a.max(*b));
    if largest <= 0.0 {
        return Some([1.0; 3]);
    }
    let tint = sum.map(|s| s / largest);
    let brightest = (0..3).find(|c| tint[*c] >= 1.0)?;
    let same =
        |f: [f64; 3]| (0..3).all(|c| (f[c] - tint[c] * f[brightest]).abs() <= GREY * f[brightest].abs());
    entries.iter().flatten().map(|e| e.0.map(f64::from)).all(same).then_some(tint)
}

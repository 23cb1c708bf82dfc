//! Positive functions as products of factors: sums in the logarithm, three channels at once.
//!
//! McCool, Ang & Ahmad (2001), *Homomorphic Factorization of BRDFs for High-Performance Rendering*: of
//! samples v of a positive function, ln v ≈ A x with the logarithms x of the factors and one row of
//! interpolation weights for each sample. Rows weigh v^power, so that with 1 the absolute error is minimised
//! and with 0 the relative one; further rows, whose right-hand side is 0, keep the factors smooth.
//! Gauss–Newton steps then minimise Σ (v^(power − 1)(e^(A x) − v))² itself.

use crate::dense::Cholesky;
use crate::lsqr::{Rgb, Sparse, solve};
use steradian_parallel::prelude::*;

/// Samples and their rows.
pub struct Problem {
    /// Rows of the samples, then those of smoothness.
    pub a: Sparse,
    /// The samples.
    pub values: Vec<Rgb>,
    /// Weights of the samples beside those by their value; 1 where there are none.
    pub share: Vec<f64>,
    /// Values below this count as this.
    pub floor: f64,
    /// Values below this weigh as this.
    pub dim: f64,
    /// Power of the values by which errors of the logarithm count.
    pub power: f64,
    /// Weights of the rows of smoothness.
    pub smooth: Vec<Rgb>,
    /// Where the solver stops ([`solve`]).
    pub accuracy: f64,
    /// Steps of the solver at most.
    pub steps: usize,
    /// Normal equations in place of steps: for up to some hundred unknowns.
    pub dense: bool,
}

/// Blocks of rows whose normal equations are summed apart: fixed, so that sums do not depend on the number of
/// threads. Each block has a matrix of 24 n² bytes for n unknowns.
const BLOCKS: usize = 16;
/// Samples whose squares are summed in one block: fixed, so that sums do not depend on the number of threads.
const SAMPLES_PER_BLOCK: usize = 1 << 12;
/// Part of the diagonal that is added to normal equations, which are singular: a factor moved from one map to
/// another changes nothing. It lies above the rounding of a factorisation (n ε, 3e-14 for 300 unknowns) and
/// far below the accuracy of the fits.
const RIDGE: f64 = 1e-11;

/// Bytes that the normal equations of `n` unknowns take ([`Problem::dense`]).
pub fn normal_bytes(n: usize) -> usize {
    BLOCKS * n * n * size_of::<Rgb>()
}

/// A solution.
pub struct Solution {
    /// Logarithms of the factors.
    pub x: Vec<Rgb>,
    /// A x.
    pub model: Vec<Rgb>,
    /// Σ (weight (e^model − v))² over the samples.
    pub cost: Rgb,
    /// Steps of the solver so far.
    pub steps: usize,
}

impl Problem {
    /// Value `k`, at least the floor.
    pub fn floored(&self, k: usize) -> Rgb {
        self.values[k].map(|v| v.max(self.floor))
    }

    fn share(&self, k: usize) -> f64 {
        self.share.get(k).copied().unwrap_or(1.0)
    }

    /// Right-hand sides of the first solution: logarithms of the samples.
    pub fn logs(&self) -> Vec<Rgb> {
        let mut logs: Vec<Rgb> =
            (0..self.values.len()).into_par_iter().map(|k| self.floored(k).map(f64::ln)).collect();
        logs.extend(self.smooth.iter().map(|_| [0.0; 3]));
        logs
    }

    /// Weights of all rows where the values are `of`.
    pub fn weights(&self, of: impl Fn(usize) -> Rgb + Sync) -> Vec<Rgb> {
        let weight = |k: usize| of(k).map(|v| self.share(k) * raised(v.max(self.dim), self.power));
        let mut weights: Vec<Rgb> = (0..self.values.len()).into_par_iter().map(weight).collect();
        weights.extend(&self.smooth);
        weights
    }

    /// Σ of the squares of a function of the samples, in blocks of fixed size, in their order.
    fn squares(&self, of: impl Fn(usize) -> Rgb + Sync) -> Rgb {
        let n = self.values.len();
        let add = |mut sum: Rgb, x: Rgb| {
            (0..3).for_each(|c| sum[c] += x[c]);
            sum
        };
        let block = |b: usize| {
            let range = b * SAMPLES_PER_BLOCK..((b + 1) * SAMPLES_PER_BLOCK).min(n);
            range.fold([0.0; 3], |sum, k| add(sum, of(k).map(|x| x * x)))
        };
        let blocks: Vec<Rgb> = (0..n.div_ceil(SAMPLES_PER_BLOCK)).into_par_iter().map(block).collect();
        blocks.into_iter().fold([0.0; 3], add)
    }

    /// Least squares in the logarithm.
    pub fn solve(&self) -> Solution {
        let weights = self.weights(|k| self.floored(k));
        let (x, steps) = self.least(&weights, &self.logs());
        self.solution(x, steps)
    }

    /// argmin ‖diag(weight)(A x − b)‖ per channel, and the steps that it took.
    fn least(&self, weights: &[Rgb], b: &[Rgb]) -> (Vec<Rgb>, usize) {
        let dense = if self.dense { self.normal(weights, b) } else { None };
        dense.map_or_else(|| solve(&self.a, weights, b, self.accuracy, self.steps), |x| (x, 1))
    }

    /// The same by normal equations; `None` where they are singular.
    fn normal(&self, weights: &[Rgb], b: &[Rgb]) -> Option<Vec<Rgb>> {
        let (n, size) = (self.a.columns(), b.len().div_ceil(BLOCKS).max(1));
        let block = |k: usize| {
            let (mut m, mut side) = (vec![[0.0; 3]; n * n], vec![[0.0; 3]; n]);
            for i in k * size..((k + 1) * size).min(b.len()) {
                let w: Rgb = weights[i].map(|w| w * w);
                let row = self.a.row(i);
                for &(p, x) in row {
                    let (p, x) = (p as usize, f64::from(x));
                    (0..3).for_each(|c| side[p][c] += w[c] * x * b[i][c]);
                    for &(q, y) in row.iter().filter(|q| q.0 as usize <= p) {
                        let y = x * f64::from(y);
                        let to = &mut m[p * n + q as usize];
                        (0..3).for_each(|c| to[c] += w[c] * y);
                    }
                }
            }
            (m, side)
        };
        let mut blocks = (0..BLOCKS).into_par_iter().map(block).collect::<Vec<_>>().into_iter();
        let (mut m, mut side) = blocks.next()?;
        let add = |to: &mut [Rgb], from: &[Rgb]| {
            to.iter_mut().zip(from).for_each(|(t, f)| (0..3).for_each(|c| t[c] += f[c]));
        };
        for (a, b) in blocks {
            add(&mut m, &a);
            add(&mut side, &b);
        }
        let mut x = vec![[0.0; 3]; n];
        for c in 0..3 {
            // Unknowns of which no row says anything are 0.
            let scale: Vec<f64> = (0..n)
                .map(|k| m[k * n + k][c])
                .map(|d| if d > 0.0 { d.sqrt().recip() } else { 0.0 })
                .collect();
            let entry = |i: usize, j: usize| {
                let v = m[i * n + j][c] * scale[i] * scale[j];
                if i != j {
                    v
                } else if v > 0.0 {
                    v + RIDGE
                } else {
                    1.0
                }
            };
            let a: Vec<Vec<f64>> =
                (0..n).map(|i| (0..n).map(|j| if j <= i { entry(i, j) } else { 0.0 }).collect()).collect();
            let solved = Cholesky::new(&a)?.solve((0..n).map(|k| side[k][c] * scale[k]).collect());
            x.iter_mut().zip(solved).zip(&scale).for_each(|((x, v), s)| x[c] = v * s);
        }
        Some(x)
    }

    fn solution(&self, x: Vec<Rgb>, steps: usize) -> Solution {
        let model = self.a.times(&x);
        let cost = self.squares(|k| {
            let (v, m, floored, share) = (&self.values[k], &model[k], self.floored(k), self.share(k));
            std::array::from_fn(|c| share * raised(floored[c], self.power - 1.0) * (m[c].exp() - v[c]))
        });
        Solution { x, model, cost, steps }
    }

    /// A solution's [`cost`](Solution::cost) over Σ (weight v)², the largest of the channels.
    pub fn relative(&self, cost: &Rgb) -> f64 {
        let all = self.squares(|k| self.floored(k).map(|v| self.share(k) * raised(v, self.power)));
        (0..3).map(|c| if all[c] > 0.0 { cost[c] / all[c] } else { 0.0 }).fold(0.0, f64::max)
    }

    /// A Gauss–Newton step of the cost, v − e^m ≈ e^m δm, kept in the channels that it serves.
    pub fn refine(&self, now: &mut Solution) {
        let found: Vec<Rgb> = now.model[..self.values.len()].par_iter().map(|m| m.map(f64::exp)).collect();
        let rest = |(v, e): (&Rgb, &Rgb)| -> Rgb {
            std::array::from_fn(|c| ((v[c] - e[c]) / e[c].max(self.floor)).clamp(-1.0, 1.0))
        };
        let mut rest: Vec<Rgb> = self.values.par_iter().zip(&found).map(rest).collect();
        rest.extend(now.model[self.values.len()..].iter().map(|m| m.map(|m| -m)));
        let weights = self.weights(|k| found[k]);
        let (step, taken) = self.least(&weights, &rest);
        let moved = |(x, s): (&Rgb, &Rgb)| std::array::from_fn(|c| x[c] + s[c]);
        let trial = self.solution(now.x.iter().zip(&step).map(moved).collect(), 0);
        for c in (0..3).filter(|&c| trial.cost[c] < now.cost[c]).collect::<Vec<_>>() {
            now.cost[c] = trial.cost[c];
            now.x.iter_mut().zip(&trial.x).for_each(|(x, t)| x[c] = t[c]);
            now.model.iter_mut().zip(&trial.model).for_each(|(m, t)| m[c] = t[c]);
        }
        now.steps += taken;
    }
}

/// x^power, without asking for more than that where the power is 1 or 0.
fn raised(x: f64, power: f64) -> f64 {
    if power == 1.0 {
        x
    } else if power == 0.0 {
        1.0
    } else {
        x.powf(power)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table of products of one number for each row and one for each column, sampled everywhere: found to
    /// rounding. With a factor on one entry it is no product: steps after the first lower the absolute error.
    #[test]
    fn products_are_found_and_refined() {
        let (rows, columns) = (9usize, 7usize);
        let (p, q) = (|i: usize| 0.3 + i as f64, |j: usize| (-0.7 * j as f64).exp());
        let problem = |bump: f64, dense: bool| {
            let (mut ends, mut entries, mut values) = (Vec::new(), Vec::new(), Vec::new());
            for i in 0..rows {
                for j in 0..columns {
                    entries.extend([(i as u32, 1.0), ((rows + j) as u32, 1.0)]);
                    ends.push(entries.len() as u32);
                    let v = p(i) * q(j) * if (i, j) == (4, 3) { bump } else { 1.0 };
                    values.push([v, 2.0 * v, 0.0]);
                }
            }
            let a = Sparse::new(rows + columns, ends, entries);
            let (share, smooth) = (Vec::new(), Vec::new());
            let (floor, dim, power) = (1e-4, 1e-4, 1.0);
            Problem { a, values, share, floor, dim, power, smooth, accuracy: 1e-12, steps: 200, dense }
        };
        for exact in [false, true].map(|dense| problem(1.0, dense).solve()) {
            for k in 0..rows * columns {
                let want = p(k / columns) * q(k % columns);
                assert!((exact.model[k][0].exp() / want - 1.0).abs() < 1e-8, "{k}");
                assert!((exact.model[k][1].exp() / (2.0 * want) - 1.0).abs() < 1e-8, "{k}");
                // Nothing is the floor.
                assert!((exact.model[k][2].exp() / 1e-4 - 1.0).abs() < 1e-8, "{k}");
            }
        }
        let bumped = problem(3.0, false);
        let mut s = bumped.solve();
        let first = s.cost[0];
        let square = |k: usize| bumped.values[k][0].powi(2);
        let all: f64 = (0..rows * columns).map(square).sum();
        assert!((bumped.relative(&[first, 0.0, 0.0]) * all / first - 1.0).abs() < 1e-6);
        let mut before = first;
        for _ in 0..4 {
            bumped.refine(&mut s);
            assert!(s.cost[0] <= before);
            before = s.cost[0];
        }
        assert!(before < 0.95 * first, "{before} {first}");
    }
}

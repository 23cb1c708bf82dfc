//! The least-norm point of a polyhedron: min ½|y|² with a_i·y ≤ b_i.
//!
//! Goldfarb & Idnani 1983, A numerically stable dual method for solving strictly convex quadratic programs:
//! the most violated constraint joins the active ones, others leave where their multipliers would turn
//! negative. The active constraints' Gram matrix is kept as a Cholesky factor.

use std::mem::take;
use steradian_simd::{Arch, Kernel, Vector};

/// a·y ≤ b.
pub(super) struct Constraint {
    pub(super) a: Vec<f64>,
    pub(super) b: f64,
}

pub(super) struct Program {
    rows: Vec<Constraint>,
    /// |a|² of each.
    sizes: Vec<f64>,
    y: Vec<f64>,
    active: Vec<usize>,
    multipliers: Vec<f64>,
    /// Lower triangle L of the active constraints' a·a = L Lᵀ.
    factor: Vec<Vec<f64>>,
    tolerance: f64,
}

/// a·b.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    steradian_simd::run(Dot(a, b))
}

struct Dot<'a>(&'a [f64], &'a [f64]);

impl Kernel for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<A: Arch>(self) -> f64 {
        let n = self.0.len();
        let (a, b) = (&self.0[..n], &self.1[..n]);
        let lanes = A::F64::LANES;
        // Several sums: a single one would wait for each addition.
        let mut sums = [A::F64::splat(0.0); 4];
        let mut at = 0;
        while at + 4 * lanes <= n {
            for k in 0..4 {
                let i = at + k * lanes;
                sums[k] = A::F64::load(&a[i..]).fma(A::F64::load(&b[i..]), sums[k]);
            }
            at += 4 * lanes;
        }
        while at + lanes <= n {
            sums[0] = A::F64::load(&a[at..]).fma(A::F64::load(&b[at..]), sums[0]);
            at += lanes;
        }
        let sum = sums[0].add(sums[1]).add(sums[2].add(sums[3]));
        let mut x = [0.0; 8];
        sum.store(&mut x);
        let mut total = 0.0;
        for k in 0..lanes {
            total += x[k];
        }
        for i in at..n {
            total = A::fma(a[i], b[i], total);
        }
        total
    }
}

impl Program {
    /// Without constraints; `scale` is the size of right sides that count.
    pub(super) fn new(n: usize, scale: f64) -> Self {
        Self {
            rows: vec![],
            sizes: vec![],
            y: vec![0.0; n],
            active: vec![],
            multipliers: vec![],
            factor: vec![],
            tolerance: 1e-7 * scale,
        }
    }

    /// Adds constraints; of those that did not matter last, all but the `keep` nearest to mattering are
    /// forgotten: they come back if they do.
    pub(super) fn add(&mut self, rows: Vec<Constraint>, keep: usize) {
        let mut before: Vec<_> = take(&mut self.rows).into_iter().map(Some).collect();
        self.rows = self.active.iter().filter_map(|i| before[*i].take()).collect();
        self.active = (0..self.rows.len()).collect();
        let slack = |r: Constraint| (r.b - dot(&r.a, &self.y), r);
        let mut others: Vec<_> = before.into_iter().flatten().map(slack).collect();
        others.sort_by(|a, b| a.0.total_cmp(&b.0));
        self.rows.extend(others.into_iter().take(keep).map(|o| o.1));
        self.rows.extend(rows);
        self.sizes = self.rows.iter().map(|r| dot(&r.a, &r.a)).collect();
    }

    /// The solution, starting from the last.
    pub(super) fn solve(&mut self) -> Vec<f64> {
        for _ in 0..50 * (self.y.len() + 1) {
            let violation = |i: usize| dot(&self.rows[i].a, &self.y) - self.rows[i].b;
            let worst = (0..self.rows.len()).map(|i| (violation(i), i)).filter(|v| self.sizes[v.1] > 0.0);
            match worst.max_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((v, i)) if v > self.tolerance && self.meet(i) => {}
                _ => break,
            }
        }
        self.y.clone()
    }

    /// The constraints that are left.
    pub(super) fn rows(&self) -> &[Constraint] {
        &self.rows
    }

    /// No point that meets the constraints has a smaller norm: with multipliers λ ≥ 0 of any size, Aᵀλ·y ≤
    /// λ·b for all of them, so that |y| ≥ −λ·b/|Aᵀλ|.
    pub(super) fn least(&self) -> f64 {
        let (mut sum, mut right) = (vec![0.0; self.y.len()], 0.0);
        for (i, m) in self.active.iter().zip(&self.multipliers) {
            let m = m.max(0.0);
            sum.iter_mut().zip(&self.rows[*i].a).for_each(|(s, a)| *s += m * a);
            right += m * self.rows[*i].b;
        }
        let size = dot(&sum, &sum).sqrt();
        if right < 0.0 && size > 0.0 { -right / size } else { 0.0 }
    }

    /// Makes constraint `p` an equality; false where rounding forbids it.
    fn meet(&mut self, p: usize) -> bool {
        let mut multiplier = 0.0;
        loop {
            let row = &self.rows[p];
            let g: Vec<f64> = self.active.iter().map(|i| dot(&self.rows[*i].a, &row.a)).collect();
            let w = forward(&self.factor, g);
            // What of the normal is beyond the active constraints'.
            let beyond = self.sizes[p] - dot(&w, &w);
            let free = beyond > 1e-11 * self.sizes[p];
            let r = backward(&self.factor, w.clone());
            let full = if free { (dot(&row.a, &self.y) - row.b) / beyond } else { f64::INFINITY };
            let ratio = |k: usize| if r[k] > 0.0 { self.multipliers[k] / r[k] } else { f64::INFINITY };
            let (k, partial) = (0..r.len())
                .map(|k| (k, ratio(k)))
                .min_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap_or((0, f64::INFINITY));
            let step = full.min(partial);
            if step == f64::INFINITY {
                return false;
            }
            multiplier += step;
            self.multipliers.iter_mut().zip(&r).for_each(|(m, r)| *m -= step * r);
            if partial < full {
                self.drop(k);
                self.place(p, multiplier);
            } else {
                self.active.push(p);
                self.multipliers.push(multiplier);
                self.factor.push([&w[..], &[beyond.sqrt()]].concat());
                self.place(p, 0.0);
                return true;
            }
        }
    }

    /// y from the multipliers of the active constraints and of one more.
    fn place(&mut self, p: usize, multiplier: f64) {
        self.y.fill(0.0);
        let all = self.active.iter().zip(&self.multipliers).chain([(&p, &multiplier)]);
        for (i, m) in all {
            self.y.iter_mut().zip(&self.rows[*i].a).for_each(|(y, a)| *y -= m * a);
        }
    }

    fn drop(&mut self, k: usize) {
        self.active.remove(k);
        self.multipliers.remove(k);
        self.factor.remove(k);
        // Rotations bring the rows below back to a triangle.
        for j in k..self.factor.len() {
            let (a, b) = (self.factor[j][j], self.factor[j][j + 1]);
            let (c, s) = (a / a.hypot(b), b / a.hypot(b));
            for row in &mut self.factor[j..] {
                (row[j], row[j + 1]) = (c * row[j] + s * row[j + 1], c * row[j + 1] - s * row[j]);
            }
            self.factor[j].truncate(j + 1);
        }
    }
}

/// L w = g.
fn forward(factor: &[Vec<f64>], mut g: Vec<f64>) -> Vec<f64> {
    for (k, row) in factor.iter().enumerate() {
        g[k] = (g[k] - dot(&row[..k], &g[..k])) / row[k];
    }
    g
}

/// Lᵀ r = w.
fn backward(factor: &[Vec<f64>], mut w: Vec<f64>) -> Vec<f64> {
    for (k, row) in factor.iter().enumerate().rev() {
        w[k] /= row[k];
        let r = w[k];
        w[..k].iter_mut().zip(row).for_each(|(w, l)| *w -= r * l);
    }
    w
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Feasible, multipliers not negative, y of the active normals: that is the only least point.
    #[test]
    fn the_conditions_of_a_least_point_hold() {
        let (n, m) = (12, 60);
        let mut program = Program::new(n, 1.0);
        for part in 0..2 {
            let rows = (0..m).map(|i| {
                let entry = |j: usize| ((i * 37 + j * 11 + part * 5) as f64 * 0.731).sin();
                let a: Vec<f64> = (0..n).map(entry).collect();
                // The point of ones meets all.
                Constraint { b: a.iter().sum::<f64>() + 0.2 * (i as f64).cos().abs(), a }
            });
            program.add(rows.collect(), m);
            let y = program.solve();
            let low = program.rows.iter().map(|r| r.b - dot(&r.a, &y)).fold(f64::INFINITY, f64::min);
            assert!(low > -1e-6 && !program.active.is_empty(), "{low:e}");
            assert!(program.multipliers.iter().all(|m| *m > -1e-12));
            let mut sum = y;
            for (i, m) in program.active.iter().zip(&program.multipliers) {
                let row = &program.rows[*i];
                assert!((dot(&row.a, &program.y) - row.b).abs() < 1e-6);
                sum.iter_mut().zip(&row.a).for_each(|(s, a)| *s += m * a);
            }
            assert!(sum.iter().all(|s| s.abs() < 1e-12));
            let size = dot(&program.y, &program.y).sqrt();
            assert!((program.least() / size - 1.0).abs() < 1e-6, "{} {size}", program.least());
        }
    }
}

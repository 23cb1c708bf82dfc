//! Least squares of a sparse matrix, three channels at once.
//!
//! Paige & Saunders (1982), *LSQR: An Algorithm for Sparse Linear Equations and Sparse Least Squares*, ACM
//! TOMS 8.

use std::sync::OnceLock;
use steradian_parallel::prelude::*;

/// One number per channel.
pub type Rgb = [f64; 3];

/// A matrix with rows of few entries.
pub struct Sparse {
    rows: Lists,
    columns: usize,
    /// The transpose, which takes as long to make as several products: normal equations do without.
    turned: OnceLock<Lists>,
}

/// Rows whose sums are accumulated together; the blocks are added in their order, so that results do not
/// depend on threads. A block has accumulators of all columns: of a million rows and 20 000 columns, half as
/// many rows take 1.3 times the processor time, twice as many 0.94.
const ROWS_PER_BLOCK: usize = 1 << 16;

/// Lists of (index, value) one after the other.
#[derive(Default)]
struct Lists {
    ends: Vec<u32>,
    entries: Vec<(u32, f32)>,
}

impl Lists {
    fn get(&self, i: usize) -> &[(u32, f32)] {
        let start = if i > 0 { self.ends[i - 1] as usize } else { 0 };
        &self.entries[start..self.ends[i] as usize]
    }

    /// Sums over the lists, each times `weight` of what it points to.
    fn sums(&self, of: impl Fn(usize) -> Rgb + Sync) -> Vec<Rgb> {
        let sum = |i: usize| {
            let mut s = [0.0; 3];
            for &(k, v) in self.get(i) {
                let x = of(k as usize);
                (0..3).for_each(|c| s[c] += f64::from(v) * x[c]);
            }
            s
        };
        (0..self.ends.len()).into_par_iter().with_min_len(512).map(sum).collect()
    }
}

impl Sparse {
    /// The matrix of these rows, each the end of its entries.
    pub fn new(columns: usize, ends: Vec<u32>, entries: Vec<(u32, f32)>) -> Self {
        Self { rows: Lists { ends, entries }, columns, turned: OnceLock::new() }
    }

    fn turned(&self) -> &Lists {
        self.turned.get_or_init(|| {
            let rows = &self.rows;
            let mut counts = vec![0u32; self.columns + 1];
            rows.entries.iter().for_each(|e| counts[e.0 as usize + 1] += 1);
            for k in 0..self.columns {
                counts[k + 1] += counts[k];
            }
            let mut place = counts.clone();
            let mut entries = vec![(0, 0.0); rows.entries.len()];
            for row in 0..rows.ends.len() {
                for &(k, v) in rows.get(row) {
                    let at = &mut place[k as usize];
                    entries[*at as usize] = (row as u32, v);
                    *at += 1;
                }
            }
            counts.remove(0);
            Lists { ends: counts, entries }
        })
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Column and value of the entries of row `i`.
    pub fn row(&self, i: usize) -> &[(u32, f32)] {
        self.rows.get(i)
    }

    /// A x.
    pub fn times(&self, x: &[Rgb]) -> Vec<Rgb> {
        self.rows.sums(|k| x[k])
    }

    /// Squared norms of the columns of diag(weight) A, of as many rows as there are weights.
    pub fn column_norms(&self, weight: &[Rgb]) -> Vec<Rgb> {
        let block = |(b, weight): (usize, &[Rgb])| {
            let mut s = vec![[0.0; 3]; self.columns];
            for (row, w) in weight.iter().enumerate() {
                for &(k, v) in self.rows.get(b * ROWS_PER_BLOCK + row) {
                    let to = &mut s[k as usize];
                    (0..3).for_each(|c| to[c] += (f64::from(v) * w[c]).powi(2));
                }
            }
            s
        };
        let blocks: Vec<Vec<Rgb>> = weight.par_chunks(ROWS_PER_BLOCK).enumerate().map(block).collect();
        let mut sum = vec![[0.0; 3]; self.columns];
        for block in blocks {
            sum.iter_mut().zip(block).for_each(|(s, b)| (0..3).for_each(|c| s[c] += b[c]));
        }
        sum
    }
}

/// √Σ x², in blocks of fixed size, in their order.
fn norm(x: &[Rgb]) -> Rgb {
    let block = |b: &[Rgb]| {
        let mut s = [0.0; 3];
        b.iter().for_each(|x| (0..3).for_each(|c| s[c] += x[c] * x[c]));
        s
    };
    let blocks: Vec<Rgb> = x.par_chunks(4096).map(block).collect();
    let mut s = [0.0; 3];
    blocks.iter().for_each(|b| (0..3).for_each(|c| s[c] += b[c]));
    s.map(f64::sqrt)
}

/// 1/x, 0 for 0.
fn inverse(x: Rgb) -> Rgb {
    x.map(|x| if x > 0.0 { 1.0 / x } else { 0.0 })
}

/// x times what scales it, number by number.
fn scaled(x: &[Rgb], by: &[Rgb]) -> Vec<Rgb> {
    let product = |(x, s): (&Rgb, &Rgb)| [x[0] * s[0], x[1] * s[1], x[2] * s[2]];
    x.par_iter().zip(by).with_min_len(4096).map(product).collect()
}

/// a x + b y, channel by channel.
fn combine(x: &mut [Rgb], a: Rgb, y: &[Rgb], b: Rgb) {
    x.par_iter_mut().zip(y).with_min_len(4096).for_each(|(x, y)| {
        (0..3).for_each(|c| x[c] = a[c] * x[c] + b[c] * y[c]);
    });
}

/// argmin ‖diag(weight)(A x − b)‖ per channel, columns scaled to norm 1; stops where the gradient has fallen
/// below `accuracy` of what the residual allows, or after `most` steps. Returns x and the steps taken.
pub fn solve(a: &Sparse, weight: &[Rgb], b: &[Rgb], accuracy: f64, most: usize) -> (Vec<Rgb>, usize) {
    let scale: Vec<Rgb> = a.column_norms(weight).into_iter().map(|n| inverse(n.map(f64::sqrt))).collect();
    let times = |v: &[Rgb]| {
        let v = scaled(v, &scale);
        let mut u = a.rows.sums(|k| v[k]);
        u.par_iter_mut().zip(weight).for_each(|(u, w)| (0..3).for_each(|c| u[c] *= w[c]));
        u
    };
    let adjoint = |u: &[Rgb]| {
        let u = scaled(u, weight);
        let mut v = a.turned().sums(|k| u[k]);
        v.par_iter_mut().zip(&scale).for_each(|(v, s)| (0..3).for_each(|c| v[c] *= s[c]));
        v
    };
    let mut u: Vec<Rgb> = b.iter().zip(weight).map(|(b, w)| std::array::from_fn(|c| b[c] * w[c])).collect();
    let mut beta = norm(&u);
    u.iter_mut().for_each(|u| (0..3).for_each(|c| u[c] *= inverse(beta)[c]));
    let mut v = adjoint(&u);
    let mut alpha = norm(&v);
    v.iter_mut().for_each(|v| (0..3).for_each(|c| v[c] *= inverse(alpha)[c]));
    let mut w = v.clone();
    let mut x = vec![[0.0; 3]; a.columns];
    let (mut phi_bar, mut rho_bar, first) = (beta, alpha, beta);
    let mut steps = 0;
    while steps < most {
        steps += 1;
        let mut next = times(&v);
        combine(&mut next, [1.0; 3], &u, alpha.map(|a| -a));
        beta = norm(&next);
        let scaled = inverse(beta);
        next.par_iter_mut().with_min_len(4096).for_each(|u| (0..3).for_each(|c| u[c] *= scaled[c]));
        u = next;
        let mut next = adjoint(&u);
        combine(&mut next, [1.0; 3], &v, beta.map(|b| -b));
        alpha = norm(&next);
        let scaled = inverse(alpha);
        next.par_iter_mut().with_min_len(4096).for_each(|v| (0..3).for_each(|c| v[c] *= scaled[c]));
        v = next;
        let (mut step, mut back) = ([0.0; 3], [0.0; 3]);
        let mut done = true;
        for c in 0..3 {
            let rho = rho_bar[c].hypot(beta[c]);
            if rho <= 0.0 {
                continue;
            }
            let (cos, sin) = (rho_bar[c] / rho, beta[c] / rho);
            step[c] = cos * phi_bar[c] / rho;
            back[c] = -sin * alpha[c] / rho;
            rho_bar[c] = -cos * alpha[c];
            phi_bar[c] *= sin;
            // ‖Aᵀr‖ = φ̄ α |cos|, with columns of norm 1.
            let gradient = phi_bar[c] * alpha[c] * cos.abs();
            done &= gradient <= accuracy * first[c];
        }
        combine(&mut x, [1.0; 3], &w, step);
        combine(&mut w, back, &v, [1.0; 3]);
        if done {
            break;
        }
    }
    x.iter_mut().zip(&scale).for_each(|(x, s)| (0..3).for_each(|c| x[c] *= s[c]));
    (x, steps)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A straight line through weighted points, against the normal equations.
    #[test]
    fn a_line_through_points_is_that_of_the_normal_equations() {
        let at: Vec<f64> = (0..20).map(|k| f64::from(k) * 0.3 - 1.0).collect();
        let value: Vec<Rgb> = at.iter().map(|x| [2.0 + 3.0 * x, (5.0 * x).sin(), 0.0]).collect();
        let weight: Vec<Rgb> = (0..20).map(|k| [1.0, 1.0 + f64::from(k % 3), 1.0]).collect();
        let entries = at.iter().flat_map(|x| [(0, 1.0), (1, *x as f32)]).collect();
        let a = Sparse::new(2, (1..=20).map(|k| 2 * k).collect(), entries);
        let (x, _) = solve(&a, &weight, &value, 1e-12, 50);
        for c in 0..3 {
            let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
                (0..20).map(|k| weight[k][c].powi(2) * f(f64::from(at[k] as f32), value[k][c])).sum()
            };
            let (s, sx, sxx) = (sum(&|_, _| 1.0), sum(&|x, _| x), sum(&|x, _| x * x));
            let (sy, sxy) = (sum(&|_, y| y), sum(&|x, y| x * y));
            let det = s * sxx - sx * sx;
            let want = [(sxx * sy - sx * sxy) / det, (s * sxy - sx * sy) / det];
            assert!((x[0][c] - want[0]).abs() < 1e-9 && (x[1][c] - want[1]).abs() < 1e-9, "{x:?} {want:?}");
        }
        let back = a.times(&x);
        assert!((back[3][0] - value[3][0]).abs() < 1e-6);
    }
}

//! Matrices as sums of products, every entry with a weight of its own.
//!
//! With weights that are no product of one of the row and one of the column the singular value decomposition
//! is not the best approximation (Srebro & Jaakkola 2003, *Weighted Low-Rank Approximations*). Alternating
//! least squares (Gabriel & Zamir 1979) is: with one side fixed the other one is a small linear system for
//! each row, and no step raises the error. Terms are added one by one, each along what the others leave (Wang
//! et al. 2014, *Orthogonal Rank-One Matrix Pursuit*).

use crate::dense::Cholesky;
use crate::matrix::Matrix;
use crate::svd;

/// Σ w (M − Σ_k g_k h_k)² over entries: rows i, columns j, and colours c of each column.
#[derive(Debug, Clone)]
pub struct Weighted {
    weights: Matrix,
    /// w M of each colour.
    weighted: Vec<Matrix>,
    /// Sums of the weights of rows and of columns.
    marginals: [Vec<f64>; 2],
    /// Σ w M².
    square: f64,
}

/// g_k of rows, and h_k of each colour's columns.
#[derive(Debug, Clone, PartialEq)]
pub struct Factors {
    /// `left[k][i]`.
    pub left: Vec<Vec<f64>>,
    /// `right[c][k][j]`.
    pub right: Vec<Vec<Vec<f64>>>,
    /// Σ w (M − Σ_k g_k h_k)² over Σ w M².
    pub residual: f64,
}

/// `[c][k][j]`: of each colour and term a number for each column.
type Colours = Vec<Vec<Vec<f64>>>;

/// What is added to the unit diagonal of each scaled system. 1e-14 gives the same five digits of the
/// residuals of up to eight terms; 1e-6 raises the eighth from 7.0285e-3 to 7.0295e-3.
const RIDGE: f64 = 1e-10;

impl Weighted {
    /// The weights, and M of each colour; `None` where their sizes differ.
    pub fn new(weights: Matrix, colours: &[Matrix]) -> Option<Self> {
        let same = |m: &Matrix| m.rows() == weights.rows() && m.columns() == weights.columns();
        if !colours.iter().all(same) {
            return None;
        }
        let mut square = 0.0;
        let mut weighted = Vec::new();
        for m in colours {
            let mut data = Vec::with_capacity(m.rows() * m.columns());
            for i in 0..m.rows() {
                let row = weights.row(i).iter().zip(m.row(i));
                square += row.clone().map(|(w, m)| f64::from(*w) * f64::from(*m).powi(2)).sum::<f64>();
                data.extend(row.map(|(w, m)| w * m));
            }
            weighted.push(Matrix::new(m.rows(), m.columns(), data)?);
        }
        let ones = |n: usize| [vec![1.0; n]];
        let rows = weights.times(&ones(weights.columns())).pop()?;
        let columns = weights.transposed_times(&ones(weights.rows())).pop()?;
        Some(Self { weights, weighted, marginals: [rows, columns], square })
    }

    /// No terms yet.
    pub fn nothing(&self) -> Factors {
        let residual = if self.square > 0.0 { 1.0 } else { 0.0 };
        Factors { left: Vec::new(), right: vec![Vec::new(); self.weighted.len()], residual }
    }

    /// One term more, along what `f` leaves: of w (M − Σ_k g_k h_k) over the roots of the weights of rows and
    /// columns the first singular vector. Then all terms are improved as [`Weighted::improve`] does.
    pub fn extend(&self, f: Factors, most: usize, accuracy: f64) -> Factors {
        let [r, c] =
            self.marginals.each_ref().map(|m| m.iter().map(|x| x.max(1e-300).sqrt()).collect::<Vec<_>>());
        let mut data = Vec::with_capacity(self.weighted.len() * r.len() * c.len());
        for (i, r) in r.iter().enumerate() {
            for (m, h) in self.weighted.iter().zip(&f.right) {
                let mut model = vec![0.0; c.len()];
                for (g, h) in f.left.iter().zip(h) {
                    model.iter_mut().zip(h).for_each(|(m, h)| *m += g[i] * h);
                }
                let row = m.row(i).iter().zip(self.weights.row(i)).zip(model.iter().zip(&c));
                data.extend(row.map(|((wm, w), (model, c))| {
                    ((f64::from(*wm) - f64::from(*w) * model) / (r * c)) as f32
                }));
            }
        }
        let rest = Matrix::new(r.len(), self.weighted.len() * c.len(), data).unwrap_or_default();
        let Some(u) = svd::leading(&rest, 1, 1e-3).left.pop() else { return f };
        let mut left = f.left.clone();
        left.push(u.iter().zip(&r).map(|(u, r)| u / r).collect());
        let more = self.improve(left, most, accuracy);
        if more.residual < f.residual { more } else { f }
    }

    /// Improves factors that start from `left`, which is not empty, by alternating steps: at most `most`,
    /// fewer where one of them lowers the residual by less than `accuracy` of itself.
    pub fn improve(&self, left: Vec<Vec<f64>>, most: usize, accuracy: f64) -> Factors {
        let mut right = self.right(&left);
        let mut f = Factors { residual: self.residual(&right), left, right: right.1 };
        for _ in 1..most {
            let left = self.left(&f.right);
            right = self.right(&left);
            let residual = self.residual(&right);
            // False for NaN too.
            if residual < f.residual {
                let done = residual > (1.0 - accuracy) * f.residual;
                f = Factors { left, right: right.1, residual };
                if done {
                    break;
                }
            } else {
                break;
            }
        }
        f
    }

    /// g of rows for given h.
    fn left(&self, right: &[Vec<Vec<f64>>]) -> Vec<Vec<f64>> {
        let products: Vec<Vec<f64>> =
            pairs(right[0].len()).map(|(a, b)| sum(right.iter().map(|h| product(&h[a], &h[b])))).collect();
        let normal = self.weights.times(&products);
        let sides = sum_each(self.weighted.iter().zip(right).map(|(m, h)| m.times(h)));
        solve(&normal, &sides)
    }

    /// What each colour asks of h, and h, for given g.
    fn right(&self, left: &[Vec<f64>]) -> (Colours, Colours) {
        let products: Vec<Vec<f64>> = pairs(left.len()).map(|(a, b)| product(&left[a], &left[b])).collect();
        let normal = self.weights.transposed_times(&products);
        let sides: Vec<_> = self.weighted.iter().map(|m| m.transposed_times(left)).collect();
        let h = sides.iter().map(|s| solve(&normal, s)).collect();
        (sides, h)
    }

    /// The residual where h is the best one for its g: Σ w M² − Σ h · side.
    fn residual(&self, (sides, h): &(Colours, Colours)) -> f64 {
        let all = sides.iter().flatten().zip(h.iter().flatten());
        let held: f64 = all.map(|(s, h)| s.iter().zip(h).map(|(s, h)| s * h).sum::<f64>()).sum();
        if self.square > 0.0 { ((self.square - held) / self.square).max(0.0) } else { 0.0 }
    }
}

/// Entries of the lower triangle, row by row.
fn pairs(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(|a| (0..=a).map(move |b| (a, b)))
}

fn product(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a * b).collect()
}

fn sum(mut all: impl Iterator<Item = Vec<f64>>) -> Vec<f64> {
    let mut s = all.next().unwrap_or_default();
    all.for_each(|v| s.iter_mut().zip(&v).for_each(|(s, v)| *s += v));
    s
}

fn sum_each(mut all: impl Iterator<Item = Vec<Vec<f64>>>) -> Vec<Vec<f64>> {
    let mut s = all.next().unwrap_or_default();
    all.for_each(|v| {
        s.iter_mut().zip(&v).for_each(|(s, v)| s.iter_mut().zip(v).for_each(|(s, v)| *s += v));
    });
    s
}

/// The small systems: `normal` by [`pairs`], `sides` by unknown, each over all systems.
fn solve(normal: &[Vec<f64>], sides: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = sides.len();
    let count = sides.first().map_or(0, Vec::len);
    let mut out = vec![vec![0.0; count]; n];
    for i in 0..count {
        let mut a = vec![vec![0.0; n]; n];
        pairs(n).zip(normal).for_each(|((x, y), v)| a[x][y] = v[i]);
        // Each unknown in its own unit, so that terms of any size weigh alike.
        let scale: Vec<f64> =
            (0..n).map(|k| if a[k][k] > 0.0 { a[k][k].sqrt().recip() } else { 0.0 }).collect();
        for (x, y) in pairs(n) {
            a[x][y] *= scale[x] * scale[y];
            if x == y {
                a[x][x] = if a[x][x] > 0.0 { a[x][x] + RIDGE } else { 1.0 };
            }
        }
        let b = (0..n).map(|k| sides[k][i] * scale[k]).collect();
        let Some(c) = Cholesky::new(&a) else { continue };
        c.solve(b).into_iter().enumerate().for_each(|(k, x)| out[k][i] = x * scale[k]);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::svd;

    fn matrix(rows: usize, columns: usize, f: impl Fn(usize, usize) -> f64) -> Matrix {
        let data = (0..rows * columns).map(|k| f(k / columns, k % columns) as f32).collect();
        Matrix::new(rows, columns, data).expect("whole rows")
    }

    fn vector(n: usize, seed: f64) -> Vec<f64> {
        (0..n).map(|i| 1.0 + 0.5 * (i as f64 * seed).sin()).collect()
    }

    /// Two products of which a part of the entries is missing are found again, missing entries and colours
    /// too.
    #[test]
    fn planted_products_are_found_in_spite_of_missing_entries() {
        let (g, h) = ([vector(30, 0.7), vector(30, 1.9)], [vector(24, 0.4), vector(24, 2.3)]);
        let value = |c: usize, i: usize, j: usize| g[0][i] * h[0][j] + [0.2, 0.8][c] * g[1][i] * h[1][j];
        let seen = |i: usize, j: usize| !(i * i + 3 * j * j + i * j).is_multiple_of(4);
        let weights = matrix(30, 24, |i, j| f64::from(u8::from(seen(i, j))) * (1.0 + (i % 3) as f64));
        let colours = [0, 1].map(|c| matrix(30, 24, |i, j| if seen(i, j) { value(c, i, j) } else { 1e6 }));
        let w = Weighted::new(weights, &colours).expect("one size");
        let f = w.improve(vec![vector(30, 0.1), vector(30, 0.9)], 400, 1e-9);
        assert!(f.residual < 1e-8, "{}", f.residual);
        for (c, right) in f.right.iter().enumerate() {
            for (i, j) in [(3, 4), (0, 0), (7, 1), (29, 23)] {
                let got: f64 = (0..2).map(|k| f.left[k][i] * right[k][j]).sum();
                assert!((got - value(c, i, j)).abs() < 1e-3, "{i} {j}: {got} {}", value(c, i, j));
            }
        }
    }

    /// With equal weights the best factors are the singular vectors, and what is left is what the theorem
    /// says.
    #[test]
    fn equal_weights_are_the_singular_value_decomposition() {
        let m = matrix(40, 25, |i, j| 1.0 / (1.0 + (i + 2 * j) as f64));
        let s = svd::leading(&m, 3, 1e-12);
        let w = Weighted::new(matrix(40, 25, |_, _| 1.0), std::slice::from_ref(&m)).expect("one size");
        for count in 1..=3 {
            let f = w.improve(s.left[..count].to_vec(), 5, 1e-6);
            let theory = s.rest(count) / s.square;
            assert!((f.residual - theory).abs() < 1e-6 + 1e-3 * theory, "{count}: {} {theory}", f.residual);
        }
        assert!(Weighted::new(matrix(2, 2, |_, _| 1.0), &[m]).is_none());
    }

    /// Added one by one, terms are as good as the singular vectors where all weights are equal.
    #[test]
    fn terms_one_by_one() {
        let m = matrix(40, 25, |i, j| (-((i as f64 - 1.6 * j as f64) / 6.0).powi(2)).exp());
        let s = svd::leading(&m, 5, 1e-12);
        let w = Weighted::new(matrix(40, 25, |_, _| 1.0), &[m]).expect("one size");
        let mut f = w.nothing();
        for count in 1..=5 {
            f = w.extend(f, 60, 1e-6);
            let theory = s.rest(count) / s.square;
            assert_eq!(f.left.len(), count);
            assert!(f.residual < 1.02 * theory + 1e-6, "{count}: {} {theory}", f.residual);
        }
    }

    #[test]
    fn no_step_raises_the_residual() {
        let w = Weighted::new(
            matrix(20, 20, |i, j| if i > j { 1.0 } else { 0.01 }),
            &[matrix(20, 20, |i, j| ((i * j) as f64).sin())],
        )
        .expect("one size");
        let steps: Vec<f64> =
            (1..12).map(|n| w.improve(vec![vector(20, 0.3), vector(20, 1.1)], n, 0.0).residual).collect();
        assert!(steps.windows(2).all(|s| s[1] <= s[0]), "{steps:?}");
    }
}

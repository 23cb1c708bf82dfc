//! The largest singular values of a dense matrix with their vectors.
//!
//! Golub & Kahan (1965) and Golub, Luk & Overton (1981): block Lanczos on A Aᵀ with full orthogonalisation,
//! from a random block (Halko, Martinsson & Tropp 2011; Musco & Musco 2015 bound its error). Of an
//! orthonormal basis Q of the columns of A Ω, A Aᵀ A Ω, … the part Qᵀ A has the singular values of A up to
//! what the basis misses. Each step costs one product with A and one with Aᵀ.

use crate::eigen;
use crate::matrix::Matrix;

/// A ≈ Σ_k σ_k u_k v_kᵀ.
#[derive(Debug, Clone, PartialEq)]
pub struct Svd {
    /// σ_k, falling.
    pub values: Vec<f64>,
    /// u_k, each as long as a column.
    pub left: Vec<Vec<f64>>,
    /// v_k, each as long as a row.
    pub right: Vec<Vec<f64>>,
    /// Σ a², which is the sum of the squares of all singular values.
    pub square: f64,
}

impl Svd {
    /// ‖A − A_K‖², A_K the sum of the first `count` terms: Σ_{k ≥ K} σ_k² (Eckart & Young 1936).
    pub fn rest(&self, count: usize) -> f64 {
        let held: f64 = self.values.iter().take(count).map(|s| s * s).sum();
        (self.square - held).max(0.0)
    }
}

/// Vectors of the basis in addition to those that are asked for. Four and 16 take as long, within 5 %, and
/// the squared residual is above the least one by less than 1e-8 of itself with either.
const SPARE: usize = 8;
/// Steps at most: a guard. Spectra that fall fast, slowly, or end in noise stop before 12, and give the same
/// digits with 48.
const MAX_STEPS: usize = 24;
/// A vector that orthogonalisation reduces to this part of its length is rounding, and is dropped: ε √n is
/// 1e-14 for n = 10 000. Half and twice give the same residuals to 1e-14.
const MIN_REMAINING_PART: f64 = 1e-11;

fn dot(a: &[f64], b: &[f64]) -> f64 {
    // Four sums at once: the compiler may not change the order of one.
    let mut s = [0.0; 4];
    let (a4, a1) = a.as_chunks::<4>();
    let (b4, b1) = b.as_chunks::<4>();
    for (x, y) in a4.iter().zip(b4) {
        (0..4).for_each(|k| s[k] += x[k] * y[k]);
    }
    s.iter().sum::<f64>() + a1.iter().zip(b1).map(|(x, y)| x * y).sum::<f64>()
}

/// Appends to the orthonormal `basis` what each of `new` adds to it.
fn extend(basis: &mut Vec<Vec<f64>>, new: Vec<Vec<f64>>) {
    for mut v in new {
        let before = dot(&v, &v).sqrt();
        // Twice is enough (Giraud et al. 2005).
        for _ in 0..2 {
            for q in &*basis {
                let s = dot(q, &v);
                v.iter_mut().zip(q).for_each(|(v, q)| *v -= s * q);
            }
        }
        let after = dot(&v, &v).sqrt();
        if after > MIN_REMAINING_PART * before && after.is_finite() {
            v.iter_mut().for_each(|v| *v /= after);
            basis.push(v);
        }
    }
}

/// Numbers in −1 … 1 from a fixed seed (Marsaglia 2003, xorshift).
fn noise(count: usize, n: usize) -> Vec<Vec<f64>> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    (0..count).map(|_| (0..n).map(|_| next()).collect()).collect()
}

/// Σ_k w_k x_k.
fn combination(x: &[Vec<f64>], w: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; x.first().map_or(0, Vec::len)];
    for (x, w) in x.iter().zip(w) {
        out.iter_mut().zip(x).for_each(|(o, x)| *o += w * x);
    }
    out
}

/// The `count` largest singular values and their vectors, fewer where the rank is less. Steps go on until the
/// squares of those values grow by less than `accuracy` of their sum.
pub fn leading(a: &Matrix, count: usize, accuracy: f64) -> Svd {
    let rank = a.rows().min(a.columns());
    let count = count.min(rank);
    let (mut q, mut z): (Vec<Vec<f64>>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
    let mut next = a.times(&noise((count + SPARE).min(rank), a.columns()));
    let mut held = 0.0;
    let mut spectrum = Vec::new();
    for _ in 0..MAX_STEPS {
        let from = q.len();
        extend(&mut q, next);
        q.truncate(rank);
        if q.len() == from {
            break;
        }
        z.extend(a.transposed_times(&q[from..]));
        // (Qᵀ A)(Qᵀ A)ᵀ.
        let gram = z.iter().map(|x| z.iter().map(|y| dot(x, y)).collect()).collect();
        spectrum = eigen::symmetric(gram);
        let now: f64 = spectrum.iter().take(count).map(|e| e.0.max(0.0)).sum();
        if now <= held * (1.0 + accuracy) || q.len() == rank {
            break;
        }
        held = now;
        next = a.times(&z[from..]);
    }
    let square = a.square();
    let mut out = Svd { values: Vec::new(), left: Vec::new(), right: Vec::new(), square };
    for (_, w) in spectrum.iter().take(count) {
        let mut v = combination(&z, w);
        // From the vector itself: the square would lose half of the digits of a small one.
        let sigma = dot(&v, &v).sqrt();
        if sigma <= 0.0 {
            break;
        }
        v.iter_mut().for_each(|v| *v /= sigma);
        out.values.push(sigma);
        out.left.push(combination(&q, w));
        out.right.push(v);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix with these singular values, by reflections of the diagonal one.
    fn made(rows: usize, columns: usize, values: &[f64]) -> Matrix {
        let unit = |n: usize, seed: usize| -> Vec<f64> {
            let v: Vec<f64> = (0..n).map(|i| ((i * 7919 + seed) as f64).sin()).collect();
            let s = dot(&v, &v).sqrt();
            v.iter().map(|x| x / s).collect()
        };
        let (u, v) = (unit(rows, 1), unit(columns, 2));
        let mirror = |w: &[f64], i: usize, j: usize| f64::from(u8::from(i == j)) - 2.0 * w[i] * w[j];
        let entry = |i: usize, j: usize| {
            values.iter().enumerate().map(|(k, s)| mirror(&u, i, k) * s * mirror(&v, j, k)).sum::<f64>()
                as f32
        };
        let data = (0..rows * columns).map(|k| entry(k / columns, k % columns)).collect();
        Matrix::new(rows, columns, data).expect("whole rows")
    }

    #[test]
    fn values_and_vectors_of_a_known_matrix() {
        let values: Vec<f64> = (0..40).map(|k| 3.0 * 0.8f64.powi(k)).collect();
        for (rows, columns) in [(90, 64), (40, 200)] {
            let a = made(rows, columns, &values);
            let s = leading(&a, 8, 1e-12);
            assert_eq!(s.values.len(), 8);
            for k in 0..8 {
                assert!((s.values[k] / values[k] - 1.0).abs() < 1e-6, "{k}: {} {}", s.values[k], values[k]);
                for j in 0..8 {
                    let unit = f64::from(u8::from(j == k));
                    assert!((dot(&s.left[j], &s.left[k]) - unit).abs() < 1e-9);
                    assert!((dot(&s.right[j], &s.right[k]) - unit).abs() < 1e-6);
                }
            }
            // Eckart & Young: what is left, entry by entry, is the sum of the squares of the others.
            for count in 0..8 {
                let mut left = 0.0;
                for i in 0..rows {
                    for (j, a) in a.row(i).iter().enumerate() {
                        let sum: f64 = (0..count).map(|k| s.values[k] * s.left[k][i] * s.right[k][j]).sum();
                        left += (f64::from(*a) - sum).powi(2);
                    }
                }
                let others: f64 = values[count..].iter().map(|s| s * s).sum();
                assert!((left / others - 1.0).abs() < 1e-5, "{count}: {left} {others}");
                assert!((s.rest(count) / others - 1.0).abs() < 1e-5, "{count}: {} {others}", s.rest(count));
            }
        }
    }

    /// All of them, one, none, and a rank that is less than what is asked.
    #[test]
    fn every_rank() {
        let full = leading(&made(12, 9, &[5.0, 4.0, 3.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05]), 9, 1e-12);
        assert!((full.values[8] - 0.05).abs() < 1e-5 && full.rest(9) < 1e-4, "{full:?}");
        let one = leading(&made(30, 20, &[2.0]), 5, 1e-12);
        assert!(
            (one.values[0] - 2.0).abs() < 1e-6 && one.values[1..].iter().all(|s| *s < 1e-6),
            "{:?}",
            one.values
        );
        let none = leading(&Matrix::new(4, 4, vec![0.0; 16]).expect("whole rows"), 3, 1e-12);
        assert!(none.values.is_empty() && none.square == 0.0);
        assert!(leading(&Matrix::default(), 3, 1e-12).values.is_empty());
    }

    /// Equal singular values, as a matrix that mirrors directions has them.
    #[test]
    fn a_flat_spectrum() {
        let s = leading(&made(64, 64, &[1.0; 64]), 6, 1e-9);
        assert!(s.values.iter().all(|s| (s - 1.0).abs() < 1e-6), "{:?}", s.values);
        assert!((s.rest(6) - 58.0).abs() < 1e-4);
    }
}

//! Eigenvalues and eigenvectors of small symmetric matrices.

/// Sweeps at most; a handful is enough.
const SWEEPS: usize = 30;

/// Eigenvalues in descending order with their unit eigenvectors, by Jacobi's rotations (Golub & Van Loan, Matrix
/// Computations, 8.5). The matrix is square, its lower triangle is not read.
pub fn symmetric(mut a: Vec<Vec<f64>>) -> Vec<(f64, Vec<f64>)> {
    let n = a.len();
    let unit = |i: usize| (0..n).map(|j| if i == j { 1.0 } else { 0.0 }).collect();
    // Rows are the vectors to be.
    let mut v: Vec<Vec<f64>> = (0..n).map(unit).collect();
    for i in 0..n {
        for j in 0..i {
            a[i][j] = a[j][i];
        }
    }
    for _ in 0..SWEEPS {
        let diagonal: f64 = (0..n).map(|i| a[i][i] * a[i][i]).sum();
        let off: f64 = (0..n).map(|i| a[i][i + 1..].iter().map(|x| x * x).sum::<f64>()).sum();
        if off <= 1e-26 * diagonal {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                if a[p][q] * a[p][q] > 1e-30 * (a[p][p] * a[q][q]).abs() {
                    turn(&mut a, &mut v, p, q);
                }
            }
        }
    }
    let mut out: Vec<(f64, Vec<f64>)> = v.into_iter().enumerate().map(|(i, v)| (a[i][i], v)).collect();
    out.sort_by(|x, y| y.0.total_cmp(&x.0));
    out
}

/// The rotation in the plane of `p` and `q` after which a[p][q] is 0.
fn turn(a: &mut [Vec<f64>], v: &mut [Vec<f64>], p: usize, q: usize) {
    let theta = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for row in a.iter_mut() {
        let (x, y) = (row[p], row[q]);
        (row[p], row[q]) = (c * x - s * y, s * x + c * y);
    }
    for m in [a, v] {
        let (head, tail) = m.split_at_mut(q);
        for (x, y) in head[p].iter_mut().zip(&mut tail[0]) {
            (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_are_orthonormal_and_make_the_matrix_again() {
        let n = 12;
        let a: Vec<Vec<f64>> = (0..n)
            .map(|i| (0..n).map(|j| 1.0 / (1.0 + (i + j) as f64) + f64::from(u8::from(i == j))).collect())
            .collect();
        let e = symmetric(a.clone());
        assert!(e.windows(2).all(|w| w[0].0 >= w[1].0));
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        for i in 0..n {
            for j in 0..n {
                let unit = if i == j { 1.0 } else { 0.0 };
                assert!((dot(&e[i].1, &e[j].1) - unit).abs() < 1e-12);
                let again: f64 = e.iter().map(|(l, v)| l * v[i] * v[j]).sum();
                assert!((again - a[i][j]).abs() < 1e-12);
            }
        }
    }
}

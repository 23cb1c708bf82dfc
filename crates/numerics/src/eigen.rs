//! Eigenvalues and eigenvectors of symmetric matrices.

/// Steps for one eigenvalue at most; two are usual, and 30 and 120 give the same digits.
const MAX_STEPS: usize = 60;

/// Eigenvalues in descending order with their unit eigenvectors. The matrix is square, its lower triangle is
/// not read.
///
/// Householder's reduction to three diagonals, then implicit QL steps with Wilkinson's shift (Golub & Van
/// Loan, *Matrix Computations*, 8.3; Dubrulle, Martin & Wilkinson 1968). Errors are a few units in the last
/// place of the largest eigenvalue.
pub fn symmetric(mut a: Vec<Vec<f64>>) -> Vec<(f64, Vec<f64>)> {
    let n = a.len();
    for i in 0..n {
        for j in 0..i {
            a[i][j] = a[j][i];
        }
    }
    // Numbers near 1, whose squares neither overflow nor vanish.
    let scale = a.iter().flatten().fold(0.0_f64, |m, x| m.max(x.abs()));
    if scale > 0.0 {
        a.iter_mut().flatten().for_each(|x| *x /= scale);
    }
    // Rows are the vectors to be.
    let mut v: Vec<Vec<f64>> =
        (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    let (mut d, mut e) = tridiagonal(&mut a, &mut v);
    for l in 0..n {
        for _ in 0..MAX_STEPS {
            let small = |m: usize| e[m].abs() <= f64::EPSILON * (d[m].abs() + d[m + 1].abs());
            let m = (l..n - 1).find(|m| small(*m)).unwrap_or(n - 1);
            if m == l {
                break;
            }
            step(&mut d, &mut e, &mut v, l, m);
        }
    }
    let mut out: Vec<(f64, Vec<f64>)> = d.into_iter().map(|d| d * scale).zip(v).collect();
    out.sort_by(|x, y| y.0.total_cmp(&x.0));
    out
}

/// The diagonal and the one beside it of Q a Qᵀ, by reflections that make `v` into Q v; `a` is used up.
fn tridiagonal(a: &mut [Vec<f64>], v: &mut [Vec<f64>]) -> (Vec<f64>, Vec<f64>) {
    let n = a.len();
    let mut e = vec![0.0; n];
    // Of a matrix of numbers near 1: far below what rounding leaves, and the square far above the smallest
    // numbers.
    let nothing = 1e-20;
    for k in 0..n.saturating_sub(1) {
        let first = a[k][k + 1];
        let rest = a[k][k + 2..].iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        if rest <= nothing {
            e[k] = first;
            continue;
        }
        let square: f64 = a[k][k + 1..].iter().map(|x| x * x).sum();
        // The mirror that takes what is beside the diagonal to `to` along the first axis: u the normal, not
        // normalised.
        let to = -square.sqrt().copysign(first);
        e[k] = to;
        let mut u = a[k][k + 1..].to_vec();
        u[0] -= to;
        let beta = 1.0 / (to * (to - first));
        // a -= u wᵀ + w uᵀ below and right of k.
        let mut w: Vec<f64> = a[k + 1..].iter().map(|row| beta * dot(&row[k + 1..], &u)).collect();
        let half = 0.5 * beta * dot(&w, &u);
        w.iter_mut().zip(&u).for_each(|(w, u)| *w -= half * u);
        for (i, row) in a[k + 1..].iter_mut().enumerate() {
            let (ui, wi) = (u[i], w[i]);
            for (x, (u, w)) in row[k + 1..].iter_mut().zip(u.iter().zip(&w)) {
                *x -= ui * w + wi * u;
            }
        }
        // v -= β u (uᵀ v) in rows k + 1 and on.
        let mut sum = vec![0.0; n];
        for (u, row) in u.iter().zip(&v[k + 1..]) {
            sum.iter_mut().zip(row).for_each(|(s, x)| *s += beta * u * x);
        }
        for (u, row) in u.iter().zip(&mut v[k + 1..]) {
            row.iter_mut().zip(&sum).for_each(|(x, s)| *x -= u * s);
        }
    }
    ((0..n).map(|i| a[i][i]).collect(), e)
}

/// One implicit QL step on rows `l` … `m`.
fn step(d: &mut [f64], e: &mut [f64], v: &mut [Vec<f64>], l: usize, m: usize) {
    let g = 0.5 * (d[l + 1] - d[l]) / e[l];
    let shift = d[l] - e[l] / (g + g.hypot(1.0).copysign(g));
    let (mut g, mut sine, mut cosine, mut moved) = (d[m] - shift, 1.0, 1.0, 0.0);
    for i in (l..m).rev() {
        let (f, b) = (sine * e[i], cosine * e[i]);
        let r = f.hypot(g);
        e[i + 1] = r;
        if r == 0.0 {
            d[i + 1] -= moved;
            e[m] = 0.0;
            return;
        }
        (sine, cosine) = (f / r, g / r);
        g = d[i + 1] - moved;
        let r = (d[i] - g) * sine + 2.0 * cosine * b;
        moved = sine * r;
        d[i + 1] = g + moved;
        g = cosine * r - b;
        let (head, tail) = v.split_at_mut(i + 1);
        for (x, y) in head[i].iter_mut().zip(&mut tail[0]) {
            (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
        }
    }
    d[l] -= moved;
    e[l] = g;
    e[m] = 0.0;
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hold(a: &[Vec<f64>]) {
        let (n, e) = (a.len(), symmetric(a.to_vec()));
        let scale = a.iter().flatten().fold(1e-300_f64, |m, x| m.max(x.abs()));
        assert!(e.windows(2).all(|w| w[0].0 >= w[1].0));
        for i in 0..n {
            for j in 0..n {
                let unit = f64::from(u8::from(i == j));
                assert!((dot(&e[i].1, &e[j].1) - unit).abs() < 1e-12);
                let again: f64 = e.iter().map(|(l, v)| l * v[i] * v[j]).sum();
                assert!((again - a[i][j]).abs() < 1e-12 * scale, "{n}: {again} {}", a[i][j]);
            }
        }
    }

    #[test]
    fn vectors_are_orthonormal_and_make_the_matrix_again() {
        let made = |n: usize, f: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
            (0..n).map(|i| (0..n).map(|j| f(i, j)).collect()).collect()
        };
        for n in [0, 1, 2, 3, 12, 41] {
            // Hilbert's matrix, whose eigenvalues fall to rounding; equal eigenvalues; nothing; rank one;
            // three diagonals.
            hold(&made(n, &|i, j| 1.0 / (1.0 + (i + j) as f64)));
            hold(&made(n, &|i, j| f64::from(u8::from(i == j))));
            hold(&made(n, &|_, _| 0.0));
            hold(&made(n, &|i, j| 1e-200 / (1.0 + (i + j) as f64)));
            hold(&made(n, &|i, j| 1e8 * (i as f64 - 2.0) * (j as f64 - 2.0)));
            hold(&made(n, &|i, j| (-3.0 * (i + j) as f64).exp()));
            hold(&made(n, &|i, j| [2.0, -1.0, 0.0][i.abs_diff(j).min(2)]));
        }
    }

    /// 2 − 2 cos(kπ/(n + 1)) of the second difference's matrix.
    #[test]
    fn the_string_has_its_frequencies() {
        let n = 30;
        let a: Vec<Vec<f64>> = (0..n)
            .map(|i| (0..n).map(|j| [2.0, -1.0, 0.0][usize::abs_diff(i, j).min(2)]).collect())
            .collect();
        for (k, (value, _)) in symmetric(a).iter().rev().enumerate() {
            let want = 2.0 - 2.0 * (std::f64::consts::PI * (k + 1) as f64 / (n + 1) as f64).cos();
            assert!((value - want).abs() < 1e-14, "{value} {want}");
        }
    }
}

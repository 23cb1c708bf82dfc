//! Dense linear systems.

/// The lower triangular L of a = L Lᵀ (Cholesky), for several right sides.
#[derive(Debug, Clone)]
pub struct Cholesky {
    l: Vec<Vec<f64>>,
}

impl Cholesky {
    /// The factor of a symmetric matrix, of which the lower triangle is read; `None` where it is not positive
    /// definite to working accuracy.
    pub fn new(a: &[Vec<f64>]) -> Option<Self> {
        let n = a.len();
        let mut l = vec![vec![0.0; n]; n];
        for i in 0..n {
            for j in 0..=i {
                let s: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
                let rest = a[i][j] - s;
                if i != j {
                    l[i][j] = rest / l[j][j];
                } else if rest > 1e-13 * a[i][i] && rest > 0.0 {
                    l[i][i] = rest.sqrt();
                } else {
                    return None;
                }
            }
        }
        Some(Self { l })
    }

    /// x of a x = b.
    pub fn solve(&self, mut b: Vec<f64>) -> Vec<f64> {
        let (l, n) = (&self.l, b.len());
        for i in 0..n {
            let s: f64 = (0..i).map(|j| l[i][j] * b[j]).sum();
            b[i] = (b[i] - s) / l[i][i];
        }
        for i in (0..n).rev() {
            let s: f64 = (i + 1..n).map(|j| l[j][i] * b[j]).sum();
            b[i] = (b[i] - s) / l[i][i];
        }
        b
    }
}

/// x of a x = b for every column of `b` (whose rows are those of `a`), by elimination with pivots (Gauss and
/// Jordan). `None` where a pivot is at most `singular` times the largest entry.
pub fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<Vec<f64>>, singular: f64) -> Option<Vec<Vec<f64>>> {
    eliminate(&mut a, &mut b, singular).then_some(b)
}

/// [`solve`] in place, for rows of any kind, such as arrays of a system that is solved many times: x replaces
/// `b`, and `a` is spent. Rows may have more entries than there are rows if those are 0. False where a pivot
/// is at most `singular` times the largest entry.
pub fn eliminate<A, B>(a: &mut [A], b: &mut [B], singular: f64) -> bool
where
    A: AsRef<[f64]> + AsMut<[f64]> + Clone,
    B: AsRef<[f64]> + AsMut<[f64]> + Clone,
{
    let n = a.len();
    let scale = a.iter().flat_map(|row| row.as_ref()).fold(0.0_f64, |m, x| m.max(x.abs()));
    let at = |a: &[A], i: usize, k: usize| a[i].as_ref()[k];
    for k in 0..n {
        let larger = |i: &usize, j: &usize| at(a, *i, k).abs().total_cmp(&at(a, *j, k).abs());
        let pivot = (k..n).max_by(larger).unwrap_or(k);
        if at(a, pivot, k).is_nan() || at(a, pivot, k).abs() <= singular * scale {
            return false;
        }
        a.swap(k, pivot);
        b.swap(k, pivot);
        let inverse = at(a, k, k).recip();
        a[k].as_mut().iter_mut().for_each(|x| *x *= inverse);
        b[k].as_mut().iter_mut().for_each(|x| *x *= inverse);
        let (row, right) = (a[k].clone(), b[k].clone());
        for i in (0..n).filter(|i| *i != k) {
            let factor = at(a, i, k);
            a[i].as_mut().iter_mut().zip(row.as_ref()).for_each(|(x, r)| *x -= factor * r);
            b[i].as_mut().iter_mut().zip(right.as_ref()).for_each(|(x, r)| *x -= factor * r);
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_system() {
        let a = vec![vec![4.0, 2.0], vec![2.0, 3.0]];
        let x = Cholesky::new(&a).expect("definite").solve(vec![10.0, 9.0]);
        assert!((x[0] - 1.5).abs() < 1e-14 && (x[1] - 2.0).abs() < 1e-14, "{x:?}");
        let x = solve(a, vec![vec![10.0], vec![9.0]], 1e-12).expect("regular");
        assert!((x[0][0] - 1.5).abs() < 1e-14 && (x[1][0] - 2.0).abs() < 1e-14, "{x:?}");
        let singular = vec![vec![1.0, 1.0], vec![1.0, 1.0]];
        assert!(Cholesky::new(&singular).is_none());
        assert!(solve(singular, vec![vec![1.0], vec![1.0]], 1e-12).is_none());
        assert!(solve(vec![vec![f64::NAN]], vec![vec![1.0]], 1e-12).is_none());
    }

    /// The first pivot is 0: rows have to change places.
    #[test]
    fn elimination_exchanges_rows() {
        let a = vec![vec![0.0, 2.0, 1.0], vec![1.0, 0.0, 0.0], vec![0.0, 1.0, -1.0]];
        let x = solve(a, vec![vec![7.0], vec![5.0], vec![-1.0]], 1e-12).expect("regular");
        for (x, want) in x.iter().zip([5.0, 2.0, 3.0]) {
            assert!((x[0] - want).abs() < 1e-14, "{x:?}");
        }
    }
}

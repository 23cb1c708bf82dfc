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
        let all: Vec<usize> = (0..a.len()).collect();
        let mut l: Vec<Vec<f64>> = Vec::with_capacity(a.len());
        for i in 0..a.len() {
            l.push(next_row(a, &all[..=i], &l)?);
        }
        Some(Self { l })
    }

    /// x of a x = b.
    pub fn solve(&self, b: Vec<f64>) -> Vec<f64> {
        solved(&self.l, b)
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

/// x ≥ 0 for which xᵀ a x − 2 bᵀ x is least, a symmetric and positive definite: Lawson & Hanson 1974,
/// *Solving Least Squares Problems*, chapter 23, on the normal equations. `start` is any x ≥ 0, zeros at
/// worst; the fewer of its zeros differ from those of the result, the sooner it is found.
pub fn nonnegative(a: &[Vec<f64>], b: &[f64], start: &[f64]) -> Vec<f64> {
    let (n, mut x) = (b.len(), start.to_vec());
    let mut free: Vec<usize> = (0..n).filter(|i| x[*i] > 0.0).collect();
    let scale = b.iter().fold(0.0_f64, |m, b| m.max(b.abs()));
    // Rows of L over the free variables.
    let mut l: Vec<Vec<f64>> = Vec::new();
    // Each step adds a variable and takes out some; three times as many as there are have always sufficed.
    for step in 0..3 * n {
        if step > 0 || free.is_empty() {
            let slope = |i: usize| b[i] - free.iter().map(|j| a[i][*j] * x[*j]).sum::<f64>();
            let steepest = (0..n).filter(|i| !free.contains(i)).map(|i| (slope(i), i));
            let Some((slope, next)) = steepest.max_by(|a, b| a.0.total_cmp(&b.0)) else { break };
            if slope.is_nan() || slope <= 1e-12 * scale {
                break;
            }
            free.push(next);
        }
        loop {
            while l.len() < free.len() {
                let Some(row) = next_row(a, &free[..=l.len()], &l) else {
                    // It depends on those before it.
                    x[free.remove(l.len())] = 0.0;
                    continue;
                };
                l.push(row);
            }
            let found = solved(&l, free.iter().map(|i| b[*i]).collect());
            // The step towards the minimum over the free variables, as far as none turns negative.
            let blocked = free.iter().zip(&found).filter(|(_, f)| **f <= 0.0);
            let step = blocked.map(|(i, f)| x[*i] / (x[*i] - f)).fold(1.0, f64::min);
            for (i, f) in free.iter().zip(&found) {
                x[*i] += step * (f - x[*i]);
            }
            if step >= 1.0 {
                break;
            }
            let stays = |i: &usize| x[*i] > 1e-14 * scale / a[*i][*i];
            let same = free.iter().take_while(|i| stays(i)).count();
            l.truncate(same);
            let (kept, gone): (Vec<usize>, Vec<usize>) = free.iter().partition(|i| stays(i));
            gone.iter().for_each(|i| x[*i] = 0.0);
            free = kept;
        }
    }
    x
}

/// The next row of L, a = L Lᵀ over the variables `of`, of which `l` has all rows but the last; `None` where
/// a is not positive definite to working accuracy.
fn next_row(a: &[Vec<f64>], of: &[usize], l: &[Vec<f64>]) -> Option<Vec<f64>> {
    let last = of[l.len()];
    let mut row: Vec<f64> = Vec::with_capacity(of.len());
    for (known, i) in l.iter().zip(of) {
        let s: f64 = known.iter().zip(&row).map(|(x, y)| x * y).sum();
        row.push((a[last][*i] - s) / known[row.len()]);
    }
    let rest = a[last][last] - row.iter().map(|x| x * x).sum::<f64>();
    (rest > 1e-13 * a[last][last] && rest > 0.0).then(|| {
        row.push(rest.sqrt());
        row
    })
}

/// x of L Lᵀ x = b, L by rows as far as the diagonal.
fn solved(l: &[Vec<f64>], mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for i in 0..n {
        let s: f64 = (0..i).map(|j| l[i][j] * b[j]).sum();
        b[i] = (b[i] - s) / l[i][i];
    }
    for i in (0..n).rev() {
        b[i] /= l[i][i];
        let x = b[i];
        b[..i].iter_mut().zip(&l[i]).for_each(|(b, l)| *b -= l * x);
    }
    b
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

    /// Where the free variables are at their minimum and the others would lower nothing, nothing is lower.
    #[test]
    fn the_least_without_negative_numbers() {
        let x = nonnegative(&[vec![2.0, 0.0], vec![0.0, 1.0]], &[4.0, -3.0], &[0.0; 2]);
        assert!((x[0] - 2.0).abs() < 1e-12 && x[1] == 0.0, "{x:?}");
        // Bumps in a row that overlap, and a sum of which some would be negative.
        let n = 24;
        let overlap = |i: usize, j: usize| (-0.25 * (i as f64 - j as f64).powi(2)).exp();
        let a: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| overlap(i, j)).collect()).collect();
        let b: Vec<f64> = (0..n).map(|i| (i as f64 * 1.3).sin() + 0.3).collect();
        let x = nonnegative(&a, &b, &vec![0.0; n]);
        let elsewhere: Vec<f64> = (0..n).map(|i| f64::from(u8::from(i % 3 == 0))).collect();
        let again = nonnegative(&a, &b, &elsewhere);
        assert!(x.iter().zip(&again).all(|(x, y)| (x - y).abs() < 1e-9), "{x:?} {again:?}");
        let mut at_bound = 0;
        for i in 0..n {
            let slope = b[i] - (0..n).map(|j| a[i][j] * x[j]).sum::<f64>();
            assert!(x[i] >= 0.0 && slope < 1e-9 && (x[i] == 0.0 || slope > -1e-9), "{i}: {} {slope}", x[i]);
            at_bound += usize::from(x[i] == 0.0);
        }
        assert!(at_bound > 3 && at_bound < n - 3, "{at_bound}");
    }
}

//! Sums of Legendre polynomials at many points, as many at a time as fit into registers.

use steradian_simd::{Arch, Kernel, Vector, run};

/// Registers of points that a recursion carries at a time.
const GROUP: usize = 4;

/// Σ_i w_i P_l(x_i) for l = 0 … `order`; points are (x, w).
pub(crate) fn moments(points: &[(f64, f64)], order: usize) -> Vec<f64> {
    run(Moments { points, order })
}

/// P_{l+1} = a_l x P_l − b_l P_{l−1}: a_l and −b_l.
fn steps(order: usize) -> Vec<[f64; 2]> {
    (0..=order).map(|l| l as f64).map(|l| [(2.0 * l + 1.0) / (l + 1.0), -l / (l + 1.0)]).collect()
}

struct Moments<'a> {
    points: &'a [(f64, f64)],
    order: usize,
}

impl Kernel for Moments<'_> {
    type Output = Vec<f64>;

    #[inline(always)]
    fn run<A: Arch>(self) -> Vec<f64> {
        let lanes = A::F64::LANES;
        let width = GROUP * lanes;
        let steps = steps(self.order);
        let mut sums = vec![0.0; (self.order + 1) * lanes];
        let (mut x, mut w) = (vec![0.0; width], vec![0.0; width]);
        for block in self.points.chunks(width) {
            x.fill(0.0);
            w.fill(0.0);
            for (k, point) in block.iter().enumerate() {
                (x[k], w[k]) = *point;
            }
            let zero = [A::F64::splat(0.0); GROUP];
            // w P_l obeys P_l's recursion.
            let (mut at, mut p, mut before) = (zero, zero, zero);
            for g in 0..GROUP {
                at[g] = A::F64::load(&x[g * lanes..]);
                p[g] = A::F64::load(&w[g * lanes..]);
            }
            for (sum, [a, b]) in sums.chunks_exact_mut(lanes).zip(&steps) {
                let (a, b) = (A::F64::splat(*a), A::F64::splat(*b));
                let mut all = A::F64::load(sum);
                for g in 0..GROUP {
                    all = all.add(p[g]);
                    let next = a.mul(at[g]).fma(p[g], b.mul(before[g]));
                    (before[g], p[g]) = (p[g], next);
                }
                all.store(sum);
            }
        }
        sums.chunks_exact(lanes).map(|s| s.iter().sum()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_those_of_the_recursion() {
        let points: Vec<(f64, f64)> =
            (0..77).map(|k| ((f64::from(k) * 0.7).sin(), f64::from(k % 5))).collect();
        let m = moments(&points, 40);
        let p = |l: usize, x: f64| {
            let (mut before, mut p) = (0.0, 1.0);
            for l in 0..l {
                let l = l as f64;
                (before, p) = (p, ((2.0 * l + 1.0) * x * p - l * before) / (l + 1.0));
            }
            p
        };
        for l in 0..=40 {
            let direct: f64 = points.iter().map(|(x, w)| w * p(l, *x)).sum();
            assert!((m[l] - direct).abs() < 1e-11, "{l}: {} {direct}", m[l]);
        }
    }
}

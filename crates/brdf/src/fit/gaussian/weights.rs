//! The weights of given Gaussians: least squares with w ≥ 0, and with a given sum where the albedo is kept.

use super::MAX_LOBES;
use steradian_numerics::dense::eliminate;

/// A small symmetric matrix.
pub(super) type Small = [[f64; MAX_LOBES]; MAX_LOBES];

/// The solution for one channel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Weights {
    pub w: [f64; MAX_LOBES],
    /// dw/db over the weights that are not at their bound: how w follows the right-hand side.
    pub follow: Small,
}

/// Rows of a system: one per lobe for the weights, and one for the multiplier of their sum.
const SIDE: usize = MAX_LOBES + 1;

/// The minimum of wᵀ G w − 2 bᵀ w over w ≥ 0, and Σ w = `sum` where it is given: the best of the minima on
/// all faces, at most fifteen.
pub(super) fn best(k: usize, gram: &Small, b: [f64; MAX_LOBES], sum: Option<f64>) -> Weights {
    let none = Weights { w: [0.0; MAX_LOBES], follow: [[0.0; MAX_LOBES]; MAX_LOBES] };
    let sum = sum.map(|s| s.max(0.0));
    if sum == Some(0.0) {
        return none;
    }
    let mut found = (if sum.is_some() { f64::INFINITY } else { 0.0 }, none);
    for face in 1..1usize << k {
        let free: Vec<usize> = (0..k).filter(|i| face >> i & 1 == 1).collect();
        let n = free.len();
        let m = n + usize::from(sum.is_some());
        let (mut a, mut unit) = ([[0.0; SIDE]; SIDE], [[0.0; SIDE]; SIDE]);
        for (i, p) in free.iter().enumerate() {
            for (j, q) in free.iter().enumerate() {
                // A ridge of 1e-9 keeps lobes that coincide from weights without bound.
                a[i][j] = gram[*p][*q] * if i == j { 1.0 + 1e-9 } else { 1.0 };
            }
        }
        if m > n {
            for i in 0..n {
                (a[i][n], a[n][i]) = (1.0, 1.0);
            }
        }
        (0..m).for_each(|i| unit[i][i] = 1.0);
        if !eliminate(&mut a[..m], &mut unit[..m], 0.0) {
            continue;
        }
        let inverse = unit;
        let mut w = [0.0; MAX_LOBES];
        for (i, p) in free.iter().enumerate() {
            w[*p] = free.iter().enumerate().map(|(j, q)| inverse[i][j] * b[*q]).sum::<f64>();
            w[*p] += sum.map_or(0.0, |s| inverse[i][n] * s);
        }
        if free.iter().any(|p| w[*p] < 0.0 || !w[*p].is_finite()) {
            continue;
        }
        let value: f64 =
            (0..k).map(|i| w[i] * ((0..k).map(|j| gram[i][j] * w[j]).sum::<f64>() - 2.0 * b[i])).sum();
        if value < found.0 {
            let mut follow = none.follow;
            for (i, p) in free.iter().enumerate() {
                free.iter().enumerate().for_each(|(j, q)| follow[*p][*q] = inverse[i][j]);
            }
            found = (value, Weights { w, follow });
        }
    }
    found.1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_minima() {
        let mut gram = [[0.0; MAX_LOBES]; MAX_LOBES];
        (gram[0][0], gram[1][1], gram[0][1], gram[1][0]) = (2.0, 1.0, 0.5, 0.5);
        let close = |w: [f64; MAX_LOBES], want: [f64; 2]| {
            assert!((w[0] - want[0]).abs() < 1e-7 && (w[1] - want[1]).abs() < 1e-7, "{w:?} {want:?}");
        };
        // G w = b with b = G (1, 2).
        close(best(2, &gram, [3.0, 2.5, 0.0, 0.0], None).w, [1.0, 2.0]);
        // The second would be negative.
        close(best(2, &gram, [3.0, 0.1, 0.0, 0.0], None).w, [1.5, 0.0]);
        // On w₀ + w₁ = 1 with b = 0: 2 w₀² + w₀ w₁ + w₁², least at w₀ = ¼.
        close(best(2, &gram, [0.0; 4], Some(1.0)).w, [0.25, 0.75]);
        close(best(2, &gram, [9.0, 0.0, 0.0, 0.0], Some(1.0)).w, [1.0, 0.0]);
        close(best(2, &gram, [3.0, 2.5, 0.0, 0.0], Some(0.0)).w, [0.0, 0.0]);
    }
}

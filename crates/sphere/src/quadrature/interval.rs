//! Rules on [−1, 1]; nodes ascend.

use std::f64::consts::PI;
use steradian_parallel::prelude::*;

/// Nodes in (−1, 1), ascending, and weights of the n-point Gauss–Legendre rule, exact to degree 2n − 1.
///
/// Newton's method in θ from Tricomi's first approximation (Abramowitz & Stegun 1964, 22.16.6), with P_n by
/// the difference form of its recursion, which stays accurate near the ends:
/// (k+1)(P_{k+1} − P_k) = k (P_k − P_{k−1}) − (2k+1)(1−x) P_k. Weights are 2/(dP_n/dθ)². Nodes and weights
/// are good to a few 1e-16 absolute for n up to 4096. O(n²).
pub fn gauss_legendre(n: usize) -> (Vec<f64>, Vec<f64>) {
    let (theta, half) = gauss_legendre_angles(n);
    let (mut x, mut w) = (vec![0.0; n], vec![0.0; n]);
    for (i, (theta, weight)) in theta.iter().zip(half).enumerate() {
        let z = if 2 * i + 1 == n { 0.0 } else { theta.cos() };
        (x[i], x[n - 1 - i]) = (-z, z);
        (w[i], w[n - 1 - i]) = (weight, weight);
    }
    (x, w)
}

/// θ in (0, π/2], ascending, with cos θ the non-negative nodes of the Gauss–Legendre rule, and the weights.
pub(crate) fn gauss_legendre_angles(n: usize) -> (Vec<f64>, Vec<f64>) {
    let ratios: Vec<[f64; 2]> =
        (1..n).map(|k| [k as f64 / (k + 1) as f64, (2 * k + 1) as f64 / (k + 1) as f64]).collect();
    (0..n.div_ceil(2)).into_par_iter().map(|i| root(n, i, &ratios)).unzip()
}

/// The i-th root of P_n(cos θ) from θ = 0, and its weight.
fn root(n: usize, i: usize, ratios: &[[f64; 2]]) -> (f64, f64) {
    let nf = n as f64;
    let guess = PI * (4 * i + 3) as f64 / (4.0 * nf + 2.0);
    let mut theta = guess + (1.0 / guess.tan()) / (8.0 * nf * nf);
    let mut slope = 1.0;
    for _ in 0..20 {
        let (p, d) = legendre_and_slope(n, theta, ratios);
        let step = p / d;
        theta -= step;
        slope = d + step * d / theta.tan();
        if step.abs() <= 4e-16 * theta {
            break;
        }
    }
    (theta, 2.0 / (slope * slope))
}

/// P_n(cos θ) and dP_n/dθ.
fn legendre_and_slope(n: usize, theta: f64, ratios: &[[f64; 2]]) -> (f64, f64) {
    let half = (0.5 * theta).sin();
    let t = 2.0 * half * half;
    // p = P_k, d = P_k − P_{k−1}, starting at k = 1.
    let (mut p, mut d) = (1.0 - t, -t);
    for [a, b] in ratios {
        d = a * d - b * t * p;
        p += d;
    }
    // dP_n/dθ = n (x P_n − P_{n−1})/sin θ = n (d − (1−x) P_n)/sin θ.
    (p, n as f64 * (d - t * p) / theta.sin())
}

/// Nodes and weights of the n-point Clenshaw–Curtis rule (ends included), exact to degree n − 1.
///
/// Waldvogel 2006, BIT 46, "Fast construction of the Fejér and Clenshaw–Curtis quadrature rules", eq. 2.4.
pub fn clenshaw_curtis(n: usize) -> (Vec<f64>, Vec<f64>) {
    if n < 2 {
        return (vec![0.0; n], vec![2.0; n]);
    }
    let last = n - 1;
    let cos = cosines(last);
    let weight = |j: usize| {
        let sum: f64 = (1..=last / 2)
            .map(|k| {
                let b = if 2 * k == last { 1.0 } else { 2.0 };
                b * cos[2 * k * j % (2 * last)] / ((4 * k * k) as f64 - 1.0)
            })
            .sum();
        let c = if j == 0 || j == last { 1.0 } else { 2.0 };
        c / last as f64 * (1.0 - sum)
    };
    symmetric(n, |j| -cos[j], weight)
}

/// Nodes and weights of Fejér's first rule: the n midpoints θ_j = (j+½)π/n, exact to degree n − 1.
///
/// Waldvogel 2006, BIT 46, eq. 2.1 (Fejér 1933).
pub fn fejer1(n: usize) -> (Vec<f64>, Vec<f64>) {
    if n == 0 {
        return (vec![], vec![]);
    }
    let cos = cosines(2 * n);
    let weight = |j: usize| {
        let sum: f64 =
            (1..=n / 2).map(|k| cos[2 * k * (2 * j + 1) % (4 * n)] / ((4 * k * k) as f64 - 1.0)).sum();
        2.0 / n as f64 * (1.0 - 2.0 * sum)
    };
    symmetric(n, |j| -cos[2 * j + 1], weight)
}

/// cos(πk/n) for k < 2n.
fn cosines(n: usize) -> Vec<f64> {
    (0..2 * n).map(|k| (PI * k as f64 / n as f64).cos()).collect()
}

/// A rule from its first half.
fn symmetric(
    n: usize,
    x: impl Fn(usize) -> f64,
    w: impl Fn(usize) -> f64 + Sync + Send,
) -> (Vec<f64>, Vec<f64>) {
    let half: Vec<f64> = (0..n.div_ceil(2)).into_par_iter().map(w).collect();
    let (mut nodes, mut weights) = (vec![0.0; n], vec![0.0; n]);
    for (j, w) in half.into_iter().enumerate() {
        let z = if 2 * j + 1 == n { 0.0 } else { x(j) };
        (nodes[j], nodes[n - 1 - j]) = (z, -z);
        (weights[j], weights[n - 1 - j]) = (w, w);
    }
    (nodes, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sum(rule: &(Vec<f64>, Vec<f64>), f: impl Fn(f64) -> f64) -> f64 {
        rule.0.iter().zip(&rule.1).map(|(x, w)| w * f(*x)).sum()
    }

    #[test]
    fn monomials_are_exact_to_the_degree_promised() {
        for n in 1..30 {
            let rules = [(gauss_legendre(n), 2 * n - 1), (clenshaw_curtis(n), n - 1), (fejer1(n), n - 1)];
            for (rule, degree) in &rules {
                assert!(rule.0.is_sorted());
                for k in 0..=*degree {
                    let exact = if k % 2 == 0 { 2.0 / (k + 1) as f64 } else { 0.0 };
                    assert!((sum(rule, |x| x.powi(k as i32)) - exact).abs() < 4e-15, "{n} {k}");
                }
            }
        }
    }

    /// Abramowitz & Stegun 1964, table 25.4.
    #[test]
    fn known_nodes() {
        let (x, w) = gauss_legendre(5);
        assert!(
            (x[4] - 0.906_179_845_938_664).abs() < 1e-15 && (w[4] - 0.236_926_885_056_189_1).abs() < 1e-15
        );
        assert!((x[3] - 0.538_469_310_105_683_1).abs() < 1e-15 && (w[2] - 128.0 / 225.0).abs() < 1e-15);
        assert_eq!(gauss_legendre(1), (vec![0.0], vec![2.0]));
        assert_eq!(gauss_legendre(0), (vec![], vec![]));
    }

    /// Weights and nodes at n = 4096: ∫1, ∫x², ∫x^800 and ∫P_n² of a lower band, to rounding.
    #[test]
    fn four_thousand_nodes_are_accurate() {
        let rule = gauss_legendre(4096);
        assert!((rule.1.iter().sum::<f64>() - 2.0).abs() < 1e-14);
        assert!((sum(&rule, |x| x * x) - 2.0 / 3.0).abs() < 1e-14);
        assert!((sum(&rule, |x| x.powi(800)) - 2.0 / 801.0).abs() < 1e-14);
        // ∫ √(1−x²) = π/2: the algebraic ends test the outer weights; error O(n^−3).
        assert!((sum(&rule, |x| (1.0 - x * x).sqrt()) - PI / 2.0).abs() < 1e-10);
        // The first root of P_n is at j_{0,1}/√((n+½)² + 1/12) to O(n^−5) (Olver 1974).
        let theta = gauss_legendre_angles(4096).0[0];
        let n = 4096.5_f64;
        let olver = 2.404_825_557_695_773 / (n * n + 1.0 / 12.0).sqrt();
        assert!((theta / olver - 1.0).abs() < 1e-13, "{:e}", theta / olver - 1.0);
    }
}

//! Legendre polynomials up to degree 5 on [−1, 1]: Gauss nodes, the discrete transform, moments of hats.

use std::sync::LazyLock;
use steradian_sphere::quadrature::gauss_legendre;

/// Nodes, and polynomials, per axis: degrees 0 … 5.
pub(super) const N: usize = 6;

/// One value for each degree.
pub(super) type Row = [f64; N];

/// One value for each pair of degrees (or nodes): x first.
pub(super) type Square = [Row; N];

/// Interior points, off the Gauss grid and near its border, at which an interpolant is checked.
pub(super) const CHECKS: [[f64; 2]; 5] = [[0.0, 0.0], [0.97, 0.4], [-0.97, -0.4], [-0.4, 0.97], [0.4, -0.97]];

/// A [`Row`] with zeros behind it, which fills the widest registers.
pub(super) type Wide = [f64; 8];

/// A row of [`Wide`] rows: x first.
pub(super) type WideSquare = [Wide; N];

/// A row with its zeros.
#[inline(always)]
pub(super) fn wide(row: &Row) -> Wide {
    std::array::from_fn(|j| if j < N { row[j] } else { 0.0 })
}

/// The Gauss–Legendre rule of N nodes and tables derived from it.
pub(super) struct Rule {
    /// Nodes.
    pub x: Row,
    /// Discrete transform: c_i = Σ_q `to_degree[i][q]` g(x_q) are the Legendre coefficients of the
    /// interpolant.
    pub to_degree: Square,
    /// The table transposed, node first.
    pub of_node: WideSquare,
    /// Weights.
    pub w: Row,
    /// P_i(x_q), indexed `[i][q]`.
    pub p: Square,
    /// Polynomials at the check points, degree first: of x, and of y.
    pub checks: [WideSquare; 2],
}

/// The one rule.
pub(super) static RULE: LazyLock<Rule> = LazyLock::new(|| {
    let (nodes, weights) = gauss_legendre(N);
    let mut rule = Rule {
        x: [0.0; N],
        w: [0.0; N],
        to_degree: [[0.0; N]; N],
        of_node: [[0.0; 8]; N],
        p: [[0.0; N]; N],
        checks: [[[0.0; 8]; N]; 2],
    };
    for (k, check) in CHECKS.into_iter().enumerate() {
        for (table, at) in rule.checks.iter_mut().zip(check) {
            table.iter_mut().zip(polynomials(at)).for_each(|(row, p)| row[k] = p);
        }
    }
    for q in 0..N {
        (rule.x[q], rule.w[q]) = (nodes[q], weights[q]);
        let p = polynomials(nodes[q]);
        for i in 0..N {
            rule.p[i][q] = p[i];
            rule.to_degree[i][q] = (i as f64 + 0.5) * weights[q] * p[i];
            rule.of_node[q][i] = rule.to_degree[i][q];
        }
    }
    rule
});

/// P_0 … P_5 at x (Bonnet's recurrence).
#[inline(always)]
pub(super) fn polynomials(x: f64) -> Row {
    let mut p = [1.0, x, 0.0, 0.0, 0.0, 0.0];
    for k in 2..N {
        let n = k as f64;
        p[k] = ((2.0 * n - 1.0) * x * p[k - 1] - (n - 1.0) * p[k - 2]) * (1.0 / n);
    }
    p
}

/// ∫ P_i(x) · h(x) dx over [a, b] for the falling hat h = (b − x)/(b − a) and the rising one, 1 − h.
///
/// Degree 6 at most, so that N ≥ 4 Gauss nodes are exact.
pub(super) fn hats(a: f64, b: f64) -> [Row; 2] {
    let mut out = [[0.0; N]; 2];
    let half = 0.5 * (b - a);
    for q in 0..N {
        let t = RULE.x[q];
        let p = polynomials(0.5 * (a + b) + half * t);
        let w = RULE.w[q] * half;
        for i in 0..N {
            out[0][i] += w * p[i] * 0.5 * (1.0 - t);
            out[1][i] += w * p[i] * 0.5 * (1.0 + t);
        }
    }
    out
}

/// A with P_i(m + h·x) = Σ_k `A[i][k]` P_k(x).
pub(super) fn affine(m: f64, h: f64) -> Square {
    let mut a = [[0.0; N]; N];
    for q in 0..N {
        let p = polynomials(m + h * RULE.x[q]);
        for i in 0..N {
            for k in 0..=i {
                a[i][k] += RULE.to_degree[k][q] * p[i];
            }
        }
    }
    a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transform_is_exact_for_polynomials() {
        for k in 0..N {
            for i in 0..N {
                let c: f64 = (0..N).map(|q| RULE.to_degree[i][q] * polynomials(RULE.x[q])[k]).sum();
                assert!((c - f64::from(u8::from(i == k))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn affine_composes() {
        let a = affine(0.3, 0.2);
        let x = -0.7;
        let (p, direct) = (polynomials(x), polynomials(0.3 + 0.2 * x));
        for i in 0..N {
            let sum: f64 = (0..N).map(|k| a[i][k] * p[k]).sum();
            assert!((sum - direct[i]).abs() < 1e-14);
        }
    }

    #[test]
    fn hats_share_the_integral_of_a_polynomial() {
        let [fall, rise] = hats(-0.25, 0.5);
        assert!((fall[0] - 0.375).abs() < 1e-15 && (rise[0] - 0.375).abs() < 1e-15);
        assert!((fall[1] + rise[1] - 0.5 * (0.25 - 0.0625)).abs() < 1e-15);
    }
}

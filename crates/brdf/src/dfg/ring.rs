//! Quadrature over half vectors: rings of constant θ_h, and the part of each whose mirrored direction is
//! above the horizon.

use std::f64::consts::PI;
use std::sync::LazyLock;
use steradian_sphere::quadrature::gauss_legendre;

/// Nodes of a panel, and of a ring.
pub(super) const NODES: usize = 24;

/// Gauss's rule on −1 … 1.
pub(super) struct Rule {
    pub nodes: [f64; NODES],
    pub weights: [f64; NODES],
    /// cos φ at the nodes of 0 … π.
    whole: [f64; NODES],
}

pub(super) fn rule() -> &'static Rule {
    static RULE: LazyLock<Rule> = LazyLock::new(|| {
        let (x, w) = gauss_legendre(NODES);
        let nodes = std::array::from_fn(|k| x[k]);
        let weights = std::array::from_fn(|k| w[k]);
        Rule { nodes, weights, whole: nodes.map(|x| (0.5 * PI * (1.0 + x)).cos()) }
    });
    &RULE
}

impl Rule {
    /// Nodes and weights of ∫ dθ from `a` to `b`: θ = a + (b − a) sin²(π/4 (1 + x)) evens out the square
    /// roots at the ends.
    pub(super) fn panel(&self, a: f64, b: f64) -> impl Iterator<Item = (f64, f64)> + '_ {
        (0..NODES).map(move |k| {
            // 2 sin² y = 1 − cos 2y, cos(π/2 + z) = −sin z.
            let (sin, cos) = (0.5 * PI * self.nodes[k]).sin_cos();
            (a + (b - a) * 0.5 * (1.0 + sin), self.weights[k] * 0.25 * PI * (b - a) * cos)
        })
    }
}

/// Half vectors at θ_h about the normal, seen from n·wo = μ.
pub(super) struct Ring {
    pub sin: f64,
    pub cos: f64,
    /// The azimuth up to which wi is above the horizon: cos φ = −cot θ_o cot 2θ_h.
    pub end: f64,
    mu: f64,
    /// sin θ_o sin θ_h, cos θ_o cos θ_h.
    product: [f64; 2],
}

impl Ring {
    pub(super) fn new(theta: f64, mu: f64) -> Self {
        let (sin, cos) = theta.sin_cos();
        let sin_o = (1.0 - mu * mu).max(0.0).sqrt();
        let (num, den) = (-mu * (cos * cos - sin * sin), sin_o * 2.0 * sin * cos);
        let end = if den > 0.0 {
            (num / den).clamp(-1.0, 1.0).acos()
        } else if num < 0.0 {
            PI
        } else {
            0.0
        };
        Self { sin, cos, end, mu, product: [sin_o * sin, mu * cos] }
    }

    /// cos φ at the nodes of 0 … end.
    #[inline(always)]
    pub(super) fn cosines(&self, rule: &Rule) -> [f64; NODES] {
        if self.end == PI {
            return rule.whole;
        }
        // Nodes come in pairs ±x: cos(½ end (1 ± x)).
        let half = 0.5 * self.end;
        let (sin, cos) = half.sin_cos();
        let mut all = [0.0; NODES];
        for k in 0..NODES / 2 {
            let (s, c) = (half * rule.nodes[k]).sin_cos();
            all[k] = cos * c - sin * s;
            all[NODES - 1 - k] = cos * c + sin * s;
        }
        all
    }

    /// wo·h and n·wi at cos φ.
    #[inline(always)]
    pub(super) fn reflected(&self, cos_phi: f64) -> (f64, f64) {
        let u = self.product[0] * cos_phi + self.product[1];
        (u, 2.0 * u * self.cos - self.mu)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_come_in_pairs_and_rings_end_at_the_horizon() {
        let rule = rule();
        for k in 0..NODES {
            assert!((rule.nodes[k] + rule.nodes[NODES - 1 - k]).abs() < 1e-15);
        }
        for (theta, mu) in [(0.3, 0.9), (0.5, 0.4), (0.8, 0.3), (1.2, 0.05)] {
            let ring = Ring::new(theta, mu);
            assert!(ring.end > 0.0);
            for (k, c) in ring.cosines(rule).into_iter().enumerate() {
                assert!((c - (0.5 * ring.end * (1.0 + rule.nodes[k])).cos()).abs() < 1e-14);
                assert!(ring.reflected(c).1 > 0.0);
            }
            let (_, z) = ring.reflected(ring.end.cos());
            assert!(if ring.end < PI { z.abs() < 1e-12 } else { z > 0.0 }, "{theta} {mu}: {z}");
        }
        let sum: f64 = rule.panel(0.2, 1.3).map(|(theta, w)| w * theta.sin()).sum();
        assert!((sum - (0.2_f64.cos() - 1.3_f64.cos())).abs() < 1e-12);
    }
}

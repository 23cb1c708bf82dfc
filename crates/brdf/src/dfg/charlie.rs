//! The albedo of sheen.
//!
//! Estevez & Kulla 2017, Production Friendly Microfacet Sheen BRDF: D = (2 + 1/α) sin^(1/α) θ_h / 2π, and the
//! fitted Λ of their section 3.2 (V = 1/((1 + Λ(wo) + Λ(wi)) 4 n·wo n·wi)), as KHR_materials_sheen has them.
//! Neubelt & Pettineo 2013, Crafting a Next-Gen Material Pipeline for The Order: 1886: V = 1/(4 (n·wi +
//! n·wo − n·wi n·wo)), as Filament has it. E(μ) = ∫ D V n·wi dwi, F = 1.

use super::ring::{NODES, Ring, Rule, rule};
use std::f64::consts::{FRAC_PI_2, PI};

/// Visibility term of sheen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Visibility {
    /// Λ of Estevez & Kulla: glTF.
    EstevezKulla,
    /// That of Neubelt & Pettineo, as in Filament.
    Neubelt,
}

impl Visibility {
    /// V at the cosines of wo and wi, sr⁻¹.
    pub fn value(self, mu_o: f64, mu_i: f64, alpha: f64) -> f64 {
        match self {
            Self::EstevezKulla => {
                1.0 / ((1.0 + lambda(mu_o, alpha) + lambda(mu_i, alpha)) * 4.0 * mu_o * mu_i).max(1e-300)
            }
            Self::Neubelt => 1.0 / (4.0 * (mu_o + mu_i - mu_o * mu_i)).max(1e-300),
        }
    }
}

/// D of Estevez & Kulla at θ_h, sr⁻¹.
pub fn distribution(theta: f64, alpha: f64) -> f64 {
    (2.0 + 1.0 / alpha) * theta.sin().max(0.0).powf(1.0 / alpha) / (2.0 * PI)
}

/// Λ of Estevez & Kulla, their table 1 between α = 0 and α = 1.
pub fn lambda(mu: f64, alpha: f64) -> f64 {
    const ROUGH: [f64; 5] = [21.5473, 3.82987, 0.19823, -1.97760, -4.32054];
    const SMOOTH: [f64; 5] = [25.3245, 3.32435, 0.16801, -1.27393, -4.85967];
    let t = (1.0 - alpha) * (1.0 - alpha);
    let [a, b, c, d, e]: [f64; 5] = std::array::from_fn(|i| ROUGH[i] + (SMOOTH[i] - ROUGH[i]) * t);
    let l = |x: f64| a / (1.0 + b * x.powf(c)) + d * x + e;
    if mu < 0.5 { l(mu).exp() } else { (2.0 * l(0.5) - l(1.0 - mu)).exp() }
}

/// Steps of a table over n·wi, between which 1/(1 + Λ) is linear to 2e-6.
const STEPS: usize = 4096;
/// Rings of half vectors that contribute less are skipped.
const NOTHING: f64 = 1e-10;

/// E of sheen of one width.
#[derive(Debug, Clone)]
pub struct Albedo {
    alpha: f64,
    visibility: Visibility,
    /// 1/(1 + Λ) at equal steps of μ; empty where V needs none. Between them linear to 2e-6: Λ is steepest
    /// where this is next to nothing.
    shadow: Vec<f64>,
}

impl Albedo {
    /// `alpha` is clamped to 1e-4 … 1.
    pub fn new(alpha: f64, visibility: Visibility) -> Self {
        let alpha = alpha.clamp(1e-4, 1.0);
        let at = |k: usize| 1.0 / (1.0 + lambda(k as f64 / STEPS as f64, alpha));
        let shadow = match visibility {
            Visibility::EstevezKulla => (0..=STEPS).map(at).collect(),
            Visibility::Neubelt => Vec::new(),
        };
        Self { alpha, visibility, shadow }
    }

    /// E at cosine `mu` = n·wo (0 … 1); absolute error below 1e-4, mostly far below.
    pub fn at(&self, mu: f64) -> f64 {
        let (mu, alpha) = (mu.clamp(1e-6, 1.0), self.alpha);
        // θ_h at which the horizon begins to cut the circle of h, and at which it has cut all of it.
        let above = 0.5 * mu.asin();
        let end = 0.5 * (FRAC_PI_2 + mu.acos());
        let mut cuts = vec![0.0, above, end, 0.5 * (above + end), end - 0.1 * (end - above)];
        // sin^(1/α) falls from the horizon within √α.
        cuts.extend([0.5, 1.0, 2.0, 4.0, 8.0].map(|k| FRAC_PI_2 - k * alpha.sqrt()));
        cuts.extend(
            [0.1, 0.5, 2.0, 6.0, 20.0].map(|k| end - k * alpha.min(0.1) * end.tan().recip().abs().max(0.02)),
        );
        cuts.retain(|t| (0.0..=end).contains(t));
        cuts.sort_by(f64::total_cmp);
        let rule = rule();
        let lambda_o = lambda(mu, alpha);
        let mut sum = 0.0;
        for ab in cuts.windows(2) {
            for (theta, step) in rule.panel(ab[0], ab[1]) {
                let ring = Ring::new(theta, mu);
                let all = step * distribution(theta, alpha) * ring.sin * ring.end;
                // V n·wi 4 u is at most 1/n·wo.
                if all > NOTHING * mu {
                    sum += all * self.ring(&ring, rule, lambda_o, mu);
                }
            }
        }
        sum
    }

    /// The mean over the ring of V n·wi 4 wo·h, times 2: both its halves.
    fn ring(&self, ring: &Ring, rule: &Rule, lambda_o: f64, mu: f64) -> f64 {
        let cosines = ring.cosines(rule);
        let mut value = [0.0; NODES];
        match self.visibility {
            // V n·wi = 1/((1 + Λo + Λi) 4 μ), and 1/(Λo + 1/s) = s/(1 + Λo s).
            Visibility::EstevezKulla => {
                for k in 0..NODES {
                    let (u, z) = ring.reflected(cosines[k]);
                    let s = self.shadow(z);
                    value[k] = rule.weights[k] * u.max(0.0) * s / (1.0 + lambda_o * s) / mu;
                }
            }
            Visibility::Neubelt => {
                for k in 0..NODES {
                    let (u, z) = ring.reflected(cosines[k]);
                    let (u, z) = (u.max(0.0), z.max(0.0));
                    value[k] = rule.weights[k] * u * z / (mu + z - mu * z);
                }
            }
        }
        value.iter().sum()
    }

    /// 1/(1 + Λ) at μ; 0 below the horizon.
    #[inline(always)]
    fn shadow(&self, mu: f64) -> f64 {
        let x = mu.clamp(0.0, 1.0) * STEPS as f64;
        let i = (x as usize).min(STEPS - 1);
        let (a, b) = (self.shadow[i], self.shadow[i + 1]);
        if mu > 0.0 { a + (b - a) * (x - i as f64) } else { 0.0 }
    }
}

/// E at cosine `mu` = n·wo (0 … 1) and width `alpha` (1e-4 … 1), as [`Albedo`] has it.
pub fn albedo(mu: f64, alpha: f64, visibility: Visibility) -> f64 {
    Albedo::new(alpha, visibility).at(mu)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// Sum over a fine product grid of wi.
    fn brute(mu: f64, alpha: f64, v: Visibility) -> f64 {
        let wo = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
        let (n, m) = (2000, 1000);
        let mut sum = 0.0;
        for i in 0..n {
            let z = (f64::from(i) + 0.5) / f64::from(n);
            let s = (1.0 - z * z).sqrt();
            for j in 0..m {
                let phi = PI * (f64::from(j) + 0.5) / f64::from(m);
                let wi = DVec3::new(s * phi.cos(), s * phi.sin(), z);
                let h = (wi + wo).normalize();
                sum += distribution(h.x.hypot(h.y).atan2(h.z), alpha) * v.value(mu, z, alpha) * z;
            }
        }
        sum * 2.0 * PI / f64::from(n * m)
    }

    #[test]
    fn agrees_with_brute_force() {
        for v in [Visibility::EstevezKulla, Visibility::Neubelt] {
            for (mu, alpha) in [(0.05, 0.09), (0.3, 0.25), (0.7, 0.5), (0.2, 1.0), (1.0, 1.0), (0.9, 0.04)] {
                let (a, b) = (albedo(mu, alpha, v), brute(mu, alpha, v));
                assert!((a - b).abs() < 1e-4 * b.max(0.1), "{v:?} mu {mu} alpha {alpha}: {a} {b}");
            }
        }
    }

    #[test]
    fn d_is_a_distribution() {
        // ∫ D cos θ dh = 1.
        for alpha in [0.1, 0.5, 1.0] {
            let f = |(t, w): (f64, f64)| w * distribution(t, alpha) * t.cos() * t.sin() * 2.0 * PI;
            let sum: f64 = rule().panel(0.0, FRAC_PI_2).map(f).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{sum}");
        }
    }
}

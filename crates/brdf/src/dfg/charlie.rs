//! The albedo of sheen.
//!
//! Estevez & Kulla 2017, Production Friendly Microfacet Sheen BRDF: D = (2 + 1/α) sin^(1/α) θ_h / 2π, and the fitted
//! Λ of their section 3.2 (V = 1/((1 + Λ(wo) + Λ(wi)) 4 n·wo n·wi)), as KHR_materials_sheen has them. Neubelt & Pettineo
//! 2013, Crafting a Next-Gen Material Pipeline for The Order: 1886: V = 1/(4 (n·wi + n·wo − n·wi n·wo)), as Filament has
//! it. E(μ) = ∫ D V n·wi dwi, F = 1.

use super::RULE;
use super::limit;
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// How sheen shadows itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Visibility {
    /// Λ of Estevez & Kulla: glTF.
    EstevezKulla,
    /// Of Neubelt & Pettineo: Filament.
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

/// E at cosine `mu` = n·wo (0 … 1) and width `alpha` (1e-4 … 1); absolute error below 1e-4, mostly far below.
pub fn albedo(mu: f64, alpha: f64, visibility: Visibility) -> f64 {
    let (mu, alpha) = (mu.clamp(1e-6, 1.0), alpha.clamp(1e-4, 1.0));
    let wo = DVec3::new((1.0 - mu * mu).max(0.0).sqrt(), 0.0, mu);
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
    let (nodes, weights) = &*RULE;
    let mut sum = 0.0;
    for ab in cuts.windows(2) {
        for (x, w) in nodes.iter().zip(weights) {
            // θ = a + (b − a) sin²(π/4 (1 + x)) evens out the square roots at the ends.
            let angle = 0.25 * PI * (1.0 + x);
            let theta = ab[0] + (ab[1] - ab[0]) * angle.sin().powi(2);
            let step = w * 0.25 * PI * (ab[1] - ab[0]) * (2.0 * angle).sin();
            sum += step * ring(theta, wo, alpha, visibility);
        }
    }
    sum
}

/// The integral over the azimuth of h at θ_h, times sin θ_h.
fn ring(theta: f64, wo: DVec3, alpha: f64, visibility: Visibility) -> f64 {
    let (s, c) = theta.sin_cos();
    let end = limit(theta, wo);
    let d = distribution(theta, alpha);
    let (nodes, weights) = &*RULE;
    let term = |(x, w): (&f64, &f64)| {
        let phi = 0.5 * end * (1.0 + x);
        let u = wo.dot(DVec3::new(s * phi.cos(), s * phi.sin(), c));
        let mu_i = 2.0 * u * c - wo.z;
        if mu_i <= 0.0 || u <= 0.0 {
            return 0.0;
        }
        w * visibility.value(wo.z, mu_i, alpha) * mu_i * 4.0 * u
    };
    nodes.iter().zip(weights).map(term).sum::<f64>() * d * s * end
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let (x, w) = (&RULE.0, &RULE.1);
        for alpha in [0.1, 0.5, 1.0] {
            let f = |(x, w): (&f64, &f64)| {
                let t = 0.25 * PI * (1.0 + x);
                0.25 * PI * w * distribution(t, alpha) * t.cos() * t.sin() * 2.0 * PI
            };
            let sum: f64 = x.iter().zip(w).map(f).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{sum}");
        }
    }
}

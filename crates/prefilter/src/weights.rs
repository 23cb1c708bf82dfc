//! What divides a sum over texels.

use crate::legendre;
use std::f64::consts::PI;

/// Steps for each band: cubic interpolation of the highest then errs by 8e-6 of what it adds to the sum.
const STEPS: usize = 24;

/// Σ K Ω over all texels, which depends on the latitude only, or what divides the sum over texels by it.
pub(crate) struct Weights {
    /// In equal steps of θ from 0 to π.
    table: Vec<f64>,
}

impl Weights {
    /// ∫K / Σ K Ω.
    pub(crate) fn new(rows: usize, k: &[f64]) -> Self {
        let mut sums = Self::sums(rows, k);
        sums.table.iter_mut().for_each(|sum| *sum = if *sum > 0.0 { k[0] / *sum } else { 1.0 });
        sums
    }

    /// Σ K Ω itself.
    pub(crate) fn sums(rows: usize, k: &[f64]) -> Self {
        // c_l = Σ Ω P_l(cos θ_j); then Σ K Ω = Σ (2l+1)/4π k_l c_l P_l(cos θ).
        let row = |j: usize| {
            let (sin, cos) = (PI * (j as f64 + 0.5) / rows as f64).sin_cos();
            (cos, 4.0 * PI * sin * (0.5 * PI / rows as f64).sin())
        };
        let rows: Vec<(f64, f64)> = (0..rows).map(row).collect();
        let c = legendre::moments(&rows, k.len() - 1);
        let a: Vec<f64> =
            c.iter().zip(k).enumerate().map(|(l, (c, k))| (2 * l + 1) as f64 / (4.0 * PI) * k * c).collect();
        let steps = STEPS * (k.len() + 4);
        let x: Vec<f64> = (0..=steps).map(|i| (PI * i as f64 / steps as f64).cos()).collect();
        Self { table: legendre::series(&a, &x) }
    }

    /// Is the factor 1 everywhere, as far as an image's single precision sees?
    pub(crate) fn are_one(&self) -> bool {
        self.table.iter().all(|w| (w - 1.0).abs() < 1e-7)
    }

    /// The value at θ, by the cubic through four steps; beyond a pole the meridian comes back.
    pub(crate) fn at(&self, theta: f64) -> f64 {
        let last = self.table.len() - 1;
        let x = theta / PI * last as f64;
        let i = (x as usize).min(last - 1);
        let t = x - i as f64;
        let before = self.table[if i == 0 { 1 } else { i - 1 }];
        let after = self.table[if i + 2 > last { last - 1 } else { i + 2 }];
        let (here, next) = (self.table[i], self.table[i + 1]);
        let (p, q) = (t * (t - 1.0), (t + 1.0) * (t - 2.0));
        (after * (t + 1.0) - before * (t - 2.0)) * p / 6.0 + (here * (t - 1.0) - next * t) * q / 2.0
    }
}

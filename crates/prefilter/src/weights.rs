//! What divides a sum over texels.

use crate::legendre;
use std::f64::consts::PI;

/// Σ K Ω over all texels, which depends on the latitude only: what divides the sum over texels.
pub(crate) struct Weights {
    /// ∫K / Σ K Ω in equal steps of θ from 0 to π.
    table: Vec<f64>,
}

impl Weights {
    pub(crate) fn new(rows: usize, k: &[f64]) -> Self {
        // c_l = Σ Ω P_l(cos θ_j); then Σ K Ω = Σ (2l+1)/4π k_l c_l P_l(cos θ).
        let row = |j: usize| {
            let (sin, cos) = (PI * (j as f64 + 0.5) / rows as f64).sin_cos();
            (cos, 4.0 * PI * sin * (0.5 * PI / rows as f64).sin())
        };
        let rows: Vec<(f64, f64)> = (0..rows).map(row).collect();
        let c = legendre::moments(&rows, k.len() - 1);
        let a: Vec<f64> =
            c.iter().zip(k).enumerate().map(|(l, (c, k))| (2 * l + 1) as f64 / (4.0 * PI) * k * c).collect();
        let steps = 4 * k.len() + 16;
        let x: Vec<f64> = (0..=steps).map(|i| (PI * i as f64 / steps as f64).cos()).collect();
        let weight = |sum: f64| if sum > 0.0 { k[0] / sum } else { 1.0 };
        Self { table: legendre::series(&a, &x).into_iter().map(weight).collect() }
    }

    /// The factor at θ.
    pub(crate) fn at(&self, theta: f64) -> f64 {
        let x = theta / PI * (self.table.len() - 1) as f64;
        let i = (x as usize).min(self.table.len() - 2);
        self.table[i] + (self.table[i + 1] - self.table[i]) * (x - i as f64)
    }
}

//! A profile made ready for many lookups by the cosine of the angle.

use super::rings::{Curve, NODES};
use std::f64::consts::{FRAC_PI_2, PI, SQRT_2};

/// Steps of √(1 − x) over 0 … √2 in the table that finds a panel: 5e-4 radians near the axis, and 8 kB, a
/// quarter of the first cache.
const TABLE_STEPS: usize = 4096;

/// A [`Curve`] over x = cos ψ: no search, no inverse trigonometric function.
#[derive(Debug, Clone, PartialEq)]
pub struct ByCosine {
    /// Per panel: middle, 1/half width, end.
    panels: Vec<[f64; 3]>,
    /// Powers 0 … 7 of z of each panel.
    powers: Vec<[f64; NODES]>,
    /// The panel at the beginning of each step.
    first: Vec<u16>,
    /// The curve is zero below this x.
    least: f64,
}

impl ByCosine {
    /// The curve's own polynomials.
    pub fn new(curve: &Curve) -> Self {
        let panel = |e: &[f64]| [0.5 * (e[0] + e[1]), 2.0 / (e[1] - e[0]), e[1]];
        let panels: Vec<_> = curve.edges().windows(2).map(panel).collect();
        let angle = |i: usize| 2.0 * (i as f64 / TABLE_STEPS as f64).min(1.0).asin();
        let place = |psi: f64| panels.partition_point(|p| p[2] <= psi).min(panels.len().max(1) - 1) as u16;
        Self {
            first: (0..=TABLE_STEPS).map(|i| place(angle(i))).collect(),
            powers: curve.terms().iter().map(powers).collect(),
            panels,
            least: curve.support().cos(),
        }
    }

    /// The value where cos ψ = `x`.
    #[inline]
    pub fn at(&self, x: f64) -> f64 {
        if x < self.least || self.powers.is_empty() {
            return 0.0;
        }
        let s = (1.0 - x).clamp(0.0, 2.0).sqrt();
        let psi = if x >= 0.0 { s * arc(x.min(1.0)) } else { PI - (1.0 + x).max(0.0).sqrt() * arc(-x) };
        let mut k = usize::from(self.first[(s * (TABLE_STEPS as f64 / SQRT_2)) as usize]);
        while k + 1 < self.panels.len() && psi > self.panels[k][2] {
            k += 1;
        }
        let ([middle, scale, _], c) = (self.panels[k], &self.powers[k]);
        let z = (psi - middle) * scale;
        let mut sum = c[NODES - 1];
        for l in (0..NODES - 1).rev() {
            sum = sum * z + c[l];
        }
        sum
    }
}

/// arccos(x)/√(1 − x) within 2e-8 for 0 ≤ x ≤ 1: Abramowitz & Stegun 1964, Handbook of Mathematical
/// Functions, 4.4.46.
#[inline]
fn arc(x: f64) -> f64 {
    const A: [f64; 7] = [
        -0.214_598_801_6,
        0.088_978_987_4,
        -0.050_174_304_6,
        0.030_891_881_0,
        -0.017_088_125_6,
        0.006_670_090_1,
        -0.001_262_491_1,
    ];
    let mut sum = A[6];
    for k in (0..6).rev() {
        sum = sum * x + A[k];
    }
    FRAC_PI_2 + x * sum
}

/// Σ c_l P_l(z) by powers of z.
fn powers(c: &[f64; NODES]) -> [f64; NODES] {
    let (mut before, mut now) = ([0.0; NODES], [0.0; NODES]);
    now[0] = 1.0;
    let mut out = [0.0; NODES];
    for (l, c) in c.iter().enumerate() {
        (0..NODES).for_each(|k| out[k] += c * now[k]);
        // (l + 1) P_{l+1} = (2l + 1) z P_l − l P_{l−1}.
        let n = l as f64;
        let next = |k: usize| {
            let shifted = if k > 0 { now[k - 1] } else { 0.0 };
            ((2.0 * n + 1.0) * shifted - n * before[k]) / (n + 1.0)
        };
        (before, now) = (now, std::array::from_fn(next));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::super::Rings;
    use super::*;

    #[test]
    fn it_is_the_curve() {
        for width in [1e-5, 0.01, 0.3, 1.0] {
            let rings = Rings::graded(width);
            let lobe = |psi: &f64| {
                let t = psi / width;
                if *psi < 2.5 { (1.0 + t * t).powi(-2) - 1e-3 * psi.cos() } else { 0.0 }
            };
            let values: Vec<f64> = rings.angles().iter().map(lobe).collect();
            let curve = rings.curve(&values);
            let ready = ByCosine::new(&curve);
            for k in 0..=20_000 {
                // Dense near the axis.
                let psi = PI * (f64::from(k) / 20_000.0).powi(4);
                let (x, want) = (psi.cos(), curve.at(psi));
                // cos ψ has no more digits of ψ than this.
                let slack = (3e-16 / psi.max(1e-12)).min(3e-8) / width + 1e-6;
                assert!((ready.at(x) - want).abs() < slack, "{width} {psi}: {} {want}", ready.at(x));
            }
            assert!(ready.at(-1.0).abs() < 1e-9);
        }
    }
}

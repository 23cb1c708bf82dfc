//! A sharp kernel in two parts: K = K χ + K (1 − χ), with χ a smooth step from 1 at the centre to 0 outwards.
//!
//! K χ reaches a few texels and is summed directly; K (1 − χ) is as smooth as χ, however sharp K is, and goes through
//! frequency space.

use crate::Zonal;
use crate::kernel::quadrature;

/// The two parts.
pub(crate) struct Split<'a> {
    kernel: &'a dyn Zonal,
    /// Where χ = ½, radians.
    middle: f64,
    /// χ = erfc((θ − middle)/width)/2.
    width: f64,
    /// χ over chord², from 0 to `reach`².
    table: Vec<f64>,
    reach2: f64,
}

impl<'a> Split<'a> {
    /// Splits so that the smooth part is within 1e-5 with bands up to `order`.
    pub fn new(kernel: &'a dyn Zonal, order: usize) -> Self {
        // The spectrum of an erfc step of width w falls like exp(−(l w)²/4).
        let width = 6.8 / order.max(16) as f64;
        let middle = 3.0 * width;
        let reach2 = (middle + 3.0 * width).powi(2);
        let mut split = Self { kernel, middle, width, table: Vec::new(), reach2 };
        const STEPS: usize = 4096;
        split.table = (0..STEPS + 2)
            .map(|k| split.step(2.0 * (0.5 * (reach2 * k as f64 / STEPS as f64).sqrt()).min(1.0).asin()))
            .collect();
        split
    }

    /// Chord² beyond which the near part is zero.
    pub fn reach2(&self) -> f64 {
        self.reach2
    }

    /// The angle beyond which the near part is zero.
    pub fn reach(&self) -> f64 {
        2.0 * (0.5 * self.reach2.sqrt()).min(1.0).asin()
    }

    /// χ at angle θ, 0 beyond the reach.
    fn step(&self, theta: f64) -> f64 {
        0.5 * erfc((theta - self.middle) / self.width)
    }

    /// K χ at chord² `c2` ≤ reach².
    pub fn near(&self, c2: f64) -> f64 {
        let x = c2 / self.reach2 * (self.table.len() - 2) as f64;
        let i = (x as usize).min(self.table.len() - 2);
        let t = x - i as f64;
        let chi = self.table[i] + (self.table[i + 1] - self.table[i]) * t;
        self.kernel.value(1.0 - 0.5 * c2) * chi
    }

    /// K (1 − χ) at x = cos θ.
    pub fn far_value(&self, x: f64) -> f64 {
        let c2 = (2.0 * (1.0 - x)).max(0.0);
        let whole = self.kernel.value(x);
        if c2 >= self.reach2 { whole } else { whole - self.near(c2) }
    }

    /// Coefficients of K (1 − χ).
    pub fn far(&self, order: usize) -> Vec<f64> {
        quadrature(|x| self.far_value(x), self.kernel.width().min(self.width), self.kernel.support(), order)
    }
}

/// Abramowitz & Stegun 7.1.26, absolute error 1.5e-7: both parts use the same function, so only smoothness counts.
fn erfc(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.3275911 * x.abs());
    let p = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429))));
    let e = p * (-x * x).exp();
    if x < 0.0 { 2.0 - e } else { e }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lobe;

    #[test]
    fn the_parts_add_up_and_the_far_one_is_smooth() {
        for alpha in [1e-4, 1e-3, 5e-3] {
            let k = Lobe::ggx(alpha);
            let split = Split::new(&k, 500);
            let far = split.far(600);
            // ∫ K χ by quadrature of its own.
            let near = quadrature(|x| split.near((2.0 * (1.0 - x)).max(0.0)), alpha, split.reach(), 0)[0];
            assert!((near + far[0] - 1.0).abs() < 1e-5, "{alpha}: {near} {}", far[0]);
            assert!(far[500..].iter().all(|k| k.abs() < 3e-5), "{alpha}: {:e}", far[500]);
        }
    }
}

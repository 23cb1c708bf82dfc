//! Integrals of cosⁿ over intervals.

use crate::math::positive_pow;
use std::f64::consts::FRAC_PI_2;

/// Intervals of the table: values between them are off by 2e-13 of the whole tail, and by 2e-8 of themselves
/// where it is 1e-18.
const STEPS: usize = 256;

/// Q(x) = ∫ₓ^{π/2} cosᵐ t dt for one exponent n: a table for the m = n + 2k ≥ 8 at equal steps of x up to
/// where cosᵐ is 1e-18 (or π/2), read by quintic Hermite interpolation, and k steps of (m + 1) Q_m = (m + 2)
/// Q_{m+2} + cosᵐ⁺¹x sin x down to n. Tails are kept to a relative error.
#[derive(Debug, Clone)]
pub struct CosinePower {
    n: f64,
    /// The tabulated exponent.
    m: f64,
    step: f64,
    /// Q, Q′ and Q″ at the steps, the derivatives in units of the step.
    table: Vec<[f64; 3]>,
    /// The tail from 0, of cosⁿ and of cosⁿ cos 2x.
    whole: [f64; 2],
}

impl CosinePower {
    /// For cosⁿ, n ≥ 0.
    pub fn new(n: f64) -> Self {
        let m = n + 2.0 * (0.5 * (8.0 - n)).ceil().max(0.0);
        let step = (2.0 * 41.5 / (m + 1.0)).sqrt().min(FRAC_PI_2) / STEPS as f64;
        let (nodes, weights) = steradian_sphere::quadrature::gauss_legendre(8);
        let f = |x: f64| positive_pow(x.cos(), m);
        let mut sum = 0.0;
        let mut table = vec![[0.0; 3]; STEPS + 1];
        for (k, entry) in table.iter_mut().enumerate().rev() {
            let x = k as f64 * step;
            if k < STEPS {
                let part = |(t, w): (&f64, &f64)| w * f(x + 0.5 * step * (1.0 + t));
                sum += 0.5 * step * nodes.iter().zip(&weights).map(part).sum::<f64>();
            }
            let bend = m * x.sin() * positive_pow(x.cos(), m - 1.0);
            *entry = [sum, -f(x) * step, bend * step * step];
        }
        let mut made = Self { n, m, step, table, whole: [0.0; 2] };
        let [even, twice, _] = made.tail(0.0);
        made.whole = [even, twice];
        made
    }

    /// For the twin on a GPU: (n, m, step), the tails from 0, and the table.
    pub fn plain(&self) -> ([[f64; 3]; 2], &[[f64; 3]]) {
        ([[self.n, self.m, self.step], [self.whole[0], self.whole[1], 0.0]], &self.table)
    }

    /// Q_m at 0 ≤ x.
    fn tabulated(&self, x: f64) -> f64 {
        let u = x / self.step;
        let k = u as usize;
        if k >= STEPS {
            return 0.0;
        }
        let ([a, da, dda], [b, db, ddb]) = (self.table[k], self.table[k + 1]);
        let t = u - k as f64;
        // a + da t + ½ dda t² and the remainder r0, r1, r2 of value, slope and curvature at t = 1.
        let (r0, r1, r2) = (b - a - da - 0.5 * dda, db - da - dda, ddb - dda);
        let c3 = 10.0 * r0 - 4.0 * r1 + 0.5 * r2;
        let c4 = -15.0 * r0 + 7.0 * r1 - r2;
        let c5 = 6.0 * r0 - 3.0 * r1 + 0.5 * r2;
        a + t * (da + t * (0.5 * dda + t * (c3 + t * (c4 + t * c5))))
    }

    /// ∫ₓ^{π/2} of cosⁿ, cosⁿ cos 2t and cosⁿ sin 2t, 0 ≤ x.
    fn tail(&self, x: f64) -> [f64; 3] {
        if x >= FRAC_PI_2 {
            return [0.0; 3];
        }
        let (s, c) = x.sin_cos();
        let (n, c1) = (self.n, positive_pow(c, self.n + 1.0));
        let (mut even, mut power) = (self.tabulated(x), self.m);
        while power > n + 0.5 {
            power -= 2.0;
            even = ((power + 2.0) * even + positive_pow(c, power + 1.0) * s) / (power + 1.0);
        }
        // cos 2t = 2 cos² − 1, and ∫ 2 cosⁿ⁺¹ sin.
        [even, (n * even - 2.0 * c1 * s) / (n + 2.0), 2.0 * c1 * c / (n + 2.0)]
    }

    /// ∫ from `lo` to `hi` of cosⁿ, cosⁿ cos 2x and cosⁿ sin 2x; the power counts as 0 beyond ±π/2.
    pub fn integrals(&self, lo: f64, hi: f64) -> [f64; 3] {
        let (a, b) = (self.tail(lo.abs()), self.tail(hi.abs()));
        let even = |c: usize| match (lo < 0.0, hi < 0.0) {
            (false, false) => a[c] - b[c],
            (true, true) => b[c] - a[c],
            (true, false) => 2.0 * self.whole[c] - a[c] - b[c],
            (false, true) => a[c] + b[c] - 2.0 * self.whole[c],
        };
        [even(0), even(1), a[2] - b[2]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn closed_forms() {
        for x in [-1.5, -0.4, 0.0, 0.1, 0.9, 1.4, FRAC_PI_2, 2.0] {
            let y: f64 = f64::clamp(x, -FRAC_PI_2, FRAC_PI_2);
            let (s, c) = y.sin_cos();
            // F₁ = sin, F₂ = (y + s c)/2, F₀ = y, F₃ = s − s³/3.
            for (n, exact) in [(0.0, y), (1.0, s), (2.0, 0.5 * (y + s * c)), (3.0, s - s.powi(3) / 3.0)] {
                let got = CosinePower::new(n).integrals(0.0, x)[0];
                assert!((got - exact).abs() < 1e-12, "{n} {x}: {got} {exact}");
            }
        }
    }

    #[test]
    fn any_exponent() {
        let (nodes, weights) = steradian_sphere::quadrature::gauss_legendre(64);
        for n in [0.5, 4.7, 50.0, 200.0, 1e5] {
            let powers = CosinePower::new(n);
            // Within π/2 for the smallest n.
            let sigma = 0.7 * (1.0 / (n + 1.0)).sqrt();
            for (lo, hi) in [(-1.2, 0.3), (0.1, 0.35), (-0.5, -0.4), (-2.0, 1.1)] {
                let (lo, hi) = (lo * sigma, hi * sigma);
                let sum = |g: fn(f64) -> f64| -> f64 {
                    let at = |(t, w): (&f64, &f64)| {
                        let x = 0.5 * (lo + hi) + 0.5 * (hi - lo) * t;
                        w * x.cos().powf(n) * g(2.0 * x)
                    };
                    0.5 * (hi - lo) * nodes.iter().zip(&weights).map(at).sum::<f64>()
                };
                let got = powers.integrals(lo, hi);
                let exact = [sum(|_| 1.0), sum(f64::cos), sum(f64::sin)];
                for (a, b) in got.into_iter().zip(exact) {
                    assert!((a - b).abs() < 1e-11 * sigma, "{n} {lo} {hi}: {a} {b}");
                }
            }
        }
    }
}

//! A spherical Gaussian swept along its great circle: the stretched lobe.
//!
//! With m(t) the mean moved by t along the plane of n and wo and Von Mises's density of concentration κ = 1/s² over t,
//!
//! **G_σ,s(d) = ∫ e^(κ cos t)/(2π I₀(κ)) G_σ(m(t), d) dt = c(λ) e^(−λ) I₀(R)/I₀(κ)**,
//! R² = κ² + λ² (1 − y²) + 2κλ m·d,
//!
//! with λ = 1/σ², c the factor of G_σ and y the component of d across the plane. Its integral is 1, as that of every Gaussian
//! that it sweeps; s = 0 is the round one; narrow ones have the width σ across and √(σ² + s²) along. Filtered light is a
//! sum of lookups at width σ along the circle.

use super::density;
use glam::DVec3;
use steradian_simd::{Arch, Kernel};

/// Values below e^−40 of the peak are 0.
const TAIL: f64 = -40.0;

/// I₀(x) e^(−x), x ≥ 0, to 2e-7 (Abramowitz & Stegun 9.8.1, 9.8.2).
fn bessel0(x: f64) -> f64 {
    if x > 15.0 {
        far_bessel0(x.recip())
    } else if x < 3.75 {
        let t = (x / 3.75) * (x / 3.75);
        let p = polynomial(
            t,
            &[1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3],
        );
        p * (-x).exp()
    } else {
        let p = polynomial(
            3.75 / x,
            &[
                0.398_942_28,
                0.013_285_92,
                0.002_253_19,
                -0.001_575_65,
                0.009_162_81,
                -0.020_577_06,
                0.026_355_37,
                -0.016_476_33,
                0.003_923_77,
            ],
        );
        p / x.sqrt()
    }
}

/// 1 − I₁(x)/I₀(x), x ≥ 0: by the ratio's own asymptotic series where it is small.
fn lag(x: f64) -> f64 {
    if x > 15.0 {
        return far_lag(x.recip());
    }
    let first = if x < 3.75 {
        let t = (x / 3.75) * (x / 3.75);
        let p = polynomial(
            t,
            &[0.5, 0.878_905_94, 0.514_988_69, 0.150_849_34, 0.026_587_33, 0.003_015_32, 0.000_324_11],
        );
        p * x * (-x).exp()
    } else {
        let p = polynomial(
            3.75 / x,
            &[
                0.398_942_28,
                -0.039_880_24,
                -0.003_620_18,
                0.001_638_01,
                -0.010_315_55,
                0.022_829_67,
                -0.028_953_12,
                0.017_876_54,
                -0.004_200_59,
            ],
        );
        p / x.sqrt()
    };
    1.0 - first / bessel0(x)
}

fn polynomial(t: f64, c: &[f64]) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * t + c)
}

/// The mean cosine of Von Mises's density of concentration 1/s²: how far a sweep shortens the mean.
pub fn mean_cosine(sweep: f64) -> f64 {
    if sweep > 0.0 { 1.0 - lag((sweep * sweep).recip()) } else { 1.0 }
}

/// One lobe, ready to be evaluated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Swept {
    /// m.
    pub mean: DVec3,
    /// dm/dγ: along the plane, away from n.
    turned: DVec3,
    lambda: f64,
    /// κ, and 1/I₀(κ) scaled; `None` for a round lobe.
    sweep: Option<(f64, f64, f64)>,
    peak: f64,
    /// d ln c/dλ.
    slope: f64,
}

impl Swept {
    /// The mean at polar angle `gamma` beyond n, away from wo, which lies at positive x; widths in radians.
    pub fn new(gamma: f64, sigma: f64, sweep: f64) -> Self {
        let lambda = (sigma * sigma).recip();
        let (s, c) = gamma.sin_cos();
        // Below a hundredth of σ a sweep changes nothing.
        let swept = (sweep > 0.01 * sigma).then(|| {
            let kappa = (sweep * sweep).recip();
            (kappa, bessel0(kappa).recip(), lag(kappa))
        });
        Self {
            mean: DVec3::new(-s, 0.0, c),
            turned: DVec3::new(-c, 0.0, -s),
            lambda,
            sweep: swept,
            peak: density(sigma),
            slope: sigma * sigma - 2.0 / (2.0 * lambda).exp_m1(),
        }
    }

    /// Per steradian.
    pub fn value(&self, d: DVec3) -> f64 {
        let below = 0.5 * (d - self.mean).length_squared();
        let lambda = self.lambda;
        let Some((kappa, scale, _)) = self.sweep else {
            let e = -lambda * below;
            return if e > TAIL { self.peak * e.exp() } else { 0.0 };
        };
        let (r, e) = self.radius(d, below, kappa);
        if e > TAIL { self.peak * e.exp() * bessel0(r) * scale } else { 0.0 }
    }

    /// R, and R − κ − λ without cancellation.
    fn radius(&self, d: DVec3, below: f64, kappa: f64) -> (f64, f64) {
        let (lambda, whole) = (self.lambda, kappa + self.lambda);
        let short = lambda * (lambda * d.y * d.y + 2.0 * kappa * below);
        let r = (whole * whole - short).max(0.0).sqrt();
        (r, -short / (r + whole))
    }

    /// What [`Self::slopes`] gives at each point, as far as `out` has places, times the roots of the solid angles.
    pub fn columns(&self, d: &[DVec3], root: &[f64], out: &mut [Vec<f64>]) {
        out.iter_mut().for_each(|to| to.resize(d.len(), 0.0));
        let mut done = 0;
        if self.sweep.is_none_or(|(kappa, ..)| kappa + self.lambda > 15.0 - TAIL) {
            let (groups, roots) = (d.as_chunks::<LANES>().0, root.as_chunks::<LANES>().0);
            done = groups.len() * LANES;
            steradian_simd::run(Columns { lobe: *self, d: groups, root: roots, out });
        }
        for i in done..d.len() {
            for (to, v) in out.iter_mut().zip(self.slopes(d[i])) {
                to[i] = v * root[i];
            }
        }
    }

    /// The value, and its derivatives by γ, ln σ and ln s.
    pub fn slopes(&self, d: DVec3) -> [f64; 4] {
        let below = 0.5 * (d - self.mean).length_squared();
        let (lambda, along) = (self.lambda, d.dot(self.turned));
        let Some((kappa, scale, lag_kappa)) = self.sweep else {
            let e = -lambda * below;
            if e <= TAIL {
                return [0.0; 4];
            }
            let value = self.peak * e.exp();
            return [value, value * lambda * along, -2.0 * lambda * value * (self.slope - below), 0.0];
        };
        let (r, e) = self.radius(d, below, kappa);
        if e <= TAIL {
            return [0.0; 4];
        }
        let value = self.peak * e.exp() * bessel0(r) * scale;
        let inverse = r.max(1e-12).recip();
        let ratio = 1.0 - lag(r);
        let cosine = 1.0 - below;
        // ∂R/∂λ − 1 and ∂R/∂κ − 1.
        let across = d.y * d.y;
        let by_lambda = (lambda * (1.0 - across) + kappa * cosine) * inverse;
        let lean = -(lambda * along) * (lambda * along) * inverse / (r + kappa + lambda * cosine).max(1e-12);
        let by_kappa = ratio * (1.0 + lean) - 1.0 + lag_kappa;
        [
            value,
            value * ratio * kappa * lambda * inverse * along,
            -2.0 * lambda * value * (self.slope - 1.0 + ratio * by_lambda),
            -2.0 * kappa * value * by_kappa,
        ]
    }
}

/// Points at a time.
const LANES: usize = 8;

/// The value and its derivatives of a lobe so narrow that R > 15 wherever the value counts, times roots of solid angles, for the
/// points of whole groups of lanes.
struct Columns<'a> {
    lobe: Swept,
    d: &'a [[DVec3; LANES]],
    root: &'a [[f64; LANES]],
    out: &'a mut [Vec<f64>],
}

impl Kernel for Columns<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Swept { mean, turned, lambda, sweep, peak, slope } = self.lobe;
        let (kappa, scale, lag_kappa) = sweep.unwrap_or((1e8, 1.0, 0.0));
        let round = sweep.is_none();
        for (i, (d, root)) in self.d.iter().zip(self.root).enumerate() {
            let mut values = [[0.0; LANES]; 4];
            let x: [f64; LANES] = std::array::from_fn(|k| d[k].x);
            let y: [f64; LANES] = std::array::from_fn(|k| d[k].y);
            let z: [f64; LANES] = std::array::from_fn(|k| d[k].z);
            for k in 0..LANES {
                let (p, q) = (x[k] - mean.x, z[k] - mean.z);
                let below = 0.5 * (p * p + y[k] * y[k] + q * q);
                let along = x[k] * turned.x + z[k] * turned.z;
                let across = y[k] * y[k];
                let whole = kappa + lambda;
                let short = lambda * (lambda * across + 2.0 * kappa * below);
                let r = (whole * whole - short).max(225.0).sqrt();
                let inverse = 1.0 / r;
                let e = if round { -lambda * below } else { -short / (r + whole) };
                let root = if e > TAIL { root[k] } else { 0.0 };
                let bessel = if round { 1.0 } else { far_bessel0(inverse) * scale };
                let value = peak * exp(e.max(-60.0)) * bessel * root;
                let ratio = 1.0 - far_lag(inverse);
                let cosine = 1.0 - below;
                let by_lambda = (lambda * (1.0 - across) + kappa * cosine) * inverse;
                let aside = lambda * along;
                let lean = -aside * aside * inverse / (r + kappa + lambda * cosine).max(1e-12);
                let by_kappa = ratio * (1.0 + lean) - 1.0 + lag_kappa;
                values[0][k] = value;
                values[1][k] = value * aside * if round { 1.0 } else { ratio * kappa * inverse };
                values[2][k] = -2.0
                    * lambda
                    * value
                    * if round { slope - below } else { slope - 1.0 + ratio * by_lambda };
                values[3][k] = if round { 0.0 } else { -2.0 * kappa * value * by_kappa };
            }
            for (to, values) in self.out.iter_mut().zip(values) {
                to[i * LANES..(i + 1) * LANES].copy_from_slice(&values);
            }
        }
    }
}

/// [`bessel0`] of 1/t, t < 1/15.
#[inline(always)]
fn far_bessel0(t: f64) -> f64 {
    // 1/√(2π) (1 + t/8 + 9 t²/128 + …).
    let p = 1.0
        + t * (0.125 + t * (9.0 / 128.0 + t * (225.0 / 3072.0 + t * (11_025.0 / 98_304.0 + t * 0.227_108))));
    0.398_942_280_401_432_7 * p * t.sqrt()
}

/// [`lag`] of 1/t, t < 1/15.
#[inline(always)]
fn far_lag(t: f64) -> f64 {
    t * (0.5 + t * (0.125 + t * (0.125 + t * (25.0 / 128.0 + t * (13.0 / 32.0 + t * (1073.0 / 1024.0))))))
}

/// e^x for −60 ≤ x ≤ 0, to 1e-13, without branches.
#[inline(always)]
fn exp(x: f64) -> f64 {
    // Added, it leaves the nearest whole number in the lowest bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    let n = x * std::f64::consts::LOG2_E + ROUND;
    let whole = n - ROUND;
    let f = (x - whole * 0.693_147_180_369_123_8) - whole * 1.908_214_929_270_587_7e-10;
    let p = 1.0 / 39_916_800.0;
    let p = 1.0 / 3_628_800.0 + f * p;
    let p = 1.0 / 362_880.0 + f * p;
    let p = 1.0 / 40_320.0 + f * p;
    let p = 1.0 / 5040.0 + f * p;
    let p = 1.0 / 720.0 + f * p;
    let p = 1.0 / 120.0 + f * p;
    let p = 1.0 / 24.0 + f * p;
    let p = 1.0 / 6.0 + f * p;
    let p = 1.0 + f * (1.0 + f * (0.5 + f * p));
    f64::from_bits(p.to_bits().wrapping_add(n.to_bits() << 52))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn directions(n: usize) -> impl Iterator<Item = DVec3> {
        (0..n).map(move |k| {
            let z = 1.0 - (2 * k + 1) as f64 / n as f64;
            let (s, c) = (PI * (1.0 + 5f64.sqrt()) * k as f64).sin_cos();
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * c, r * s, z)
        })
    }

    /// The closed form is the integral that it stands for, and has integral 1.
    #[test]
    fn a_swept_gaussian_is_the_mean_of_its_gaussians() {
        for (sigma, sweep) in [(0.1, 0.3), (0.3, 0.1), (0.5, 0.9), (0.2, 0.05), (1.0, 1.0)] {
            let lobe = Swept::new(0.7, sigma, sweep);
            let kappa = f64::powi(sweep, -2);
            let sum = |d: DVec3| {
                let (mut sum, mut all) = (0.0, 0.0);
                for k in 0..2000 {
                    let t = PI * (f64::from(k) + 0.5) / 1000.0;
                    let w = (kappa * (t.cos() - 1.0)).exp();
                    sum += w * Swept::new(0.7 + t, sigma, 0.0).value(d);
                    all += w;
                }
                sum / all
            };
            let top = lobe.value(lobe.mean);
            for d in directions(40) {
                let (a, b) = (lobe.value(d), sum(d));
                assert!((a - b).abs() < 1e-6 * top, "{sigma} {sweep}: {a} {b}");
            }
            let n = 200_000;
            let whole = directions(n).map(|d| lobe.value(d)).sum::<f64>() * 4.0 * PI / n as f64;
            assert!((whole - 1.0).abs() < 1e-5, "{sigma} {sweep}: {whole}");
        }
    }

    #[test]
    fn slopes_are_derivatives() {
        for (sigma, sweep) in [(0.1, 0.3), (0.02, 0.01), (0.5, 0.9), (0.3, 0.0), (0.004, 0.05)] {
            for k in 0..12 {
                let (s, c) = (0.7 + sigma * (0.3 * f64::from(k) - 2.0)).sin_cos();
                let d = DVec3::new(-s, 0.5 * sigma, c).normalize();
                let at =
                    |g: f64, a: f64, b: f64| Swept::new(0.7 + g, sigma * a.exp(), sweep * b.exp()).value(d);
                let h = 1e-4;
                let lobe = Swept::new(0.7, sigma, sweep);
                let [value, g, a, b] = lobe.slopes(d);
                assert_eq!(value, lobe.value(d));
                let top = lobe.value(lobe.mean);
                let step = h * sigma;
                let wants = [
                    (g * sigma, (at(step, 0.0, 0.0) - at(-step, 0.0, 0.0)) / (2.0 * h)),
                    (a, (at(0.0, h, 0.0) - at(0.0, -h, 0.0)) / (2.0 * h)),
                    (b, (at(0.0, 0.0, h) - at(0.0, 0.0, -h)) / (2.0 * h)),
                ];
                for (i, (got, want)) in wants.into_iter().enumerate() {
                    assert!((got - want).abs() < 1e-4 * top, "{sigma} {sweep} {k} {i}: {got} {want}");
                }
            }
        }
    }

    /// Groups of lanes have what single points have.
    #[test]
    fn columns_are_the_slopes() {
        let d: Vec<DVec3> = directions(1003).collect();
        let root: Vec<f64> = (0..d.len()).map(|k| 1.0 + k as f64 / 500.0).collect();
        for (sigma, sweep) in [(0.1, 0.3), (0.02, 0.01), (0.5, 0.9), (0.3, 0.0), (0.12, 0.001), (0.05, 1.0)] {
            let lobe = Swept::new(0.7, sigma, sweep);
            let mut out: [Vec<f64>; 4] = Default::default();
            lobe.columns(&d, &root, &mut out);
            let top = lobe.value(lobe.mean);
            for (i, d) in d.iter().enumerate() {
                let want = lobe.slopes(*d);
                for c in 0..4 {
                    let scale = top * [1.0, 1.0 / sigma, 1.0, 1.0][c] * root[i];
                    let (got, want) = (out[c][i], want[c] * root[i]);
                    assert!((got - want).abs() < 1e-6 * scale, "{sigma} {sweep} {i} {c}: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn mean_cosines_are_those_of_the_density() {
        for sweep in [0.05, 0.2, 0.28, 0.5, 1.0f64] {
            let kappa = sweep.powi(-2);
            let (mut sum, mut all) = (0.0, 0.0);
            for k in 0..100_000 {
                let t = PI * (f64::from(k) + 0.5) / 100_000.0;
                let w = (kappa * (t.cos() - 1.0)).exp();
                sum += w * (1.0 - t.cos());
                all += w;
            }
            let got = 1.0 - mean_cosine(sweep);
            assert!((got / (sum / all) - 1.0).abs() < 1e-5, "{sweep}: {got} {}", sum / all);
        }
    }
}

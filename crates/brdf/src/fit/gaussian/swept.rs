//! A spherical Gaussian swept along a great circle through its mean: the stretched lobe.
//!
//! With m(t) the mean moved by t along the circle (that of n and wo where reflectance is isotropic) and Von
//! Mises's density of concentration κ = 1/s² over t,
//!
//! **G_σ,s(d) = ∫ e^(κ cos t)/(2π I₀(κ)) G_σ(m(t), d) dt = c(λ) e^(−λ) I₀(R)/I₀(κ)**,
//! R² = κ² + λ² (1 − y²) + 2κλ m·d,
//!
//! with λ = 1/σ², c the factor of G_σ and y the component of d across the plane. Its integral is 1, as that
//! of every Gaussian that it sweeps; s = 0 is the round one; narrow ones have the width σ across and √(σ² +
//! s²) along. Filtered light is a sum of lookups at width σ along the circle.

use super::density;
use glam::DVec3;
use steradian_simd::{Arch, Kernel};

/// ln of the part of the peak below which values are 0: e^−40 is 4e-18, below the rounding of doubles. e^−20
/// and e^−80 give the same errors of fits to four digits.
const LN_TAIL: f64 = -40.0;

/// Polynomials of Abramowitz & Stegun 9.8.1 to 9.8.4: below [`JOIN`] I₀ and I₁/x in (x/3.75)², beyond it √x
/// e^(−x) I₀ and √x e^(−x) I₁ in 3.75/x.
const NEAR: [[f64; 7]; 2] = [
    [1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3],
    [0.5, 0.878_905_94, 0.514_988_69, 0.150_849_34, 0.026_587_33, 0.003_015_32, 0.000_324_11],
];
const BEYOND: [[f64; 9]; 2] = [
    [
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
    [
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
];
/// Where these polynomials meet.
const JOIN: f64 = 3.75;
/// From here on asymptotic series serve ([`far_bessel0`], [`far_lag`]).
const FAR: f64 = 15.0;

/// I₀(x) e^(−x), x ≥ 0, to 2e-7.
fn bessel0(x: f64) -> f64 {
    if x > FAR {
        far_bessel0(x.recip())
    } else if x < JOIN {
        polynomial((x / JOIN) * (x / JOIN), &NEAR[0]) * (-x).exp()
    } else {
        polynomial(JOIN / x, &BEYOND[0]) / x.sqrt()
    }
}

/// 1 − I₁(x)/I₀(x), x ≥ 0: by the ratio's own asymptotic series where it is small.
fn lag(x: f64) -> f64 {
    if x > FAR {
        far_lag(x.recip())
    } else if x < JOIN {
        let t = (x / JOIN) * (x / JOIN);
        1.0 - x * polynomial(t, &NEAR[1]) / polynomial(t, &NEAR[0])
    } else {
        1.0 - polynomial(JOIN / x, &BEYOND[1]) / polynomial(JOIN / x, &BEYOND[0])
    }
}

/// [`bessel0`] and [`lag`] without branches.
#[inline(always)]
fn bessel0_and_lag(x: f64) -> (f64, f64) {
    let near = x.min(JOIN);
    let t = (near / JOIN) * (near / JOIN);
    let (p0, p1) = (polynomial(t, &NEAR[0]), polynomial(t, &NEAR[1]));
    let beyond = x.max(JOIN);
    let (q0, q1) = (polynomial(JOIN / beyond, &BEYOND[0]), polynomial(JOIN / beyond, &BEYOND[1]));
    let inverse = 1.0 / x.max(FAR);
    let (bessel, lag) =
        if x < JOIN { (p0 * exp(-near), 1.0 - near * p1 / p0) } else { (q0 / beyond.sqrt(), 1.0 - q1 / q0) };
    if x > FAR { (far_bessel0(inverse), far_lag(inverse)) } else { (bessel, lag) }
}

#[inline(always)]
fn polynomial(t: f64, c: &[f64]) -> f64 {
    c.iter().rev().fold(0.0, |sum, c| sum * t + c)
}

/// The mean cosine of Von Mises's density of concentration 1/s²: how far a sweep shortens the mean.
pub fn mean_cosine(sweep: f64) -> f64 {
    if sweep > 0.0 { 1.0 - lag((sweep * sweep).recip()) } else { 1.0 }
}

/// Axes of a lobe in the frame in which wo has no y (and positive x): its mean, the direction along which it
/// is swept, and the one across.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Axes {
    /// m.
    pub mean: DVec3,
    /// Unit tangent of the sweep.
    pub along: DVec3,
    /// along × mean.
    pub across: DVec3,
}

/// Derivatives of mean and `across` by one of the angles of [`Axes::new`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Motion {
    mean: DVec3,
    across: DVec3,
}

impl Axes {
    /// The mean at polar angle `gamma` beyond n, away from wo, in the plane of both, then `aside` out of the
    /// plane; `turn` is the angle from that plane to the direction of the sweep.
    pub fn new(gamma: f64, aside: f64, turn: f64) -> Self {
        let [_, up, side] = Self::tangents(gamma, aside);
        let (s, c) = turn.sin_cos();
        Self { mean: Self::tangents(gamma, aside)[0], along: up * c + side * s, across: side * c - up * s }
    }

    /// The mean, and the unit directions in which it moves as `gamma` and `aside` grow.
    pub fn tangents(gamma: f64, aside: f64) -> [DVec3; 3] {
        let ((s, c), (sb, cb)) = (gamma.sin_cos(), aside.sin_cos());
        let plane = DVec3::new(-s, 0.0, c);
        [plane * cb + DVec3::Y * sb, DVec3::new(-c, 0.0, -s), DVec3::Y * cb - plane * sb]
    }

    /// The inverse of [`Self::new`], `turn` in −π/2 … π/2.
    pub fn angles(mean: DVec3, along: DVec3) -> [f64; 3] {
        let (gamma, aside) = ((-mean.x).atan2(mean.z), mean.y.atan2(mean.x.hypot(mean.z)));
        let [_, up, side] = Self::tangents(gamma, aside);
        let (c, s) = (along.dot(up), along.dot(side));
        [gamma, aside, if c < 0.0 { (-s).atan2(-c) } else { s.atan2(c) }]
    }

    /// Derivatives by the three angles.
    pub fn motions(gamma: f64, aside: f64, turn: f64) -> [Motion; 3] {
        let [mean, up, side] = Self::tangents(gamma, aside);
        let ((sb, cb), (s, c)) = (aside.sin_cos(), turn.sin_cos());
        let plane = mean * cb - side * sb;
        [
            Motion { mean: up * cb, across: plane * s - up * (c * sb) },
            Motion { mean: side, across: mean * -c },
            Motion { mean: DVec3::ZERO, across: -(up * c + side * s) },
        ]
    }
}

/// One lobe, ready to be evaluated.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Swept {
    axes: Axes,
    lambda: f64,
    /// κ, and 1/I₀(κ) scaled; `None` for a round lobe.
    sweep: Option<(f64, f64, f64)>,
    peak: f64,
    /// d ln c/dλ.
    slope: f64,
}

impl Swept {
    /// Widths in radians.
    pub fn new(axes: Axes, sigma: f64, sweep: f64) -> Self {
        let lambda = (sigma * sigma).recip();
        // Below a hundredth of σ a sweep changes nothing.
        let swept = (sweep > 0.01 * sigma).then(|| {
            let kappa = (sweep * sweep).recip();
            (kappa, bessel0(kappa).recip(), lag(kappa))
        });
        Self {
            axes,
            lambda,
            sweep: swept,
            peak: density(sigma),
            slope: sigma * sigma - 2.0 / (2.0 * lambda).exp_m1(),
        }
    }

    /// Per steradian.
    pub fn value(&self, d: DVec3) -> f64 {
        let below = 0.5 * (d - self.axes.mean).length_squared();
        let lambda = self.lambda;
        let Some((kappa, scale, _)) = self.sweep else {
            let e = -lambda * below;
            return if e > LN_TAIL { self.peak * e.exp() } else { 0.0 };
        };
        let (r, e) = self.radius(d.dot(self.axes.across), below, kappa);
        if e > LN_TAIL { self.peak * e.exp() * bessel0(r) * scale } else { 0.0 }
    }

    /// R, and R − κ − λ without cancellation.
    fn radius(&self, y: f64, below: f64, kappa: f64) -> (f64, f64) {
        let (lambda, whole) = (self.lambda, kappa + self.lambda);
        let short = lambda * (lambda * y * y + 2.0 * kappa * below);
        let r = (whole * whole - short).max(0.0).sqrt();
        (r, -short / (r + whole))
    }

    /// [`Self::slopes`] at each point, times the roots of the solid angles, in as many columns as `out` has.
    pub fn columns(&self, motions: &[Motion; 3], d: &[DVec3], root: &[f64], out: &mut [Vec<f64>]) {
        out.iter_mut().for_each(|to| to.resize(d.len(), 0.0));
        let ((groups, _), (roots, _)) = (d.as_chunks::<LANES>(), root.as_chunks::<LANES>());
        // The value counts where R − κ − λ > LN_TAIL: R > FAR there.
        if self.sweep.is_none_or(|(kappa, ..)| kappa + self.lambda > FAR - LN_TAIL) {
            steradian_simd::run(Columns::<false> { lobe: *self, motions, d: groups, root: roots, out });
        } else {
            steradian_simd::run(Columns::<true> { lobe: *self, motions, d: groups, root: roots, out });
        }
        for i in groups.len() * LANES..d.len() {
            for (to, v) in out.iter_mut().zip(self.slopes(motions, d[i])) {
                to[i] = v * root[i];
            }
        }
    }

    /// The value, and its derivatives by γ, ln σ, ln s, and the angles out of the plane and of the sweep.
    pub fn slopes(&self, motions: &[Motion; 3], d: DVec3) -> [f64; 6] {
        let Axes { mean, along, across } = self.axes;
        let below = 0.5 * (d - mean).length_squared();
        let lambda = self.lambda;
        // The value, its derivatives by m·d and by y over the value's scale, and by ln σ and ln s.
        let [value, by_mean, by_y, sigma, sweep] = match self.sweep {
            None => {
                let e = -lambda * below;
                let value = if e > LN_TAIL { self.peak * e.exp() } else { return [0.0; 6] };
                [value, value * lambda, 0.0, -2.0 * lambda * value * (self.slope - below), 0.0]
            }
            Some((kappa, scale, lag_kappa)) => {
                let y = d.dot(across);
                let (r, e) = self.radius(y, below, kappa);
                if e <= LN_TAIL {
                    return [0.0; 6];
                }
                let value = self.peak * e.exp() * bessel0(r) * scale;
                let inverse = r.max(1e-12).recip();
                let ratio = 1.0 - lag(r);
                let cosine = 1.0 - below;
                // ∂R/∂λ − 1 and ∂R/∂κ − 1.
                let by_lambda = (lambda * (1.0 - y * y) + kappa * cosine) * inverse;
                let aside = lambda * d.dot(along);
                let lean = -aside * aside * inverse / (r + kappa + lambda * cosine).max(1e-12);
                let by_kappa = ratio * (1.0 + lean) - 1.0 + lag_kappa;
                let by_r = value * ratio * lambda * inverse;
                [
                    value,
                    by_r * kappa,
                    -by_r * lambda * y,
                    -2.0 * lambda * value * (self.slope - 1.0 + ratio * by_lambda),
                    -2.0 * kappa * value * by_kappa,
                ]
            }
        };
        let [gamma, aside, turn] = motions.map(|m| by_mean * d.dot(m.mean) + by_y * d.dot(m.across));
        [value, gamma, sigma, sweep, aside, turn]
    }
}

/// Points at a time: eight doubles are one register of AVX-512, or two of AVX2.
const LANES: usize = 8;

/// The value and its derivatives of a lobe, times roots of solid angles, for the points of whole groups of
/// lanes. Where the lobe is not `WIDE`, R > [`FAR`] wherever the value counts.
struct Columns<'a, const WIDE: bool> {
    lobe: Swept,
    motions: &'a [Motion; 3],
    d: &'a [[DVec3; LANES]],
    root: &'a [[f64; LANES]],
    out: &'a mut [Vec<f64>],
}

impl<const WIDE: bool> Kernel for Columns<'_, WIDE> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let Swept { axes: Axes { mean, along, across }, lambda, sweep, peak, slope } = self.lobe;
        let (kappa, scale, lag_kappa) = sweep.unwrap_or((1e8, 1.0, 0.0));
        let round = sweep.is_none();
        let [gamma, aside, turn] = *self.motions;
        let in_plane = self.out.len() <= 4;
        for (i, (d, root)) in self.d.iter().zip(self.root).enumerate() {
            let mut values = [[0.0; LANES]; 6];
            let x: [f64; LANES] = std::array::from_fn(|k| d[k].x);
            let y: [f64; LANES] = std::array::from_fn(|k| d[k].y);
            let z: [f64; LANES] = std::array::from_fn(|k| d[k].z);
            let dot = |v: DVec3, k: usize| x[k] * v.x + y[k] * v.y + z[k] * v.z;
            for k in 0..LANES {
                let (p, q, o) = (x[k] - mean.x, z[k] - mean.z, y[k] - mean.y);
                let below = 0.5 * (p * p + o * o + q * q);
                let (along, off) = (dot(along, k), dot(across, k));
                let whole = kappa + lambda;
                let short = lambda * (lambda * off * off + 2.0 * kappa * below);
                let least = if WIDE { 1e-12 } else { FAR };
                let r = (whole * whole - short).max(least * least).sqrt();
                let inverse = 1.0 / r;
                let e = if round { -lambda * below } else { -short / (r + whole) };
                let root = if e > LN_TAIL { root[k] } else { 0.0 };
                let (bessel, lag) =
                    if WIDE { bessel0_and_lag(r) } else { (far_bessel0(inverse), far_lag(inverse)) };
                let bessel = if round { 1.0 } else { bessel * scale };
                let value = peak * exp(e.max(-60.0)) * bessel * root;
                let ratio = 1.0 - lag;
                let cosine = 1.0 - below;
                let by_lambda = (lambda * (1.0 - off * off) + kappa * cosine) * inverse;
                let leaning = lambda * along;
                let lean = -leaning * leaning * inverse / (r + kappa + lambda * cosine).max(1e-12);
                let by_kappa = ratio * (1.0 + lean) - 1.0 + lag_kappa;
                let by_mean = value * lambda * if round { 1.0 } else { ratio * kappa * inverse };
                let by_y = if round { 0.0 } else { -value * ratio * lambda * lambda * off * inverse };
                values[0][k] = value;
                values[1][k] = by_mean * dot(gamma.mean, k) + by_y * dot(gamma.across, k);
                values[2][k] = -2.0
                    * lambda
                    * value
                    * if round { slope - below } else { slope - 1.0 + ratio * by_lambda };
                values[3][k] = if round { 0.0 } else { -2.0 * kappa * value * by_kappa };
                if !in_plane {
                    values[4][k] = by_mean * dot(aside.mean, k) + by_y * dot(aside.across, k);
                    values[5][k] = by_mean * dot(turn.mean, k) + by_y * dot(turn.across, k);
                }
            }
            for (to, values) in self.out.iter_mut().zip(values) {
                to[i * LANES..(i + 1) * LANES].copy_from_slice(&values);
            }
        }
    }
}

/// [`bessel0`] of 1/t, t < 1/[`FAR`].
#[inline(always)]
fn far_bessel0(t: f64) -> f64 {
    // 1/√(2π) (1 + t/8 + 9 t²/128 + …).
    let p = 1.0
        + t * (0.125 + t * (9.0 / 128.0 + t * (225.0 / 3072.0 + t * (11_025.0 / 98_304.0 + t * 0.227_108))));
    0.398_942_280_401_432_7 * p * t.sqrt()
}

/// [`lag`] of 1/t, t < 1/[`FAR`].
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

    fn in_plane(gamma: f64, sigma: f64, sweep: f64) -> Swept {
        Swept::new(Axes::new(gamma, 0.0, 0.0), sigma, sweep)
    }

    fn directions(n: usize) -> impl Iterator<Item = DVec3> {
        (0..n).map(move |k| {
            let z = 1.0 - (2 * k + 1) as f64 / n as f64;
            let (s, c) = (PI * (1.0 + 5f64.sqrt()) * k as f64).sin_cos();
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * c, r * s, z)
        })
    }

    /// The closed form equals the integral that defines it, and has integral 1.
    #[test]
    fn a_swept_gaussian_is_the_mean_of_its_gaussians() {
        for (sigma, sweep) in [(0.1, 0.3), (0.3, 0.1), (0.5, 0.9), (0.2, 0.05), (1.0, 1.0)] {
            let lobe = in_plane(0.7, sigma, sweep);
            let kappa = f64::powi(sweep, -2);
            let sum = |d: DVec3| {
                let (mut sum, mut all) = (0.0, 0.0);
                for k in 0..2000 {
                    let t = PI * (f64::from(k) + 0.5) / 1000.0;
                    let w = (kappa * (t.cos() - 1.0)).exp();
                    sum += w * in_plane(0.7 + t, sigma, 0.0).value(d);
                    all += w;
                }
                sum / all
            };
            let top = lobe.value(lobe.axes.mean);
            for d in directions(40) {
                let (a, b) = (lobe.value(d), sum(d));
                assert!((a - b).abs() < 1e-6 * top, "{sigma} {sweep}: {a} {b}");
            }
            let n = 200_000;
            let whole = directions(n).map(|d| lobe.value(d)).sum::<f64>() * 4.0 * PI / n as f64;
            assert!((whole - 1.0).abs() < 1e-5, "{sigma} {sweep}: {whole}");
        }
    }

    /// Places: in the plane of incidence, and out of it with the sweep turned.
    const PLACES: [[f64; 3]; 3] = [[0.7, 0.0, 0.0], [0.7, 0.4, 1.1], [-0.2, -0.8, -0.5]];

    #[test]
    fn slopes_are_derivatives() {
        for place in PLACES {
            for (sigma, sweep) in [(0.1, 0.3), (0.02, 0.01), (0.5, 0.9), (0.3, 0.0), (0.004, 0.05)] {
                for k in 0..12 {
                    let axes = Axes::new(place[0], place[1], place[2]);
                    let off = sigma * (0.3 * f64::from(k) - 2.0);
                    let d = (axes.mean + axes.along * off + axes.across * (0.5 * sigma)).normalize();
                    let at = |by: [f64; 5]| {
                        let axes = Axes::new(place[0] + by[0], place[1] + by[3], place[2] + by[4]);
                        Swept::new(axes, sigma * by[1].exp(), sweep * by[2].exp()).value(d)
                    };
                    let lobe = Swept::new(axes, sigma, sweep);
                    let slopes = lobe.slopes(&Axes::motions(place[0], place[1], place[2]), d);
                    assert_eq!(slopes[0], lobe.value(d));
                    let top = lobe.value(lobe.axes.mean);
                    for i in 0..5 {
                        let h = if i == 0 || i == 3 { 1e-4 * sigma } else { 1e-4 };
                        let unit = h / 1e-4;
                        let step = |h: f64| std::array::from_fn(|j| if j == i { h } else { 0.0 });
                        let want = (at(step(h)) - at(step(-h))) / (2.0 * h) * unit;
                        let got = slopes[1 + i] * unit;
                        // A turned sweep moves by its length.
                        let most = 1e-4 * top * if i == 4 { 1.0 + sweep / sigma } else { 1.0 };
                        assert!((got - want).abs() < most, "{sigma} {sweep} {k} {i}: {got} {want}");
                    }
                }
            }
        }
    }

    #[test]
    fn angles_are_those_of_the_axes() {
        for [gamma, aside, turn] in PLACES {
            let axes = Axes::new(gamma, aside, turn);
            assert!((axes.along.cross(axes.mean) - axes.across).length() < 1e-12);
            for along in [axes.along, -axes.along] {
                let got = Axes::angles(axes.mean, along);
                assert!([gamma, aside, turn].iter().zip(got).all(|(a, b)| (a - b).abs() < 1e-12), "{got:?}");
            }
        }
    }

    /// Groups of lanes give the values of single points.
    #[test]
    fn columns_are_the_slopes() {
        let d: Vec<DVec3> = directions(1003).collect();
        let root: Vec<f64> = (0..d.len()).map(|k| 1.0 + k as f64 / 500.0).collect();
        for (sigma, sweep) in [(0.1, 0.3), (0.02, 0.01), (0.5, 0.9), (0.3, 0.0), (0.12, 0.001), (0.05, 1.0)] {
            for [gamma, aside, turn] in PLACES {
                let lobe = Swept::new(Axes::new(gamma, aside, turn), sigma, sweep);
                let motions = Axes::motions(gamma, aside, turn);
                let mut out: [Vec<f64>; 6] = Default::default();
                lobe.columns(&motions, &d, &root, &mut out);
                let top = lobe.value(lobe.axes.mean);
                for (i, d) in d.iter().enumerate() {
                    let want = lobe.slopes(&motions, *d);
                    for c in 0..6 {
                        let scale =
                            top * [1.0, 1.0 / sigma, 1.0, 1.0, 1.0 / sigma, sweep / sigma][c] * root[i];
                        let (got, want) = (out[c][i], want[c] * root[i]);
                        assert!((got - want).abs() <= 1e-6 * scale, "{sigma} {sweep} {i} {c}: {got} {want}");
                    }
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

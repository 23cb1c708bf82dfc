//! Normalised kernels for filtered maps: ∫K dω = 1, so that filtering preserves a constant environment.
//!
//! Those of microfacet models are seen with n = wo = r, K ∝ D(n·h)/4 · ⟨n·wi⟩₊ with n·h = cos(θ/2).

use super::profile;
use super::zonal::{GgxMirror, Power, Zonal, quadrature};
use std::f64::consts::{FRAC_PI_2, PI};

/// A normalised kernel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lobe {
    shape: Shape,
    /// 1/∫ of the shape.
    scale: f64,
}

/// The form of a lobe, without factors that normalisation cancels.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    Ggx(GgxMirror),
    Beckmann { alpha: f64 },
    Charlie { alpha: f64 },
    BlinnPhong { n: f64 },
    Phong(Power),
    Gaussian { sigma: f64 },
    SphericalGaussian { lambda: f64 },
}

impl Lobe {
    fn new(shape: Shape) -> Self {
        let mut lobe = Self { shape, scale: 1.0 };
        lobe.scale = quadrature(|x| lobe.value(x), lobe.width(), lobe.support(), 0)[0].recip();
        lobe
    }

    /// Trowbridge–Reitz (GGX): the split sum's ∫L w/∫w. `alpha` = perceptual_roughness², kept ≥ 1e-4.
    pub fn ggx(alpha: f64) -> Self {
        Self { shape: Shape::Ggx(GgxMirror::new(alpha)), scale: 1.0 }
    }

    /// Beckmann: D = exp(−tan²θ_h/α²)/(π α² cos⁴θ_h). `alpha` is kept ≥ 1e-4.
    pub fn beckmann(alpha: f64) -> Self {
        Self::new(Shape::Beckmann { alpha: alpha.max(1e-4) })
    }

    /// The least alpha of [`Self::charlie`].
    pub const LEAST_CHARLIE: f64 = 0.02;

    /// Charlie sheen (Estevez & Kulla 2017): D ∝ sin^{1/α} θ_h. `alpha` is kept ≥ [`Self::LEAST_CHARLIE`].
    pub fn charlie(alpha: f64) -> Self {
        Self::new(Shape::Charlie { alpha: alpha.max(Self::LEAST_CHARLIE) })
    }

    /// Blinn–Phong: D ∝ (n·h)^n, n > 0.
    pub fn blinn_phong(n: f64) -> Self {
        Self::new(Shape::BlinnPhong { n })
    }

    /// Phong: (n+1)/2π ⟨cos θ⟩₊^n, n > 0.
    pub fn phong(n: f64) -> Self {
        Self { shape: Shape::Phong(Power { n }), scale: (n + 1.0) / (2.0 * PI) }
    }

    /// Lambert: ⟨cos θ⟩₊/π, so that a map holds E/π.
    pub fn lambert() -> Self {
        Self::phong(1.0)
    }

    /// A Gaussian of the angle, ∝ exp(−θ²/2σ²) over the whole sphere; `sigma` in radians, > 0.
    pub fn gaussian(sigma: f64) -> Self {
        Self::new(Shape::Gaussian { sigma })
    }

    /// A spherical Gaussian ∝ exp(λ (cos θ − 1)), λ = 1/σ², over the whole sphere; `sigma` in radians, > 0.
    pub fn spherical_gaussian(sigma: f64) -> Self {
        let lambda = (sigma * sigma).recip();
        // ∫ = 2π (1 − e^{−2λ})/λ
        let scale = lambda / (2.0 * PI * -(-2.0 * lambda).exp_m1());
        Self { shape: Shape::SphericalGaussian { lambda }, scale }
    }
}

impl Zonal for Lobe {
    fn value(&self, x: f64) -> f64 {
        if x <= 0.0 && self.support() <= FRAC_PI_2 {
            return 0.0;
        }
        // cos²θ_h and sin²θ_h
        let (c2, s2) = (0.5 * (1.0 + x), 0.5 * (1.0 - x).max(0.0));
        self.scale
            * match self.shape {
                Shape::Ggx(k) => k.value(x),
                Shape::Beckmann { alpha } => (-s2 / (c2 * alpha * alpha)).exp() / (alpha * c2).powi(2) * x,
                Shape::Charlie { alpha } => s2.powf(0.5 / alpha) * x,
                Shape::BlinnPhong { n } => c2.powf(0.5 * n) * x,
                Shape::Phong(k) => k.value(x),
                Shape::Gaussian { sigma } => {
                    let theta = if s2 < 0.5 { 2.0 * s2.sqrt().asin() } else { x.clamp(-1.0, 1.0).acos() };
                    (-0.5 * (theta / sigma).powi(2)).exp()
                }
                Shape::SphericalGaussian { lambda } => (-2.0 * lambda * s2).exp(),
            }
    }

    fn width(&self) -> f64 {
        match self.shape {
            Shape::Ggx(k) => k.width(),
            Shape::Beckmann { alpha } => alpha.min(1.0),
            // It varies over the last part of its hemisphere, but like a power: panels from 0.3 resolve it.
            Shape::Charlie { .. } => 0.3,
            Shape::BlinnPhong { n } => (2.0 / n.max(2.0).sqrt()).min(1.0),
            Shape::Phong(k) => k.width(),
            Shape::Gaussian { sigma } => sigma.min(1.0),
            Shape::SphericalGaussian { lambda } => lambda.sqrt().recip().min(1.0),
        }
    }

    fn support(&self) -> f64 {
        if matches!(self.shape, Shape::Gaussian { .. } | Shape::SphericalGaussian { .. }) {
            PI
        } else {
            FRAC_PI_2
        }
    }

    fn fill(&self, s2: &[f32], out: &mut [f32]) {
        let scale = self.scale as f32;
        match self.shape {
            Shape::Ggx(k) => k.fill(s2, out),
            Shape::Beckmann { alpha } => {
                profile::beckmann(
                    s2,
                    out,
                    (alpha * alpha).recip() as f32,
                    (self.scale / (alpha * alpha)) as f32,
                );
            }
            Shape::Phong(Power { n: 1.0 }) => {
                out.iter_mut().zip(s2).for_each(|(k, s2)| *k = scale * (1.0 - 2.0 * s2).max(0.0));
            }
            // (1 − 2 s²)^n and (1 − s²)^{n/2} (1 − 2 s²). Phong's only for n ≥ 16: wider lobes reach angles
            // at which the series of ln fails.
            Shape::Phong(Power { n }) if n >= 16.0 => profile::power(s2, out, (n as f32, 2.0, 0.0), scale),
            Shape::BlinnPhong { n } => profile::power(s2, out, (0.5 * n as f32, 1.0, 2.0), scale),
            Shape::Charlie { alpha } => {
                let n = 0.5 / alpha;
                profile::sheen(s2, out, n as f32, (self.scale * 0.5_f64.powf(n)) as f32);
            }
            Shape::Gaussian { sigma } if sigma < 0.15 => {
                profile::gaussian(s2, out, (0.5 / (sigma * sigma)) as f32, scale);
            }
            Shape::SphericalGaussian { lambda } => {
                profile::exponential(s2, out, (2.0 * lambda) as f32, scale);
            }
            _ => {
                out.iter_mut().zip(s2).for_each(|(k, &s2)| *k = self.value(1.0 - 2.0 * f64::from(s2)) as f32)
            }
        }
    }

    fn coefficients(&self, order: usize) -> Vec<f64> {
        match self.shape {
            Shape::Ggx(k) => k.coefficients(order),
            Shape::Phong(k) => k.coefficients(order).into_iter().map(|k| k * self.scale).collect(),
            _ => quadrature(|x| self.value(x), self.width(), self.support(), order),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Cosine;

    #[test]
    fn every_lobe_is_normalised_at_every_width() {
        for w in [1e-3, 0.01, 0.1, 0.4, 1.0] {
            let exponent = 1.0 / (w * w);
            let lobes = [
                Lobe::ggx(w),
                Lobe::beckmann(w),
                Lobe::charlie(w),
                Lobe::blinn_phong(exponent),
                Lobe::phong(exponent),
                Lobe::gaussian(w),
                Lobe::spherical_gaussian(w),
            ];
            for lobe in lobes {
                // An independent composite rule: the midpoint rule in √θ-like steps.
                let n = 400_000;
                let top = lobe.support();
                let sum: f64 = (0..n)
                    .map(|k| {
                        let t = (f64::from(k) + 0.5) / f64::from(n);
                        let theta = top * t * t;
                        2.0 * PI * lobe.value(theta.cos()) * theta.sin() * 2.0 * top * t / f64::from(n)
                    })
                    .sum();
                assert!((sum - 1.0).abs() < 1e-6, "{lobe:?}: {sum}");
                assert!((lobe.coefficients(4)[0] - 1.0).abs() < 1e-10, "{lobe:?}");
            }
        }
    }

    #[test]
    fn lambert_is_the_cosine_over_pi() {
        for (a, b) in Lobe::lambert().coefficients(20).iter().zip(Cosine.coefficients(20)) {
            assert!((a - b / PI).abs() < 1e-14);
        }
    }

    /// k_1/k_0 = ∫K x/∫K in closed form.
    #[test]
    fn first_bands_are_those_of_the_integrals() {
        let ratio = |lobe: Lobe| {
            let k = lobe.coefficients(1);
            k[1] / k[0]
        };
        for alpha in [0.02_f64, 0.1, 0.5] {
            // ∫ xⁿ/(p − r x)² over [0, 1], from y = p − r x.
            let (p, r) = (0.5 * (1.0 + alpha * alpha), 0.5 * (1.0 - alpha * alpha));
            let (a, ln) = (1.0 / (p - r) - 1.0 / p, (p / (p - r)).ln());
            let exact = (p * p * a - 2.0 * p * ln + r) / (r * (p * a - ln));
            assert!((ratio(Lobe::ggx(alpha)) - exact).abs() < 1e-11, "ggx {alpha}");
        }
        for m in [0.5_f64, 5.0, 200.0] {
            // Blinn–Phong: u^m (2u − 1) from ½ to 1, u = cos²θ_h, n = 2m; Charlie: u^m (1 − 2u) up to ½, u =
            // sin²θ_h.
            let part = |k: f64| (1.0 - 0.5_f64.powf(m + k)) / (m + k);
            let exact = (4.0 * part(3.0) - 4.0 * part(2.0) + part(1.0)) / (2.0 * part(2.0) - part(1.0));
            assert!((ratio(Lobe::blinn_phong(2.0 * m)) - exact).abs() < 1e-11, "blinn-phong {m}");
            if m < 25.0 {
                let part = |k: f64| 0.5_f64.powf(k) / (m + k);
                let exact = (part(1.0) - 4.0 * part(2.0) + 4.0 * part(3.0)) / (part(1.0) - 2.0 * part(2.0));
                assert!((ratio(Lobe::charlie(0.5 / m)) - exact).abs() < 1e-9, "charlie {m}");
            }
        }
    }

    /// k_l = e^{−λ} … in terms of Bessel functions, which [`steradian_sphere::sh::zonal`] holds; and for
    /// narrow ones all Gaussians are the heat kernel exp(−l(l+1)σ²/2).
    #[test]
    fn gaussians_are_the_known_ones() {
        use steradian_sphere::sh::zonal;
        for sigma in [0.05_f64, 0.3, 1.5] {
            let lambda = (sigma * sigma).recip();
            let exact = zonal::gaussian(60, lambda);
            for (a, b) in Lobe::spherical_gaussian(sigma).coefficients(60).iter().zip(&exact) {
                assert!((a - b / exact[0]).abs() < 1e-11, "{sigma}: {a} {b}");
            }
        }
        let sigma = 0.01;
        let heat = zonal::heat(200, 0.5 * sigma * sigma);
        let both = [Lobe::spherical_gaussian(sigma), Lobe::gaussian(sigma)].map(|l| l.coefficients(200));
        for l in 0..=200 {
            for k in &both {
                assert!((k[l] - heat[l] / heat[0]).abs() < 2e-4, "{l}: {} {}", k[l], heat[l]);
            }
        }
    }

    /// Blinn–Phong of exponent 2/α² and Beckmann of α tend to the same Gaussian of θ_h.
    #[test]
    fn narrow_lobes_agree() {
        let alpha = 0.01;
        let (a, b, c) = (
            Lobe::beckmann(alpha).coefficients(200),
            Lobe::blinn_phong(2.0 / (alpha * alpha)).coefficients(200),
            // exp(−θ_h²/α²) with θ_h = θ/2: σ = √2 α.
            Lobe::gaussian(alpha * 2f64.sqrt()).coefficients(200),
        );
        for l in 0..=200 {
            assert!(
                (a[l] - b[l]).abs() < 2e-3 && (a[l] - c[l]).abs() < 2e-3,
                "{l}: {} {} {}",
                a[l],
                b[l],
                c[l]
            );
        }
    }
}

//! Spherical Gaussians G(d) = a e^{λ(d·μ − 1)} (Wang et al. 2009, "All-frequency rendering of dynamic,
//! spatially-varying reflectance"), and their normalised form, the von Mises–Fisher distribution.

use crate::Frame;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// A lobe about `axis` of sharpness λ ≥ 0 and amplitude per channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SphericalGaussian {
    /// Unit axis μ.
    pub axis: DVec3,
    /// Sharpness λ; 0 is a constant.
    pub sharpness: f64,
    /// Value on the axis.
    pub amplitude: [f64; 3],
}

/// ∫ e^{λ(d·μ − 1)} dω = 2π (1 − e^{−2λ})/λ.
pub fn unit_integral(sharpness: f64) -> f64 {
    let l = sharpness;
    if l < 1e-8 { 4.0 * PI * (1.0 - l) } else { TAU * -(-2.0 * l).exp_m1() / l }
}

impl SphericalGaussian {
    /// The lobe whose integral is 1 in every channel (von Mises–Fisher): amplitude λ/(2π(1 − e^{−2λ})).
    pub fn normalized(axis: DVec3, sharpness: f64) -> Self {
        Self { axis, sharpness, amplitude: [1.0 / unit_integral(sharpness); 3] }
    }

    /// The value at unit direction `d`.
    pub fn value(&self, d: DVec3) -> [f64; 3] {
        // d·μ − 1 = −|d − μ|²/2, which keeps its digits near the axis.
        let e = (-0.5 * self.sharpness * (d - self.axis).length_squared()).exp();
        self.amplitude.map(|a| a * e)
    }

    /// ∫ G dω.
    pub fn integral(&self) -> [f64; 3] {
        let i = unit_integral(self.sharpness);
        self.amplitude.map(|a| a * i)
    }

    /// The product of two lobes, again a lobe: with u = λ₁μ₁ + λ₂μ₂, sharpness |u|, axis u/|u|, amplitude
    /// a₁a₂ e^{|u| − λ₁ − λ₂}.
    pub fn product(&self, other: &Self) -> Self {
        let (l1, l2) = (self.sharpness, other.sharpness);
        let u = self.axis * l1 + other.axis * l2;
        let l = u.length();
        // |u| − λ₁ − λ₂ = −λ₁λ₂|μ₁ − μ₂|²/(|u| + λ₁ + λ₂), without cancellation.
        let sum = l + l1 + l2;
        let gap = l1 * l2 * (self.axis - other.axis).length_squared();
        let scale = if sum > 0.0 { (-gap / sum).exp() } else { 1.0 };
        Self {
            axis: if l > 0.0 { u / l } else { self.axis },
            sharpness: l,
            amplitude: std::array::from_fn(|c| scale * self.amplitude[c] * other.amplitude[c]),
        }
    }

    /// ∫ G₁ G₂ dω.
    pub fn inner(&self, other: &Self) -> [f64; 3] {
        self.product(other).integral()
    }

    /// ∫ G₁(ω) G₂(ω about d) dω as a function of d, where `other`'s axis is turned to d, approximated by a
    /// lobe about this axis: sharpness λ₁λ₂/(λ₁ + λ₂) (Iwasaki et al. 2012, "Interactive bi-scale editing of
    /// highly glossy materials", eq. 9), and the amplitude that keeps the convolution's integral ∫G₁ ∫G₂. The
    /// error is of order 1/λ for sharp lobes.
    pub fn convolve(&self, other: &Self) -> Self {
        let (l1, l2) = (self.sharpness, other.sharpness);
        let l = if l1 + l2 > 0.0 { l1 * l2 / (l1 + l2) } else { 0.0 };
        let (i1, i2, i) = (unit_integral(l1), unit_integral(l2), unit_integral(l));
        Self {
            axis: self.axis,
            sharpness: l,
            amplitude: std::array::from_fn(|c| self.amplitude[c] * other.amplitude[c] * i1 * i2 / i),
        }
    }

    /// A direction with the density of the normalised lobe, for u in [0, 1)²: d·μ = 1 + ln(1 − u(1 −
    /// e^{−2λ}))/λ (Jakob 2012, "Numerically stable sampling of the von Mises–Fisher distribution on S²").
    pub fn sample(&self, u: DVec2) -> DVec3 {
        let l = self.sharpness;
        let below = if l < 1e-8 { 2.0 * u.x } else { -(u.x * (-2.0 * l).exp_m1()).ln_1p() / l };
        let below = below.clamp(0.0, 2.0);
        let r = (below * (2.0 - below)).sqrt();
        let (s, c) = (TAU * u.y).sin_cos();
        Frame::from_normal(self.axis).to_world(DVec3::new(r * c, r * s, 1.0 - below))
    }

    /// The density of [`SphericalGaussian::sample`], per steradian.
    pub fn pdf(&self, d: DVec3) -> f64 {
        (-0.5 * self.sharpness * (d - self.axis).length_squared()).exp() / unit_integral(self.sharpness)
    }

    /// The `u` that gives `d`.
    pub fn invert(&self, d: DVec3) -> DVec2 {
        let (l, below) = (self.sharpness, 0.5 * (d - self.axis).length_squared());
        let x = if l < 1e-8 { 0.5 * below } else { (-l * below).exp_m1() / (-2.0 * l).exp_m1() };
        let local = Frame::from_normal(self.axis).to_local(d);
        let phi = local.y.atan2(local.x) / TAU;
        DVec2::new(x, if phi < 0.0 { phi + 1.0 } else { phi })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::R2;

    const D: DVec3 = DVec3::new(0.36, 0.48, 0.8);

    #[test]
    fn integrals_and_densities() {
        for sharpness in [0.0, 1e-9, 0.5, 10.0, 1e4] {
            let g = SphericalGaussian::normalized(D, sharpness);
            assert!((g.integral()[0] - 1.0).abs() < 1e-12);
            let other = SphericalGaussian::normalized(DVec3::Y, 1.0 + 0.9 * sharpness);
            let n = 20_000;
            let mean =
                (0..n).map(|k| g.sample(R2::default().point(k))).map(|d| other.value(d)[0]).sum::<f64>();
            let exact = g.inner(&other)[0];
            assert!((mean / f64::from(n) / exact - 1.0).abs() < 0.02 || exact < 1e-8, "{sharpness}");
            for k in 0..100 {
                let u = R2::default().point(k);
                let d = g.sample(u);
                assert!((g.invert(d) - u).length() < 1e-7, "{sharpness}: {u} {}", g.invert(d));
                assert!((g.pdf(d) / g.value(d)[0] - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn products_are_pointwise() {
        let a = SphericalGaussian { axis: D, sharpness: 7.0, amplitude: [1.0, 2.0, 3.0] };
        let b = SphericalGaussian { axis: DVec3::X, sharpness: 3.0, amplitude: [0.5, 1.0, 2.0] };
        for k in 0..50 {
            let d = crate::sampling::sphere::sample(R2::default().point(k));
            let (p, x, y) = (a.product(&b).value(d), a.value(d), b.value(d));
            assert!((0..3).all(|c| (p[c] - x[c] * y[c]).abs() < 1e-14 + 1e-12 * p[c]));
        }
    }

    #[test]
    fn convolution_keeps_the_integral_and_the_peak() {
        let a = SphericalGaussian::normalized(D, 200.0);
        let b = SphericalGaussian::normalized(D, 300.0);
        let c = a.convolve(&b);
        assert!((c.integral()[0] - 1.0).abs() < 1e-12);
        assert!((c.value(D)[0] / a.inner(&b)[0] - 1.0).abs() < 0.01);
    }
}

//! Kernels on a cone about a direction: cosⁿ(θ − α)₊, θ from the direction.
//!
//! The highlights of fibres: of Kajiya & Kay (1989) about the tangent with α = θ_o, and of Banks (1994; Kautz
//! 2004 (STAR), eq. 35) with α = π − θ_o, since √(1 − x²)√(1 − y²) − xy = −cos(θ_i + θ_o) with x = cos θ_i,
//! y = cos θ_o. Seen about −d, θ is π − θ, so that
//!
//! > K_α(−d·wi) = K_{π−α}(d·wi)
//!
//! and α ≤ π/2 suffices. Near d the kernel of α > 0 is pointed (cosⁿα (1 + n θ tan α)), so its bands fall
//! like a power.

use super::legendre;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::OnceLock;
use steradian_sphere::quadrature::gauss_legendre;

/// Nodes of a panel.
const NODES: usize = 32;
/// Radians by which P_order turns in a panel at most: 32 nodes integrate a wave of 40 radians times a
/// polynomial of degree 15 to 4e-14, one of 50 radians to 2e-11.
const MAX_PHASE: f64 = 40.0;
/// Exponents below which the end of the support is not smooth enough for one panel.
const SMOOTH_EXPONENT: f64 = 16.0;

/// cosⁿ(θ − α)₊ about a direction, 0 ≤ α ≤ π.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FibreKernel {
    /// Exponent, ≥ 0.
    pub n: f64,
    /// Angle of the highlight from the direction, radians.
    pub alpha: f64,
}

fn rule() -> &'static (Vec<f64>, Vec<f64>) {
    static RULE: OnceLock<(Vec<f64>, Vec<f64>)> = OnceLock::new();
    RULE.get_or_init(|| gauss_legendre(NODES))
}

impl FibreKernel {
    /// The angle over which the kernel varies across the highlight, radians.
    pub fn width(&self) -> f64 {
        self.n.max(1.0).sqrt().recip()
    }

    /// The kernel at angle θ from the direction.
    pub fn value(&self, theta: f64) -> f64 {
        let (s, c) = (theta - self.alpha).sin_cos();
        if c <= 0.0 {
            0.0
        } else if c < 0.9 {
            c.powf(self.n)
        } else {
            // ln cos keeps its digits.
            (0.5 * self.n * (-s * s).ln_1p()).exp()
        }
    }

    /// k_l = 2π ∫ K P_l sin θ dθ for l = 0 … `order` (Funk–Hecke).
    pub fn coefficients(&self, order: usize) -> Vec<f64> {
        let mut points = Vec::new();
        self.nodes(order as f64, |theta, w| {
            let (s, c) = theta.sin_cos();
            points.push((c, 2.0 * PI * w * self.value(theta) * s));
        });
        legendre::moments(&points, order)
    }

    /// ∫ K(θ) g(θ) dθ of a smooth g.
    pub fn integral(&self, g: impl Fn(f64) -> f64) -> f64 {
        let mut sum = 0.0;
        self.nodes(0.0, |theta, w| sum += w * self.value(theta) * g(theta));
        sum
    }

    /// Gauss–Legendre nodes in panels that double away from the highlight, and halve towards an end of the
    /// support.
    fn nodes(&self, order: f64, mut put: impl FnMut(f64, f64)) {
        for sign in [-1.0, 1.0] {
            let pole = if sign < 0.0 { self.alpha } else { PI - self.alpha };
            let reach = pole.min(FRAC_PI_2);
            let edges = self.edges(reach, pole > FRAC_PI_2);
            for (a, b) in edges.windows(2).map(|e| (e[0], e[1])) {
                let parts = (order * (b - a) / MAX_PHASE).ceil().max(1.0);
                let h = (b - a) / parts;
                for k in 0..parts as usize {
                    let middle = a + h * (k as f64 + 0.5);
                    let (x, w) = rule();
                    x.iter().zip(w).for_each(|(x, w)| {
                        put(self.alpha + sign * (middle + 0.5 * h * x), 0.5 * h * w);
                    });
                }
            }
        }
    }

    /// Ends of the panels from the highlight out to `reach`, where the kernel falls to zero if `dark`.
    fn edges(&self, reach: f64, dark: bool) -> Vec<f64> {
        let halve = dark && self.n < SMOOTH_EXPONENT;
        let far = if halve { 0.5 * reach } else { reach };
        let mut edges = vec![0.0];
        let mut at = 0.5 * self.width();
        while at < far {
            edges.push(at);
            at *= 2.0;
        }
        edges.push(far);
        if halve {
            edges.extend((2..24).map(|k| reach * (1.0 - 0.5_f64.powi(k))));
            edges.push(reach);
        }
        edges
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sphere::sh::zonal;

    /// Integral by the midpoint rule, whose points do not depend on the kernel.
    fn midpoint(cone: &FibreKernel, g: impl Fn(f64) -> f64) -> f64 {
        let n = 40_000;
        let theta = |k: i32| PI * (f64::from(k) + 0.5) / f64::from(n);
        (0..n).map(|k| cone.value(theta(k)) * g(theta(k))).sum::<f64>() * PI / f64::from(n)
    }

    fn legendre_at(l: usize, x: f64) -> f64 {
        let mut k = vec![0.0; l + 1];
        k[l] = 4.0 * PI / (2 * l + 1) as f64;
        zonal::value(&k, x)
    }

    #[test]
    fn coefficients_are_the_integrals() {
        for n in [0.0, 0.3, 1.0, 7.5, 30.0, 1000.0] {
            for alpha in [0.0, 0.4, FRAC_PI_2, 2.5, PI] {
                let cone = FibreKernel { n, alpha };
                let k = cone.coefficients(60);
                for l in [0, 1, 2, 60] {
                    let exact = 2.0 * PI * midpoint(&cone, |t| legendre_at(l, t.cos()) * t.sin());
                    // The midpoint rule misplaces a step by up to half its spacing.
                    let within = if n < 1.0 { 1e-3 } else { 1e-6 };
                    assert!((k[l] - exact).abs() < within, "{n} {alpha} {l}: {} {exact}", k[l]);
                }
            }
        }
    }

    /// α = 0 is Phong's lobe, and about the opposite direction α is π − α.
    #[test]
    fn known_cases() {
        use crate::{Power, Zonal};
        let phong = FibreKernel { n: 12.0, alpha: 0.0 }.coefficients(40);
        for (a, b) in phong.iter().zip(Power { n: 12.0 }.coefficients(40)) {
            assert!((a - b).abs() < 1e-13, "{a} {b}");
        }
        let (a, b) = (FibreKernel { n: 9.0, alpha: 0.7 }, FibreKernel { n: 9.0, alpha: PI - 0.7 });
        for (l, (a, b)) in a.coefficients(30).iter().zip(b.coefficients(30)).enumerate() {
            let sign = if l % 2 == 0 { 1.0 } else { -1.0 };
            assert!((a - sign * b).abs() < 1e-13, "{l}: {a} {b}");
        }
    }

    /// As n → ∞ the kernel is √(2π/n) δ(θ − α): k_l → √(2π/n) 2π sin α P_l(cos α).
    #[test]
    fn sharp_cones_are_circles() {
        let (n, alpha) = (1e6, 0.8_f64);
        let scale = (2.0 * PI / n).sqrt() * 2.0 * PI * alpha.sin();
        let sharp = FibreKernel { n, alpha };
        for (l, k) in sharp.coefficients(12).iter().enumerate() {
            assert!((k / scale - legendre_at(l, alpha.cos())).abs() < 1e-4, "{l}");
        }
    }

    #[test]
    fn integrals_are_those_of_the_midpoint_rule() {
        for n in [0.0, 2.0, 50.0] {
            let cone = FibreKernel { n, alpha: 1.1 };
            let exact = midpoint(&cone, |t| t.sin().powi(2));
            assert!((cone.integral(|t| t.sin().powi(2)) - exact).abs() < 1e-4, "{n}");
        }
    }
}

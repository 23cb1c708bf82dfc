//! Rules on the sphere and the hemisphere.

use super::gauss_legendre;
use glam::DVec3;
use std::f64::consts::PI;

/// Directions and their weights in steradians.
#[derive(Debug, Clone, PartialEq)]
pub struct SphereRule {
    /// Unit directions.
    pub directions: Vec<DVec3>,
    /// Weights; they sum to the solid angle of the domain.
    pub weights: Vec<f64>,
}

impl SphereRule {
    /// Σ weight · f(direction).
    pub fn integrate(&self, mut f: impl FnMut(DVec3) -> f64) -> f64 {
        self.directions.iter().zip(&self.weights).map(|(d, w)| w * f(*d)).sum()
    }

    /// Number of directions.
    pub fn len(&self) -> usize {
        self.directions.len()
    }

    /// Has the rule no directions?
    pub fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }

    fn product(nodes: &[f64], weights: &[f64], azimuths: usize) -> Self {
        let mut rule = Self { directions: Vec::new(), weights: Vec::new() };
        for (z, w) in nodes.iter().zip(weights) {
            let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
            for i in 0..azimuths {
                let phi = 2.0 * PI * (i as f64 + 0.5) / azimuths as f64;
                rule.directions.push(DVec3::new(r * phi.cos(), r * phi.sin(), *z));
                rule.weights.push(w * 2.0 * PI / azimuths as f64);
            }
        }
        rule
    }
}

/// Gauss–Legendre in z times equal steps in azimuth: exact for polynomials (spherical harmonics) of degree
/// up to `degree` over the sphere.
pub fn product_sphere(degree: usize) -> SphereRule {
    let (x, w) = gauss_legendre(degree / 2 + 1);
    SphereRule::product(&x, &w, degree + 1)
}

/// The same over the hemisphere z > 0: exact for polynomials in z of degree up to `degree` and azimuthal
/// frequencies up to `degree`; products of even powers of √(1−z²) included.
pub fn product_hemisphere(degree: usize) -> SphereRule {
    let (x, w) = gauss_legendre(degree / 2 + 1);
    let nodes: Vec<f64> = x.iter().map(|x| 0.5 + 0.5 * x).collect();
    let weights: Vec<f64> = w.iter().map(|w| 0.5 * w).collect();
    SphereRule::product(&nodes, &weights, degree + 1)
}

/// `n` directions of equal weight 4π/n on a Fibonacci spiral (Swinbank & Purser 2006, Q. J. R. Meteorol.
/// Soc. 132, with points at half-integers): even covering for any n, error O(n^−3/2) or better for smooth
/// integrands.
pub fn fibonacci(n: usize) -> SphereRule {
    let golden = (5f64.sqrt() - 1.0) / 2.0;
    let directions = (0..n)
        .map(|i| {
            let z = 1.0 - (2 * i + 1) as f64 / n as f64;
            let r = ((1.0 - z) * (1.0 + z)).sqrt();
            let phi = 2.0 * PI * (i as f64 * golden).fract();
            DVec3::new(r * phi.cos(), r * phi.sin(), z)
        })
        .collect();
    SphereRule { directions, weights: vec![4.0 * PI / n as f64; n] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sh::{count, eval};

    #[test]
    fn harmonics_integrate_to_nothing() {
        let rule = product_sphere(12);
        let mut sums = vec![0.0; count(12)];
        let mut y = sums.clone();
        for (d, w) in rule.directions.iter().zip(&rule.weights) {
            eval(12, *d, &mut y);
            sums.iter_mut().zip(&y).for_each(|(s, y)| *s += w * y);
        }
        assert!((sums[0] - (4.0 * PI).sqrt()).abs() < 1e-14);
        assert!(sums[1..].iter().all(|s| s.abs() < 1e-14));
    }

    #[test]
    fn the_hemisphere_has_area_two_pi_and_cosine_pi() {
        let rule = product_hemisphere(9);
        assert!((rule.integrate(|_| 1.0) - 2.0 * PI).abs() < 1e-14);
        assert!((rule.integrate(|d| d.z) - PI).abs() < 1e-14);
        assert!((rule.integrate(|d| d.z * d.x * d.x) - PI / 4.0).abs() < 1e-14);
        assert_eq!(rule.len(), 50);
    }

    #[test]
    fn the_spiral_converges() {
        let f = |d: DVec3| (2.0 * d.x + d.y - 0.5 * d.z).exp();
        let a = 5.25f64.sqrt();
        let exact = 4.0 * PI * a.sinh() / a;
        let error = |n| (fibonacci(n).integrate(f) / exact - 1.0).abs();
        assert!(error(1000) < 1e-3 && error(30_000) < 1e-5, "{} {}", error(1000), error(30_000));
        assert!(fibonacci(0).is_empty());
    }
}

//! A kernel of any shape, given by its values: of a measured reflectance, say.

use super::legendre;
use super::octaves::Octaves;
use super::zonal::Zonal;
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_sphere::quadrature::gauss_legendre;

/// Nodes of a panel.
const NODES: usize = 16;
/// A panel is halved where the last terms of its Legendre series exceed this part of the peak …
const FINE: f64 = 1e-9;
/// … unless it is already this small a part of the hemisphere.
const SMALLEST: f64 = 1e-5;

/// A kernel on the hemisphere, in panels of θ that were halved until a polynomial of degree 15 fits, and
/// normalised: ∫K dω = 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Radial {
    /// Where panels begin; the last entry is π/2.
    edges: Vec<f64>,
    /// Legendre coefficients of each panel, scaled.
    terms: Vec<[f64; NODES]>,
    /// Table of the kernel in single precision.
    cells: Octaves,
    width: f64,
    accuracy: f64,
}

impl Radial {
    /// The kernel of `f(θ)`, 0 ≤ θ ≤ π/2, not normalised; `None` where it is not finite or integrates to
    /// nothing.
    ///
    /// Adaptive: panels double from the axis and are halved where the last two of 16 Legendre terms are above
    /// 1e-9 of the peak.
    pub fn new(f: impl Fn(f64) -> f64) -> Option<Self> {
        let (nodes, weights) = gauss_legendre(NODES);
        let fit = |a: f64, b: f64| -> [f64; NODES] {
            let mut c = [0.0; NODES];
            for (z, w) in nodes.iter().zip(&weights) {
                let v = f(0.5 * (a + b) + 0.5 * (b - a) * z) * w;
                legendre_at(*z).iter().enumerate().for_each(|(l, p)| c[l] += (l as f64 + 0.5) * p * v);
            }
            c
        };
        let (mut edges, mut terms) = (vec![0.0], Vec::new());
        let mut peak = (0..=64).map(|k| f(FRAC_PI_2 * f64::from(k) / 64.0).abs()).fold(0.0, f64::max);
        let mut lost = 0.0;
        // The last on the stack is the nearest to the axis.
        let mut stack: Vec<(f64, f64)> = (0..10).map(|k| (0.5_f64.powi(k + 1), 0.5_f64.powi(k))).collect();
        stack.push((0.0, 0.5_f64.powi(10)));
        while let Some((a, b)) = stack.pop() {
            let c = fit(a * FRAC_PI_2, b * FRAC_PI_2);
            if c.iter().any(|c| !c.is_finite()) {
                return None;
            }
            peak = c.iter().map(|c| c.abs()).fold(peak, f64::max);
            let error = c[NODES - 1].abs() + c[NODES - 2].abs();
            if error > FINE * peak && b - a > SMALLEST {
                stack.extend([(0.5 * (a + b), b), (a, 0.5 * (a + b))]);
                continue;
            }
            lost += error * 2.0 * PI * ((a * FRAC_PI_2).cos() - (b * FRAC_PI_2).cos());
            edges.push(b * FRAC_PI_2);
            terms.push(c);
        }
        let mut made = Self { edges, terms, cells: Octaves::default(), width: 1.0, accuracy: 0.0 };
        let all = made.coefficients(0)[0];
        if !(all.is_finite() && all > 0.0) {
            return None;
        }
        made.terms.iter_mut().flatten().for_each(|c| *c /= all);
        made.accuracy = lost / all;
        made.width = made.half_width(peak / all);
        made.cells = Octaves::new(|s2| made.at(angle(s2)), peak / all);
        Some(made)
    }

    /// Approximate error of any band coefficient against that of the given function, relative to k_0 = 1.
    pub fn accuracy(&self) -> f64 {
        self.accuracy
    }

    /// The angle over which K changes by half its peak.
    fn half_width(&self, peak: f64) -> f64 {
        let first = self.at(0.0);
        let angle = |k: usize| 1e-4 * 1.05_f64.powi(k as i32);
        let found =
            (0..210).map(angle).take_while(|a| *a < 1.0).find(|a| (self.at(*a) - first).abs() > 0.5 * peak);
        found.unwrap_or(1.0)
    }

    fn at(&self, theta: f64) -> f64 {
        if !(0.0..=FRAC_PI_2).contains(&theta) {
            return 0.0;
        }
        let k = self.edges.partition_point(|e| *e <= theta).clamp(1, self.terms.len()) - 1;
        let (a, b) = (self.edges[k], self.edges[k + 1]);
        let z = (2.0 * theta - a - b) / (b - a);
        legendre_at(z).iter().zip(&self.terms[k]).map(|(p, c)| p * c).sum()
    }
}

/// θ of s² = sin²(θ/2).
fn angle(s2: f64) -> f64 {
    2.0 * s2.clamp(0.0, 1.0).sqrt().asin()
}

/// P_0 … P_15 at z.
fn legendre_at(z: f64) -> [f64; NODES] {
    let mut p = [1.0; NODES];
    p[1] = z;
    for l in 2..NODES {
        let n = l as f64;
        p[l] = ((2.0 * n - 1.0) * z * p[l - 1] - (n - 1.0) * p[l - 2]) / n;
    }
    p
}

impl Zonal for Radial {
    fn value(&self, x: f64) -> f64 {
        self.at(angle(0.5 * (1.0 - x)))
    }

    fn fill(&self, s2: &[f32], out: &mut [f32]) {
        self.cells.fill(s2, out, |s2| self.at(angle(f64::from(s2))) as f32);
    }

    fn width(&self) -> f64 {
        self.width
    }

    /// Gauss–Legendre quadrature in each panel; a panel is divided so that the phase of P_order advances by
    /// at most 20 radians a part.
    fn coefficients(&self, order: usize) -> Vec<f64> {
        // Degree 15 times a wave of 20 radians to 4e-14.
        const RULE: usize = 32;
        let (nodes, weights) = gauss_legendre(RULE);
        let mut points = Vec::new();
        for (edges, c) in self.edges.windows(2).zip(&self.terms) {
            let (a, h) = (edges[0], edges[1] - edges[0]);
            let parts = (order as f64 * h / 20.0).ceil().max(1.0);
            for part in 0..parts as usize {
                for (z, w) in nodes.iter().zip(&weights) {
                    // The place in the panel, −1 … 1.
                    let z = (2.0 * part as f64 + 1.0 + z) / parts - 1.0;
                    let k: f64 = legendre_at(z).iter().zip(c).map(|(p, c)| p * c).sum();
                    let (sin, x) = (a + 0.5 * h * (z + 1.0)).sin_cos();
                    points.push((x, 2.0 * PI * k * sin * 0.5 * h / parts * w));
                }
            }
        }
        legendre::moments(&points, order)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lobe;

    #[test]
    fn known_kernels_come_back() {
        for lobe in
            [Lobe::ggx(0.01), Lobe::ggx(0.5), Lobe::beckmann(0.1), Lobe::lambert(), Lobe::charlie(0.3)]
        {
            let radial = Radial::new(|theta| 3.0 * lobe.value(theta.cos())).unwrap();
            assert!(radial.accuracy() < 1e-6, "{lobe:?}: {:e}", radial.accuracy());
            for (l, (a, b)) in radial.coefficients(400).iter().zip(lobe.coefficients(400)).enumerate() {
                assert!((a - b).abs() < 2e-8, "{lobe:?}, band {l}: {a} {b}");
            }
            for x in [1.0, 0.9999, 0.9, 0.3, 0.0, -0.5] {
                assert!(
                    (radial.value(x) - lobe.value(x)).abs() < 1e-6 * lobe.value(1.0).max(1.0),
                    "{lobe:?} {x}"
                );
            }
        }
    }

    #[test]
    fn single_precision_is_the_same_kernel() {
        let lobe = Lobe::ggx(3e-3);
        let radial = Radial::new(|theta| lobe.value(theta.cos())).unwrap();
        let s2: Vec<f32> = (0..5000).map(|k| (k as f32 / 4999.0).powi(5)).collect();
        let mut out = vec![0.0; s2.len()];
        radial.fill(&s2, &mut out);
        for (s2, got) in s2.iter().zip(&out) {
            let exact = radial.value(1.0 - 2.0 * f64::from(*s2));
            let off = (f64::from(*got) - exact).abs();
            assert!(off < 1e-6 * exact + 4e-9 * lobe.value(1.0), "{s2}: {got} {exact}");
        }
    }

    #[test]
    fn steps_are_found_and_faults_are_none() {
        let radial = Radial::new(|theta| if theta < 0.3 { 1.0 } else { 0.0 }).unwrap();
        let cap = 2.0 * PI * (1.0 - 0.3_f64.cos());
        assert!((radial.value(0.99) * cap - 1.0).abs() < 1e-4);
        assert!(radial.accuracy() < 1e-3);
        assert!(Radial::new(|_| 0.0).is_none());
        assert!(Radial::new(|_| f64::NAN).is_none());
    }
}

//! A texel of a lat-long light: a rectangle in θ and φ, over which the light is constant.

use super::small_light::{MOST_NODES, rule};
use crate::Zonal;
use glam::DVec3;
use std::f64::consts::PI;

/// θ (from +Y) and φ = atan2(z, x) of a texel's borders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Polar angles, the smaller first.
    pub theta: [f64; 2],
    /// Azimuths, the smaller first.
    pub phi: [f64; 2],
}

/// The direction at polar angle θ and azimuth φ.
fn direction(theta: f64, phi: f64) -> DVec3 {
    let ((s, c), (sin, cos)) = (theta.sin_cos(), phi.sin_cos());
    DVec3::new(s * cos, c, s * sin)
}

/// Nodes along each side of a cell of size `ratio` times the scale of a function. Kernels have their nearest
/// pole, or a Gaussian's equivalent, about two scales off: Gauss–Legendre rules then leave 2e-5 (one node) to
/// 1e-6 of the value.
pub(crate) fn nodes_for(ratio: f64) -> usize {
    // Of one node, two and so on. Of 1/(1 + r²/4), its square and a Gaussian, on squares up to three scales
    // off, one and two nodes miss 2e-5 of the peak at most, more of them 2e-6.
    const MAX_RATIOS: [f64; 7] = [0.015, 0.3, 0.6, 1.0, 1.6, 2.2, 3.0];
    1 + MAX_RATIOS.iter().take_while(|r| ratio > **r).count()
}

/// Where a kernel has a step, no rule converges quickly; cells are then divided to this size, radians, at
/// which the errors along the step add up to about 1e-5.
const STEP: f64 = 0.004;

/// The scale to which a kernel's step at the rim of its support needs cells divided: infinite where it has
/// none. Sheen rises towards the horizon, and much of it lies within a hundredth of a radian of it.
pub(crate) fn step_scale(kernel: &dyn Zonal) -> f64 {
    let support = kernel.support().min(PI);
    let at = |theta: f64| kernel.value(theta.cos()).abs();
    let peak = (0..=64).map(|k| at(support * f64::from(k) / 64.0)).fold(0.0, f64::max);
    if support < PI && at(support - 0.01_f64.min(0.1 * support)) > 0.05 * peak { STEP } else { f64::INFINITY }
}

impl Cell {
    /// The cell of texel (i, j).
    pub fn texel(i: usize, j: usize, width: usize, height: usize) -> Self {
        let theta = |j: usize| PI * j as f64 / height as f64;
        let phi = |i: usize| 2.0 * PI * i as f64 / width as f64 - PI;
        Self { theta: [theta(j), theta(j + 1)], phi: [phi(i), phi(i + 1)] }
    }

    fn sides(&self) -> [f64; 2] {
        [self.theta[1] - self.theta[0], self.phi[1] - self.phi[0]]
    }

    /// ∫ dω.
    pub fn solid_angle(&self) -> f64 {
        let [height, width] = self.sides();
        2.0 * width * (0.5 * (self.theta[0] + self.theta[1])).sin() * (0.5 * height).sin()
    }

    /// The direction at half of both angles.
    pub fn centre(&self) -> DVec3 {
        direction(0.5 * (self.theta[0] + self.theta[1]), 0.5 * (self.phi[0] + self.phi[1]))
    }

    /// The longer of its two extents, radians.
    pub(crate) fn size(&self) -> f64 {
        let [height, width] = self.sides();
        height.max(width * self.widest())
    }

    /// The largest sin θ.
    fn widest(&self) -> f64 {
        let [a, b] = self.theta;
        if a < 0.5 * PI && b > 0.5 * PI { 1.0 } else { a.sin().max(b.sin()) }
    }

    /// Directions and weights (of sum 1) of a product of two Gauss–Legendre rules.
    pub(crate) fn nodes(&self, n: usize, put: &mut impl FnMut(DVec3, f64)) {
        let (x, w) = rule(n);
        let at = |[a, b]: [f64; 2], x: f64| 0.5 * (a + b) + 0.5 * (b - a) * x;
        let all: f64 = x.iter().zip(w).map(|(x, w)| w * at(self.theta, *x).sin()).sum();
        let mut turns = [(0.0, 0.0); MOST_NODES];
        turns.iter_mut().zip(x).for_each(|(turn, x)| *turn = at(self.phi, *x).sin_cos());
        for (xt, wt) in x.iter().zip(w) {
            let (s, c) = at(self.theta, *xt).sin_cos();
            for ((sin, cos), wp) in turns.iter().zip(w) {
                put(DVec3::new(s * cos, c, s * sin), 0.5 * wp * wt * s / all);
            }
        }
    }

    /// Directions and weights (of sum Ω) that integrate a kernel about `d` that varies over `width` at its
    /// peak and, beyond, over its distance, but nowhere over more than `most`.
    pub(crate) fn leaves(&self, d: DVec3, width: f64, most: f64, put: &mut impl FnMut(DVec3, f64)) {
        let (size, [height, turn]) = (self.size(), self.sides());
        let near = self.centre().distance(d) - 0.75 * size;
        let ratio = size / width.max(0.5 * near).min(most);
        if ratio <= 1.0 && turn <= 1.0 {
            let omega = self.solid_angle();
            return self.nodes(nodes_for(ratio), &mut |d, w| put(d, w * omega));
        }
        let halves = |[a, b]: [f64; 2], split: bool| {
            let m = 0.5 * (a + b);
            if split { vec![[a, m], [m, b]] } else { vec![[a, b]] }
        };
        let tall = ratio > 1.0 && height > 0.5 * size;
        for theta in halves(self.theta, tall) {
            for phi in halves(self.phi, turn > 1.0 || ratio > 1.0 && turn * self.widest() > 0.5 * size) {
                Self { theta, phi }.leaves(d, width, most, put);
            }
        }
    }

    /// ∫ K(d·w) dω over the cell.
    pub(crate) fn integral(&self, kernel: &dyn Zonal, d: DVec3, most: f64) -> f64 {
        let mut sum = 0.0;
        self.leaves(d, kernel.width(), most, &mut |w, omega| sum += omega * kernel.value(d.dot(w)));
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lobe;

    /// The cells of a whole image integrate to the whole kernel, however narrow it is, and the parts of a
    /// cell to the cell.
    #[test]
    fn cells_hold_their_part_of_a_kernel() {
        let d = DVec3::new(0.3, 0.81, -0.2).normalize();
        for kernel in
            [Lobe::ggx(1e-3), Lobe::ggx(0.05), Lobe::gaussian(1e-4), Lobe::phong(60.0), Lobe::ggx(0.6)]
        {
            for (width, height) in [(1, 1), (3, 2), (8, 4), (64, 32)] {
                let cells = || (0..width * height).map(|k| Cell::texel(k % width, k / width, width, height));
                let sum: f64 = cells().map(|c| c.integral(&kernel, d, f64::INFINITY)).sum();
                assert!((sum - 1.0).abs() < 1e-4, "{kernel:?} {width} {height}: {sum}");
                let omega: f64 = cells().map(|c| c.solid_angle()).sum();
                assert!((omega - 4.0 * PI).abs() < 1e-12, "{omega}");
            }
        }
    }
}

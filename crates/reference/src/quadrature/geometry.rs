//! Rectangles in (φ, θ) and the charts that lay them on the sphere.

use super::legendre::{CHECKS, N, RULE};
use glam::DVec3;

/// A rectangle of azimuths φ and polar angles θ of one [`Chart`]; radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Rect {
    /// φ from, to.
    pub phi: [f64; 2],
    /// θ from, to; within [0, π].
    pub theta: [f64; 2],
}

/// An axis of a rectangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axis {
    /// Azimuth.
    Phi,
    /// Polar angle.
    Theta,
}

impl Rect {
    /// Extents in φ and θ.
    pub fn size(&self) -> [f64; 2] {
        [self.phi[1] - self.phi[0], self.theta[1] - self.theta[0]]
    }

    /// The two halves of the rectangle.
    pub fn halves(&self, axis: Axis) -> [Self; 2] {
        let mut out = [*self; 2];
        match axis {
            Axis::Phi => {
                let m = 0.5 * (self.phi[0] + self.phi[1]);
                (out[0].phi[1], out[1].phi[0]) = (m, m);
            }
            Axis::Theta => {
                let m = 0.5 * (self.theta[0] + self.theta[1]);
                (out[0].theta[1], out[1].theta[0]) = (m, m);
            }
        }
        out
    }

    /// The middle.
    pub fn centre(&self) -> [f64; 2] {
        [0.5 * (self.phi[0] + self.phi[1]), 0.5 * (self.theta[0] + self.theta[1])]
    }
}

/// A rectangle with derived quantities that take trigonometry. Angles come as sine and cosine.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    /// The rectangle.
    pub rect: Rect,
    /// φ and θ of its middle.
    middle: [(f64, f64); 2],
    /// φ of both ends, and θ of both.
    pub ends: [[(f64, f64); 2]; 2],
    /// Largest angular extents on the sphere along φ and θ.
    pub angular: [f64; 2],
    /// The direction of its middle, in the chart's coordinates.
    pub centre: DVec3,
    /// Upper bound of the distance of any point of the rectangle from its middle, as a chord between unit
    /// vectors and as an angle.
    pub reach: f64,
}

impl Patch {
    /// The patch of a rectangle. The squared chord between (φ, θ) and (φ', θ') is 4 sin²(Δθ/2) + 4 sin θ sin
    /// θ' sin²(Δφ/2).
    pub fn new(rect: Rect) -> Self {
        let (centre, [dphi, dtheta]) = (rect.centre(), rect.size());
        let middle = centre.map(f64::sin_cos);
        let ends = [0, 1].map(|k| {
            let half = 0.5 * [dphi, dtheta][k];
            [-half, half].map(|d| beside(middle[k], centre[k], d))
        });
        let angular = [widest_sine(rect.theta, ends[1].map(|(sin, _)| sin)) * dphi, dtheta];
        let reach = 0.5 * (angular[0] * angular[0] + dtheta * dtheta).sqrt();
        Self { rect, middle, ends, angular, centre: spherical(middle[0], middle[1]), reach }
    }

    /// The axis along which it is longer on the sphere; azimuth while it spans more than a quadrant.
    pub fn long_axis(&self) -> Axis {
        let [a, b] = self.angular;
        if a >= b || (self.rect.size()[0] > 0.51 * std::f64::consts::PI && a > 1e-9) {
            Axis::Phi
        } else {
            Axis::Theta
        }
    }
}

/// The largest sine over an interval of [0, π] with the sines of its ends.
fn widest_sine(theta: [f64; 2], sines: [f64; 2]) -> f64 {
    let right = std::f64::consts::FRAC_PI_2;
    if theta[0] <= right && right <= theta[1] { 1.0 } else { sines[0].max(sines[1]) }
}

/// Sample points of an integrand on a rectangle, in the chart's coordinates.
#[derive(Debug, Clone)]
pub(super) struct Nodes {
    /// cos φ and sin φ of the Gauss rule's columns.
    azimuths: [[f64; 2]; N],
    /// sin θ and cos θ of its rows.
    polars: [[f64; 2]; N],
    /// The check points, and sin θ there.
    checks: [(DVec3, f64); CHECKS.len()],
}

impl Nodes {
    /// Nodes of a rectangle.
    pub fn new(patch: &Patch) -> Self {
        let ([cp, ct], [hp, ht]) = (patch.rect.centre(), patch.rect.size().map(|s| 0.5 * s));
        let [phi, theta] = patch.middle;
        let check = |[x, y]: [f64; 2]| {
            let theta = beside(theta, ct, ht * y);
            (spherical(beside(phi, cp, hp * x), theta), theta.0)
        };
        Self {
            azimuths: RULE.x.map(|x| beside(phi, cp, hp * x)).map(|(sin, cos)| [cos, sin]),
            polars: RULE.x.map(|x| beside(theta, ct, ht * x)).map(|(sin, cos)| [sin, cos]),
            checks: CHECKS.map(check),
        }
    }

    /// All local directions, those of the Gauss rule first, by columns; and sin θ there.
    pub fn directions(&self, chart: &Chart) -> ([DVec3; SAMPLES], [f64; SAMPLES]) {
        let (mut wi, mut sines) = ([DVec3::ZERO; SAMPLES], [0.0; SAMPLES]);
        for (a, [cos, sin]) in self.azimuths.iter().enumerate() {
            let column = chart.x * *cos + chart.z * *sin;
            for (b, [sin, cos]) in self.polars.iter().enumerate() {
                wi[a * N + b] = column * *sin + chart.y * *cos;
                sines[a * N + b] = *sin;
            }
        }
        for (k, (d, sine)) in self.checks.iter().enumerate() {
            (wi[N * N + k], sines[N * N + k]) = (chart.at(*d), *sine);
        }
        (wi, sines)
    }
}

/// Sine and cosine of `a` + `d` from those of `a`: for small d by the addition theorem and Taylor
/// polynomials, whose errors of d¹³/13! and d¹²/12! are at most rounding; several times as fast as the
/// library's.
pub(super) fn beside((sin, cos): (f64, f64), a: f64, d: f64) -> (f64, f64) {
    // Radians: 0.25¹²/12! = 1.2e-16, half a unit in the last place of a cosine near 1.
    const MAX_STEP: f64 = 0.25;
    if d.abs() > MAX_STEP {
        return (a + d).sin_cos();
    }
    let q = -d * d;
    // Σ q^k/(2k + 1)! and Σ q^k/(2k)!; divisions would take most of the time.
    let over = |k: f64| q * (1.0 / k);
    let s = d
        * (1.0
            + over(6.0) * (1.0 + over(20.0) * (1.0 + over(42.0) * (1.0 + over(72.0) * (1.0 + over(110.0))))));
    let c =
        1.0 + over(2.0) * (1.0 + over(12.0) * (1.0 + over(30.0) * (1.0 + over(56.0) * (1.0 + over(90.0)))));
    (sin * c + cos * s, cos * c - sin * s)
}

/// Points of the Gauss rule, and check points.
pub(super) const SAMPLES: usize = N * N + CHECKS.len();

/// A chart's direction from sine and cosine of φ and of θ.
pub(super) fn spherical((sp, cp): (f64, f64), (st, ct): (f64, f64)) -> DVec3 {
    DVec3::new(st * cp, ct, st * sp)
}

/// Polar coordinates laid on the sphere, seen from the shading frame: direction(φ, θ) =
/// sin θ (cos φ · x + sin φ · z) + cos θ · y, all in local coordinates (the shading normal is +z there).
#[derive(Debug, Clone, Copy)]
pub(super) struct Chart {
    /// Local direction of φ = 0, θ = π/2.
    pub x: DVec3,
    /// Local direction of the pole θ = 0.
    pub y: DVec3,
    /// Local direction of φ = π/2, θ = π/2.
    pub z: DVec3,
}

impl Chart {
    /// Polar coordinates about the local direction `pole`.
    pub fn about(pole: DVec3) -> Self {
        let x = pole.any_orthonormal_vector();
        Self { x, y: pole, z: x.cross(pole) }
    }

    /// The local direction of one in the chart's coordinates.
    pub fn at(&self, d: DVec3) -> DVec3 {
        self.x * d.x + self.y * d.y + self.z * d.z
    }

    /// The local direction at (φ, θ).
    pub fn direction(&self, phi: f64, theta: f64) -> DVec3 {
        self.at(spherical(phi.sin_cos(), theta.sin_cos()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_beside_one_that_is_known_are_exact_to_rounding() {
        for k in 0..=2000 {
            let (a, d) = (f64::from(k) * 0.0031 - 3.1, f64::from(k % 201 - 100) * 2.6e-3);
            let ((s, c), (sine, cosine)) = (beside(a.sin_cos(), a, d), (a + d).sin_cos());
            assert!((s - sine).abs() < 5e-16 && (c - cosine).abs() < 5e-16, "{a} {d}");
        }
    }
}

//! Rectangles in (φ, θ) and the charts that lay them on the sphere.

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

    /// Largest angular extents on the sphere along φ and θ.
    pub fn angular(&self) -> [f64; 2] {
        let [dphi, dtheta] = self.size();
        [widest_sine(self.theta) * dphi, dtheta]
    }

    /// The axis along which it is longer on the sphere; azimuth while it spans more than a quadrant.
    pub fn long_axis(&self) -> Axis {
        let [a, b] = self.angular();
        if a >= b || (self.size()[0] > 0.51 * std::f64::consts::PI && a > 1e-9) {
            Axis::Phi
        } else {
            Axis::Theta
        }
    }

    /// Its halves.
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

/// The largest sine over an interval of [0, π].
fn widest_sine(theta: [f64; 2]) -> f64 {
    let right = std::f64::consts::FRAC_PI_2;
    if theta[0] <= right && right <= theta[1] { 1.0 } else { theta[0].sin().max(theta[1].sin()) }
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

    /// The local direction at (φ, θ).
    pub fn direction(&self, phi: f64, theta: f64) -> DVec3 {
        let ((sp, cp), (st, ct)) = (phi.sin_cos(), theta.sin_cos());
        (self.x * cp + self.z * sp) * st + self.y * ct
    }
}

//! Sample / pdf / invert triples on the sphere, and the point sets that feed them.
//!
//! Each triple maps the unit square to directions with a known density: `sample(u)` gives the direction,
//! `pdf` its density per steradian (per area for the disk), `invert` the `u` that it came from. Local frames
//! have z as the normal.

mod distribution;
mod points;

pub use distribution::{Distribution1d, SphereDistribution};
pub use points::{Pcg32, R2, hammersley};

use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Azimuth in [0, 1).
fn turn(x: f64, y: f64) -> f64 {
    let phi = y.atan2(x) / TAU;
    let phi = if phi < 0.0 { phi + 1.0 } else { phi };
    if phi >= 1.0 { 0.0 } else { phi }
}

/// The direction with height z and azimuth 2πu; `one_minus_z` keeps the sine exact near the pole.
fn direction(one_minus_z: f64, u: f64) -> DVec3 {
    let r = (one_minus_z * (2.0 - one_minus_z)).max(0.0).sqrt();
    let (s, c) = (TAU * u).sin_cos();
    DVec3::new(r * c, r * s, 1.0 - one_minus_z)
}

/// Uniform over the sphere: z = 1 − 2u.
pub mod sphere {
    use super::{DVec2, DVec3, PI, direction, turn};

    /// The direction of `u` in [0, 1)².
    pub fn sample(u: DVec2) -> DVec3 {
        direction(2.0 * u.x, u.y)
    }

    /// 1/4π.
    pub fn pdf() -> f64 {
        0.25 / PI
    }

    /// The inverse of [`sample`].
    pub fn invert(d: DVec3) -> DVec2 {
        DVec2::new(0.5 * (1.0 - d.z), turn(d.x, d.y))
    }
}

/// Uniform over the hemisphere z ≥ 0: z = 1 − u.
pub mod hemisphere {
    use super::{DVec2, DVec3, TAU, direction, turn};

    /// The direction of `u` in [0, 1)².
    pub fn sample(u: DVec2) -> DVec3 {
        direction(u.x, u.y)
    }

    /// 1/2π above the horizon.
    pub fn pdf(d: DVec3) -> f64 {
        if d.z >= 0.0 { 1.0 / TAU } else { 0.0 }
    }

    /// The inverse of [`sample`].
    pub fn invert(d: DVec3) -> DVec2 {
        DVec2::new(1.0 - d.z, turn(d.x, d.y))
    }
}

/// Cosine-weighted over the hemisphere z ≥ 0: z = √(1 − u) (Malley's method: uniform over the disk, projected
/// upwards).
pub mod cosine_hemisphere {
    use super::{DVec2, DVec3, PI, TAU, turn};

    /// The direction of `u` in [0, 1)².
    pub fn sample(u: DVec2) -> DVec3 {
        let (s, c) = (TAU * u.y).sin_cos();
        let r = u.x.sqrt();
        DVec3::new(r * c, r * s, (1.0 - u.x).max(0.0).sqrt())
    }

    /// cos θ/π.
    pub fn pdf(d: DVec3) -> f64 {
        d.z.max(0.0) / PI
    }

    /// The inverse of [`sample`].
    pub fn invert(d: DVec3) -> DVec2 {
        DVec2::new(d.x * d.x + d.y * d.y, turn(d.x, d.y))
    }
}

/// Uniform over the cone of half-angle ρ about z. Take `versine` = 1 − cos ρ = 2 sin²(ρ/2), which stays exact
/// for small cones such as the sun's.
pub mod cone {
    use super::{DVec2, DVec3, TAU, direction, turn};

    /// 1 − cos ρ.
    pub fn versine(angle: f64) -> f64 {
        2.0 * (0.5 * angle).sin().powi(2)
    }

    /// The direction of `u` in [0, 1)².
    pub fn sample(versine: f64, u: DVec2) -> DVec3 {
        direction(versine * u.x, u.y)
    }

    /// 1/(2π(1 − cos ρ)) inside, 0 outside.
    pub fn pdf(versine: f64, d: DVec3) -> f64 {
        if one_minus_z(d) <= versine { 1.0 / (TAU * versine) } else { 0.0 }
    }

    /// The inverse of [`sample`].
    pub fn invert(versine: f64, d: DVec3) -> DVec2 {
        DVec2::new(one_minus_z(d) / versine, turn(d.x, d.y))
    }

    /// 1 − z of a unit vector without cancellation near the axis.
    fn one_minus_z(d: DVec3) -> f64 {
        if d.z > 0.0 { (d.x * d.x + d.y * d.y) / (1.0 + d.z) } else { 1.0 - d.z }
    }
}

/// Uniform over the unit disk by Shirley & Chiu's concentric map (1997), which keeps neighbours together.
pub mod disk {
    use super::{DVec2, PI};
    use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

    /// The point of `u` in [0, 1)².
    pub fn sample(u: DVec2) -> DVec2 {
        let p = 2.0 * u - DVec2::ONE;
        if p == DVec2::ZERO {
            return p;
        }
        let (r, phi) = if p.x.abs() > p.y.abs() {
            (p.x, FRAC_PI_4 * p.y / p.x)
        } else {
            (p.y, FRAC_PI_2 - FRAC_PI_4 * p.x / p.y)
        };
        let (s, c) = phi.sin_cos();
        DVec2::new(r * c, r * s)
    }

    /// 1/π inside.
    pub fn pdf(p: DVec2) -> f64 {
        if p.length_squared() <= 1.0 { 1.0 / PI } else { 0.0 }
    }

    /// The inverse of [`sample`].
    pub fn invert(p: DVec2) -> DVec2 {
        let r = p.length();
        let q = if p.x.abs() > p.y.abs() {
            let r = r.copysign(p.x);
            DVec2::new(r, r * (p.y / p.x).atan() / FRAC_PI_4)
        } else if p.y != 0.0 {
            let r = r.copysign(p.y);
            DVec2::new(r * (p.x / p.y).atan() / FRAC_PI_4, r)
        } else {
            DVec2::ZERO
        };
        0.5 * (q + DVec2::ONE)
    }
}

#[cfg(test)]
mod tests;

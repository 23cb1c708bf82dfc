//! Lights that are not images.

use crate::Environment;
use glam::{DVec3, Vec3};
use std::sync::Arc;

/// The largest radiance (W sr⁻¹ m⁻²), irradiance or intensity that is computed with; of a sun it is some 1e7.
/// Filters multiply it with lobes of up to 1e8 sr⁻¹ (`n` = 1e8, `alpha` = 1e-4) in single precision, which
/// ends at 3.4e38.
pub const LARGEST: f64 = 1e30;

/// Light that cannot be computed with.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Unsound {
    /// A texel is NaN, infinite, or beyond [`LARGEST`].
    #[error("the environment's texel ({i}, {j}) is {value:e}: radiance must be finite, {LARGEST:e} at most")]
    Texel {
        /// Column.
        i: usize,
        /// Row.
        j: usize,
        /// What it holds.
        value: f32,
    },
    /// A light other than the image has values that are not finite, negative or too large, or no direction or
    /// position.
    #[error("a {0} light is not finite, is beyond {LARGEST:e}, or has no direction")]
    Light(&'static str),
}

/// A point light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointLight {
    /// Position, metres.
    pub position: Vec3,
    /// Radiant intensity, W sr⁻¹.
    pub intensity: [f32; 3],
}

/// Light from one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionalLight {
    /// Unit direction towards the light.
    pub direction: DVec3,
    /// Irradiance on a surface that faces it, W m⁻².
    pub irradiance: [f64; 3],
}

/// A distant disk of constant radiance, such as the sun.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DiskLight {
    /// Unit direction towards its centre.
    pub direction: DVec3,
    /// Angular radius, radians (the sun's is about 0.00465).
    pub angular_radius: f64,
    /// Radiance, W sr⁻¹ m⁻².
    pub radiance: [f64; 3],
}

impl DiskLight {
    /// Disks of a larger angular radius, radians, count as sky. The rules for exact shading assume lights
    /// that are small relative to the hemisphere and, on GPUs, to the lobe.
    pub const WIDEST_SUN: f64 = 0.35;

    /// Solid angle, steradians: 2π(1 − cos ρ) = 4π sin²(ρ/2).
    pub fn solid_angle(&self) -> f64 {
        let s = (0.5 * self.angular_radius).sin();
        4.0 * std::f64::consts::PI * s * s
    }
}

/// All light of a scene; each part may be absent.
#[derive(Debug, Clone, Default)]
pub struct Lights {
    /// Distant light as an image.
    pub environment: Option<Arc<Environment>>,
    /// Suns.
    pub disks: Vec<DiskLight>,
    /// Directional lights.
    pub directionals: Vec<DirectionalLight>,
    /// Point lights.
    pub points: Vec<PointLight>,
    /// Distant lights whose direct light is shaded separately, not by the technique's data. The data hold
    /// only their light reflected between surfaces; nothing, for techniques without interreflection.
    pub apart: Option<Arc<Lights>>,
}

impl Lights {
    /// Is all light finite, and no stronger than [`LARGEST`]? Then no filter overflows.
    pub fn check(&self) -> Result<(), Unsound> {
        if let Some(image) = self.environment.as_ref().map(|e| &e.image) {
            for plane in &image.planes {
                if let Some(k) = plane.iter().position(|v| !sound(f64::from(*v))) {
                    let (i, j) = (k % image.width.max(1), k / image.width.max(1));
                    return Err(Unsound::Texel { i, j, value: plane[k] });
                }
            }
        }
        let direction = |d: DVec3| d.is_finite() && d != DVec3::ZERO;
        let all = |v: [f64; 3]| v.into_iter().all(sound);
        let disk = |d: &DiskLight| direction(d.direction) && d.angular_radius.is_finite() && all(d.radiance);
        if !self.disks.iter().all(disk) {
            return Err(Unsound::Light("disk"));
        }
        if !self.directionals.iter().all(|d| direction(d.direction) && all(d.irradiance)) {
            return Err(Unsound::Light("directional"));
        }
        if !self.points.iter().all(|p| p.position.is_finite() && all(p.intensity.map(f64::from))) {
            return Err(Unsound::Light("point"));
        }
        Ok(())
    }
}

/// Is it finite, and no larger than [`LARGEST`]?
pub(crate) fn sound(v: f64) -> bool {
    v.abs() <= LARGEST
}

impl From<Environment> for Lights {
    fn from(e: Environment) -> Self {
        Self { environment: Some(Arc::new(e)), ..Self::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sphere::{Layout, SphereImage};

    #[test]
    fn light_is_finite_and_no_larger_than_the_bound() {
        let of = |value: f32| {
            let mut image = SphereImage::new(Layout::LatLong, 8, 4);
            image.planes[1][8 + 3] = value;
            Lights::from(Environment { image }).check()
        };
        for value in [0.0, -9.9e29, 9.9e29] {
            assert_eq!(of(value), Ok(()));
        }
        for value in [1.1e30, -1e38, f32::INFINITY] {
            assert_eq!(of(value), Err(Unsound::Texel { i: 3, j: 1, value }));
        }
        assert!(of(f32::NAN).is_err_and(|e| e.to_string().contains("texel (3, 1) is NaN")));
        let disk = |radiance: f64, direction: DVec3| {
            let disk = DiskLight { direction, angular_radius: 0.1, radiance: [radiance; 3] };
            Lights { disks: vec![disk], ..Lights::default() }.check()
        };
        assert_eq!(disk(1e30, DVec3::Y), Ok(()));
        for (radiance, direction) in [(1e31, DVec3::Y), (f64::NAN, DVec3::Y), (1.0, DVec3::ZERO)] {
            assert_eq!(disk(radiance, direction), Err(Unsound::Light("disk")));
        }
        let directional = DirectionalLight { direction: DVec3::Y, irradiance: [0.0, -2e30, 0.0] };
        let lights = Lights { directionals: vec![directional], ..Lights::default() };
        assert_eq!(lights.check(), Err(Unsound::Light("directional")));
        let point = PointLight { position: Vec3::NAN, intensity: [1.0; 3] };
        let lights = Lights { points: vec![point], ..Lights::default() };
        assert_eq!(lights.check(), Err(Unsound::Light("point")));
    }
}

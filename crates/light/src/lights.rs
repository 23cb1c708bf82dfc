//! Lights that are not images.

use crate::Environment;
use glam::{DVec3, Vec3};
use std::sync::Arc;

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
}

impl From<Environment> for Lights {
    fn from(e: Environment) -> Self {
        Self { environment: Some(Arc::new(e)), ..Self::default() }
    }
}

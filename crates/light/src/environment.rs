//! Distant light as an image on the sphere.

use glam::{DMat3, DVec3};
use steradian_sphere::SphereImage;

/// Distant light: a lat-long image in Steradian's convention (linear Rec. 709 radiance, W sr⁻¹ m⁻²).
///
/// Other layouts are resampled when an environment is made of them (area-exact). Suns that are known apart
/// from the image live beside it, in [`crate::Lights::disks`].
#[derive(Debug, Clone)]
pub struct Environment {
    /// Lat-long radiance.
    pub image: SphereImage,
}

impl Environment {
    /// The texel (as piecewise constant) that direction `d` sees.
    pub fn radiance(&self, d: DVec3) -> [f32; 3] {
        self.image.nearest(d)
    }

    /// The environment turned by `rotation`.
    pub fn rotated(&self, rotation: DMat3) -> Self {
        Self { image: self.image.rotate(rotation) }
    }
}

//! Distant light as an image on the sphere.

use crate::load::latlong_size;
use glam::{DMat3, DVec3};
use steradian_sphere::{Layout, SphereImage};

/// Distant light: a lat-long image in Steradian's convention (linear Rec. 709 radiance, W sr⁻¹ m⁻²).
///
/// Other layouts are resampled when an environment is made of them (area-exact). Suns that are not part of
/// the image are in [`crate::Lights::disks`].
#[derive(Debug, Clone)]
pub struct Environment {
    /// Lat-long radiance.
    pub image: SphereImage,
}

impl Environment {
    /// An environment of an image in any layout: moved where it is lat-long, else resampled.
    pub fn from_image(image: SphereImage) -> Self {
        if image.layout == Layout::LatLong {
            return Self { image };
        }
        let (w, h) = latlong_size(image.layout, image.width, image.height);
        Self { image: image.resample(Layout::LatLong, w, h) }
    }

    /// The texel (as piecewise constant) that direction `d` sees.
    pub fn radiance(&self, d: DVec3) -> [f32; 3] {
        self.image.nearest(d)
    }

    /// The environment turned by `rotation`.
    pub fn rotated(&self, rotation: DMat3) -> Self {
        Self { image: self.image.rotate(rotation) }
    }
}

//! Whole lights made, turned and scaled; disks drawn into images.

use crate::suns::luminance;
use crate::{DiskLight, Environment, Lights};
use glam::DMat3;
use std::sync::Arc;
use steradian_sphere::layout::Position;
use steradian_sphere::{Layout, SphereImage};

impl Lights {
    /// The lights of a sky spec ([`crate::sky`]) with an image of `size`: a sun stays a disk light, outside
    /// the image.
    pub fn of_sky(spec: &str, size: (usize, usize)) -> Result<Self, crate::sky::SkyError> {
        let sky = crate::sky::by_name(spec, size.0, size.1)?;
        let environment = Some(Arc::new(Environment { image: sky.image }));
        Ok(Self { environment, disks: sky.sun.into_iter().collect(), ..Self::default() })
    }

    /// Turns everything distant by `degrees` about +Y and multiplies it by `gain`. Point lights have
    /// positions in the scene and stay as they are.
    pub fn adjust(&mut self, degrees: f64, gain: f64) {
        let rotation = about_y(degrees);
        if let Some(e) = self.environment.take() {
            let mut image = Arc::try_unwrap(e).unwrap_or_else(|e| (*e).clone()).image;
            if degrees != 0.0 {
                image = turned_about_y(&image, degrees);
            }
            scale(&mut image, gain);
            self.environment = Some(Arc::new(Environment { image }));
        }
        for d in &mut self.disks {
            d.direction = (rotation * d.direction).normalize();
            d.radiance = d.radiance.map(|c| c * gain);
        }
        for d in &mut self.directionals {
            d.direction = (rotation * d.direction).normalize();
            d.irradiance = d.irradiance.map(|c| c * gain);
        }
    }

    /// The image; a black one where there is none.
    pub fn into_image(self) -> SphereImage {
        let black = || SphereImage::new(Layout::LatLong, 64, 32);
        self.environment.map_or_else(black, |e| Arc::try_unwrap(e).unwrap_or_else(|e| (*e).clone()).image)
    }

    /// The image with the disks drawn into it: a texel holds the part of each disk that covers it.
    pub fn with_disks_drawn(&self) -> SphereImage {
        let black = || SphereImage::new(Layout::LatLong, 1024, 512);
        let mut image = self.environment.as_ref().map_or_else(black, |e| e.image.clone());
        for d in &self.disks {
            splat(&mut image, d);
        }
        image
    }
}

/// The part of an image's luminous flux that is lost where radiance is clipped to `most`.
pub fn share_beyond(image: &SphereImage, most: f64) -> f64 {
    let whole = luminance(image.integral());
    let mut beyond = image.clone();
    beyond.planes.iter_mut().flatten().for_each(|v| *v = (f64::from(*v) - most).max(0.0) as f32);
    if whole > 0.0 { luminance(beyond.integral()) / whole } else { 0.0 }
}

/// The rotation by `degrees` about +Y.
pub fn about_y(degrees: f64) -> DMat3 {
    DMat3::from_rotation_y(degrees.to_radians())
}

/// Multiplies every texel.
pub fn scale(image: &mut SphereImage, gain: f64) {
    if gain != 1.0 {
        image.planes.iter_mut().flatten().for_each(|v| *v = (f64::from(*v) * gain) as f32);
    }
}

/// Rotation about +Y. Lat-long images turn by whole texels where the angle allows: nothing is resampled then.
pub fn turned_about_y(image: &SphereImage, degrees: f64) -> SphereImage {
    let texels = degrees / 360.0 * image.width as f64;
    if image.layout != Layout::LatLong || (texels - texels.round()).abs() > 1e-6 {
        return image.rotate(about_y(degrees));
    }
    // Rotation by φ about +Y takes azimuth atan2(z, x) to itself less φ: the columns move to the left.
    let shift = (texels.round() as i64).rem_euclid(image.width as i64) as usize;
    let mut out = image.clone();
    for plane in &mut out.planes {
        plane.chunks_exact_mut(image.width).for_each(|row| row.rotate_left(shift));
    }
    out
}

/// Adds a disk to the texels that it covers, by 8 × 8 points in each, scaled so that its flux is exact.
fn splat(image: &mut SphereImage, disk: &DiskLight) {
    // Points a side of a texel. Of disks of three texels' radius the centroid is 0.014 texels off at most,
    // with four a side 0.033, with sixteen 0.008.
    const POINTS: usize = 8;
    let (w, h) = (image.width, image.height);
    let cosine = disk.angular_radius.cos();
    let reach = disk.angular_radius + 4.0 * std::f64::consts::PI / h as f64;
    let mut covered: Vec<(usize, f64)> = Vec::new();
    let mut flux = 0.0;
    for j in 0..h {
        let omega = image.layout.solid_angle(w, h, 0, 0, j);
        for i in 0..w {
            let inside = |k: usize| {
                let x = i as f64 + ((k % POINTS) as f64 + 0.5) / POINTS as f64;
                let y = j as f64 + ((k / POINTS) as f64 + 0.5) / POINTS as f64;
                image
                    .layout
                    .direction(w, h, Position { face: 0, x, y })
                    .is_some_and(|d| d.dot(disk.direction) >= cosine)
            };
            let centre = Position { face: 0, x: i as f64 + 0.5, y: j as f64 + 0.5 };
            let near =
                image.layout.direction(w, h, centre).is_some_and(|d| d.angle_between(disk.direction) < reach);
            if !near {
                continue;
            }
            let part = (0..POINTS * POINTS).filter(|k| inside(*k)).count() as f64 / (POINTS * POINTS) as f64;
            if part > 0.0 {
                covered.push((image.index(0, i, j), part));
                flux += part * omega;
            }
        }
    }
    if covered.is_empty() {
        // Smaller than the grid of points: the texel that holds its centre takes it all.
        let (f, i, j) = image.texel_of(disk.direction);
        covered.push((image.index(f, i, j), 1.0));
        flux = image.layout.solid_angle(w, h, f, i, j);
    }
    let scale = disk.solid_angle() / flux;
    for (k, part) in covered {
        (0..3).for_each(|c| image.planes[c][k] += (disk.radiance[c] * part * scale) as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn lights_turn_as_one_and_a_drawn_disk_keeps_its_flux() {
        let mut lights = Lights::of_sky("sky:elevation=30,azimuth=20", (64, 32)).expect("a sky");
        let sun = lights.disks[0];
        let flux = |l: &Lights| l.with_disks_drawn().integral()[1];
        let before = flux(&lights);
        let alone = Lights { disks: vec![sun], ..Lights::default() };
        assert!((flux(&alone) / (sun.solid_angle() * sun.radiance[1]) - 1.0).abs() < 1e-5);
        lights.adjust(90.0, 2.0);
        assert!((flux(&lights) / (2.0 * before) - 1.0).abs() < 1e-5);
        let turned = DVec3::new(sun.direction.z, sun.direction.y, -sun.direction.x);
        assert!(lights.disks[0].direction.distance(turned) < 1e-12);
        assert!(Lights::of_sky("sky:altitude=3", (8, 4)).is_err());
    }
}

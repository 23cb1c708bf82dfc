//! Background that a camera sees where there is no surface.

use glam::{DVec3, Vec3};
use std::f64::consts::TAU;
use steradian_light::{DiskLight, Lights};
use steradian_sphere::{Layout, SphereImage};

/// Content of the pixels that no surface covers.
#[derive(Debug, Clone, PartialEq)]
pub enum Background {
    /// One colour.
    Colour([f32; 3]),
    /// The environment and the disks.
    Sky(Backdrop),
}

/// An environment filtered for one size of pixel, and the disks in front of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Backdrop {
    image: Option<SphereImage>,
    disks: Vec<(Vec3, f32, [f32; 3])>,
}

impl Backdrop {
    /// The distant lights for pixels that subtend `footprint` radians: where texels are finer, they are
    /// averaged over the pixel, so that nothing aliases; where they are coarser, lookups are bicubic within
    /// the range of the nearest texels, since a cubic's negative lobes would draw dark rims around windows
    /// and lamps. A `footprint` that is larger than the pixel blurs the environment.
    pub fn new(lights: &Lights, footprint: f64) -> Self {
        let image = lights.environment.as_ref().map(|e| filtered(&e.image, footprint));
        let disk = |d: &DiskLight| {
            (d.direction.as_vec3(), d.angular_radius.cos() as f32, d.radiance.map(|c| c as f32))
        };
        Self { image, disks: lights.disks.iter().map(disk).collect() }
    }

    /// The filtered environment.
    pub fn image(&self) -> Option<&SphereImage> {
        self.image.as_ref()
    }

    /// The disks: unit direction, cosine of the angular radius, radiance.
    pub fn disks(&self) -> &[(Vec3, f32, [f32; 3])] {
        &self.disks
    }

    /// Radiance from unit direction `d`, disks included.
    pub fn radiance(&self, d: Vec3) -> [f32; 3] {
        let mut sum =
            self.image.as_ref().map_or([0.0; 3], |i| i.bicubic_limited(d.as_dvec3()).map(|c| c.max(0.0)));
        for (direction, cosine, radiance) in &self.disks {
            if direction.dot(d) >= *cosine {
                (0..3).for_each(|k| sum[k] += radiance[k]);
            }
        }
        sum
    }

    /// Does a rim of a disk pass within `footprint` radians of `d`?
    pub fn near_rim(&self, d: Vec3, footprint: f32) -> bool {
        self.disks.iter().any(|(direction, cosine, _)| {
            (direction.angle_between(d) - cosine.clamp(-1.0, 1.0).acos()).abs() < footprint
        })
    }
}

fn filtered(image: &SphereImage, footprint: f64) -> SphereImage {
    let width =
        if footprint > 0.0 { (TAU / footprint).round().clamp(16.0, 1e6) as usize } else { usize::MAX };
    if width >= image.width {
        return image.clone();
    }
    image.resample(Layout::LatLong, width, (width / 2).max(8))
}

impl Background {
    /// Radiance from unit direction `d`.
    pub fn radiance(&self, d: Vec3) -> [f32; 3] {
        match self {
            Self::Colour(c) => *c,
            Self::Sky(s) => s.radiance(d),
        }
    }

    /// Does it change sharply within `footprint` radians of `d`?
    pub fn sharp_near(&self, d: Vec3, footprint: f32) -> bool {
        matches!(self, Self::Sky(s) if s.near_rim(d, footprint))
    }
}

/// The brightest disk's direction, for a camera or a report.
pub fn brightest_disk(lights: &Lights) -> Option<DVec3> {
    let power = |d: &DiskLight| d.radiance.iter().sum::<f64>() * d.solid_angle();
    lights.disks.iter().max_by(|a, b| power(a).total_cmp(&power(b))).map(|d| d.direction)
}

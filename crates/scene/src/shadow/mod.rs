//! Occluders between points and lights: rays, shadow maps, shadow volumes.
//!
//! Rays through the hierarchy are exact. Maps and volumes are what rasterisers draw; here they are computed
//! without one, so that a picture shows the errors of each.

mod flat;
mod map;
mod volume;

use crate::{Bvh, Ray};
use glam::Vec3;
use std::fmt::Debug;

pub use flat::{Boundary, Flat, Volumes};
pub use map::{MapOptions, ShadowMaps};
pub use volume::ShadowVolumes;

/// Occlusion between points and lights.
pub trait Blocker: Debug + Send + Sync {
    /// The unoccluded part of a light, 0 … 1: from the unit direction of `ray`, `distance` away (infinite for
    /// distant ones), at the ray's origin, a point of unit normal `normal`.
    fn arriving(&self, ray: &Ray, normal: Vec3, distance: f32) -> f32;

    /// Is there [`Blocker::flat`]?
    fn is_portable(&self) -> bool {
        false
    }

    /// The occluders as rows of numbers, for GPUs; `None` where there is no such form, or more rows than
    /// single precision can number.
    fn flat(&self) -> Option<Flat> {
        None
    }
}

impl Blocker for Bvh {
    fn arriving(&self, ray: &Ray, _: Vec3, distance: f32) -> f32 {
        f32::from(u8::from(!self.occluded(ray, distance)))
    }

    fn is_portable(&self) -> bool {
        self.most_rows() <= Flat::MOST
    }

    fn flat(&self) -> Option<Flat> {
        self.is_portable().then(|| {
            let (boxes, triangles) = self.rows();
            Flat::Rays { boxes, triangles }
        })
    }
}

/// Where a light is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightAt {
    /// Far away in this unit direction.
    Far(Vec3),
    /// At this position, metres.
    Near(Vec3),
}

impl LightAt {
    /// Difference from the light that `ray` points to at `distance`: an angle in radians or a distance in
    /// metres; infinite for a light of the other kind.
    fn mismatch(self, ray: &Ray, distance: f32) -> f32 {
        match self {
            Self::Far(d) if distance.is_infinite() => (d - ray.direction).length(),
            Self::Near(p) if distance.is_finite() => (ray.origin + distance * ray.direction - p).length(),
            _ => f32::INFINITY,
        }
    }
}

/// The entry of the light that a ray looks for, among entries of one light each: the one that agrees best.
fn meant<'a, T>(all: &'a [(LightAt, T)], ray: &Ray, distance: f32) -> Option<&'a (LightAt, T)> {
    let mismatch = |x: &&(LightAt, T)| x.0.mismatch(ray, distance);
    all.iter().min_by(|a, b| mismatch(a).total_cmp(&mismatch(b)))
}

#[cfg(test)]
mod tests;

//! Taking suns and lamps out of an image: a sunless image and disk lights that together hold the same light.
//!
//! A sun is a small, round, connected region that is far brighter than what lies around it and holds a part
//! of the whole flux (`region`). Its texels are replaced by a harmonic function of those around it
//! (`inpaint`); the light taken away becomes a disk of constant radiance with the same flux and the same
//! vector flux ∫ L ω dω, which fixes direction, irradiance and radius: over a disk the mean cosine is (1 +
//! cos ρ)/2. So everything that depends on the light's zeroth and first moment, such as the irradiance of a
//! surface that faces it, is unchanged.
//!
//! The channels of one sun differ by fractions of a texel in direction and in radius. What the one disk
//! cannot hold of that goes back into the image as a factor 1 + a₀ + a·ω per channel, far below a per cent in
//! daylight, so that flux and vector flux of every channel are those of the original to rounding. Where the
//! rest of the image is too dark for that, each channel gets a disk of its own, which is exact without any
//! factor.

mod inpaint;
mod moments;
mod region;
mod taken;
#[cfg(test)]
mod tests;

pub use taken::{Taken, take};

use crate::DiskLight;
use glam::DVec3;
use moments::{Grid, Moments};
use std::f64::consts::PI;
use steradian_sphere::{Layout, SphereImage};

/// What counts as a sun.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunOptions {
    /// Suns at most, the strongest first.
    pub most: usize,
    /// Largest angular radius of the region of a sun, radians.
    pub largest: f64,
    /// Smallest part of the whole luminous flux.
    pub share: f64,
    /// How many times brighter than what lies around it.
    pub contrast: f64,
}

impl Default for SunOptions {
    fn default() -> Self {
        Self { most: 8, largest: 3f64.to_radians(), share: 0.01, contrast: 30.0 }
    }
}

/// What became of an image.
#[derive(Debug, Clone, PartialEq)]
pub struct Extraction {
    /// The image without its suns.
    pub sunless: SphereImage,
    /// The suns, the strongest first; where a sun was split, one per channel.
    pub suns: Vec<DiskLight>,
    /// Part of the whole luminous flux that each of them holds.
    pub shares: Vec<f64>,
    /// Largest relative change of a texel outside the regions.
    pub change: f64,
    /// Largest relative deviation of flux and vector flux of a channel from those of the original.
    pub deviation: f64,
}

/// Largest factor by which texels outside the regions may change before channels get disks of their own.
const MOST_CHANGE: f64 = 0.05;

/// Luminance of linear Rec. 709.
pub fn luminance(v: [f64; 3]) -> f64 {
    0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]
}

/// Splits a lat-long image into a sunless one and disk lights. Other layouts are resampled first. No suns:
/// the image as it is.
pub fn extract(image: &SphereImage, options: &SunOptions) -> Extraction {
    if image.layout != Layout::LatLong {
        let (w, h) = crate::load::latlong_size(image.layout, image.width, image.height);
        return extract(&image.resample(Layout::LatLong, w, h), options);
    }
    let grid = Grid::new(image.width, image.height);
    let before = grid.moments(image);
    let whole = luminance(before.map(|m| m.flux));
    let mut sunless = image.clone();
    let mut taken: Vec<[Moments; 3]> = Vec::new();
    for texels in region::find(image, &grid, options) {
        let light = inpaint::take(&mut sunless, &grid, &texels);
        if luminance(light.map(|m| m.flux)) >= options.share * whole {
            taken.push(light);
        } else {
            texels.iter().for_each(|&k| (0..3).for_each(|c| sunless.planes[c][k] = image.planes[c][k]));
        }
    }
    let strength = |m: &[Moments; 3]| luminance(m.map(|m| m.flux));
    taken.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    if taken.is_empty() {
        let (shares, suns) = (Vec::new(), Vec::new());
        return Extraction { sunless, suns, shares, change: 0.0, deviation: 0.0 };
    }
    let mut suns: Vec<DiskLight> = taken.iter().map(joint).collect();
    let mut change = grid.restore(&mut sunless, &rest(&before, &suns), MOST_CHANGE);
    if change.is_none() {
        suns = taken.iter().flat_map(apart).collect();
        change = grid.restore(&mut sunless, &rest(&before, &suns), MOST_CHANGE);
    }
    let after = grid.moments(&sunless);
    let deviation = (0..3).map(|c| after[c].apart(&rest(&before, &suns)[c], &before[c])).fold(0.0, f64::max);
    let share = |d: &DiskLight| luminance(d.radiance) * d.solid_angle() / whole;
    let shares = suns.iter().map(share).collect();
    Extraction { sunless, suns, shares, change: change.unwrap_or(0.0), deviation }
}

/// The moments that the image must have, so that image and suns together have those of the original.
fn rest(before: &[Moments; 3], suns: &[DiskLight]) -> [Moments; 3] {
    std::array::from_fn(|c| suns.iter().fold(before[c], |m, d| m.minus(&Moments::of_disk(d, c))))
}

/// A disk's cos ρ from its mean cosine.
fn radius(mean_cosine: f64) -> f64 {
    // 1 − cos ρ = 2 (1 − m) = 2 sin²(ρ/2); far below a texel's own extent nothing is.
    2.0 * (1.0 - mean_cosine).clamp(1e-14, 1.0).sqrt().asin()
}

/// A disk of irradiance E_c on a surface that faces it.
fn disk(direction: DVec3, angular_radius: f64, irradiance: [f64; 3]) -> DiskLight {
    let area = PI * angular_radius.sin().powi(2);
    DiskLight { direction, angular_radius, radiance: irradiance.map(|e| (e / area).max(0.0)) }
}

/// One disk for all channels: direction and radius of the luminous flux.
fn joint(m: &[Moments; 3]) -> DiskLight {
    let weights = [0.2126, 0.7152, 0.0722];
    let vector: DVec3 = m.iter().zip(weights).map(|(m, w)| m.vector * w).sum();
    let d = vector.normalize_or(DVec3::Y);
    let flux = luminance(m.map(|m| m.flux));
    disk(d, radius(vector.dot(d) / flux), m.map(|m| m.vector.dot(d)))
}

/// A disk for each channel that has light.
fn apart(m: &[Moments; 3]) -> Vec<DiskLight> {
    let one = |c: usize| {
        let d = m[c].vector.try_normalize()?;
        let irradiance = std::array::from_fn(|k| if k == c { m[c].vector.length() } else { 0.0 });
        Some(disk(d, radius(m[c].vector.dot(d) / m[c].flux), irradiance))
    };
    (0..3).filter_map(one).collect()
}

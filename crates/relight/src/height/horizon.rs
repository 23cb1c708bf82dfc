//! Horizon maps: the elevation below which a texel sees the surface and no light.

use super::{HeightField, walk};
use glam::Vec3;
use std::f32::consts::{FRAC_PI_2, PI, TAU};
use steradian_parallel::prelude::*;

/// Elevations of the horizon of every texel at equal steps of azimuth, linear between them (Sloan & Cohen
/// 2000).
#[derive(Debug, Clone, PartialEq)]
pub struct Horizons {
    width: usize,
    height: usize,
    azimuths: usize,
    /// Texel by texel in rows from the top, azimuth by azimuth from φ = 0: e in parts of π/2 over 65535.
    elevations: Vec<u16>,
}

impl Horizons {
    /// The horizons of a field at `azimuths` azimuths, 1 at least; `None` where `go_on` says no.
    pub fn new(field: &HeightField, azimuths: usize, go_on: &(dyn Fn() -> bool + Sync)) -> Option<Self> {
        let count = azimuths.max(1);
        let phi: Vec<f64> = (0..count).map(|k| std::f64::consts::TAU * k as f64 / count as f64).collect();
        let slopes = walk::slopes(field, &phi, go_on)?;
        let texels = field.width * field.height;
        let mut elevations = vec![0; texels * count];
        elevations.par_chunks_mut(field.width * count).enumerate().for_each(|(row, out)| {
            for (column, out) in out.chunks_exact_mut(count).enumerate() {
                for (k, e) in out.iter_mut().enumerate() {
                    let slope = slopes[k * texels + row * field.width + column];
                    *e = (slope.atan() / FRAC_PI_2 * 65535.0).round() as u16;
                }
            }
        });
        Some(Self { width: field.width, height: field.height, azimuths: count, elevations })
    }

    /// Texels a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Azimuths of a texel.
    pub fn azimuths(&self) -> usize {
        self.azimuths
    }

    /// Bytes of the table.
    pub fn bytes(&self) -> usize {
        2 * self.elevations.len()
    }

    /// The elevation at azimuth `k` of a texel, radians.
    pub fn sample(&self, texel: usize, k: usize) -> f32 {
        f32::from(self.elevations[texel * self.azimuths + k]) / 65535.0 * FRAC_PI_2
    }

    /// The elevation of a texel's horizon at azimuth `phi`, radians.
    pub fn elevation(&self, texel: usize, phi: f32) -> f32 {
        let x = (phi / TAU).rem_euclid(1.0) * self.azimuths as f32;
        let k = (x as usize).min(self.azimuths - 1);
        let (a, b) = (self.sample(texel, k), self.sample(texel, (k + 1) % self.azimuths));
        a + (x - k as f32) * (b - a)
    }

    /// The part of a disk light that a texel sees: of angular radius `radius` about the unit direction `d`,
    /// cut by a straight horizon. 0 or 1 where the radius is 0.
    pub fn visible(&self, texel: usize, d: Vec3, radius: f32) -> f32 {
        let above = d.z.clamp(-1.0, 1.0).asin() - self.elevation(texel, d.y.atan2(d.x));
        if above.abs() >= radius {
            return if above > 0.0 { 1.0 } else { 0.0 };
        }
        let x = above / radius;
        // The segment of the unit disk beyond a chord at distance −x.
        1.0 - (x.acos() - x * (1.0 - x * x).sqrt()) / PI
    }
}

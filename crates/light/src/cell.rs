//! Texels of a photograph as lights.

use glam::{DMat3, DVec3};
use std::f64::consts::{PI, TAU};

/// A cell of constant radiance, turned in any way: a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellLight {
    /// Unit axis of the image, its upper pole.
    pub pole: DVec3,
    /// Unit direction on the equator below the cell's middle.
    pub meridian: DVec3,
    /// Angles from the pole, radians.
    pub theta: [f64; 2],
    /// Half of its extent in azimuth, radians.
    pub half: f64,
    /// Radiance, W sr⁻¹ m⁻².
    pub radiance: [f64; 3],
}

impl CellLight {
    /// Texel (i, j) of a lat-long image of `width` × `height`, with radiance 0.
    #[inline]
    pub fn texel(i: usize, j: usize, width: usize, height: usize) -> Self {
        let (s, c) = (TAU * ((i as f64 + 0.5) / width as f64 - 0.5)).sin_cos();
        let theta = [j, j + 1].map(|j| PI * j as f64 / height as f64);
        let meridian = DVec3::new(c, 0.0, s);
        Self { pole: DVec3::Y, meridian, theta, half: PI / width as f64, radiance: [0.0; 3] }
    }

    /// Solid angle.
    #[inline]
    pub fn solid_angle(&self) -> f64 {
        let [a, b] = self.theta;
        4.0 * self.half * (0.5 * (a + b)).sin() * (0.5 * (b - a)).sin()
    }

    /// The direction at θ and at the azimuth φ from its middle.
    #[inline]
    pub fn direction(&self, theta: f64, phi: f64) -> DVec3 {
        let equator = self.meridian * phi.cos() + self.pole.cross(self.meridian) * phi.sin();
        self.pole * theta.cos() + equator * theta.sin()
    }

    /// The direction that is at x, y of the unit square, where areas are solid angles.
    #[inline]
    pub fn inside(&self, x: f64, y: f64) -> DVec3 {
        let [a, b] = self.theta.map(f64::cos);
        self.direction((a + (b - a) * x).clamp(-1.0, 1.0).acos(), self.half * (2.0 * y - 1.0))
    }

    /// The middle of its ranges.
    #[inline]
    pub fn centre(&self) -> DVec3 {
        self.direction(0.5 * (self.theta[0] + self.theta[1]), 0.0)
    }

    /// Half of its height and of its width.
    #[inline]
    pub fn halves(&self) -> [f64; 2] {
        let [middle, height] = [0.5 * (self.theta[0] + self.theta[1]), 0.5 * (self.theta[1] - self.theta[0])];
        // The longer of its upper and its lower side.
        [height, self.half.min(0.5 * PI) * (middle.sin() + height * middle.cos().abs())]
    }

    /// This cell in the rotated image.
    #[inline]
    pub fn turned(&self, by: &DMat3) -> Self {
        let [pole, meridian] = [self.pole, self.meridian].map(|v| (*by * v).normalize_or(v));
        Self { pole, meridian, ..*self }
    }
}

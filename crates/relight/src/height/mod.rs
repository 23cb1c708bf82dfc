//! Bumps as height fields, and their occlusion of the light above: horizons (Max 1988; Sloan & Cohen 2000,
//! *Interactive Horizon Mapping*) and their ellipses (Heidrich, Daubert, Kautz & Seidel 2000, *Illuminating
//! Micro Geometry Based on Precomputed Visibility*); and mutual visibility of bumps ([`Scattering`]).
//!
//! The field is periodic. Its texels are the vertices of a surface of triangles, two to a square, cut along
//! the diagonal from the upper left to the lower right: the mesh that a path tracer sees. Lengths are in
//! texels: x to the right of the picture, y up, z out of it. Azimuths φ turn from x to y; elevations e rise
//! from the plane of the picture.

mod ellipse;
mod horizon;
mod pattern;
mod scatter;
mod walk;

pub use ellipse::{Ellipse, Ellipses};
pub use horizon::Horizons;
pub use pattern::Pattern;
pub use scatter::{Caster, Scattering};

use glam::{DVec3, Vec3};

/// Most texels of a field, so that 32-bit indices suffice.
const MOST: usize = 1 << 31;

/// Why heights are no field.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum HeightError {
    /// Sides and heights do not agree.
    #[error(
        "{width} x {height} texels and {heights} heights: sides of one texel at least, and a height for each"
    )]
    Size {
        /// Texels a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Heights.
        heights: usize,
    },
    /// A height that is not finite.
    #[error("the height of texel ({0}, {1}) is not finite")]
    Finite(usize, usize),
}

/// A periodic height field.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    width: usize,
    height: usize,
    z: Vec<f32>,
}

impl HeightField {
    /// Heights in texels, in rows from the top.
    pub fn new(width: usize, height: usize, z: Vec<f32>) -> Result<Self, HeightError> {
        if z.is_empty() || width.checked_mul(height) != Some(z.len()) || z.len() > MOST {
            return Err(HeightError::Size { width, height, heights: z.len() });
        }
        match z.iter().position(|v| !v.is_finite()) {
            Some(k) => Err(HeightError::Finite(k % width, k / width)),
            None => Ok(Self { width, height, z }),
        }
    }

    /// Texels a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Heights in rows from the top.
    pub fn heights(&self) -> &[f32] {
        &self.z
    }

    /// The height of column `i` and row `j`, wherever they lie.
    pub fn at(&self, i: i64, j: i64) -> f32 {
        let (i, j) = (i.rem_euclid(self.width as i64), j.rem_euclid(self.height as i64));
        self.z[j as usize * self.width + i as usize]
    }

    /// The unit normal at a texel, by central differences.
    pub fn normal(&self, i: usize, j: usize) -> Vec3 {
        let (i, j) = (i as i64, j as i64);
        let (dx, dy) = (self.at(i + 1, j) - self.at(i - 1, j), self.at(i, j - 1) - self.at(i, j + 1));
        Vec3::new(-dx, -dy, 2.0).normalize()
    }

    /// Does light from the direction `d` (x to the right, y up, z out of the picture) reach a texel? A ray is
    /// followed over four periods.
    pub fn sees(&self, i: usize, j: usize, d: DVec3) -> bool {
        walk::sees(self, (i, j), d)
    }

    /// The largest slope of the surface, 0 at least, that each texel sees along each azimuth (radians):
    /// planes of texels, azimuth by azimuth. Every crossing of a line with an edge is tested as far as any
    /// height can matter: the reference for [`Horizons`].
    #[doc(hidden)]
    pub fn slopes_by_every_crossing(&self, azimuths: &[f64]) -> Vec<f32> {
        walk::slopes_by_every_crossing(self, azimuths)
    }

    /// Smallest and largest height.
    pub fn range(&self) -> (f32, f32) {
        self.z.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), z| (a.min(*z), b.max(*z)))
    }
}

#[cfg(test)]
mod tests;

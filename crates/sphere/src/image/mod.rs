//! RGB images on the sphere.

mod coverage;
mod cube_cells;
mod cube_lookups;
mod latlong;
mod lookup;
mod patch;
mod refine;
mod resample;
#[cfg(test)]
mod tests;

pub use lookup::Filter;

use crate::layout::{Layout, Position};
use glam::{DMat3, DVec3};
use steradian_parallel::prelude::*;

/// Three planes of f32 over a layout; each plane holds its faces one after the other, rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct SphereImage {
    /// The layout.
    pub layout: Layout,
    /// Width of one face.
    pub width: usize,
    /// Height of one face.
    pub height: usize,
    /// Red, green and blue; each `layout.faces()·width·height` long.
    pub planes: [Vec<f32>; 3],
}

impl SphereImage {
    /// A black image.
    pub fn new(layout: Layout, width: usize, height: usize) -> Self {
        let n = layout.faces() * width * height;
        Self { layout, width, height, planes: [vec![0.0; n], vec![0.0; n], vec![0.0; n]] }
    }

    /// An image of `f` at every texel centre (zero outside the used part).
    pub fn from_fn(
        layout: Layout,
        width: usize,
        height: usize,
        f: impl Fn(DVec3) -> [f32; 3] + Sync,
    ) -> Self {
        let mut out = Self::new(layout, width, height);
        out.fill_rows(|face, j, r, g, b| {
            for i in 0..width {
                if let Some(d) = layout.texel_direction(width, height, face, i, j) {
                    [r[i], g[i], b[i]] = f(d);
                }
            }
        });
        out
    }

    /// Calls `f(face, row, red, green, blue)` for every row, in parallel.
    pub(crate) fn fill_rows(&mut self, f: impl Fn(usize, usize, &mut [f32], &mut [f32], &mut [f32]) + Sync) {
        let (width, height) = (self.width.max(1), self.height.max(1));
        let [r, g, b] = &mut self.planes;
        r.par_chunks_mut(width)
            .zip(g.par_chunks_mut(width))
            .zip(b.par_chunks_mut(width))
            .enumerate()
            .for_each(|(row, ((r, g), b))| f(row / height, row % height, r, g, b));
    }

    /// Index of texel (i, j) of `face` in a plane.
    #[inline]
    pub fn index(&self, face: usize, i: usize, j: usize) -> usize {
        (face * self.height + j) * self.width + i
    }

    /// Texel (i, j) of `face`.
    #[inline]
    pub fn texel(&self, face: usize, i: usize, j: usize) -> [f32; 3] {
        let k = self.index(face, i, j);
        [self.planes[0][k], self.planes[1][k], self.planes[2][k]]
    }

    /// The position that shows unit direction `d`.
    #[inline]
    pub fn position(&self, d: DVec3) -> Position {
        self.layout.position(self.width, self.height, d)
    }

    /// Face, column and row of the texel that contains direction `d`.
    pub fn texel_of(&self, d: DVec3) -> (usize, usize, usize) {
        let p = self.position(d);
        let (i, j) = ((p.x as usize).min(self.width - 1), (p.y as usize).min(self.height - 1));
        (p.face, i, j)
    }

    /// The texel that contains direction `d`.
    pub fn nearest(&self, d: DVec3) -> [f32; 3] {
        let (face, i, j) = self.texel_of(d);
        self.texel(face, i, j)
    }

    /// Bilinear lookup, correct across seams, corners and poles.
    pub fn bilinear(&self, d: DVec3) -> [f32; 3] {
        self.lookup(Filter::Bilinear, d)
    }

    /// [`SphereImage::bilinear`] of a direction whose [`SphereImage::position`] is known; for lat-long and
    /// octahedral images.
    pub fn bilinear_at(&self, p: &Position) -> [f32; 3] {
        self.interpolate(Filter::Bilinear, 0, p.x, p.y).map(|v| v as f32)
    }

    /// Catmull–Rom bicubic lookup, correct across seams, corners and poles. It overshoots beside sharp edges,
    /// below zero too: the cubic has negative lobes.
    pub fn bicubic(&self, d: DVec3) -> [f32; 3] {
        self.lookup(Filter::CatmullRom, d)
    }

    /// [`SphereImage::bicubic`] within the range of the four nearest texels, for pictures that are looked at.
    /// It is not linear in the texels.
    pub fn bicubic_limited(&self, d: DVec3) -> [f32; 3] {
        self.lookup(Filter::LimitedCatmullRom, d)
    }

    /// Many lookups at once, in parallel.
    pub fn lookup_many(&self, filter: Filter, directions: &[DVec3]) -> Vec<[f32; 3]> {
        directions.par_iter().with_min_len(256).map(|&d| self.lookup(filter, d)).collect()
    }

    /// The same function in another layout or size: area-exact where texels grow, bicubic where they shrink.
    ///
    /// ∫ L dω is kept to about 1e-6 unless every texel shrinks, when it is kept as well as the interpolation
    /// is good. The same result whatever the number of threads.
    pub fn resample(&self, layout: Layout, width: usize, height: usize) -> Self {
        resample::remap(self, layout, width, height, DMat3::IDENTITY)
    }

    /// The means of a lat-long image, constant over each of its cells, over the texels of a cube map of
    /// `size` a side, to rounding. Other layouts go through [`SphereImage::resample`]. Where texels shrink
    /// the cells show: `resample` interpolates there.
    pub fn cube_means(&self, size: usize) -> Self {
        if self.layout == Layout::LatLong {
            cube_cells::means(self, size)
        } else {
            self.resample(Layout::Cube, size, size)
        }
    }

    /// Twice as many texels each way: cubic, but every texel's mean is kept and no part lies beyond the
    /// texel's neighbours, so that what is nowhere negative stays so.
    pub fn refined(&self) -> Self {
        let planes = refine::refine(self);
        Self { layout: self.layout, width: 2 * self.width, height: 2 * self.height, planes }
    }

    /// The function turned by `rotation`: out(d) = self(rotation⁻¹ d); `rotation` may mirror. Quality and
    /// energy as with [`SphereImage::resample`].
    pub fn rotate(&self, rotation: DMat3) -> Self {
        resample::remap(self, self.layout, self.width, self.height, rotation.transpose())
    }

    /// Solid angles of the texels of row `j` of `face`.
    pub fn row_solid_angles(&self, face: usize, j: usize) -> Vec<f64> {
        if self.layout == Layout::LatLong {
            return vec![self.layout.solid_angle(self.width, self.height, face, 0, j); self.width];
        }
        (0..self.width).map(|i| self.layout.solid_angle(self.width, self.height, face, i, j)).collect()
    }

    /// ∫ L dω per channel, with exact solid angles.
    pub fn integral(&self) -> [f64; 3] {
        let rows: Vec<[f64; 3]> = (0..self.layout.faces() * self.height)
            .into_par_iter()
            .map(|row| {
                let omega = self.row_solid_angles(row / self.height, row % self.height);
                let at = row * self.width;
                std::array::from_fn(|c| {
                    let texels = &self.planes[c][at..at + self.width];
                    omega.iter().zip(texels).filter(|(w, _)| **w > 0.0).map(|(w, &v)| w * f64::from(v)).sum()
                })
            })
            .collect();
        rows.iter().fold([0.0; 3], |a, r| std::array::from_fn(|c| a[c] + r[c]))
    }
}

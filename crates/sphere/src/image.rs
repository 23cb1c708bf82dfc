//! RGB images on the sphere.

use crate::Layout;
use glam::{DMat3, DVec3};

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
    pub fn from_fn(layout: Layout, width: usize, height: usize, f: impl Fn(DVec3) -> [f32; 3] + Sync) -> Self {
        let _ = (layout, width, height, f);
        todo!()
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

    /// The texel that contains direction `d`.
    pub fn nearest(&self, d: DVec3) -> [f32; 3] {
        let _ = d;
        todo!()
    }

    /// Bilinear lookup, correct across seams, corners and poles.
    pub fn bilinear(&self, d: DVec3) -> [f32; 3] {
        let _ = d;
        todo!()
    }

    /// Catmull–Rom bicubic lookup, correct across seams, corners and poles.
    pub fn bicubic(&self, d: DVec3) -> [f32; 3] {
        let _ = d;
        todo!()
    }

    /// The same function in another layout or size: area-exact where texels grow, bicubic where they shrink.
    pub fn resample(&self, layout: Layout, width: usize, height: usize) -> Self {
        let _ = (layout, width, height);
        todo!()
    }

    /// The function turned by `rotation`: out(d) = self(rotation⁻¹ d).
    pub fn rotate(&self, rotation: DMat3) -> Self {
        let _ = rotation;
        todo!()
    }

    /// ∫ L dω per channel, with exact solid angles.
    pub fn integral(&self) -> [f64; 3] {
        todo!()
    }
}

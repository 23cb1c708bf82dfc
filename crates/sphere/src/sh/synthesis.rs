//! From coefficients to images.

use super::points::{CubeAngles, angles};
use super::rotation::exchange_yz;
use super::{Basis, ColumnsRgb, Grid, PointSynthesis, ShRgb, ShTransform, count};
use crate::layout::Position;
use crate::{Layout, SphereImage};
use glam::DVec3;
use steradian_parallel::prelude::*;

/// Above this order texels are interpolated from a lat-long grid: it is quicker than the sum over the basis.
const DIRECT_ORDER: usize = 20;

/// What f32 keeps is more.
const ERROR: f64 = 1e-7;

/// The function of `sh` at every texel centre of a map (zero outside the used part), to 1e-7 of its range.
///
/// Lat-long maps by the fast transform, others up to order 20 by the sum over the basis, above by
/// [`PointSynthesis`].
pub fn synthesize(sh: &ShRgb, layout: Layout, width: usize, height: usize) -> SphereImage {
    if layout == Layout::LatLong {
        let mut image = SphereImage::new(layout, width, height);
        let plan = ShTransform::new(sh.order, width, height, Grid::Equirectangular);
        plan.synthesize(sh, image.planes.each_mut().map(Vec::as_mut_slice));
        return image;
    }
    if sh.order <= DIRECT_ORDER {
        return synthesize_direct(sh, layout, width, height);
    }
    let mut polar = sh.clone();
    exchange_yz(sh.order, polar.c.each_mut().map(Vec::as_mut_slice));
    PointSynthesis::new(&ColumnsRgb::from_sh(&polar), &[], ERROR).image(layout, width, height)
}

impl PointSynthesis {
    /// The values at every texel centre of a map (zero outside the used part), on all threads.
    pub fn image(&self, layout: Layout, width: usize, height: usize) -> SphereImage {
        let mut image = SphereImage::new(layout, width, height);
        if image.planes[0].is_empty() {
            return image;
        }
        let cube = (layout == Layout::Cube).then(|| CubeAngles::new(width));
        let [r, g, b] = image.planes.each_mut().map(|p| p.par_chunks_mut(width));
        let rows = r.zip(g).zip(b).enumerate();
        rows.for_each_init(Vec::new, |at: &mut Vec<[f64; 2]>, (row, ((r, g), b))| {
            let (face, j) = (row / height, row % height);
            at.clear();
            at.resize(width, [0.0; 2]);
            if let Some(cube) = &cube {
                cube.row(face, j, at);
                return self.values(at, [r, g, b]);
            }
            let direction = |i: usize| layout.texel_direction(width, height, face, i, j);
            for (i, at) in at.iter_mut().enumerate() {
                *at = direction(i).map_or([0.0; 2], angles);
            }
            self.values(at, [&mut *r, &mut *g, &mut *b]);
            for i in (0..width).filter(|i| direction(*i).is_none()) {
                (r[i], g[i], b[i]) = (0.0, 0.0, 0.0);
            }
        });
        image
    }
}

/// [`synthesize`] by the sum over the basis at each texel centre, in any layout and order: the reference.
pub fn synthesize_direct(sh: &ShRgb, layout: Layout, width: usize, height: usize) -> SphereImage {
    let basis = Basis::new(sh.order);
    fill(
        layout,
        width,
        height,
        || vec![0.0; count(sh.order)],
        |y, d| {
            basis.eval(sh.order, d, y);
            sh.c.each_ref().map(|c| c.iter().zip(&*y).map(|(c, y)| c * y).sum())
        },
    )
}

fn fill<T>(
    layout: Layout,
    width: usize,
    height: usize,
    scratch: impl Fn() -> T + Sync + Send,
    f: impl Fn(&mut T, DVec3) -> [f64; 3] + Sync,
) -> SphereImage {
    let mut image = SphereImage::new(layout, width, height);
    if width == 0 {
        return image;
    }
    let [r, g, b] = image.planes.each_mut().map(|p| p.par_chunks_mut(width));
    r.zip(g).zip(b).enumerate().for_each_init(scratch, |scratch, (row, ((r, g), b))| {
        let (face, j) = (row / height, row % height);
        for i in 0..width {
            let at = Position { face, x: i as f64 + 0.5, y: j as f64 + 0.5 };
            if let Some(d) = layout.direction(width, height, at) {
                [r[i], g[i], b[i]] = f(scratch, d).map(|v| v as f32);
            }
        }
    });
    image
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in crate::sh) fn noise(order: usize) -> ShRgb {
        let mut sh = ShRgb::zero(order);
        for (k, c) in sh.c.iter_mut().enumerate() {
            for (i, c) in c.iter_mut().enumerate() {
                *c = ((i * i + 3 * k) as f64).sin();
            }
        }
        sh
    }

    #[test]
    fn an_image_projects_back_to_its_coefficients() {
        let sh = noise(12);
        let image = synthesize(&sh, Layout::LatLong, 64, 64);
        let plan = ShTransform::new(12, 64, 64, Grid::Equirectangular);
        let back = plan.analyze(image.planes.each_ref().map(Vec::as_slice));
        for (a, b) in sh.c.iter().flatten().zip(back.c.iter().flatten()) {
            assert!((a - b).abs() < 2e-6);
        }
        let fine = super::super::project(&synthesize(&sh, Layout::LatLong, 512, 256), 12);
        for (a, b) in sh.c.iter().flatten().zip(fine.c.iter().flatten()) {
            assert!((a - b).abs() < 2e-3);
        }
    }

    #[test]
    fn cube_maps_agree_with_the_direct_sum() {
        let sh = noise(30);
        let (a, b) = (synthesize(&sh, Layout::Cube, 16, 16), synthesize_direct(&sh, Layout::Cube, 16, 16));
        let peak = b.planes[0].iter().fold(0.0_f32, |m, v| m.max(v.abs()));
        for (x, y) in a.planes[0].iter().zip(&b.planes[0]) {
            assert!((x - y).abs() < 3e-7 * peak);
        }
    }

    #[test]
    fn projections_are_the_limit_of_direct_sums() {
        let sh = noise(8);
        let image = synthesize(&sh, Layout::LatLong, 40, 20);
        // Every texel as 8 × 8 points.
        let mut fine = SphereImage::new(Layout::LatLong, 320, 160);
        for k in 0..320 * 160 {
            let from = k / 320 / 8 * 40 + k % 320 / 8;
            (0..3).for_each(|c| fine.planes[c][k] = image.planes[c][from]);
        }
        let (a, b) = (super::super::project(&image, 10), super::super::project_direct(&fine, 10));
        for (a, b) in a.c.iter().flatten().zip(b.c.iter().flatten()) {
            assert!((a - b).abs() < 2e-3, "{a} {b}");
        }
        let cube = synthesize(&sh, Layout::Cube, 128, 128);
        for (a, b) in sh.c.iter().flatten().zip(super::super::project(&cube, 8).c.iter().flatten()) {
            assert!((a - b).abs() < 1e-3, "{a} {b}");
        }
    }
}

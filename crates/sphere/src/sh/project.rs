//! Projection of images.

use super::{Basis, Grid, ShRgb, ShTransform, count};
use crate::layout::Position;
use crate::{Layout, SphereImage};
use steradian_parallel::prelude::*;

/// Rows of texels per block: blocks are summed in index order, so the result does not depend on threads.
const ROWS: usize = 16;

/// Coefficients up to `order` of an image in any layout.
///
/// A lat-long image is taken as constant over each texel's exact cell: ∫ L Y dω to rounding, by
/// [`Grid::Cells`]. Texels of other layouts stand at their centres ([`project_direct`]): band l of a
/// piecewise constant image is off by about (l·texel)²/24 relative.
pub fn project(image: &SphereImage, order: usize) -> ShRgb {
    if image.layout != Layout::LatLong {
        return project_direct(image, order);
    }
    let plan = ShTransform::new(order, image.width, image.height, Grid::Cells);
    plan.analyze(image.planes.each_ref().map(Vec::as_slice))
}

/// Coefficients up to `order` by Σ texel·Ω·Y(centre) over all texels with exact solid angles Ω, in any
/// layout. O(texels · order²).
pub fn project_direct(image: &SphereImage, order: usize) -> ShRgb {
    let basis = Basis::new(order);
    let rows = image.layout.faces() * image.height;
    let blocks: Vec<ShRgb> = (0..rows.div_ceil(ROWS))
        .into_par_iter()
        .map(|b| {
            let mut sum = ShRgb::zero(order);
            let mut y = vec![0.0; count(order)];
            for row in b * ROWS..rows.min((b + 1) * ROWS) {
                add_row(image, &basis, row / image.height, row % image.height, &mut y, &mut sum);
            }
            sum
        })
        .collect();
    let mut total = ShRgb::zero(order);
    for block in &blocks {
        for (t, b) in total.c.iter_mut().zip(&block.c) {
            t.iter_mut().zip(b).for_each(|(t, b)| *t += b);
        }
    }
    total
}

fn add_row(image: &SphereImage, basis: &Basis, face: usize, j: usize, y: &mut [f64], sum: &mut ShRgb) {
    let (width, height) = (image.width, image.height);
    let lat_long = image.layout == Layout::LatLong;
    let mut omega = if lat_long { image.layout.solid_angle(width, height, face, 0, j) } else { 0.0 };
    for i in 0..width {
        let at = Position { face, x: i as f64 + 0.5, y: j as f64 + 0.5 };
        if !lat_long {
            omega = image.layout.solid_angle(width, height, face, i, j);
        }
        let rgb = image.texel(face, i, j);
        if omega == 0.0 || rgb == [0.0; 3] {
            continue;
        }
        let Some(d) = image.layout.direction(width, height, at) else { continue };
        basis.eval(sum.order, d, y);
        for (c, v) in sum.c.iter_mut().zip(rgb) {
            let v = f64::from(v) * omega;
            c.iter_mut().zip(&*y).for_each(|(c, y)| *c += v * y);
        }
    }
}

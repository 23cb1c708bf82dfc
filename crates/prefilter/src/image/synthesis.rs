//! Synthesis of images in any layout from coefficients about the pole y: by the transform itself where the
//! image is lat-long, else by [`PointSynthesis`].

use crate::light::polar;
use glam::DVec3;
use steradian_sphere::sh::{ColumnsRgb, Grid, PointSynthesis, Precision, ShRgb, ShTransform};
use steradian_sphere::{Layout, SphereImage};

/// Tolerance below which single precision is not enough.
const STRICT: f64 = 1e-4;

/// Precision in which sums are kept for an image of a given tolerance.
pub(crate) fn precision(tolerance: f64) -> Precision {
    if tolerance < STRICT { Precision::Double } else { Precision::Image }
}

/// The function of `columns`, band l multiplied with `factors[l]` and none beyond, at every texel centre.
pub(crate) fn synthesize(
    columns: &ColumnsRgb,
    factors: &[f64],
    (layout, width, height): (Layout, usize, usize),
    tolerance: f64,
) -> SphereImage {
    if layout == Layout::LatLong {
        let mut image = SphereImage::new(layout, width, height);
        let order = columns.order().min(factors.len().saturating_sub(1));
        let plan =
            ShTransform::with_precision(order, width, height, Grid::Equirectangular, precision(tolerance));
        plan.synthesize_columns(columns, factors, image.planes.each_mut().map(Vec::as_mut_slice));
        return image;
    }
    // Relative to the range of the function, whose dark parts count as well.
    let error = if tolerance < STRICT { 1e-6 } else { 1e-5 };
    PointSynthesis::new(columns, factors, error).image(layout, width, height)
}

/// The function of `sh` (world axes), band l multiplied with `factors[l]` and none beyond, in given
/// directions; `error` is relative to the range of the function.
pub(crate) fn at_points(sh: &ShRgb, factors: &[f64], directions: &[DVec3], error: f64) -> [Vec<f32>; 3] {
    let mut planes: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; directions.len()]);
    // Exchanging the poles twice changes nothing.
    let columns = ColumnsRgb::from_sh(&polar::to_world(sh));
    let [r, g, b] = &mut planes;
    PointSynthesis::new(&columns, factors, error).at(directions, [r, g, b]);
    planes
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sphere::sh;

    /// All energy in the highest band is the worst case.
    #[test]
    fn every_layout_holds_the_function() {
        for order in [0, 3, 20, 77] {
            let mut sh = ShRgb::zero(order);
            for (k, c) in sh.c.iter_mut().flatten().enumerate() {
                *c = ((k * k + 1) as f64).sin();
            }
            let (world, columns) = (polar::to_world(&sh), ColumnsRgb::from_sh(&sh));
            let factors = vec![2.0; order + 1];
            for (tolerance, close) in [(1e-3, 1e-5), (1e-6, 1e-6)] {
                for shape in [(Layout::Cube, 9, 9), (Layout::LatLong, 24, 12), (Layout::Octahedral, 8, 8)] {
                    let got = synthesize(&columns, &factors, shape, tolerance);
                    let exact = sh::synthesize_direct(&world, shape.0, shape.1, shape.2);
                    let peak = exact.planes[0].iter().fold(0.0_f32, |m, v| m.max(v.abs()));
                    for (a, b) in got.planes.iter().flatten().zip(exact.planes.iter().flatten()) {
                        assert!((0.5 * a - b).abs() <= close * peak, "{order} {shape:?}: {a} {b} of {peak}");
                    }
                }
            }
        }
    }
}

//! From coefficients to images.

use super::{Basis, Grid, ShRgb, ShTransform, count};
use crate::layout::Position;
use crate::{Layout, SphereImage};
use glam::DVec3;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Above this order texels are interpolated from a lat-long grid: it is quicker than the sum over the basis.
const DIRECT_ORDER: usize = 20;

/// The function of `sh` at every texel centre of a map (zero outside the used part).
///
/// Lat-long maps by the fast transform, others up to order 20 by the sum over the basis, above by
/// interpolation from a lat-long grid of twice the needed samples with a regularised sinc; its error is
/// below 1e-7 of the function's range, less than f32 keeps.
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
    let oversampled = Oversampled::new(sh);
    fill(layout, width, height, || (), |(), d| oversampled.value(d))
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

/// Half the taps of the interpolation, per axis.
const HALF: usize = 11;
const TAPS: usize = 2 * HALF;
/// exp(−BETA) bounds the interpolation's error at twice the needed samples.
const BETA: f64 = HALF as f64 * PI / 2.0;

/// A band-limited function on a lat-long grid twice as dense as its band needs, read by the regularised
/// sinc of Kircheis, Potts & Tasche 2022, "On regularized Shannon sampling formulas with localized
/// sampling" (their sinh-type window): weights sinc(x−i)·sinh(β√(1−((x−i)/m)²))/sinh β, error e^−β with
/// β = mπ/2.
struct Oversampled {
    width: usize,
    height: usize,
    stride: usize,
    /// Rows with `TAPS` wrapped samples on either side.
    planes: [Vec<f64>; 3],
}

impl Oversampled {
    fn new(sh: &ShRgb) -> Self {
        let height = 2 * (sh.order + 1);
        let width = 2 * height;
        let plan = ShTransform::new(sh.order, width, height, Grid::Equirectangular);
        let mut flat: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; width * height]);
        plan.synthesize(sh, flat.each_mut().map(Vec::as_mut_slice));
        let stride = width + 2 * TAPS;
        let planes = flat.map(|p| {
            let rows = p.chunks_exact(width);
            rows.flat_map(|r| (0..stride).map(|i| r[(i + width - TAPS % width) % width])).collect()
        });
        Self { width, height, stride, planes }
    }

    fn value(&self, d: DVec3) -> [f64; 3] {
        let (width, height) = (self.width as f64, self.height as f64);
        let theta = d.x.hypot(d.z).atan2(d.y);
        let x = (0.5 + d.z.atan2(d.x) / (2.0 * PI)) * width - 0.5;
        let (j0, wj) = weights(theta / PI * height - 0.5);
        let (i0, wi) = weights(x);
        let mut sum = [0.0; 3];
        for (k, w) in wj.iter().enumerate() {
            let j = j0 + k as isize;
            // Beyond a pole the meridian continues on the other side.
            let (row, shift) = match j {
                j if j < 0 => ((-1 - j) as usize, self.width / 2),
                j if j >= self.height as isize => (2 * self.height - 1 - j as usize, self.width / 2),
                j => (j as usize, 0),
            };
            let column = (i0 + (self.width + shift) as isize) as usize % self.width;
            let start = row * self.stride + (column + TAPS);
            for (s, plane) in sum.iter_mut().zip(&self.planes) {
                let taps = &plane[start..start + TAPS];
                *s += w * taps.iter().zip(&wi).map(|(t, w)| t * w).sum::<f64>();
            }
        }
        sum
    }
}

/// The first sample that counts at x, and the weights of `TAPS` samples from it.
fn weights(x: f64) -> (isize, [f64; TAPS]) {
    let floor = x.floor();
    let t = x - floor;
    let first = floor as isize - (HALF as isize - 1);
    // sin π(t + HALF − 1 − k) alternates in sign.
    let sin = (PI * t).sin();
    let mut w = [0.0; TAPS];
    for (k, w) in w.iter_mut().enumerate() {
        let u = t + (HALF - 1) as f64 - k as f64;
        let sinc = if u == 0.0 {
            1.0
        } else {
            let sign = if (HALF - 1 + k).is_multiple_of(2) { 1.0 } else { -1.0 };
            sign * sin / (PI * u)
        };
        let inside = (1.0 - (u / HALF as f64).powi(2)).max(0.0).sqrt();
        // sinh(βs)/sinh β without overflow.
        let window =
            ((BETA * (inside - 1.0)).exp() - (-BETA * (inside + 1.0)).exp()) / (1.0 - (-2.0 * BETA).exp());
        *w = sinc * window;
    }
    (first, w)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(order: usize) -> ShRgb {
        let mut sh = ShRgb::zero(order);
        for (k, c) in sh.c.iter_mut().enumerate() {
            for (i, c) in c.iter_mut().enumerate() {
                *c = ((i * i + 3 * k) as f64).sin();
            }
        }
        sh
    }

    /// All energy in the highest band is the worst case.
    #[test]
    fn interpolation_is_as_good_as_the_sum_over_the_basis() {
        for order in [21, 64] {
            let mut sh = noise(order);
            sh.c[1][..order * order].fill(0.0);
            let o = Oversampled::new(&sh);
            let mut range = [0.0_f64; 3];
            let mut worst = [0.0_f64; 3];
            for d in crate::quadrature::fibonacci(300).directions.into_iter().chain([
                DVec3::Y,
                -DVec3::Y,
                DVec3::X,
            ]) {
                let (a, b) = (o.value(d), sh.value(d));
                for k in 0..3 {
                    range[k] = range[k].max(b[k].abs());
                    worst[k] = worst[k].max((a[k] - b[k]).abs());
                }
            }
            for k in 0..3 {
                assert!(worst[k] < 1e-7 * range[k], "{order}: {:e}", worst[k] / range[k]);
            }
        }
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
    fn direct_and_fast_projections_agree() {
        let sh = noise(8);
        let image = synthesize(&sh, Layout::LatLong, 40, 20);
        let (a, b) = (super::super::project(&image, 10), super::super::project_direct(&image, 10));
        for (a, b) in a.c.iter().flatten().zip(b.c.iter().flatten()) {
            assert!((a - b).abs() < 1e-12);
        }
        let cube = synthesize(&sh, Layout::Cube, 128, 128);
        for (a, b) in sh.c.iter().flatten().zip(super::super::project(&cube, 8).c.iter().flatten()) {
            assert!((a - b).abs() < 1e-3, "{a} {b}");
        }
    }
}

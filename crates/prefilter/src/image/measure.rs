//! Integrals of images over their texels, and clamping of negative texels.

use steradian_parallel::prelude::*;
use steradian_sphere::{Layout, SphereImage};

/// Solid angles of the texels of one face, which are equal for all faces.
struct Areas {
    layout: Layout,
    width: usize,
    /// One per row of a lat-long image, else per texel.
    omega: Vec<f64>,
}

impl Areas {
    fn new(layout: Layout, width: usize, height: usize) -> Self {
        let omega = match layout {
            Layout::LatLong => (0..height).map(|j| layout.solid_angle(width, height, 0, 0, j)).collect(),
            Layout::Cube => cube(width),
            _ => (0..width * height)
                .into_par_iter()
                .map(|k| layout.solid_angle(width, height, 0, k % width, k / width))
                .collect(),
        };
        Self { layout, width, omega }
    }

    /// Σ Ω v over row `j` of a face.
    fn row(&self, j: usize, values: &[f32]) -> f64 {
        if self.layout == Layout::LatLong {
            return self.omega[j] * values.iter().map(|&v| f64::from(v)).sum::<f64>();
        }
        let omega = &self.omega[j * self.width..][..self.width];
        omega.iter().zip(values).map(|(w, &v)| w * f64::from(v)).sum()
    }
}

/// Solid angles of a cube's texels: differences of atan(xy/√(1 + x² + y²)), that of the rectangle from the
/// face's middle to a corner; one quarter, mirrored.
fn cube(n: usize) -> Vec<f64> {
    let at = |k: usize| 2.0 * k as f64 / n as f64 - 1.0;
    let half = n / 2;
    // Corners from the middle (or half a texel before it) to the border.
    let side = n - half + 1;
    let corner = |k: usize| {
        let (x, y) = (at(half + k % side), at(half + k / side));
        (x * y).atan2((1.0 + x * x + y * y).sqrt())
    };
    let corners: Vec<f64> = (0..side * side).map(corner).collect();
    let fold = |k: usize| k.max(n - 1 - k) - half;
    let texel = |k: usize| {
        let (i, j) = (fold(k % n), fold(k / n));
        let c = |i: usize, j: usize| corners[j * side + i];
        (c(i + 1, j + 1) - c(i, j + 1)) - (c(i + 1, j) - c(i, j))
    };
    (0..n * n).map(texel).collect()
}

/// ∫ of an image, and the relative flux added by clamping negative texels to zero, if `raise`.
pub(crate) fn finish(image: &mut SphereImage, raise: bool) -> ([f64; 3], f64) {
    let (width, height) = (image.width.max(1), image.height.max(1));
    let areas = Areas::new(image.layout, image.width, image.height);
    let sums = image.planes.each_mut().map(|plane| {
        let rows = plane.par_chunks_mut(width).enumerate();
        let sums: Vec<[f64; 2]> = rows
            .map(|(row, values)| {
                let before = areas.row(row % height, values);
                if !raise || values.iter().all(|&v| v >= 0.0) {
                    return [before, 0.0];
                }
                values.iter_mut().for_each(|v| *v = v.max(0.0));
                let after = areas.row(row % height, values);
                [after, after - before]
            })
            .collect();
        sums.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
    });
    let (all, added) = (sums.iter().map(|s| s[0]).sum::<f64>(), sums.iter().map(|s| s[1]).sum::<f64>());
    (sums.map(|s| s[0]), if all > 0.0 { added / all } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrals_are_the_images() {
        for (layout, w, h) in [
            (Layout::Cube, 5, 5),
            (Layout::Cube, 16, 16),
            (Layout::LatLong, 12, 6),
            (Layout::Octahedral, 8, 8),
        ] {
            let mut image = SphereImage::from_fn(layout, w, h, |d| [d.x as f32 + 0.5, 1.0, d.z as f32]);
            let exact = image.integral();
            let (sum, added) = finish(&mut image, false);
            assert_eq!(added, 0.0);
            for c in 0..3 {
                assert!((sum[c] - exact[c]).abs() < 1e-12, "{layout:?}: {sum:?} {exact:?}");
            }
            let (sum, added) = finish(&mut image, true);
            assert!(image.planes.iter().flatten().all(|&v| v >= 0.0));
            let all: f64 = sum.iter().sum();
            assert!((added - (all - exact.iter().sum::<f64>()) / all).abs() < 1e-12);
        }
    }
}

//! The angular filter: the convolution integral by direct summation, direction by direction. Exact for
//! kernels of any sharpness; the frequency filter is faster where it suffices.

use crate::{Tree, Zonal};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_sphere::SphereImage;

/// Part of the angle over which a kernel varies that counts as one piece: the error falls as its square.
const PIECE: f64 = 0.5;

/// Approximate relative error of [`convolve_at`], where the light is not negative.
pub const ERROR: f64 = 1e-3;

/// ∫ L(wi) K(d·wi) dwi over the light of `tree`, to about [`ERROR`].
pub fn convolve_at(tree: &Tree, kernel: &dyn Zonal, d: DVec3) -> [f64; 3] {
    let (width, support) = (kernel.width(), kernel.support());
    let scale = |c: DVec3, radius: f64| {
        // The chord is at most the angle; a node is dark to the kernel where even its nearest point is
        // beyond.
        let angle = angle(0.5 * d.distance(c));
        // Tails fall like θ⁻⁴: they vary over a fraction of θ.
        if angle - 1.6 * radius > support { f64::INFINITY } else { PIECE * (0.5 * angle).max(width) }
    };
    tree.integrate(scale, |wi| [kernel.value(d.dot(wi)); 3])
}

/// The angle, radians, whose half has sine `y`, to within 4e-4: enough to decide which parts of the light are
/// treated as points.
#[inline]
pub fn angle(y: f64) -> f64 {
    if y < 0.5 {
        let y2 = y * y;
        return 2.0 * y * (1.0 + y2 * (1.0 / 6.0 + y2 * (0.075 + y2 * (15.0 / 336.0))));
    }
    // From the other end: acos(1 − z) = √(2z) (1 + z/12 + 3z²/160 + …).
    let z = (1.0 - y).max(0.0);
    PI - 2.0 * (2.0 * z).sqrt() * (1.0 + z * (1.0 / 12.0 + z * (3.0 / 160.0 + z * (5.0 / 896.0))))
}

/// Sums over every texel at its centre, without a hierarchy, for tests.
pub fn brute_force(image: &SphereImage, kernel: &dyn Zonal, d: DVec3) -> [f64; 3] {
    use steradian_sphere::layout::Position;
    let mut sum = [0.0; 3];
    for face in 0..image.layout.faces() {
        for j in 0..image.height {
            for i in 0..image.width {
                let at = Position { face, x: i as f64 + 0.5, y: j as f64 + 0.5 };
                let Some(wi) = image.layout.direction(image.width, image.height, at) else { continue };
                let w =
                    image.layout.solid_angle(image.width, image.height, face, i, j) * kernel.value(d.dot(wi));
                let l = image.texel(face, i, j);
                (0..3).for_each(|c| sum[c] += w * f64::from(l[c]));
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_close_enough() {
        for k in 0..=1000 {
            let theta = PI * f64::from(k) / 1000.0;
            assert!((angle((0.5 * theta).sin()) - theta).abs() < 4e-4, "{theta}");
        }
    }
}

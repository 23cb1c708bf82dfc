//! Central directions of the maps' texels, and the frames about them.

use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// The frame [x', y', z'] about the central direction c (of any length but 0): z' = c, x' = ∂c/∂α, y' = z' ×
/// x', with α = acos(c.y) and β = atan2(c.z, c.x) as in lat-long images. Right-handed. At the poles β counts
/// as 0.
///
/// φ about c is measured from x' towards y'.
pub fn frame(c: DVec3) -> [DVec3; 3] {
    let (rho, r) = (DVec2::new(c.x, c.z).length(), c.length());
    let (cos_beta, sin_beta) = if rho > 0.0 { (c.x / rho, c.z / rho) } else { (1.0, 0.0) };
    let (cos_alpha, sin_alpha) = if r > 0.0 { (c.y / r, rho / r) } else { (1.0, 0.0) };
    axes([cos_alpha, sin_alpha], [cos_beta, sin_beta])
}

/// [`frame`] at angles: where α is 0 or π, the frame still turns with β.
pub fn frame_at(alpha: f64, beta: f64) -> [DVec3; 3] {
    let ((sa, ca), (sb, cb)) = (alpha.sin_cos(), beta.sin_cos());
    axes([ca, sa], [cb, sb])
}

fn axes([ca, sa]: [f64; 2], [cb, sb]: [f64; 2]) -> [DVec3; 3] {
    [DVec3::new(ca * cb, -sa, ca * sb), DVec3::new(sb, 0.0, -cb), DVec3::new(sa * cb, ca, sa * sb)]
}

/// (θ, φ) of direction `w` in a frame: θ from z', φ from x' towards y'. At θ = 0 or π, φ is 0.
pub fn angles_in(frame: &[DVec3; 3], w: DVec3) -> [f64; 2] {
    let [x, y, z] = frame.map(|axis| axis.dot(w));
    [DVec2::new(x, y).length().atan2(z), if x == 0.0 && y == 0.0 { 0.0 } else { y.atan2(x) }]
}

/// A lat-long grid of central directions whose first and last rows lie on the poles: row i at α = πi/(rows −
/// 1), column j at β = 2π(j + ½)/columns − π, texel centres at half-integers as in lat-long images. (Rows and
/// columns of the sphere's Clenshaw–Curtis grid.)
///
/// A pole is one direction but as many texels as there are columns: the frame turns with β, and so do the
/// values of maps with q ≠ 0. Bilinear interpolation in (α, β) is therefore continuous in the frame and right
/// up to the poles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Grid {
    rows: usize,
    columns: usize,
}

impl Grid {
    /// A grid of at least 2 rows and 1 column.
    pub fn new(rows: usize, columns: usize) -> Self {
        Self { rows: rows.max(2), columns: columns.max(1) }
    }

    /// Rows, both poles included.
    pub fn rows(self) -> usize {
        self.rows
    }

    /// Columns about the whole circle.
    pub fn columns(self) -> usize {
        self.columns
    }

    /// Texels of a plane.
    pub fn texels(self) -> usize {
        self.rows * self.columns
    }

    /// α of row i, radians from +Y.
    pub fn alpha(self, i: usize) -> f64 {
        PI * i as f64 / (self.rows - 1) as f64
    }

    /// β of column j, radians, −π … π.
    pub fn beta(self, j: usize) -> f64 {
        2.0 * PI * (j as f64 + 0.5) / self.columns as f64 - PI
    }

    /// Central direction of the texel in row i, column j.
    pub fn direction(self, i: usize, j: usize) -> DVec3 {
        self.frame(i, j)[2]
    }

    /// Frame of the texel in row i, column j.
    pub fn frame(self, i: usize, j: usize) -> [DVec3; 3] {
        frame_at(self.alpha(i), self.beta(j))
    }

    /// The four texels about a direction (index in a plane, row-major) and their bilinear weights, with the
    /// frame to read what they interpolate in: [`frame`] of `c`.
    pub fn bilinear(self, c: DVec3) -> [(usize, f64); 4] {
        let alpha = c.x.hypot(c.z).atan2(c.y);
        let beta = if c.x == 0.0 && c.z == 0.0 { 0.0 } else { c.z.atan2(c.x) };
        let y = alpha / PI * (self.rows - 1) as f64;
        // Casts turn NaN into 0.
        let i = (y as usize).min(self.rows - 2);
        let x = (0.5 + beta / (2.0 * PI)) * self.columns as f64 - 0.5;
        let x = if x < 0.0 { x + self.columns as f64 } else { x };
        let j = (x as usize).min(self.columns - 1);
        let (v, u) = (y - i as f64, x - j as f64);
        let next = (j + 1) % self.columns;
        let at = |i: usize, j: usize| i * self.columns + j;
        [
            (at(i, j), (1.0 - u) * (1.0 - v)),
            (at(i, next), u * (1.0 - v)),
            (at(i + 1, j), (1.0 - u) * v),
            (at(i + 1, next), u * v),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_right_handed_and_follow_the_meridian() {
        for (alpha, beta) in [(0.3, 1.0), (2.8, -2.0), (1.5, 3.1), (0.0, 0.7), (PI, -1.0)] {
            let [x, y, z] = frame_at(alpha, beta);
            assert!((x.cross(y) - z).length() < 1e-15);
            let step = frame_at(alpha + 1e-6, beta)[2] - z;
            assert!((step / 1e-6 - x).length() < 1e-5);
            if z.x.hypot(z.z) > 1e-9 {
                let again = frame(z);
                assert!((0..3).all(|k| (again[k] - [x, y, z][k]).length() < 1e-14));
            }
            let w = x * 0.6 * 0.5_f64.cos() + y * 0.6 * 0.5_f64.sin() + z * 0.8;
            let [theta, phi] = angles_in(&[x, y, z], w);
            assert!((theta - 0.6_f64.asin()).abs() < 1e-12 && (phi - 0.5).abs() < 1e-12);
        }
    }

    #[test]
    fn bilinear_weights_meet_texels_and_wrap() {
        let grid = Grid::new(9, 12);
        for (i, j) in [(1, 0), (4, 11), (7, 5)] {
            let near = grid.bilinear(grid.direction(i, j));
            let weight: f64 = near.iter().filter(|(k, _)| *k == i * 12 + j).map(|n| n.1).sum();
            assert!((weight - 1.0).abs() < 1e-12, "{near:?}");
        }
        let seam = grid.bilinear(DVec3::new(-1.0, 0.0, 0.0));
        assert!(seam.iter().filter(|n| n.1 > 0.4).map(|n| n.0 % 12).eq([11, 0]), "{seam:?}");
        for c in [DVec3::Y, -DVec3::Y, DVec3::NAN, DVec3::ZERO] {
            assert!(grid.bilinear(c).iter().all(|n| n.0 < grid.texels()));
        }
    }
}

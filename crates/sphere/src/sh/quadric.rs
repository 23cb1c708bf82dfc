//! Functions of order 2 on the sphere as nᵀMn of homogeneous n = (x, y, z, 1).
//!
//! Ramamoorthi & Hanrahan (2001), *An Efficient Representation for Irradiance Environment Maps*, eqs 11–12.

use super::{ShRgb, index};
use glam::{Mat3, Mat4};
use std::f64::consts::PI;

/// One symmetric matrix per channel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Quadric(pub [Mat4; 3]);

impl Quadric {
    /// The function Σ_{l ≤ 2} `scale_l` c_lm Y_lm, with `scale` per channel and band.
    pub fn new(sh: &ShRgb, scale: [[f64; 3]; 3]) -> Self {
        Self(std::array::from_fn(|k| matrix(&sh.c[k], scale[k])))
    }

    /// The function turned by `rotation`.
    pub fn turned(&self, rotation: Mat3) -> Self {
        let r = Mat4::from_mat3(rotation);
        Self(self.0.map(|m| r * m * r.transpose()))
    }

    /// The value of all channels at unit `n`.
    #[inline(always)]
    pub fn value(&self, n: [f32; 3]) -> [f32; 3] {
        [Self::form(&self.0[0], n), Self::form(&self.0[1], n), Self::form(&self.0[2], n)]
    }

    /// nᵀMn of one channel at unit `n`, M symmetric.
    #[inline(always)]
    pub fn form(m: &Mat4, n: [f32; 3]) -> f32 {
        let [x, y, z] = n;
        let (a, b, c, d) = (m.x_axis, m.y_axis, m.z_axis, m.w_axis);
        let square = a.x * x * x + b.y * y * y + c.z * z * z;
        let cross = a.y * x * y + a.z * x * z + b.z * y * z;
        let linear = a.w * x + b.w * y + c.w * z;
        square + 2.0 * (cross + linear) + d.w
    }
}

/// Eqs 11–12, with the basis's own constants where the paper has rounded c1 … c5, and with the term −c5/3 of
/// Y_20 distributed over xx and yy by 1 = x² + y² + z².
fn matrix(c: &[f64], scale: [f64; 3]) -> Mat4 {
    let e = |l: usize, m: isize| scale[l] * c.get(index(l, m)).copied().unwrap_or(0.0);
    let (y0, y1) = ((0.25 / PI).sqrt(), (0.75 / PI).sqrt());
    let (y2, y20) = ((15.0 / (4.0 * PI)).sqrt(), (5.0 / (16.0 * PI)).sqrt());
    let xx = 0.5 * y2 * e(2, 2) - y20 * e(2, 0);
    let yy = -0.5 * y2 * e(2, 2) - y20 * e(2, 0);
    let zz = 2.0 * y20 * e(2, 0);
    let (xy, yz, xz) = (0.5 * y2 * e(2, -2), 0.5 * y2 * e(2, -1), 0.5 * y2 * e(2, 1));
    let (x, y, z) = (0.5 * y1 * e(1, 1), 0.5 * y1 * e(1, -1), 0.5 * y1 * e(1, 0));
    let m = [[xx, xy, xz, x], [xy, yy, yz, y], [xz, yz, zz, z], [x, y, z, y0 * e(0, 0)]];
    Mat4::from_cols_array_2d(&m.map(|r| r.map(|v| v as f32)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn some() -> ShRgb {
        let c = std::array::from_fn(|k| (0..9).map(|i| ((i * 7 + k * 3) % 5) as f64 - 1.5).collect());
        ShRgb { order: 2, c }
    }

    #[test]
    fn the_matrix_form_equals_the_sum() {
        let q = Quadric::new(&some(), [[1.0; 3]; 3]);
        for k in 0..100 {
            let (z, phi) = (0.99 - 0.02 * f64::from(k), 2.4 * f64::from(k));
            let r = (1.0 - z * z).sqrt();
            let d = DVec3::new(r * phi.cos(), r * phi.sin(), z);
            let (a, b) = (q.value(d.as_vec3().to_array()), some().value(d));
            for c in 0..3 {
                assert!((f64::from(a[c]) - b[c]).abs() < 3e-6, "{a:?} {b:?}");
            }
        }
    }

    #[test]
    fn turning_turns_the_function() {
        let q = Quadric::new(&some(), [[1.0; 3]; 3]);
        let r = Mat3::from_rotation_y(0.7) * Mat3::from_rotation_x(0.4);
        let d = DVec3::new(0.3, -0.5, 0.6).normalize().as_vec3();
        let (a, b) = (q.turned(r).value((r * d).to_array()), q.value(d.to_array()));
        assert!((0..3).all(|c| (a[c] - b[c]).abs() < 1e-5));
    }
}

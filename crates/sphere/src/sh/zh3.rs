//! Quadratic zonal harmonics: linear light and one more number per channel.
//!
//! Roughton, Sloan, Silvennoinen, Iwanicki, Shirley 2024, ZH3: Quadratic Zonal Harmonics. Linear coefficients
//! know the main direction of light; about it, band 2 is reduced to its zonal part. The axis is that of
//! luminance (their section 3.4), shared by the channels. Stored, the number is the projection of band 2
//! (exact where the light is symmetric about the axis); hallucinated (their section 3.4.3), it follows from
//! bands 0 and 1 by a fit, z = c₀ (0.08 r + 0.6 r²) with r = |c₁·axis|/c₀, and nothing is stored.

use super::{ShRgb, count, eval};
use glam::DVec3;
use std::f64::consts::PI;

/// Bands 0 and 1, and band 2 about an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Zh3 {
    /// Order 1.
    pub linear: ShRgb,
    /// Unit; +Y where band 1 has no luminance.
    pub axis: DVec3,
    /// By channel the coefficient of Y(2,0) about the axis, √(5/16π) (3 (axis·d)² − 1).
    pub zonal: [f64; 3],
}

/// Rec. 709.
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];

impl Zh3 {
    /// The stored variant of radiance coefficients; without band 2 its numbers are 0.
    pub fn project(sh: &ShRgb) -> Self {
        let (linear, axis) = split(sh);
        let mut zonal = [0.0; 3];
        if sh.order >= 2 {
            let z = zonal_basis(axis);
            zonal = sh.c.each_ref().map(|c| c[4..9].iter().zip(&z).map(|(c, z)| c * z).sum());
        }
        Self { linear, axis, zonal }
    }

    /// The hallucinated variant, from bands 0 and 1 of radiance alone.
    pub fn hallucinate(sh: &ShRgb) -> Self {
        let (linear, axis) = split(sh);
        let zonal = linear.c.each_ref().map(|c| {
            if c[0] <= 0.0 {
                return 0.0;
            }
            let r = DVec3::new(c[3], c[1], c[2]).dot(axis).abs() / c[0];
            c[0] * (0.08 * r + 0.6 * r * r)
        });
        Self { linear, axis, zonal }
    }

    /// The same function with nine coefficients.
    pub fn quadratic(&self) -> ShRgb {
        let mut sh = ShRgb::zero(2);
        let z = zonal_basis(self.axis);
        for ((c, linear), zonal) in sh.c.iter_mut().zip(&self.linear.c).zip(self.zonal) {
            c[..4].copy_from_slice(&linear[..4]);
            c[4..].iter_mut().zip(&z).for_each(|(c, z)| *c = zonal * z);
        }
        sh
    }
}

/// Bands 0 and 1, and their axis.
fn split(sh: &ShRgb) -> (ShRgb, DVec3) {
    let mut linear = ShRgb::zero(1);
    for (to, from) in linear.c.iter_mut().zip(&sh.c) {
        to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
    }
    let sum = |i: usize| linear.c.iter().zip(LUMINANCE).map(|(c, w)| w * c[i]).sum::<f64>();
    // Y(1, −1), Y(1, 0), Y(1, 1) are y, z, x.
    let axis = DVec3::new(sum(3), sum(1), sum(2)).try_normalize().unwrap_or(DVec3::Y);
    (linear, axis)
}

/// Y(2, 0) about `axis` in the basis: √(4π/5) Y(2, m)(axis).
fn zonal_basis(axis: DVec3) -> [f64; 5] {
    let mut y = [0.0; count(2)];
    eval(2, axis, &mut y);
    std::array::from_fn(|m| (4.0 * PI / 5.0).sqrt() * y[4 + m])
}

#[cfg(test)]
mod tests {
    use super::super::zonal;
    use super::*;

    #[test]
    fn light_about_an_axis_is_exact() {
        let d = DVec3::new(0.2, -0.5, 0.7).normalize();
        let mut sh = ShRgb::zero(2);
        sh.add_lobe(&zonal::disk(2, 0.4), d, [1.0, 0.5, 2.0]);
        sh.c[0][0] += 0.3;
        let z = Zh3::project(&sh);
        assert!((z.axis - d).length() < 1e-12);
        for (a, b) in z.quadratic().c.iter().flatten().zip(sh.c.iter().flatten()) {
            assert!((a - b).abs() < 1e-12);
        }
        // Along the axis the zonal basis has the value √(5/4π).
        let unit = Zh3 { linear: ShRgb::zero(1), axis: d, zonal: [1.0; 3] };
        assert!((unit.quadratic().value(d)[0] - (5.0 / (4.0 * PI)).sqrt()).abs() < 1e-12);
    }

    #[test]
    fn the_fit_meets_its_ends() {
        // Ambient light: nothing. A lone sun: r = √3, z = c₀ (0.08 √3 + 1.8), which is 0.867 of the exact √5
        // c₀.
        let mut sh = ShRgb::zero(2);
        sh.c[0][0] = 1.0;
        assert_eq!(Zh3::hallucinate(&sh).zonal, [0.0; 3]);
        sh.add_lobe(&[1.0; 3], DVec3::X, [0.0, 1.0, 0.0]);
        let (a, b) = (Zh3::hallucinate(&sh), Zh3::project(&sh));
        assert!((a.zonal[1] / b.zonal[1] - (0.08 * 3f64.sqrt() + 1.8) / 5f64.sqrt()).abs() < 1e-12);
    }
}

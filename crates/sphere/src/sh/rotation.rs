//! Rotation of coefficients, band by band, to any order.

use super::exchange::Band;
use super::{ShRgb, count};
use glam::{DMat3, DVec3};
use steradian_parallel::prelude::*;

/// ZYZ Euler angles (α, β, γ), radians: R = R_z(α) R_y(β) R_z(γ), active matrices on column vectors.
///
/// γ comes from what remains after R_z(α) is taken off, so that α + γ (or α − γ) stays accurate where β is
/// near 0 or π.
pub fn euler_zyz(r: DMat3) -> [f64; 3] {
    let z = r.z_axis;
    let alpha = if z.x == 0.0 && z.y == 0.0 { 0.0 } else { z.y.atan2(z.x) };
    let rest = DMat3::from_rotation_z(-alpha) * r;
    let beta = rest.z_axis.x.atan2(rest.z_axis.z);
    let gamma = rest.x_axis.y.atan2(rest.y_axis.y);
    [alpha, beta, gamma]
}

/// Rotates coefficients: the result is the function turned by `rotation` (f'(d) = f(rotation⁻¹ d)).
///
/// M(R) = Z(α) X Z(−β) X Z(γ) with X the exchange of y and z, since R_y(β) = X R_z(−β) X (the ZXZXZ scheme
/// of Pinchon & Hoggan 2007, J. Phys. A 40, with the exchange of axes in place of the quarter turn).
/// O(order³) without tables; stable to order 2047 and beyond.
pub struct Rotation {
    order: usize,
    /// cos and sin of mγ, −mβ and mα for each m, in the order in which they are applied.
    turns: [Vec<(f64, f64)>; 3],
    /// The matrix mirrors: odd bands change sign after its negative, a rotation, was applied.
    mirrored: bool,
}

/// Below this order one band is too little work for another thread.
const PARALLEL_ORDER: usize = 80;

impl Rotation {
    /// A plan for rotations up to `order`. `rotation` must be orthogonal; one that mirrors (determinant −1)
    /// is taken as well.
    pub fn new(order: usize, rotation: DMat3) -> Self {
        let mirrored = rotation.determinant() < 0.0;
        let [alpha, beta, gamma] = euler_zyz(if mirrored { -rotation } else { rotation });
        let turn = |angle: f64| (0..=order).map(|m| sin_cos(m, angle)).collect();
        Self { order, turns: [turn(gamma), turn(-beta), turn(alpha)], mirrored }
    }

    /// Applies the rotation to `count(order)` coefficients.
    ///
    /// # Panics
    /// If either slice is shorter.
    pub fn apply(&self, c: &[f64], out: &mut [f64]) {
        let n = count(self.order);
        out[..n].copy_from_slice(&c[..n]);
        self.apply_in_place([&mut out[..n]]);
    }

    /// Applies the rotation to three channels at once, which shares most of the work. Bands above the
    /// plan's order are dropped.
    pub fn apply_rgb(&self, sh: &ShRgb) -> ShRgb {
        let mut out = ShRgb::zero(self.order);
        let n = count(self.order.min(sh.order));
        for (o, c) in out.c.iter_mut().zip(&sh.c) {
            o[..n].copy_from_slice(&c[..n]);
        }
        self.apply_in_place(out.c.each_mut().map(Vec::as_mut_slice));
        out
    }

    fn apply_in_place<const C: usize>(&self, c: [&mut [f64]; C]) {
        for_each_band(self.order, c, |l, scratch, mut band| self.turn_band(l, scratch, &mut band));
    }

    fn turn_band<const C: usize>(&self, l: usize, scratch: &mut Band<C>, band: &mut [&mut [f64]; C]) {
        if l == 0 {
            return;
        }
        let turns = self.turns.each_ref().map(|turns| {
            // (c, s) ← (c cos mα − s sin mα, c sin mα + s cos mα).
            move |m: usize, c: f64, s: f64| {
                let (cos, sin) = turns[m];
                (c * cos - s * sin, c * sin + s * cos)
            }
        });
        scratch.rotate(l, band, turns);
        if self.mirrored && l % 2 == 1 {
            band.iter_mut().for_each(|b| b.iter_mut().for_each(|x| *x = -*x));
        }
    }
}

/// cos mα and sin mα, with the angle's multiple reduced before rounding hurts.
fn sin_cos(m: usize, angle: f64) -> (f64, f64) {
    let (s, c) = (m as f64 * angle).sin_cos();
    (c, s)
}

/// Exchanges y and z in all bands.
pub(crate) fn exchange_yz<const C: usize>(order: usize, c: [&mut [f64]; C]) {
    for_each_band(order, c, |l, scratch, mut band| scratch.exchange(l, &mut band));
}

/// Runs `f` on each band, in parallel where that pays; bands do not touch each other.
fn for_each_band<const C: usize>(
    order: usize,
    c: [&mut [f64]; C],
    f: impl Fn(usize, &mut Band<C>, [&mut [f64]; C]) + Sync,
) {
    let mut rest = c;
    let mut bands = Vec::with_capacity(order + 1);
    for l in 0..=order {
        let mut band: [&mut [f64]; C] = std::array::from_fn(|_| [].as_mut_slice());
        for (r, b) in rest.iter_mut().zip(&mut band) {
            let (head, tail) = std::mem::take(r).split_at_mut(2 * l + 1);
            (*b, *r) = (head, tail);
        }
        bands.push((l, band));
    }
    if order < PARALLEL_ORDER {
        let mut scratch = Band::new();
        bands.into_iter().for_each(|(l, band)| f(l, &mut scratch, band));
    } else {
        bands.into_par_iter().rev().for_each_init(Band::new, |scratch, (l, band)| f(l, scratch, band));
    }
}

/// The rotation that takes +Z to unit direction `d` (about an axis in the xy plane's frame: R_z(φ) R_y(θ)).
pub fn z_to(d: DVec3) -> DMat3 {
    let (theta, phi) = (d.x.hypot(d.y).atan2(d.z), d.y.atan2(d.x));
    DMat3::from_rotation_z(phi) * DMat3::from_rotation_y(theta)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sh::{eval, index};

    fn turn(a: f64, b: f64, c: f64) -> DMat3 {
        DMat3::from_rotation_z(a) * DMat3::from_rotation_x(b) * DMat3::from_rotation_y(c)
    }

    fn noise(n: usize) -> Vec<f64> {
        (0..n as u64)
            .map(|i| (i.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 11) as f64 / (1u64 << 53) as f64 - 0.5)
            .collect()
    }

    fn rotated(order: usize, r: DMat3, c: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; c.len()];
        Rotation::new(order, r).apply(c, &mut out);
        out
    }

    fn worst(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn rotations_form_a_group_to_band_1023() {
        for order in [255, 1023] {
            let (r1, r2) = (turn(0.3, -1.9, 2.2), turn(-2.5, 0.4, 1.1));
            let c = noise(count(order));
            let two = rotated(order, r1, &rotated(order, r2, &c));
            assert!(worst(&two, &rotated(order, r1 * r2, &c)) < 1e-11, "{order}");
            let back = rotated(order, r1.transpose(), &rotated(order, r1, &c));
            assert!(worst(&back, &c) < 1e-11, "{order}");
        }
    }

    /// The value of f' at R d is the value of f at d.
    #[test]
    fn rotated_values_stand_at_rotated_points_at_band_255() {
        let order = 255;
        let r = turn(0.7, 1.2, -0.4);
        let c = noise(count(order));
        let scale = c.iter().map(|x| x * x).sum::<f64>().sqrt();
        let turned = rotated(order, r, &c);
        let (mut y, mut yr) = (vec![0.0; c.len()], vec![0.0; c.len()]);
        for d in [DVec3::new(0.1, 0.9, -0.3), DVec3::new(-0.4, 0.2, 0.8), DVec3::new(1.0, -0.4, 0.01)] {
            let d = d.normalize();
            eval(order, d, &mut y);
            eval(order, r * d, &mut yr);
            let (a, b): (f64, f64) = (
                c.iter().zip(&y).map(|(a, b)| a * b).sum(),
                turned.iter().zip(&yr).map(|(a, b)| a * b).sum(),
            );
            assert!((a - b).abs() < 1e-11 * scale, "{a} {b} {scale}");
        }
    }

    /// At band 1 the matrix is the rotation itself on (y, z, x); also near the poles of the Euler angles.
    #[test]
    fn band_one_turns_as_vectors_do() {
        let near = DMat3::from_rotation_z(1.0) * DMat3::from_rotation_y(1e-9) * DMat3::from_rotation_z(0.5);
        let flip = DMat3::from_rotation_x(std::f64::consts::PI - 1e-12) * DMat3::from_rotation_z(0.8);
        for r in [DMat3::IDENTITY, turn(1.0, 2.0, 3.0), near, flip, -turn(0.2, 0.1, 0.5)] {
            let v = DVec3::new(0.3, -0.8, 0.5);
            let out = rotated(1, r, &[1.0, v.y, v.z, v.x]);
            let e = r * v;
            assert!(worst(&out, &[1.0, e.y, e.z, e.x]) < 1e-14, "{out:?} {e}");
        }
    }

    #[test]
    fn nearly_polar_rotations_keep_their_azimuth_at_band_255() {
        let r = DMat3::from_rotation_z(1.0) * DMat3::from_rotation_y(1e-9) * DMat3::from_rotation_z(0.5);
        let c = noise(count(255));
        let two = rotated(255, DMat3::from_rotation_z(-1.0), &rotated(255, r, &c));
        let one = rotated(255, DMat3::from_rotation_y(1e-9) * DMat3::from_rotation_z(0.5), &c);
        assert!(worst(&two, &one) < 1e-11);
    }

    #[test]
    fn channels_and_single_functions_agree_and_norms_stay() {
        let order = 60;
        let c = noise(count(order));
        let sh = ShRgb { order, c: std::array::from_fn(|k| c.iter().map(|x| x * (k + 1) as f64).collect()) };
        let plan = Rotation::new(order, turn(0.1, 0.2, 0.3));
        let rgb = plan.apply_rgb(&sh);
        let one = rotated(order, turn(0.1, 0.2, 0.3), &c);
        assert!(worst(&rgb.c[0], &one) < 1e-14);
        let energy = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
        assert!((energy(&rgb.c[2]) / energy(&sh.c[2]) - 1.0).abs() < 1e-13);
    }

    #[test]
    fn zonal_functions_follow_their_axis() {
        let d = DVec3::new(0.3, -0.5, 0.2).normalize();
        let mut c = vec![0.0; count(20)];
        for l in 0..=20 {
            c[index(l, 0)] = ((2 * l + 1) as f64 / 4.0 / std::f64::consts::PI).sqrt();
        }
        let mut y = vec![0.0; count(20)];
        eval(20, d, &mut y);
        assert!(worst(&rotated(20, z_to(d), &c), &y) < 1e-13);
        assert!((z_to(d) * DVec3::Z).abs_diff_eq(d, 1e-15));
    }
}

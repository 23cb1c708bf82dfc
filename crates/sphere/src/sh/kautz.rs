//! Rotation of coefficients as Kautz, Sloan & Snyder (2002), *Fast, Arbitrary BRDF Shading for Low-Frequency
//! Lighting Using Spherical Harmonics*, appendix, do it: what [`super::Rotation`] and [`super::Turns`] are
//! held against.

use super::{Rotation, count, index};
use glam::{DMat3, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};

/// Turns the first bands of `c` in place, f'(d) = f(R⁻¹ d), with matrices written out in the components of R
/// ("useful for very low-order projections"): three bands, or fewer where `c` is shorter; what follows stays.
///
/// Band 1 is the vector (y, z, x). Band 2 is the quadratic form dᵀ A d of a symmetric matrix without trace,
/// which R turns to R A Rᵀ.
pub fn turn_symbolic(r: DMat3, c: &mut [f64]) {
    if c.len() >= 4 {
        let v = r * DVec3::new(c[3], c[1], c[2]);
        (c[1], c[2], c[3]) = (v.y, v.z, v.x);
    }
    if c.len() >= 9 {
        // Y_2m = 2a (xy, yz, √3/6 (3z² − 1), xz, (x² − y²)/2), a = √(15/16π); 3z² − 1 = 2z² − x² − y² on the
        // sphere.
        let s = 1.0 / 3f64.sqrt();
        let [xy, yz, zz, xz, xx] = [c[4], c[5], c[6] * s, c[7], c[8]];
        let a = DMat3::from_cols(
            DVec3::new(xx - zz, xy, xz),
            DVec3::new(xy, -xx - zz, yz),
            DVec3::new(xz, yz, 2.0 * zz),
        );
        let b = r * a * r.transpose();
        c[4] = b.x_axis.y;
        c[5] = b.y_axis.z;
        c[6] = 0.5 * b.z_axis.z / s;
        c[7] = b.x_axis.z;
        c[8] = 0.5 * (b.x_axis.x - b.y_axis.y);
    }
}

/// Turns by ZYZ angles whose turn about y is made of two fixed quarter turns about x and a turn about z
/// between them, the fixed ones as sparse tables.
#[derive(Debug, Clone)]
pub struct QuarterTurns {
    bands: usize,
    /// (to, from, factor) of R_x(90°).
    entries: Vec<(usize, usize, f64)>,
}

impl QuarterTurns {
    /// The tables of the first `bands` bands.
    pub fn new(bands: usize) -> Self {
        let order = bands.max(1) - 1;
        let quarter = Rotation::new(order, DMat3::from_rotation_x(FRAC_PI_2));
        let mut entries = Vec::new();
        for from in 0..count(order) {
            let (mut one, mut column) = (vec![0.0; count(order)], vec![0.0; count(order)]);
            one[from] = 1.0;
            quarter.apply(&one, &mut column);
            entries
                .extend(column.iter().enumerate().filter(|e| e.1.abs() > 1e-9).map(|(to, x)| (to, from, *x)));
        }
        Self { bands: order + 1, entries }
    }

    /// How many numbers the tables hold.
    pub fn entries(&self) -> usize {
        self.entries.len()
    }

    /// Turns bands² coefficients in place, f'(d) = f(R⁻¹ d): R_y(β) = R_x(−90°) R_z(β) R_x(90°), whose signs
    /// the paper leaves open.
    ///
    /// # Panics
    /// If `c` is shorter.
    pub fn apply(&self, r: DMat3, c: &mut [f64]) {
        let [alpha, beta, gamma] = super::euler_zyz(r);
        self.turn_z(gamma, c);
        self.quarter(c, false);
        self.turn_z(beta, c);
        self.quarter(c, true);
        self.turn_z(alpha, c);
    }

    fn turn_z(&self, angle: f64, c: &mut [f64]) {
        for m in 1..self.bands {
            let (sin, cos) = (m as f64 * angle).rem_euclid(2.0 * PI).sin_cos();
            for l in m..self.bands {
                let (p, n) = (index(l, m as isize), index(l, -(m as isize)));
                (c[p], c[n]) = (c[p] * cos - c[n] * sin, c[p] * sin + c[n] * cos);
            }
        }
    }

    /// R_x(90°), or its inverse, the transposed table.
    fn quarter(&self, c: &mut [f64], back: bool) {
        let mut out = vec![0.0; count(self.bands - 1)];
        for &(to, from, x) in &self.entries {
            let (to, from) = if back { (from, to) } else { (to, from) };
            out[to] += x * c[from];
        }
        c[..out.len()].copy_from_slice(&out);
    }
}

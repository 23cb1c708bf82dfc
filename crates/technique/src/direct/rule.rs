//! Quadrature over a spherical cap; `direct.wgsl` has the same rules.
//!
//! A cap of angular radius ρ, seen in polar coordinates about its centre, has the area element dω = dt dφ
//! with t = 1 − cos θ. Gauss–Legendre's n nodes in t and 4n equal angles integrate every polynomial of degree
//! 4n − 1 in the plane: for a Gaussian of width s the error falls like (ρ/s)^4n/(4n)!, so that n follows from
//! ρ/s. Where the horizon crosses the cap, f_cos has a kink or a jump there; then the cap is cut into strips
//! of equal elevation, of which only those above the horizon count: with elevation e = e_c + ρ cos u,
//! sin²(Δφ/2) = (sin²(ρ/2) − sin²((e − e_c)/2))/ (cos e cos e_c) bounds the azimuth, and dω = cos e ρ sin u
//! du dφ.

use glam::DVec3;
use std::f64::consts::PI;
use std::sync::LazyLock;
use steradian_sphere::quadrature::gauss_legendre;

/// A disk in the local frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cap {
    /// Unit direction of its centre.
    pub centre: DVec3,
    /// Angular radius, radians.
    pub radius: f64,
}

/// The sizes of rules: up to 16 rings, or 32 strips.
const SIZES: [usize; 6] = [1, 2, 4, 8, 16, 32];
/// Largest ρ/s of each number of rings: relative error at the peak of a Gaussian at most about 1e-3. As many
/// strips lie across a cap as rings lie on both sides of its centre, so that it takes twice their number.
pub(super) const REACH: [f64; 5] = [0.5, 1.3, 3.0, 7.0, 15.0];
/// Below this ratio ρ/s the centre alone suffices: the error is at most (ρ/s)²/4.
pub(super) const POINT: f64 = 0.03;

/// Nodes and weights on 0 … 1 of Gauss–Legendre's rules of [`SIZES`] points.
static GAUSS: LazyLock<[Vec<(f64, f64)>; 6]> = LazyLock::new(|| {
    SIZES.map(|n| {
        let (x, w) = gauss_legendre(n);
        x.into_iter().zip(w).map(|(x, w)| (0.5 * (1.0 + x), 0.5 * w)).collect()
    })
});

/// The number of rings that the rule for a disk needs whose radius is `ratio` times the width of the
/// reflectance there: 0 for the centre alone; `None` beyond the largest rule. Caps that the horizon crosses
/// take at least eight strips.
pub fn rings(ratio: f64, crossed: bool) -> Option<usize> {
    if ratio < POINT && !crossed {
        return Some(0);
    }
    let n = SIZES.into_iter().zip(REACH).find(|(_, reach)| ratio < *reach)?.0;
    Some(if crossed { (2 * n).max(8) } else { n })
}

/// Nodes and weights on 0 … 1 of Gauss–Legendre's rules of 1, 2, 4, 8, 16 and 32 points, one rule after
/// another.
pub fn gauss() -> impl Iterator<Item = (f64, f64)> {
    GAUSS.iter().flatten().copied()
}

pub(super) fn nodes(n: usize) -> &'static [(f64, f64)] {
    SIZES.iter().position(|s| *s >= n).map_or(&[], |k| &GAUSS[k])
}

impl Cap {
    /// Solid angle: 4π sin²(ρ/2).
    pub fn solid_angle(&self) -> f64 {
        4.0 * PI * (0.5 * self.radius).sin().powi(2)
    }

    /// The unit direction at `versine` = 1 − cos θ and azimuth φ about the centre.
    pub fn direction(&self, versine: f64, phi: f64) -> DVec3 {
        let (a, b) = self.centre.any_orthonormal_pair();
        let r = (versine * (2.0 - versine)).max(0.0).sqrt();
        let (s, c) = phi.sin_cos();
        (a * (r * c) + b * (r * s) + self.centre * (1.0 - versine)).normalize_or(self.centre)
    }

    /// ∫ f over the cap by `n` rings of 4n points; by its centre where `n` is 0.
    pub fn polar(&self, n: usize, f: impl Fn(DVec3) -> [f64; 3]) -> [f64; 3] {
        let omega = self.solid_angle();
        if n == 0 {
            return f(self.centre).map(|v| v * omega);
        }
        let top = 2.0 * (0.5 * self.radius).sin().powi(2);
        let mut sum = [0.0; 3];
        for (k, &(t, w)) in nodes(n).iter().enumerate() {
            for i in 0..4 * n {
                // Rings are turned against each other.
                let phi = 2.0 * PI * (i as f64 + 0.5 * (k % 2) as f64) / (4 * n) as f64;
                let v = f(self.direction(t * top, phi));
                (0..3).for_each(|c| sum[c] += w * v[c]);
            }
        }
        sum.map(|v| v * omega / (4 * n) as f64)
    }

    /// ∫ f over the part of the cap above the horizon z = 0 by `n` strips of `n` points. Caps that hold the
    /// zenith are beyond it.
    pub fn strips(&self, n: usize, f: impl Fn(DVec3) -> [f64; 3]) -> [f64; 3] {
        let c = self.centre;
        let (centre, azimuth) = (c.z.clamp(-1.0, 1.0).asin(), c.y.atan2(c.x));
        let end = (-centre / self.radius).clamp(-1.0, 1.0).acos();
        let mut sum = [0.0; 3];
        for &(x, wx) in nodes(n) {
            let (su, cu) = (x * end).sin_cos();
            let e = centre + self.radius * cu;
            let half2 = (0.5 * self.radius).sin().powi(2) - (0.5 * self.radius * cu).sin().powi(2);
            let sine = (half2.max(0.0) / (e.cos() * centre.cos()).max(1e-12)).sqrt().min(1.0);
            let width = 4.0 * sine.asin();
            let strip = wx * end * self.radius * su * e.cos() * width;
            for &(y, wy) in nodes(n) {
                let phi = azimuth + width * (y - 0.5);
                let v = f(DVec3::new(e.cos() * phi.cos(), e.cos() * phi.sin(), e.sin()));
                (0..3).for_each(|k| sum[k] += strip * wy * v[k]);
            }
        }
        sum
    }
}

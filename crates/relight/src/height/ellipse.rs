//! Horizons as ellipses: the directions that see the light, projected along the normal to the unit disk, as
//! the inside of one ellipse (Heidrich et al. 2000; Kautz 2004 (STAR), 6.4.2).

use super::{HeightField, walk};
use glam::Vec3;
use std::f64::consts::TAU;
use steradian_numerics::dense::Cholesky;
use steradian_parallel::prelude::*;

/// Azimuths that an ellipse is fitted to.
const AZIMUTHS: usize = 64;
/// Rounds of weighted least squares: further ones change less than a thousandth of the disk.
const ROUNDS: usize = 16;
/// Residuals whose difference in r² is below this get equal weights.
const SMALL: f64 = 0.01;
/// Least weight of azimuths where the conic reaches beyond the disk.
const FREE: f64 = 1e-3;
/// Weight of a unit disk relative to the horizon: it decides only where the horizon does not determine the
/// conic.
const RIDGE: f64 = 1e-10;

/// A conic about the normal: directions with a x² + b xy + c y² + d x + e y ≤ 1 see the light, (x, y) the
/// tangential part of the unit direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ellipse(pub [f32; 5]);

impl Ellipse {
    /// The whole hemisphere.
    pub const OPEN: Self = Self([1.0, 0.0, 1.0, 0.0, 0.0]);

    /// The ellipse of a horizon of these elevations (radians) at equal steps of azimuth, at least five.
    ///
    /// Minimises the area whose visibility is wrong, by reweighted least squares: along azimuth φ the conic
    /// is A r² + B r = 1, and the area between it and the horizon r_k = cos e_k is ½ |r² − r_k²| dφ, the
    /// residual A r_k² + B r_k − 1 divided by d(A r² + B r)/d(r²). A sum of squares instead has half as much
    /// error again before a steep wall.
    pub fn new(elevations: &[f32]) -> Self {
        let n = elevations.len();
        let point = |k: usize| {
            let (sin, cos) = (TAU * k as f64 / n as f64).sin_cos();
            (f64::from(elevations[k]).cos(), cos, sin)
        };
        let row = |r: f64, cos: f64, sin: f64| {
            [r * r * cos * cos, r * r * cos * sin, r * r * sin * sin, r * cos, r * sin]
        };
        let open = Self::OPEN.0.map(f64::from);
        let mut q = open;
        for _ in 0..ROUNDS {
            let (mut a, mut b) = (vec![vec![0.0; 5]; 5], vec![0.0; 5]);
            for k in 0..5 {
                a[k][k] = RIDGE * n as f64;
                b[k] = RIDGE * n as f64 * open[k];
            }
            for k in 0..n {
                let (r, cos, sin) = point(k);
                let v = row(r, cos, sin);
                let square = q[0] * cos * cos + q[1] * cos * sin + q[2] * sin * sin;
                let slope = square + (q[3] * cos + q[4] * sin) / (2.0 * r.max(1e-3));
                let slope = slope.max(1e-2);
                let off = (v.iter().zip(q).map(|(v, q)| v * q).sum::<f64>() - 1.0) / slope;
                // Beyond the unit disk there are no directions: however far the conic goes, it misses no more
                // than what lies between the horizon and the disk's edge.
                let room = (1.0 - r * r) / off.abs().max(1e-12);
                let matters = if off < 0.0 { room.clamp(FREE, 1.0) } else { 1.0 };
                let weight = matters * SMALL / (slope * slope * off.abs().max(SMALL));
                for i in 0..5 {
                    b[i] += weight * v[i];
                    (0..5).for_each(|j| a[i][j] += weight * v[i] * v[j]);
                }
            }
            let Some(system) = Cholesky::new(&a) else { break };
            let next = system.solve(b);
            q.copy_from_slice(&next);
        }
        let [a, b, c, ..] = q;
        if q.iter().all(|v| v.is_finite()) && a > 0.0 && 4.0 * a * c > b * b {
            return Self(q.map(|v| v as f32));
        }
        // Where the conic is no ellipse: the circle of the same area.
        let mean = (0..n).map(|k| point(k).0.powi(2)).sum::<f64>() / n as f64;
        let all = (1.0 / mean.max(1e-6)) as f32;
        Self([all, 0.0, all, 0.0, 0.0])
    }

    /// Does a light in the unit direction `d` reach the texel?
    pub fn lit(&self, d: Vec3) -> bool {
        let [a, b, c, u, v] = self.0;
        d.z > 0.0 && a * d.x * d.x + b * d.x * d.y + c * d.y * d.y + u * d.x + v * d.y <= 1.0
    }
}

/// The ellipses of all texels in rows from the top, 20 bytes each.
#[derive(Debug, Clone, PartialEq)]
pub struct Ellipses(pub Vec<Ellipse>);

impl Ellipses {
    /// Ellipses of the horizons of a field; `None` where `go_on` says no.
    pub fn new(field: &HeightField, go_on: &(dyn Fn() -> bool + Sync)) -> Option<Self> {
        let phi: Vec<f64> = (0..AZIMUTHS).map(|k| TAU * k as f64 / AZIMUTHS as f64).collect();
        let slopes = walk::slopes(field, &phi, go_on)?;
        let texels = field.width * field.height;
        let of = |texel: usize| {
            let e: [f32; AZIMUTHS] = std::array::from_fn(|k| slopes[k * texels + texel].atan());
            Ellipse::new(&e)
        };
        Some(Self((0..texels).into_par_iter().map(of).collect()))
    }
}

//! Real orthonormal spherical harmonics: basis, transforms, rotation, windowing.
//!
//! Signs follow Kautz's course notes (2006): Y(1,−1) = 0.488603 y, Y(1,0) = 0.488603 z, Y(1,1) = 0.488603 x,
//! no Condon–Shortley phase. `order` is the highest band l; `bands = order + 1`.

mod basis;
mod dering;
mod exchange;
pub mod fft;
mod kautz;
mod points;
mod project;
mod quadric;
mod rotation;
mod synthesis;
mod transform;
mod turns;
mod wigner;
mod window;
mod zh3;
pub mod zonal;

pub use basis::{Basis, epsilon, eval, legendre};
pub use dering::Dering;
pub use kautz::{QuarterTurns, turn_symbolic};
pub(crate) use points::CubeAngles;
pub use points::PointSynthesis;
pub use project::{project, project_direct};
pub use quadric::Quadric;
pub use rotation::{Rotation, euler_zyz, z_to};
pub use synthesis::{synthesize, synthesize_direct};
pub use transform::{ColumnsRgb, Grid, Precision, Sample, ShTransform};
pub use turns::{Angle, Exchange, TURNS, TurnedBlock, Turns, turn};
pub use wigner::wigner_d;
pub use window::Window;
pub use zh3::Zh3;

use glam::DVec3;

/// Index of (l, m), −l ≤ m ≤ l: l² + l + m.
#[inline]
pub const fn index(l: usize, m: isize) -> usize {
    (l * l + l).strict_add_signed(m)
}

/// Number of coefficients up to `order`: (order + 1)².
#[inline]
pub const fn count(order: usize) -> usize {
    (order + 1) * (order + 1)
}

/// Coefficients of an RGB function up to an order.
#[derive(Debug, Clone, PartialEq)]
pub struct ShRgb {
    /// Highest band.
    pub order: usize,
    /// Red, green, blue; each `count(order)` long.
    pub c: [Vec<f64>; 3],
}

impl ShRgb {
    /// All zero.
    pub fn zero(order: usize) -> Self {
        Self { order, c: std::array::from_fn(|_| vec![0.0; count(order)]) }
    }

    /// Mean square over all rotations of a coefficient of each band, per channel: Σ_m c_lm²/(2l + 1), l = 0 …
    /// order.
    pub fn mean_squares(&self) -> [Vec<f64>; 3] {
        self.c.each_ref().map(|c| {
            let band = |l: usize| c[l * l..(l + 1) * (l + 1)].iter().map(|x| x * x).sum::<f64>();
            (0..=self.order).map(|l| band(l) / (2 * l + 1) as f64).collect()
        })
    }

    /// Multiplies band l by `k[l]` (0 beyond its end): a convolution with a zonal kernel (Funk–Hecke), where
    /// k_l = 2π ∫ K(x) P_l(x) dx.
    pub fn convolve(&mut self, k: &[f64]) {
        for c in &mut self.c {
            for l in 0..=self.order {
                let k = k.get(l).copied().unwrap_or(0.0);
                c[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|x| *x *= k);
            }
        }
    }

    /// The value at unit direction `d`.
    pub fn value(&self, d: DVec3) -> [f64; 3] {
        let mut y = vec![0.0; count(self.order)];
        eval(self.order, d, &mut y);
        std::array::from_fn(|k| self.c[k].iter().zip(&y).map(|(a, b)| a * b).sum())
    }
}

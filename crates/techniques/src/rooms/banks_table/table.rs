//! The model and its table.

use crate::shared::tables::grid::Grid;
use glam::DVec3;
use std::f64::consts::PI;

/// Eq. 33 with its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Model {
    pub n: f64,
    /// k_d of each channel.
    pub diffuse: [f64; 3],
    /// k_s of each channel.
    pub specular: [f64; 3],
}

impl Model {
    /// cos a and cosᴺ(a + b)₊ of sines and cosines.
    fn parts(&self, [sa, ca]: [f64; 2], [sb, cb]: [f64; 2]) -> [f64; 2] {
        let (c, s) = (ca * cb - sa * sb, sa * cb + ca * sb);
        // cosᴺ = (1 − sin²)^(N/2) keeps its digits near the peak.
        let power = if c <= 0.0 { 0.0 } else { (0.5 * self.n * (-(s * s).min(1.0)).ln_1p()).exp() };
        [ca, power]
    }

    /// (n·l)(k_d cos a + k_s cosᴺ(a + b)₊).
    pub fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return [0.0; 3];
        }
        let side = |w: DVec3| [w.x, w.y.hypot(w.z)];
        let [d, s] = self.parts(side(wi), side(wo));
        std::array::from_fn(|c| wi.z * (self.diffuse[c] * d + self.specular[c] * s))
    }
}

/// cos a and cosᴺ(a + b)₊ over a and b, or over their sines.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    pub model: Model,
    pub resolution: usize,
    /// Are the coordinates angles?
    pub angles: bool,
    pub grid: Grid<2>,
}

impl Table {
    pub(super) fn new(model: Model, resolution: usize, angles: bool) -> Self {
        let side = |u: f64| {
            if angles {
                let (s, c) = (PI * (u - 0.5)).sin_cos();
                [s, c]
            } else {
                let s = 2.0 * u - 1.0;
                [s, (1.0 - s * s).max(0.0).sqrt()]
            }
        };
        // On the ends c is a rounding error.
        let side = |u: f64| side(u).map(|x| if x.abs() < 1e-15 { 0.0 } else { x });
        let grid = Grid::new(resolution, resolution, |u, v| model.parts(side(u), side(v)));
        Self { model, resolution, angles, grid }
    }
}

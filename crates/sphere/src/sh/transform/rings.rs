//! Where the rows of a grid stand, and their weights.

use super::latitude;
use crate::quadrature::{clenshaw_curtis, fejer1, gauss_legendre_angles};
use std::f64::consts::PI;

/// How the rows of a lat-long grid stand in θ, and how they are weighted in an integral.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Grid {
    /// Texel centres θ = (j+½)π/height with the weights of Fejér's first rule: analysis is exact for band
    /// limit `order` if height > 2·order and width > 2·order.
    Equirectangular,
    /// Gauss–Legendre rows: exact if height > order and width > 2·order.
    GaussLegendre,
    /// Clenshaw–Curtis rows θ = jπ/(height−1), poles included: exact if height > 2·order, width > 2·order.
    ClenshawCurtis,
    /// Texels that are constant over their cells: ∫ Y over each exact cell, for any order. Analysis only.
    Cells,
}

impl Grid {
    /// Does ∫ over a texel's width replace the value at its centre?
    pub(super) fn sinc(self) -> bool {
        self == Self::Cells
    }
}

/// Rows that are transformed together, and rings whose numbers lie side by side.
pub(super) const BLOCK: usize = 16;

/// The northern rings of a grid (equator included), from the pole; the southern mirror them. Padded to whole
/// groups with rings of no weight.
pub(super) struct Rings {
    pub(super) cos: Vec<f64>,
    pub(super) sin: Vec<f64>,
    /// cos².
    pub(super) x2: Vec<f64>,
    pub(super) weight: Vec<f64>,
    count: usize,
    height: usize,
}

impl Rings {
    pub(super) fn new(grid: Grid, height: usize, order: usize) -> Self {
        let mut rings = Self { cos: vec![], sin: vec![], x2: vec![], weight: vec![], count: 0, height };
        if height == 0 {
            return rings;
        }
        let step = PI / height as f64;
        match grid {
            Grid::Equirectangular => {
                let w = fejer1(height).1;
                rings.fill(|j| ((j as f64 + 0.5) * step, w[j]));
            }
            Grid::ClenshawCurtis => {
                let w = clenshaw_curtis(height).1;
                let theta =
                    |j: usize| if height > 1 { PI * j as f64 / (height - 1) as f64 } else { 0.5 * PI };
                rings.fill(|j| (theta(j), w[j]));
            }
            Grid::GaussLegendre => {
                let (theta, w) = gauss_legendre_angles(height);
                rings.fill(|j| (theta[j], w[j]));
            }
            Grid::Cells => {
                rings.height = latitude::rings(order);
                let step = PI / rings.height as f64;
                rings.fill(|j| {
                    let theta = (j as f64 + 0.5) * step;
                    (theta, theta.sin() * step)
                });
            }
        }
        rings.count = rings.cos.len();
        while !rings.cos.len().is_multiple_of(BLOCK) {
            rings.push(0.0, 1.0, 0.0);
        }
        rings
    }

    fn push(&mut self, cos: f64, sin: f64, weight: f64) {
        self.cos.push(cos);
        self.sin.push(sin);
        self.x2.push(if sin < 0.5 { (1.0 - sin) * (1.0 + sin) } else { cos * cos });
        self.weight.push(weight);
    }

    /// Rows from (θ, weight).
    fn fill(&mut self, ring: impl Fn(usize) -> (f64, f64)) {
        for j in 0..self.height.div_ceil(2) {
            let (theta, w) = ring(j);
            let equator = 2 * j + 1 == self.height;
            self.push(if equator { 0.0 } else { theta.cos() }, theta.sin(), w);
        }
    }

    /// Is this one of the rings that only fill up a group?
    pub(super) fn is_padding(&self, ring: usize) -> bool {
        ring >= self.count
    }

    /// Half the weight of the BLOCK rings from one, and that times cos θ.
    pub(super) fn halves(&self, ring: usize) -> [[f64; BLOCK]; 2] {
        let even = |k: usize| if ring + k < self.weight.len() { 0.5 * self.weight[ring + k] } else { 0.0 };
        let even = std::array::from_fn(even);
        [even, std::array::from_fn(|k| even[k] * if even[k] == 0.0 { 0.0 } else { self.cos[ring + k] })]
    }

    /// cos θ of all rows, from the north.
    pub(super) fn rows(&self) -> Vec<f64> {
        (0..self.height)
            .map(|j| {
                let mirror = self.height - 1 - j;
                if j <= mirror { self.cos[j] } else { -self.cos[mirror] }
            })
            .collect()
    }
}

//! Where a view lies in tables by elevation and azimuth.

use super::lookups::elevation;
use super::views::Views;
use crate::shared::maths::vector::{cross, dot};
use std::f32::consts::TAU;

/// Position of a view in the tables, and its frame.
pub(super) struct Place {
    /// Place in a lobe's part of the tables, and weights of the next column and the next row.
    pub first: usize,
    part: [f32; 2],
    /// The part of wo perpendicular to n, normalised; n × that; and n.
    pub axes: [[f32; 3]; 3],
    /// Sine and cosine of θ_o.
    pub polar: [f32; 2],
}

impl Place {
    /// Coordinates and frame of the view `wo` on normal and tangent.
    #[inline(always)]
    pub(super) fn new(v: &Views, n: [f32; 3], t: [f32; 3], wo: [f32; 3]) -> Self {
        Self::at_row(v, n, t, wo, |theta, rows| theta.clamp(0.0, 1.0) * (rows - 1) as f32)
    }

    /// [`Self::new`] with the fractional row of θ_o over the last elevation, of so many rows.
    #[inline(always)]
    pub(super) fn at_row(
        v: &Views,
        n: [f32; 3],
        t: [f32; 3],
        wo: [f32; 3],
        row: impl Fn(f32, usize) -> f32,
    ) -> Self {
        let (b, cos_o) = (cross(n, t), dot(n, wo).min(1.0));
        let [sine, theta] = elevation(cos_o);
        let (x, y) = (dot(wo, t), dot(wo, b));
        let length = (x * x + y * y).sqrt();
        let [x, y] = if length > 1e-6 { [x / length, y / length] } else { [1.0, 0.0] };
        let (rows, columns) = (v.count() / v.columns, v.columns);
        let row = row(theta, rows);
        let i = (row as usize).min(rows - 2);
        let turn = y.atan2(x) / TAU;
        let column = (turn - turn.floor()) * (columns - 1) as f32;
        let j = (column as usize).min(columns - 2);
        Self {
            first: i * columns + j,
            part: [column - j as f32, row - i as f32],
            axes: [
                std::array::from_fn(|k| x * t[k] + y * b[k]),
                std::array::from_fn(|k| x * b[k] - y * t[k]),
                n,
            ],
            polar: [sine, cos_o],
        }
    }

    /// Interpolates the values of a table for a lobe.
    #[inline(always)]
    pub(super) fn at(&self, v: &Views, table: &[[f32; 4]], lobe: usize) -> [f32; 4] {
        let first = lobe * v.count() + self.first;
        let [a, b, c, d] = [0, 1, v.columns, v.columns + 1].map(|k| table[first + k]);
        let [x, y] = self.part;
        std::array::from_fn(|k| {
            let (near, far) = (a[k] + (b[k] - a[k]) * x, c[k] + (d[k] - c[k]) * x);
            near + (far - near) * y
        })
    }
}

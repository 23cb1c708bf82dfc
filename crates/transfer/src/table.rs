//! Integrals of the harmonics over the cells of the hemisphere, with and without the cosine.

use crate::grid::{LIFT, MEASURE, direction, place, start};
use steradian_parallel::prelude::*;
use steradian_sphere::sh;

/// For each cell of each level: ∫ (n·w) y_i dw for the first `bands`² harmonics about the normal, then ∫ y_i
/// dw for the first `wide`². A cell's are the sums of its children's.
pub struct Table {
    /// Level of the finest cells, of which there are 4^level.
    pub level: u32,
    /// Numbers of a cell.
    pub width: usize,
    rows: Vec<f32>,
    /// ∫ (n·w) dw and ∫ dw of each cell.
    weights: Vec<[f32; 2]>,
}

impl Table {
    /// Harmonics of `bands` with and `wide` without the cosine, cells down to 4^`level`.
    pub fn new(bands: usize, wide: usize, level: u32) -> Self {
        let (cosine, plain) = (bands * bands, wide * wide);
        let width = cosine + plain;
        let side = 1u32 << level;
        let count = 1usize << (2 * level);
        let mut fine = vec![0.0f64; count * width];
        let mut weights = vec![[0.0f64; 2]; count];
        fine.par_chunks_mut(width).zip(&mut weights).enumerate().for_each(|(i, (row, weight))| {
            let [x, y] = place(i as u32);
            let mut values = vec![0.0; cosine.max(plain)];
            // Gauss's two points an axis, of parts of the cell where it is near the horizon: weights vary
            // most there.
            let near = |k: u32| k.min(side - 1 - k) < 4;
            let parts = if near(x) || near(y) { 4 } else { 1 };
            let gauss = |k: u32, n: u32| {
                let s = if n.is_multiple_of(2) { -0.5 } else { 0.5 } / 3f64.sqrt();
                ((f64::from(k) + (f64::from(n / 2) + 0.5 + s) / f64::from(parts)) / f64::from(side)) as f32
            };
            for (i, j) in (0..2 * parts).flat_map(|j| (0..2 * parts).map(move |i| (i, j))) {
                let d = direction(gauss(x, i), gauss(y, j)).as_dvec3().normalize();
                let share = 0.25 / f64::from(parts * parts);
                let w = share * MEASURE / count as f64 / (d.z + LIFT);
                sh::eval(bands.max(wide) - 1, d, &mut values);
                row[..cosine].iter_mut().zip(&values).for_each(|(r, y)| *r += w * d.z * y);
                row[cosine..].iter_mut().zip(&values).for_each(|(r, y)| *r += w * y);
                weight[0] += w * d.z;
                weight[1] += w;
            }
        });
        let mut table = Self {
            level,
            width,
            rows: vec![0.0; start(level + 1) * width],
            weights: vec![[0.0; 2]; start(level + 1)],
        };
        for l in (0..=level).rev() {
            table.put(l, &fine, &weights);
            fine = coarser(&fine, width);
            weights = weights.chunks(4).map(|c| [0, 1].map(|k| c.iter().map(|w| w[k]).sum())).collect();
        }
        table
    }

    fn put(&mut self, level: u32, rows: &[f64], weights: &[[f64; 2]]) {
        let first = start(level);
        let to = &mut self.rows[first * self.width..][..rows.len()];
        to.iter_mut().zip(rows).for_each(|(t, r)| *t = *r as f32);
        let to = &mut self.weights[first..][..weights.len()];
        to.iter_mut().zip(weights).for_each(|(t, w)| *t = w.map(|w| w as f32));
    }

    /// Numbers of a cell.
    #[inline(always)]
    pub fn row(&self, level: u32, cell: u32) -> &[f32] {
        let at = (start(level) + cell as usize) * self.width;
        &self.rows[at..at + self.width]
    }

    /// ∫ (n·w) dw and ∫ dw of a cell of any level.
    #[inline(always)]
    pub fn weight(&self, level: u32, cell: u32) -> [f32; 2] {
        if level > self.level {
            finer_weight(level, cell)
        } else {
            self.weights[start(level) + cell as usize]
        }
    }
}

/// ∫ (n·w) dw and ∫ dw of a cell that is small: by Gauss's two points an axis near the horizon, where weights
/// vary, so that the parts of a cell make the whole; else by its centre.
#[inline(always)]
pub fn finer_weight(level: u32, cell: u32) -> [f32; 2] {
    let ([x, y], side) = (place(cell), 1u32 << level);
    let (scale, all) = (1.0 / side as f32, MEASURE as f32 / (side as f32 * side as f32));
    let at = |u: f32, v: f32| {
        let z = direction((x as f32 + u) * scale, (y as f32 + v) * scale).z;
        let w = all / (z + LIFT as f32);
        [w * z, w]
    };
    let inside = |k: u32| k.min(side - 1 - k) >= side / 16;
    if inside(x) && inside(y) {
        return at(0.5, 0.5);
    }
    let (a, b) = (0.211_324_87, 0.788_675_13);
    let four = [at(a, a), at(a, b), at(b, a), at(b, b)];
    [0, 1].map(|k| 0.25 * (four[0][k] + four[1][k] + four[2][k] + four[3][k]))
}

/// Sums of four cells each.
fn coarser(fine: &[f64], width: usize) -> Vec<f64> {
    let sums = |four: &[f64]| -> Vec<f64> {
        (0..width).map(|k| four.chunks(width).map(|row| row[k]).sum()).collect()
    };
    if fine.len() == width { Vec::new() } else { fine.par_chunks(4 * width).flat_map_iter(sums).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The whole hemisphere: Â_l y_lm(z) and the hemisphere's own coefficients.
    #[test]
    fn all_cells_together_are_the_closed_forms() {
        let t = Table::new(5, 9, 7);
        let all = t.row(0, 0);
        let norm = |l: usize| ((2 * l + 1) as f64 / (4.0 * std::f64::consts::PI)).sqrt();
        for (kernel, row, order) in
            [(sh::zonal::cosine(4), &all[..25], 4), (sh::zonal::phong(8, 0.0), &all[25..], 8)]
        {
            for l in 0..=order {
                for m in -(l as isize)..=l as isize {
                    let expected = if m == 0 { kernel[l] * norm(l) } else { 0.0 };
                    let got = f64::from(row[sh::index(l, m)]);
                    assert!((got - expected).abs() < 5e-5, "{l} {m}: {got} {expected}");
                }
            }
        }
        let w = t.weight(0, 0);
        assert!((w[0] - std::f32::consts::PI).abs() < 5e-5 && (w[1] - std::f32::consts::TAU).abs() < 5e-5);
    }
}

//! Bilinear hats on the paraboloid of outgoing directions, a basis of which four functions are non-zero at a
//! view.

use glam::DVec3;
use steradian_numerics::dense::Cholesky;
use steradian_sphere::sh;

/// Samples of a cell's edge in integrals.
const SAMPLES: usize = 12;

/// side × side hats over [−1, 1]², (s, t) = (x, y)/(1 + z).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hats {
    /// Hats along an edge.
    pub side: usize,
}

impl Hats {
    /// Number of hats.
    pub fn len(self) -> usize {
        self.side * self.side
    }

    /// The hat of least s and t of the four that act at (s, t), and the weights of the farther ones.
    #[inline(always)]
    pub fn cell(self, s: f32, t: f32) -> (usize, [f32; 2]) {
        let last = (self.side - 1) as f32;
        let at = [s, t].map(|x| (0.5 * (x + 1.0) * last).clamp(0.0, last));
        let first = at.map(|x| (x as usize).min(self.side - 2));
        (first[1] * self.side + first[0], [0, 1].map(|k| at[k] - first[k] as f32))
    }

    /// The four hats that act at a local direction above the horizon, and their values, which sum to 1.
    #[inline(always)]
    pub fn at(self, [x, y, z]: [f32; 3]) -> ([usize; 4], [f32; 4]) {
        let scale = (1.0 + z.max(0.0)).recip();
        let (first, [u, v]) = self.cell(x * scale, y * scale);
        let places = [first, first + 1, first + self.side, first + self.side + 1];
        (places, [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v])
    }

    /// The change of basis from harmonics: a row for each hat, with the factors of a function's coefficients
    /// that give the sum over hats nearest to it over the hemisphere (least squares, the dual basis). Rows of
    /// hats outside the hemisphere are 0.
    pub fn change_of_basis(self, bands: usize) -> Vec<f64> {
        let (m, n) = (self.len(), bands * bands);
        let (mut own, mut mixed) = (vec![vec![0.0; m]; m], vec![vec![0.0; m]; n]);
        let steps = (self.side - 1) * SAMPLES;
        let mut y = vec![0.0; n];
        for k in 0..steps * steps {
            let [s, t] = [k % steps, k / steps].map(|k| 2.0 * (k as f64 + 0.5) / steps as f64 - 1.0);
            let r2 = s * s + t * t;
            if r2 > 1.0 {
                continue;
            }
            let d = DVec3::new(2.0 * s, 2.0 * t, 1.0 - r2) / (1.0 + r2);
            let omega = (1.0 + r2).powi(-2);
            sh::eval(bands - 1, d, &mut y);
            let (places, values) = self.at(d.as_vec3().to_array());
            for (j, g) in places.iter().zip(values) {
                let g = f64::from(g) * omega;
                places.iter().zip(values).for_each(|(k, h)| own[*j][*k] += g * f64::from(h));
                mixed.iter_mut().zip(&y).for_each(|(row, y)| row[*j] += g * y);
            }
        }
        let mean = (0..m).map(|j| own[j][j]).sum::<f64>() / m as f64;
        for (j, row) in own.iter_mut().enumerate() {
            row[j] = if row[j] > 0.0 { row[j] + 1e-9 * mean } else { mean };
        }
        let mut out = vec![0.0; m * n];
        if let Some(own) = Cholesky::new(&own) {
            for (i, row) in mixed.into_iter().enumerate() {
                own.solve(row).into_iter().enumerate().for_each(|(j, x)| out[j * n + i] = x);
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sphere::quadrature::product_hemisphere;

    /// Hats sum to 1 everywhere, a constant is reproduced, and harmonics up to the hats' resolution.
    #[test]
    fn hats_are_a_partition_of_unity() {
        let rule = product_hemisphere(40);
        let mut last = f64::INFINITY;
        for side in [6, 8, 16] {
            let hats = Hats { side };
            let rows = hats.change_of_basis(3);
            let (mut off, mut all) = (0.0, 0.0);
            for (d, w) in rule.directions.iter().zip(&rule.weights) {
                let (places, values) = hats.at(d.as_vec3().to_array());
                assert!((values.iter().sum::<f32>() - 1.0).abs() < 1e-6);
                let mut y = [0.0; 9];
                sh::eval(2, *d, &mut y);
                for (i, y) in y.iter().enumerate() {
                    let got: f64 =
                        places.iter().zip(values).map(|(j, g)| f64::from(g) * rows[j * 9 + i]).sum();
                    assert!(i > 0 || (got - y).abs() < 1e-5, "{side}: {d}: {got} {y}");
                    off += w * (got - y).powi(2);
                    all += w * y * y;
                }
            }
            let error = (off / all).sqrt();
            assert!(error < 0.65 * last, "{side}: {error}");
            last = error;
        }
        assert!(last < 0.02, "{last}");
    }
}

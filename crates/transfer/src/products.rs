//! Products of harmonics: matrices of glossy transfer from visibility.

use steradian_parallel::prelude::*;
use steradian_sphere::quadrature::product_sphere;
use steradian_sphere::sh;

/// The integrals Γ_ijk = ∫ y_i y_j y_k dw of three harmonics, those that are not zero: i, j in `bands` bands
/// and k in 2·bands − 1, which is all that a product of two can hold.
///
/// With them the matrix M_ij = ∫ V y_i y_j dw of a visibility V is Σ_k Γ_ijk V_k, exactly, of the 2·bands − 1
/// bands of V alone.
pub struct Products {
    bands: usize,
    /// j, k, Γ of each i, for j ≤ i.
    rows: Vec<Vec<(u32, u32, f64)>>,
    /// Coefficients of the hemisphere about +z by band.
    hemisphere: Vec<f64>,
}

impl Products {
    /// The products of `bands` bands.
    pub fn new(bands: usize) -> Self {
        let order = bands - 1;
        let (n, wide) = (sh::count(order), sh::count(2 * order));
        let rule = product_sphere(4 * order);
        let values: Vec<Vec<f64>> = rule
            .directions
            .iter()
            .map(|d| {
                let mut y = vec![0.0; wide];
                sh::eval(2 * order, *d, &mut y);
                y
            })
            .collect();
        let lm = |i: usize| {
            let l = i.isqrt();
            (l, (i as isize - (l * l + l) as isize).unsigned_abs())
        };
        let row = |i: usize| {
            let mut out = Vec::new();
            let (li, mi) = lm(i);
            for j in 0..=i {
                let (lj, mj) = lm(j);
                for k in (li - lj).pow(2)..sh::count(li + lj) {
                    let (lk, mk) = lm(k);
                    // Parity, and the products of cosines and sines of mφ.
                    if (li + lj + lk) % 2 == 1 || (mk != mi + mj && mk != mi.abs_diff(mj)) {
                        continue;
                    }
                    let g: f64 = values.iter().zip(&rule.weights).map(|(y, w)| w * y[i] * y[j] * y[k]).sum();
                    if g.abs() > 1e-12 {
                        out.push((j as u32, k as u32, g));
                    }
                }
            }
            out
        };
        Self {
            bands,
            rows: (0..n).into_par_iter().map(row).collect(),
            hemisphere: sh::zonal::phong(2 * order, 0.0),
        }
    }

    /// Bands of the matrices.
    pub fn bands(&self) -> usize {
        self.bands
    }

    /// ∫ f y_i y_j dw of a function with these (2·bands − 1)² coefficients, row by row.
    pub fn matrix(&self, f: &[f64]) -> Vec<f64> {
        let n = self.bands * self.bands;
        let mut out = vec![0.0; n * n];
        for (i, row) in self.rows.iter().enumerate() {
            for &(j, k, g) in row {
                out[i * n + j as usize] += g * f[k as usize];
            }
            for j in 0..i {
                out[j * n + i] = out[i * n + j];
            }
        }
        out
    }

    /// The transfer matrix of a site: the identity minus the part that its visibility v (of n·w > 0) blocks.
    /// Directions below the horizon count as open: reflectance is zero there.
    pub fn transfer(&self, n: glam::DVec3, v: &[f32]) -> Vec<f64> {
        let order = 2 * (self.bands - 1);
        let mut y = vec![0.0; sh::count(order)];
        sh::eval(order, n, &mut y);
        let blocked: Vec<f64> = y
            .iter()
            .zip(v)
            .enumerate()
            .map(|(i, (y, v))| self.hemisphere[i.isqrt()] * y - f64::from(*v))
            .collect();
        let mut m = self.matrix(&blocked);
        let count = self.bands * self.bands;
        for (k, x) in m.iter_mut().enumerate() {
            *x = if k % (count + 1) == 0 { 1.0 - *x } else { -*x };
        }
        m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// V ≡ 1 gives the identity; a half space gives ½δ_ij where l_i + l_j is even (parity).
    #[test]
    fn open_spheres_and_half_spaces_are_closed_forms() {
        let p = Products::new(4);
        let mut one = vec![0.0; 49];
        one[0] = (4.0 * std::f64::consts::PI).sqrt();
        let delta = |i: usize, j: usize| if i == j { 1.0 } else { 0.0 };
        for (k, x) in p.matrix(&one).iter().enumerate() {
            assert!((x - delta(k / 16, k % 16)).abs() < 1e-12);
        }
        let n = DVec3::new(0.3, -0.8, 0.4).normalize();
        let mut y = vec![0.0; 49];
        sh::eval(6, n, &mut y);
        let half: Vec<f64> = y.iter().enumerate().map(|(i, y)| p.hemisphere[i.isqrt()] * y).collect();
        let m = p.matrix(&half);
        for i in 0..16usize {
            for j in 0..16usize {
                if (i.isqrt() + j.isqrt()) % 2 == 0 {
                    assert!((m[16 * i + j] - 0.5 * delta(i, j)).abs() < 1e-12, "{i} {j}");
                }
            }
        }
        // The hemisphere is unoccluded, so nothing is subtracted.
        let v: Vec<f32> = half.iter().map(|x| *x as f32).collect();
        for (k, x) in p.transfer(n, &v).iter().enumerate() {
            assert!((x - delta(k / 16, k % 16)).abs() < 1e-6);
        }
    }

    /// Against ∫ V y_i y_j of a band-limited V summed directly.
    #[test]
    fn coupled_coefficients_are_the_integral() {
        let p = Products::new(3);
        let v: Vec<f64> = (0..25).map(|k| (k as f64 * 1.7).sin()).collect();
        let m = p.matrix(&v);
        let rule = product_sphere(12);
        for (i, j) in [(0, 0), (1, 5), (8, 3), (7, 7)] {
            let direct: f64 = rule
                .directions
                .iter()
                .zip(&rule.weights)
                .map(|(d, w)| {
                    let mut y = [0.0; 25];
                    sh::eval(4, *d, &mut y);
                    w * y[i] * y[j] * y.iter().zip(&v).map(|(a, b)| a * b).sum::<f64>()
                })
                .sum();
            assert!((m[9 * i + j] - direct).abs() < 1e-12);
        }
    }
}

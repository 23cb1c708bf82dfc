//! Visibility from diffuse transfer.
//!
//! Green, Kautz & Durand 2007, *Efficient Reflectance and Visibility Approximations for Environment Map
//! Rendering*, 3.3.1: where a site has its diffuse transfer vector, t_i = ∫ V (n·w)₊ y_i dw, "the same data
//! can be reused for the visibility of the glossy component", by dividing the cosine out. Three ways to do
//! so, for a direction w above the horizon:
//!
//! - [`divided`]: V(w) = Σ t_i y_i(w)/(n·w), the paper's words. The series does not vanish at the horizon as
//!   the cosine does, and the quotient has no bound there;
//! - [`share`]: V(w) = Σ t_i y_i(w)/Σ o_i y_i(w), o the transfer vector of an open site: exactly 1 where
//!   nothing is blocked;
//! - [`Recovery`]: the coefficients c of the visibility that is nearest to V where the cosine counts, min ∫
//!   (n·w)₊ (V − Σ c_i y_i)² dw, whose normal equations need t alone: **M c = t, M_ij = ∫ (n·w)₊ y_i y_j
//!   dw**. What light blocks is solved for, 1 − V, so that an open site is exactly open, and ε is added to
//!   the diagonal: eigenvalues of M fall to 3e-5 at four bands, and an error of t would be multiplied by
//!   their inverses.
//!
//! Where v_i = ∫ V y_i dw is available, the same fit is done with the weight 1 in place of the cosine
//! ([`Recovery::over_hemisphere`]): the series of v itself is that of a function that ends at the horizon,
//! which a few bands cannot represent.

use crate::Products;
use glam::DVec3;
use steradian_numerics::dense::Cholesky;
use steradian_sphere::sh;

/// Harmonics of as many bands as `t` has, at `w`.
fn harmonics(t: &[f32], w: DVec3) -> Vec<f64> {
    let mut y = vec![0.0; t.len()];
    sh::eval(t.len().isqrt().max(1) - 1, w, &mut y);
    y
}

fn series(t: &[f32], w: DVec3) -> f64 {
    harmonics(t, w).iter().zip(t).map(|(y, t)| y * f64::from(*t)).sum()
}

/// Visibility of unit `w` from the transfer vector `t` (bands² numbers) of a site of unit normal `n`: its
/// series over the cosine. 0 below the horizon; not clamped to 0 … 1.
pub fn divided(n: DVec3, t: &[f32], w: DVec3) -> f64 {
    let cosine = n.dot(w);
    if cosine > 0.0 { series(t, w) / cosine } else { 0.0 }
}

/// Visibility as the series over that of an open site.
pub fn share(n: DVec3, t: &[f32], w: DVec3) -> f64 {
    if n.dot(w) <= 0.0 {
        return 0.0;
    }
    let cosine = sh::zonal::cosine(t.len().isqrt().max(1) - 1);
    series(t, w) / sh::zonal::value(&cosine, n.dot(w))
}

/// Coefficients of visibility from those of diffuse transfer.
pub struct Recovery {
    products: Products,
    /// Coefficients of the weight by band, to 2·bands − 1 bands: of the cosine, or of the hemisphere.
    weight: Vec<f64>,
    ridge: f64,
}

impl Recovery {
    /// A solver for vectors of `bands` bands. `ridge` is ε, 1e-6 to 1: a value near the error of t damps the
    /// amplification of that error.
    pub fn new(bands: usize, ridge: f64) -> Self {
        Self::weighed(bands, sh::zonal::cosine(2 * (bands.max(1) - 1)), ridge)
    }

    /// For v = ∫ V y dw over n·w > 0 in place of t: min ∫ (V − Σ c_i y_i)² dw over the hemisphere, **G c = v,
    /// G_ij = ∫ y_i y_j dw** over n·w > 0 (least-squares projection on the hemisphere).
    pub fn over_hemisphere(bands: usize, ridge: f64) -> Self {
        Self::weighed(bands, sh::zonal::phong(2 * (bands.max(1) - 1), 0.0), ridge)
    }

    fn weighed(bands: usize, weight: Vec<f64>, ridge: f64) -> Self {
        Self { products: Products::new(bands.max(1)), weight, ridge: ridge.clamp(1e-6, 1.0) }
    }

    /// c of a site of unit normal `n` and transfer vector `t` (bands² numbers; v for
    /// [`Recovery::over_hemisphere`]): V(w) ≈ Σ c_i y_i(w) for n·w > 0. It means nothing below the horizon.
    ///
    /// # Panics
    /// If `t` is of another length.
    pub fn visibility(&self, n: DVec3, t: &[f32]) -> Vec<f64> {
        let count = self.products.bands().pow(2);
        assert_eq!(t.len(), count, "a transfer vector has bands² numbers");
        let open = sh::zonal::lobe(&self.weight, n);
        let matrix = self.products.matrix(&open);
        let mut rows: Vec<Vec<f64>> = matrix.chunks_exact(count).map(<[f64]>::to_vec).collect();
        rows.iter_mut().enumerate().for_each(|(i, row)| row[i] += self.ridge);
        let blocked: Vec<f64> = open.iter().zip(t).map(|(o, t)| o - f64::from(*t)).collect();
        // With ε on its diagonal a matrix of non-negative eigenvalues is positive definite.
        let blocked = Cholesky::new(&rows).map_or_else(|| vec![0.0; count], |c| c.solve(blocked));
        let mut out: Vec<f64> = blocked.iter().map(|b| -b).collect();
        out[0] += (4.0 * std::f64::consts::PI).sqrt();
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_sphere::quadrature::product_sphere;

    /// t of a visibility, by quadrature.
    fn transfer(bands: usize, n: DVec3, v: impl Fn(DVec3) -> f64) -> Vec<f32> {
        let rule = product_sphere(120);
        let mut t = vec![0.0; bands * bands];
        let mut y = t.clone();
        for (d, w) in rule.directions.iter().zip(&rule.weights).filter(|(d, _)| d.dot(n) > 0.0) {
            sh::eval(bands - 1, *d, &mut y);
            t.iter_mut().zip(&y).for_each(|(t, y)| *t += w * d.dot(n) * v(*d) * y);
        }
        t.into_iter().map(|t| t as f32).collect()
    }

    fn above(n: DVec3) -> impl Iterator<Item = DVec3> {
        product_sphere(12).directions.into_iter().filter(move |d| d.dot(n) > 0.05)
    }

    fn value(c: &[f64], d: DVec3) -> f64 {
        let mut y = vec![0.0; c.len()];
        sh::eval(c.len().isqrt() - 1, d, &mut y);
        y.iter().zip(c).map(|(y, c)| y * c).sum()
    }

    #[test]
    fn open_sites_are_open() {
        let n = DVec3::new(0.3, -0.8, 0.5).normalize();
        for bands in [2, 3, 4, 5] {
            let t: Vec<f32> =
                sh::zonal::lobe(&sh::zonal::cosine(bands - 1), n).iter().map(|t| *t as f32).collect();
            let c = Recovery::new(bands, 0.02).visibility(n, &t);
            for d in above(n) {
                assert!((share(n, &t, d) - 1.0).abs() < 1e-5, "{bands}");
                assert!((value(&c, d) - 1.0).abs() < 1e-5, "{bands}");
            }
            // The series of a few bands is not the cosine: at the horizon the quotient runs away.
            let low = (n.any_orthonormal_vector() + 0.05 * n).normalize();
            assert!((divided(n, &t, low) - 1.0).abs() > 0.3, "{bands}: {}", divided(n, &t, low));
        }
    }

    /// Visibility that the bands hold comes back; that of half a hemisphere is nearer by least squares than
    /// by division.
    #[test]
    fn visibility_comes_back() {
        let n = DVec3::new(0.5, 0.6, -0.4).normalize();
        let side = n.any_orthonormal_vector();
        let recovery = Recovery::new(4, 1e-6);
        let smooth = |d: DVec3| 0.5 + 0.3 * d.dot(side) - 0.15 * d.x * d.y;
        let c = recovery.visibility(n, &transfer(4, n, smooth));
        let worst = above(n).map(|d| (value(&c, d) - smooth(d)).abs()).fold(0.0, f64::max);
        assert!(worst < 0.02, "{worst}");
        let half = |d: DVec3| f64::from(u8::from(d.dot(side) > 0.0));
        let t = transfer(4, n, half);
        let c = Recovery::new(4, 0.01).visibility(n, &t);
        let rms = |v: &dyn Fn(DVec3) -> f64| {
            let (sum, all) = above(n).fold((0.0, 0.0), |(sum, all), d| {
                let off = v(d).clamp(0.0, 1.0) - half(d);
                (sum + off * off, all + 1.0)
            });
            (sum / all).sqrt()
        };
        let [a, b, e] = [rms(&|d| divided(n, &t, d)), rms(&|d| share(n, &t, d)), rms(&|d| value(&c, d))];
        assert!(e < b && b < a && e < 0.3, "{a} {b} {e}");
    }
}

//! ρ̂_lpq and quantities that follow from it: energies, orders, rows.

use super::geometry::{Argument, Centre};
use super::theta::Polar;
use super::{CentralError, Scale};

/// Spherical harmonic coefficients of an isotropic reflectance about a centre: f_cos = Σ ρ̂_lp|q| y_lq(wi)
/// y_pq(wo), l ≤ F, p ≤ P, |q| ≤ min(l, p) (times the [`Scale`], where there is one), or y_pq of the normal
/// ([`Argument`]).
#[derive(Debug, Clone)]
pub struct Lpq {
    /// The central direction, from which polar angles are measured.
    pub centre: Centre,
    /// The argument of y_pq.
    pub of: Argument,
    /// F: the highest l.
    pub f: usize,
    /// P: the highest p.
    pub p: usize,
    /// `[p][q ≤ p][channel][l]`; see [`Lpq::row`].
    pub(super) rho: Vec<f64>,
    /// Total energy, of which infinitely many coefficients would hold all: the right side of 5.18 (with the
    /// fit's weight, where it is a fit).
    pub energy: [f64; 3],
    /// Factor of the series, by elevation.
    pub scale: Option<Scale>,
    /// The inner products of f_pq under the fit's weight, `[q][p − q][p' − q]`; `None` for the plain
    /// projection, under which f_pq are orthonormal.
    pub(super) gram: Option<Vec<Vec<Vec<f64>>>>,
    /// Estimated RMS error of the coefficients' quadrature, relative to f_cos.
    pub accuracy: f64,
}

/// Rows (p, q) before row (p, 0).
fn before(p: usize) -> usize {
    p * (p + 1) / 2
}

impl Lpq {
    /// Rows of all (p, q), 0 ≤ q ≤ p ≤ `p`.
    pub(super) fn rows(p: usize) -> usize {
        before(p + 1)
    }

    /// ρ̂_lpq over l = 0 … F, per channel; the row of q also serves −q. Zero below l = q, and all zero for
    /// q > p.
    pub fn row(&self, p: usize, q: usize) -> [&[f64]; 3] {
        let bands = self.f + 1;
        let at = (before(p) + q) * 3 * bands;
        std::array::from_fn(|c| &self.rho[at + c * bands..at + (c + 1) * bands])
    }

    /// The highest q with anything in it: P, or 0 about the tangent.
    pub fn azimuth(&self) -> usize {
        if self.centre == Centre::Tangent { 0 } else { self.p.min(self.f) }
    }

    /// The energy that l ≤ `f`, p ≤ `p` hold, q and −q both counted: the left side of 5.18. For a fit, the
    /// energy of f_cos less that of the truncated series' error, both under the fit's weight.
    pub fn captured(&self, f: usize, p: usize) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let p = p.min(self.p);
        for q in 0..=p.min(self.azimuth()) {
            let both = if q == 0 { 1.0 } else { 2.0 };
            for (a, pa) in (q..=self.p).zip(0..) {
                for (b, pb) in (q..=p).zip(0..) {
                    // |f|² − |f − f~|² = 2⟨f, f~⟩ − |f~|², and ⟨f, f_pq⟩ = Σ_p' G ρ̂ by the normal equations.
                    let product = match &self.gram {
                        None if a != b => continue,
                        None => 1.0,
                        Some(gram) => gram[q][pa][pb],
                    };
                    let factor = both * product * if a <= p { 1.0 } else { 2.0 };
                    let (x, y) = (self.row(a, q), self.row(b, q));
                    for c in 0..3 {
                        sum[c] += factor * dot(x[c], y[c], f.min(self.f) + 1);
                    }
                }
            }
        }
        sum
    }

    /// The captured share of the energy of all channels together; 1 where there is no energy.
    pub fn share(&self, f: usize, p: usize) -> f64 {
        let total: f64 = self.energy.iter().sum();
        if total > 0.0 { self.captured(f, p).iter().sum::<f64>() / total } else { 1.0 }
    }

    /// The smallest orders (F, P) that miss at most the share `epsilon` of the energy (5.18; ε is a squared
    /// relative error), P first, then F (section 5.6.2); `None` if these coefficients do not reach that far.
    pub fn orders(&self, epsilon: f64) -> Option<(usize, usize)> {
        let enough = 1.0 - epsilon;
        let p = (0..=self.p).find(|&p| self.share(self.f, p) >= enough)?;
        (0..=self.f).find(|&f| self.share(f, p) >= enough).map(|f| (f, p))
    }

    /// The coefficients up to lower orders. (A fit is only truncated; fitting again gives a better one at the
    /// lower P.)
    pub fn truncated(&self, f: usize, p: usize) -> Self {
        let (f, p) = (f.min(self.f), p.min(self.p));
        let mut rho = Vec::with_capacity(Self::rows(p) * 3 * (f + 1));
        for (p, q) in (0..=p).flat_map(|p| (0..=p).map(move |q| (p, q))) {
            self.row(p, q).iter().for_each(|row| rho.extend_from_slice(&row[..=f]));
        }
        let cut = |g: &Vec<Vec<Vec<f64>>>| {
            let block = |(q, g): (usize, &Vec<Vec<f64>>)| {
                let n = p + 1 - q;
                g[..n].iter().map(|row| row[..n].to_vec()).collect()
            };
            g.iter().take(p + 1).enumerate().map(block).collect()
        };
        Self { f, p, rho, gram: self.gram.as_ref().map(cut), scale: self.scale.clone(), ..*self }
    }

    /// k_lq at elevation `theta_o` by the series (times the scale), `[q][channel][l]`, q up to
    /// [`Lpq::azimuth`]; [`super::Slices`] has the exact values.
    pub fn slice(&self, theta_o: f64) -> Vec<[Vec<f64>; 3]> {
        let polar = Polar::new(self.p, self.azimuth()).rows(self.centre.slice(theta_o).polar(self.of));
        let scale = self.scale.as_ref().map_or([1.0; 3], |s| s.value(theta_o));
        let one = |(q, f): (usize, &Vec<f64>)| {
            let mut k: [Vec<f64>; 3] = std::array::from_fn(|_| vec![0.0; self.f + 1]);
            for p in q..=self.p {
                for (c, row) in self.row(p, q).iter().enumerate() {
                    k[c].iter_mut().zip(*row).for_each(|(k, r)| *k += scale[c] * f[p] * r);
                }
            }
            k
        };
        polar.iter().enumerate().map(one).collect()
    }
}

fn dot(a: &[f64], b: &[f64], n: usize) -> f64 {
    a[..n].iter().zip(&b[..n]).map(|(a, b)| a * b).sum()
}

/// Refuses orders whose slices do not exist.
pub(super) fn check_orders(f: usize, p: usize) -> Result<(), CentralError> {
    let order = f.max(p);
    if order > super::MAX_ORDER { Err(CentralError::Order { order }) } else { Ok(()) }
}

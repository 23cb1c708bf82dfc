//! Errors that need no image: means over orientations from the spectra of light and kernel.
//!
//! Let the kernel about C at an elevation θ_o be Σ_lq κ_l|q| y_lq(wi') a_q(φ_o), so that B = Σ_lq κ_l|q|
//! L'_lq(C) a_q(φ_o). Matrix elements of rotations are orthogonal, ∫ D^l_mq D̄^l'_m'q dC = 4π/(2l+1) δ_ll'
//! δ_mm', and a_q² has mean 1, so over all central directions C and azimuths φ_o
//!
//! ```text
//! ⟨B²⟩ = Σ_l E_l/(2l+1) Σ_q κ_l|q|²,   E_l = Σ_m L_lm²,   q from −l to l
//! ```
//!
//! exactly, with no cross terms between bands: the *difference* of two kernels gives the mean square error of
//! one for the other, computed before any map is.

use super::Term;

/// κ of one elevation and one q, by l from 0, red, green, blue.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Azimuthal order.
    pub q: usize,
    /// κ_lq.
    pub k: [Vec<f64>; 3],
}

impl Row {
    /// This kernel row as a term of a plan.
    pub fn term(&self) -> Term<'_> {
        Term { q: self.q, k: self.k.each_ref().map(Vec::as_slice) }
    }
}

/// ⟨B²⟩ of each channel for the kernel of one elevation, from E_l ([`ColumnsRgb::band_energies`]). Terms of
/// the same q add up.
///
/// [`ColumnsRgb::band_energies`]: steradian_sphere::sh::ColumnsRgb::band_energies
pub fn mean_square(bands: &[[f64; 3]], terms: &[Term<'_>]) -> [f64; 3] {
    weighed(terms, &[], |l, c| bands.get(l).map_or(0.0, |e| e[c] / (2 * l + 1) as f64))
}

/// ⟨(B − B~)²⟩ of each channel, where a kernel is replaced by another at the same elevation.
pub fn mean_square_error(bands: &[[f64; 3]], exact: &[Term<'_>], approximate: &[Term<'_>]) -> [f64; 3] {
    weighed(exact, approximate, |l, c| bands.get(l).map_or(0.0, |e| e[c] / (2 * l + 1) as f64))
}

/// Σ_l weight(l) Σ_q (Σ of `plus` − Σ of `minus`)².
fn weighed(plus: &[Term<'_>], minus: &[Term<'_>], weight: impl Fn(usize, usize) -> f64) -> [f64; 3] {
    let mut qs: Vec<usize> = plus.iter().chain(minus).map(|t| t.q).collect();
    qs.sort_unstable();
    qs.dedup();
    std::array::from_fn(|c| {
        let of = |terms: &[Term<'_>], q: usize, l: usize| -> f64 {
            terms.iter().filter(|t| t.q == q).map(|t| t.k[c].get(l).copied().unwrap_or(0.0)).sum()
        };
        let last = plus.iter().chain(minus).map(|t| t.k[c].len()).max().unwrap_or(0);
        qs.iter()
            .map(|&q| {
                let signs = if q == 0 { 1.0 } else { 2.0 };
                let square = |l: usize| (of(plus, q, l) - of(minus, q, l)).powi(2);
                signs * (q..last).map(|l| weight(l, c) * square(l)).sum::<f64>()
            })
            .sum()
    })
}

/// Λ_l² = 4π/(2l+1).
fn lambda_square(l: usize) -> f64 {
    4.0 * std::f64::consts::PI / (2 * l + 1) as f64
}

/// Energies by band of a light, one channel or their sum, and its total, ∫ L².
#[derive(Debug, Clone, PartialEq)]
pub struct LightSpectrum {
    /// E_l.
    pub bands: Vec<f64>,
    /// ∫ L² (5.15); the excess over the bands' sum lies above them.
    pub total: f64,
}

impl LightSpectrum {
    /// The part of the energy above band `f`: ε_L of (5.16).
    pub fn epsilon(&self, f: usize) -> f64 {
        let captured: f64 = self.bands.iter().take(f + 1).sum();
        if self.total > 0.0 { (1.0 - captured / self.total).max(0.0) } else { 0.0 }
    }

    /// F_L, the least order with ε_L ≤ `epsilon` (5.16); `None` where no listed band reaches it.
    pub fn order(&self, epsilon: f64) -> Option<usize> {
        (0..self.bands.len()).find(|f| self.epsilon(*f) <= epsilon)
    }
}

/// Energies of a kernel by l and p, Σ_q ρ̂_lpq² with both signs of q, and their total.
#[derive(Debug, Clone, PartialEq)]
pub struct KernelSpectrum {
    /// Energies by l, then p.
    pub bands: Vec<Vec<f64>>,
    /// 2π ∫∫∫ f_cos² sin θ_i sin θ_o (5.18); of a radially symmetric kernel ∫ f_cos² dwi (5.17).
    pub total: f64,
    /// Has the kernel nothing above the p that are listed? True of radially symmetric ones.
    pub complete_in_p: bool,
}

impl KernelSpectrum {
    /// The spectrum of a radially symmetric kernel: ρ̂_l² by l.
    pub fn radial(squares: &[f64], total: f64) -> Self {
        Self { bands: squares.iter().map(|x| vec![*x]).collect(), total, complete_in_p: true }
    }

    fn sum(&self, f: usize, p: usize) -> f64 {
        self.bands.iter().take(f.saturating_add(1)).flat_map(|b| b.iter().take(p.saturating_add(1))).sum()
    }

    /// The part of the energy beyond orders (f, p): ε_ρ of (5.18).
    pub fn epsilon(&self, f: usize, p: usize) -> f64 {
        if self.total > 0.0 { (1.0 - self.sum(f, p) / self.total).max(0.0) } else { 0.0 }
    }
}

/// Σ |B_lmpq|² up to orders (f, p): Σ_l Λ_l² E_l Σ_pq ρ̂² (5.7).
pub fn reflected(light: &LightSpectrum, kernel: &KernelSpectrum, f: usize, p: usize) -> f64 {
    let of = |(l, (e, b)): (usize, (&f64, &Vec<f64>))| {
        lambda_square(l) * e * b.iter().take(p.saturating_add(1)).sum::<f64>()
    };
    light.bands.iter().zip(&kernel.bands).enumerate().take(f + 1).map(of).sum()
}

/// Ramamoorthi & Hanrahan's estimate of the error's energy: the lesser of light's and kernel's (5.5.1).
pub fn lesser(light: &LightSpectrum, kernel: &KernelSpectrum, f: usize, p: usize) -> f64 {
    light.epsilon(f).min(kernel.epsilon(f, p))
}

/// ε_B of (5.19) as printed, B_res = Λ_{F+1} (ε_L L_tot)(ε_ρ ρ_tot).
///
/// This is not a bound: a product of amplitudes Λ L ρ̂ has energies with Λ², which is larger while 4π > 2F +
/// 3, and the energy beyond P is not considered.
pub fn printed_bound(light: &LightSpectrum, kernel: &KernelSpectrum, f: usize, p: usize) -> f64 {
    let residual = lambda_square(f + 1).sqrt()
        * (light.epsilon(f) * light.total)
        * (kernel.epsilon(f, p) * kernel.total);
    share(residual, reflected(light, kernel, f, p))
}

/// (5.19) corrected: an upper bound of the part of ⟨∫ B² dwo'⟩, the mean over all central directions, that
/// orders (f, p) leave out.
///
/// > B_res = Λ²_{F+1} (ε_L L_tot) Σ_{l>F} ρ̂² + Σ_{l≤F} Λ_l² E_l Σ_{p>P} ρ̂² + unknown · max(Λ_l² E_l)
///
/// Above F a sum of products is at most the product of the sums, and Λ_l ≤ Λ_{F+1}. The energy that P leaves
/// out below F is a sum of listed values. The kernel's energy that is listed under no (l, p) could belong to
/// any of them, so that it is multiplied by the largest factor. Since x/(c + x) grows with x, the stated
/// accuracy 1 − ε is never above the true one. The bound holds for the mean over directions: a single image
/// may be worse.
pub fn bound(light: &LightSpectrum, kernel: &KernelSpectrum, f: usize, p: usize) -> f64 {
    // Orders beyond the listed ones leave out no more than the listed ones do.
    let f = f.min(light.bands.len().min(kernel.bands.len()).saturating_sub(1));
    let above_light = lambda_square(f + 1) * light.epsilon(f) * light.total;
    let above: f64 = kernel.bands.iter().skip(f + 1).flatten().sum();
    let unknown = (kernel.total - kernel.sum(usize::MAX, usize::MAX)).max(0.0);
    let below = reflected(light, kernel, f, usize::MAX) - reflected(light, kernel, f, p);
    let weights = light.bands.iter().enumerate().map(|(l, e)| lambda_square(l) * e);
    let elsewhere = if kernel.complete_in_p { 0.0 } else { weights.fold(0.0, f64::max) };
    let residual = above_light * above + below.max(0.0) + unknown * above_light.max(elsewhere);
    share(residual, reflected(light, kernel, f, p))
}

fn share(residual: f64, captured: f64) -> f64 {
    if residual > 0.0 { residual / (captured + residual) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{kernel, noise};
    use super::super::{Grid, Plan, azimuth};
    use super::*;
    use steradian_base::Task;
    use steradian_sphere::sh::{self, ColumnsRgb};

    /// ⟨B²⟩ against the mean over all directions and azimuths of the maps themselves.
    #[test]
    fn the_mean_over_orientations_is_the_maps_mean() {
        let order = 8;
        let light = ColumnsRgb::from_world(&noise(order));
        let rows: Vec<Row> = (0..4).map(|q| Row { q, k: kernel(order, q) }).collect();
        let terms: Vec<Term<'_>> = rows.iter().map(Row::term).collect();
        let grid = Grid::new(2 * order + 1, 2 * order + 4);
        let maps = Plan::new(order, 3, grid).maps(&light, &terms, &Task::quiet()).expect("nobody cancels");
        let (_, weights) = steradian_sphere::quadrature::clenshaw_curtis(grid.rows());
        let azimuths = 9;
        let expected = mean_square(&light.band_energies(), &terms);
        for c in 0..3 {
            let mut mean = 0.0;
            for (i, w) in weights.iter().enumerate() {
                for j in 0..grid.columns() {
                    for k in 0..azimuths {
                        let phi = 2.0 * std::f64::consts::PI * f64::from(k) / f64::from(azimuths);
                        let b: f64 = maps
                            .keys
                            .iter()
                            .zip(&maps.planes)
                            .map(|(key, p)| azimuth(key.q, phi) * f64::from(p[c][i * grid.columns() + j]))
                            .sum();
                        mean += 0.5 * w * b * b / (grid.columns() as f64 * f64::from(azimuths));
                    }
                }
            }
            assert!((mean / expected[c] - 1.0).abs() < 1e-6, "{mean} {}", expected[c]);
        }
        let error = mean_square_error(&light.band_energies(), &terms, &terms[..2]);
        let rest = mean_square(&light.band_energies(), &terms[2..]);
        assert!((0..3).all(|c| (error[c] / rest[c] - 1.0).abs() < 1e-12));
    }

    /// Truncated kernels of rough and smooth spectra: the repaired bound is above the true error at every
    /// order, and the printed one is not.
    #[test]
    fn the_repaired_bound_is_a_bound() {
        let order = 40;
        let mut below = 0;
        for (slope, p_slope) in [(0.3, 0.5), (1.0, 0.2), (2.5, 1.0), (4.0, 3.0)] {
            let e = |l: usize| (1.0 + l as f64).powf(-slope);
            let light_bands: Vec<f64> = (0..=order).map(e).collect();
            let light = LightSpectrum { total: light_bands.iter().sum(), bands: light_bands };
            let bands: Vec<Vec<f64>> = (0..=order)
                .map(|l| (0..=8).map(|p| (-0.02 * (l * l) as f64 - p_slope * p as f64).exp()).collect())
                .collect();
            let kernel = KernelSpectrum { total: bands.iter().flatten().sum(), bands, complete_in_p: false };
            let all = reflected(&light, &kernel, order, 8);
            for f in 0..order {
                for p in 0..=8 {
                    let truth = 1.0 - reflected(&light, &kernel, f, p) / all;
                    assert!(bound(&light, &kernel, f, p) >= truth - 1e-12, "{slope} {f} {p}");
                    below += usize::from(printed_bound(&light, &kernel, f, p) < truth - 1e-9);
                }
            }
            // Unlisted bands count, too: a light cut at band 10 is bounded from its total.
            let cut = LightSpectrum { bands: light.bands[..11].to_vec(), total: light.total };
            for f in 0..10 {
                let truth = 1.0 - reflected(&light, &kernel, f, 8) / all;
                assert!(bound(&cut, &kernel, f, 8) >= truth - 1e-12, "{f}");
            }
        }
        assert!(below > 20, "{below}");
    }

    /// Figure 5.5: Phong s = 32 in Grace Cathedral, whose spectrum the repaired bound never flatters.
    #[test]
    fn phong_in_grace_cathedral_is_bounded() {
        let Some(path) = steradian_testkit::data("environments/latlong/grace_latlong.exr") else { return };
        let loaded = steradian_light::load::load(&path, &Default::default()).expect("the probe is readable");
        let image = loaded.into_environment().image.resample(steradian_sphere::Layout::LatLong, 256, 128);
        let plan = sh::ShTransform::new(127, 256, 128, sh::Grid::Equirectangular);
        let sh = plan.analyze(image.planes.each_ref().map(Vec::as_slice));
        let energies = ColumnsRgb::from_world(&sh).band_energies();
        let bands: Vec<f64> = energies.iter().map(|e| e.iter().sum()).collect();
        let light = LightSpectrum { total: bands.iter().sum(), bands };
        let k = crate::Zonal::coefficients(&crate::Lobe::phong(32.0), 127);
        let square = |(l, k): (usize, &f64)| k * k / lambda_square(l);
        let squares: Vec<f64> = k.iter().enumerate().map(square).collect();
        let kernel = KernelSpectrum::radial(&squares, squares.iter().sum());
        let all = reflected(&light, &kernel, 127, 0);
        for f in 0..=30 {
            let truth = 1.0 - reflected(&light, &kernel, f, 0) / all;
            let repaired = bound(&light, &kernel, f, 0);
            assert!(repaired >= truth - 1e-13, "{f}: {repaired} {truth}");
            // The bound is not trivial either: it falls as orders grow.
            assert!(f < 12 || repaired < 0.05, "{f}: {repaired}");
        }
        assert!(light.order(0.5).is_some_and(|f| f > 10), "{:?}", light.order(0.5));
    }
}

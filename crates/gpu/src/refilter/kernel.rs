//! Kernels, and their approximation by sums of Gaussians and low bands.

use crate::GpuError;
use steradian_numerics::dense;
use steradian_prefilter::quadrature;
use steradian_technique::gpu::Kernel;

/// Fails for parameters that make no kernel.
pub(super) fn check(kernel: Kernel) -> Result<(), GpuError> {
    let good = match kernel {
        Kernel::Ggx { alpha } => alpha > 0.0 && alpha <= 1.0,
        Kernel::Phong { n } => (1.0..=1e6).contains(&n),
        Kernel::Gaussian { sigma } => (1e-3..=4.0).contains(&sigma),
        Kernel::Mirror | Kernel::Lambert => true,
    };
    if good { Ok(()) } else { Err(GpuError::Scene(format!("{kernel:?} is no kernel"))) }
}

/// The α of the GGX kernel that needs as fine a grid.
pub(super) fn width(kernel: Kernel) -> f64 {
    match kernel {
        Kernel::Mirror => f64::INFINITY,
        Kernel::Ggx { alpha } => alpha,
        Kernel::Phong { n } => 0.7 / n.sqrt(),
        Kernel::Gaussian { sigma } => 0.7 * sigma.min(1.0),
        Kernel::Lambert => 0.7,
    }
}

/// `Job.kernel` without the gain: shape, parameter, factor.
pub(super) fn numbers(kernel: Kernel) -> [f64; 3] {
    let peak = kernel.zonal().map_or(0.0, |k| k.value(1.0));
    match kernel {
        // value(1) = scale/(4π α²), and the shader multiplies α²/q².
        Kernel::Mirror => [0.0, 1.0, 0.0],
        Kernel::Ggx { alpha } => [0.0, alpha.max(1e-4), peak * alpha.max(1e-4).powi(2)],
        Kernel::Phong { n } => [1.0, n, peak],
        Kernel::Gaussian { sigma } => [2.0, sigma.powi(-2), peak],
        Kernel::Lambert => [1.0, 1.0, peak],
    }
}

/// Coefficients of the normalised Gaussian exp(κ(cos θ − 1)), lowered to end at 0 at θ = `reach`.
pub(super) fn gaussian(kappa: f64, reach: f64, order: usize) -> Vec<f64> {
    let edge = (kappa * (reach.cos() - 1.0)).exp();
    let value = |x: f64| (kappa * (x - 1.0)).exp() - edge;
    let mut k = quadrature(value, kappa.sqrt().recip(), reach, order);
    let whole = k[0];
    k.iter_mut().for_each(|k| *k /= whole);
    k
}

/// Factors of the bands of a mean over square cells of `area` steradians, to second order: exp(−l(l+1)
/// area/24).
pub(super) fn cells(area: f64, order: usize) -> Vec<f64> {
    (0..=order).map(|l| (-((l * (l + 1)) as f64) * area / 24.0).exp()).collect()
}

/// Σ w_j b_j(l) ≈ k_l, with bands below `bands` to be mended by spherical harmonics.
pub(super) struct Mixture {
    /// w_j.
    pub weights: Vec<f64>,
    /// k_l − Σ w_j b_j(l) of the low bands.
    pub rest: Vec<f64>,
    /// Relative error of the higher bands: √(Σ (2l+1)/(l+1)² e_l² / Σ (2l+1)/(l+1)² k_l²), the RMS error
    /// under light whose bands fall like 1/l², as photographs' do.
    pub error: f64,
}

/// Approximate relative error of a Gaussian on its cube: it penalises large weights that cancel each other.
/// For GGX of α = 1/81 weights sum to 1.3 without sign and the predicted error is 0.15 % with 0.005, 1.0 and
/// 0.19 % with 0.02, 1.0 and 0.34 % with 0.1.
const NOISE: f64 = 0.02;

/// Least squares in frequency space. Weights of bands lie between those of natural light and of a single
/// point; low bands hardly count, so that they do not constrain the fit; large weights are penalised by the
/// errors that they would amplify.
pub(super) fn fit(k: &[f64], basis: &[Vec<f64>], bands: usize) -> Mixture {
    let full = |l: usize| (2 * l + 1) as f64 / (l + 1) as f64;
    let weight = |l: usize| if l < bands { 1e-4 * full(l) } else { full(l) };
    let n = basis.len();
    let dot = |a: &[f64], b: &[f64]| -> f64 { (0..k.len()).map(|l| weight(l) * a[l] * b[l]).sum() };
    let mut system: Vec<Vec<f64>> =
        (0..n).map(|i| (0..n).map(|j| dot(&basis[i], &basis[j])).collect()).collect();
    for (i, b) in basis.iter().enumerate() {
        system[i][i] += NOISE * NOISE * b.iter().enumerate().map(|(l, b)| full(l) * b * b).sum::<f64>();
    }
    let sides = basis.iter().map(|b| vec![dot(b, k)]).collect();
    // The added diagonal keeps the system regular.
    let weights = dense::solve(system, sides, 0.0).map_or_else(|| vec![0.0; n], |x| x.concat());
    let miss: Vec<f64> =
        (0..k.len()).map(|l| k[l] - weights.iter().zip(basis).map(|(w, b)| w * b[l]).sum::<f64>()).collect();
    let energy = |e: &[f64], from: usize| -> f64 {
        (from..e.len()).map(|l| (2 * l + 1) as f64 / (l + 1).pow(2) as f64 * e[l] * e[l]).sum()
    };
    let error = (energy(&miss, bands) / energy(k, 0)).sqrt();
    Mixture { weights, rest: miss[..bands].to_vec(), error }
}

/// The variance v of the Gaussian exp(−l(l+1)v/2) nearest to a kernel, weighted as in [`fit`], by which a box
/// is chosen.
pub(super) fn variance(k: &[f64]) -> f64 {
    let off = |v: f64| -> f64 {
        let e = |(l, k): (usize, &f64)| {
            let gap = k - (-((l * (l + 1)) as f64) * v / 2.0).exp();
            (2 * l + 1) as f64 / (l + 1) as f64 * gap * gap
        };
        k.iter().enumerate().map(e).sum()
    };
    let (mut best, mut least) = (1.0, f64::INFINITY);
    for i in 0..=1200 {
        let v = 10f64.powf(-5.0 + 6.0 * f64::from(i) / 1200.0);
        let e = off(v);
        if e < least {
            (best, least) = (v, e);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_prefilter::{GgxMirror, Zonal};

    /// Four Gaussians of doubling width and ten bands approximate GGX at every roughness within their range.
    #[test]
    fn gaussians_and_low_bands_stand_for_ggx() {
        let sigma0: f64 = 2.0 * std::f64::consts::FRAC_PI_2 / 128.0;
        let basis: Vec<Vec<f64>> = (0..4)
            .map(|j| {
                let v = (sigma0 * f64::from(1 << j)).powi(2);
                (0..=300).map(|l| (-((l * (l + 1)) as f64) * v / 2.0).exp()).collect()
            })
            .collect();
        for alpha in [0.04, 0.1, 0.25, 0.5, 1.0] {
            let m = fit(&GgxMirror::new(alpha).coefficients(300), &basis, 10);
            assert!(m.error < 5e-3, "alpha {alpha}: {}", m.error);
            assert!(m.weights.iter().all(|w| w.abs() < 3.0), "alpha {alpha}: {:?}", m.weights);
        }
    }

    #[test]
    fn narrow_gaussians_have_the_heat_kernel_s_bands() {
        let v: f64 = 0.03 * 0.03;
        let k = gaussian(1.0 / v, 0.2, 60);
        for l in [1usize, 10, 30, 60] {
            let heat = (-((l * (l + 1)) as f64) * v / 2.0).exp();
            assert!((k[l] - heat).abs() < 1e-3, "{l}: {} {heat}", k[l]);
        }
    }
}

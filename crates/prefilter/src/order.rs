//! The order rule: how many bands of filtered light a tolerance needs.

use crate::Source;
use std::f64::consts::PI;

/// Energies of a kernel and of light by band.
pub(crate) struct Energies<'a> {
    /// k_l² of the kernel, or a mean of that over several kernels.
    pub kernel: &'a [f64],
    /// Energy of the light's bands, all that are known.
    pub bands: &'a [f64],
    /// Energy of all bands, ∫ L².
    pub whole: f64,
    /// Σ flux² of further small lights, whose spectrum is flat.
    pub flux2: f64,
    /// Energy of the filtered light, to which errors are relative.
    pub result: f64,
}

/// The smallest order whose bound of the relative RMS error is at most `limit` (or all bands), and that
/// bound.
///
/// The energy in bands above F is at most max_{l>F} k_l² (∫L² − Σ_{l≤F} L_l²) (Ramamoorthi & Hanrahan 2002,
/// eq. 5.19 in spirit), and that of each small light Σ_{l>F} k_l² (2l + 1)/4π flux².
pub(crate) fn smallest_order(e: &Energies<'_>, limit: f64) -> (usize, f64) {
    if e.result <= 0.0 {
        return (0, 0.0);
    }
    // By band: the largest k_l² above it (kernels fall, but for ripples that this takes care of), and the
    // energy of small lights above it.
    let mut above = vec![(0.0, 0.0); e.kernel.len().max(e.bands.len())];
    let (mut peak, mut lights) = (0.0_f64, 0.0);
    for l in (1..e.kernel.len()).rev() {
        peak = peak.max(e.kernel[l]);
        lights += e.kernel[l] * (2 * l + 1) as f64 / (4.0 * PI) * e.flux2;
        above[l - 1] = (peak, lights);
    }
    let (mut left, mut tail) = (e.whole, 0.0);
    for (l, (band, (peak, lights))) in e.bands.iter().zip(above).enumerate() {
        left = (left - band).max(0.0);
        tail = ((peak * left + lights) / e.result).sqrt();
        if tail <= limit {
            return (l, tail);
        }
    }
    (e.bands.len().saturating_sub(1), tail)
}

/// The smallest order for a prepared light and the energies of a kernel by band, and the relative RMS error
/// that it leaves at most. `flux2` is Σ flux² of the small lights that go through the bands as well; 0 where
/// they are summed apart.
pub fn of_source(source: &Source, kernel: &[f64], flux2: f64, limit: f64) -> (usize, f64) {
    let bands: Vec<f64> = source.base_bands().collect();
    let result = kernel.iter().zip(&source.bands).map(|(k, b)| k * b).sum();
    smallest_order(&Energies { kernel, bands: &bands, whole: source.base_energy, flux2, result }, limit)
}

/// The bands of an analysis that is sure to hold those that [`of_source`] finds, by a source of the same
/// light with fewer of them: all energy beyond these may lie just above the order. All bands of `kernel`
/// where that is not enough.
pub fn of_analysis(source: &Source, kernel: &[f64], limit: f64) -> usize {
    let mut bands: Vec<f64> = source.base_bands().collect();
    bands.resize(kernel.len().max(bands.len()), 0.0);
    let result = kernel.iter().zip(&source.bands).map(|(k, b)| k * b).sum();
    smallest_order(&Energies { kernel, bands: &bands, whole: source.base_energy, flux2: 0.0, result }, limit)
        .0
}

//! Spectra of reflectance to linear Rec. 709.

use steradian_base::brief;
use steradian_formats::cie::{XYZ_TO_REC709, matching};

/// [`weights`] of wavelengths from a file; the error describes their fault.
pub(super) fn weights_of(wavelengths: &[f64]) -> Result<Vec<[f64; 3]>, String> {
    let ascending = wavelengths.windows(2).all(|p| p[0] < p[1]);
    if wavelengths.len() < 2 || !ascending || wavelengths.iter().any(|v| !(100.0..=1e4).contains(v)) {
        let shown = wavelengths.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        return Err(format!("its wavelengths are no ascending list of lengths in nm: {}", brief(&shown)));
    }
    let weights = weights(wavelengths);
    let visible = weights.iter().flatten().all(|w| w.is_finite());
    visible.then_some(weights).ok_or_else(|| "its wavelengths lie outside the visible ones".into())
}

/// The weight of each wavelength (ascending, nm) per channel, so that a spectrum of constant reflectance ρ is
/// (ρ, ρ, ρ): equal-energy light, its white brought to that of Rec. 709 by factors of X, Y and Z. The
/// spectrum is linear between its wavelengths.
fn weights(wavelengths: &[f64]) -> Vec<[f64; 3]> {
    let mut xyz = vec![[0.0; 3]; wavelengths.len()];
    for (i, pair) in wavelengths.windows(2).enumerate() {
        // Whole nanometres of the interval at their middles.
        let steps = (pair[1] - pair[0]).ceil().max(1.0);
        for k in 0..steps as usize {
            let t = (k as f64 + 0.5) / steps;
            let value = matching(pair[0] + t * (pair[1] - pair[0]));
            for c in 0..3 {
                let v = value[c] * (pair[1] - pair[0]) / steps;
                xyz[i][c] += (1.0 - t) * v;
                xyz[i + 1][c] += t * v;
            }
        }
    }
    let total: [f64; 3] = std::array::from_fn(|c| xyz.iter().map(|v| v[c]).sum());
    // The white of Rec. 709 as its own matrix has it: rows · white = 1.
    let white = [0.950_47, 1.0, 1.088_83];
    let rgb = |v: &[f64; 3]| -> [f64; 3] {
        let v: [f64; 3] = std::array::from_fn(|c| v[c] * white[c] / total[c]);
        std::array::from_fn(|c| XYZ_TO_REC709[c].iter().zip(v).map(|(m, v)| m * v).sum())
    };
    xyz.iter().map(rgb).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grey_stays_grey_and_hues_are_right() {
        let nm: Vec<f64> = (0..40).map(|i| 360.0 + 10.0 * f64::from(i)).collect();
        let w = weights(&nm);
        let rgb = |s: &dyn Fn(f64) -> f64| -> [f64; 3] {
            std::array::from_fn(|c| nm.iter().zip(&w).map(|(nm, w)| s(*nm) * w[c]).sum())
        };
        assert!(rgb(&|_| 0.5).iter().all(|v| (v - 0.5).abs() < 1e-5), "{:?}", rgb(&|_| 0.5));
        let red = rgb(&|nm| f64::from(u8::from(nm > 600.0)));
        assert!(red[0] > 0.75 && red[1] < 0.1 && red[2] < 0.1, "{red:?}");
        let blue = rgb(&|nm| f64::from(u8::from(nm < 480.0)));
        assert!(blue[2] > 0.75 && blue[0] < 0.1 && blue[1] < 0.1, "{blue:?}");
    }
}

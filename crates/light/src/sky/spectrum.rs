//! Spectra in bins of 20 nm, and their colour.

use std::sync::OnceLock;
use steradian_formats::cie::{XYZ_TO_REC709, matching};

/// Number of bins, 380 to 740 nm.
pub(super) const BINS: usize = 18;
/// Width of a bin, nm, and where the first begins: tables of sun and ozone come in steps of 10 nm, of which a
/// bin averages two.
const STEP: f64 = 20.0;
const FIRST: f64 = 380.0;

/// A value per bin.
pub(super) type Spectrum = [f64; BINS];

/// Luminous efficacy that ties RGB radiance to luminance: cd m⁻² = 179·Y(RGB). It is that of equal-energy
/// light in the visible band, the convention of Radiance's pictures (Ward 1994, WHTEFFICACY).
pub const EFFICACY: f64 = 179.0;

/// Peak efficacy of the eye, lm W⁻¹.
const K_M: f64 = 683.002;

/// Centre of a bin, nm.
pub(super) fn wavelength(bin: usize) -> f64 {
    FIRST + STEP * (bin as f64 + 0.5)
}

/// Mean over each bin of a table that starts at 360 nm and goes in steps of 10 nm: the bin's centre is a node
/// of the table, its ends are half a weight each.
fn binned(table: &[f64; 48]) -> Spectrum {
    std::array::from_fn(|k| {
        let i = 3 + 2 * k;
        0.25 * table[i - 1] + 0.5 * table[i] + 0.25 * table[i + 1]
    })
}

/// Solar irradiance above the atmosphere at the mean distance, W m⁻² nm⁻¹ (ASTM G173-03 as averaged to 10 nm
/// by Bruneton 2017, "Precomputed atmospheric scattering: a new implementation").
pub(super) fn solar() -> Spectrum {
    binned(&[
        1.11776, 1.14259, 1.01249, 1.14716, 1.72765, 1.73054, 1.6887, 1.61253, 1.91198, 2.03474, 2.02042,
        2.02212, 1.93377, 1.95809, 1.91686, 1.8298, 1.8685, 1.8931, 1.85149, 1.8504, 1.8341, 1.8345, 1.8147,
        1.78158, 1.7533, 1.6965, 1.68194, 1.64654, 1.6048, 1.52143, 1.55622, 1.5113, 1.474, 1.4482, 1.41018,
        1.36775, 1.34188, 1.31429, 1.28303, 1.26758, 1.2367, 1.2082, 1.18737, 1.14683, 1.12362, 1.1058,
        1.07124, 1.04992,
    ])
}

/// Absorption cross section of ozone, m² (Serdyuchenko et al. 2014 at 233 K, averaged to 10 nm by Bruneton
/// 2017).
pub(super) fn ozone_cross_section() -> Spectrum {
    binned(&[
        1.18e-27, 2.182e-28, 2.818e-28, 6.636e-28, 1.527e-27, 2.763e-27, 5.52e-27, 8.451e-27, 1.582e-26,
        2.316e-26, 3.669e-26, 4.924e-26, 7.752e-26, 9.016e-26, 1.48e-25, 1.602e-25, 2.139e-25, 2.755e-25,
        3.091e-25, 3.5e-25, 4.266e-25, 4.672e-25, 4.398e-25, 4.701e-25, 5.019e-25, 4.305e-25, 3.74e-25,
        3.215e-25, 2.662e-25, 2.238e-25, 1.852e-25, 1.473e-25, 1.209e-25, 9.423e-26, 7.455e-26, 6.566e-26,
        5.105e-26, 4.15e-26, 4.228e-26, 3.237e-26, 2.451e-26, 2.801e-26, 2.534e-26, 1.624e-26, 1.465e-26,
        2.078e-26, 1.383e-26, 7.105e-27,
    ])
}

/// Luminance of linear Rec. 709 (weights sum to 1, so that a grey is its own luminance).
pub fn luminance(rgb: [f64; 3]) -> f64 {
    0.212_672_8 * rgb[0] + 0.715_152_2 * rgb[1] + 0.072_175_0 * rgb[2]
}

/// Linear Rec. 709 of a spectrum per nm, so that [`EFFICACY`]·luminance is its luminance (or illuminance). It
/// may leave the gamut: see [`into_gamut`].
pub(super) fn rgb(s: &Spectrum) -> [f64; 3] {
    static WEIGHTS: OnceLock<[[f64; 3]; BINS]> = OnceLock::new();
    let weights = WEIGHTS.get_or_init(|| {
        std::array::from_fn(|k| {
            let mut w = [0.0; 3];
            for nm in 0..STEP as usize {
                let xyz = matching(FIRST + STEP * k as f64 + nm as f64 + 0.5).map(|v| v * K_M / EFFICACY);
                for (w, row) in w.iter_mut().zip(XYZ_TO_REC709) {
                    *w += row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2];
                }
            }
            w
        })
    });
    let mut out = [0.0; 3];
    for (s, w) in s.iter().zip(weights) {
        out.iter_mut().zip(w).for_each(|(o, w)| *o += s * w);
    }
    out
}

/// Moves a colour outside Rec. 709 towards the grey of its own luminance until no component is negative:
/// luminance is kept, saturation lost.
pub(super) fn into_gamut(rgb: [f64; 3]) -> [f64; 3] {
    let y = luminance(rgb);
    let low = rgb.iter().copied().fold(f64::INFINITY, f64::min);
    if low >= 0.0 {
        return rgb;
    }
    if y <= 0.0 {
        return [0.0; 3];
    }
    let t = y / (y - low);
    rgb.map(|v| (y + t * (v - y)).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Equal-energy light of 1 W m⁻² nm⁻¹: 683·106.857 lm m⁻², nearly grey (its white is not D65's).
    #[test]
    fn equal_energy_has_its_luminance() {
        let c = rgb(&[1.0; BINS]);
        assert!((luminance(c) * EFFICACY / (683.0 * 106.857) - 1.0).abs() < 2e-3);
        assert!(c[0] / c[1] > 1.2 && c[2] / c[1] < 1.0, "{c:?}");
    }

    /// The solar illuminance constant is about 128–134 klx.
    #[test]
    fn sunlight_above_the_air_has_its_illuminance() {
        let lux = luminance(rgb(&solar())) * EFFICACY;
        assert!((125e3..136e3).contains(&lux), "{lux}");
        let visible: f64 = solar().iter().sum::<f64>() * STEP;
        assert!((580.0..660.0).contains(&visible), "{visible}");
    }

    #[test]
    fn gamut_mapping_keeps_luminance() {
        let c = [1.0, 0.3, -0.2];
        let m = into_gamut(c);
        assert!((luminance(m) - luminance(c)).abs() < 1e-12 && m[2] < 1e-15);
        assert_eq!(into_gamut([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
        assert_eq!(into_gamut([-1.0, -1.0, 0.1]), [0.0; 3]);
    }
}

//! Spectra of reflectance to linear Rec. 709.

/// CIE 1931 colour matching functions (Wyman, Sloan & Shirley 2013, "Simple Analytic Approximations to the CIE XYZ Color
/// Matching Functions", multi-lobe fit).
fn matching(nm: f64) -> [f64; 3] {
    let g = |centre: f64, below: f64, above: f64| {
        let t = (nm - centre) * if nm < centre { below } else { above };
        (-0.5 * t * t).exp()
    };
    [
        1.056 * g(599.8, 0.0264, 0.0323) + 0.362 * g(442.0, 0.0624, 0.0374)
            - 0.065 * g(501.1, 0.0490, 0.0382),
        0.821 * g(568.8, 0.0213, 0.0247) + 0.286 * g(530.9, 0.0613, 0.0322),
        1.217 * g(437.0, 0.0845, 0.0278) + 0.681 * g(459.0, 0.0385, 0.0725),
    ]
}

/// XYZ → linear Rec. 709 (IEC 61966-2-1, D65).
const REC709: [[f64; 3]; 3] = [
    [3.240_454_2, -1.537_138_5, -0.498_531_4],
    [-0.969_266_0, 1.876_010_8, 0.041_556_0],
    [0.055_643_4, -0.204_025_9, 1.057_225_2],
];

/// The weight of each wavelength (ascending, nm) per channel, so that a spectrum of constant reflectance ρ is (ρ, ρ, ρ):
/// equal-energy light, its white brought to that of Rec. 709 by factors of X, Y and Z. The spectrum is linear between
/// its wavelengths.
pub(super) fn weights(wavelengths: &[f64]) -> Vec<[f64; 3]> {
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
        std::array::from_fn(|c| REC709[c].iter().zip(v).map(|(m, v)| m * v).sum())
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

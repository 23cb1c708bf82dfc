//! The tone curves, on non-negative linear Rec. 709 colours.

use super::luminance;

/// Reinhard, Stark, Shirley & Ferwerda 2002, "Photographic Tone Reproduction for Digital Images", eq. 4:
/// L_d = L (1 + L/L_white²) / (1 + L); the colour keeps its ratios.
pub fn reinhard(x: [f32; 3], white: f32) -> [f32; 3] {
    let l = luminance(x);
    let scale = (1.0 + l / (white * white)) / (1.0 + l);
    x.map(|c| c * scale)
}

/// Hable 2010, "Filmic Tonemapping Operators": exposure bias 2, linear white 11.2.
pub fn hable(x: [f32; 3]) -> [f32; 3] {
    let curve = |x: f32| {
        let (a, b, c, d, e, f) = (0.15, 0.50, 0.10, 0.20, 0.02, 0.30);
        (x * (a * x + c * b) + d * e) / (x * (a * x + b) + d * f) - e / f
    };
    let white = 1.0 / curve(11.2);
    x.map(|c| curve(2.0 * c) * white)
}

/// Narkowicz 2016, "ACES Filmic Tone Mapping Curve".
pub fn aces_narkowicz(x: f32) -> f32 {
    (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
}

/// Hill 2016 (in Pettineo's BakingLab): sRGB → RRT input, fit of RRT and ODT, back to sRGB.
pub fn aces_hill(x: [f32; 3]) -> [f32; 3] {
    const INPUT: [[f32; 3]; 3] =
        [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
    const OUTPUT: [[f32; 3]; 3] =
        [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
    let fit =
        |v: f32| (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
    multiply(&OUTPUT, multiply(&INPUT, x).map(fit))
}

/// AgX (Sobotka), as approximated by Wrensch 2023, "Minimal AgX Implementation": inset, log2 over −12.47393 …
/// 4.026069 stops, a polynomial of degree 6, outset, display power 2.2 taken back.
pub fn agx(x: [f32; 3]) -> [f32; 3] {
    const INSET: [[f32; 3]; 3] = [
        [0.842_479_06, 0.078_433_6, 0.079_223_745],
        [0.042_328_242, 0.878_468_64, 0.079_166_13],
        [0.042_375_655, 0.078_433_6, 0.879_142_97],
    ];
    const OUTSET: [[f32; 3]; 3] = [
        [1.196_879, -0.098_020_88, -0.099_029_74],
        [-0.052_896_85, 1.151_903_1, -0.098_961_18],
        [-0.052_971_635, -0.098_043_45, 1.151_073_7],
    ];
    const MIN_EV: f32 = -12.473_93;
    const MAX_EV: f32 = 4.026_069;
    let curve = |v: f32| {
        let t = ((v.max(1e-10).log2() - MIN_EV) / (MAX_EV - MIN_EV)).clamp(0.0, 1.0);
        let (t2, t4) = (t * t, t * t * t * t);
        15.5 * t4 * t2 - 40.14 * t4 * t + 31.96 * t4 - 6.868 * t2 * t + 0.4298 * t2 + 0.1191 * t - 0.00232
    };
    multiply(&OUTSET, multiply(&INSET, x).map(curve)).map(|c| c.max(0.0).powf(2.2))
}

/// Khronos 2024, "PBR Neutral Tone Mapper": identity less a Fresnel offset below 0.8, then a rational
/// shoulder that desaturates.
pub fn neutral(x: [f32; 3]) -> [f32; 3] {
    const START: f32 = 0.8 - 0.04;
    const DESATURATION: f32 = 0.15;
    let low = x[0].min(x[1]).min(x[2]);
    let offset = if low < 0.08 { low - 6.25 * low * low } else { 0.04 };
    let c = x.map(|v| v - offset);
    let peak = c[0].max(c[1]).max(c[2]);
    if peak < START {
        return c;
    }
    let d = 1.0 - START;
    let new_peak = 1.0 - d * d / (peak + d - START);
    let g = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    c.map(|v| v * new_peak / peak * (1.0 - g) + new_peak * g)
}

fn multiply(m: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    m.map(|r| r[0] * v[0] + r[1] * v[1] + r[2] * v[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn published_anchors() {
        // Reinhard: the white luminance maps to 1.
        assert!((reinhard([4.0; 3], 4.0)[0] - 1.0).abs() < 1e-6);
        // Hable: the linear white divided by the exposure bias maps to 1.
        assert!((hable([5.6; 3])[0] - 1.0).abs() < 1e-6);
        // Narkowicz: 0.8037 at 1.
        assert!((aces_narkowicz(1.0) - 0.803_797).abs() < 1e-5);
        // PBR Neutral is the identity less 0.04 between 0.08 and 0.8.
        assert!((neutral([0.5, 0.3, 0.2])[0] - 0.46).abs() < 1e-6);
        // Hill's matrices keep greys grey, and middle grey stays within a tenth of a stop of the curve.
        let g = aces_hill([0.18; 3]);
        assert!((g[0] - g[2]).abs() < 2e-3);
        // AgX: middle grey in, about middle grey out.
        assert!((agx([0.18; 3])[1] - 0.18).abs() < 0.04, "{:?}", agx([0.18; 3]));
    }
}

//! Spectra to colours, for whoever reads or computes spectra: the observer and the way to linear Rec. 709.

/// CIE 1931 colour matching functions (Wyman, Sloan & Shirley 2013, "Simple analytic approximations to the
/// CIE XYZ color matching functions", multi-lobe fit).
pub fn matching(nm: f64) -> [f64; 3] {
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
pub const XYZ_TO_REC709: [[f64; 3]; 3] = [
    [3.240_454_2, -1.537_138_5, -0.498_531_4],
    [-0.969_266_0, 1.876_010_8, 0.041_556_0],
    [0.055_643_4, -0.204_025_9, 1.057_225_2],
];

//! ꟻLIP: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström & Fairchild 2020, "ꟻLIP: A Difference
//! Evaluator for Alternating Images", HPG. LDR version, with the constants of the authors' implementation.
//!
//! Colour: contrast sensitivity filters in YCxCz (section 4.1.1), clamp to the display's gamut, Hunt-adjusted
//! L*a*b*, HyAB distance raised to q_c = 0.7 and redistributed (4.1.2, 4.1.3). Features: edges and points by
//! derivatives of a Gaussian of the width of human edge detectors (4.2). Combined: ΔE = ΔE_c^(1 − ΔE_f)
//! (4.3).

use crate::Display;
use crate::tone::srgb_decode;
use steradian_parallel::prelude::*;

/// Pixels per degree of a 0.7 m wide 3840-pixel display at 0.7 m.
pub const DEFAULT_PPD: f32 = 67.020_64;

/// Parameters of Andersson et al. 2020, in the paper's letters: exponent, knee of colour differences and what
/// they map to there; width of the features' detector in degrees; exponent of feature differences.
const Q_C: f32 = 0.7;
const P_C: f32 = 0.4;
const P_T: f32 = 0.95;
const W: f32 = 0.082;
const Q_F: f32 = 0.5;
/// Gaussians of the contrast sensitivity functions of A, RG and BY: pairs (a, b), table 1.
const CSF: [[(f32, f32); 2]; 3] =
    [[(1.0, 0.0047), (0.0, 1e-5)], [(1.0, 0.0053), (0.0, 1e-5)], [(34.1, 0.04), (13.5, 0.025)]];
/// XYZ of the white (1, 1, 1).
const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];

/// Result of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Flip {
    /// Difference per pixel, 0 … 1, rows from the top.
    pub map: Vec<f32>,
    /// Mean over the pixels.
    pub mean: f64,
}

/// ꟻLIP of two sRGB pictures of one size (the smaller area where they differ) at `ppd` pixels per degree.
pub fn flip_displays(a: &Display, b: &Display, ppd: f32) -> Flip {
    let (w, h) = (a.width.min(b.width), a.height.min(b.height));
    let linear = |d: &Display| -> [Vec<f32>; 3] {
        let table: Vec<f32> = (0..=255u8).map(|v| srgb_decode(f32::from(v) / 255.0)).collect();
        let at = |c: usize| {
            (0..w * h).map(|i| table[usize::from(d.rgb[3 * ((i / w) * d.width + i % w) + c])]).collect()
        };
        [at(0), at(1), at(2)]
    };
    flip(&linear(a), &linear(b), w, h, ppd)
}

/// ꟻLIP of two pictures of display-linear planes in 0 … 1, `w`·`h` values each.
pub fn flip(a: &[Vec<f32>; 3], b: &[Vec<f32>; 3], w: usize, h: usize, ppd: f32) -> Flip {
    if w * h == 0 {
        return Flip { map: Vec::new(), mean: 0.0 };
    }
    let (ya, yb) = (opponent(a), opponent(b));
    let (la, lb) = (perceived(&ya, w, h, ppd), perceived(&yb, w, h, ppd));
    let (fa, fb) = (Features::of(&ya[0], w, h, ppd), Features::of(&yb[0], w, h, ppd));
    let max = hyab(hunt(lab([0.0, 1.0, 0.0])), hunt(lab([0.0, 0.0, 1.0]))).powf(Q_C);
    let map: Vec<f32> = (0..w * h)
        .into_par_iter()
        .map(|i| {
            let colour = redistribute(hyab(la[i], lb[i]).powf(Q_C), max);
            let feature = (fa.edge[i] - fb.edge[i]).abs().max((fa.point[i] - fb.point[i]).abs());
            let feature = (feature * std::f32::consts::FRAC_1_SQRT_2).powf(Q_F).clamp(0.0, 1.0);
            colour.powf(1.0 - feature)
        })
        .collect();
    let mean = map.iter().map(|&v| f64::from(v)).sum::<f64>() / map.len() as f64;
    Flip { map, mean }
}

/// Section 4.1.3: maps 0 … p_c·max to 0 … p_t of the range.
fn redistribute(e: f32, max: f32) -> f32 {
    let knee = P_C * max;
    if e < knee { P_T / knee * e } else { P_T + (e - knee) / (max - knee) * (1.0 - P_T) }
}

fn xyz([r, g, b]: [f32; 3]) -> [f32; 3] {
    [
        (10_135_552.0 * r + 8_788_810.0 * g + 4_435_075.0 * b) / 24_577_794.0,
        (2_613_072.0 * r + 8_788_810.0 * g + 887_015.0 * b) / 12_288_897.0,
        (1_425_312.0 * r + 8_788_810.0 * g + 70_074_185.0 * b) / 73_733_382.0,
    ]
}

fn rgb_from_xyz([x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        3.241_003_3 * x - 1.537_398_9 * y - 0.498_615_86 * z,
        -0.969_224_3 * x + 1.875_930_1 * y + 0.041_554_224 * z,
        0.055_639_423 * x - 0.204_011_2 * y + 1.057_148_9 * z,
    ]
}

/// Linear RGB planes → Y_y, C_x, C_z planes.
fn opponent(p: &[Vec<f32>; 3]) -> [Vec<f32>; 3] {
    let n = p[0].len();
    let mut out: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; n]);
    for i in 0..n {
        let c = xyz([p[0][i], p[1][i], p[2][i]]);
        let [x, y, z] = std::array::from_fn(|k| c[k] / WHITE[k]);
        out[0][i] = 116.0 * y - 16.0;
        out[1][i] = 500.0 * (x - y);
        out[2][i] = 200.0 * (y - z);
    }
    out
}

fn lab(rgb: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let c = xyz(rgb);
    let f: [f32; 3] = std::array::from_fn(|k| {
        let t = c[k] / WHITE[k];
        if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    });
    [116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])]
}

/// Hunt effect: chroma counts less in the dark.
fn hunt([l, a, b]: [f32; 3]) -> [f32; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

fn hyab(a: [f32; 3], b: [f32; 3]) -> f32 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Filtered by contrast sensitivity, clamped to the display's gamut, Hunt-adjusted L*a*b*.
fn perceived(ycc: &[Vec<f32>; 3], w: usize, h: usize, ppd: f32) -> Vec<[f32; 3]> {
    let planes: Vec<Vec<f32>> = (0..3).map(|k| csf_filter(&ycc[k], &CSF[k], w, h, ppd)).collect();
    (0..w * h)
        .into_par_iter()
        .map(|i| {
            let y = (planes[0][i] + 16.0) / 116.0;
            let x = planes[1][i] / 500.0 + y;
            let z = y - planes[2][i] / 200.0;
            let rgb = rgb_from_xyz([x * WHITE[0], y * WHITE[1], z * WHITE[2]]);
            hunt(lab(rgb.map(|c| c.clamp(0.0, 1.0))))
        })
        .collect()
}

/// The sum of two Gaussians a √(π/b) exp(−π² d²/b), d in degrees, normalised over the square of the common
/// radius; each is separable.
fn csf_filter(plane: &[f32], lobes: &[(f32, f32); 2], w: usize, h: usize, ppd: f32) -> Vec<f32> {
    use std::f32::consts::PI;
    let radius = (3.0 * (0.04f32 / (2.0 * PI * PI)).sqrt() * ppd).ceil() as isize;
    let kernel = |b: f32| -> Vec<f32> {
        (-radius..=radius).map(|x| (-PI * PI * (x as f32 / ppd).powi(2) / b).exp()).collect()
    };
    let mut total = 0.0;
    let mut sum = vec![0.0f32; plane.len()];
    for &(a, b) in lobes.iter().filter(|l| l.0 > 0.0) {
        let k = kernel(b);
        let weight = a * (PI / b).sqrt();
        total += weight * k.iter().sum::<f32>().powi(2);
        let out = separable(plane, &k, &k, w, h);
        sum.iter_mut().zip(out).for_each(|(s, o)| *s += weight * o);
    }
    sum.iter_mut().for_each(|s| *s /= total);
    sum
}

/// Magnitudes of edges and points.
struct Features {
    edge: Vec<f32>,
    point: Vec<f32>,
}

impl Features {
    fn of(y: &[f32], w: usize, h: usize, ppd: f32) -> Self {
        let sd = 0.5 * W * ppd;
        let radius = (3.0 * sd).ceil() as isize;
        let at = |f: &dyn Fn(f32, f32) -> f32| -> Vec<f32> {
            (-radius..=radius).map(|x| f(x as f32, (-((x * x) as f32) / (2.0 * sd * sd)).exp())).collect()
        };
        let mut smooth = at(&|_, g| g);
        let sum: f32 = smooth.iter().sum();
        smooth.iter_mut().for_each(|v| *v /= sum);
        let first = balanced(at(&|x, g| -x * g));
        let second = balanced(at(&|x, g| (x * x / (sd * sd) - 1.0) * g));
        let luma: Vec<f32> = y.iter().map(|v| (v + 16.0) / 116.0).collect();
        let magnitude = |k: &[f32]| -> Vec<f32> {
            let (x, y) = (separable(&luma, k, &smooth, w, h), separable(&luma, &smooth, k, w, h));
            x.iter().zip(y).map(|(x, y)| x.hypot(y)).collect()
        };
        Self { edge: magnitude(&first), point: magnitude(&second) }
    }
}

/// Positive weights sum to 1, negative ones to −1.
fn balanced(mut k: Vec<f32>) -> Vec<f32> {
    let plus: f32 = k.iter().filter(|v| **v > 0.0).sum();
    let minus: f32 = -k.iter().filter(|v| **v < 0.0).sum::<f32>();
    k.iter_mut().for_each(|v| *v /= if *v < 0.0 { minus } else { plus });
    k
}

/// Correlation with kx along rows and ky along columns; borders repeat the last pixel.
fn separable(p: &[f32], kx: &[f32], ky: &[f32], w: usize, h: usize) -> Vec<f32> {
    let (rx, ry) = ((kx.len() / 2) as isize, (ky.len() / 2) as isize);
    let clamp = |v: isize, n: usize| v.clamp(0, n as isize - 1) as usize;
    let mut rows = vec![0.0f32; w * h];
    rows.par_chunks_mut(w).enumerate().for_each(|(y, out)| {
        for (x, o) in out.iter_mut().enumerate() {
            *o = kx
                .iter()
                .enumerate()
                .map(|(k, c)| c * p[y * w + clamp(x as isize + k as isize - rx, w)])
                .sum();
        }
    });
    let mut out = vec![0.0f32; w * h];
    out.par_chunks_mut(w).enumerate().for_each(|(y, line)| {
        for (k, c) in ky.iter().enumerate() {
            let from = clamp(y as isize + k as isize - ry, h) * w;
            line.iter_mut().zip(&rows[from..from + w]).for_each(|(o, r)| *o += c * r);
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(w: usize, h: usize, seed: u32) -> Display {
        let mut s = seed;
        let mut next = || {
            s = s.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (s >> 24) as u8
        };
        Display { width: w, height: h, rgb: (0..3 * w * h).map(|_| next()).collect() }
    }

    #[test]
    fn black_against_white_is_the_published_value() {
        let (a, b) = (Display::filled(16, 16, [0; 3]), Display::filled(16, 16, [255; 3]));
        let f = flip_displays(&a, &b, DEFAULT_PPD);
        assert!((f.mean - 0.967_4).abs() < 2e-4, "{}", f.mean);
        // Green against blue is the largest colour difference: 1.
        let (a, b) = (Display::filled(8, 8, [0, 255, 0]), Display::filled(8, 8, [0, 0, 255]));
        assert!((flip_displays(&a, &b, DEFAULT_PPD).mean - 1.0).abs() < 1e-4);
    }

    #[test]
    fn identical_pictures_differ_by_nothing_and_order_does_not_matter() {
        let (a, b) = (noise(40, 30, 1), noise(40, 30, 2));
        assert_eq!(flip_displays(&a, &a, DEFAULT_PPD).mean, 0.0);
        let (ab, ba) = (flip_displays(&a, &b, DEFAULT_PPD), flip_displays(&b, &a, DEFAULT_PPD));
        assert_eq!(ab.map, ba.map);
        assert!(ab.map.iter().all(|v| (0.0..=1.0).contains(v)));
        // The authors' own program (flip-evaluator 1.7) gives 0.435458690 for these two pictures.
        assert!((ab.mean - 0.435_458_69).abs() < 2e-6, "{}", ab.mean);
    }
}

//! Metrics of the difference between two pictures.

mod difference;
mod flip;

pub use difference::difference_picture;
pub use flip::{DEFAULT_PPD, Flip, flip, flip_displays};

use crate::Film;

/// Differences of linear radiance over the pixels that count.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Errors {
    /// √ mean (a − b)² over pixels and channels, W sr⁻¹ m⁻².
    pub rmse: f64,
    /// √ (Σ(a − b)² / Σ b²): the relative RMS error that `--tolerance` speaks of.
    pub relative_rms: f64,
    /// mean (a − b)² / (b² + 0.01) (Rousselle, Knaus & Zwicker 2011, section 4).
    pub rel_mse: f64,
    /// max |a − b|.
    pub max_abs: f64,
    /// 10 log₁₀ (peak² / mean (a − b)²), decibel, peak = the largest value of b; infinite for equal pictures.
    pub psnr: f64,
    /// Median over pixels of the error relative to the pixel's own radiance, |a − b| / |b| over the channels.
    pub median: f64,
    /// Ninth decile over pixels of the error relative to the pixel's own radiance.
    pub ninetieth: f64,
    /// mean |log₂ (luminance of a / luminance of b)|: photographic stops.
    pub stops: f64,
    /// Pixels that counted.
    pub pixels: usize,
}

/// Where radiance is below this part of its mean, errors of single pixels are relative to that part of the
/// mean.
const DARK: f64 = 1e-3;

/// Errors of `a` against the reference `b` over the pixels where `mask` holds. The films should have one
/// size; pixels that one of them lacks are skipped.
pub fn errors(a: &Film, b: &Film, mask: impl Fn(usize) -> bool) -> Errors {
    let counted: Vec<usize> = (0..a.len().min(b.len())).filter(|i| mask(*i)).collect();
    errors_over(a, b, &counted)
}

/// [`errors`] over these pixels. (Not generic: it would be compiled with its callers, which are not
/// optimised.)
fn errors_over(a: &Film, b: &Film, counted: &[usize]) -> Errors {
    let (mut d2, mut b2, mut rel, mut max, mut peak) = (0.0, 0.0, 0.0, 0.0f64, 0.0f64);
    for &i in counted {
        for (x, y) in a.pixel(i).into_iter().zip(b.pixel(i)) {
            let (x, y) = (f64::from(x), f64::from(y));
            let d = (x - y) * (x - y);
            d2 += d;
            b2 += y * y;
            rel += d / (y * y + 0.01);
            max = max.max((x - y).abs());
            peak = peak.max(y);
        }
    }
    let pixels = counted.len();
    let n = (3 * pixels).max(1) as f64;
    let relative_rms = if d2 == 0.0 { 0.0 } else { (d2 / b2).sqrt() };
    let psnr = if d2 == 0.0 { f64::INFINITY } else { 10.0 * (peak * peak * n / d2).log10() };
    let points = single(counted.iter().map(|&i| [a.pixel(i), b.pixel(i)].map(|v| v.map(f64::from))));
    let [median, ninetieth, stops] = points;
    let rmse = (d2 / n).sqrt();
    Errors { rmse, relative_rms, rel_mse: rel / n, max_abs: max, psnr, median, ninetieth, stops, pixels }
}

/// The median and the 90th percentile of single pixels' relative errors, and their mean difference in stops.
fn single(pairs: impl Iterator<Item = [[f64; 3]; 2]> + Clone) -> [f64; 3] {
    let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
    let luminance = |v: [f64; 3]| 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2];
    let count = pairs.clone().count();
    if count == 0 {
        return [0.0; 3];
    }
    let mean = |f: &dyn Fn([f64; 3]) -> f64| pairs.clone().map(|[_, b]| f(b)).sum::<f64>() / count as f64;
    let (dark, dim) = (DARK * mean(&length), DARK * mean(&|v| luminance(v).abs()));
    let mut relative: Vec<f64> = pairs
        .clone()
        .map(|[a, b]| {
            let off = length([0, 1, 2].map(|c| a[c] - b[c]));
            if off == 0.0 { 0.0 } else { off / length(b).max(dark) }
        })
        .collect();
    relative.sort_by(f64::total_cmp);
    let stops = pairs.map(|[a, b]| {
        let [a, b] = [a, b].map(|v| luminance(v).max(dim).max(f64::MIN_POSITIVE));
        (a / b).log2().abs()
    });
    [relative[count / 2], relative[(9 * count / 10).min(count - 1)], stops.sum::<f64>() / count as f64]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn constant(v: f32) -> Film {
        let mut f = Film::new(3, 2);
        f.rgb.iter_mut().for_each(|p| p.fill(v));
        f
    }

    #[test]
    fn closed_forms_of_constant_pictures() {
        let e = errors(&constant(1.1), &constant(1.0), |_| true);
        assert!((e.rmse - 0.1).abs() < 1e-6 && (e.relative_rms - 0.1).abs() < 1e-6);
        assert!((e.rel_mse - 0.01 / 1.01).abs() < 1e-6);
        assert!((e.psnr - 20.0).abs() < 1e-4);
        assert_eq!(e.pixels, 6);
        assert!((e.median - 0.1).abs() < 1e-6 && (e.ninetieth - 0.1).abs() < 1e-6);
        assert!((errors(&constant(4.0), &constant(1.0), |_| true).stops - 2.0).abs() < 1e-6);
    }

    /// One pixel in six is off by all of its radiance: it moves the 90th percentile, not the median.
    #[test]
    fn percentiles_are_those_of_pixels() {
        let mut a = constant(1.0);
        a.rgb.iter_mut().for_each(|p| p[3] = 2.0);
        let e = errors(&a, &constant(1.0), |_| true);
        assert!(e.median == 0.0 && (e.ninetieth - 1.0).abs() < 1e-6);
        assert!((e.stops - 1.0 / 6.0).abs() < 1e-6 && (e.relative_rms - (1.0f64 / 6.0).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn equal_pictures_have_no_error() {
        let e = errors(&constant(0.0), &constant(0.0), |_| true);
        assert_eq!((e.rmse, e.relative_rms, e.rel_mse), (0.0, 0.0, 0.0));
        assert!(e.psnr.is_infinite());
        assert_eq!(errors(&constant(2.0), &constant(1.0), |i| i == 0).pixels, 1);
    }
}

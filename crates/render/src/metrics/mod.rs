//! How far a picture is from another.

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
    /// Pixels that counted.
    pub pixels: usize,
}

/// Errors of `a` against the reference `b` over the pixels where `mask` holds. The films have the same size;
/// what one of them lacks is left out.
pub fn errors(a: &Film, b: &Film, mask: impl Fn(usize) -> bool) -> Errors {
    let (mut d2, mut b2, mut rel, mut max, mut peak, mut pixels) = (0.0, 0.0, 0.0, 0.0f64, 0.0f64, 0usize);
    for i in (0..a.len().min(b.len())).filter(|&i| mask(i)) {
        pixels += 1;
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
    let n = (3 * pixels).max(1) as f64;
    let relative_rms = if d2 == 0.0 { 0.0 } else { (d2 / b2).sqrt() };
    let psnr = if d2 == 0.0 { f64::INFINITY } else { 10.0 * (peak * peak * n / d2).log10() };
    Errors { rmse: (d2 / n).sqrt(), relative_rms, rel_mse: rel / n, max_abs: max, psnr, pixels }
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
    }

    #[test]
    fn equal_pictures_have_no_error() {
        let e = errors(&constant(0.0), &constant(0.0), |_| true);
        assert_eq!((e.rmse, e.relative_rms, e.rel_mse), (0.0, 0.0, 0.0));
        assert!(e.psnr.is_infinite());
        assert_eq!(errors(&constant(2.0), &constant(1.0), |i| i == 0).pixels, 1);
    }
}

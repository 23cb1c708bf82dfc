//! The error of a technique in one picture, as one sees it.

use steradian_render::{Film, errors};

/// Part of the silhouettes' error that counts as an error of the picture. With a fifth, gold of α = 0.1 in a
/// studio got a map with black rings (silhouettes off by 68 %) in place of one that blurs a reflection's edge
/// (12 %; a tenth of its other points by 61 %); with a half, yellow paint there got a blurred highlight in
/// place of a map with fine rings (63 %).
const SILHOUETTE_WEIGHT: f64 = 0.3;
/// Errors of single points count as this at most: black for grey is wrong, whatever the factor.
const MAX_POINT_ERROR: f64 = 0.5;

/// Where radiance is below this part of its median, errors of single points are relative to that part of the
/// median: two stops, below which displays show little. (The mean would be that of a sun's highlight.)
const DARK: f64 = 0.25;

/// Errors against the reference at a sample of a picture's points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureError {
    /// Relative RMS error, √ (Σ(a − b)² / Σ b²), which the brightest points rule.
    pub relative_rms: f64,
    /// Median over the points of the error relative to the point's own radiance, or to a quarter of the
    /// median radiance at darker points.
    pub median: f64,
    /// Ninth decile of the same.
    pub ninetieth: f64,
    /// Root mean square of the same, at most ½ each.
    pub bounded_rms: f64,
    /// Root mean square of such errors, at most 1 each, at points of the mesh that are seen from 80° to 89°
    /// off the normal; `None` where the camera sees no such points.
    pub silhouettes: Option<f64>,
}

impl PictureError {
    /// Of a film against the reference's at its whole pixels, and at silhouettes of radiance against the
    /// reference's; `None` where there are no such pixels.
    pub(crate) fn of(film: &Film, truth: &Film, silhouettes: Option<[&[[f32; 3]]; 2]>) -> Option<Self> {
        let whole = |i: usize| truth.alpha[i] > 0.999;
        let e = errors(film, truth, whole);
        if e.pixels == 0 || !e.relative_rms.is_finite() {
            return None;
        }
        let pixels = || (0..truth.len()).filter(|i| whole(*i));
        let mut sizes: Vec<f64> = pixels().map(|i| length(truth.pixel(i))).collect();
        sizes.sort_by(f64::total_cmp);
        let dark = DARK * sizes[sizes.len() / 2];
        let mut points: Vec<f64> = pixels().map(|i| relative(film.pixel(i), truth.pixel(i), dark)).collect();
        points.sort_by(f64::total_cmp);
        let rms = |of: &[f64], most: f64| {
            let squares = of.iter().map(|x| x.min(most).powi(2));
            (squares.sum::<f64>() / of.len().max(1) as f64).sqrt()
        };
        let silhouettes = silhouettes.map(|[got, truth]| {
            let all: Vec<f64> = got.iter().zip(truth).map(|(a, b)| relative(*a, *b, dark)).collect();
            rms(&all, 1.0)
        });
        Some(Self {
            relative_rms: e.relative_rms,
            median: points[points.len() / 2],
            ninetieth: points[9 * points.len() / 10],
            bounded_rms: rms(&points, MAX_POINT_ERROR),
            silhouettes,
        })
    }

    /// One number to compare techniques by: the largest of the relative RMS error, of that of single points,
    /// and of 0.3 of the silhouettes' error. The first alone overlooks all but the sun's highlight where
    /// there is one.
    pub fn apparent(&self) -> f64 {
        self.relative_rms.max(self.bounded_rms).max(SILHOUETTE_WEIGHT * self.silhouettes.unwrap_or(0.0))
    }
}

fn length(v: [f32; 3]) -> f64 {
    v.iter().map(|x| f64::from(*x).powi(2)).sum::<f64>().sqrt()
}

/// The difference of `a` from `b`, relative to `b` or to `dark`, whichever is larger.
fn relative(a: [f32; 3], b: [f32; 3], dark: f64) -> f64 {
    let off = length([0, 1, 2].map(|c| a[c] - b[c]));
    if off == 0.0 { 0.0 } else { off / length(b).max(dark) }
}

impl std::fmt::Display for PictureError {
    /// `3.10 % off in the median, 9.00 % and more in the worst tenth, 2.0 % at silhouettes (RMS 4.30 %)`
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let percent = |x: f64| 100.0 * x;
        write!(
            f,
            "{:.2} % off in the median, {:.2} % and more in the worst tenth",
            percent(self.median),
            percent(self.ninetieth)
        )?;
        if let Some(s) = self.silhouettes {
            write!(f, ", {:.1} % at silhouettes", percent(s))?;
        }
        write!(f, " (RMS {:.2} %)", percent(self.relative_rms))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(pixels: &[f32]) -> Film {
        let mut f = Film::new(pixels.len(), 1);
        f.rgb.iter_mut().for_each(|p| p.copy_from_slice(pixels));
        f.alpha.fill(1.0);
        f
    }

    /// A sun's highlight rules the RMS error, and neither it nor the dark rule the others.
    #[test]
    fn errors_are_those_that_one_sees() {
        let truth = film(&[1e6, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1e-3, 1e-3]);
        let got = film(&[1e6, 1.2, 1.2, 1.0, 1.0, 1.0, 1.0, 1.0, 1e-3, 3e-3]);
        let e = PictureError::of(&got, &truth, None).expect("pixels");
        assert!(e.relative_rms < 1e-6 && e.median == 0.0, "{e:?}");
        assert!((e.ninetieth - 0.2).abs() < 1e-6, "{e:?}");
        let single = ((0.2f64 * 0.2 * 2.0 + (2e-3f64 / 0.25).powi(2)) / 10.0).sqrt();
        assert!((e.apparent() - single).abs() < 1e-4, "{e:?}");
        let rim = |v: f32| vec![[v; 3]; 4];
        let e = PictureError::of(&truth, &truth, Some([&rim(9.0), &rim(1.0)])).expect("pixels");
        assert_eq!((e.silhouettes, e.apparent()), (Some(1.0), SILHOUETTE_WEIGHT));
        assert_eq!(PictureError::of(&Film::new(1, 1), &Film::new(1, 1), None), None);
    }
}

//! The error of a technique in one picture, as one sees it.

/// Part of the silhouettes' error that counts as an error of the picture: a silhouette is a line, which shows
/// rings and specks from errors of a quarter on, where areas show errors of a twentieth.
const SILHOUETTES: f64 = 0.2;

/// Errors against the reference at a sample of a picture's points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PictureError {
    /// Relative RMS error, √ (Σ(a − b)² / Σ b²), which the brightest points rule.
    pub relative_rms: f64,
    /// Median over the points of the error relative to the point's own radiance.
    pub median: f64,
    /// Ninth decile of the same.
    pub ninetieth: f64,
    /// Root mean square, at points of the mesh seen from 80° to 89° off the normal, of the error relative to
    /// the point's own radiance, at most 1 each; `None` where the camera sees no such points.
    pub silhouettes: Option<f64>,
}

impl PictureError {
    /// One number to compare techniques by: the largest of the RMS error, the ninth decile, and a fifth of the
    /// silhouettes' error. The RMS error alone overlooks all but the sun's highlight where there is one.
    pub fn apparent(&self) -> f64 {
        self.relative_rms.max(self.ninetieth).max(SILHOUETTES * self.silhouettes.unwrap_or(0.0))
    }
}

impl std::fmt::Display for PictureError {
    /// `3.1 % off in the median, 9.0 % in the worst tenth, 4.3 % by RMS`
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

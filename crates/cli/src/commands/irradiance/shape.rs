//! What is done to coefficients: windows, deringing, and their short form ZH3.

use crate::commands::irradiance::rows;
use crate::inputs;
use serde_json::{Value, json};
use steradian_base::unknown;
use steradian_sphere::sh::{Dering, ShRgb, Window, Zh3};

/// A window as a user names it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowSpec {
    kind: &'static str,
    width: Option<f64>,
}

const WINDOWS: [&str; 4] = ["none", "hann", "lanczos", "gauss"];

impl WindowSpec {
    /// `hann`, or `hann:6` with a width in bands.
    pub fn parse(text: &str) -> Result<Self, String> {
        let (name, width) = text.split_once(':').map_or((text, None), |(n, w)| (n, Some(w)));
        let name = if name == "hanning" { "hann" } else { name };
        let found = WINDOWS.into_iter().find(|w| *w == name);
        let kind = found.ok_or_else(|| unknown("window", name, &WINDOWS))?;
        let width = width.map(inputs::positive).transpose()?;
        if kind == "none" && width.is_some() {
            return Err("the window none has no width".into());
        }
        Ok(Self { kind, width })
    }

    /// For coefficients of `bands` bands. Hann's and Lanczos' windows end at the first band that is not there, that of
    /// Gauss has half the bands for its standard deviation.
    pub fn window(self, bands: usize) -> Window {
        let width = |usual: f64| self.width.unwrap_or(usual);
        match self.kind {
            "hann" => Window::Hanning { width: width(bands as f64) },
            "lanczos" => Window::Lanczos { width: width(bands as f64) },
            "gauss" => Window::Gauss { width: width(0.5 * bands as f64) },
            _ => Window::Box,
        }
    }
}

/// For the report.
pub fn dering_json(d: &Dering) -> Value {
    let bands: Vec<[f64; 3]> =
        (0..d.factors[0].len()).map(|l| std::array::from_fn(|c| d.factors[c][l])).collect();
    json!({"factors": bands, "change": d.change, "least_change": d.least, "minimum": d.minimum})
}

/// The bands up to `order`; those that are not there are 0.
pub fn truncated(sh: &ShRgb, order: usize) -> ShRgb {
    let mut out = ShRgb::zero(order);
    for (to, from) in out.c.iter_mut().zip(&sh.c) {
        to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
    }
    out
}

/// The band to which ZH3's errors are measured; what follows changes irradiance by less than 0.2 % of a lone sun's.
pub const ZH3_ORDER: usize = 8;

/// ZH3 of radiance up to [`ZH3_ORDER`] at least, both ways, and what they and plain coefficients miss.
pub fn zh3_json(radiance: &ShRgb) -> Value {
    let (stored, guessed) = (Zh3::project(radiance), Zh3::hallucinate(radiance));
    json!({
        "axis": stored.axis.to_array(),
        "linear": rows(&stored.linear),
        "stored": stored.zonal,
        "hallucinated": guessed.zonal,
        "irradiance_error": {
            "linear": error(radiance, &stored.linear),
            "hallucinated": error(radiance, &guessed.quadratic()),
            "stored": error(radiance, &stored.quadratic()),
            "quadratic": error(radiance, &truncated(radiance, 2)),
        },
    })
}

/// Root mean square over normals of the difference of irradiances, over that of the irradiance (Parseval).
fn error(radiance: &ShRgb, short: &ShRgb) -> f64 {
    let k = steradian_session::cosine(ZH3_ORDER + 1);
    let (a, b) = (truncated(radiance, ZH3_ORDER), truncated(short, ZH3_ORDER));
    let (mut sum, mut all) = (0.0, 0.0);
    for (a, b) in a.c.iter().zip(&b.c) {
        for (i, (a, b)) in a.iter().zip(b).enumerate() {
            let k = k[i.isqrt()];
            sum += (k * (a - b)).powi(2);
            all += (k * a).powi(2);
        }
    }
    if all > 0.0 { (sum / all).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn windows_are_read() {
        assert_eq!(WindowSpec::parse("hann").unwrap().window(5), Window::Hanning { width: 5.0 });
        assert_eq!(WindowSpec::parse("lanczos:7.5").unwrap().window(5), Window::Lanczos { width: 7.5 });
        assert_eq!(WindowSpec::parse("gauss").unwrap().window(6), Window::Gauss { width: 3.0 });
        assert_eq!(WindowSpec::parse("none").unwrap().window(6), Window::Box);
        assert!(WindowSpec::parse("han").unwrap_err().contains("hann"));
        assert!(WindowSpec::parse("hann:0").is_err() && WindowSpec::parse("none:3").is_err());
    }

    /// A lone sun: linear coefficients miss much, the short forms little of what nine coefficients have.
    #[test]
    fn short_forms_lie_between_linear_and_quadratic() {
        let mut sh = ShRgb::zero(ZH3_ORDER);
        sh.add_lobe(&[1.0; ZH3_ORDER + 1], glam::DVec3::new(0.6, 0.0, 0.8), [1.0; 3]);
        sh.c.iter_mut().for_each(|c| c[0] += 0.5);
        let report = zh3_json(&sh);
        let e = |name: &str| report["irradiance_error"][name].as_f64().unwrap();
        assert!((e("stored") - e("quadratic")).abs() < 1e-12);
        assert!(e("stored") < e("hallucinated") && e("hallucinated") < e("linear"), "{report}");
    }
}

//! Spherical harmonic coefficients of a light's radiance and irradiance: windows, deringing, and their short
//! form ZH3.

use crate::{Adjust, Error, Session, cosine};
use serde_json::{Value, json};
use steradian_base::unknown;
use steradian_sphere::sh::{Dering, ShRgb, Window, Zh3};

/// Request for irradiance coefficients.
#[derive(Debug, Clone)]
pub struct Request {
    /// Light: an image, or a sky spec.
    pub environment: String,
    /// How the light is read, rotated and scaled.
    pub adjust: Adjust,
    /// Bands: 3 are orders 0 to 2, 9 coefficients.
    pub bands: usize,
    /// Window over them.
    pub window: Option<WindowSpec>,
    /// Are coefficients changed, as little as possible, such that the irradiance is nowhere negative?
    pub dering: bool,
    /// Is ZH3 added: linear coefficients and one zonal number a channel?
    pub zh3: bool,
}

/// Coefficients of radiance and irradiance.
#[derive(Debug, Clone)]
pub struct Coefficients {
    /// Coefficients of radiance, after window and deringing.
    pub radiance: ShRgb,
    /// Coefficients of irradiance in W m⁻² (no 1/π).
    pub irradiance: ShRgb,
    /// Factors of the window, band by band.
    pub window: Option<Vec<f64>>,
    /// Changes made by deringing.
    pub dering: Option<Dering>,
    /// ZH3, stored and hallucinated, and its errors.
    zh3: Option<Value>,
}

impl Session {
    /// Coefficients of a light as [`Session::light`] takes it.
    pub fn irradiance(&mut self, r: &Request) -> Result<Coefficients, Error> {
        let order = r.bands - 1;
        let most = if r.zh3 { ZH3_ORDER.max(order) } else { order };
        let light = self.light_coefficients(&r.environment, &r.adjust, most)?;
        let zh3 = r.zh3.then(|| zh3_json(&light));
        let mut radiance = truncated(&light, order);
        let window = r.window.map(|w| w.window(r.bands));
        if let Some(w) = window {
            radiance.window(w);
        }
        let cosine = cosine(r.bands);
        let dering = r.dering.then(|| radiance.dering(&cosine));
        let mut irradiance = radiance.clone();
        irradiance.convolve(&cosine);
        Ok(Coefficients { radiance, irradiance, window: window.map(|w| w.factors(order)), dering, zh3 })
    }
}

impl Coefficients {
    /// The coefficients as JSON.
    pub fn document(&self) -> Value {
        let radiance = rows(&self.radiance);
        let bands = radiance.len().isqrt();
        let mut document = json!({
            "bands": bands,
            "order": bands - 1,
            "radiance": radiance,
            "irradiance": rows(&self.irradiance),
        });
        if let Some(w) = &self.window {
            document["window"] = json!(w);
        }
        if let Some(d) = &self.dering {
            document["dering"] = dering_json(d);
        }
        if let Some(z) = &self.zh3 {
            document["zh3"] = z.clone();
        }
        document
    }

    /// The coefficients as comma-separated text, one a line.
    pub fn table(&self) -> String {
        let mut out =
            String::from("l,m,radiance_r,radiance_g,radiance_b,irradiance_r,irradiance_g,irradiance_b\n");
        let all = rows(&self.radiance).into_iter().zip(rows(&self.irradiance)).enumerate();
        for (i, (a, b)) in all {
            let l = i.isqrt();
            let m = i as i64 - (l * l + l) as i64;
            let numbers: Vec<String> = a.iter().chain(&b).map(|v| format!("{v:.9}")).collect();
            out.push_str(&format!("{l},{m},{}\n", numbers.join(",")));
        }
        out
    }
}

fn rows(sh: &ShRgb) -> Vec<[f64; 3]> {
    (0..sh.c[0].len()).map(|i| std::array::from_fn(|k| sh.c[k][i])).collect()
}

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
        let width = width.map(positive).transpose()?;
        if kind == "none" && width.is_some() {
            return Err("the window none has no width".into());
        }
        Ok(Self { kind, width })
    }

    /// For coefficients of `bands` bands. Hann's and Lanczos' windows fall to 0 at band `bands`; the standard
    /// deviation of Gauss' window is half of `bands`.
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

fn positive(text: &str) -> Result<f64, String> {
    let finite = text.parse::<f64>().ok().filter(|v| v.is_finite());
    let v = finite.ok_or_else(|| format!("'{text}' is not a finite number"))?;
    if v > 0.0 { Ok(v) } else { Err(format!("'{text}' is not positive")) }
}

fn dering_json(d: &Dering) -> Value {
    let bands: Vec<[f64; 3]> =
        (0..d.factors[0].len()).map(|l| std::array::from_fn(|c| d.factors[c][l])).collect();
    json!({"factors": bands, "change": d.change, "least_change": d.least, "minimum": d.minimum})
}

/// The bands up to `order`; missing ones are 0.
fn truncated(sh: &ShRgb, order: usize) -> ShRgb {
    let mut out = ShRgb::zero(order);
    for (to, from) in out.c.iter_mut().zip(&sh.c) {
        to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
    }
    out
}

/// Highest band considered in ZH3's errors; higher ones change irradiance by less than 0.2 % of a lone sun's.
const ZH3_ORDER: usize = 8;

/// ZH3 of radiance up to [`ZH3_ORDER`] at least, stored and hallucinated, with its errors and those of plain
/// coefficients.
fn zh3_json(radiance: &ShRgb) -> Value {
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
    let k = cosine(ZH3_ORDER + 1);
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

    /// A lone sun: linear coefficients miss much of the irradiance, the short forms little compared with nine
    /// coefficients.
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

//! Polar plots of a reflectance, as SVG.

use crate::{Brdf, Domain, Lobe};
use glam::DVec3;
use std::f64::consts::PI;
use std::fmt::Write;

/// Options of a plot.
#[derive(Debug, Clone)]
pub struct PlotOptions {
    /// Polar angles of wo in degrees, at most five.
    pub views: Vec<f64>,
    /// Radius by the logarithm (three decades), else linear.
    pub log: bool,
    /// Azimuth of the plane of incidence from the tangent, in degrees.
    pub azimuth: f64,
}

impl Default for PlotOptions {
    fn default() -> Self {
        Self { views: vec![0.0, 30.0, 60.0, 85.0], log: false, azimuth: 0.0 }
    }
}

const COLOURS: [&str; 5] = ["#3b6fb6", "#d1722f", "#3f9151", "#b5397e", "#6a5d4d"];
const RADIUS: f64 = 270.0;
const WIDTH: f64 = 660.0;
const DECADES: f64 = 3.0;

/// f · n·wi (the mean of the channels) in the plane of incidence, one closed curve per view, all on one
/// scale. The dashed line of a view's colour points to wo. The source is cited below the title.
pub fn polar_svg(brdf: &dyn Brdf, options: &PlotOptions) -> String {
    let plane = Plane::new(options.azimuth);
    let curves: Vec<Vec<(f64, f64)>> = options.views.iter().map(|v| plane.curve(brdf, *v)).collect();
    let peak = curves.iter().flatten().map(|p| p.1).fold(0.0, f64::max);
    let full = brdf.domain() == Domain::Sphere;
    let mut plot = Plot { svg: String::new(), peak, log: options.log, full };
    plot.open(brdf);
    plot.grid();
    for (i, (curve, view)) in curves.iter().zip(&options.views).enumerate() {
        plot.curve(curve, *view, i);
    }
    plot.legend(&curves, &options.views);
    plot.svg.push_str("</svg>\n");
    plot.svg
}

/// The plane of incidence: θ > 0 on the side of the mirror direction.
struct Plane {
    forward: DVec3,
}

impl Plane {
    fn new(azimuth: f64) -> Self {
        let (s, c) = azimuth.to_radians().sin_cos();
        Self { forward: DVec3::new(c, s, 0.0) }
    }

    fn direction(&self, theta: f64) -> DVec3 {
        self.forward * theta.sin() + DVec3::Z * theta.cos()
    }

    /// (θ, value) in ascending θ, dense near the model's peaks.
    fn curve(&self, brdf: &dyn Brdf, view: f64) -> Vec<(f64, f64)> {
        let wo = self.direction(-view.to_radians());
        let end = if brdf.domain() == Domain::Sphere { PI } else { 0.5 * PI };
        let mut thetas: Vec<f64> = (0..=720).map(|i| end * (f64::from(i) / 360.0 - 1.0)).collect();
        for (theta, width) in brdf.lobes(wo).into_iter().flat_map(|l| self.peaks(l)) {
            thetas.extend((-60..=60).map(|i| theta + 0.1 * width * f64::from(i)));
        }
        thetas.retain(|t| t.abs() <= end);
        thetas.sort_by(f64::total_cmp);
        let value = |t: f64| brdf.f_cos(self.direction(t), wo).iter().sum::<f64>() / 3.0;
        thetas.into_iter().map(|t| (t, value(t))).filter(|p| p.1.is_finite()).collect()
    }

    /// Where a hint meets the plane.
    fn peaks(&self, lobe: Lobe) -> Vec<(f64, f64)> {
        let angle = |a: DVec3| a.dot(self.forward).atan2(a.z);
        match lobe {
            Lobe::Axis { axis, width } => vec![(angle(axis), width)],
            Lobe::Cone { axis, cosine, width } => {
                let reach = axis.dot(self.forward).hypot(axis.z);
                let half =
                    if reach > 1e-9 { (cosine / reach).clamp(-1.0, 1.0).acos() } else { return Vec::new() };
                vec![(angle(axis) + half, width), (angle(axis) - half, width)]
            }
            Lobe::Arc { normal, width } => {
                let middle = angle(normal);
                vec![(middle + 0.5 * PI, width), (middle - 0.5 * PI, width)]
            }
        }
    }
}

struct Plot {
    svg: String,
    peak: f64,
    log: bool,
    full: bool,
}

/// Text that is safe inside SVG and HTML.
fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Three significant digits.
fn short(x: f64) -> String {
    let digits = 2 - x.abs().max(1e-300).log10().floor() as i32;
    match digits {
        0..=4 => format!("{x:.*}", digits as usize),
        -2..0 => format!("{x:.0}"),
        _ => format!("{x:.2e}"),
    }
}

/// Lines of at most `width` characters.
fn wrap(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.len() - 1;
        if !lines[last].is_empty() && lines[last].chars().count() + word.chars().count() >= width {
            lines.push(word.to_owned());
        } else {
            let space = if lines[last].is_empty() { "" } else { " " };
            lines[last] = format!("{}{space}{word}", lines[last]);
        }
    }
    lines
}

impl Plot {
    fn height(&self) -> f64 {
        if self.full { 760.0 } else { 480.0 }
    }

    fn centre(&self) -> (f64, f64) {
        (0.5 * WIDTH, 120.0 + RADIUS)
    }

    fn add(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a String cannot fail.
        let _ = self.svg.write_fmt(text);
        self.svg.push('\n');
    }

    fn open(&mut self, brdf: &dyn Brdf) {
        let h = self.height();
        self.add(format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {h}\" width=\"{WIDTH}\" height=\"{h}\" \
             font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#333\">"
        ));
        self.add(format_args!("<rect width=\"{WIDTH}\" height=\"{h}\" fill=\"#fff\"/>"));
        let title = escape(&brdf.spec());
        self.add(format_args!(
            "<text x=\"20\" y=\"28\" font-size=\"16\" font-weight=\"bold\">{title}</text>"
        ));
        let lines = wrap(brdf.info().source, 105);
        for (i, line) in lines.iter().take(2).enumerate() {
            let y = 46 + 14 * i;
            self.add(format_args!(
                "<text x=\"20\" y=\"{y}\" font-size=\"11\" fill=\"#777\">{}</text>",
                escape(line)
            ));
        }
        let scale = if self.log { ", logarithmic radius" } else { "" };
        let y = 46 + 14 * lines.len().min(2);
        self.add(format_args!(
            "<text x=\"20\" y=\"{y}\" font-size=\"11\" fill=\"#777\">f · n·wi in sr⁻¹ in the plane of incidence, mean of r, g, b{scale}</text>"
        ));
    }

    /// The radius of a value, 0 … 1.
    fn radius(&self, value: f64) -> f64 {
        let x = if self.peak > 0.0 { (value / self.peak).max(0.0) } else { 0.0 };
        if self.log { (1.0 + x.max(1e-30).log10() / DECADES).max(0.0) } else { x }
    }

    fn point(&self, theta: f64, r: f64) -> (f64, f64) {
        let (x, y) = self.centre();
        (x + RADIUS * r * theta.sin(), y - RADIUS * r * theta.cos())
    }

    fn grid(&mut self) {
        let (cx, cy) = self.centre();
        for i in 1..=4 {
            let share = if self.log && i < 4 { 10f64.powi(i - 4) } else { f64::from(i) / 4.0 };
            if self.log && i == 1 {
                continue;
            }
            let r = RADIUS * self.radius(share * self.peak).max(0.0);
            let (x0, x1) = (cx - r, cx + r);
            self.add(format_args!(
                "<path d=\"M{x0:.1},{cy:.1} A{r:.1},{r:.1} 0 0 1 {x1:.1},{cy:.1}\" fill=\"none\" stroke=\"#ddd\"/>"
            ));
            if self.full {
                self.add(format_args!(
                    "<path d=\"M{x0:.1},{cy:.1} A{r:.1},{r:.1} 0 0 0 {x1:.1},{cy:.1}\" fill=\"none\" stroke=\"#eee\"/>"
                ));
            }
            let label = short(share * self.peak);
            let y = cy + 14.0;
            self.add(format_args!(
                "<text x=\"{x1:.1}\" y=\"{y:.1}\" font-size=\"10\" text-anchor=\"middle\" fill=\"#777\">{label}</text>"
            ));
        }
        for degrees in [-90, -60, -30, 0, 30, 60, 90] {
            let theta = f64::from(degrees).to_radians();
            let ((x, y), (tx, ty)) = (self.point(theta, 1.0), self.point(theta, 1.05));
            self.add(format_args!(
                "<line x1=\"{cx:.1}\" y1=\"{cy:.1}\" x2=\"{x:.1}\" y2=\"{y:.1}\" stroke=\"#ddd\"/>"
            ));
            let ty = ty + 4.0;
            self.add(format_args!(
                "<text x=\"{tx:.1}\" y=\"{ty:.1}\" font-size=\"10\" text-anchor=\"middle\" fill=\"#777\">{degrees}°</text>"
            ));
        }
    }

    fn curve(&mut self, curve: &[(f64, f64)], view: f64, i: usize) {
        let colour = COLOURS[i % COLOURS.len()];
        let (cx, cy) = self.centre();
        let mut path = if self.full { String::new() } else { format!("M{cx:.1},{cy:.1}") };
        for (theta, value) in curve {
            let (x, y) = self.point(*theta, self.radius(*value));
            let _ = write!(path, "{}{x:.1},{y:.1}", if path.is_empty() { "M" } else { " L" });
        }
        self.add(format_args!(
            "<path d=\"{path} Z\" fill=\"{colour}\" fill-opacity=\"0.08\" stroke=\"{colour}\" stroke-width=\"1.8\"/>"
        ));
        let (x, y) = self.point(-view.to_radians(), 1.0);
        self.add(format_args!(
            "<line x1=\"{cx:.1}\" y1=\"{cy:.1}\" x2=\"{x:.1}\" y2=\"{y:.1}\" stroke=\"{colour}\" stroke-dasharray=\"4 4\" stroke-opacity=\"0.6\"/>"
        ));
    }

    fn legend(&mut self, curves: &[Vec<(f64, f64)>], views: &[f64]) {
        let y = self.height() - 22.0;
        for (i, (curve, view)) in curves.iter().zip(views).enumerate() {
            let x = 20.0 + 160.0 * i as f64;
            let colour = COLOURS[i % COLOURS.len()];
            let peak = short(curve.iter().map(|p| p.1).fold(0.0, f64::max));
            let (box_y, text_x) = (y - 9.0, x + 16.0);
            self.add(format_args!(
                "<rect x=\"{x}\" y=\"{box_y}\" width=\"10\" height=\"10\" fill=\"{colour}\"/>"
            ));
            self.add(format_args!(
                "<text x=\"{text_x}\" y=\"{y}\" font-size=\"11\">θ_o = {view}°, peak {peak}</text>"
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plots_name_their_source_and_every_view() {
        for spec in ["ggx:alpha=0.3", "phong-map:n=20", "ward:ax=0.01,ay=0.3", "banks:n=9", "lafortune:@skin"]
        {
            for log in [false, true] {
                let brdf = crate::parse(spec).expect(spec);
                let svg = polar_svg(&*brdf, &PlotOptions { log, ..PlotOptions::default() });
                assert!(svg.starts_with("<svg") && svg.ends_with("</svg>\n"));
                assert!(!svg.contains("NaN") && !svg.contains("inf"), "{spec}");
                assert!(svg.contains(&escape(&brdf.spec())) && svg.contains("θ_o = 85°"));
                let source = brdf.info().source.split_whitespace().next().unwrap_or_default();
                assert!(svg.contains(source));
            }
        }
        assert_eq!(
            [0.125, 3.5551, 27.0, 12345.0, 0.0].map(short),
            ["0.125", "3.56", "27.0", "12345", "0.00e0"]
        );
        assert_eq!(escape("<a & \"b\">"), "&lt;a &amp; &quot;b&quot;&gt;");
    }
}

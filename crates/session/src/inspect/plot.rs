//! Polar plots of a reflectance in the plane of incidence.

use glam::DVec3;
use steradian_brdf::Brdf;
use steradian_render::plot::{Anchor, Drawing, Mark};

/// View angles of the curves, degrees, and their colours.
const CURVES: [(f64, [u8; 3]); 4] =
    [(0.0, [68, 119, 170]), (30.0, [34, 136, 51]), (60.0, [204, 140, 20]), (80.0, [204, 51, 85])];
const WIDTH: f64 = 880.0;
const HEIGHT: f64 = 520.0;
const CENTRE: (f64, f64) = (440.0, 440.0);
const RADIUS: f64 = 380.0;
const INK: [u8; 3] = [60, 62, 66];
const FAINT: [u8; 3] = [208, 210, 214];

/// f · cos against the direction of light for four views, each curve scaled to its peak.
pub fn polar_plot(brdf: &dyn Brdf) -> Drawing {
    Drawing { marks: marks(brdf), ..Drawing::new(WIDTH as usize, HEIGHT as usize) }
}

fn text(at: (f64, f64), text: impl Into<String>, colour: [u8; 3]) -> Mark {
    Mark::Text { at, text: text.into(), size: 14.0, colour, anchor: Anchor::Start }
}

/// Luminance of f·cos for light from `degrees` in the plane of incidence, positive on the mirror side.
fn value(brdf: &dyn Brdf, degrees: f64, wo: DVec3) -> f64 {
    let t = degrees.to_radians();
    let [r, g, b] = brdf.f_cos(DVec3::new(-t.sin(), 0.0, t.cos()), wo);
    let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    if y.is_finite() { y.max(0.0) } else { 0.0 }
}

fn marks(brdf: &dyn Brdf) -> Vec<Mark> {
    const STEPS: usize = 1440;
    let curves: Vec<Vec<f64>> = CURVES
        .iter()
        .map(|(view, _)| {
            let t = view.to_radians();
            let wo = DVec3::new(t.sin(), 0.0, t.cos());
            (0..=STEPS).map(|i| value(brdf, -90.0 + 180.0 * i as f64 / STEPS as f64, wo)).collect()
        })
        .collect();
    let mut out = axes();
    for (values, (view, colour)) in curves.iter().zip(CURVES) {
        let peak = values.iter().copied().fold(0.0, f64::max);
        let scale = if peak > 0.0 { RADIUS / peak } else { 0.0 };
        let point = |(i, v): (usize, &f64)| polar(-90.0 + 180.0 * i as f64 / STEPS as f64, v * scale);
        out.push(Mark::Line { points: values.iter().enumerate().map(point).collect(), colour, width: 2.0 });
        let y = 22.0 + 20.0 * (view / 30.0).round();
        let text = format!("view {view}°, peak {peak:.4} sr-1");
        out.push(self::text((WIDTH - 210.0, y), text, colour));
    }
    out.push(text((16.0, 22.0), shortened(&brdf.spec()), INK));
    let note = "f cos against the direction of light, each curve scaled to its peak";
    out.push(text((16.0, HEIGHT - 22.0), note, INK));
    out
}

fn shortened(text: &str) -> String {
    let short: String = text.chars().take(60).collect();
    if short.len() < text.len() { short + "..." } else { short }
}

fn polar(degrees: f64, r: f64) -> (f64, f64) {
    let t = degrees.to_radians();
    (CENTRE.0 + r * t.sin(), CENTRE.1 - r * t.cos())
}

fn axes() -> Vec<Mark> {
    let line = |points| Mark::Line { points, colour: FAINT, width: 1.0 };
    let mut out: Vec<Mark> = [0.5, 1.0]
        .iter()
        .map(|k| line((-90..=90).map(|d| polar(f64::from(d), k * RADIUS)).collect()))
        .collect();
    for degrees in (-90..=90).step_by(30) {
        let d = f64::from(degrees);
        out.push(line(vec![CENTRE, polar(d, RADIUS)]));
        let (x, y) = polar(d, RADIUS + 18.0);
        out.push(text((x - 10.0, y - 4.0), format!("{degrees}°"), INK));
    }
    out
}

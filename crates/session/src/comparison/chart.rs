//! Results of a sweep as a chart: error, bytes and time of baking against the parameter, a line per technique
//! and light.

use super::{Finding, Sweep};
use crate::compare::Rendering;
use steradian_render::plot::{Anchor, Drawing, Mark};

const PANEL: (f64, f64) = (300.0, 260.0);
const LEFT: f64 = 62.0;
const TOP: f64 = 46.0;
const GAP: f64 = 78.0;
const ROW: f64 = 18.0;
const INK: [u8; 3] = [60, 62, 66];
const FAINT: [u8; 3] = [222, 224, 228];
/// Paul Tol's bright scheme and darker variants, distinguishable with colour blindness.
const COLOURS: [[u8; 3]; 10] = [
    [68, 119, 170],
    [238, 102, 119],
    [34, 136, 51],
    [204, 187, 68],
    [102, 204, 238],
    [170, 51, 119],
    [140, 140, 140],
    [34, 34, 85],
    [153, 85, 0],
    [0, 102, 102],
];

/// A quantity of the chart.
struct Quantity {
    name: &'static str,
    value: fn(&Rendering) -> Option<f64>,
}

const QUANTITIES: [Quantity; 3] = [
    Quantity { name: "relative RMS error", value: |r| Some(r.errors.as_ref()?.0.relative_rms) },
    Quantity { name: "bytes", value: |r| Some(r.bytes as f64) },
    Quantity { name: "seconds of baking", value: |r| Some(r.bake_seconds) },
];

/// Points of one technique under one light.
type Points = Vec<(f64, f64)>;

/// Map from values to pixels.
struct Axis {
    low: f64,
    high: f64,
    log: bool,
}

impl Axis {
    /// An axis that holds all values; a logarithmic one spans whole powers of ten.
    fn of(values: impl Iterator<Item = f64>, log: bool) -> Self {
        let kept = values.filter(|v| v.is_finite() && (!log || *v > 0.0));
        let (low, high) = kept.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let (low, high) = if low <= high { (low, high) } else { (1.0, 10.0) };
        if log {
            let (low, high) = (10f64.powf(low.log10().floor()), 10f64.powf(high.log10().ceil()));
            return Self { low, high: if high > low { high } else { 10.0 * low }, log };
        }
        let high = if high > low { high } else { low + 1.0 };
        Self { low, high, log }
    }

    /// Position of a value on the axis, 0 … 1.
    fn place(&self, v: f64) -> f64 {
        if self.log {
            (v / self.low).log10() / (self.high / self.low).log10()
        } else {
            (v - self.low) / (self.high - self.low)
        }
    }

    fn ticks(&self) -> Vec<f64> {
        if self.log {
            let decades = (self.high / self.low).log10().round() as i32;
            let step = (decades / 6).max(1);
            return (0..=decades).step_by(step as usize).map(|k| self.low * 10f64.powi(k)).collect();
        }
        (0..=4).map(|k| self.low + (self.high - self.low) * f64::from(k) / 4.0).collect()
    }
}

fn number(v: f64) -> String {
    if v == 0.0 || (1e-3..1e4).contains(&v.abs()) {
        let text = format!("{v:.4}");
        return text.trim_end_matches('0').trim_end_matches('.').into();
    }
    format!("{v:.0e}")
}

/// The chart.
pub fn drawing(findings: &[Finding], sweep: &Sweep) -> Drawing {
    let series = series(findings);
    let width = LEFT + 3.0 * PANEL.0 + 2.0 * GAP + 24.0;
    let legend = legend(&series, width - LEFT);
    let rows = legend.iter().map(|e| e.1 + 1).max().unwrap_or(0);
    let height = TOP + PANEL.1 + LEGEND + ROW * rows as f64 + 12.0;
    let mut page = Drawing::new(width as usize, height as usize);
    for (k, q) in QUANTITIES.iter().enumerate() {
        let lines: Vec<Points> = series.iter().map(|(_, s)| points(s, q)).collect();
        panel(&mut page, LEFT + k as f64 * (PANEL.0 + GAP), q.name, sweep, &lines);
    }
    let top = TOP + PANEL.1 + LEGEND;
    if let Some(first) = legend.first() {
        let rule = vec![(LEFT, top - 20.0), (width - 24.0, top - 20.0)];
        page.marks.push(Mark::Line { points: rule, colour: FAINT, width: 1.0 });
        text(&mut page, (first.0 - TITLE, top - 5.0), "all charts:".into(), Anchor::Start, INK);
    }
    for (k, ((name, _), (x, row))) in series.iter().zip(&legend).enumerate() {
        let (x, y) = (*x, top + *row as f64 * ROW);
        let colour = COLOURS[k % COLOURS.len()];
        page.marks.push(Mark::Line { points: vec![(x, y), (x + 22.0, y)], colour, width: 2.5 });
        text(&mut page, (x + 30.0, y - 5.0), name.clone(), Anchor::Start, INK);
    }
    page
}

/// Width of a letter of the legend, about.
const LETTER: f64 = 6.8;
/// Room for the legend's heading.
const TITLE: f64 = 76.0;
/// From the charts to the first row of the legend.
const LEGEND: f64 = 72.0;

/// The places of the entries of one legend for all charts, from left to right: their x and row. They stand
/// close together, so that none is below a chart as if it were that one's.
fn legend(series: &Series<'_>, width: f64) -> Vec<(f64, usize)> {
    let (left, mut x, mut row) = (LEFT + TITLE, LEFT + TITLE, 0);
    let mut out = Vec::with_capacity(series.len());
    for (name, _) in series {
        let wide = 30.0 + LETTER * name.chars().count() as f64 + 26.0;
        if x > left && x + wide > width {
            (x, row) = (left, row + 1);
        }
        out.push((x, row));
        x += wide;
    }
    out
}

/// A technique under a light, with its result at each value.
type Series<'a> = Vec<(String, Vec<(f64, &'a Rendering)>)>;

fn series(findings: &[Finding]) -> Series<'_> {
    let one_light = findings.iter().all(|f| f.environment == findings[0].environment);
    let one_base = findings.iter().all(|f| f.base == findings[0].base);
    let mut out: Series<'_> = Vec::new();
    for f in findings {
        for a in &f.answers {
            let (Some(r), Some(x)) = (a.rendering().filter(|r| r.errors.is_some()), f.value) else {
                continue;
            };
            let mut name = a.name().replace('_', " ");
            if !one_light {
                name += &format!(", {}", f.environment);
            }
            if !one_base {
                name += &format!(", {}", f.base);
            }
            match out.iter_mut().find(|s| s.0 == name) {
                Some(s) => s.1.push((x, r)),
                None => out.push((name, vec![(x, r)])),
            }
        }
    }
    out
}

fn points(series: &[(f64, &Rendering)], q: &Quantity) -> Points {
    let all = series.iter().filter_map(|(x, r)| Some((*x, (q.value)(r)?)));
    all.filter(|(_, y)| *y > 0.0 && y.is_finite()).collect()
}

fn text(page: &mut Drawing, at: (f64, f64), text: String, anchor: Anchor, colour: [u8; 3]) {
    page.marks.push(Mark::Text { at, text, size: 12.0, colour, anchor });
}

fn panel(page: &mut Drawing, left: f64, name: &str, sweep: &Sweep, lines: &[Points]) {
    let x = Axis::of(sweep.values.iter().copied(), sweep.log);
    let y = Axis::of(lines.iter().flatten().map(|p| p.1), true);
    let at = |(a, b): (f64, f64)| (left + PANEL.0 * x.place(a), TOP + PANEL.1 * (1.0 - y.place(b)));
    let line = |points, colour, width| Mark::Line { points, colour, width };
    for t in y.ticks() {
        let p = at((x.low, t));
        page.marks.push(line(vec![p, (left + PANEL.0, p.1)], FAINT, 1.0));
        text(page, (left - 8.0, p.1 - 4.0), number(t), Anchor::End, INK);
    }
    for t in x.ticks() {
        let p = at((t, y.low));
        page.marks.push(line(vec![(p.0, TOP), p], FAINT, 1.0));
        text(page, (p.0, p.1 + 9.0), number(t), Anchor::Middle, INK);
    }
    text(page, (left, TOP - 26.0), name.into(), Anchor::Start, INK);
    text(page, (left + 0.5 * PANEL.0, TOP + PANEL.1 + 28.0), sweep.key.clone(), Anchor::Middle, INK);
    for (k, points) in lines.iter().enumerate() {
        let colour = COLOURS[k % COLOURS.len()];
        let places: Vec<(f64, f64)> = points.iter().copied().map(at).collect();
        page.marks.extend(places.iter().map(|p| Mark::Dot { at: *p, colour, radius: 3.0 }));
        page.marks.push(line(places, colour, 2.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_legend_stands_below_all_charts() {
        let series = |names: &[&str]| -> Series<'static> {
            names.iter().map(|n| (n.to_string(), Vec::new())).collect()
        };
        let places = legend(&series(&["split sum", "lobe maps", "shrm"]), 1000.0);
        assert_eq!(places.iter().map(|p| p.1).collect::<Vec<_>>(), [0, 0, 0]);
        assert!(places[2].0 < LEFT + PANEL.0 + GAP, "close together: {places:?}");
        let long = "a technique of a long name, under a light of a long name".to_string();
        let places = legend(&series(&[&long, &long, &long]), 1100.0);
        assert_eq!(places.iter().map(|p| p.1).collect::<Vec<_>>(), [0, 0, 1]);
    }

    #[test]
    fn axes_hold_their_values() {
        let a = Axis::of([0.02, 0.3].into_iter(), true);
        assert!((a.low - 0.01).abs() < 1e-12 && (a.high - 1.0).abs() < 1e-12);
        assert!((a.place(0.1) - 0.5).abs() < 1e-12 && a.ticks().len() == 3);
        let a = Axis::of([2.0, 4.0].into_iter(), false);
        assert_eq!((a.place(3.0), a.ticks()), (0.5, vec![2.0, 2.5, 3.0, 3.5, 4.0]));
        // One value, and none.
        assert!(Axis::of([5.0].into_iter(), true).place(5.0).is_finite());
        assert!(Axis::of([].into_iter(), false).place(1.0).is_finite());
        assert_eq!([0.0, 0.25, 1e-5, 2e6].map(number), ["0", "0.25", "1e-5", "2e6"]);
    }
}

//! From levels to a report: correct levels are accepted at once, else hypotheses are compared.

mod bench;
mod decide;
mod hypotheses;

use crate::Input;
use crate::light::{Alteration, Prepared, READINGS, Reading, View};
use crate::measure;
use crate::model::{Hypothesis, List};
use crate::orientation::{self, Orientation};
use crate::report::{Encoding, Fault, Report};
use crate::samples::Samples;
use crate::scale::{Column, Form, Moments, Score};
use bench::Bench;
use glam::DMat3;
use std::collections::HashMap;
use steradian_base::{Cancelled, Task};

/// Levels with a smaller error are correct: the sums behind hypotheses have half of it.
const RIGHT: f64 = 4e-3;
/// Residuals below this count as equal.
const FLOOR: f64 = 4e-3;
/// Upper bound of the residual that counts as none, however uncertain the interpretation of texels is.
const MOST_OPEN: f64 = 0.01;

pub fn run(input: &Input<'_>, task: &Task) -> Result<Report, Cancelled> {
    task.begin("filtering", input.levels.len() as u64);
    let references = measure::filtered(input.lights, input.expected, input.levels, task)?;
    task.end();
    let bench = Bench::new(input, references);
    let off = |m: usize, small: f64| bench.straight[m] > small.hypot(1.3 * bench.rounding[m]);
    if (0..input.levels.len()).all(|m| !off(m, RIGHT)) {
        return Ok(bench.report(None, bench.marks.clone(), None));
    }
    if let Some(report) = bench.plain_texture() {
        return Ok(report);
    }
    if bench.other_light(task)? {
        // That texels are black, or clipped, is said of the light that the file was compared with.
        let damaged = bench.marks.iter().filter_map(|f| match f {
            &Fault::Damaged { level, invalid, .. } if invalid > 0 => {
                Some(Fault::Damaged { level, invalid, black: 0 })
            }
            _ => None,
        });
        let faults = [Fault::OtherLight].into_iter().chain(damaged).collect();
        return Ok(bench.report(None, faults, None));
    }
    let mut search = Search::new(&bench, task)?;
    search.all(task)?;
    task.end();
    search.decide(task)
}

/// All hypotheses, and their inputs.
struct Search<'a, 'b> {
    bench: &'b Bench<'a>,
    tried: Vec<Hypothesis>,
    /// Residuals below this count as equal: the uncertainty from the interpretation of texels and from the
    /// file's format.
    floor: f64,
    /// That uncertainty for each level.
    open: Vec<f64>,
    reading: Option<Reading>,
    /// The split sum's numbers by alpha.
    lobes: HashMap<u64, Option<[f64; 2]>>,
}

impl<'a, 'b> Search<'a, 'b> {
    fn new(bench: &'b Bench<'a>, task: &Task) -> Result<Self, Cancelled> {
        task.begin("comparing hypotheses", 3);
        let (n, expected) = (bench.input.levels.len(), bench.input.expected);
        let view =
            View::new(bench.input.levels, &bench.samples, expected, Orientation::Axes(DMat3::IDENTITY));
        let mut out = Self {
            bench,
            tried: Vec::new(),
            floor: FLOOR,
            open: vec![0.0; n],
            reading: None,
            lobes: HashMap::new(),
        };
        let own = |m: usize| -> Column {
            let at = |t: &(usize, usize, usize)| bench.references[m].texel(t.0, t.1, t.2).map(f64::from);
            bench.samples[m].texels.iter().map(at).collect()
        };
        let mut read: Vec<(Option<Reading>, Vec<Column>)> = vec![(None, (0..n).map(own).collect())];
        let plain = Alteration::None.of(bench.input.lights);
        for r in READINGS {
            let light = Prepared::new(&plain, r, &view, task)?;
            read.push((Some(r), light.columns(expected, &bench.samples)));
            if r == Reading::Cells {
                out.straight(&light, &view, task)?;
            }
        }
        task.advance(1);
        for m in 0..n {
            // Means over texels are one reading of an unfiltered level: the spread of all other readings
            // counts.
            let spans = read
                .iter()
                .flat_map(|(_, a)| read.iter().map(|(_, b)| apart(&bench.samples[m], &a[m], &b[m])));
            out.open[m] = spans.fold(0.0, f64::max).hypot(bench.rounding[m]);
        }
        // For an unfiltered level the reading that fits best is taken: it adds no uncertainty to the
        // remaining levels.
        let filtered = (0..n).filter(|&m| expected[m].zonal().is_some());
        let mean = filtered.map(|m| out.open[m].powi(2)).sum::<f64>() / n.max(1) as f64;
        out.floor = FLOOR.hypot(0.7 * mean.sqrt());
        let mut residuals = Vec::new();
        for (r, columns) in read {
            out.add(
                &view,
                &columns,
                expected.to_vec(),
                &List::Expected,
                Alteration::None,
                Encoding::Linear,
                0,
            );
            residuals.push((
                r,
                out.tried.iter().rev().take(30).map(|h| h.score.residual).fold(f64::INFINITY, f64::min),
            ));
        }
        residuals.sort_by(|a, b| a.1.total_cmp(&b.1));
        out.reading = residuals[0].0.filter(|_| residuals[1].1 > 2.0 * residuals[0].1.max(FLOOR));
        Ok(out)
    }

    /// Every hypothesis in addition to those of [`Search::straight`]: rotated levels, then altered light,
    /// unless something simpler explains everything.
    fn all(&mut self, task: &Task) -> Result<(), Cancelled> {
        let (levels, expected) = (self.bench.input.levels, self.bench.input.expected);
        let samples = &self.bench.samples;
        let mut views = vec![View::new(levels, samples, expected, Orientation::Axes(DMat3::IDENTITY))];
        let turns = if self.explained() { Vec::new() } else { self.turns() };
        for orientation in turns {
            let view = View::new(levels, samples, expected, self.refined(orientation, task)?);
            let lights = Alteration::None.of(self.bench.input.lights);
            let light = Prepared::new(&lights, Reading::Cells, &view, task)?;
            let columns = light.columns(expected, samples);
            self.add(
                &view,
                &columns,
                expected.to_vec(),
                &List::Expected,
                Alteration::None,
                Encoding::Linear,
                0,
            );
            if !self.explained() {
                self.straight(&light, &view, task)?;
            }
            views.push(view);
        }
        task.advance(1);
        for view in views {
            if !self.explained() {
                self.altered(&view, task)?;
            }
        }
        task.advance(1);
        Ok(())
    }

    /// Does a hypothesis of at most three free numbers explain all of the error?
    fn explained(&self) -> bool {
        let best = self.best();
        best.score.residual < 1.2 * self.floor.min(MOST_OPEN) && best.free <= 3
    }

    /// Turns that fit the levels clearly better than none does.
    fn turns(&self) -> Vec<Orientation> {
        let bench = self.bench;
        let pairs = || bench.input.levels.iter().zip(&bench.references);
        let mut found: Vec<Orientation> = Vec::new();
        for (l, r) in pairs() {
            let f = orientation::find(l, r);
            if f.certain && !f.orientation.is_identity() && !found.contains(&f.orientation) && found.len() < 4
            {
                found.push(f.orientation);
            }
        }
        let cubes = bench.input.levels.iter().all(|l| l.layout == steradian_sphere::Layout::Cube);
        found.retain(|t| cubes || !matches!(t, Orientation::Faces(_)));
        let misfit = |t: &Orientation| pairs().map(|(l, r)| orientation::residual(t, l, r)).sum::<f64>();
        let straight = misfit(&Orientation::Axes(DMat3::IDENTITY));
        let mut known: Vec<(f64, Orientation)> = found.into_iter().map(|t| (misfit(&t), t)).collect();
        known.retain(|k| k.0 < 0.8 * straight);
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        known.into_iter().take(2).map(|k| k.1).collect()
    }

    /// A turn about +Y with its angle found from the samples.
    fn refined(&self, orientation: Orientation, task: &Task) -> Result<Orientation, Cancelled> {
        let Orientation::Axes(g) = orientation else { return Ok(orientation) };
        if !orientation.interpolates() {
            return Ok(orientation);
        }
        let bench = self.bench;
        let plain = Alteration::None.of(bench.input.lights);
        let at = |degrees: f64| -> Result<(f64, Orientation), Cancelled> {
            let orientation = Orientation::Axes(DMat3::from_rotation_y(degrees.to_radians()) * g);
            let view =
                View::new(bench.input.levels, &bench.samples, bench.input.expected, orientation.clone());
            let light = Prepared::new(&plain, Reading::Cells, &view, task)?;
            let columns = light.columns(bench.input.expected, &bench.samples);
            let score = Score::new(Form::PerLevel, &halves(&bench.samples, &columns), [0, 1, 2], &[]);
            Ok((score.map_or(f64::INFINITY, |s| s.residual), orientation))
        };
        let mut best = (at(0.0)?, 0.0);
        for step in [0.3, 0.1, 0.03, 0.01] {
            for side in [-step, step] {
                loop {
                    let next = (at(best.1 + side)?, best.1 + side);
                    if next.0.0 >= best.0.0 || next.1.abs() > 4.0 {
                        break;
                    }
                    best = next;
                }
            }
        }
        Ok(best.0.1)
    }
}

/// Moments of all levels.
fn halves(samples: &[Samples], columns: &[Column]) -> Vec<[Moments; 2]> {
    samples.iter().zip(columns).map(|(s, x)| Moments::halves(s, x)).collect()
}

/// Difference of two columns, relative and weighted as the samples are.
fn apart(s: &Samples, a: &Column, b: &Column) -> f64 {
    let (mut left, mut all) = (0.0, 0.0);
    for ((w, a), b) in s.weights.iter().zip(a).zip(b) {
        for c in 0..3 {
            left += w * (a[c] - b[c]).powi(2);
            all += w * a[c] * b[c];
        }
    }
    if all > 0.0 { (left / all).sqrt() } else { 0.0 }
}

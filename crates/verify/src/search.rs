//! From levels to a report: what is right is said at once, else hypotheses are compared.

use crate::Input;
use crate::kernel::{Family, Kernel};
use crate::laws::{LAWS, SLIPS};
use crate::light::{Alteration, Layers, ORDERS, Prepared, READINGS, Reading, View};
use crate::measure::{self, Error};
use crate::model::{Hypothesis, Kinds, List};
use crate::report::{Encoding, Fault, Level, Nearest, Report};
use crate::samples::Samples;
use crate::scale::{self, Column, FORMS, Form, Moments, Score};
use crate::texture;
use crate::turn::{self, Turn};
use glam::DMat3;
use std::borrow::Cow;
use std::collections::HashMap;
use steradian_base::{Cancelled, Task};
use steradian_light::load::PROFILES;
use steradian_sphere::SphereImage;

/// Levels that are off by less are right: the sums behind hypotheses err by half of it.
const RIGHT: f64 = 4e-3;
/// Levels that are off by less may be as their baker made them, unless a cause shows clearly.
const SMALL: f64 = 0.02;
/// Residuals below this are alike.
const FLOOR: f64 = 4e-3;
/// ln of the factor by which a hypothesis has to explain more than those of another kind.
const CLEARLY: f64 = 0.3;
/// A hypothesis that leaves more than this, or than this part of what the file is off by, explains nothing.
const LEAVES: f64 = 0.04;
const LEAVES_OF_ALL: f64 = 0.15;
/// … nor does one that leaves more than this, however far off the file is.
const LEAVES_MOST: f64 = 0.12;
/// Residuals above this never count as nothing, however much the light's texels leave open.
const MOST_OPEN: f64 = 0.01;
/// Correlation of the details of file and light below which they are of two lights.
const SAME_LIGHT: f64 = 0.35;

/// A file's levels, prepared.
struct Bench<'a> {
    input: &'a Input<'a>,
    references: Vec<SphereImage>,
    sound: Vec<Vec<bool>>,
    limits: Vec<f64>,
    samples: Vec<Samples>,
    /// Relative errors of the format's rounding, per level.
    rounding: Vec<f64>,
    /// Relative errors of each level as it is.
    straight: Vec<f64>,
    /// Damage, limits.
    marks: Vec<Fault>,
}

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
    let mut search = Search::new(&bench, task)?;
    search.all(task)?;
    task.end();
    search.decide(task)
}

impl<'a> Bench<'a> {
    fn new(input: &'a Input<'a>, references: Vec<SphereImage>) -> Self {
        let (mut sound, mut marks, mut limits) = (Vec::new(), Vec::new(), Vec::new());
        let (mut samples, mut rounding, mut straight) = (Vec::new(), Vec::new(), Vec::new());
        for (m, (image, reference)) in input.levels.iter().zip(&references).enumerate() {
            let (fine, fault) = texture::sound(m, image, reference);
            marks.extend(fault);
            let limited = texture::limited(image);
            // What the light itself never exceeds is no limit.
            let most = reference.planes.iter().flatten().fold(0.0f32, |a, v| a.max(*v));
            let limited = limited.filter(|(l, _)| most > 1.02 * l);
            marks.extend(limited.map(|(limit, texels)| Fault::Limited { level: m, limit, texels }));
            let limit = limited.map_or(f64::INFINITY, |l| f64::from(l.0));
            samples.push(Samples::new(image, &fine, limit));
            rounding.push(texture::rounding(image, input.step, texture::steps(image)));
            straight.push(measure::weighted(image, reference, &fine, limit));
            sound.push(fine);
            limits.push(limit);
        }
        Self { input, references, sound, limits, samples, rounding, straight, marks }
    }

    /// Errors that a look at the texels names: steps of the format, or seams.
    fn plain_texture(&self) -> Option<Report> {
        let n = self.input.levels.len();
        let coarse = self.input.levels.iter().map(texture::steps).collect::<Option<Vec<_>>>();
        let within = (0..n).all(|m| self.straight[m] <= SMALL.min(2e-3).hypot(1.4 * self.rounding[m]));
        if let Some(steps) = coarse.filter(|_| within && self.input.step == 0.0) {
            let worst = self.rounding.iter().fold(0.0, |a: f64, b| a.max(*b));
            let mut faults = self.marks.clone();
            faults.extend((worst > SMALL).then_some(Fault::Coarse(steps[0], worst)));
            return Some(self.report(None, faults, None));
        }
        let (inside, border) =
            texture::seams(self.input.levels, &self.references, &self.sound, &self.limits)?;
        let only = border > SMALL && border > 4.0 * inside && inside < SMALL;
        only.then(|| {
            let mut faults = self.marks.clone();
            faults.push(Fault::Seams(border));
            self.report(None, faults, None)
        })
    }

    /// The report, with what was found where that is something else than expected.
    fn report(
        &self,
        found: Option<(&Hypothesis, &[SphereImage])>,
        faults: Vec<Fault>,
        reading: Option<Reading>,
    ) -> Report {
        let level = |m: usize| {
            let (image, reference, expected) =
                (&self.input.levels[m], &self.references[m], self.input.expected[m]);
            let error = Error::between(image, reference, [0, 1, 2], [1.0; 3]);
            let shape = (image.layout, image.width, image.height);
            let as_it_is = self.straight[m];
            let Some((h, exact)) = found else {
                let gain = self.gain(m);
                return Level {
                    layout: shape.0,
                    width: shape.1,
                    height: shape.2,
                    expected,
                    found: expected,
                    scale: gain,
                    expected_residual: as_it_is,
                    residual: as_it_is,
                    error,
                    error_as_found: Error::between(image, reference, [0, 1, 2], gain),
                };
            };
            let mut back = h.turn.undo(image);
            if h.encoding != Encoding::Linear {
                let f = function(h.encoding);
                back.planes.iter_mut().flatten().for_each(|v| *v = f(f64::from(*v)) as f32);
            }
            Level {
                layout: shape.0,
                width: shape.1,
                height: shape.2,
                expected,
                found: h.kernels[m],
                scale: h.score.factors[m],
                expected_residual: as_it_is,
                residual: h.score.levels[m],
                error,
                error_as_found: Error::between(&back, &exact[m], h.channels, h.score.factors[m]),
            }
        };
        let turn = found.map_or(Turn::Axes(DMat3::IDENTITY), |f| f.0.turn.clone());
        Report { levels: (0..self.input.levels.len()).map(level).collect(), turn, faults, reading }
    }

    /// The samples with an encoding undone.
    fn decoded(&self, encoding: Encoding) -> Cow<'_, [Samples]> {
        if encoding == Encoding::Linear {
            return Cow::Borrowed(&self.samples);
        }
        let levels = self.samples.iter().zip(&self.limits);
        levels.map(|(s, l)| s.mapped(*l, function(encoding))).collect()
    }

    /// The factor of least squares on each channel of a level as it is.
    fn gain(&self, m: usize) -> [f64; 3] {
        let s = &self.samples[m];
        let x: Column =
            s.texels.iter().map(|t| self.references[m].texel(t.0, t.1, t.2).map(f64::from)).collect();
        let [a, b] = Moments::halves(s, &x);
        a.plus(&b).gains([0, 1, 2])
    }

    /// The correlation of details of the sharper levels with the light's, under the turn that suits them best.
    fn same_light(&self) -> Option<f64> {
        let sharp = |k: &Kernel| k.roughness().is_some_and(|r| r < 0.55);
        let levels = (0..self.input.levels.len()).filter(|m| sharp(&self.input.expected[*m]));
        let likeness = levels.filter_map(|m| turn::detail(&self.input.levels[m], &self.references[m]));
        likeness.reduce(f64::max)
    }
}

/// How file values become linear ones.
fn function(e: Encoding) -> fn(f64) -> f64 {
    match e {
        Encoding::Linear => |v| v,
        Encoding::Encoded => |v| texture::decode(v.max(0.0)),
        Encoding::Decoded => |v| texture::encode(v.max(0.0)),
    }
}

/// All hypotheses, and what they are made of.
struct Search<'a, 'b> {
    bench: &'b Bench<'a>,
    tried: Vec<Hypothesis>,
    /// Residuals below this are alike: what the meaning of a texel and the file's format leave open.
    floor: f64,
    /// Per level, what they leave open.
    open: Vec<f64>,
    reading: Option<Reading>,
    /// The split sum's numbers by alpha.
    lobes: HashMap<u64, Option<[f64; 2]>>,
}

/// Widths that are tried per family, before the best one is refined.
const WIDTHS: usize = 20;

impl<'a, 'b> Search<'a, 'b> {
    fn new(bench: &'b Bench<'a>, task: &Task) -> Result<Self, Cancelled> {
        task.begin("comparing hypotheses", 3);
        let (n, expected) = (bench.input.levels.len(), bench.input.expected);
        let view = View::new(bench.input.levels, &bench.samples, expected, Turn::Axes(DMat3::IDENTITY));
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
            let light = Prepared::new(
                &plain,
                r,
                &view,
                &|m| r == Reading::Cells || expected[m].zonal().is_none(),
                task,
            )?;
            read.push((Some(r), light.columns(expected, &bench.samples)));
            if r == Reading::Cells {
                out.straight(&light, &view, task)?;
            }
        }
        task.advance(1);
        for m in 0..n {
            // Means over texels are one reading of a level that is not filtered: the span of the others counts.
            let spans = read
                .iter()
                .flat_map(|(_, a)| read.iter().map(|(_, b)| apart(&bench.samples[m], &a[m], &b[m])));
            out.open[m] = spans.fold(0.0, f64::max).hypot(bench.rounding[m]);
        }
        // Of a level that is not filtered the reading that fits best is taken: it opens nothing for the others.
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

    /// Every hypothesis beside those of [`Search::straight`]: turned levels, then altered light, unless something
    /// simpler explains everything.
    fn all(&mut self, task: &Task) -> Result<(), Cancelled> {
        let (levels, expected) = (self.bench.input.levels, self.bench.input.expected);
        let samples = &self.bench.samples;
        let mut views = vec![View::new(levels, samples, expected, Turn::Axes(DMat3::IDENTITY))];
        let turns = if self.explained() { Vec::new() } else { self.turns() };
        for turn in turns {
            let view = View::new(levels, samples, expected, self.refined(turn, task)?);
            let light = Prepared::new(
                &Alteration::None.of(self.bench.input.lights),
                Reading::Cells,
                &view,
                &|_| true,
                task,
            )?;
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

    /// Does a hypothesis with hardly a free number leave nothing?
    fn explained(&self) -> bool {
        let best = self.best();
        best.score.residual < 1.2 * self.floor.min(MOST_OPEN) && best.free <= 3
    }

    /// Turns that suit the levels better than none.
    fn turns(&self) -> Vec<Turn> {
        let bench = self.bench;
        let pairs = || bench.input.levels.iter().zip(&bench.references);
        let mut found: Vec<Turn> = Vec::new();
        for (l, r) in pairs() {
            let f = turn::find(l, r);
            if f.certain && !f.turn.is_identity() && !found.contains(&f.turn) && found.len() < 4 {
                found.push(f.turn);
            }
        }
        let cubes = bench.input.levels.iter().all(|l| l.layout == steradian_sphere::Layout::Cube);
        found.retain(|t| cubes || !matches!(t, Turn::Faces(_)));
        let misfit = |t: &Turn| pairs().map(|(l, r)| turn::residual(t, l, r)).sum::<f64>();
        let straight = misfit(&Turn::Axes(DMat3::IDENTITY));
        let mut known: Vec<(f64, Turn)> = found.into_iter().map(|t| (misfit(&t), t)).collect();
        known.retain(|k| k.0 < 0.8 * straight);
        known.sort_by(|a, b| a.0.total_cmp(&b.0));
        known.into_iter().take(2).map(|k| k.1).collect()
    }

    /// A turn about +Y with its angle found from the samples.
    fn refined(&self, turn: Turn, task: &Task) -> Result<Turn, Cancelled> {
        let Turn::Axes(g) = turn else { return Ok(turn) };
        if !turn.interpolates() {
            return Ok(turn);
        }
        let bench = self.bench;
        let plain = Alteration::None.of(bench.input.lights);
        let at = |degrees: f64| -> Result<(f64, Turn), Cancelled> {
            let turn = Turn::Axes(DMat3::from_rotation_y(degrees.to_radians()) * g);
            let view = View::new(bench.input.levels, &bench.samples, bench.input.expected, turn.clone());
            let direct = |m: usize| bench.input.expected[m].zonal().is_none();
            let light = Prepared::new(&plain, Reading::Cells, &view, &direct, task)?;
            let columns = light.columns(bench.input.expected, &bench.samples);
            let score = Score::new(Form::PerLevel, &halves(&bench.samples, &columns), [0, 1, 2], &[]);
            Ok((score.map_or(f64::INFINITY, |s| s.residual), turn))
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

    /// Hypotheses of light that is as it is: curves, families, encodings.
    fn straight(&mut self, light: &Prepared, view: &View<'_>, task: &Task) -> Result<(), Cancelled> {
        let bench = self.bench;
        let expected = bench.input.expected;
        for (name, kernels) in self.curves() {
            let columns = light.columns(&kernels, &bench.samples);
            self.add(view, &columns, kernels, &List::Curve(name), Alteration::None, Encoding::Linear, 0);
        }
        task.check()?;
        for family in Family::ALL {
            let (kernels, free) = self.fitted(light, family);
            if kernels != expected {
                let own = kernels
                    .iter()
                    .zip(expected)
                    .all(|(k, e)| k.family == e.family || k.roughness() == Some(0.0) || *e == Kernel::NONE);
                let list = List::Fitted { free, family: !own };
                let columns = light.columns(&kernels, &bench.samples);
                self.add(view, &columns, kernels, &list, Alteration::None, Encoding::Linear, free);
            }
        }
        for family in [Family::Box, Family::None] {
            let kernel = |k: &Kernel| if *k == Kernel::NONE { *k } else { Kernel { family, width: 0.0 } };
            let kernels: Vec<Kernel> = expected.iter().map(kernel).collect();
            if kernels != expected {
                let columns = light.columns(&kernels, &bench.samples);
                let list = List::Fitted { free: 0, family: true };
                self.add(view, &columns, kernels, &list, Alteration::None, Encoding::Linear, 0);
            }
        }
        for encoding in [Encoding::Encoded, Encoding::Decoded] {
            let columns = light.columns(expected, &bench.decoded(encoding));
            self.add(view, &columns, expected.to_vec(), &List::Expected, Alteration::None, encoding, 0);
        }
        Ok(())
    }

    /// Lists of kernels that come of another curve, or of counting levels wrongly.
    fn curves(&self) -> Vec<(String, Vec<Kernel>)> {
        let expected = self.bench.input.expected;
        let Some(shape) = self.bench.input.law.shape() else { return Vec::new() };
        let n = expected.len();
        let family = expected.iter().map(|k| k.family).find(|f| *f != Family::None).unwrap_or(Family::Ggx);
        if n < 2 || family == Family::Lambert {
            return Vec::new();
        }
        let list = |r: &dyn Fn(usize) -> f64| -> Vec<Kernel> {
            (0..n).map(|m| Kernel::at(family, r(m).min(1.0))).collect()
        };
        let laws = LAWS.iter().map(|(name, law)| ((*name).to_string(), list(&|m| law(m, n - 1))));
        let slips = SLIPS.iter().map(|(name, slip)| ((*name).to_string(), list(&|m| slip(shape, m, n - 1))));
        let mut out: Vec<(String, Vec<Kernel>)> = Vec::new();
        for (name, kernels) in laws.chain(slips) {
            let same = |k: &[Kernel]| {
                k.iter().zip(&kernels).all(|(a, b)| a == b || (a.width - b.width).abs() < 1e-9)
            };
            if !same(expected) && !out.iter().any(|(_, k)| same(k)) {
                out.push((name, kernels));
            }
        }
        out
    }

    /// A family's widths fitted level by level; how many levels were freed.
    fn fitted(&self, light: &Prepared, family: Family) -> (Vec<Kernel>, usize) {
        let bench = self.bench;
        let mut free = 0;
        let mut level = |m: usize| {
            let (s, expected) = (&bench.samples[m], bench.input.expected[m]);
            let residual = |k: Kernel| {
                let [a, b] = Moments::halves(s, &light.column(m, k, s));
                let all = a.plus(&b);
                all.residual2([0, 1, 2], all.gains([0, 1, 2])).sqrt()
            };
            let wanted = residual(expected);
            let Some((low, high)) = family.range() else {
                let k = Kernel { family, width: 0.0 };
                return if residual(k) < 0.7 * wanted { k } else { expected };
            };
            let at = |t: f64| Kernel { family, width: low * (high / low).powf(t / WIDTHS as f64) };
            let coarse = (0..=WIDTHS).map(|k| (residual(at(k as f64)), k as f64));
            let mut best = coarse.fold((f64::INFINITY, 0.0), |a, b| if b.0 < a.0 { b } else { a });
            for step in [0.5, 0.25, 0.12, 0.06, 0.03] {
                for t in [best.1 - step, best.1 + step] {
                    if (0.0..=WIDTHS as f64).contains(&t) {
                        let r = residual(at(t));
                        best = if r < best.0 { (r, t) } else { best };
                    }
                }
            }
            // Another family's levels are all its own; of the expected one only those that gain by it.
            let gains = best.0 < 0.7 * wanted && wanted > FLOOR;
            if gains || (family != expected.family && expected != Kernel::NONE) {
                free += 1;
                at(best.1)
            } else {
                expected
            }
        };
        let kernels = (0..bench.input.levels.len()).map(&mut level).collect();
        (kernels, free)
    }

    /// Lists of kernels that altered light is tried with: the expected one, and the best other one.
    fn lists(&self) -> Vec<(Vec<Kernel>, List, usize)> {
        let expected = (self.bench.input.expected.to_vec(), List::Expected, 0);
        let curve = |h: &&Hypothesis| matches!(h.list, List::Curve(_)) && h.light == Alteration::None;
        let other =
            self.tried.iter().filter(curve).min_by(|a, b| a.cost(self.floor).total_cmp(&b.cost(self.floor)));
        let other = other.map(|h| (h.kernels.clone(), h.list.clone(), 0));
        [Some(expected), other].into_iter().flatten().collect()
    }

    /// Hypotheses of light that was reduced or clipped.
    fn altered(&mut self, view: &View<'_>, task: &Task) -> Result<(), Cancelled> {
        let bench = self.bench;
        let lights = bench.input.lights;
        let rows = lights.environment.as_ref().map_or(0, |e| e.image.height);
        let lists = self.lists();
        let plain = |m: usize| lists.iter().any(|l| l.0[m].zonal().is_none());
        for factor in [2, 4, 8].into_iter().filter(|f| rows >= 4 * f) {
            for means in [true, false] {
                let light = Alteration::Reduced { factor, means };
                for reading in READINGS {
                    let p = Prepared::new(&light.of(lights), reading, view, &plain, task)?;
                    for (kernels, list, free) in lists.clone() {
                        let columns = p.columns(&kernels, &bench.samples);
                        self.add(view, &columns, kernels, &list, light, Encoding::Linear, free);
                    }
                }
            }
        }
        for (kernels, list, free) in lists {
            self.clipped(view, &kernels, &list, free, task)?;
        }
        Ok(())
    }

    /// Light clipped where that explains most.
    fn clipped(
        &mut self,
        view: &View<'_>,
        kernels: &[Kernel],
        list: &List,
        free: usize,
        task: &Task,
    ) -> Result<(), Cancelled> {
        let bench = self.bench;
        let Some(layers) = Layers::new(bench.input.lights, kernels, view, task)? else { return Ok(()) };
        let filtered: Vec<usize> = (0..kernels.len()).filter(|m| kernels[*m].zonal().is_some()).collect();
        let used = if filtered.is_empty() { (0..kernels.len()).collect() } else { filtered };
        let mut best = [(f64::INFINITY, 0.0); 2];
        for c in layers.radiances() {
            let columns = layers.clipped(c);
            let halves: Vec<[Moments; 2]> =
                used.iter().map(|&m| Moments::halves(&bench.samples[m], &columns[m])).collect();
            for (best, form) in best.iter_mut().zip([Form::One, Form::Colour]) {
                if let Some(s) = Score::new(form, &halves, [0, 1, 2], &[]).filter(|s| s.residual < best.0) {
                    *best = (s.residual, c);
                }
            }
        }
        for (_, c) in best {
            let light = Alteration::Clipped(c);
            let p = Prepared::new(
                &light.of(bench.input.lights),
                Reading::Cells,
                view,
                &|m| kernels[m].zonal().is_none(),
                task,
            )?;
            let columns = p.columns(kernels, &bench.samples);
            self.add(view, &columns, kernels.to_vec(), list, light, Encoding::Linear, free + 1);
        }
        Ok(())
    }

    /// Adds hypotheses of all orders of channels and forms of factors.
    fn add(
        &mut self,
        view: &View<'_>,
        columns: &[Column],
        kernels: Vec<Kernel>,
        list: &List,
        light: Alteration,
        encoding: Encoding,
        free: usize,
    ) {
        let bench = self.bench;
        let halves = halves(&bench.decoded(encoding), columns);
        let mut known = |k: &Kernel| {
            let r = k.roughness()?;
            *self.lobes.entry(r.to_bits()).or_insert_with(|| scale::lobe(Some(r)))
        };
        let lobes: Vec<Option<[f64; 2]>> = kernels.iter().map(&mut known).collect();
        for channels in ORDERS {
            for (form, numbers) in FORMS.map(|f| f(kernels.len())) {
                let Some(score) = Score::new(form, &halves, channels, &lobes) else { continue };
                self.tried.push(Hypothesis {
                    turn: view.turn.clone(),
                    channels,
                    light,
                    list: list.clone(),
                    kernels: kernels.clone(),
                    scale: score.scale(form, &lobes),
                    encoding,
                    score,
                    free: free + numbers,
                });
            }
        }
    }

    fn best(&self) -> &Hypothesis {
        let cost = |h: &&Hypothesis| h.cost(self.floor);
        self.tried.iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).unwrap_or(&self.tried[0])
    }

    /// The best of each kind, the cheapest first.
    fn ranked(&self) -> Vec<&Hypothesis> {
        let mut all: Vec<&Hypothesis> = self.tried.iter().collect();
        all.sort_by(|a, b| a.cost(self.floor).total_cmp(&b.cost(self.floor)));
        let mut kinds: Vec<Kinds> = Vec::new();
        all.retain(|h| {
            let new = !kinds.contains(&h.kinds());
            kinds.push(h.kinds());
            new
        });
        all
    }

    fn decide(&self, task: &Task) -> Result<Report, Cancelled> {
        let bench = self.bench;
        let ranked = self.ranked();
        let best = ranked[0];
        let none = best.faults(bench.input.expected, Vec::new()).is_empty();
        let as_it_is = self.tried.iter().filter(|h| h.faults(bench.input.expected, Vec::new()).is_empty());
        let as_it_is = as_it_is.min_by(|a, b| a.score.residual.total_cmp(&b.score.residual)).unwrap_or(best);
        let mut faults = bench.marks.clone();
        let level_off = |m: usize, r: f64| r > SMALL.max(1.2 * self.open[m]).hypot(1.3 * bench.rounding[m]);
        let off = |h: &Hypothesis| h.score.levels.iter().enumerate().any(|(m, r)| level_off(m, *r));
        if !none && self.clear(best, as_it_is.score.residual, &ranked) {
            faults.extend(best.faults(bench.input.expected, conventions(&best.turn, bench.input.read)));
            if off(best) {
                faults.push(Fault::Remains(best.score.residual));
            }
            task.begin("filtering what was found", bench.input.levels.len() as u64);
            let lights = best.light.of(bench.input.lights);
            let exact = measure::filtered(&lights, &best.kernels, bench.input.levels, task)?;
            task.end();
            return Ok(bench.report(Some((best, &exact)), faults, None));
        }
        if off(as_it_is) {
            faults.push(self.texture(as_it_is, &ranked));
        }
        Ok(bench.report(None, faults, self.reading))
    }

    /// Does a hypothesis explain clearly more than those of other kinds, and enough?
    fn clear(&self, best: &Hypothesis, all: f64, ranked: &[&Hypothesis]) -> bool {
        let kinds = best.kinds();
        let rival = ranked.iter().find(|h| !kinds.within(h.kinds()));
        let ahead = rival.is_none_or(|r| r.cost(self.floor) - best.cost(self.floor) > CLEARLY);
        ahead && best.score.residual < LEAVES.max((LEAVES_OF_ALL * all).min(LEAVES_MOST))
    }

    /// What an error that no hypothesis explains is like.
    fn texture(&self, as_it_is: &Hypothesis, ranked: &[&Hypothesis]) -> Fault {
        let bench = self.bench;
        let residual = as_it_is.score.residual;
        let detail = bench.same_light();
        if residual > 0.15 && detail.is_some_and(|d| d < SAME_LIGHT) {
            return Fault::OtherLight;
        }
        let off = (0..bench.input.levels.len()).filter(|&m| bench.straight[m] > SMALL);
        let mut noisy =
            off.map(|m| texture::is_noise(&bench.input.levels[m], &bench.references[m], &bench.sound[m]));
        // Small levels hold too few texels to tell.
        if residual < 0.5 && noisy.next() == Some(true) {
            return Fault::Noise(residual);
        }
        let expected = bench.input.expected;
        let near = ranked.iter().filter(|h| !h.faults(expected, Vec::new()).is_empty()).take(3);
        let near =
            near.map(|h| Nearest { faults: h.faults(expected, Vec::new()), residual: h.score.residual });
        Fault::Unexplained(residual, near.collect())
    }
}

/// Moments of all levels.
fn halves(samples: &[Samples], columns: &[Column]) -> Vec<[Moments; 2]> {
    samples.iter().zip(columns).map(|(s, x)| Moments::halves(s, x)).collect()
}

/// How far two columns are apart, relative and weighted as the samples are.
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

/// Conventions by which the light would have to be read to undo a turn.
fn conventions(turn: &Turn, read: &steradian_light::load::Profile) -> Vec<&'static str> {
    let Turn::Axes(g) = turn else { return Vec::new() };
    // World w of another tool is our direction p w, and found at w = pᵀ d.
    let same = |p: &&steradian_light::load::Profile| {
        (p.latlong().transpose() * read.latlong() - *g).abs_diff_eq(DMat3::ZERO, 1e-9)
    };
    PROFILES.iter().filter(same).map(|p| p.name).collect()
}

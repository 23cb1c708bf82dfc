//! Hypotheses: curves and families of kernels, encodings, light that was reduced or clipped.

use super::{FLOOR, Search, halves};
use crate::kernel::{Family, Kernel};
use crate::laws::Rule;
use crate::light::{Alteration, Layers, ORDERS, Prepared, READINGS, Reading, View};
use crate::model::{Hypothesis, List};
use crate::report::Encoding;
use crate::scale::{self, Column, FORMS, Form, Moments, Score};
use steradian_base::{Cancelled, Task};

/// Widths that are tried per family before the best one is refined.
const WIDTHS: usize = 20;

impl Search<'_, '_> {
    /// Hypotheses of light that is as it is: curves, families, encodings.
    pub(super) fn straight(
        &mut self,
        light: &Prepared<'_>,
        view: &View<'_>,
        task: &Task,
    ) -> Result<(), Cancelled> {
        let bench = self.bench;
        let expected = bench.input.expected;
        for (rule, kernels) in self.curves() {
            let columns = light.columns(&kernels, &bench.samples);
            self.add(view, &columns, kernels, &List::Curve(rule), Alteration::None, Encoding::Linear, 0);
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

    /// Lists of kernels that follow from another curve, or from counting levels wrongly.
    fn curves(&self) -> Vec<(Rule, Vec<Kernel>)> {
        let expected = self.bench.input.expected;
        let Some(shape) = self.bench.input.law.shape() else { return Vec::new() };
        let n = expected.len();
        let family = expected.iter().map(|k| k.family).find(|f| *f != Family::None).unwrap_or(Family::Ggx);
        if n < 2 || family == Family::Lambert {
            return Vec::new();
        }
        let mut out: Vec<(Rule, Vec<Kernel>)> = Vec::new();
        for rule in Rule::all() {
            let level = |m: usize| Kernel::at(family, rule.roughness(shape, m, n - 1).min(1.0));
            let kernels: Vec<Kernel> = (0..n).map(level).collect();
            let same = |k: &[Kernel]| {
                k.iter().zip(&kernels).all(|(a, b)| a == b || (a.width - b.width).abs() < 1e-9)
            };
            if !same(expected) && !out.iter().any(|(_, k)| same(k)) {
                out.push((rule, kernels));
            }
        }
        out
    }

    /// A family's widths fitted level by level; how many levels were freed.
    fn fitted(&self, light: &Prepared<'_>, family: Family) -> (Vec<Kernel>, usize) {
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
            // For another family all levels are fitted; for the expected one only those that gain by it.
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
    pub(super) fn altered(&mut self, view: &View<'_>, task: &Task) -> Result<(), Cancelled> {
        let bench = self.bench;
        let lights = bench.input.lights;
        let rows = lights.environment.as_ref().map_or(0, |e| e.image.height);
        let lists = self.lists();
        for factor in [2, 4, 8].into_iter().filter(|f| rows >= 4 * f) {
            for means in [true, false] {
                let light = Alteration::Reduced { factor, means };
                for reading in READINGS {
                    let p = Prepared::new(&light.of(lights), reading, view, task)?;
                    for (kernels, list, free) in lists.clone() {
                        let columns = p.columns(&kernels, &bench.samples);
                        self.add(view, &columns, kernels, &list, light, Encoding::Linear, free);
                    }
                }
            }
        }
        let kernels: Vec<&[Kernel]> = lists.iter().map(|l| &l.0[..]).collect();
        let Some(layers) = Layers::new(lights, &kernels, view, task)? else { return Ok(()) };
        for (k, list) in lists.iter().enumerate() {
            self.clipped(view, list, |c| layers.clipped(k, c), &layers.radiances(), task)?;
        }
        Ok(())
    }

    /// Light clipped where that explains most, of these radiances.
    fn clipped(
        &mut self,
        view: &View<'_>,
        (kernels, list, free): &(Vec<Kernel>, List, usize),
        clipped: impl Fn(f64) -> Vec<Column>,
        radiances: &[f64],
        task: &Task,
    ) -> Result<(), Cancelled> {
        let bench = self.bench;
        let filtered: Vec<usize> = (0..kernels.len()).filter(|m| kernels[*m].zonal().is_some()).collect();
        let used = if filtered.is_empty() { (0..kernels.len()).collect() } else { filtered };
        let mut best = [(f64::INFINITY, 0.0); 2];
        for &c in radiances {
            let columns = clipped(c);
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
            let p = Prepared::new(&light.of(bench.input.lights), Reading::Cells, view, task)?;
            let columns = p.columns(kernels, &bench.samples);
            self.add(view, &columns, kernels.clone(), list, light, Encoding::Linear, free + 1);
        }
        Ok(())
    }

    /// Adds hypotheses of all orders of channels and forms of factors.
    pub(super) fn add(
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
                    orientation: view.orientation.clone(),
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
}

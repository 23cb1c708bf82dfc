//! Fits of anisotropic reflectance: views by elevation and azimuth.

use super::refine::{self, Fitted, Kind};
use super::slice::Slice;
use super::{
    Axes, GaussianFit, GaussianLobe, LAST, MAX_LOBES, MIN_AZIMUTHS, Objective, Plan, SliceReport, chain,
    order,
};
use crate::Brdf;
use crate::math::spherical;
use glam::{DMat3, DVec3};
use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::OnceLock;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;

/// Does this rotation or reflection of the surface change nothing?
pub(super) fn is_invariant(brdf: &dyn Brdf, by: DMat3) -> bool {
    (0..200).all(|k| {
        // Directions of a low-discrepancy sequence (Roberts 2018).
        let at = |g: f64| (0.5 + g * f64::from(k)).fract();
        let wo = spherical(1.5 * at(0.754_877_666), 2.0 * PI * at(0.569_840_291));
        let wi = spherical(1.5 * at(0.819_172_513), 2.0 * PI * at(0.671_043_607));
        let (a, b) = (brdf.f_cos(wi, wo), brdf.f_cos(by * wi, by * wo));
        (0..3).all(|c| (a[c] - b[c]).abs() <= 1e-6 * a[c].abs().max(b[c].abs()) + 1e-12)
    })
}

/// The fit of the view along the normal, turned into the frame of a view at azimuth `phi`.
fn turned(top: &Fitted, phi: f64) -> Fitted {
    let turn = DMat3::from_rotation_z(-phi);
    let lobe = |l: &GaussianLobe| {
        let axes = l.axes(0.0);
        let [angle, aside, turn] = Axes::angles(turn * axes.mean, turn * axes.along);
        GaussianLobe { angle, aside, turn, ..*l }
    };
    Fitted { lobes: top.lobes.iter().map(lobe).collect(), ..*top }
}

/// Lobes as a mirror in the plane of n and wo shows them.
fn mirrored(lobes: &[GaussianLobe]) -> Vec<GaussianLobe> {
    lobes.iter().map(|l| GaussianLobe { aside: -l.aside, turn: -l.turn, ..*l }).collect()
}

/// One azimuth: its slices by elevation, from the second on, and the candidate fits at each.
struct Column {
    slices: Vec<Slice>,
    found: Vec<Vec<Fitted>>,
}

/// The fits chosen at an azimuth, by elevation from the second on; none before the first choice.
/// [`Grid::align`] puts the lobes of all into one order.
type Chosen = Vec<Fitted>;

impl Column {
    fn norm(&self, i: usize, f: &Fitted) -> f64 {
        (f.error / self.slices[i].square[0].max(1e-300)).sqrt()
    }
}

/// The chosen fits of a neighbouring azimuth, their errors, and the slices midway.
struct Beside<'a> {
    fits: Vec<Fitted>,
    norms: Vec<f64>,
    midway: Vec<&'a Slice>,
}

/// The views that are fitted.
struct Grid<'a> {
    brdf: &'a dyn Brdf,
    kind: Kind,
    diffuse: [f64; 3],
    /// N and M.
    size: [usize; 2],
    /// Number of azimuths after which slices repeat: M, or half of it where half a turn changes nothing.
    period: usize,
    /// Are slices of one half of the period mirror images of those of the other?
    mirrored: bool,
    /// The slices between each elevation and the next, and between each azimuth and the next, made when they
    /// are needed.
    midway: [Vec<OnceLock<Slice>>; 2],
}

impl<'a> Grid<'a> {
    fn new(brdf: &'a dyn Brdf, plan: Plan) -> Self {
        let (lobes, keep) = (plan.lobes.clamp(1, MAX_LOBES), plan.objective == Objective::Energy);
        let kind = Kind { lobes, keep, stretched: true, turned: true };
        let size = [plan.views.max(2), plan.azimuths.max(MIN_AZIMUTHS)];
        let even = size[1].is_multiple_of(2) && is_invariant(brdf, DMat3::from_rotation_z(PI));
        let period = if even { size[1] / 2 } else { size[1] };
        let mirror = DMat3::from_diagonal(DVec3::new(1.0, -1.0, 1.0));
        let mirrored = period.is_multiple_of(2) && is_invariant(brdf, mirror);
        let midway = [(); 2].map(|()| (0..size[0] * period).map(|_| OnceLock::new()).collect());
        Self { brdf, kind, diffuse: chain::diffuse(brdf, kind), size, period, mirrored, midway }
    }

    /// Number of azimuths that differ by more than symmetry: only the first of all are fitted.
    fn distinct(&self) -> usize {
        if self.mirrored { self.period / 2 } else { self.period }
    }

    /// The azimuth among the first ones that `j` equals, and whether as its mirror image.
    fn equal(&self, j: usize) -> (usize, bool) {
        let k = j % self.period;
        if k < self.distinct() { (k, false) } else { (self.period - 1 - k, true) }
    }

    /// The azimuth at index `j`, which may be fractional. It is half a step off the planes about which
    /// anisotropic reflectance is often symmetric, since searches at these end on saddles.
    fn phi(&self, j: f64) -> f64 {
        2.0 * PI * (j + 0.5) / self.size[1] as f64
    }

    /// The slice at a place of the grid; fractional indices lie between places.
    fn slice(&self, i: f64, j: f64) -> Slice {
        let view = [LAST * i / (self.size[0] - 1) as f64, self.phi(j)];
        Slice::new(self.brdf, self.diffuse, view, self.kind)
    }

    /// The slice midway between a view and that of the next elevation (`way` 0) or azimuth (1), and whether
    /// what is there is its mirror image.
    fn midway(&self, way: usize, i: usize, j: usize) -> (&Slice, bool) {
        let (j, is_image) = self.midway_at(way, j);
        let place = &self.midway[way][i * self.period + j];
        let step = if way == 0 { [0.5, 0.0] } else { [0.0, 0.5] };
        (place.get_or_init(|| self.slice(i as f64 + step[0], j as f64 + step[1])), is_image)
    }

    /// The first azimuth at which the slice midway equals that at `j`, and whether as its mirror image.
    fn midway_at(&self, way: usize, j: usize) -> (usize, bool) {
        let j = j % self.period;
        let image = (2 * self.period - 1 - way - j) % self.period;
        if self.mirrored && image < j { (image, true) } else { (j, false) }
    }

    /// The relative error there of interpolation between lobes that are in one order.
    fn between(&self, [way, i, j]: [usize; 3], a: &[GaussianLobe], b: &[GaussianLobe]) -> f64 {
        match self.midway(way, i, j) {
            (slice, false) => chain::between(slice, a, b),
            (slice, true) => chain::between(slice, &mirrored(a), &mirrored(b)),
        }
    }

    /// The candidate fits of an azimuth.
    fn column(&self, j: usize, task: &Task) -> Result<Column, Cancelled> {
        let slices: Vec<Slice> = (1..self.size[0]).map(|i| self.slice(i as f64, j as f64)).collect();
        let found = chain::candidates(&slices, self.kind, task)?;
        Ok(Column { slices, found })
    }

    /// The fit of the view along the normal, which all azimuths share. Candidates are the mean of the fits of
    /// the next elevation, the result of a search started from that mean, and the results of independent
    /// searches; the one that interpolates best with the next elevation is chosen.
    fn top(&self, columns: &[Column], chosen: &[Chosen]) -> (Slice, Fitted) {
        let slice = Slice::new(self.brdf, self.diffuse, [0.0; 2], self.kind);
        let next: Vec<Fitted> =
            chosen.iter().enumerate().map(|(j, c)| turned(&c[0], -self.phi(j as f64))).collect();
        let share = (next.len() as f64).recip();
        let mean = |k: usize| {
            let sum =
                |of: &dyn Fn(&GaussianLobe) -> f64| next.iter().map(|f| of(&f.lobes[k])).sum::<f64>() * share;
            let mut lobe = GaussianLobe {
                angle: sum(&|l| l.angle),
                aside: sum(&|l| l.aside),
                weight: [0, 1, 2].map(|c| sum(&|l| l.weight[c])),
                ..GaussianLobe::default()
            };
            lobe.widen([0, 1, 2].map(|i| sum(&|l| l.spread()[i])));
            lobe
        };
        let mut lobes: Vec<GaussianLobe> = (0..self.kind.lobes).map(mean).collect();
        if self.kind.keep {
            for c in 0..3 {
                let all: f64 = lobes.iter().map(|l| l.weight[c]).sum();
                let scale = if all > 0.0 { slice.albedo[c].max(0.0) / all } else { 0.0 };
                lobes.iter_mut().for_each(|l| l.weight[c] *= scale);
            }
        }
        let error = slice.norm(&lobes).powi(2) * slice.square[0];
        let mean = Fitted { lobes, error, converged: true };
        let mut found = vec![refine::follow(&slice, &mean, self.kind), mean];
        for mut fit in refine::search(&slice, self.kind, 3, refine::STEPS) {
            fit.lobes = order::after(&found[1].lobes, &fit.lobes);
            found.push(fit);
        }
        let cost = |top: &Fitted| -> f64 {
            let own = slice.norm(&top.lobes);
            let at = |(j, chosen): (usize, &Chosen)| {
                let ends = own.max(columns[self.equal(j).0].norm(0, &chosen[0]));
                let top = turned(top, self.phi(j as f64));
                let middle = self.between([0, 0, j], &top.lobes, &chosen[0].lobes);
                own + chain::step(middle, ends, chain::JUMP)
            };
            chosen.iter().enumerate().map(at).sum()
        };
        let costs: Vec<f64> = found.iter().map(cost).collect();
        let best = (0..found.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
        let best = found.swap_remove(best);
        (slice, best)
    }

    /// The neighbours of azimuth `j`, one of the first, that are chosen.
    fn beside(&self, columns: &[Column], chosen: &[Chosen], j: usize) -> Vec<Beside<'_>> {
        let count = chosen.len();
        let before = (j + count - 1) % count;
        let neighbours = [(before, before), ((j + 1) % count, j)].into_iter();
        let of = |(k, from): (usize, usize)| {
            let (column, rows) =
                (&columns[self.equal(k).0], (1..self.size[0]).into_par_iter().with_max_len(1));
            let norm = |(i, f)| column.norm(i, f);
            Beside {
                fits: chosen[k].clone(),
                norms: chosen[k].iter().enumerate().map(norm).collect(),
                // None of them is an image: those on either side of the first azimuths are their own.
                midway: rows.map(|i| self.midway(1, i, from).0).collect(),
            }
        };
        neighbours.filter(|(k, _)| !chosen[*k].is_empty()).map(of).collect()
    }

    /// Does anything jump between the choice at an azimuth and its neighbours?
    fn jumps(column: &Column, chosen: &Chosen, beside: &[Beside<'_>]) -> bool {
        let one = |b: &Beside<'_>, i: usize| {
            let ends = b.norms[i].max(column.norm(i, &chosen[i]));
            chain::midway(b.midway[i], &b.fits[i], &chosen[i]) > (1.25 * ends).max(MIN_JUMP)
        };
        beside.iter().any(|b| (0..chosen.len()).any(|i| one(b, i)))
    }

    /// Chooses among the candidates, and the results of searches from the neighbours' fits, so that
    /// interpolation towards the neighbours jumps little.
    fn choose(&self, column: &mut Column, j: usize, beside: &[Beside<'_>]) -> Chosen {
        let views = self.size[0] - 1;
        let rows = |count: usize| (0..count).into_par_iter().with_max_len(1);
        for b in beside {
            let follow = |i: usize| refine::follow(&column.slices[i], &b.fits[i], self.kind);
            let more: Vec<Fitted> = rows(views).map(follow).collect();
            column.found.iter_mut().zip(more).for_each(|(found, more)| found.push(more));
        }
        column.found.iter_mut().for_each(chain::distinct);
        let between: Vec<&Slice> = rows(views - 1).map(|i| self.midway(0, i + 1, j).0).collect();
        let column = &*column;
        let more = |i: usize| -> Vec<f64> {
            let one = |f: &Fitted, b: &Beside<'_>| {
                let ends = column.norm(i, f).max(b.norms[i]);
                chain::step(chain::midway(b.midway[i], &b.fits[i], f), ends, chain::JUMP)
            };
            column.found[i].iter().map(|f| beside.iter().map(|b| one(f, b)).sum()).collect()
        };
        let more: Vec<Vec<f64>> = rows(views).map(more).collect();
        let middles = chain::midways(&column.found, &between);
        let path = chain::smoothest(&column.slices, &column.found, &middles, chain::JUMP, &|i, k| more[i][k]);
        path.iter().zip(&column.found).map(|(k, found)| found[*k].clone()).collect()
    }

    /// Puts the lobes of all views into one order, so that interpolation is between corresponding lobes.
    /// Around some views lobes exchange their places, so that no order serves all neighbours; the pairs of
    /// neighbours that differ most, as at grazing views, are then left inconsistent.
    fn align(&self, chosen: &mut [Chosen]) {
        let (rows, count) = (self.size[0] - 1, chosen.len());
        let of = |i: usize, j: usize| &chosen[j][i].lobes;
        let up = (1..rows).flat_map(|i| (0..count).map(move |j| [0, i, j]));
        let aside = (0..rows).flat_map(|i| (0..count).map(move |j| [1, i, j]));
        // The views on either side of a place: an elevation (0) or an azimuth (1) apart.
        let ends = |[way, i, j]: [usize; 3]| {
            if way == 0 { ([i - 1, j], [i, j]) } else { ([i, j], [i, (j + 1) % count]) }
        };
        // The best order of the second view's lobes for the first, and its error midway.
        let best = |place: [usize; 3]| {
            let ([i, j], [k, l]) = ends(place);
            let lobes = of(k, l);
            let error = |order: &Vec<usize>| {
                let b: Vec<GaussianLobe> = order.iter().map(|p| lobes[*p]).collect();
                self.between([place[0], i + 1, j], of(i, j), &b)
            };
            let orders = order::permutations(lobes.len());
            let all = orders.into_iter().map(|o| (error(&o), o));
            all.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default()
        };
        // Places that are equal by symmetry have equal orders; mirror images of azimuths have them from the
        // other side.
        let equal = |[way, i, j]: [usize; 3]| {
            let (k, is_image) = self.midway_at(way, j);
            ([way, i, k], is_image && way == 1)
        };
        let places: Vec<[usize; 3]> = up.chain(aside).collect();
        let first: Vec<[usize; 3]> = places.iter().copied().filter(|p| equal(*p).0 == *p).collect();
        let made: Vec<(f64, Vec<usize>)> = first.par_iter().with_max_len(8).map(|p| best(*p)).collect();
        let made: HashMap<_, _> = first.into_iter().zip(made).collect();
        let link = |place: [usize; 3]| {
            let (from, reversed) = equal(place);
            let (error, order) = &made[&from];
            let position = |k: usize| order.iter().position(|o| *o == k).unwrap_or(0);
            let order = if reversed { (0..order.len()).map(position).collect() } else { order.clone() };
            let ([i, j], [k, l]) = ends(place);
            (*error, j * rows + i, l * rows + k, order)
        };
        let mut links: Vec<(f64, usize, usize, Vec<usize>)> = places.into_iter().map(link).collect();
        links.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Kruskal's: views join the group of the neighbour that they are nearest to, with its order.
        let mut group: Vec<usize> = (0..rows * count).collect();
        let mut orders = vec![(0..self.kind.lobes).collect::<Vec<usize>>(); rows * count];
        for (_, a, b, order) in links {
            let (from, to) = (group[b], group[a]);
            if from == to {
                continue;
            }
            let place = |lobe: usize| orders[b].iter().position(|o| *o == lobe).unwrap_or(0);
            let moved: Vec<usize> = orders[a].iter().map(|k| place(order[*k])).collect();
            for view in (0..group.len()).filter(|v| group[*v] == from).collect::<Vec<_>>() {
                orders[view] = moved.iter().map(|k| orders[view][*k]).collect();
                group[view] = to;
            }
        }
        for (view, order) in orders.iter().enumerate() {
            let fit = &mut chosen[view / rows][view % rows];
            fit.lobes = order.iter().map(|k| fit.lobes[*k]).collect();
        }
    }
}

/// Relative errors midway between views that are below this do not count as jumps. Half and twice give the
/// same fit of brushed metal (Ward, 5 × 8 views).
const MIN_JUMP: f64 = 0.05;
/// Rounds over the azimuths. One and four give the same fit of brushed metal (Ward, 5 × 8 views), in 0.7 and
/// 1.3 of the time.
const AZIMUTH_ROUNDS: usize = 2;

/// See [`GaussianFit::new`].
pub(super) fn fit(brdf: &dyn Brdf, plan: Plan, task: &Task) -> Result<GaussianFit, Cancelled> {
    let grid = Grid::new(brdf, plan);
    let (size, distinct) = (grid.size, grid.distinct());
    task.begin("fitting", ((1 + AZIMUTH_ROUNDS) * distinct) as u64);
    let quiet = task.clone().without_progress();
    let column = |j: usize| {
        task.advance(1);
        grid.column(j, &quiet)
    };
    let columns: Vec<Result<Column, Cancelled>> =
        (0..distinct).into_par_iter().with_max_len(1).map(column).collect();
    let mut columns = columns.into_iter().collect::<Result<Vec<Column>, Cancelled>>()?;
    let mut chosen: Vec<Chosen> = vec![Vec::new(); size[1]];
    for round in 0..AZIMUTH_ROUNDS {
        for j in 0..distinct {
            task.check()?;
            task.advance(1);
            let beside = grid.beside(&columns, &chosen, j);
            if round > 0 && !Grid::jumps(&columns[j], &chosen[j], &beside) {
                continue;
            }
            let fits = grid.choose(&mut columns[j], j, &beside);
            let image = |f: &Fitted| Fitted { lobes: mirrored(&f.lobes), ..*f };
            for (k, to) in chosen.iter_mut().enumerate() {
                match grid.equal(k) {
                    (of, false) if of == j => to.clone_from(&fits),
                    (of, true) if of == j => *to = fits.iter().map(image).collect(),
                    _ => {}
                }
            }
        }
    }
    task.end();
    // Azimuths that are equal by symmetry have equal errors.
    let report = |j: usize| -> Vec<SliceReport> {
        columns[j].slices.iter().zip(&chosen[j]).map(|(slice, fit)| slice.report(fit)).collect()
    };
    let reports: Vec<Vec<SliceReport>> = (0..distinct).into_par_iter().with_max_len(1).map(report).collect();
    grid.align(&mut chosen);
    let (slice, top) = grid.top(&columns, &chosen);
    let seen_from_top = slice.report(&top);
    let view = |(i, j): (usize, usize)| {
        let phi = grid.phi(j as f64);
        let (report, lobes) = match i {
            0 => (seen_from_top, turned(&top, phi).lobes),
            _ => (reports[grid.equal(j).0][i - 1], chosen[j][i - 1].lobes.clone()),
        };
        (SliceReport { phi, ..report }, lobes)
    };
    let places = (0..size[0]).flat_map(|i| (0..size[1]).map(move |j| (i, j)));
    let (report, views) = places.map(view).unzip();
    Ok(GaussianFit { azimuths: size[1], report, ..GaussianFit::isotropic(grid.diffuse, views) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::lobes::Lobes;
    use crate::{albedo, parse};

    fn plan(lobes: usize, views: usize, azimuths: usize) -> Plan {
        Plan { lobes, views, azimuths, ..Plan::default() }
    }

    /// A sum of lobes off the plane of incidence, swept along directions of their own, is recovered, also
    /// between the views of the fit.
    #[test]
    fn lobes_that_are_there_are_found() {
        let known = |theta: f64, phi: f64| {
            vec![
                GaussianLobe {
                    angle: -0.1 * theta,
                    aside: 0.15 * theta * (2.0 * phi).sin(),
                    sigma: 0.08,
                    sweep: 0.25,
                    turn: (0.7 + phi).rem_euclid(PI),
                    weight: [0.4, 0.3, 0.2],
                },
                GaussianLobe {
                    angle: -0.2 * theta,
                    sigma: 0.35,
                    weight: [0.1, 0.1, 0.3],
                    ..GaussianLobe::default()
                },
            ]
        };
        let truth =
            GaussianFit { azimuths: 24, ..GaussianFit::isotropic([0.0; 3], vec![Vec::new(); 7 * 24]) };
        let places = (0..7).flat_map(|i| (0..24).map(move |j| (i, j)));
        let views = places.map(|(i, j)| known(truth.theta(i), truth.phi(j))).collect();
        let brdf = Lobes::new("lobes:a".into(), GaussianFit { views, ..truth });
        let found = GaussianFit::new(&brdf, plan(2, 7, 16), &Task::quiet()).expect("not cancelled");
        // Seen along the normal the truth itself lies between two azimuths.
        let most = |r: &SliceReport| if r.theta > 0.0 { 0.01 } else { 0.03 };
        assert!(found.report.iter().all(|r| r.norm() < most(r) && r.converged), "{:?}", found.report);
        for view in [[0.4, 0.3], [1.0, 2.0], [1.3, 5.5]] {
            let error = found.error_at(&brdf, view).norm();
            assert!(error < 0.2, "{view:?}: {error}");
        }
    }

    /// Azimuths that are equal by symmetry are fitted once.
    #[test]
    fn symmetric_azimuths() {
        let distinct = |spec: &str, azimuths: usize| {
            Grid::new(&*parse(spec).expect(spec), plan(1, 2, azimuths)).distinct()
        };
        assert_eq!([24, 12, 10].map(|m| distinct("ggx:ax=0.1,ay=0.4", m)), [6, 3, 5]);
        // Its grooves are slanted: half a turn is left of its symmetry.
        let slanted =
            GaussianLobe { angle: -0.2, sigma: 0.1, sweep: 0.2, turn: 0.7, ..GaussianLobe::default() };
        let lobe = |k: usize| GaussianLobe { weight: [0.1 + 0.01 * (k % 5) as f64; 3], ..slanted };
        let all = |views: Vec<Vec<GaussianLobe>>| {
            let fit = GaussianFit { azimuths: 10, ..GaussianFit::isotropic([0.0; 3], views) };
            let brdf = Lobes::new("lobes:a".into(), fit);
            Grid::new(&brdf, plan(1, 2, 12)).distinct()
        };
        assert_eq!(all((0..20).map(|k| vec![lobe(k)]).collect()), 6);
        assert_eq!(all((0..20).map(|k| vec![lobe(k / 4)]).collect()), 12);
    }

    /// Errors of brushed metals; the albedo of every view is kept by another quadrature; midway between views
    /// they are hardly worse.
    #[test]
    fn brushed_metals() {
        for spec in ["ggx:ax=0.1,ay=0.4,f0=0.9/0.6/0.3", "ward:ax=0.05,ay=0.3"] {
            let brdf = parse(spec).expect(spec);
            let fit = GaussianFit::new(&*brdf, plan(3, 6, 12), &Task::quiet()).expect("not cancelled");
            for (k, report) in fit.report.iter().enumerate() {
                let i = k / fit.azimuths;
                let most = if i < 4 { 0.1 } else { 0.3 };
                assert!(report.norm() < most, "{spec}, view {i}: {}", report.norm());
                // Nine of twelve azimuths are images of three.
                let own = fit.error_at(&*brdf, [report.theta, report.phi]).norm();
                assert!((own - report.norm()).abs() < 2e-3, "{spec}, view {k}: {own}, not {}", report.norm());
                let want = albedo::directional(&*brdf, spherical(report.theta, report.phi), 1e-5);
                for c in (0..3).filter(|_| i < 5 && k % 5 == 0) {
                    let got = fit.diffuse[c] + fit.views[k].iter().map(|l| l.weight[c]).sum::<f64>();
                    assert!(
                        (got - want[c]).abs() < 5e-3 * want[c],
                        "{spec}, view {k}: {got}, not {}",
                        want[c]
                    );
                }
            }
            let midway = |i: usize, j: usize| {
                let view = [0.5 * (fit.theta(i) + fit.theta(i + 1)), fit.phi(j) + PI / 12.0];
                fit.error_at(&*brdf, view).norm()
            };
            let between: Vec<f64> = (0..3)
                .flat_map(|i| (0..12).step_by(3).map(move |j| (i, j)))
                .map(|(i, j)| midway(i, j))
                .collect();
            let mean = between.iter().sum::<f64>() / between.len() as f64;
            println!(
                "{spec}: midway {mean:.3} in the mean, {:.3} at most",
                between.iter().copied().fold(0.0, f64::max)
            );
            assert!(mean < 0.12, "{spec}: {mean}");
            let all: Vec<f64> = fit.report.iter().map(SliceReport::norm).collect();
            println!("{spec}: {:.3} in the mean of views", all.iter().sum::<f64>() / all.len() as f64);
        }
    }
}

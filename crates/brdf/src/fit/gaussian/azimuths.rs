//! Fits of anisotropic reflectance: views by elevation and azimuth.

use super::refine::{self, Fitted, Kind};
use super::slice::Slice;
use super::{
    Axes, GaussianFit, GaussianLobe, LAST, MAX_LOBES, MIN_AZIMUTHS, Objective, Plan, SliceReport, chain,
    order,
};
use crate::Brdf;
use crate::math::spherical;
use glam::DMat3;
use std::f64::consts::PI;
use std::sync::{Arc, OnceLock};
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;

/// Does half a turn of the surface change nothing?
fn is_even(brdf: &dyn Brdf) -> bool {
    (0..200).all(|k| {
        // Directions of a low-discrepancy sequence (Roberts 2018).
        let at = |g: f64| (0.5 + g * f64::from(k)).fract();
        let wo = spherical(1.5 * at(0.754_877_666), 2.0 * PI * at(0.569_840_291));
        let wi = spherical(1.5 * at(0.819_172_513), 2.0 * PI * at(0.671_043_607));
        let (a, b) = (
            brdf.f_cos(wi, wo),
            brdf.f_cos(DMat3::from_rotation_z(PI) * wi, DMat3::from_rotation_z(PI) * wo),
        );
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

/// One azimuth: its slices by elevation, from the second on, the candidate fits at each, and the chosen one.
/// [`Grid::align`] puts the lobes of all chosen fits into one order.
#[derive(Clone)]
struct Column {
    slices: Arc<Vec<Slice>>,
    found: Vec<Vec<Fitted>>,
    chosen: Vec<Fitted>,
}

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
    /// Number of azimuths after which slices repeat: M, or half of it.
    half: usize,
    /// The slices between each elevation and the next, and between each azimuth and the next, made when they
    /// are needed.
    midway: [Vec<OnceLock<Slice>>; 2],
}

impl Grid<'_> {
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

    /// The slice midway between a view and that of the next elevation (`way` 0) or azimuth (1).
    fn midway(&self, way: usize, i: usize, j: usize) -> &Slice {
        let j = j % self.half;
        let place = &self.midway[way][i * self.half + j];
        let step = if way == 0 { [0.5, 0.0] } else { [0.0, 0.5] };
        place.get_or_init(|| self.slice(i as f64 + step[0], j as f64 + step[1]))
    }

    /// The candidate fits of an azimuth.
    fn column(&self, j: usize, task: &Task) -> Result<Column, Cancelled> {
        let slices: Vec<Slice> = (1..self.size[0]).map(|i| self.slice(i as f64, j as f64)).collect();
        let found = chain::candidates(&slices, self.kind, task)?;
        Ok(Column { slices: Arc::new(slices), found, chosen: Vec::new() })
    }

    /// The fit of the view along the normal, which all azimuths share. Candidates are the mean of the fits of
    /// the next elevation, the result of a search started from that mean, and the results of independent
    /// searches; the one that interpolates best with the next elevation is chosen.
    fn top(&self, columns: &[Column]) -> (Slice, Fitted) {
        let slice = Slice::new(self.brdf, self.diffuse, [0.0; 2], self.kind);
        let next: Vec<Fitted> =
            columns.iter().enumerate().map(|(j, c)| turned(&c.chosen[0], -self.phi(j as f64))).collect();
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
            let at = |(j, column): (usize, &Column)| {
                let ends = own.max(column.norm(0, &column.chosen[0]));
                let top = turned(top, self.phi(j as f64));
                let middle = chain::between(self.midway(0, 0, j), &top.lobes, &column.chosen[0].lobes);
                own + chain::step(middle, ends, chain::JUMP)
            };
            columns.iter().enumerate().map(at).sum()
        };
        let costs: Vec<f64> = found.iter().map(cost).collect();
        let best = (0..found.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
        let best = found.swap_remove(best);
        (slice, best)
    }

    /// The neighbours of azimuth `j` that are chosen.
    fn beside(&self, columns: &[Column], j: usize) -> Vec<Beside<'_>> {
        let count = columns.len();
        let before = (j + count - 1) % count;
        let neighbours = [(before, before), ((j + 1) % count, j)];
        let chosen = neighbours.into_iter().filter(|(k, _)| !columns[*k].chosen.is_empty());
        let of = |(k, from): (usize, usize)| {
            let (column, rows) = (&columns[k], (1..self.size[0]).into_par_iter().with_max_len(1));
            let norm = |(i, f)| column.norm(i, f);
            Beside {
                fits: column.chosen.clone(),
                norms: column.chosen.iter().enumerate().map(norm).collect(),
                midway: rows.map(|i| self.midway(1, i, from)).collect(),
            }
        };
        chosen.map(of).collect()
    }

    /// Does anything jump between the column's choice and its neighbours?
    fn jumps(column: &Column, beside: &[Beside<'_>]) -> bool {
        let one = |b: &Beside<'_>, i: usize| {
            let ends = b.norms[i].max(column.norm(i, &column.chosen[i]));
            chain::midway(b.midway[i], &b.fits[i], &column.chosen[i]) > (1.25 * ends).max(MIN_JUMP)
        };
        beside.iter().any(|b| (0..column.chosen.len()).any(|i| one(b, i)))
    }

    /// Chooses among the candidates, and the results of searches from the neighbours' fits, so that
    /// interpolation towards the neighbours jumps little.
    fn choose(&self, column: &mut Column, j: usize, beside: &[Beside<'_>]) -> Vec<Fitted> {
        let views = self.size[0] - 1;
        let rows = |count: usize| (0..count).into_par_iter().with_max_len(1);
        for b in beside {
            let follow = |i: usize| refine::follow(&column.slices[i], &b.fits[i], self.kind);
            let more: Vec<Fitted> = rows(views).map(follow).collect();
            column.found.iter_mut().zip(more).for_each(|(found, more)| found.push(more));
        }
        column.found.iter_mut().for_each(chain::distinct);
        let between: Vec<&Slice> = rows(views - 1).map(|i| self.midway(0, i + 1, j)).collect();
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
    fn align(&self, columns: &mut [Column]) {
        let (rows, count) = (self.size[0] - 1, columns.len());
        let of = |i: usize, j: usize| &columns[j].chosen[i].lobes;
        let up = (1..rows).flat_map(|i| (0..count).map(move |j| ([i - 1, j], [i, j], [0, i])));
        let aside =
            (0..rows).flat_map(|i| (0..count).map(move |j| ([i, j], [i, (j + 1) % count], [1, i + 1])));
        let pairs: Vec<_> = up.chain(aside).collect();
        // The best order of the second view's lobes for the first, and its error midway.
        let best = |([i, j], [k, l], [way, at]): &([usize; 2], [usize; 2], [usize; 2])| {
            let (slice, lobes) = (self.midway(*way, *at, *j), of(*k, *l));
            let error = |order: &Vec<usize>| {
                let b: Vec<GaussianLobe> = order.iter().map(|p| lobes[*p]).collect();
                chain::between(slice, of(*i, *j), &b)
            };
            let orders = order::permutations(lobes.len());
            let all = orders.into_iter().map(|o| (error(&o), o));
            let (error, order) = all.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or_default();
            (error, j * rows + i, l * rows + k, order)
        };
        let mut links: Vec<(f64, usize, usize, Vec<usize>)> =
            pairs.par_iter().with_max_len(8).map(best).collect();
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
            let fit = &mut columns[view / rows].chosen[view % rows];
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
    let (lobes, keep) = (plan.lobes.clamp(1, MAX_LOBES), plan.objective == Objective::Energy);
    let kind = Kind { lobes, keep, stretched: true, turned: true };
    let size = [plan.views.max(2), plan.azimuths.max(MIN_AZIMUTHS)];
    let count = size[1];
    // Where half a turn changes nothing, half of the searches suffice.
    let half = if count.is_multiple_of(2) && is_even(brdf) { count / 2 } else { count };
    let midway = [(); 2].map(|()| (0..size[0] * half).map(|_| OnceLock::new()).collect());
    let grid = Grid { brdf, kind, diffuse: chain::diffuse(brdf, kind), size, half, midway };
    task.begin("fitting", (half + AZIMUTH_ROUNDS * count) as u64);
    let quiet = task.clone().without_progress();
    let column = |j: usize| {
        task.advance(1);
        grid.column(j, &quiet)
    };
    let columns: Vec<Result<Column, Cancelled>> =
        (0..half).into_par_iter().with_max_len(1).map(column).collect();
    let mut columns = columns.into_iter().collect::<Result<Vec<Column>, Cancelled>>()?;
    columns.extend_from_within(..count - half);
    for round in 0..AZIMUTH_ROUNDS {
        for j in 0..count {
            task.check()?;
            task.advance(1);
            let beside = grid.beside(&columns, j);
            if round == 0 || Grid::jumps(&columns[j], &beside) {
                let chosen = grid.choose(&mut columns[j], j, &beside);
                columns[j].chosen = chosen;
            }
        }
    }
    task.end();
    grid.align(&mut columns);
    let (slice, top) = grid.top(&columns);
    let places = (0..size[0]).flat_map(|i| (0..count).map(move |j| (i, j)));
    // Where azimuths half a turn apart are equivalent, they share their slices.
    let view = |(i, j): (usize, usize)| {
        let (column, phi) = (&columns[j], grid.phi(j as f64));
        let (report, lobes) = match i {
            0 => (slice.report(&top), turned(&top, phi).lobes),
            _ => (column.slices[i - 1].report(&column.chosen[i - 1]), column.chosen[i - 1].lobes.clone()),
        };
        (SliceReport { phi, ..report }, lobes)
    };
    let (report, views) = places.map(view).unzip();
    Ok(GaussianFit { azimuths: count, report, ..GaussianFit::isotropic(grid.diffuse, views) })
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

//! All elevations together: the minima that searches find at each, and which of them follow each other best.

use super::refine::{self, Fitted, Kind};
use super::slice::{self, Slice};
use super::{GaussianLobe, order};
use crate::Brdf;
use std::borrow::Borrow;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;

/// Squared relative errors below this count as 0: relative errors of 0.3 %. Half and twice choose the same
/// diffuse parts of GGX, measured chrome and Oren and Nayar's model.
const FLOOR: f64 = 1e-5;
/// Steps of searches that only compare diffuse parts. Four choose the same diffuse parts in those cases; 16
/// another one for GGX of alpha 0.4, whose mean error is 0.058 in place of 0.057.
const DIFFUSE_STEPS: usize = 8;
/// Cost of a jump between elevations of stretched lobes, relative to that of an error of its size. Half and
/// twice give the same fits in those cases.
pub(super) const JUMP: f64 = 4.0;

/// Chooses the diffuse part with which the geometric mean of the lobes' errors at some views is least:
/// grazing views have much larger errors than others, whatever the diffuse part is. For round lobes the error
/// is relative to all of f_cos. For stretched ones it is the geometric mean of that and of the error relative
/// to f_cos without the diffuse part: where a slightly smaller diffuse part hardly changes the first error,
/// it leaves the lobes a definite shape to fit instead of a small remainder. No candidate exceeds the albedo
/// of any of these views: where the albedo is kept, nothing would be left of it for the highlight.
pub(super) fn diffuse(brdf: &dyn Brdf, kind: Kind) -> [f64; 3] {
    let views = [10.0f64, 35.0, 60.0, 75.0, 85.0].map(f64::to_radians);
    // An azimuth between those that anisotropic reflectance is often symmetric about.
    let phi = if kind.turned { 0.7 } else { 0.0 };
    let wholes = views.map(|theta| Slice::new(brdf, [0.0; 3], [theta, phi], kind));
    let mut most = [f64::INFINITY; 3];
    for whole in &wholes {
        most.iter_mut().zip(whole.albedo).for_each(|(m, a)| *m = m.min(a.max(0.0)));
    }
    let mean_error = |diffuse: [f64; 3]| -> f64 {
        let error = |whole: &Slice| {
            let slice = whole.less(diffuse);
            let steps = if kind.stretched { DIFFUSE_STEPS } else { refine::STEPS };
            let fit = refine::search(&slice, kind, 1, steps).pop();
            let part = |of: f64, e: f64| (FLOOR + e / of.max(1e-300)).ln() / views.len() as f64;
            fit.map_or(0.0, |f| {
                let [own, all] = slice.square.map(|of| part(of, f.error));
                if kind.stretched { 0.5 * (own + all) } else { all }
            })
        };
        wholes.each_ref().map(error).iter().sum()
    };
    let tried: Vec<[f64; 3]> = slice::diffuse(brdf, kind.stretched)
        .into_iter()
        .map(|found| std::array::from_fn(|c| f64::min(found[c], most[c])))
        .collect();
    let means: Vec<f64> = tried.par_iter().with_max_len(1).map(|diffuse| mean_error(*diffuse)).collect();
    let mut best = (f64::INFINITY, [0.0; 3]);
    for (mean, diffuse) in means.into_iter().zip(tried) {
        // A larger one must be worth it.
        if mean < best.0 - 0.05 {
            best = (mean, diffuse);
        }
    }
    best.1
}

/// Minima at every slice: from its own moments, and from the neighbours' on the way there and back.
pub(super) fn candidates(slices: &[Slice], kind: Kind, task: &Task) -> Result<Vec<Vec<Fitted>>, Cancelled> {
    let mut found: Vec<Vec<Fitted>> = Vec::with_capacity(slices.len());
    task.begin("fitting", 2 * slices.len() as u64);
    let searched = |slice: &Slice| {
        task.check()?;
        let all = refine::search(slice, kind, 3, refine::STEPS);
        task.advance(1);
        Ok(all)
    };
    let searched: Vec<Result<Vec<Fitted>, Cancelled>> =
        slices.par_iter().with_max_len(1).map(searched).collect();
    let mut forth: Option<Fitted> = None;
    for (slice, all) in slices.iter().zip(searched) {
        task.check()?;
        let mut all = all?;
        forth = match forth {
            Some(before) => Some(refine::follow(slice, &before, kind)),
            None => least(all.clone()),
        };
        all.extend(forth.clone());
        found.push(all);
    }
    let mut back: Option<Fitted> = None;
    for (slice, all) in slices.iter().zip(&mut found).rev() {
        task.check()?;
        back = match back {
            Some(after) => Some(refine::follow(slice, &after, kind)),
            None => least(all.clone()),
        };
        all.extend(back.clone());
        task.advance(1);
    }
    task.end();
    if kind.stretched {
        found.iter_mut().for_each(distinct);
    }
    Ok(found)
}

/// Drops minima that are found twice, and those with more than twice the least error (norm).
pub(super) fn distinct(all: &mut Vec<Fitted>) {
    let least = all.iter().map(|f| f.error).fold(f64::INFINITY, f64::min);
    all.retain(|f| f.error <= 4.0 * least);
    let mut kept: Vec<Fitted> = Vec::with_capacity(all.len());
    for fit in all.drain(..) {
        let same = |k: &Fitted| {
            let ordered = order::after(&k.lobes, &fit.lobes);
            let close = |(a, b): (&GaussianLobe, &GaussianLobe)| {
                let (narrow, long) = (a.sigma.min(b.sigma), a.along().min(b.along()));
                (a.angle - b.angle).hypot(a.aside - b.aside) < 0.05 * long
                    && (a.sigma - b.sigma).abs() < 0.03 * narrow
                    && (a.along() - b.along()).abs() < 0.03 * long
            };
            (k.error - fit.error).abs() < 0.02 * fit.error && k.lobes.iter().zip(&ordered).all(close)
        };
        if !kept.iter().any(same) {
            kept.push(fit);
        }
    }
    *all = kept;
}

/// Where interpolation between two slices has a much larger error than both, adds to each the minimum of a
/// search started at the other's fit. Returns whether there were any.
pub(super) fn mend(
    slices: &[Slice],
    found: &mut [Vec<Fitted>],
    between: &[Slice],
    path: &[usize],
    kind: Kind,
) -> bool {
    let mut any = false;
    for i in 1..slices.len() {
        let (a, b) = (found[i - 1][path[i - 1]].clone(), found[i][path[i]].clone());
        let norm = |k: usize, f: &Fitted| (f.error / slices[k].square[0].max(1e-300)).sqrt();
        let worse = norm(i - 1, &a).max(norm(i, &b));
        if midway(&between[i - 1], &a, &b) > 1.2 * worse {
            found[i].push(refine::follow(&slices[i], &a, kind));
            found[i - 1].push(refine::follow(&slices[i - 1], &b, kind));
            any = true;
        }
    }
    any
}

/// The candidate of least error; of equals the first.
pub(super) fn least(all: Vec<Fitted>) -> Option<Fitted> {
    all.into_iter().reduce(|a, b| if b.error < 0.9999 * a.error { b } else { a })
}

/// The relative errors of interpolation midway between the candidates of each slice and those of the slice
/// before: by slice, its candidates, and those before. `between` are the slices midway.
pub(super) fn midways<S: Borrow<Slice> + Sync>(found: &[Vec<Fitted>], between: &[S]) -> Vec<Vec<Vec<f64>>> {
    let of = |i: usize| {
        let to = |f: &Fitted| found[i].iter().map(|b| midway(between[i].borrow(), b, f)).collect();
        found[i + 1].iter().map(to).collect()
    };
    (0..between.len()).into_par_iter().with_max_len(1).map(of).collect()
}

/// Chooses one candidate of every slice, so that the sum of the relative errors (norms) at the slices and
/// midway between them is least (Viterbi 1967), where [`step`] weights jumps by `jump`; returns their indices
/// in `found`. `middles` are [`midways`]; `more` is an additional cost of a slice's candidate.
pub(super) fn smoothest(
    slices: &[Slice],
    found: &[Vec<Fitted>],
    middles: &[Vec<Vec<f64>>],
    jump: f64,
    more: &dyn Fn(usize, usize) -> f64,
) -> Vec<usize> {
    let own = |i: usize, f: &Fitted| (f.error / slices[i].square[0].max(1e-300)).sqrt();
    let mut costs: Vec<f64> = found[0].iter().enumerate().map(|(k, f)| own(0, f) + more(0, k)).collect();
    let mut from: Vec<Vec<usize>> = Vec::new();
    for i in 1..slices.len() {
        let mut next = Vec::with_capacity(found[i].len());
        let mut came = Vec::with_capacity(found[i].len());
        for (n, fit) in found[i].iter().enumerate() {
            let cost = |k: usize| {
                let ends = own(i - 1, &found[i - 1][k]).max(own(i, fit));
                costs[k] + step(middles[i - 1][n][k], ends, jump)
            };
            let all = (0..found[i - 1].len()).map(|k| (k, cost(k)));
            let (k, cost) = all.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
            next.push(cost + own(i, fit) + more(i, n));
            came.push(k);
        }
        costs = next;
        from.push(came);
    }
    let mut k = (0..costs.len()).min_by(|a, b| costs[*a].total_cmp(&costs[*b])).unwrap_or(0);
    let mut path = vec![k];
    for came in from.iter().rev() {
        k = came[k];
        path.push(k);
    }
    path.reverse();
    path
}

/// Cost of an error midway, where the larger of the errors at both ends is `ends`.
pub(super) fn step(middle: f64, ends: f64, jump: f64) -> f64 {
    // Beyond a quarter more it is a jump.
    middle + jump * (middle - 1.25 * ends).max(0.0)
}

/// The relative error of interpolation midway between two fits.
pub(super) fn midway(slice: &Slice, a: &Fitted, b: &Fitted) -> f64 {
    between(slice, &a.lobes, &order::after(&a.lobes, &b.lobes))
}

/// The relative error of interpolation midway between lobes that are in one order.
pub(super) fn between(slice: &Slice, a: &[GaussianLobe], b: &[GaussianLobe]) -> f64 {
    let lobes: Vec<GaussianLobe> = a.iter().zip(b).map(|(a, b)| a.towards(b, 0.5)).collect();
    slice.norm(&lobes)
}

//! All elevations together: the minima that searches find at each, and which of them follow each other best.

use super::order;
use super::refine::{self, Fitted};
use super::slice::{self, Slice};
use crate::Brdf;
use steradian_base::{Cancelled, Task};

/// Errors below it, squared, are as good as none.
const FLOOR: f64 = 1e-5;

/// Of the possible diffuse parts the one with which the lobes of some views err least, in the geometric mean: grazing views err
/// much more than others, whatever the diffuse part is. None is more than what any of these
/// views sends back: where the albedo is kept, nothing would be left of it for the highlight.
pub(super) fn diffuse(brdf: &dyn Brdf, lobes: usize, keep: bool) -> [f64; 3] {
    let views = [10.0f64, 35.0, 60.0, 75.0, 85.0].map(f64::to_radians);
    let mut most = [f64::INFINITY; 3];
    for theta in views {
        let whole = Slice::new(brdf, [0.0; 3], theta);
        most.iter_mut().zip(whole.albedo).for_each(|(m, a)| *m = m.min(a.max(0.0)));
    }
    let mut best = (f64::INFINITY, [0.0; 3]);
    for found in slice::diffuse(brdf) {
        let diffuse = std::array::from_fn(|c| f64::min(found[c], most[c]));
        let error = |theta: f64| {
            let slice = Slice::new(brdf, diffuse, theta);
            let fit = refine::search(&slice, lobes, keep, 1).pop();
            fit.map_or(0.0, |f| (FLOOR + f.error / slice.square[1].max(1e-300)).ln() / views.len() as f64)
        };
        let mean = views.map(error).iter().sum();
        // A larger one must be worth it.
        if mean < best.0 - 0.05 {
            best = (mean, diffuse);
        }
    }
    best.1
}

/// Minima at every slice: from its own moments, and from the neighbours' on the way there and back.
pub(super) fn candidates(
    slices: &[Slice],
    lobes: usize,
    keep: bool,
    task: &Task,
) -> Result<Vec<Vec<Fitted>>, Cancelled> {
    let mut found: Vec<Vec<Fitted>> = Vec::with_capacity(slices.len());
    task.begin("fitting", 2 * slices.len() as u64);
    let mut forth: Option<Fitted> = None;
    for slice in slices {
        task.check()?;
        let mut all = refine::search(slice, lobes, keep, 3);
        forth = match forth {
            Some(before) => Some(refine::follow(slice, &before, keep)),
            None => least(all.clone()),
        };
        all.extend(forth.clone());
        found.push(all);
        task.advance(1);
    }
    let mut back: Option<Fitted> = None;
    for (slice, all) in slices.iter().zip(&mut found).rev() {
        task.check()?;
        back = match back {
            Some(after) => Some(refine::follow(slice, &after, keep)),
            None => least(all.clone()),
        };
        all.extend(back.clone());
        task.advance(1);
    }
    task.end();
    Ok(found)
}

/// The candidate of least error; of equals the first.
pub(super) fn least(all: Vec<Fitted>) -> Option<Fitted> {
    all.into_iter().reduce(|a, b| if b.error < 0.9999 * a.error { b } else { a })
}

/// One candidate of every slice, so that the sum of the relative errors (norms) at the slices and midway between them is least
/// (Viterbi 1967): their places in `found`. `between` are the slices midway.
pub(super) fn smoothest(slices: &[Slice], found: &[Vec<Fitted>], between: &[Slice]) -> Vec<usize> {
    let own = |i: usize, f: &Fitted| (f.error / slices[i].square[0].max(1e-300)).sqrt();
    let mut costs: Vec<f64> = found[0].iter().map(|f| own(0, f)).collect();
    let mut from: Vec<Vec<usize>> = Vec::new();
    for i in 1..slices.len() {
        let mut next = Vec::with_capacity(found[i].len());
        let mut came = Vec::with_capacity(found[i].len());
        for fit in &found[i] {
            let cost = |k: usize| costs[k] + midway(&between[i - 1], &found[i - 1][k], fit);
            let all = (0..found[i - 1].len()).map(|k| (k, cost(k)));
            let (k, cost) = all.min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 0.0));
            next.push(cost + own(i, fit));
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

/// The relative error of what is interpolated midway between two fits.
fn midway(slice: &Slice, a: &Fitted, b: &Fitted) -> f64 {
    let ordered = order::after(&a.lobes, &b.lobes);
    let lobes = a.lobes.iter().zip(&ordered).map(|(a, b)| a.towards(b, 0.5)).collect();
    slice.report(&Fitted { lobes, error: f64::NAN, converged: true }).norm()
}

//! One order of the lobes for all elevations, so that interpolation is between corresponding lobes.

use super::GaussianLobe;
use super::refine::Fitted;

/// Sorts the lobes of the first elevation by width, and puts those of every other into the order in which
/// they are least different from those before.
pub(super) fn align(fits: &mut [Fitted]) {
    if let Some(first) = fits.first_mut() {
        first.lobes.sort_by(|a, b| a.sigma.total_cmp(&b.sigma));
    }
    for i in 1..fits.len() {
        let (before, rest) = fits.split_at_mut(i);
        if let (Some(before), Some(next)) = (before.last(), rest.first_mut()) {
            next.lobes = after(&before.lobes, &next.lobes);
        }
    }
}

/// `lobes` in the order in which they are least different from those `before`.
pub(super) fn after(before: &[GaussianLobe], lobes: &[GaussianLobe]) -> Vec<GaussianLobe> {
    let cost =
        |order: &[usize]| -> f64 { order.iter().zip(before).map(|(k, b)| difference(b, &lobes[*k])).sum() };
    let orders = permutations(lobes.len());
    let best = orders.iter().min_by(|a, b| cost(a).total_cmp(&cost(b)));
    best.map_or_else(|| lobes.to_vec(), |order| order.iter().map(|k| lobes[*k]).collect())
}

/// Difference of two lobes, in width and in position relative to the widths, weighted by the lobes' weight.
fn difference(a: &GaussianLobe, b: &GaussianLobe) -> f64 {
    let stretch = (a.along() / a.sigma * b.sigma / b.along()).ln().abs();
    let long = (a.along() / a.sigma).min(b.along() / b.sigma).ln();
    let width = (a.sigma / b.sigma).ln().abs() + 0.5 * stretch + long * (a.turn - b.turn).sin().abs();
    let place = (a.angle - b.angle).hypot(a.aside - b.aside) / (a.along() + b.along());
    let weight = |l: &GaussianLobe| l.weight.iter().sum::<f64>();
    (width + place) * (weight(a) + weight(b)) + (weight(a) - weight(b)).abs()
}

/// All orders of so many.
pub(super) fn permutations(n: usize) -> Vec<Vec<usize>> {
    let mut all = vec![Vec::new()];
    for k in 0..n {
        all = all
            .iter()
            .flat_map(|p: &Vec<usize>| {
                (0..=p.len()).map(move |at| {
                    let mut q = p.clone();
                    q.insert(at, k);
                    q
                })
            })
            .collect();
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lobes_keep_their_places() {
        let lobe = |sigma: f64, w: f64| GaussianLobe { sigma, weight: [w; 3], ..GaussianLobe::default() };
        let fit = |lobes: Vec<GaussianLobe>| Fitted { lobes, error: 0.0, converged: true };
        let (a, b, c) = (lobe(0.1, 0.5), lobe(0.3, 0.2), lobe(0.9, 0.1));
        let mut fits = [fit(vec![c, a, b]), fit(vec![b, c, a]), fit(vec![a, c, b])];
        align(&mut fits);
        assert!(fits.iter().all(|f| f.lobes == [a, b, c]));
        assert_eq!(permutations(4).len(), 24);
    }
}

//! Panels of an interval, finer around the lobes of a reflectance, and Gauss–Legendre rules on them.

/// Ratio of the lengths of panels, going away from a lobe.
const GRADING: f64 = 2.5;

/// Borders of panels over [a, b]: each (centre, width) begins one, and from there panels grow by the factor
/// [`GRADING`], the first `width` long. Panels shorter than `short` are merged into their neighbours; the
/// ends stay.
pub(super) fn panels([a, b]: [f64; 2], places: &[(f64, f64)], short: f64) -> Vec<f64> {
    let mut borders = vec![a, b];
    for &(centre, width) in places {
        borders.push(centre);
        let mut step = width;
        while step < b - a {
            borders.extend([centre - step, centre + step]);
            step *= GRADING;
        }
    }
    borders.retain(|x| (a..=b).contains(x));
    borders.sort_by(f64::total_cmp);
    borders.dedup_by(|x, y| *x - *y < short);
    if let Some(last) = borders.last_mut() {
        *last = b;
    }
    borders
}

/// Nodes and weights of a rule, given by its own nodes in [−1, 1] and its weights, on each of `parts` equal
/// parts of a panel.
pub(super) fn composite<'a>(
    panel: &'a [f64],
    parts: f64,
    (x, w): &'a (Vec<f64>, Vec<f64>),
) -> impl Iterator<Item = [f64; 2]> + 'a {
    let h = (panel[1] - panel[0]) / parts;
    (0..parts as usize).flat_map(move |k| {
        let middle = panel[0] + h * (k as f64 + 0.5);
        x.iter().zip(w).map(move |(x, w)| [middle + 0.5 * h * x, 0.5 * h * w])
    })
}

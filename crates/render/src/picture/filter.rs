//! Sub-pixel positions and the reconstruction filter.

/// The k-th of n² positions in a pixel: the canonical arrangement of Kensler 2013, "Correlated Multi-Jittered
/// Sampling", without jitter. Every position has a row and a column of n² of its own.
pub fn position(k: usize, n: usize) -> (f32, f32) {
    let (i, j, m) = ((k % n) as f32, (k / n) as f32, n as f32);
    ((i + (j + 0.5) / m) / m, (j + (i + 0.5) / m) / m)
}

/// Radius of the filter in pixels.
const RADIUS: f32 = 1.25;

/// The quadratic B-spline scaled to a radius of 1.25 pixels: smooth, never negative, no ringing around suns.
#[inline]
fn weight(x: f32) -> f32 {
    let x = x.abs() * (1.5 / RADIUS);
    if x < 0.5 {
        0.75 - x * x
    } else if x < 1.5 {
        0.5 * (1.5 - x) * (1.5 - x)
    } else {
        0.0
    }
}

/// Weights of a sample at `x` in 0 … 1 of its pixel for the pixel before, its own and the one after.
#[inline]
pub fn weights(x: f32) -> [f32; 3] {
    [weight(x + 0.5), weight(x - 0.5), weight(x - 1.5)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_lie_in_strata_of_their_own() {
        for n in 1..6 {
            let cell = |v: f32| (v * (n * n) as f32) as usize;
            let columns: std::collections::BTreeSet<_> = (0..n * n).map(|k| cell(position(k, n).0)).collect();
            let rows: std::collections::BTreeSet<_> = (0..n * n).map(|k| cell(position(k, n).1)).collect();
            assert_eq!((columns.len(), rows.len()), (n * n, n * n));
        }
    }

    #[test]
    fn the_filter_reaches_no_further_than_the_neighbours() {
        assert_eq!(weight(RADIUS), 0.0);
        let w = weights(0.5);
        assert!(w[1] > w[0] && (w[0] - w[2]).abs() < 1e-6);
    }
}

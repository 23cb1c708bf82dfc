//! Search for small disks whose removal from the light, in addition to suns, helps the slices most.

use super::scaled::{Scaled, both};
use steradian_base::{Cancelled, Task};
use steradian_prefilter::Apart;
use steradian_prefilter::MatchingPursuit;

/// Angular radius of the disks, radians: a little less than the sun's, below what the highest band resolves.
const RADIUS: f64 = 0.004;
/// Band above which maps of grazing views become expensive; the weight of lower bands is reduced.
const EASY: f64 = 24.0;
/// Angle of view, radians, beyond which slices are expensive; only these views count.
const HARD: f64 = 0.9;

/// The lobes' energy at such views, by band, per coefficient, with the weight of low bands reduced.
fn weights(scaled: &Scaled<'_>, order: usize) -> Vec<f64> {
    let s = scaled.s;
    let hard = |i: &usize| scaled.counts(*i) && (s.azimuth == 0 || scaled.angle(*i) > HARD);
    let mut w = vec![0.0; order + 1];
    for i in (0..scaled.len()).filter(hard) {
        for q in 0..=s.azimuth {
            for (c, row) in s.row(i, q).into_iter().enumerate() {
                let share = both(q) * scaled.share(i, c) / scaled.scale[i][c].powi(2);
                w.iter_mut().zip(row).for_each(|(w, k)| *w += share * k * k);
            }
        }
    }
    // Bands beyond the slices' own are assumed to be like the last one.
    let last = w.get(s.order).copied().unwrap_or(0.0);
    w.iter_mut().skip(s.order + 1).for_each(|w| *w = last);
    for (l, w) in w.iter_mut().enumerate() {
        let x = (l as f64 / EASY).powi(4);
        *w *= x / ((1.0 + x) * (2 * l + 1) as f64);
    }
    w
}

/// Up to `most` disks.
pub fn pursue(
    apart: &Apart,
    scaled: &Scaled<'_>,
    most: usize,
    task: &Task,
) -> Result<MatchingPursuit, Cancelled> {
    let light = &apart.rest;
    MatchingPursuit::new(light, &weights(scaled, light.order), RADIUS, most, task)
}

/// The first `count` disks of those found taken out too.
pub fn with(apart: &Apart, found: &MatchingPursuit, count: usize) -> Apart {
    apart.with(&found.small_lights(&apart.rest, count))
}

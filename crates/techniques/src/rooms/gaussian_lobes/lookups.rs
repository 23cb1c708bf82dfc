//! Rows of tables by the elevation of the view, and the lookups of a lobe.

use super::params::MAX_TAPS;
use crate::shared::maths::angle::{angle, sin_cos};
use std::sync::LazyLock;
use steradian_brdf::fit::gaussian::LAST;

/// 1 over the last elevation.
pub(super) const SCALE: f32 = (1.0 / LAST) as f32;

/// Row `i` + x · (rows − 1) of a table, linear.
#[inline(always)]
pub(super) fn row(table: &[[f32; 4]], first: usize, count: usize, x: f32) -> [f32; 4] {
    let at = x.clamp(0.0, 1.0) * (count - 1) as f32;
    let k = (at as usize).min(count - 2);
    let w = at - k as f32;
    let (a, b) = (table[first + k], table[first + k + 1]);
    std::array::from_fn(|c| a[c] + (b[c] - a[c]) * w)
}

/// r turned by `angle` away from n in the plane of both: cos a r + sin a (cos θ r − n)/sin θ.
#[inline(always)]
pub(super) fn mean(n: [f32; 3], r: [f32; 3], [sine, cos_o]: [f32; 2], angle: f32) -> [f32; 3] {
    let [s, c] = sin_cos(angle);
    let s = s / sine.max(1e-4);
    std::array::from_fn(|k| (c + s * cos_o) * r[k] - s * n[k])
}

/// Lookups: one, or three at least.
#[inline(always)]
pub(super) fn number(taps: f32) -> usize {
    if taps > 1.001 { (taps - 1e-3).ceil().max(3.0) as usize } else { 1 }
}

/// The lookups of a stretched lobe by their number: where each lies in standard deviations of the sweep, and
/// its weight of 1.
pub(super) static TAPS: LazyLock<Vec<Vec<[f32; 2]>>> =
    LazyLock::new(|| (0..=MAX_TAPS as usize).map(taps).collect());

/// Gaussian weights at evenly spaced places out to two standard deviations, stretched so that their variance
/// is 1.
fn taps(count: usize) -> Vec<[f32; 2]> {
    let place = |k: usize| (2 * k + 1) as f32 / count as f32 - 1.0;
    let weighed: Vec<[f32; 2]> = (0..count).map(|k| [place(k), (-2.0 * place(k).powi(2)).exp()]).collect();
    let all: f32 = weighed.iter().map(|[_, w]| w).sum();
    let square: f32 = weighed.iter().map(|[at, w]| at * at * w).sum();
    let scale = (all / square.max(1e-6)).sqrt();
    weighed.iter().map(|[at, w]| [at * scale, w / all]).collect()
}

/// The sine of θ_o, and θ_o over the last elevation.
#[inline(always)]
pub(super) fn elevation(cos_o: f32) -> [f32; 2] {
    let cosine = cos_o.min(1.0);
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    [sine, angle(sine, cosine) * SCALE]
}

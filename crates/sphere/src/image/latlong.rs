//! Lat-long to lat-long: separable, exact in φ and cos θ.

use super::{Filter, SphereImage};
use crate::layout::Layout;
use std::f64::consts::PI;
use steradian_parallel::prelude::*;

/// Axes that shrink are averaged exactly over the new cells; then axes that grow are interpolated.
pub fn resample(source: &SphereImage, width: usize, height: usize) -> SphereImage {
    let (w, h) = (width.min(source.width), height.min(source.height));
    let small = if (w, h) == (source.width, source.height) { None } else { Some(shrink(source, w, h)) };
    if (w, h) == (width, height) {
        return small.unwrap_or_else(|| source.clone());
    }
    let small = small.as_ref().unwrap_or(source);
    SphereImage::from_fn(Layout::LatLong, width, height, |d| small.lookup(Filter::CatmullRom, d))
}

/// For each of `n` new cells the old cells that it overlaps and their shares; `edge` gives the coordinate of
/// border k of a grid of `of` cells.
fn overlaps(n: usize, old: usize, edge: impl Fn(usize, usize) -> f64) -> Vec<Vec<(usize, f64)>> {
    (0..n)
        .map(|k| {
            let (a, b) = (edge(k, n), edge(k + 1, n));
            let first = (k * old / n).saturating_sub(1);
            let last = ((k + 1) * old / n + 1).min(old);
            (first..last)
                .filter_map(|s| {
                    let share = (edge(s + 1, old).min(b) - edge(s, old).max(a)) / (b - a);
                    (share > 1e-15).then_some((s, share))
                })
                .collect()
        })
        .collect()
}

fn shrink(source: &SphereImage, width: usize, height: usize) -> SphereImage {
    let columns = overlaps(width, source.width, |k, n| k as f64 / n as f64);
    // 1 − cos θ = 2 sin²(θ/2), which is exact near both poles when taken from the nearer one.
    let rows = overlaps(height, source.height, |k, n| {
        let half = |k: usize| (0.5 * PI * k as f64 / n as f64).sin().powi(2);
        if 2 * k <= n { half(k) } else { 1.0 - half(n - k) }
    });
    let mut out = SphereImage::new(Layout::LatLong, width, height);
    for (plane, target) in source.planes.iter().zip(&mut out.planes) {
        target.par_chunks_mut(width).zip(&rows).for_each(|(line, rows)| {
            let mut mean = vec![0.0f64; source.width];
            for &(j, share) in rows {
                let row = &plane[j * source.width..(j + 1) * source.width];
                mean.iter_mut().zip(row).for_each(|(m, &v)| *m += share * f64::from(v));
            }
            for (v, columns) in line.iter_mut().zip(&columns) {
                *v = columns.iter().map(|&(i, share)| share * mean[i]).sum::<f64>() as f32;
            }
        });
    }
    out
}

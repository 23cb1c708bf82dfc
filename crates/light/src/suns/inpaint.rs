//! Filling the place of a sun from around it.

use super::moments::{Grid, Moments};
use steradian_sphere::SphereImage;

/// Sweeps at most. Each leaves 1 − 2π/side of an error (Young 1954), so that 2.2 sides settle: 2000 suffice
/// for a square of 900 texels a side.
const MAX_SWEEPS: usize = 2000;
/// Change of a sweep, relative to the rim's mean, at which they end: what is left then is side/2π times as
/// much, 2e-5 of 137 texels, the widest sun by default (6°) in an image of 8192 × 4096.
const SETTLED: f64 = 1e-6;

/// Replaces `texels` by the function that solves Laplace's equation with the texels around as its rim, where
/// that is darker than what was there. What was taken away, per channel.
pub fn take(image: &mut SphereImage, grid: &Grid, texels: &[usize]) -> [Moments; 3] {
    let mut place = std::collections::HashMap::new();
    place.extend(texels.iter().enumerate().map(|(i, &k)| (k, i)));
    // Neighbours to the sides and above and below: the index of a texel of the region, or the rim's texel.
    let near: Vec<[Result<usize, usize>; 4]> = texels
        .iter()
        .map(|&k| {
            let around = grid.around(k);
            std::array::from_fn(|i| place.get(&around[i]).copied().ok_or(around[i]))
        })
        .collect();
    let across: Vec<f64> = texels.iter().map(|&k| (grid.sine(k).max(1e-3)).powi(-2)).collect();
    std::array::from_fn(|c| {
        let plane = &mut image.planes[c];
        let filled = laplace(&near, &across, |k| f64::from(plane[k]));
        let old: Vec<f64> = texels.iter().map(|&k| f64::from(plane[k])).collect();
        for (&k, v) in texels.iter().zip(&filled) {
            plane[k] = plane[k].min(*v as f32);
        }
        let lost: std::collections::HashMap<usize, f64> =
            texels.iter().zip(old).map(|(&k, old)| (k, old - f64::from(plane[k]))).collect();
        grid.moments_of(texels, |k| lost.get(&k).copied().unwrap_or(0.0))
    })
}

/// Gauss–Seidel with overrelaxation (Young 1954): the mean of the four around, sides weighted by 1/sin²θ.
fn laplace(near: &[[Result<usize, usize>; 4]], across: &[f64], rim: impl Fn(usize) -> f64) -> Vec<f64> {
    let known: Vec<f64> = near.iter().flatten().filter_map(|n| n.err()).map(&rim).collect();
    let start = known.iter().sum::<f64>() / known.len().max(1) as f64;
    let mut v = vec![start; near.len()];
    let side = (near.len() as f64).sqrt() + 1.0;
    let relax = 2.0 / (1.0 + std::f64::consts::PI / side);
    for _ in 0..MAX_SWEEPS {
        let mut moved: f64 = 0.0;
        for (i, n) in near.iter().enumerate() {
            let at = |n: Result<usize, usize>| n.map_or_else(&rim, |i| v[i]);
            let s = across[i];
            let mean = (s * (at(n[0]) + at(n[1])) + at(n[2]) + at(n[3])) / (2.0 * s + 2.0);
            let step = relax * (mean - v[i]);
            v[i] += step;
            moved = moved.max(step.abs());
        }
        if moved <= SETTLED * start.abs() {
            break;
        }
    }
    v
}

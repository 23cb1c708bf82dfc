//! Twice as many texels each way, with every texel's mean kept.

use super::{Filter, SphereImage};
use steradian_parallel::prelude::*;

/// Each face's planes at 2 w × 2 h. Catmull–Rom at the quarter points; then each texel's four parts are drawn
/// towards their mean until they lie between the smallest and the largest of its 3 × 3 neighbourhood, and
/// shifted so that their mean is the texel: nothing undershoots, and sums over areas stay.
pub fn refine(image: &SphereImage) -> [Vec<f32>; 3] {
    let (w, h) = (image.width, image.height);
    let mut out: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; image.planes[0].len() * 4]);
    let rows = |plane: &mut Vec<f32>, c: usize| {
        plane.par_chunks_mut(4 * w).enumerate().for_each(|(row, pair)| {
            let (face, j) = (row / h, row % h);
            let lines = [-2, -1, 0, 1, 2].map(|dy| padded(image, face, j as isize + dy, c));
            let (upper, lower) = pair.split_at_mut(2 * w);
            for i in 0..w {
                let parts = split(&lines, i);
                upper[2 * i..2 * i + 2].copy_from_slice(&parts[..2]);
                lower[2 * i..2 * i + 2].copy_from_slice(&parts[2..]);
            }
        });
    };
    for (c, plane) in out.iter_mut().enumerate() {
        rows(plane, c);
    }
    out
}

/// Row `j` of a channel with two texels more on either side.
fn padded(image: &SphereImage, face: usize, j: isize, c: usize) -> Vec<f32> {
    let w = image.width as isize;
    let mut line = Vec::with_capacity(image.width + 4);
    let fetch = |i: isize| image.fetch(Filter::CatmullRom, face, i, j)[c] as f32;
    line.extend([-2, -1].map(fetch));
    if (0..image.height as isize).contains(&j) {
        let at = image.index(face, 0, j as usize);
        line.extend_from_slice(&image.planes[c][at..at + image.width]);
    } else {
        line.extend((0..w).map(fetch));
    }
    line.extend([w, w + 1].map(fetch));
    line
}

/// The four parts of texel i: upper left, upper right, lower left, lower right.
fn split(lines: &[Vec<f32>; 5], i: usize) -> [f32; 4] {
    /// Catmull–Rom at t = ¼: the texels at −1, 0, 1, 2.
    const Q: [f32; 4] = [-0.0703125, 0.8671875, 0.2265625, -0.0234375];
    let here = lines[2][i + 2];
    let (mut left, mut right) = ([0.0f32; 5], [0.0f32; 5]);
    let (mut low, mut high) = (here, here);
    for (k, line) in lines.iter().enumerate() {
        let v = &line[i..i + 5];
        left[k] = Q[3] * v[0] + Q[2] * v[1] + Q[1] * v[2] + Q[0] * v[3];
        right[k] = Q[0] * v[1] + Q[1] * v[2] + Q[2] * v[3] + Q[3] * v[4];
        if (1..4).contains(&k) {
            for &v in &v[1..4] {
                (low, high) = (low.min(v), high.max(v));
            }
        }
    }
    let upper = |v: &[f32; 5]| Q[3] * v[0] + Q[2] * v[1] + Q[1] * v[2] + Q[0] * v[3];
    let lower = |v: &[f32; 5]| Q[0] * v[1] + Q[1] * v[2] + Q[2] * v[3] + Q[3] * v[4];
    let mut parts = [upper(&left), upper(&right), lower(&left), lower(&right)];
    let mean = 0.25 * (parts[0] + parts[1] + parts[2] + parts[3]);
    let mut share = 1.0f32;
    for p in &mut parts {
        *p -= mean;
        let room = if *p < 0.0 { here - low } else { high - here };
        if p.abs() > room {
            share = share.min(room / p.abs());
        }
    }
    parts.map(|p| here + share * p)
}

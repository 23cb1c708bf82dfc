//! Means of a lat-long image over the texels of a cube map: exact for radiance that is constant over each
//! cell.
//!
//! In azimuth φ and height y = cos θ the solid angle is dφ dy, and the integral over any region is ∮ F dφ
//! around it, where F(φ, y) = ∫ L dy from a fixed height down to y (Green). F is piecewise linear in y and
//! constant in φ, so that along a side of a texel only two numbers count in each cell: Δφ and ∫ y dφ.
//! Neighbours share their sides: what one texel gains another loses, and ∫ L dω is kept to rounding.
//!
//! Sides that run up and down the four upright faces are meridians (dφ = 0). The others are great circles
//! y(a) = −t c/√(1 + t² c²), c = cos a, at azimuth a from the face's middle and height t on its plane; on the
//! top face a side z = t passes x at ψ = atan(x/t), at height y = 1/√(1 + x² + t²). Pieces are at most
//! [`STEP`] long: Simpson's rule is good to 1e-10 for the former, and a series for small angles to 1e-10 for
//! the latter.

mod cap;
mod columns;

use self::cap::Cap;
use self::columns::{Columns, Walk};
use super::SphereImage;
use crate::layout::{Layout, cube};
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_parallel::prelude::*;

/// Longest piece of a side in azimuth, radians.
const STEP: f64 = 0.05;

/// Columns of a face that are made together.
const TOGETHER: usize = 8;

/// The upright faces +X −X +Z −Z and the azimuth of their middles; s runs towards falling azimuth.
const UPRIGHT: [(usize, f64); 4] = [(0, 0.0), (1, PI), (4, FRAC_PI_2), (5, -FRAC_PI_2)];

/// The mean of lat-long `source` over every texel of a cube map of `n` texels a side.
pub fn means(source: &SphereImage, n: usize) -> SphereImage {
    let mut out = SphereImage::new(Layout::Cube, n, n);
    if n == 0 || source.width == 0 || source.height == 0 {
        return out;
    }
    let job = Job::new(source, n);
    for (face, middle) in UPRIGHT {
        let blocks: Vec<Vec<[f64; 3]>> =
            (0..n.div_ceil(TOGETHER)).into_par_iter().map(|b| job.upright(middle, b * TOGETHER)).collect();
        for (b, block) in blocks.iter().enumerate() {
            for (k, v) in block.iter().enumerate() {
                job.put(&mut out, face, b * TOGETHER + k / n, k % n, *v);
            }
        }
    }
    let mut cap = Cap::new(&job);
    for face in [2, 3] {
        cap.turn_to(face == 3);
        job.level(&cap, |i, j, v| job.put(&mut out, face, i, if face == 3 { n - 1 - j } else { j }, v));
    }
    out
}

/// F and L at one cell: F(y) = `sum` + `value` (`top` − y).
struct Cell {
    sum: [f64; 3],
    value: [f64; 3],
    top: f64,
}

impl Cell {
    /// Adds ∫ F dφ over a piece of azimuth `turn` with ∫ y dφ = `lift`.
    #[inline(always)]
    fn add(&self, turn: f64, lift: f64, to: &mut [f64; 3]) {
        let drop = self.top * turn - lift;
        for c in 0..3 {
            to[c] += self.sum[c] * turn + self.value[c] * drop;
        }
    }
}

struct Job<'a> {
    source: &'a SphereImage,
    n: usize,
    /// Borders of the texels on the plane of a face, −1 … 1.
    borders: Vec<f64>,
    /// Solid angles of the texels of a face.
    areas: Vec<f64>,
    /// cos θ of the borders of the source's rows.
    rows: Vec<f64>,
    /// Parts of a column, so that no piece is longer than [`STEP`].
    parts: usize,
}

impl<'a> Job<'a> {
    fn new(source: &'a SphereImage, n: usize) -> Self {
        let (w, h) = (source.width as f64, source.height as f64);
        let row = |j: usize| (FRAC_PI_2 - PI * j as f64 / h).sin();
        let borders: Vec<f64> = (0..=n).map(|k| 2.0 * k as f64 / n as f64 - 1.0).collect();
        let area = |k: usize| {
            let (x, y) = (&borders[k % n..], &borders[k / n..]);
            cube::solid_angle(x[0], x[1], y[0], y[1])
        };
        Self {
            source,
            n,
            areas: (0..n * n).into_par_iter().with_min_len(1024).map(area).collect(),
            borders,
            rows: (0..=source.height).map(row).collect(),
            parts: (2.0 * PI / w / STEP).ceil().max(1.0) as usize,
        }
    }

    fn put(&self, out: &mut SphereImage, face: usize, i: usize, j: usize, sum: [f64; 3]) {
        let omega = self.areas[j * self.n + i];
        let k = out.index(face, i, j);
        (0..3).for_each(|c| out.planes[c][k] = (sum[c] / omega) as f32);
    }

    /// Integrals over texels of columns `first` … of an upright face, column after column.
    fn upright(&self, middle: f64, first: usize) -> Vec<[f64; 3]> {
        let last = (first + TOGETHER).min(self.n);
        // Column coordinate of azimuth a from the middle, counted from the seam without wrapping.
        let fine = (self.source.width * self.parts) as f64;
        let at = |a: f64| (0.5 + (middle + a) / (2.0 * PI)) * fine;
        // s grows as azimuth falls.
        let angle = |k: usize| -self.borders[k].atan();
        let from = (at(angle(last)) / self.parts as f64).floor() as i64;
        let to = (at(angle(first)) / self.parts as f64).ceil() as i64;
        let columns = Columns::new(self, from, (to - from).max(1) as usize);
        let mut out = vec![[0.0; 3]; (last - first) * self.n];
        let mut side = vec![[0.0; 3]; self.n + 1];
        let mut walk = Walk::default();
        for i in (first..last).rev() {
            side.fill([0.0; 3]);
            let (mut a, end) = (angle(i + 1), angle(i));
            while a < end {
                let column = (at(a) + 1e-9).floor();
                let border = ((column + 1.0) / fine - 0.5) * 2.0 * PI - middle;
                // y(a) turns round at the middle.
                let next = if a < 0.0 { border.min(0.0) } else { border }.min(end);
                let next = if next > a { next } else { end };
                let x = (column as i64).div_euclid(self.parts as i64) - from;
                columns.sides(x.clamp(0, columns.width as i64 - 1) as usize, (a, next), &mut walk, &mut side);
                a = next;
            }
            for (texel, k) in out[(i - first) * self.n..][..self.n].iter_mut().zip(0..) {
                *texel = std::array::from_fn(|c| side[k + 1][c] - side[k][c]);
            }
        }
        out
    }

    /// Integrals over the texels of the top face, or of the bottom face seen in a mirror.
    fn level(&self, cap: &Cap<'_, '_>, mut put: impl FnMut(usize, usize, [f64; 3])) {
        let n = self.n;
        let line = |k: usize, swapped: bool| cap.line(self.borders[k], swapped);
        let along: Vec<Vec<[f64; 3]>> = (0..=n).into_par_iter().map(|k| line(k, false)).collect();
        let across: Vec<Vec<[f64; 3]>> = (0..=n).into_par_iter().map(|k| line(k, true)).collect();
        for j in 0..n {
            for i in 0..n {
                let sides = [along[j][i], across[i + 1][j], along[j + 1][i], across[i][j]];
                let [a, b, c, d] = sides;
                put(i, j, std::array::from_fn(|k| a[k] + b[k] - c[k] - d[k]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Means by a fine grid of points.
    fn sampled(source: &SphereImage, n: usize, face: usize, i: usize, j: usize) -> [f64; 3] {
        const M: usize = 400;
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        for k in 0..M * M {
            let at = |i: usize, k: usize| 2.0 * (i as f64 + (k as f64 + 0.5) / M as f64) / n as f64 - 1.0;
            let (s, t) = (at(i, k % M), at(j, k / M));
            let w = (1.0 + s * s + t * t).powf(-1.5);
            let Some(d) = cube::direction(face, s, t) else { continue };
            let l = source.nearest(d);
            (0..3).for_each(|c| sum[c] += w * f64::from(l[c]));
            weight += w;
        }
        sum.map(|s| s / weight)
    }

    fn noise(width: usize, height: usize) -> SphereImage {
        let mut image = SphereImage::new(Layout::LatLong, width, height);
        for c in 0..3 {
            for (k, v) in image.planes[c].iter_mut().enumerate() {
                *v = ((k * (c + 3)) as f32 * 1.7).sin().powi(4) * if k % 97 == 3 { 10.0 } else { 1.0 };
            }
        }
        image
    }

    #[test]
    fn every_texel_is_the_mean_over_its_cell() {
        for (w, h, n) in [(64, 32, 6), (37, 19, 4), (40, 20, 3), (16, 8, 8), (8, 4, 1)] {
            let source = noise(w, h);
            let got = means(&source, n);
            for face in 0..6 {
                for (i, j) in [(0, 0), (n / 2, n / 2), (n - 1, n / 3), (n / 3, n - 1)] {
                    let (a, b) = (got.texel(face, i, j), sampled(&source, n, face, i, j));
                    for c in 0..3 {
                        let close = (f64::from(a[c]) - b[c]).abs() < 8e-3 * (0.2 + b[c]);
                        assert!(close, "{w} x {h} to {n}, face {face} {i} {j}: {a:?} {b:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn constants_and_integrals_are_kept() {
        for (w, h, n) in [(64, 32, 16), (37, 19, 5), (256, 128, 32), (4, 2, 3), (5, 3, 2)] {
            let one = SphereImage::from_fn(Layout::LatLong, w, h, |_| [1.0, 2.0, 0.0]);
            let got = means(&one, n);
            for k in 0..6 * n * n {
                assert!((got.planes[0][k] - 1.0).abs() < 2e-6, "{w} x {h} to {n}: {}", got.planes[0][k]);
            }
            let source = noise(w, h);
            for (a, b) in means(&source, n).integral().iter().zip(source.integral()) {
                assert!((a - b).abs() < 1e-6 * b, "{w} x {h} to {n}: {a} {b}");
            }
        }
    }
}

//! Means of a lat-long image over the texels of a cube map: exact for radiance that is constant over each cell.
//!
//! In azimuth φ and height y = cos θ the solid angle is dφ dy, and the integral over any region is ∮ F dφ around it,
//! where F(φ, y) = ∫ L dy from a fixed height down to y (Green). F is piecewise linear in y and constant in φ, so
//! that along a side of a texel only two numbers count in each cell: Δφ and ∫ y dφ. Neighbours share their sides:
//! what one texel gains another loses, and ∫ L dω is kept to rounding.
//!
//! Sides that run up and down the four upright faces are meridians (dφ = 0). The others are great circles
//! y(a) = −t c/√(1 + t² c²), c = cos a, at azimuth a from the face's middle and height t on its plane; on the top face
//! a side z = t passes x at ψ = atan(x/t), at height y = 1/√(1 + x² + t²). Pieces are at most [`STEP`] long: Simpson's
//! rule is good to 1e-10 for the former, and a series for small angles to 1e-10 for the latter.

use super::SphereImage;
use crate::layout::{Layout, cube};
use rayon::prelude::*;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

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
    for face in [2, 3] {
        job.level(face == 3, |i, j, v| job.put(&mut out, face, i, if face == 3 { n - 1 - j } else { j }, v));
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
    fn add(&self, turn: f64, lift: f64, to: &mut [f64; 3]) {
        let drop = self.top * turn - lift;
        (0..3).for_each(|c| to[c] += self.sum[c] * turn + self.value[c] * drop);
    }
}

struct Job<'a> {
    source: &'a SphereImage,
    n: usize,
    /// Borders of the texels on the plane of a face, −1 … 1.
    borders: Vec<f64>,
    /// cos θ of the borders of the source's rows.
    rows: Vec<f64>,
    /// Parts of a column, so that no piece is longer than [`STEP`].
    parts: usize,
}

impl<'a> Job<'a> {
    fn new(source: &'a SphereImage, n: usize) -> Self {
        let (w, h) = (source.width as f64, source.height as f64);
        let row = |j: usize| (FRAC_PI_2 - PI * j as f64 / h).sin();
        Self {
            source,
            n,
            borders: (0..=n).map(|k| 2.0 * k as f64 / n as f64 - 1.0).collect(),
            rows: (0..=source.height).map(row).collect(),
            parts: (2.0 * PI / w / STEP).ceil().max(1.0) as usize,
        }
    }

    fn put(&self, out: &mut SphereImage, face: usize, i: usize, j: usize, sum: [f64; 3]) {
        let (x, y) = (&self.borders[i..i + 2], &self.borders[j..j + 2]);
        let omega = cube::solid_angle(x[0], x[1], y[0], y[1]);
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
        for i in first..last {
            side.fill([0.0; 3]);
            let (mut a, end) = (angle(i + 1), angle(i));
            while a < end {
                let column = (at(a) + 1e-9).floor();
                let border = ((column + 1.0) / fine - 0.5) * 2.0 * PI - middle;
                // y(a) turns round at the middle.
                let next = if a < 0.0 { border.min(0.0) } else { border }.min(end);
                let x = (column as i64).div_euclid(self.parts as i64) - from;
                columns.sides(x.clamp(0, columns.width as i64 - 1) as usize, (a, next), &mut side);
                a = if next > a { next } else { end };
            }
            for (texel, k) in out[(i - first) * self.n..][..self.n].iter_mut().zip(0..) {
                *texel = std::array::from_fn(|c| side[k + 1][c] - side[k][c]);
            }
        }
        out
    }

    /// Integrals over the texels of the top face, or of the bottom face seen in a mirror.
    fn level(&self, bottom: bool, mut put: impl FnMut(usize, usize, [f64; 3])) {
        let n = self.n;
        let cap = Cap::new(self, bottom);
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

/// F of some columns over the rows that upright faces see.
struct Columns<'a, 'b> {
    job: &'a Job<'b>,
    /// First column and number of columns.
    from: i64,
    width: usize,
    /// First and last row.
    rows: (usize, usize),
    /// Per column and row.
    sums: Vec<[f64; 3]>,
}

impl<'a, 'b> Columns<'a, 'b> {
    fn new(job: &'a Job<'b>, from: i64, width: usize) -> Self {
        let height = job.source.height;
        let rows = (height / 4, (3 * height).div_ceil(4).clamp(height / 4 + 1, height));
        let count = rows.1 - rows.0;
        let mut sums = vec![[0.0; 3]; width * count];
        for x in 0..width {
            let i = (from + x as i64).rem_euclid(job.source.width as i64) as usize;
            let mut sum = [0.0; 3];
            for (k, at) in sums[x * count..][..count].iter_mut().enumerate() {
                let j = rows.0 + k;
                *at = sum;
                let depth = job.rows[j] - job.rows[j + 1];
                let texel = j * job.source.width + i;
                (0..3).for_each(|c| sum[c] += depth * f64::from(job.source.planes[c][texel]));
            }
        }
        Self { job, from, width, rows, sums }
    }

    fn cell(&self, x: usize, j: usize) -> Cell {
        let source = self.job.source;
        let i = (self.from + x as i64).rem_euclid(source.width as i64) as usize;
        Cell {
            sum: self.sums[x * (self.rows.1 - self.rows.0) + j - self.rows.0],
            value: std::array::from_fn(|c| f64::from(source.planes[c][j * source.width + i])),
            top: self.job.rows[j],
        }
    }

    /// Adds ∫ F dφ over azimuths `a` of column `x` for the sides at every height t.
    fn sides(&self, x: usize, (a, b): (f64, f64), to: &mut [[f64; 3]]) {
        let (ca, cb, cm) = (a.cos(), b.cos(), (0.5 * (a + b)).cos());
        let (mut ja, mut jb) = (self.rows.0, self.rows.0);
        let rows = &self.job.rows;
        for (to, &t) in to.iter_mut().zip(&self.job.borders) {
            let (ya, yb) = (height(t, ca), height(t, cb));
            ja = self.below(ja, ya);
            jb = self.below(jb, yb);
            if ja == jb {
                let lift = (b - a) / 6.0 * (ya + 4.0 * height(t, cm) + yb);
                self.cell(x, ja).add(b - a, lift, to);
                continue;
            }
            let (mut p, mut j) = (a, ja);
            while p < b {
                let border = if jb > j { j + 1 } else { j };
                let q = if j == jb { b } else { crossing(t, rows[border], a).clamp(p, b) };
                let mid = height(t, (0.5 * (p + q)).cos());
                let lift = (q - p) / 6.0 * (height(t, p.cos()) + 4.0 * mid + height(t, q.cos()));
                self.cell(x, j).add(q - p, lift, to);
                if j == jb {
                    break;
                }
                p = q;
                j = if jb > j { j + 1 } else { j - 1 };
            }
        }
    }

    /// The row that holds height y, not above row `j`.
    fn below(&self, mut j: usize, y: f64) -> usize {
        while j + 1 < self.rows.1 && y < self.job.rows[j + 1] {
            j += 1;
        }
        j
    }
}

/// y of the side at height t of a face, at cosine c of the azimuth.
fn height(t: f64, c: f64) -> f64 {
    let v = t * c;
    -v / (1.0 + v * v).sqrt()
}

/// The azimuth, on the side of `a`, where the side at height t has height y.
fn crossing(t: f64, y: f64, a: f64) -> f64 {
    let c = -y / (t * ((1.0 - y) * (1.0 + y)).sqrt());
    let angle = c.clamp(-1.0, 1.0).acos().min(FRAC_PI_4);
    if a < 0.0 { -angle } else { angle }
}

/// F around a pole, from the pole outwards.
struct Cap<'a, 'b> {
    job: &'a Job<'b>,
    bottom: bool,
    /// Squared distance from the pole on the face's plane of the rows' outer borders.
    radii2: Vec<f64>,
    /// 1 − y of the rows' inner borders.
    depths: Vec<f64>,
    /// Per row and column.
    sums: Vec<[f64; 3]>,
}

impl<'a, 'b> Cap<'a, 'b> {
    fn new(job: &'a Job<'b>, bottom: bool) -> Self {
        let (width, height) = (job.source.width, job.source.height);
        let angle = |j: usize| PI * j as f64 / height as f64;
        // The corners are 54.7° from the pole.
        let count = (height as f64 * 0.3041).ceil() as usize + 1;
        let count = count.min(height);
        let radius2 = |j: usize| if 2 * j >= height { f64::INFINITY } else { angle(j).tan().powi(2) };
        let depth = |j: usize| 2.0 * (0.5 * angle(j)).sin().powi(2);
        let depths: Vec<f64> = (0..=count).map(depth).collect();
        let mut cap = Self {
            job,
            bottom,
            radii2: (1..=count).map(radius2).collect(),
            depths,
            sums: vec![[0.0; 3]; count * width],
        };
        let mut sum = vec![[0.0; 3]; width];
        for j in 0..count {
            cap.sums[j * width..][..width].copy_from_slice(&sum);
            let row = cap.row(j) * width;
            let depth = cap.depths[j + 1] - cap.depths[j];
            for c in 0..3 {
                let texels = &job.source.planes[c][row..row + width];
                sum.iter_mut().zip(texels).for_each(|(s, &l)| s[c] += depth * f64::from(l));
            }
        }
        cap
    }

    fn row(&self, j: usize) -> usize {
        if self.bottom { self.job.source.height - 1 - j } else { j }
    }

    /// ∫ F dφ along the line at `t` for every texel: of z = t from x = −1 to 1, or of x = t from z = −1 to 1.
    fn line(&self, t: f64, swapped: bool) -> Vec<[f64; 3]> {
        let mut out = vec![[0.0; 3]; self.job.n];
        if t == 0.0 {
            // Along a meridian.
            return out;
        }
        let mut walk = Walk::new(self, t, swapped);
        let ends = self.job.borders.windows(2);
        out.iter_mut().zip(ends).for_each(|(sum, ends)| walk.texel(ends[1], sum));
        out
    }

    fn cell(&self, i: usize, j: usize) -> Cell {
        let source = self.job.source;
        let k = self.row(j) * source.width + i;
        Cell {
            sum: self.sums[j * source.width + i],
            value: std::array::from_fn(|c| f64::from(source.planes[c][k])),
            // F = sum + value (depth − depth_j) with depth = 1 − y.
            top: 1.0 - self.depths[j],
        }
    }
}

/// A point on a line: its place along it, r² = x² + t², r and √(1 + r²).
#[derive(Clone, Copy)]
struct Point {
    x: f64,
    r2: f64,
    r: f64,
    h: f64,
}

/// A walk along a line of the top face, cell by cell.
struct Walk<'a, 'b, 'c> {
    cap: &'a Cap<'b, 'c>,
    t: f64,
    swapped: bool,
    here: Point,
    /// The next border of a (part of a) column in the sense of the walk, and where that is.
    border: i64,
    column_end: f64,
    /// The row.
    j: usize,
    /// Does the walk lead away from the pole?
    outwards: bool,
    row_end: f64,
}

impl<'a, 'b, 'c> Walk<'a, 'b, 'c> {
    fn new(cap: &'a Cap<'b, 'c>, t: f64, swapped: bool) -> Self {
        let here = Self::point(t, -1.0);
        let j = cap.radii2.partition_point(|&r2| r2 <= here.r2).min(cap.radii2.len() - 1);
        let mut walk =
            Self { cap, t, swapped, here, border: 0, column_end: 0.0, j, outwards: false, row_end: 0.0 };
        let place = walk.coordinate(walk.here.x);
        walk.border = if walk.rising() { place.floor() as i64 + 1 } else { place.ceil() as i64 - 1 };
        walk.column_end = walk.meeting();
        walk.row_end = walk.row_meeting();
        walk
    }

    fn point(t: f64, x: f64) -> Point {
        let r2 = x * x + t * t;
        Point { x, r2, r: r2.sqrt(), h: (1.0 + r2).sqrt() }
    }

    /// Does azimuth grow along the walk?
    fn rising(&self) -> bool {
        (self.t < 0.0) != self.swapped
    }

    fn fine(&self) -> f64 {
        (self.cap.job.source.width * self.cap.job.parts) as f64
    }

    /// The (parts of) columns passed at `x`.
    fn coordinate(&self, x: f64) -> f64 {
        let phi = if self.swapped { x.atan2(self.t) } else { self.t.atan2(x) };
        (0.5 + phi / (2.0 * PI)) * self.fine()
    }

    /// Where the walk meets the border of the column.
    fn meeting(&self) -> f64 {
        let (sin, cos) = ((self.border as f64 / self.fine() - 0.5) * 2.0 * PI).sin_cos();
        let (along, from) = if self.swapped { (sin, cos) } else { (cos, sin) };
        // Beyond a right angle from the foot of the line there is no border to be met.
        if from * self.t <= 0.0 { f64::INFINITY } else { self.t * along / from }
    }

    /// Where the walk leaves the row.
    fn row_meeting(&mut self) -> f64 {
        let inner = if self.j == 0 { 0.0 } else { self.cap.radii2[self.j - 1] };
        let gap = |r2: f64| (r2 - self.t * self.t).max(0.0).sqrt();
        if !self.outwards && inner > self.t * self.t {
            return -gap(inner);
        }
        self.outwards = true;
        gap(self.cap.radii2[self.j])
    }

    /// Adds ∫ F dφ up to `end`.
    fn texel(&mut self, end: f64, sum: &mut [f64; 3]) {
        loop {
            let x = end.min(self.column_end).min(self.row_end).max(self.here.x);
            self.piece(x, sum);
            if x >= end {
                return;
            }
            if x >= self.column_end {
                self.border += if self.rising() { 1 } else { -1 };
                self.column_end = self.meeting();
            }
            if x >= self.row_end {
                self.j = if self.outwards { (self.j + 1).min(self.cap.radii2.len() - 1) } else { self.j - 1 };
                self.row_end = self.row_meeting();
            }
        }
    }

    /// Adds the piece up to `x`, which lies in one cell.
    fn piece(&mut self, x: f64, sum: &mut [f64; 3]) {
        let (p, q) = (self.here, Self::point(self.t, x));
        self.here = q;
        // ∫ dψ = Δψ, whose tangent is known, and ∫ y dψ = Δ asin(sin ψ/√(1 + t²)), whose sine is known.
        let t2 = self.t * self.t;
        let tan = self.t.abs() * (q.x - p.x) / (t2 + p.x * q.x);
        let sin = self.t.abs() * (q.x * p.h - p.x * q.h) / ((1.0 + t2) * p.r * q.r);
        let (tan2, sin2) = (tan * tan, sin * sin);
        let turn = tan * (1.0 - tan2 * (1.0 / 3.0 - tan2 * (0.2 - tan2 / 7.0)));
        let lift = sin * (1.0 + sin2 * (1.0 / 6.0 + sin2 * (0.075 + sin2 * (15.0 / 336.0))));
        let columns = self.cap.job.source.width as i64;
        let part = if self.rising() { self.border - 1 } else { self.border };
        let i = part.div_euclid(self.cap.job.parts as i64).rem_euclid(columns);
        let sign = if self.rising() { 1.0 } else { -1.0 };
        self.cap.cell(i as usize, self.j).add(sign * turn, sign * lift, sum);
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

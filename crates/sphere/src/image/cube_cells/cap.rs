//! F around a pole, for the top and the bottom face.

use super::Job;
use std::f64::consts::PI;

/// Rows and columns of a tile.
const TILE: usize = 8;

/// F around a pole, from the pole outwards.
pub(super) struct Cap<'a, 'b> {
    job: &'a Job<'b>,
    bottom: bool,
    /// Squared distance from the pole on the face's plane of the rows' outer borders.
    radii2: Vec<f64>,
    /// 1 − y of the rows' inner borders.
    depths: Vec<f64>,
    /// F at the inner borders of the rows, of every column. In tiles, each column by column, because lines
    /// run in all directions.
    sums: Vec<[f64; 3]>,
    /// Tiles of a row of them.
    tiles: usize,
    /// Per border of a (part of a) column at azimuth φ: where a line of z = t meets it, x/t = cot φ, and sin
    /// φ; where one of x = t does, z/t = tan φ, and cos φ.
    meetings: [Vec<[f64; 2]>; 2],
}

impl<'a, 'b> Cap<'a, 'b> {
    /// The cap of neither pole yet.
    pub(super) fn new(job: &'a Job<'b>) -> Self {
        let (width, height) = (job.source.width, job.source.height);
        let angle = |j: usize| PI * j as f64 / height as f64;
        // The corners are 54.7° from the pole.
        let count = (height as f64 * 0.3041).ceil() as usize + 1;
        let count = count.min(height);
        let radius2 = |j: usize| if 2 * j >= height { f64::INFINITY } else { angle(j).tan().powi(2) };
        let depth = |j: usize| 2.0 * (0.5 * angle(j)).sin().powi(2);
        let (fine, tiles) = (width * job.parts, width.div_ceil(TILE));
        let turn = |k: usize| ((k as f64 / fine as f64 - 0.5) * 2.0 * PI).sin_cos();
        let turns: Vec<(f64, f64)> = (0..fine).map(turn).collect();
        Self {
            job,
            bottom: false,
            radii2: (1..=count).map(radius2).collect(),
            depths: (0..=count).map(depth).collect(),
            sums: vec![[0.0; 3]; (count + 1).div_ceil(TILE) * tiles * TILE * TILE],
            tiles,
            meetings: [
                turns.iter().map(|(sin, cos)| [cos / sin, *sin]).collect(),
                turns.iter().map(|(sin, cos)| [sin / cos, *cos]).collect(),
            ],
        }
    }

    /// Takes up F around the upper or the lower pole.
    pub(super) fn turn_to(&mut self, bottom: bool) {
        self.bottom = bottom;
        let width = self.job.source.width;
        let mut sums = vec![[0.0; 3]; width];
        for j in 0..=self.radii2.len() {
            if j > 0 {
                let row = self.row(j - 1) * width;
                let depth = self.depths[j] - self.depths[j - 1];
                for c in 0..3 {
                    let texels = &self.job.source.planes[c][row..row + width];
                    for i in 0..width {
                        sums[i][c] += depth * f64::from(texels[i]);
                    }
                }
            }
            for i in 0..width {
                let at = self.at(i, j);
                self.sums[at] = sums[i];
            }
        }
    }

    /// Where the sum of column i at the inner border of row j is.
    #[inline(always)]
    fn at(&self, i: usize, j: usize) -> usize {
        ((j / TILE * self.tiles + i / TILE) * TILE + i % TILE) * TILE + j % TILE
    }

    fn row(&self, j: usize) -> usize {
        if self.bottom { self.job.source.height - 1 - j } else { j }
    }

    /// ∫ F dφ along the line at `t` for every texel: of z = t from x = −1 to 1, or of x = t from z = −1 to 1.
    pub(super) fn line(&self, t: f64, swapped: bool) -> Vec<[f64; 3]> {
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

    /// Adds ∫ F dφ over a piece of azimuth `turn` with ∫ y dφ = `lift` in one cell: F is linear in y between
    /// the cell's borders.
    #[inline(always)]
    fn add(&self, (i, j): (usize, usize), turn: f64, lift: f64, to: &mut [f64; 3]) {
        let (inner, outer) = (self.sums[self.at(i, j)], self.sums[self.at(i, j + 1)]);
        let part = ((1.0 - self.depths[j]) * turn - lift) / (self.depths[j + 1] - self.depths[j]);
        for c in 0..3 {
            to[c] += inner[c] * turn + (outer[c] - inner[c]) * part;
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
    /// Does azimuth grow along the walk?
    rising: bool,
    /// The (part of a) column, and where the walk leaves it.
    part: usize,
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
        let rising = (t < 0.0) != swapped;
        let fine = cap.meetings[0].len();
        // The (parts of) columns passed at the start.
        let phi = if swapped { here.x.atan2(t) } else { t.atan2(here.x) };
        let place = (0.5 + phi / (2.0 * PI)) * fine as f64;
        let part = if rising { place.floor() } else { place.ceil() - 1.0 } as i64;
        let part = part.rem_euclid(fine as i64) as usize;
        let (column_end, outwards, row_end) = (0.0, false, 0.0);
        let mut walk = Self { cap, t, swapped, here, rising, part, column_end, j, outwards, row_end };
        walk.column_end = walk.meeting();
        walk.row_end = walk.row_meeting();
        walk
    }

    fn point(t: f64, x: f64) -> Point {
        let r2 = x * x + t * t;
        Point { x, r2, r: r2.sqrt(), h: (1.0 + r2).sqrt() }
    }

    /// Goes to the next (part of a) column.
    fn cross(&mut self) {
        let last = self.cap.meetings[0].len() - 1;
        self.part = match (self.rising, self.part) {
            (true, part) if part == last => 0,
            (true, part) => part + 1,
            (false, 0) => last,
            (false, part) => part - 1,
        };
        self.column_end = self.meeting();
    }

    /// Where the walk meets the next border of the column.
    fn meeting(&self) -> f64 {
        let table = &self.cap.meetings[usize::from(self.swapped)];
        let border = if self.rising { self.part + 1 } else { self.part };
        let [ratio, from] = table[if border == table.len() { 0 } else { border }];
        // Beyond a right angle from the foot of the line there is no border to be met.
        if from * self.t <= 0.0 { f64::INFINITY } else { self.t * ratio }
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
                self.cross();
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
        let parts = self.cap.job.parts;
        let i = if parts == 1 { self.part } else { self.part / parts };
        let sign = if self.rising { 1.0 } else { -1.0 };
        self.cap.add((i, self.j), sign * turn, sign * lift, sum);
    }
}

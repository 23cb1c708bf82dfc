//! F of the columns that an upright face sees.

use super::{Cell, Job};
use std::f64::consts::FRAC_PI_4;
use std::mem::swap;
use steradian_simd::{Arch, Kernel, run};

/// F of some columns over the rows that upright faces see.
pub(super) struct Columns<'a, 'b> {
    job: &'a Job<'b>,
    /// First column and number of columns.
    from: i64,
    pub(super) width: usize,
    /// First and last row.
    rows: (usize, usize),
    /// Per column and row.
    sums: Vec<[f64; 3]>,
}

/// The sides at every height t at one azimuth: their y, and the rows that hold them.
#[derive(Default)]
struct Sides {
    azimuth: f64,
    y: Vec<f64>,
    rows: Vec<usize>,
}

/// A walk along all sides at once.
pub(super) struct Walk {
    here: Sides,
    next: Sides,
    /// y half way.
    middle: Vec<f64>,
}

impl Default for Walk {
    fn default() -> Self {
        let here = Sides { azimuth: f64::NAN, ..Sides::default() };
        Self { here, next: Sides::default(), middle: Vec::new() }
    }
}

impl<'a, 'b> Columns<'a, 'b> {
    pub(super) fn new(job: &'a Job<'b>, from: i64, width: usize) -> Self {
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

    /// Adds ∫ F dφ over azimuths `a` … `b` of column `x` for the sides at every height t. Cheapest where the
    /// last call ended at `a`.
    pub(super) fn sides(&self, x: usize, (a, b): (f64, f64), walk: &mut Walk, to: &mut [[f64; 3]]) {
        if walk.here.azimuth != a {
            self.look(a, &mut walk.here);
        }
        self.look(b, &mut walk.next);
        heights(&self.job.borders, (0.5 * (a + b)).cos(), &mut walk.middle);
        let source = self.job.source;
        let i = (self.from + x as i64).rem_euclid(source.width as i64) as usize;
        let sums = &self.sums[x * (self.rows.1 - self.rows.0)..][..self.rows.1 - self.rows.0];
        let cell = |j: usize| Cell {
            sum: sums[j - self.rows.0],
            value: std::array::from_fn(|c| f64::from(source.planes[c][j * source.width + i])),
            top: self.job.rows[j],
        };
        for k in 0..to.len() {
            let (ja, jb) = (walk.here.rows[k], walk.next.rows[k]);
            if ja == jb {
                let lift = (b - a) / 6.0 * (walk.here.y[k] + 4.0 * walk.middle[k] + walk.next.y[k]);
                cell(ja).add(b - a, lift, &mut to[k]);
                continue;
            }
            let t = self.job.borders[k];
            let (mut p, mut j) = (a, ja);
            while p < b {
                let border = if jb > j { j + 1 } else { j };
                let q = if j == jb { b } else { crossing(t, self.job.rows[border], a).clamp(p, b) };
                let mid = height(t, (0.5 * (p + q)).cos());
                let lift = (q - p) / 6.0 * (height(t, p.cos()) + 4.0 * mid + height(t, q.cos()));
                cell(j).add(q - p, lift, &mut to[k]);
                if j == jb {
                    break;
                }
                p = q;
                j = if jb > j { j + 1 } else { j - 1 };
            }
        }
        swap(&mut walk.here, &mut walk.next);
    }

    /// The sides at azimuth `a`.
    fn look(&self, a: f64, sides: &mut Sides) {
        sides.azimuth = a;
        heights(&self.job.borders, a.cos(), &mut sides.y);
        sides.rows.clear();
        let mut j = self.rows.0;
        for &y in &sides.y {
            while j + 1 < self.rows.1 && y < self.job.rows[j + 1] {
                j += 1;
            }
            sides.rows.push(j);
        }
    }
}

/// y of the sides at heights `t` of a face, at cosine c of the azimuth.
fn heights(t: &[f64], c: f64, y: &mut Vec<f64>) {
    struct Heights<'a> {
        t: &'a [f64],
        c: f64,
        y: &'a mut [f64],
    }
    impl Kernel for Heights<'_> {
        type Output = ();

        #[inline(always)]
        fn run<A: Arch>(self) {
            for k in 0..self.t.len().min(self.y.len()) {
                self.y[k] = height(self.t[k], self.c);
            }
        }
    }
    y.resize(t.len(), 0.0);
    run(Heights { t, c, y });
}

/// y of the side at height t of a face, at cosine c of the azimuth.
#[inline(always)]
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

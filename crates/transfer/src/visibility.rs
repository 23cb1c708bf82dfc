//! Visibility of a site: cells of the hemisphere, refined where neighbours differ.
//!
//! Every cell of a regular grid gets one ray, through a point in it of a randomly shifted net of low
//! discrepancy. Cells that do not agree with their neighbours are divided in four, each with a ray of its
//! own, and so on until the estimate of the error is small enough. Boundaries of length s in cells of side h
//! leave an error of order √(s h³); the grid alone would take the square of the rays.
//!
//! Surfaces that touch leave gaps far thinner than a cell. Four rules find them:
//!
//! - which cells are divided follows from their sizes and from which kinds of rays there are nearby, never
//!   from what a cell's own ray saw: to divide cells with an odd ray, and to keep those that happen to agree,
//!   closes every thin gap;
//! - a cell that was left undivided is looked at again once a finer one beside it sees otherwise, so that a
//!   gap is followed along its way, and short boundaries are followed to fine cells whatever the estimate
//!   says;
//! - where something is blocked, large cells are divided even if all agree;
//! - along the horizon, where gaps of touching surfaces lie, cells get rays more at heights that a random one
//!   seldom has.
//!
//! Features that are smaller than a cell of the first grid and isolated may still be missed.

use crate::grid::{cell_at, direction, offset, place, shift};
use crate::table::{Table, finer_weight};
use glam::{Mat3, Vec3};
use steradian_scene::{Bvh, Ray};
use steradian_simd::{Arch, Kernel};

/// Most levels of cells: sides of 2^10.
const MAX_LEVEL: u32 = 10;
/// Most rays of a site.
const MAX_RAYS: usize = 1 << 19;
/// Bits of a cell's state, 0 where no ray was cast. Its ray hit something.
const HIT: u8 = 1;
/// A ray was cast.
const CAST: u8 = 2;
/// It or a part of it sees out.
const OPEN: u8 = 4;
/// It or a part of it is blocked.
const BLOCKED: u8 = 8;
/// It has parts.
const DIVIDED: u8 = 16;
/// Flag of a cell that is left undivided, since all around it agree.
const SETTLED: u8 = 32;
/// Variance of a random ray in a cell with neighbours of both kinds, averaged over such cells: f (1 − f) of a
/// cell whose share f is open is 1/6 in the mean where a straight boundary crosses it, and 0 where one passes
/// by.
const SPREAD: f64 = 0.18;
/// Where anything is blocked, blocked cells, those at boundaries and those at the horizon are divided until
/// the integral of V over one is this share of the target standard error: gaps of a few cells are then seen
/// by some ray.
const SPECK: f64 = 0.35;
/// Boundaries of at most so many cells are followed …
const SHORT: usize = 200;
/// … until a cell's weight is this share of the target standard error.
const TRIFLE: f64 = 0.05;
/// Where rays more are cast in cells at the horizon: depths from there, in sides of the cell.
const DEPTHS: [f32; 3] = [0.02, 0.07, 0.25];

/// Work for each site.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Effort {
    /// As many rays as are needed for this standard error of ∫ V (n·w) y dw, for harmonics of magnitude 1;
    /// integrals of V alone get five times that.
    Error(f64),
    /// A grid of 4^level cells, one ray each.
    Level(u32),
}

/// Level of the grid that is refined, for a fine result.
const GRID: u32 = 6;

/// Rays and maps of one thread.
#[derive(Default)]
pub struct Scratch {
    cells: Vec<u32>,
    open: Vec<Open>,
    order: Vec<(f32, u32)>,
    rays: Vec<Ray>,
    hits: Vec<bool>,
    /// The cell of each ray that only tells whether to divide.
    probed: Vec<u32>,
    /// For each level, rows of cells: flags of what their rays, and those of their parts, met ([`BLOCKED`]
    /// …).
    maps: Vec<Vec<u8>>,
    /// For each level, cells that wait for their rays.
    waiting: Vec<Vec<u32>>,
    /// For each level, settled cells that turned out to have a neighbour that differs.
    reopened: Vec<Vec<u32>>,
    /// Blocked cells.
    pub blocked: Vec<Blocked>,
}

/// A cell of the table that is blocked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blocked {
    /// Level of the cell.
    pub level: u32,
    /// Index of the cell in its level.
    pub cell: u32,
    /// Blocked share of the cell, with the cosine and without.
    pub share: [f32; 2],
}

/// A cell that may be divided.
struct Open {
    /// Variance of the cell, in units of the allowed one; 0 where it is left undivided, infinite where it
    /// must be divided.
    expected: f32,
    cell: u32,
    variance: [f64; 2],
    /// Weight of the cell, in units of the error of integrals of V (n·w).
    weight: f32,
}

/// Results for a site, in addition to [`Scratch::blocked`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Standard errors of ∫ V (n·w) y and of ∫ V y, for harmonics of magnitude 1.
    pub error: [f64; 2],
    /// Rays cast.
    pub rays: usize,
    /// Did every ray hit something?
    pub enclosed: bool,
}

impl Scratch {
    /// Looks around from `origin` over the hemisphere about the z axis of `frame`.
    pub fn look(
        &mut self,
        bvh: &Bvh,
        origin: Vec3,
        frame: Mat3,
        seed: u32,
        effort: Effort,
        table: &Table,
    ) -> Seen {
        self.blocked.clear();
        let (first, target) = match effort {
            // A speck that the grid misses is smaller than a cell: 1e-3 of the hemisphere at level 5.
            Effort::Error(e) => (if e > 2e-3 { GRID - 1 } else { GRID }, e),
            Effort::Level(level) => (level, f64::INFINITY),
        };
        let last = if matches!(effort, Effort::Error(_)) { MAX_LEVEL } else { first };
        while self.maps.len() <= last as usize {
            self.maps.push(vec![0; 1 << (2 * self.maps.len())]);
            self.waiting.push(Vec::new());
            self.reopened.push(Vec::new());
        }
        self.maps[first as usize].fill(0);
        self.waiting[first as usize].extend(0..1u32 << (2 * first));
        let mut seen = Seen { error: [0.0; 2], rays: 0, enclosed: true };
        // Variances of the cells that are done.
        let mut done = [0.0f64; 2];
        let share = |v: [f64; 2]| v[0].max(v[1] / 25.0) / (target * target);
        let (mut deepest, mut occluded) = (first, false);
        let mut next = Some(first);
        while let Some(level) = next {
            deepest = deepest.max(level);
            std::mem::swap(&mut self.cells, &mut self.waiting[level as usize]);
            self.waiting[level as usize].clear();
            self.cast(bvh, origin, frame, seed, first, level);
            seen.rays += self.cells.len();
            seen.enclosed &= self.hits.iter().all(|h| *h);
            occluded |= self.hits.iter().any(|h| *h);
            let refine = level < last && seen.rays < MAX_RAYS;
            if refine && level > first {
                self.reopen(first, level);
            }
            if refine && occluded {
                seen.rays += self.probe_horizon(bvh, origin, frame, first, level);
            }
            self.cells.append(&mut self.reopened[level as usize]);
            self.open.clear();
            let mut open = [0.0f64; 2];
            for k in 0..self.cells.len() {
                let cell = self.cells[k];
                let n = self.neighbours(first, level, cell);
                if !n.mixed && !(refine && (n.hit || n.horizon && occluded)) {
                    self.settle(level, cell);
                    continue;
                }
                let w = table.weight(level, cell).map(f64::from);
                let spread = if n.mixed { SPREAD } else { 0.0 };
                let variance = w.map(|w| w * w * spread);
                let wide = w[1] > 5.0 * SPECK * target;
                let large = wide && (n.hit || n.mixed || n.horizon && occluded);
                let divide = refine && (n.mixed || large);
                let sum = if divide { &mut open } else { &mut done };
                sum[0] += variance[0];
                sum[1] += variance[1];
                if !divide {
                    if !n.mixed {
                        self.settle(level, cell);
                    }
                    continue;
                }
                let expected = if large { f32::INFINITY } else { share(variance) as f32 };
                self.open.push(Open { expected, cell, variance, weight: w[0].max(w[1] / 5.0) as f32 });
            }
            if self.open.len() <= SHORT {
                let least = (TRIFLE * target) as f32;
                self.open.iter_mut().filter(|o| o.weight > least).for_each(|o| o.expected = f32::INFINITY);
            }
            seen.error = [0, 1].map(|k| (done[k] + open[k]).sqrt());
            if seen.error[0] <= target && seen.error[1] <= 5.0 * target {
                self.open.iter_mut().filter(|o| o.expected < f32::INFINITY).for_each(|o| o.expected = 0.0);
            } else {
                self.choose(0.8 * (1.0 - 0.5f64.powi((level - first + 1) as i32)) - share(done));
            }
            for o in &self.open {
                if o.expected > 0.0 {
                    self.waiting[level as usize + 1].extend((0..4).map(|k| o.cell << 2 | k));
                } else {
                    done[0] += o.variance[0];
                    done[1] += o.variance[1];
                }
            }
            let left =
                |l: &u32| !self.waiting[*l as usize].is_empty() || !self.reopened[*l as usize].is_empty();
            next = (first..=last).find(left);
        }
        for cell in 0..1u32 << (2 * first) {
            self.collect(first, cell, table);
        }
        // The grid's own map is written anew for every site.
        for map in &mut self.maps[first as usize + 1..=deepest as usize] {
            map.fill(0);
        }
        seen
    }

    /// Marks a cell as left undivided, since all around it agree.
    #[inline(always)]
    fn settle(&mut self, level: u32, cell: u32) {
        let [x, y] = place(cell);
        self.maps[level as usize][((y << level) + x) as usize] |= SETTLED;
    }

    /// Finds the parts of a cell that are blocked.
    fn collect(&mut self, level: u32, cell: u32, table: &Table) {
        let [x, y] = place(cell);
        let state = self.maps[level as usize][((y << level) + x) as usize];
        if state & DIVIDED != 0 {
            (0..4).for_each(|k| self.collect(level + 1, cell << 2 | k, table));
        } else if state & HIT != 0 {
            put(&mut self.blocked, level, cell, table);
        }
    }

    /// Reopens settled cells next to newly sampled ones that disagree with them, so that a gap found at one
    /// place is followed along its way.
    fn reopen(&mut self, first: u32, level: u32) {
        for k in 0..self.cells.len() {
            let ([x, y], side) = (place(self.cells[k]), 1u32 << level);
            let hit = self.hits[k];
            for j in y.saturating_sub(1)..=(y + 1).min(side - 1) {
                for i in x.saturating_sub(1)..=(x + 1).min(side - 1) {
                    let (l, at) = self.find(first, level, i, j);
                    let state = &mut self.maps[l as usize][at];
                    if *state & SETTLED != 0 && (*state & HIT != 0) != hit {
                        *state &= !SETTLED;
                        let (i, j) = (i >> (level - l), j >> (level - l));
                        self.reopened[l as usize].push(cell_at(i, j));
                    }
                }
            }
        }
    }

    /// Leaves those cells as they are (expected 0) that matter least, such as those near the horizon, as long
    /// as their variance is within `allowed`.
    fn choose(&mut self, allowed: f64) {
        self.order.clear();
        self.order.extend(self.open.iter().enumerate().map(|(k, o)| (o.expected, k as u32)));
        self.order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut sum = 0.0;
        for (expected, k) in &self.order {
            sum += f64::from(*expected);
            if sum > allowed {
                break;
            }
            self.open[*k as usize].expected = 0.0;
        }
    }

    /// One ray in each of the cells.
    fn cast(&mut self, bvh: &Bvh, origin: Vec3, frame: Mat3, seed: u32, first: u32, level: u32) {
        self.rays.clear();
        steradian_simd::run(Aim { cells: &self.cells, seed, level, origin, frame, rays: &mut self.rays });
        self.hits.clear();
        self.hits.resize(self.rays.len(), false);
        bvh.occluded_each(&self.rays, f32::INFINITY, &mut self.hits);
        for k in 0..self.cells.len() {
            let ([x, y], hit) = (place(self.cells[k]), &self.hits[k]);
            let at = ((y << level) + x) as usize;
            self.maps[level as usize][at] = CAST | if *hit { HIT } else { 0 };
            self.note(first, level, [x, y], if *hit { BLOCKED } else { OPEN });
        }
    }

    /// Gaps along the horizon are thin where surfaces touch or bend gently: cells there get more rays, at
    /// heights that a random ray seldom has. These rays decide only on division; they do not count in
    /// integrals.
    fn probe_horizon(&mut self, bvh: &Bvh, origin: Vec3, frame: Mat3, first: u32, level: u32) -> usize {
        let (side, scale) = (1u32 << level, 1.0 / (1u32 << level) as f32);
        self.rays.clear();
        self.probed.clear();
        for &cell in &self.cells {
            let [x, y] = place(cell);
            let edge = |k: u32| k == 0 || k == side - 1;
            if !edge(x) && !edge(y) {
                continue;
            }
            let across = |k: u32, depth: f32| match k {
                0 => depth,
                k if k == side - 1 => 1.0 - depth,
                _ => 0.5,
            };
            for depth in DEPTHS {
                let d =
                    direction((x as f32 + across(x, depth)) * scale, (y as f32 + across(y, depth)) * scale);
                self.rays.push(Ray { origin, direction: frame * d });
                self.probed.push(cell);
            }
        }
        self.hits.clear();
        self.hits.resize(self.rays.len(), false);
        bvh.occluded_each(&self.rays, f32::INFINITY, &mut self.hits);
        for k in 0..self.probed.len() {
            let seen = if self.hits[k] { BLOCKED } else { OPEN };
            self.note(first, level, place(self.probed[k]), seen);
        }
        self.rays.len()
    }

    /// Records in a cell and all its ancestors what was seen in it.
    fn note(&mut self, first: u32, level: u32, [x, y]: [u32; 2], seen: u8) {
        for l in (first..=level).rev() {
            let state = &mut self.maps[l as usize][(((y >> (level - l)) << l) + (x >> (level - l))) as usize];
            let with = *state | seen | if l < level { DIVIDED } else { 0 };
            if *state == with {
                break;
            }
            *state = with;
        }
    }

    /// State of a cell's neighbours, or of the ancestors of these.
    #[inline(always)]
    fn neighbours(&self, first: u32, level: u32, cell: u32) -> Neighbours {
        let ([x, y], side) = (place(cell), 1u32 << level);
        let own = self.maps[level as usize][((y << level) + x) as usize];
        let (mut count, mut seen) = (0u32, own);
        for j in y.saturating_sub(1)..=(y + 1).min(side - 1) {
            for i in x.saturating_sub(1)..=(x + 1).min(side - 1) {
                let (l, at) = self.find(first, level, i, j);
                seen |= self.maps[l as usize][at];
                count += 1;
            }
        }
        let both = OPEN | BLOCKED;
        Neighbours { horizon: count < 9, hit: own & HIT != 0, mixed: seen & both == both }
    }

    /// The finest cell up to `level` that was sampled here: its level, and its index in that level's map.
    #[inline(always)]
    fn find(&self, first: u32, level: u32, x: u32, y: u32) -> (u32, usize) {
        let (mut level, mut x, mut y) = (level, x, y);
        loop {
            let at = ((y << level) + x) as usize;
            if level == first || self.maps[level as usize][at] != 0 {
                return (level, at);
            }
            (level, x, y) = (level - 1, x >> 1, y >> 1);
        }
    }
}

/// Rays through the points of cells.
struct Aim<'a> {
    cells: &'a [u32],
    seed: u32,
    level: u32,
    origin: Vec3,
    frame: Mat3,
    rays: &'a mut Vec<Ray>,
}

impl Kernel for Aim<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        // A block of so many, in loops that compilers vectorise.
        const SOME: usize = 16;
        let scale = 1.0 / (1u32 << self.level) as f32;
        let shift = shift(self.seed, self.level);
        for cells in self.cells.chunks(SOME) {
            let (mut all, mut d) = ([0; SOME], [[0.0; SOME]; 3]);
            all[..cells.len()].copy_from_slice(cells);
            for (i, cell) in all.iter().enumerate() {
                let [x, y] = place(*cell);
                let [u, v] = offset(shift, [x, y]);
                let to = self.frame * direction((x as f32 + u) * scale, (y as f32 + v) * scale);
                [d[0][i], d[1][i], d[2][i]] = [to.x, to.y, to.z];
            }
            for i in 0..cells.len() {
                let direction = Vec3::new(d[0][i], d[1][i], d[2][i]);
                self.rays.push(Ray { origin: self.origin, direction });
            }
        }
    }
}

/// State of the cells around a cell.
struct Neighbours {
    /// Is it at the horizon?
    horizon: bool,
    /// Is the cell itself blocked?
    hit: bool,
    /// Are there both open and blocked cells, among its neighbours, itself and their parts?
    mixed: bool,
}

/// Adds a blocked cell; those finer than the table's count as a share of its cell.
#[inline(always)]
fn put(blocked: &mut Vec<Blocked>, level: u32, cell: u32, table: &Table) {
    if level <= table.level {
        blocked.push(Blocked { level, cell, share: [1.0; 2] });
        return;
    }
    let below = level - table.level;
    let parent = cell >> (2 * below);
    // Weights vary over a cell where it meets the horizon.
    let (own, whole) = (finer_weight(level, cell), table.weight(table.level, parent));
    let share = [own[0] / whole[0], own[1] / whole[1]];
    match blocked.last_mut() {
        Some(b) if (b.level, b.cell) == (table.level, parent) && b.share != [1.0; 2] => {
            b.share = [b.share[0] + share[0], b.share[1] + share[1]];
        }
        _ => blocked.push(Blocked { level: table.level, cell: parent, share }),
    }
}

//! What a site sees: cells of the hemisphere, refined where neighbours differ.
//!
//! Every cell of a regular grid gets one ray at a random place in it. Cells that do not agree with their neighbours
//! are divided in four, each with a ray of its own, and so on until the estimate of the error is small enough; those
//! at the horizon count as neighbours of something blocked. Boundaries of length s in cells of side h leave an error of
//! order √(s h³); the grid alone would take the square of the rays. What is smaller than a cell of the first grid and
//! stands alone may be missed, which is why that grid is fine.

use crate::grid::{direction, jitter, place};
use crate::table::{Table, finer_weight};
use glam::{Mat3, Vec3};
use steradian_scene::{Bvh, Ray};

/// Most levels of cells: sides of 2^10.
const MAX_LEVEL: u32 = 10;
/// Most rays of a site.
const MAX_RAYS: usize = 1 << 19;
/// No ray was cast in this cell.
const NONE: u8 = 2;

/// How much work a site gets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Effort {
    /// As many rays as this standard error of ∫ V (n·w) y dw, for harmonics of magnitude 1, asks for; integrals of V
    /// alone get five times that.
    Error(f64),
    /// A grid of 4^level cells, one ray each.
    Level(u32),
}

/// Level of the grid that is refined, where a fine result is asked for.
const GRID: u32 = 6;

/// Rays and maps of one thread.
#[derive(Default)]
pub struct Scratch {
    cells: Vec<u32>,
    open: Vec<Open>,
    order: Vec<f32>,
    rays: Vec<Ray>,
    hits: Vec<bool>,
    /// For each level of the maps, rows of cells: blocked 0, open 1, [`NONE`].
    maps: Vec<Vec<u8>>,
    /// What is blocked.
    pub blocked: Vec<Blocked>,
}

/// A cell of the table that is blocked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blocked {
    /// Its level.
    pub level: u32,
    /// Its number there.
    pub cell: u32,
    /// Which share of it, with the cosine and without.
    pub share: [f32; 2],
}

/// A cell that may be divided.
struct Open {
    /// Its variance, in units of what is allowed; 0 where it is left as it is.
    expected: f32,
    cell: u32,
    hit: bool,
    variance: [f64; 2],
}

/// What a site sees beside [`Scratch::blocked`].
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
        self.cells.clear();
        self.cells.extend(0..1u32 << (2 * first));
        let mut seen = Seen { error: [0.0; 2], rays: 0, enclosed: true };
        // Variances of the cells that are done.
        let mut done = [0.0f64; 2];
        let share = |v: [f64; 2]| v[0].max(v[1] / 25.0) / (target * target);
        let mut level = first;
        loop {
            self.cast(bvh, origin, frame, seed, level);
            seen.rays += self.cells.len();
            seen.enclosed &= self.hits.iter().all(|h| *h);
            let refine = matches!(effort, Effort::Error(_)) && level < MAX_LEVEL && seen.rays < MAX_RAYS;
            self.open.clear();
            let mut open = [0.0f64; 2];
            for (k, &cell) in self.cells.iter().enumerate() {
                let (around, among) = self.neighbours(first, level, cell, self.hits[k]);
                let own = if self.hits[k] { 0.0 } else { 1.0 };
                let w = table.weight(level, cell).map(|w| f64::from(w) * f64::from(w));
                let spread = f64::from((own - around) * (own - around));
                let variance = w.map(|w| w * spread);
                let divide = refine && among > 0.0 && among < 1.0;
                let sum = if divide { &mut open } else { &mut done };
                sum[0] += variance[0];
                sum[1] += variance[1];
                if divide {
                    let expected = (f64::from(among * (1.0 - among)) * share(w)).max(share(variance)) as f32;
                    self.open.push(Open { expected, cell, hit: self.hits[k], variance });
                } else if self.hits[k] {
                    put(&mut self.blocked, level, cell, table);
                }
            }
            seen.error = [0, 1].map(|k| (done[k] + open[k]).sqrt());
            if seen.error[0] <= target && seen.error[1] <= 5.0 * target {
                self.open.iter_mut().for_each(|o| o.expected = 0.0);
            } else {
                self.choose(0.8 * (1.0 - 0.5f64.powi((level - first + 1) as i32)) - share(done));
            }
            self.cells.clear();
            for o in &self.open {
                if o.expected > 0.0 {
                    self.cells.extend((0..4).map(|k| o.cell << 2 | k));
                } else {
                    if o.hit {
                        put(&mut self.blocked, level, o.cell, table);
                    }
                    done[0] += o.variance[0];
                    done[1] += o.variance[1];
                }
            }
            if self.cells.is_empty() {
                break;
            }
            level += 1;
        }
        // The grid's own map is written anew for every site.
        for map in &mut self.maps[first as usize + 1..=level as usize] {
            map.fill(NONE);
        }
        seen
    }

    /// Leaves those cells as they are (expected 0) that matter least, such as those near the horizon, as long as their
    /// variance is within `allowed`.
    fn choose(&mut self, allowed: f64) {
        self.order.clear();
        self.order.extend(self.open.iter().map(|o| o.expected));
        self.order.sort_unstable_by(f32::total_cmp);
        let (mut sum, mut limit) = (0.0, 0.0);
        for &q in &self.order {
            sum += f64::from(q);
            if sum > allowed {
                break;
            }
            limit = q;
        }
        self.open.iter_mut().filter(|o| o.expected <= limit).for_each(|o| o.expected = 0.0);
    }

    /// One ray in each of the cells.
    fn cast(&mut self, bvh: &Bvh, origin: Vec3, frame: Mat3, seed: u32, level: u32) {
        let scale = 1.0 / (1u32 << level) as f32;
        self.rays.clear();
        for &cell in &self.cells {
            let ([x, y], [u, v]) = (place(cell), jitter(seed, level, cell));
            let d = direction((x as f32 + u) * scale, (y as f32 + v) * scale);
            self.rays.push(Ray { origin, direction: frame * d });
        }
        self.hits.clear();
        self.hits.resize(self.rays.len(), false);
        bvh.occluded_each(&self.rays, f32::INFINITY, &mut self.hits);
        while self.maps.len() <= level as usize {
            self.maps.push(vec![NONE; 1 << (2 * self.maps.len())]);
        }
        let map = &mut self.maps[level as usize];
        for (&cell, hit) in self.cells.iter().zip(&self.hits) {
            let [x, y] = place(cell);
            map[((y << level) + x) as usize] = u8::from(!hit);
        }
    }

    /// Mean of the neighbours of a cell, or of what they are parts of; and the mean of all nine, in which those beyond
    /// the horizon count as blocked.
    #[inline(always)]
    fn neighbours(&self, first: u32, level: u32, cell: u32, hit: bool) -> (f32, f32) {
        let ([x, y], side) = (place(cell), 1u32 << level);
        let (mut sum, mut count) = (0u32, 0u32);
        for j in y.saturating_sub(1)..=(y + 1).min(side - 1) {
            for i in x.saturating_sub(1)..=(x + 1).min(side - 1) {
                if (i, j) != (x, y) {
                    sum += u32::from(self.value(first, level, i, j));
                    count += 1;
                }
            }
        }
        let around = if count == 0 { 0.0 } else { sum as f32 / count as f32 };
        (around, (sum + u32::from(!hit)) as f32 / 9.0)
    }

    #[inline(always)]
    fn value(&self, first: u32, level: u32, x: u32, y: u32) -> u8 {
        let (mut level, mut x, mut y) = (level, x, y);
        loop {
            let v = self.maps[level as usize][((y << level) + x) as usize];
            if v != NONE || level == first {
                return v & 1;
            }
            (level, x, y) = (level - 1, x >> 1, y >> 1);
        }
    }
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

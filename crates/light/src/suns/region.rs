//! Where the suns are.

use super::moments::Grid;
use super::{SunOptions, luminance};
use glam::{DMat2, DVec2, DVec3};
use std::collections::BinaryHeap;
use steradian_sphere::SphereImage;

/// A region starts at a texel that is this many times brighter than the mean. Half and twice give the same
/// suns in 28 environments at 512 and at 128 rows.
const MIN_SEED_OVER_MEAN: f64 = 20.0;
/// A region grows to texels down to this part of its own flux-weighted mean radiance, so that the glare of a
/// lens is taken too. In 28 environments with 17 suns and lamps, half as much takes 0.5 % more of the flux of
/// suns and loses one lamp to what surrounds it; twice as much finds the same.
const MIN_OVER_REGION_MEAN: f64 = 5e-3;
/// A region ends at texels less than this many times as bright as the median of what lies around. Half as
/// much loses two of 17 lamps, twice as much none, but leaves a tenth of the flux of a sun behind haze.
const MIN_OVER_SURROUNDINGS: f64 = 4.0;
/// A region that is still brighter than this part of its mean where it reaches the largest radius is a
/// window, not a sun. Half as much loses four of 17 lamps at 512 rows; twice as much gives the same suns
/// there.
const MAX_AT_RIM: f64 = 0.05;
/// Largest ratio of a sun's axes. Of 17 suns and lamps in 28 environments at 512 rows, 1 keeps eight; 4 takes
/// two more lamps of one environment.
const MAX_AXIS_RATIO: f64 = 2.0;
/// Larger half axis, radians, from which on the ratio of axes counts: regions below 1.1° are a few texels,
/// which show no shape.
const MIN_SHAPED_RADIUS: f64 = 0.02;

/// A texel that a region may grow to; the brightest first, then the first.
#[derive(PartialEq)]
struct Next(f64, usize);

impl Eq for Next {}

impl Ord for Next {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0).then(other.1.cmp(&self.1))
    }
}

impl PartialOrd for Next {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

struct Search<'a> {
    grid: &'a Grid,
    y: Vec<f64>,
    seen: Vec<bool>,
    o: &'a SunOptions,
    /// Largest radius: the options', or that of a few texels.
    largest: f64,
}

/// Any region may reach this many rows from its brightest texel, whatever the largest radius is: the centres
/// of the eight texels around lie within √2 rows at the equator.
const MIN_REACH_ROWS: f64 = 1.6;

/// The texels of every sun, the strongest first.
pub fn find(image: &SphereImage, grid: &Grid, o: &SunOptions) -> Vec<Vec<usize>> {
    let texels = image.width * image.height;
    let value = |k: usize| luminance(std::array::from_fn(|c| f64::from(image.planes[c][k]))).max(0.0);
    let y: Vec<f64> = (0..texels).map(value).collect();
    let whole: f64 = y.iter().enumerate().map(|(k, y)| y * grid.omega(k)).sum();
    let least = MIN_SEED_OVER_MEAN * whole / (4.0 * std::f64::consts::PI);
    let mut seeds: Vec<usize> = (0..texels).filter(|&k| y[k] > least).collect();
    seeds.sort_by(|&a, &b| y[b].total_cmp(&y[a]).then(a.cmp(&b)));
    let largest = o.largest.max(MIN_REACH_ROWS * std::f64::consts::PI / image.height as f64);
    let mut search = Search { grid, seen: vec![false; texels], y, o, largest };
    let mut found = Vec::new();
    for seed in seeds {
        if !search.seen[seed]
            && let Some((flux, region)) = search.grow(seed)
            && flux >= o.share * whole
        {
            found.push((flux, region));
        }
    }
    found.sort_by(|a: &(f64, Vec<usize>), b| b.0.total_cmp(&a.0));
    found.truncate(o.most);
    found.into_iter().map(|f| f.1).collect()
}

impl Search<'_> {
    /// The median of what lies around `centre`, between 1 and 1.5 times the largest radius.
    fn surroundings(&self, centre: DVec3) -> f64 {
        let (inner, outer) = (self.largest.cos(), (1.5 * self.largest).cos());
        let rows = self.rows(centre, 1.5 * self.largest);
        let near = rows.flat_map(|j| j * self.grid.width..(j + 1) * self.grid.width).filter(|&k| {
            let c = self.grid.direction(k).dot(centre);
            (outer..inner).contains(&c)
        });
        let mut values: Vec<f64> = near.map(|k| self.y[k]).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    }

    fn rows(&self, centre: DVec3, radius: f64) -> std::ops::Range<usize> {
        let h = self.grid.height as f64;
        let v = centre.y.clamp(-1.0, 1.0).acos() / std::f64::consts::PI * h;
        let reach = radius / std::f64::consts::PI * h + 1.0;
        (v - reach).max(0.0) as usize..((v + reach).min(h - 1.0) as usize + 1)
    }

    /// The region about `seed` with its flux, or `None` where it is none of a sun. What was looked at is
    /// seen.
    fn grow(&mut self, seed: usize) -> Option<(f64, Vec<usize>)> {
        let peak = self.grid.direction(seed);
        let around = self.surroundings(peak);
        let mut heap = BinaryHeap::from([Next(self.y[seed], seed)]);
        self.seen[seed] = true;
        let mut region = Vec::new();
        let (mut flux, mut square, mut window) = (0.0, 0.0, 0.0f64);
        while let Some(Next(y, k)) = heap.pop() {
            let reference = if flux > 0.0 { square / flux } else { y };
            if y < (MIN_OVER_REGION_MEAN * reference).max(MIN_OVER_SURROUNDINGS * around) {
                // Nothing brighter is left; what is not taken may belong to another region.
                self.seen[k] = false;
                heap.into_iter().for_each(|n| self.seen[n.1] = false);
                break;
            }
            if self.grid.direction(k).dot(peak) < self.largest.cos() {
                window = window.max(y);
                continue;
            }
            let omega = self.grid.omega(k);
            flux += y * omega;
            square += y * y * omega;
            region.push(k);
            for n in self.grid.around(k) {
                if !std::mem::replace(&mut self.seen[n], true) {
                    heap.push(Next(self.y[n], n));
                }
            }
        }
        let reference = square / flux.max(f64::MIN_POSITIVE);
        let sun = reference >= self.o.contrast * around && self.is_round(&region);
        if window > MAX_AT_RIM * reference {
            self.flood(&region, MIN_OVER_REGION_MEAN * reference);
            return None;
        }
        sun.then_some((flux, region))
    }

    /// Marks all that hangs together with `region` and is at least as bright as `cut`.
    fn flood(&mut self, region: &[usize], cut: f64) {
        let mut open: Vec<usize> = region.iter().flat_map(|&k| self.grid.around(k)).collect();
        let mut done = std::collections::HashSet::new();
        while let Some(k) = open.pop() {
            if self.y[k] >= cut && done.insert(k) {
                self.seen[k] = true;
                open.extend(self.grid.around(k));
            }
        }
    }

    /// By the second moments of its light about its centre, in the tangent plane.
    fn is_round(&self, region: &[usize]) -> bool {
        let weight = |k: usize| self.y[k] * self.grid.omega(k);
        let centre: DVec3 = region.iter().map(|&k| self.grid.direction(k) * weight(k)).sum();
        let centre = centre.normalize_or(DVec3::Y);
        let (a, b) = centre.any_orthonormal_pair();
        let (mut m, mut sum) = (DMat2::ZERO, 0.0);
        for &k in region {
            let d = self.grid.direction(k);
            let p = DVec2::new(d.dot(a), d.dot(b));
            m += DMat2::from_cols(p * p.x, p * p.y) * weight(k);
            sum += weight(k);
        }
        let step = std::f64::consts::PI / self.grid.height as f64;
        let [xx, yy] = [m.x_axis.x, m.y_axis.y].map(|v| v / sum + step * step / 12.0);
        let (mean, off) = (0.5 * (xx + yy), (0.5 * (xx - yy)).hypot(m.x_axis.y / sum));
        let [long, short] = [mean + off, (mean - off).max(step * step / 12.0)].map(|v| 2.0 * v.sqrt());
        long <= MIN_SHAPED_RADIUS || long <= MAX_AXIS_RATIO * short
    }
}

//! Where the suns are.

use super::moments::Grid;
use super::{SunOptions, luminance};
use glam::{DMat2, DVec2, DVec3};
use std::collections::BinaryHeap;
use steradian_sphere::SphereImage;

/// A region starts at a texel that is this many times brighter than the mean.
const SEED: f64 = 20.0;
/// It grows to texels down to this part of its own flux-weighted mean radiance …
const CUT: f64 = 5e-3;
/// … but not to what is less than this many times as bright as what lies around.
const ABOVE: f64 = 4.0;
/// A region that still is this bright where it would become too large is a window, not a sun.
const WINDOW: f64 = 0.05;
/// The ratio of a sun's axes at most …
const ELONGATED: f64 = 2.0;
/// … where its larger half axis exceeds this, radians.
const LARGE: f64 = 0.02;

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

/// Any region may be this many rows wide.
const TEXELS: f64 = 1.6;

/// The texels of every sun, the strongest first.
pub fn find(image: &SphereImage, grid: &Grid, o: &SunOptions) -> Vec<Vec<usize>> {
    let texels = image.width * image.height;
    let value = |k: usize| luminance(std::array::from_fn(|c| f64::from(image.planes[c][k]))).max(0.0);
    let y: Vec<f64> = (0..texels).map(value).collect();
    let whole: f64 = y.iter().enumerate().map(|(k, y)| y * grid.omega(k)).sum();
    let least = SEED * whole / (4.0 * std::f64::consts::PI);
    let mut seeds: Vec<usize> = (0..texels).filter(|&k| y[k] > least).collect();
    seeds.sort_by(|&a, &b| y[b].total_cmp(&y[a]).then(a.cmp(&b)));
    let largest = o.largest.max(TEXELS * std::f64::consts::PI / image.height as f64);
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
            if y < (CUT * reference).max(ABOVE * around) {
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
        if window > WINDOW * reference {
            self.flood(&region, CUT * reference);
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
        long <= LARGE || long <= ELONGATED * short
    }
}

//! Interpolation of the probes' light at a point.

use super::{Places, Probes};
use glam::{DVec3, UVec3};

/// Probes anywhere of which a point takes the nearest so many.
const NEAREST: usize = 8;

/// Along one axis of a grid: the cell that holds a coordinate, and the part of it that lies before the
/// coordinate. Beyond the ends it is that of the end.
fn cell(x: f64, [lo, hi]: [f64; 2], n: usize) -> Option<(usize, f64)> {
    let x = if n <= 1 || hi <= lo { 0.0 } else { (x - lo) / (hi - lo) * (n - 1) as f64 };
    if !x.is_finite() {
        return None;
    }
    let x = x.clamp(0.0, n.saturating_sub(1) as f64);
    let i = (x as usize).min(n.saturating_sub(2));
    Some((i, x - i as f64))
}

impl Probes {
    /// The probes whose light a point gets, with weights that sum to 1; none where p is not finite or all
    /// probes are inside solids.
    ///
    /// In a grid the eight of its cell, trilinear, of which those inside solids are left out and the weights
    /// of the others renormalised; outside the grid those of its nearest point; where all eight are inside
    /// solids the probe that is not and lies nearest to the nearest of them. Of probes anywhere the eight
    /// nearest, weighted by ((R − d) / (R d))², d being their distances and R that of the ninth (Franke &
    /// Nielson 1980, after Shepard 1968; 1/d² where there is none), which is continuous.
    pub fn weights(&self, p: DVec3) -> Vec<(usize, f64)> {
        if !p.is_finite() {
            return Vec::new();
        }
        let mut out = match &self.places {
            Places::Grid { bounds, size } => self.in_grid(p, *bounds, *size),
            Places::Points(places) => self.anywhere(p, places),
        };
        let sum: f64 = out.iter().map(|w| w.1).sum();
        out.iter_mut().for_each(|w| w.1 /= sum);
        out
    }

    fn in_grid(&self, p: DVec3, [lo, hi]: [DVec3; 2], size: UVec3) -> Vec<(usize, f64)> {
        let size = size.to_array().map(|n| n.max(1) as usize);
        let mut out = Vec::with_capacity(8);
        let axis = |k: usize| cell(p[k], [lo[k], hi[k]], size[k]);
        let [Some(x), Some(y), Some(z)] = [0, 1, 2].map(axis) else { return out };
        let mut heaviest = (0.0, 0);
        for c in 0..8usize {
            let of = |(i, f): (usize, f64), far: bool, n: usize| {
                if far { ((i + 1).min(n - 1), f) } else { (i, 1.0 - f) }
            };
            let (a, b, d) = (of(x, c & 1 > 0, size[0]), of(y, c & 2 > 0, size[1]), of(z, c & 4 > 0, size[2]));
            let (index, w) = (a.0 + size[0] * (b.0 + size[1] * d.0), a.1 * b.1 * d.1);
            if w > heaviest.0 {
                heaviest = (w, index);
            }
            if w > 0.0 && self.light.get(index).is_some_and(Option::is_some) {
                out.push((index, w));
            }
        }
        if out.is_empty() {
            out.extend(self.nearest(self.places.position(heaviest.1), 1).first().map(|(_, k)| (*k, 1.0)));
        }
        out
    }

    fn anywhere(&self, p: DVec3, places: &[DVec3]) -> Vec<(usize, f64)> {
        assert_eq!(places.len(), self.light.len());
        let near = self.nearest(p, NEAREST + 1);
        if let Some((_, k)) = near.first().filter(|n| n.0 == 0.0) {
            return vec![(*k, 1.0)];
        }
        let weight = |d: f64| match near.get(NEAREST) {
            Some((r, _)) => ((r - d) / (r * d)).powi(2),
            None => (1.0 / d).powi(2),
        };
        let some: Vec<_> = near.iter().take(NEAREST).map(|(d, k)| (*k, weight(*d))).collect();
        if some.iter().any(|w| w.1 > 0.0 && w.1.is_finite()) {
            return some.into_iter().filter(|w| w.1 > 0.0).collect();
        }
        // All are equally far away.
        some.into_iter().map(|(k, _)| (k, 1.0)).collect()
    }

    /// Distances and numbers of the probes nearest to p that are outside solids, in their order.
    fn nearest(&self, p: DVec3, n: usize) -> Vec<(f64, usize)> {
        let there = (0..self.light.len()).filter(|k| self.light[*k].is_some());
        let mut all: Vec<(f64, usize)> = there.map(|k| (self.places.position(k).distance(p), k)).collect();
        let order = |a: &(f64, usize), b: &(f64, usize)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if all.len() > n {
            all.select_nth_unstable_by(n, order);
            all.truncate(n);
        }
        all.sort_by(order);
        all
    }

    /// Marks the probes of the cells that a box touches, and where these are all inside solids, all probes.
    pub(super) fn mark_cells(&self, [lo, hi]: [DVec3; 2], needed: &mut [bool]) {
        let Places::Grid { bounds, size } = &self.places else { return };
        let size = size.to_array().map(|n| n.max(1) as usize);
        let span = |k: usize| {
            let axis = [bounds[0][k], bounds[1][k]];
            let (a, b) = (cell(lo[k], axis, size[k])?, cell(hi[k], axis, size[k])?);
            Some((a.0, (b.0 + 1).min(size[k] - 1)))
        };
        let [Some(x), Some(y), Some(z)] = [0, 1, 2].map(span) else { return };
        for k in z.0..=z.1 {
            for j in y.0..=y.1 {
                for i in x.0..=x.1 {
                    let index = i + size[0] * (j + size[1] * k);
                    if needed.get(index).is_none_or(|n| *n) {
                        continue;
                    }
                    needed[index] = true;
                    // Near it a point may have none of its eight.
                    if self.light.get(index).is_some_and(Option::is_none)
                        && let Some((_, k)) = self.nearest(self.places.position(index), 1).first()
                    {
                        needed[*k] = true;
                    }
                }
            }
        }
    }
}

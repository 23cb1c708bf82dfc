//! Regular grids of measurements in four coordinates, linear between neighbours.

use super::half_table::Lookup;
use super::tabulated::Twin;
use crate::math::{half, polar_angle};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::Arc;
use steradian_simd::run;

/// The four coordinates of a grid, slowest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Coordinates {
    /// √θ_h, φ_h, θ_d and φ_d modulo π (Rusinkiewicz 1998), values at the centres of cells. One cell in φ_h:
    /// isotropic. f is reciprocal by construction.
    Half,
    /// θ_i, φ_i, θ_o, φ_o, values at nodes; the last polar angle is given in whole degrees.
    Directions {
        /// Degrees.
        last: u32,
    },
    /// θ_i, θ_o, φ_o − φ_i, φ_i, values at the centres of cells.
    Differences,
}

impl Coordinates {
    fn code(self) -> f64 {
        match self {
            Self::Half => 0.0,
            Self::Differences => 1.0,
            Self::Directions { last } => 1.0 + f64::from(last),
        }
    }

    fn of_code(code: f64) -> Option<Self> {
        match code {
            0.0 => Some(Self::Half),
            1.0 => Some(Self::Differences),
            2.0..=91.0 if code.fract() == 0.0 => Some(Self::Directions { last: code as u32 - 1 }),
            _ => None,
        }
    }
}

/// Most cells of a grid.
const MAX_CELLS: usize = 1 << 27;
/// Cells per coordinate of tables made here: MERL's.
pub(super) const MERL: [usize; 4] = [90, 1, 90, 180];

/// A grid without missing cells.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Grid {
    coordinates: Coordinates,
    sizes: [usize; 4],
    /// sr⁻¹, the last coordinate fastest.
    cells: Arc<Vec<[f32; 3]>>,
}

/// (θ_h, φ_h, θ_d, φ_d) of two directions above the horizon, φ_d in [0, π).
pub(super) fn half_angles(wi: DVec3, wo: DVec3) -> [f64; 4] {
    let h = half(wi, wo);
    let s = h.x.hypot(h.y);
    let (cp, sp) = if s > 0.0 { (h.x / s, h.y / s) } else { (1.0, 0.0) };
    let (x, y) = (DVec3::new(h.z * cp, h.z * sp, -s).dot(wi), wi.y * cp - wi.x * sp);
    let turn = y.atan2(x);
    let turn = if turn < 0.0 { turn + PI } else { turn };
    let turn = if turn >= PI { 0.0 } else { turn };
    [polar_angle(h), sp.atan2(cp), x.hypot(y).atan2(h.dot(wi)), turn]
}

/// Light and view of half and difference angles.
pub(super) fn of_half_angles([theta_h, phi_h, theta_d, phi_d]: [f64; 4]) -> (DVec3, DVec3) {
    let ((sh, ch), (sd, cd), (sp, cp)) = (theta_h.sin_cos(), theta_d.sin_cos(), phi_d.sin_cos());
    let half = DVec3::new(sh, 0.0, ch);
    let across = DVec3::new(ch, 0.0, -sh) * (sd * cp) + DVec3::Y * (sd * sp);
    let (s, c) = phi_h.sin_cos();
    let turned =
        |w: DVec3| if phi_h == 0.0 { w } else { DVec3::new(c * w.x - s * w.y, s * w.x + c * w.y, w.z) };
    (turned(half * cd + across), turned(half * cd - across))
}

impl Grid {
    /// A grid in which cells with a number that is not finite are missing: such a cell takes the nearest cell
    /// at a smaller coordinate, else at a greater one, along each coordinate of `order` in turn. `None` where
    /// all are missing or sizes do not fit.
    pub fn filled(
        coordinates: Coordinates,
        sizes: [usize; 4],
        mut cells: Vec<[f32; 3]>,
        order: &[usize],
    ) -> Option<Self> {
        if sizes.iter().product::<usize>() != cells.len() || cells.len() > MAX_CELLS {
            return None;
        }
        let there = |c: &[f32; 3]| c.iter().all(|v| v.is_finite());
        for &axis in order.iter().chain(&[0, 1, 2, 3]) {
            if cells.iter().all(there) {
                break;
            }
            let stride: usize = sizes[axis + 1..].iter().product();
            for first in (0..cells.len()).filter(|i| (i / stride).is_multiple_of(sizes[axis])) {
                let mut last = None;
                let line = (0..sizes[axis]).map(|k| first + k * stride);
                for i in line.clone().chain(line.rev()) {
                    if there(&cells[i]) {
                        last = Some(cells[i]);
                    } else if let Some(value) = last {
                        cells[i] = value;
                    }
                }
            }
        }
        let whole = !cells.is_empty() && cells.iter().all(there);
        whole.then(|| Self { coordinates, sizes, cells: Arc::new(cells) })
    }

    /// Light and view at the centre of the cell `i` of a grid of [`Coordinates::Half`].
    pub fn centre(sizes: [usize; 4], i: usize) -> (DVec3, DVec3) {
        let [nh, np, nd, nt] = sizes;
        let at = |i: usize, n: usize| (i as f64 + 0.5) / n as f64;
        let theta_h = at(i / (np * nd * nt), nh).powi(2) * FRAC_PI_2;
        let phi_h = if np == 1 { 0.0 } else { at(i / (nd * nt) % np, np) * TAU };
        of_half_angles([theta_h, phi_h, at(i / nt % nd, nd) * FRAC_PI_2, at(i % nt, nt) * PI])
    }

    /// Are light and view above the horizon at the centres of cells of an isotropic grid of
    /// [`Coordinates::Half`]? In the cells' order. Both are where cos θ_h cos θ_d exceeds sin θ_h sin θ_d
    /// |cos φ_d|.
    pub fn centres_above([nh, nd, nt]: [usize; 3]) -> impl Iterator<Item = bool> {
        let at = |n: usize, whole: f64| (0..n).map(move |i| (i as f64 + 0.5) / n as f64 * whole);
        let turns: Vec<f64> = at(nt, PI).map(|t| t.cos().abs()).collect();
        let d: Vec<(f64, f64)> = at(nd, FRAC_PI_2).map(f64::sin_cos).collect();
        at(nh, 1.0).flat_map(move |h| {
            let (sh, ch) = (h * h * FRAC_PI_2).sin_cos();
            let rows = d.iter().map(|(sd, cd)| (sh * sd, ch * cd));
            let above = rows.flat_map(|(s, c)| turns.iter().map(move |t| c > s * t));
            above.collect::<Vec<bool>>()
        })
    }

    /// See [`Brdf::held`]: the kind of its coordinates, the sizes, the cells.
    pub fn numbers(&self) -> Vec<f64> {
        let head = std::iter::once(self.coordinates.code()).chain(self.sizes.iter().map(|n| *n as f64));
        head.chain(self.cells.iter().flatten().map(|v| f64::from(*v))).collect()
    }

    /// [`Grid::numbers`] undone.
    pub fn of_numbers(numbers: &[f64]) -> Option<Self> {
        let (head, cells) = numbers.split_first_chunk::<5>()?;
        let whole = |x: f64| (x >= 1.0 && x <= MAX_CELLS as f64 && x.fract() == 0.0).then_some(x as usize);
        let mut sizes = [0; 4];
        for (n, x) in sizes.iter_mut().zip(&head[1..]) {
            *n = whole(*x)?;
        }
        let count = sizes.iter().try_fold(1usize, |n, d| n.checked_mul(*d))?;
        let (cells, []) = cells.as_chunks::<3>() else { return None };
        let valid =
            count == cells.len() && cells.iter().flatten().all(|v| (0.0..=f64::from(f32::MAX)).contains(v));
        let cells = || cells.iter().map(|v| v.map(|v| v as f32)).collect();
        let coordinates = Coordinates::of_code(head[0])?;
        valid.then(|| Self { coordinates, sizes, cells: Arc::new(cells()) })
    }

    /// Every number that the grid holds.
    pub fn cells(&self) -> &[[f32; 3]] {
        &self.cells
    }

    pub fn is_isotropic(&self) -> bool {
        match self.coordinates {
            Coordinates::Half => self.sizes[1] == 1,
            Coordinates::Directions { .. } => false,
            Coordinates::Differences => self.sizes[3] == 1,
        }
    }

    /// Places among the cells, and which coordinates are periodic.
    fn place(&self, wi: DVec3, wo: DVec3) -> ([f64; 4], [bool; 4]) {
        let n = self.sizes.map(|n| n as f64);
        // At the pole components are zeros, whose signs must not decide the azimuth.
        let turn = |w: DVec3| (w.y + 0.0).atan2(w.x + 0.0);
        match self.coordinates {
            Coordinates::Half => {
                let [th, ph, td, pd] = half_angles(wi, wo);
                let at = [(th / FRAC_PI_2).sqrt(), ph / TAU, td / FRAC_PI_2, pd / PI];
                (std::array::from_fn(|k| n[k] * at[k] - 0.5), [false, true, false, true])
            }
            Coordinates::Directions { last } => {
                let theta = |w: DVec3, n: f64| polar_angle(w) / f64::from(last).to_radians() * (n - 1.0);
                let phi = |w: DVec3, n: f64| turn(w) / TAU * n;
                let at = [theta(wi, n[0]), phi(wi, n[1]), theta(wo, n[2]), phi(wo, n[3])];
                (at, [false, true, false, true])
            }
            Coordinates::Differences => {
                let at = [
                    polar_angle(wi) / FRAC_PI_2,
                    polar_angle(wo) / FRAC_PI_2,
                    (turn(wo) - turn(wi)) / TAU,
                    turn(wi) / TAU,
                ];
                (std::array::from_fn(|k| n[k] * at[k] - 0.5), [false, false, true, true])
            }
        }
    }

    /// The WGSL text, and its data: the kind of the coordinates with degrees of the last polar angle, the
    /// sizes, the cells.
    pub fn twin(&self) -> Twin {
        let (kind, last) = match self.coordinates {
            Coordinates::Half => (0.0, 90),
            Coordinates::Differences => (1.0, 90),
            Coordinates::Directions { last } => (2.0, last),
        };
        let step = f64::from(last).to_radians() as f32;
        Twin {
            source: concat!(include_str!("half.wgsl"), include_str!("grid.wgsl")),
            parameters: vec![[kind, step, 0.0, 0.0], self.sizes.map(|n| n as f32)],
            cells: self.cells.clone(),
        }
    }

    /// f of two directions above the horizon: linear in each coordinate, constant beyond the outermost cells.
    pub fn value(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if self.coordinates == Coordinates::Half && self.sizes[1] == 1 {
            let mut out = [[0.0; 3]];
            self.values(&[wi], wo, &mut out);
            return out[0];
        }
        let (place, periodic) = self.place(wi, wo);
        let axis = |k: usize| between(place[k], self.sizes[k], periodic[k]);
        let [a, b, c, d] = [axis(0), axis(1), axis(2), axis(3)];
        let mut sum = [0.0; 3];
        for (i, wi) in both(a) {
            for (j, wj) in both(b) {
                for (k, wk) in both(c) {
                    for (l, wl) in both(d) {
                        let cell = ((i * self.sizes[1] + j) * self.sizes[2] + k) * self.sizes[3] + l;
                        let w = wi * wj * wk * wl;
                        let v = self.cells[cell];
                        (0..3).for_each(|c| sum[c] += w * f64::from(v[c]));
                    }
                }
            }
        }
        sum
    }

    /// [`Grid::value`] of each of `wi`, into `out`.
    pub fn values(&self, wi: &[DVec3], wo: DVec3, out: &mut [[f64; 3]]) {
        match (self.coordinates, self.sizes) {
            (Coordinates::Half, [nh, 1, nd, nt]) => {
                run(Lookup { cells: &self.cells, sizes: [nh, nd, nt], wi, wo, out });
            }
            _ => out.iter_mut().zip(wi).for_each(|(f, wi)| *f = self.value(*wi, wo)),
        }
    }
}

/// The two cells about a place and the share of the second.
fn between(x: f64, n: usize, periodic: bool) -> (usize, usize, f64) {
    if n == 1 {
        return (0, 0, 0.0);
    }
    if periodic {
        let i = x.floor();
        let wrap = |i: f64| i.rem_euclid(n as f64) as usize % n;
        return (wrap(i), wrap(i + 1.0), x - i);
    }
    let t = x.clamp(0.0, (n - 1) as f64);
    let i = (t as usize).min(n - 2);
    (i, i + 1, t - i as f64)
}

/// Those of two neighbours that have a weight.
fn both((i, j, t): (usize, usize, f64)) -> impl Iterator<Item = (usize, f64)> {
    [(i, 1.0 - t), (j, t)].into_iter().filter(|c| c.1 > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::spherical;

    #[test]
    fn angles_go_and_come_back() {
        for (a, b) in [(0.3, 0.4), (1.2, 0.1), (0.01, 1.4)] {
            let (wi, wo) = (spherical(a, 2.0), spherical(b, 5.1));
            let angles = half_angles(wi, wo);
            let (i, o) = of_half_angles(angles);
            // φ_d modulo π: the two may have changed places.
            let same = i.distance(wi).max(o.distance(wo)).min(i.distance(wo).max(o.distance(wi)));
            assert!(same < 1e-12, "{angles:?}: {i} {o}");
            let swapped = half_angles(wo, wi);
            assert!((0..4).all(|k| (angles[k] - swapped[k]).abs() < 1e-12), "{angles:?} {swapped:?}");
        }
    }

    #[test]
    fn cells_lie_above_the_horizon_where_their_directions_do() {
        let [nh, nd, nt] = [20, 18, 24];
        let mut count = 0;
        for (i, above) in Grid::centres_above([nh, nd, nt]).enumerate() {
            let (wi, wo) = Grid::centre([nh, 1, nd, nt], i);
            // Rounding decides at the horizon.
            assert!(above == (wi.z > 0.0 && wo.z > 0.0) || wi.z.min(wo.z).abs() < 1e-12, "{i}: {wi} {wo}");
            count += 1;
        }
        assert_eq!(count, nh * nd * nt);
    }

    #[test]
    fn missing_cells_take_their_neighbours() {
        let nan = [f32::NAN; 3];
        let cell = |v: f32| [v; 3];
        let cells = vec![nan, cell(1.0), nan, nan, nan, nan];
        let grid = Grid::filled(Coordinates::Half, [2, 1, 3, 1], cells, &[2, 0]).expect("one is there");
        assert_eq!(grid.cells(), [cell(1.0); 6]);
        let cells = vec![nan, cell(1.0), nan, cell(2.0), nan, nan];
        let grid = Grid::filled(Coordinates::Half, [2, 1, 3, 1], cells, &[2, 0]).expect("two are there");
        assert_eq!(grid.cells().iter().map(|c| c[0]).collect::<Vec<_>>(), [1.0, 1.0, 1.0, 2.0, 2.0, 2.0]);
        assert!(Grid::filled(Coordinates::Half, [2, 1, 3, 1], vec![nan; 6], &[2]).is_none());
        assert!(Grid::filled(Coordinates::Half, [2, 1, 3, 1], vec![nan; 5], &[2]).is_none());
        let kept = Grid::of_numbers(&grid.numbers()).expect("whole");
        assert_eq!(kept, grid);
        assert!(Grid::of_numbers(&grid.numbers()[..20]).is_none());
        for coordinates in [Coordinates::Half, Coordinates::Differences, Coordinates::Directions { last: 75 }]
        {
            assert_eq!(Coordinates::of_code(coordinates.code()), Some(coordinates));
        }
    }

    #[test]
    fn periodic_coordinates_close() {
        assert_eq!(between(-0.25, 4, true), (3, 0, 0.75));
        assert_eq!(between(3.5, 4, true), (3, 0, 0.5));
        assert_eq!(between(3.5, 4, false), (2, 3, 1.0));
        assert_eq!(between(9.0, 1, true), (0, 0, 0.0));
    }
}

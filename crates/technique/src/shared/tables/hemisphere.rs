//! Maps over the hemisphere about the normal: rows by elevation, columns by azimuth, without trigonometry.
//!
//! Rows are equal steps of √tan(θ/2), dense at the pole, where highlights in terms of the half vector lie, or
//! of √tan(ε/2) with the elevation ε = π/2 − θ, dense at the horizon, where reflectance as a function of one
//! direction grows. Columns are equal steps of
//! |y|/(|x| + |y|) in each quadrant, between 0.7 and 1.4 times as far apart as equal angles. `hemisphere.wgsl` has the same
//! functions.

use glam::DVec3;

/// The functions in WGSL.
pub const WGSL: &str = include_str!("hemisphere.wgsl");

/// Where rows are dense.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rows {
    /// About the normal: row 0 is the pole.
    Pole,
    /// At the horizon, which is row 0.
    Horizon,
}

/// The range of azimuths that has columns of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Azimuths {
    /// One column: the azimuth changes nothing.
    One,
    /// The full circle; the first and the last column are equal.
    Full,
    /// 0 … π, where y and −y have equal values.
    Mirrored,
    /// 0 … π, where (x, y) and (−x, −y) have equal values.
    HalfTurn,
    /// 0 … π/2, where the signs of x and y do not matter.
    Quarter,
}

impl Azimuths {
    /// Its number in shaders.
    pub fn code(self) -> f32 {
        f32::from(self as u8)
    }

    fn quadrants(self) -> usize {
        [1, 4, 2, 2, 1][self as usize]
    }

    /// The column's coordinate, 0 … 1, of azimuth (x, y).
    #[inline(always)]
    fn place(self, x: f32, y: f32) -> f32 {
        let sum = x.abs() + y.abs();
        let p = if sum > 0.0 { y.abs() / sum } else { 0.0 };
        let above = if x < 0.0 { 2.0 - p } else { p };
        match self {
            Self::One => 0.0,
            Self::Quarter => p,
            Self::Mirrored => 0.5 * above,
            Self::HalfTurn => 0.5 * if y < 0.0 { 2.0 - above } else { above },
            Self::Full => 0.25 * if y < 0.0 { 4.0 - above } else { above },
        }
    }
}

/// A map's nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Map {
    /// Range of azimuths that has columns.
    pub azimuths: Azimuths,
    /// Where its rows are dense.
    pub rows: Rows,
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

/// The first row below the pole would be the horizon itself, where reflectance has no value: its nodes lie
/// this share of a step above.
const INSIDE: f64 = 0.25;

impl Map {
    /// `side` rows, and as many columns over all azimuths.
    pub fn new(azimuths: Azimuths, rows: Rows, side: usize) -> Self {
        let width = match azimuths {
            Azimuths::One => 1,
            Azimuths::Full => side + 1,
            Azimuths::Mirrored | Azimuths::HalfTurn => side / 2 + 1,
            Azimuths::Quarter => side / 4 + 1,
        };
        Self { azimuths, rows, width, height: side }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.width * self.height
    }

    /// Has it no nodes?
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Coordinates in [0, 1]² of a direction above the horizon.
    #[inline(always)]
    pub fn place(&self, w: [f32; 3]) -> [f32; 2] {
        self.place_along(w, (w[0] * w[0] + w[1] * w[1]).sqrt(), 1.0)
    }

    /// Coordinates of a vector of length `length` whose part perpendicular to the normal has length `across`.
    #[inline(always)]
    pub fn place_along(&self, w: [f32; 3], across: f32, length: f32) -> [f32; 2] {
        let row = match self.rows {
            Rows::Pole => across / (length + w[2]),
            Rows::Horizon => w[2] / (length + across),
        };
        [self.azimuths.place(w[0], w[1]), row.max(0.0).sqrt()]
    }

    /// Azimuth of a column's coordinate, radians.
    fn azimuth(&self, u: f64) -> f64 {
        let quadrant = u * self.azimuths.quadrants() as f64;
        let p = quadrant - quadrant.floor();
        (quadrant.floor() * std::f64::consts::FRAC_PI_2) + p.atan2(1.0 - p)
    }

    /// Cosine and sine of the angle from the normal at a row's coordinate.
    fn elevation(&self, v: f64) -> [f64; 2] {
        let t = v * v;
        let [a, b] = [(1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t)];
        match self.rows {
            Rows::Pole => [a, b],
            Rows::Horizon => [b, a],
        }
    }

    /// Coordinates of a node, and of its cell's ends, along one axis.
    fn cell(k: usize, count: usize) -> [f64; 3] {
        let last = (count - 1).max(1) as f64;
        let at = |x: f64| (x / last).clamp(0.0, 1.0);
        [at(k as f64 - 0.5), at(k as f64), at(k as f64 + 0.5)]
    }

    /// Direction of node `k`, columns first; above the horizon.
    pub fn direction(&self, k: usize) -> DVec3 {
        let (i, j) = (k % self.width, k / self.width);
        let v = Self::cell(j, self.height)[1];
        let inside = INSIDE / (self.height - 1).max(1) as f64;
        let v = match self.rows {
            Rows::Pole => v.min(1.0 - inside),
            Rows::Horizon => v.max(inside),
        };
        let [z, sine] = self.elevation(v);
        let (s, c) = self.azimuth(Self::cell(i, self.width)[1]).sin_cos();
        DVec3::new(sine * c, sine * s, z)
    }

    /// Solid angle of node `k`'s cell, in the share of the hemisphere that the columns cover.
    pub fn solid_angle(&self, k: usize) -> f64 {
        let (i, j) = (k % self.width, k / self.width);
        let [low, _, high] = Self::cell(j, self.height);
        let height = (self.elevation(low)[0] - self.elevation(high)[0]).abs();
        if self.width == 1 {
            return height * std::f64::consts::TAU;
        }
        let [low, _, high] = Self::cell(i, self.width);
        height * (self.azimuth(high) - self.azimuth(low))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const ALL: [Azimuths; 5] =
        [Azimuths::One, Azimuths::Full, Azimuths::Mirrored, Azimuths::HalfTurn, Azimuths::Quarter];

    /// Nodes lie where lookups find them, and their cells cover their part of the hemisphere.
    #[test]
    fn nodes_lie_where_lookups_find_them() {
        for azimuths in ALL {
            for rows in [Rows::Pole, Rows::Horizon] {
                let m = Map::new(azimuths, rows, 32);
                let horizon = if rows == Rows::Pole { 31 } else { 0 };
                for k in 0..m.len() {
                    let (i, j) = (k % m.width, k / m.width);
                    let [u, v] = m.place(m.direction(k).as_vec3().to_array());
                    let (x, y) = (u * (m.width - 1) as f32, v * 31.0);
                    let inside = if j == horizon { 0.26 } else { 1e-3 };
                    assert!((y - j as f32).abs() < inside, "{azimuths:?} {rows:?}: {i} {j}: {y}");
                    // At the pole any column is right, and the first and the last column of a full circle are
                    // equal.
                    let ends =
                        matches!(azimuths, Azimuths::Full | Azimuths::HalfTurn) && i % (m.width - 1) == 0;
                    let pole = v == 0.0 && rows == Rows::Pole || v > 0.999 && rows == Rows::Horizon;
                    assert!(pole || ends || (x - i as f32).abs() < 1e-3, "{azimuths:?}: {i} {j}: {x}");
                }
                let all: f64 = (0..m.len()).map(|k| m.solid_angle(k)).sum();
                let share = [4.0, 4.0, 2.0, 2.0, 1.0][azimuths as usize] / 4.0;
                assert!((all - share * TAU).abs() < 1e-12, "{azimuths:?} {rows:?}: {all}");
            }
        }
    }

    /// Directions that symmetry makes equal have the same coordinates.
    #[test]
    fn what_is_the_same_has_one_place() {
        let w = [0.3f32, -0.5, 0.8];
        let at = |a: Azimuths, x: f32, y: f32| Map::new(a, Rows::Pole, 32).place([x, y, w[2]]);
        assert_eq!(at(Azimuths::Mirrored, w[0], w[1]), at(Azimuths::Mirrored, w[0], -w[1]));
        assert_eq!(at(Azimuths::HalfTurn, w[0], w[1]), at(Azimuths::HalfTurn, -w[0], -w[1]));
        assert_eq!(at(Azimuths::Quarter, w[0], w[1]), at(Azimuths::Quarter, -w[0], w[1]));
        assert_ne!(at(Azimuths::Full, w[0], w[1]), at(Azimuths::Full, -w[0], w[1]));
        assert!(at(Azimuths::Full, 0.0, 0.0).iter().all(|x| x.is_finite()));
    }
}

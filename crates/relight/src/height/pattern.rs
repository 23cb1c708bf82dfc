//! Height fields by formula, where there is no measurement: patterns that repeat, from 0 to 1 over the unit
//! square.

use std::f64::consts::{PI, TAU};

/// A pattern.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pattern {
    /// Four by four half balls on a plane.
    Hemispheres,
    /// Six grooves of two even walls each, along the columns.
    Grooves,
    /// Plain weave of six threads either way, over and under each other in turns.
    Weave,
    /// Flat clods parted by cracks, around 24 points.
    Cracks,
}

impl Pattern {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Hemispheres, Self::Grooves, Self::Weave, Self::Cracks];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Hemispheres => "hemispheres",
            Self::Grooves => "grooves",
            Self::Weave => "weave",
            Self::Cracks => "cracks",
        }
    }

    /// The pattern of this name.
    pub fn of_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name)
    }

    /// Height over the unit square, which repeats: 0 to 1.
    pub fn height(self, x: f64, y: f64) -> f64 {
        match self {
            Self::Hemispheres => {
                let [u, v] = [x, y].map(|t| (4.0 * t).rem_euclid(1.0) - 0.5);
                let radius = 0.42;
                (1.0 - (u * u + v * v) / (radius * radius)).max(0.0).sqrt()
            }
            Self::Grooves => (2.0 * (6.0 * x).rem_euclid(1.0) - 1.0).abs(),
            Self::Weave => weave(x, y),
            Self::Cracks => cracks(x, y),
        }
    }

    /// Heights of the texels of a square, at their centres, rows from the top.
    pub fn heights(self, side: usize) -> Vec<f32> {
        let at = |k: usize| (k as f64 + 0.5) / side as f64;
        (0..side * side).map(|k| self.height(at(k % side), at(k / side)) as f32).collect()
    }
}

/// The higher one of two threads that cross: round ones whose middles rise and fall.
fn weave(x: f64, y: f64) -> f64 {
    // Each way; even, so that over and under continue on the next tile.
    const THREADS: f64 = 6.0;
    let thread = |across: f64, along: f64| {
        let s = 2.0 * (across.rem_euclid(1.0) - 0.5) / 0.92;
        let turn = if (across.floor() as i64).rem_euclid(2) == 0 { 1.0 } else { -1.0 };
        let round = (1.0 - s * s).max(0.0).sqrt();
        if s.abs() < 1.0 { 0.3 * round + 0.35 * (1.0 + turn * (PI * along).sin()) } else { 0.0 }
    };
    let (u, v) = (THREADS * x, THREADS * y);
    thread(u, v).max(thread(v, u + 1.0))
}

/// Difference between the distances to the second nearest and to the nearest of some points (Worley 1996),
/// limited where clods are flat.
fn cracks(x: f64, y: f64) -> f64 {
    // A fifth of the width apart; slopes take half of CRACK_WIDTH on either side, a third of a clod.
    const CLODS: u64 = 24;
    const CRACK_WIDTH: f64 = 0.06;
    let unit = |k: u64| {
        // Steele, Lea & Flood 2014, SplitMix.
        let mut z = (k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    };
    let around = |a: f64, b: f64| (a - b + 0.5).rem_euclid(1.0) - 0.5;
    let (mut first, mut second) = (f64::INFINITY, f64::INFINITY);
    for k in 0..CLODS {
        let d = around(x, unit(2 * k)).hypot(around(y, unit(2 * k + 1)));
        (first, second) = (first.min(d), second.min(d.max(first)));
    }
    let t = ((second - first) / CRACK_WIDTH).clamp(0.0, 1.0);
    0.5 - 0.5 * (0.5 * TAU * t).cos()
}

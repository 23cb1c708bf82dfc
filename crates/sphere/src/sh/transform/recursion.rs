//! Ishioka's recursion for one m, which steps over two degrees at a time: coefficients and starting values.
//!
//! K. Ishioka, "A new recurrence formula for efficient computation of spherical harmonic transform", J. Met.
//! Soc. Japan 96 (2018). With ε_l as in x P̄_l = ε_{l+1} P̄_{l+1} + ε_l P̄_{l−1} and q_k = P̄_{m+2k+1}/x,
//! P̄_{m+2k} = ε_{m+2k+1} q_k + ε_{m+2k} q_{k−1}: one sequence, even in x, serves degrees of both parities.
//! q_k = α_k r_k with α_k α_{k+1} = ±1/(ε_{m+2k+2} ε_{m+2k+3}) turns
//! x² q_k = ε_{j+1}ε_{j+2} q_{k+1} + (ε_{j+1}² + ε_j²) q_k + ε_j ε_{j−1} q_{k−1}, j = m+2k+1, into
//! r_{k+1} = (A_k x² + B_k) r_k + r_{k−1}, r_0 = P̄_mm, r_{−1} = 0.

use super::rings::{BLOCK, Rings};
use crate::sh::basis::{BIG, SMALL, epsilon};
use steradian_simd::{Arch, Kernel};

/// Rings that one pass of a loop takes, a register of AVX-512 or two of AVX2.
const LANES: usize = 8;
/// 2⁴⁰⁰ and 2⁻⁴⁰⁰: beyond either a number moves to another scale.
const HALF_BIG: f64 = f64::from_bits((1023 + 400) << 52);
const HALF_SMALL: f64 = f64::from_bits((1023 - 400) << 52);

/// The constants of step k.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// A_k = ±α_k².
    pub(super) a: f64,
    /// B_k = −A_k (ε_{l+2}² + ε_{l+1}²), l = m + 2k.
    pub(super) b: f64,
    /// α_k ε_{l+1} and α_k ε_{l+2}: what degrees l and l + 2 give to r_k.
    pub(super) even: [f64; 2],
    /// α_k: what degree l + 1 gives to x r_k.
    pub(super) odd: f64,
}

/// Steps k = 0…(order − m)/2.
pub(super) fn steps(m: usize, order: usize) -> Vec<Step> {
    // |α_k α_{k+1}| ε_{l+2} ε_{l+3} = 1 and α_0 = 1/ε_{m+1}; signs + + − − + + …
    let mut alpha = epsilon(m + 1, m).recip();
    let mut e = [epsilon(m + 1, m), epsilon(m + 2, m)];
    (0..=(order - m) / 2)
        .map(|k| {
            let l = m + 2 * k;
            let a = if k % 2 == 0 { alpha * alpha } else { -(alpha * alpha) };
            let b = -a * (e[0] * e[0] + e[1] * e[1]);
            let step = Step { a, b, even: [alpha * e[0], alpha * e[1]], odd: alpha };
            let next = [epsilon(l + 3, m), epsilon(l + 4, m)];
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            alpha = sign / (e[1] * next[0] * alpha);
            e = next;
            step
        })
        .collect()
}

/// Where each ring's sequence first exceeds what is negligible (infinite where it never does), with r_k and
/// r_{k−1} there.
#[derive(Default)]
pub(super) struct Starts {
    pub(super) first: Vec<f64>,
    pub(super) now: Vec<f64>,
    pub(super) before: Vec<f64>,
    /// Of each block of rings.
    pub(super) units: Vec<Unit>,
}

/// When a block of rings takes part in the sums: from step `begin`, or never; all its rings from step `all`.
#[derive(Clone, Copy)]
pub(super) struct Unit {
    pub(super) begin: usize,
    pub(super) all: usize,
}

impl Unit {
    fn of(first: &[f64]) -> Self {
        let (mut begin, mut all) = (f64::INFINITY, 0.0);
        for &f in first {
            begin = f.min(begin);
            all = if f < f64::INFINITY && f >= all { f + 1.0 } else { all };
        }
        // Infinity becomes the largest number.
        Self { begin: begin as usize, all: all as usize }
    }
}

/// Starts of all rings for one m.
pub(super) struct FindStarts<'a> {
    pub(super) m: usize,
    pub(super) order: usize,
    pub(super) steps: &'a [Step],
    pub(super) rings: &'a Rings,
    /// What is smaller has no part in sums.
    pub(super) negligible: f64,
}

impl Kernel for FindStarts<'_> {
    type Output = Starts;

    #[inline(always)]
    fn run<A: Arch>(self) -> Starts {
        let n = self.rings.x2.len();
        let mut starts =
            Starts { first: vec![f64::INFINITY; n], now: vec![0.0; n], before: vec![0.0; n], units: vec![] };
        let mut norm = 0.25 / std::f64::consts::PI;
        for k in 1..=self.m {
            norm *= (2 * k + 1) as f64 / (2 * k) as f64;
        }
        for first in (0..n).step_by(LANES) {
            self.block::<A>(first, norm.sqrt(), &mut starts);
        }
        starts.units = starts.first.chunks(BLOCK).map(Unit::of).collect();
        starts
    }
}

impl FindStarts<'_> {
    #[inline(always)]
    fn block<A: Arch>(&self, first: usize, norm: f64, starts: &mut Starts) {
        // P̄_lm is negligible where m exceeds l sin θ by more than this (libsharp's criterion).
        let reach = (self.m as f64 - (0.01 * self.order as f64).max(100.0)) / self.order.max(1) as f64;
        let (mut now, mut before, mut x2) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let (mut scale, mut pending) = ([0i32; LANES], 0u32);
        for k in 0..LANES {
            let sin = self.rings.sin[first + k];
            x2[k] = self.rings.x2[first + k];
            if sin < reach || sin == 0.0 && self.m > 0 || self.rings.is_padding(first + k) {
                continue;
            }
            pending |= 1 << k;
            (now[k], scale[k]) = power(sin, self.m);
            now[k] *= norm;
            if scale[k] == 0 && now[k] < self.negligible {
                (now[k], scale[k]) = (now[k] * BIG, -1);
            }
        }
        for (k, step) in self.steps.iter().enumerate() {
            for i in 0..LANES {
                if scale[i] == 0 && pending >> i & 1 == 1 {
                    pending &= !(1 << i);
                    starts.first[first + i] = k as f64;
                    starts.now[first + i] = now[i];
                    starts.before[first + i] = before[i];
                }
            }
            if pending == 0 {
                return;
            }
            for i in 0..LANES {
                let next = A::fma(A::fma(step.a, x2[i], step.b), now[i], before[i]);
                let rise = scale[i] < 0 && next.abs() > self.negligible * BIG;
                let factor = if rise { SMALL } else { 1.0 };
                before[i] = now[i] * factor;
                now[i] = next * factor;
                scale[i] += i32::from(rise);
            }
        }
    }
}

/// s^m as v·2^(800·scale), scale ≤ 0, 2^−400 ≤ v ≤ 2^400 unless s^m is 0 or scale is 0.
fn power(s: f64, m: usize) -> (f64, i32) {
    let renormalise = |(v, e): (f64, i32)| {
        if v < HALF_SMALL {
            (v * BIG, e - 1)
        } else if v > HALF_BIG {
            (v * SMALL, e + 1)
        } else {
            (v, e)
        }
    };
    let (mut result, mut base) = ((1.0, 0), (s, 0));
    let mut bits = m;
    while bits > 0 {
        if bits % 2 == 1 {
            result = renormalise((result.0 * base.0, result.1 + base.1));
        }
        base = renormalise((base.0 * base.0, 2 * base.1));
        bits /= 2;
    }
    result
}

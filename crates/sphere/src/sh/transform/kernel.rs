//! The Legendre stage for one m: eight rings at a time, P̄_lm into scratch, then a small matrix product.

use super::fourier::PairRow;
use super::rings::RingRange;
use crate::sh::basis::epsilon;
use steradian_simd::{Arch, Kernel};

/// Cosine and sine terms of red, green and blue, and two zeros.
pub(super) type Row = [f64; 8];

const LANES: usize = 8;
const BIG: f64 = f64::from_bits((1023 + 800) << 52);
const SMALL: f64 = f64::from_bits((1023 - 800) << 52);
const LIMIT: f64 = f64::from_bits((1023 - 60) << 52);
const HALF_BIG: f64 = f64::from_bits((1023 + 400) << 52);
const HALF_SMALL: f64 = f64::from_bits((1023 - 400) << 52);

/// One worker's buffers.
#[derive(Default)]
pub(super) struct Scratch {
    /// 1/ε_l and ε_{l−1}/ε_l.
    ab: Vec<[f64; 2]>,
    /// P̄_lm of eight rings, for l = m…order.
    p: Vec<[f64; LANES]>,
}

/// column[l] += Σ_rings weight · P̄_lm · (even or odd part of the pair).
pub(super) struct Analysis<'a> {
    pub(super) m: usize,
    pub(super) order: usize,
    pub(super) rings: RingRange<'a>,
    /// [pair][m].
    pub(super) rows: &'a [PairRow],
    pub(super) column: &'a mut [Row],
    pub(super) scratch: &'a mut Scratch,
}

impl Kernel for Analysis<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let norm = self.scratch.prepare(self.m, self.order);
        for first in (0..self.rings.cos.len()).step_by(LANES) {
            let Some(start) = generate::<A>(self.m, self.order, norm, self.rings, first, self.scratch) else {
                continue;
            };
            let mut parts = [[[0.0; 8]; LANES]; 2];
            for k in 0..LANES.min(self.rings.cos.len() - first) {
                let r = first + k;
                let row = &self.rows[r / self.rings.per_row * (self.order + 1) + self.m];
                for c in 0..8 {
                    parts[0][k][c] = self.rings.weight[r] * row[c];
                    parts[1][k][c] = self.rings.weight[r] * row[8 + c];
                }
            }
            for (parity, part) in parts.iter().enumerate() {
                let from = start + (start + parity) % 2;
                accumulate::<A>(&self.scratch.p, part, from, self.column);
            }
        }
    }
}

#[inline(always)]
fn accumulate<A: Arch>(p: &[[f64; LANES]], part: &[[f64; 8]; LANES], from: usize, column: &mut [Row]) {
    let part = *part;
    for (p, row) in p.iter().zip(column.iter_mut()).skip(from).step_by(2) {
        let mut sum = *row;
        for k in 0..LANES {
            for c in 0..8 {
                sum[c] = A::fma(p[k], part[k][c], sum[c]);
            }
        }
        *row = sum;
    }
}

/// rows[pair] = (Σ_{l−m even}, Σ_{l−m odd}) column[l] · P̄_lm.
pub(super) struct Synthesis<'a> {
    pub(super) m: usize,
    pub(super) order: usize,
    pub(super) rings: RingRange<'a>,
    pub(super) rows: &'a mut [PairRow],
    pub(super) column: &'a [Row],
    pub(super) scratch: &'a mut Scratch,
}

impl Kernel for Synthesis<'_> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let norm = self.scratch.prepare(self.m, self.order);
        for first in (0..self.rings.cos.len()).step_by(LANES) {
            let Some(start) = generate::<A>(self.m, self.order, norm, self.rings, first, self.scratch) else {
                continue;
            };
            for parity in 0..2 {
                let from = start + (start + parity) % 2;
                let sum = contract::<A>(&self.scratch.p, self.column, from);
                for (k, row) in self.rows[first..].iter_mut().take(LANES).enumerate() {
                    for c in 0..6 {
                        row[8 * parity + c] = sum[c][k];
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn contract<A: Arch>(p: &[[f64; LANES]], column: &[Row], from: usize) -> [[f64; LANES]; 6] {
    let mut sum = [[0.0; LANES]; 6];
    for (p, row) in p.iter().zip(column).skip(from).step_by(2) {
        for c in 0..6 {
            for k in 0..LANES {
                sum[c][k] = A::fma(p[k], row[c], sum[c][k]);
            }
        }
    }
    sum
}

impl Scratch {
    /// Fills the recursion's coefficients for m and returns the norm of P̄_mm = norm·sin^m θ.
    #[inline(always)]
    fn prepare(&mut self, m: usize, order: usize) -> f64 {
        self.ab.clear();
        self.ab.resize(order + 1 - m, [0.0; 2]);
        self.p.resize(order + 1 - m, [0.0; LANES]);
        for (k, ab) in self.ab.iter_mut().enumerate() {
            ab[1] = if k > 0 { epsilon(m + k, m) } else { 0.0 };
        }
        let mut before = 0.0;
        for ab in self.ab.iter_mut().skip(1) {
            let e = ab[1];
            *ab = [1.0 / e, before / e];
            before = e;
        }
        let mut norm = 0.25 / std::f64::consts::PI;
        for k in 1..=m {
            norm *= (2 * k + 1) as f64 / (2 * k) as f64;
        }
        norm.sqrt()
    }
}

/// Fills P̄_lm of eight rings; returns the first index l − m where any of them is above 2^−860, or none.
#[inline(always)]
fn generate<A: Arch>(
    m: usize,
    order: usize,
    norm: f64,
    rings: RingRange<'_>,
    first: usize,
    scratch: &mut Scratch,
) -> Option<usize> {
    let n = LANES.min(rings.cos.len() - first);
    let sin = &rings.sin[first..first + n];
    // P̄_lm is negligible where m exceeds l sin θ by more than this (libsharp's criterion).
    let widest = sin.iter().fold(0.0, |a: f64, s| a.max(*s));
    if m as f64 > order as f64 * widest + (0.01 * order as f64).max(100.0) {
        return None;
    }
    let (mut p, mut scale, mut x) = ([0.0; LANES], [0i32; LANES], [0.0; LANES]);
    for k in 0..n {
        (p[k], scale[k]) = power(sin[k], m);
        p[k] *= norm;
        x[k] = rings.cos[first + k];
    }
    let (ab, out) = (&scratch.ab[..], &mut scratch.p[..]);
    let mut before = [0.0; LANES];
    let mut at = 0;
    let mut start = None;
    loop {
        for k in 0..LANES {
            out[at][k] = if scale[k] == 0 { p[k] } else { 0.0 };
        }
        if start.is_none() && scale.contains(&0) {
            start = Some(at);
        }
        at += 1;
        if at == out.len() {
            return start;
        }
        if scale == [0; LANES] {
            break;
        }
        let [a, b] = ab[at];
        for k in 0..LANES {
            let next = A::fma(a * x[k], p[k], -b * before[k]);
            let rise = scale[k] < 0 && next.abs() > LIMIT;
            let factor = if rise { SMALL } else { 1.0 };
            before[k] = p[k] * factor;
            p[k] = next * factor;
            scale[k] += i32::from(rise);
        }
    }
    for (out, [a, b]) in out[at..].iter_mut().zip(&ab[at..]) {
        for k in 0..LANES {
            let next = A::fma(a * x[k], p[k], -b * before[k]);
            before[k] = p[k];
            p[k] = next;
        }
        *out = p;
    }
    start
}

/// s^m as v·2^(800·scale), scale ≤ 0, v ≤ 2^−60 where scale < 0; by repeated squaring.
fn power(s: f64, m: usize) -> (f64, i32) {
    if s == 0.0 && m > 0 {
        return (0.0, 0);
    }
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
    let (mut v, mut e) = result;
    while e < 0 && v > LIMIT {
        (v, e) = (v * SMALL, e + 1);
    }
    if e > 0 { (v * BIG, 0) } else { (v, e) }
}

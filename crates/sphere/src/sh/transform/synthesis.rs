//! The Legendre stage of synthesis for one m: r_k times terms of steps, summed over steps.

use super::fold::register;
use super::kernel::{CELL, Part, Real, Row, Scratch, State, aligned, turn};
use super::rings::BLOCK;
use super::{fused, stored};
use steradian_simd::{Arch, Kernel, Vector};

/// Steps whose r_k and terms stay in the first-level cache while sums are made of them.
const STEPS: usize = 64;

/// cells = (Σ_k even parts · r_k, x Σ_k odd parts · r_k).
pub(super) struct Synthesis<'a, T: Real> {
    pub(super) part: Part<'a>,
    pub(super) column: &'a [Row],
    /// Of the column's bands, 0 beyond the last; `None`: all are 1.
    pub(super) factors: Option<&'a [f64]>,
    /// Cells of blocks, `stride` apart, from the one of this m.
    pub(super) cells: &'a mut [T],
    pub(super) stride: usize,
    pub(super) scratch: &'a mut Scratch<T>,
}

impl<T: Real> Kernel for Synthesis<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        prepare::<A::F64x4, T>(&self.part, self.column, self.factors, &mut self.scratch.terms);
        match (A::F64::REGISTERS >= 32, T::PARTS) {
            (true, 1) => self.fused::<A, 2>(),
            (true, _) => self.fused::<A, 1>(),
            (false, _) => self.stored::<A>(),
        }
    }
}

impl<T: Real> Synthesis<'_, T> {
    /// N registers of rings at a time, two of f64.
    #[inline(always)]
    fn fused<A: Arch, const N: usize>(self) {
        let (part, lanes) = (self.part, T::Vector::<A>::LANES);
        let units = &part.starts.units[part.ring / BLOCK..];
        let terms = &self.scratch.terms[..part.steps.len()];
        let mut ring = 0;
        while ring < part.x2.len() {
            let sums = fused::over_steps::<A, T, N, 2>(&part, units[ring / BLOCK], ring, terms);
            for v in 0..N {
                let x = register::<A, T>(&part.x[ring..]);
                let cell = &mut self.cells[ring / BLOCK * self.stride..][..CELL];
                for c in 0..12 {
                    let sum = if c < 6 { sums[v][c] } else { sums[v][c].mul(x) };
                    sum.store(&mut cell[c * BLOCK + ring % BLOCK..]);
                }
                ring += lanes;
            }
        }
    }

    #[inline(always)]
    fn stored<A: Arch>(self) {
        let (part, lanes) = (self.part, T::Vector::<A>::LANES);
        let units = &part.starts.units[part.ring / BLOCK..];
        let terms = &self.scratch.terms[..part.steps.len()];
        let legendre = aligned(&mut self.scratch.legendre, STEPS * BLOCK).as_chunks_mut::<BLOCK>().0;
        for ring in (0..part.x2.len()).step_by(BLOCK) {
            let unit = units[ring / BLOCK];
            let cell = &mut self.cells[ring / BLOCK * self.stride..][..CELL];
            cell.fill(T::default());
            let mut state = State::default();
            let mut k = unit.begin;
            while k < terms.len() {
                let end = terms.len().min(k + STEPS);
                let legendre = &mut legendre[..end - k];
                part.legendre::<A, T>(ring, k, unit, &mut state, legendre);
                stored::add_over_steps::<A, T>(legendre, &terms[k..end], cell);
                k = end;
            }
            for at in (0..BLOCK).step_by(lanes) {
                let x = register::<A, T>(&part.x[ring + at..]);
                for odd in cell[6 * BLOCK..].chunks_exact_mut(BLOCK) {
                    let odd = &mut odd[at..];
                    T::Vector::<A>::load(odd).mul(x).store(odd);
                }
            }
        }
    }
}

/// The six even and six odd terms of every step, each three followed by nothing in particular. Bands that the
/// column has not are 0.
#[inline(always)]
fn prepare<V: Vector<T = f64>, T: Real>(
    part: &Part<'_>,
    column: &[Row],
    factors: Option<&[f64]>,
    terms: &mut Vec<[T; 16]>,
) {
    let (cos, sin) = (V::splat(part.phase[0]), V::splat(-part.phase[1]));
    let n = part.steps.len();
    if terms.len() < n {
        terms.resize(n, [T::default(); 16]);
    }
    let (steps, terms) = (&part.steps[..n], &mut terms[..n]);
    let bands = column.len().min(factors.map_or(usize::MAX, <[f64]>::len));
    let column = &column[..bands];
    let mut even = band([cos, sin], column, factors, 0);
    for k in 0..n {
        let odd = band([cos, sin], column, factors, 2 * k + 1);
        let next = band([cos, sin], column, factors, 2 * k + 2);
        let (step, terms) = (&steps[k], &mut terms[k]);
        let (e, f, o) = (V::splat(step.even[0]), V::splat(step.even[1]), V::splat(step.odd));
        for half in 0..2 {
            T::put(next[half].fma(f, even[half].mul(e)), &mut terms[4 * half..]);
            T::put(odd[half].mul(o), &mut terms[8 + 4 * half..]);
        }
        even = next;
    }
}

/// A band of a column, turned and multiplied; 0 beyond.
#[inline(always)]
fn band<V: Vector<T = f64>>(phase: [V; 2], column: &[Row], factors: Option<&[f64]>, k: usize) -> [V; 2] {
    if k >= column.len() {
        return [V::splat(0.0); 2];
    }
    let [c, s] = turn(phase, [V::load(&column[k]), V::load(&column[k][4..])]);
    match factors {
        Some(factors) => {
            let factor = V::splat(factors[k]);
            [c.mul(factor), s.mul(factor)]
        }
        None => [c, s],
    }
}

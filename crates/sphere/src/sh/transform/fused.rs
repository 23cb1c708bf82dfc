//! Sums in the same loop as the recursion, for instruction sets whose registers hold both.

use super::kernel::{Part, Real, State, vectors};
use super::recursion::Unit;
use super::rings::BLOCK;
use std::mem::swap;
use steradian_simd::{Arch, Vector};

/// Σ over steps of r_k · terms at N registers of rings, D of f64.
#[inline(always)]
pub(super) fn over_steps<A: Arch, T: Real, const N: usize, const D: usize>(
    part: &Part<'_>,
    unit: Unit,
    ring: usize,
    terms: &[[T; 16]],
) -> [[T::Vector<A>; 12]; N] {
    let mut sums = [[T::Vector::<A>::splat(T::default()); 12]; N];
    let x2: [A::F64; D] = vectors(part.x2, ring);
    let (mut now, mut before) = ([A::F64::splat(0.0); D], [A::F64::splat(0.0); D]);
    let begin = unit.begin.min(terms.len());
    let all = unit.all.clamp(begin, terms.len());
    let mut k = begin;
    while k < all {
        part.inject(ring, k, &mut now, &mut before);
        add::<A, T, N, D>(&now, &terms[k], &mut sums);
        part.steps[k].advance(&x2, &now, &mut before);
        swap(&mut now, &mut before);
        k += 1;
    }
    let steps = &part.steps[..terms.len()];
    while k < terms.len() {
        add::<A, T, N, D>(&now, &terms[k], &mut sums);
        steps[k].advance(&x2, &now, &mut before);
        swap(&mut now, &mut before);
        k += 1;
    }
    sums
}

#[inline(always)]
fn add<A: Arch, T: Real, const N: usize, const D: usize>(
    now: &[A::F64; D],
    terms: &[T; 16],
    sums: &mut [[T::Vector<A>; 12]; N],
) {
    let mut r = [T::pack::<A, D>(now, 0); N];
    for v in 1..N {
        r[v] = T::pack::<A, D>(now, v);
    }
    for c in 0..12 {
        let term = T::Vector::<A>::splat(terms[c + c / 3]);
        for v in 0..N {
            sums[v][c] = r[v].fma(term, sums[v][c]);
        }
    }
}

/// Σ over rings of values times r of K steps from k, a register of rings in D of f64; `first` is the first
/// block.
#[inline(always)]
pub(super) fn over_rings<A: Arch, T: Real, const K: usize, const D: usize>(
    part: &Part<'_>,
    units: &[Unit],
    first: usize,
    values: &[[[T; BLOCK]; 12]],
    state: &mut [State],
    k: usize,
) -> [[T::Vector<A>; 12]; K] {
    let (steps, values, state) = (&part.steps[k..k + K], &values[..units.len()], &mut state[..units.len()]);
    let zero = T::Vector::<A>::splat(T::default());
    let mut sums = [[zero; 12]; K];
    let mut at = 0;
    while at < BLOCK * units.len() && units[at / BLOCK].begin >= k + K {
        at += BLOCK;
    }
    // One loop over registers: a loop over blocks around it would be unrolled, and sums driven out of
    // registers.
    while at < BLOCK * units.len() {
        let (b, lane) = (at / BLOCK, at % BLOCK);
        let [state_now, state_before] = &mut state[b];
        let x2: [A::F64; D] = vectors(part.x2, BLOCK * first + at);
        let mut now: [A::F64; D] = vectors(state_now, lane);
        let mut before: [A::F64; D] = vectors(state_before, lane);
        let starting = k < units[b].all;
        let mut r = [zero; K];
        for j in 0..K {
            if starting {
                part.inject(BLOCK * first + at, k + j, &mut now, &mut before);
            }
            r[j] = T::pack::<A, D>(&now, 0);
            steps[j].advance(&x2, &now, &mut before);
            swap(&mut now, &mut before);
        }
        for v in 0..D {
            now[v].store(&mut state_now[lane + v * A::F64::LANES..]);
            before[v].store(&mut state_before[lane + v * A::F64::LANES..]);
        }
        let values = &values[b];
        for c in 0..12 {
            let x = T::Vector::<A>::load(&values[c][lane..]);
            for j in 0..K {
                sums[j][c] = r[j].fma(x, sums[j][c]);
            }
        }
        at += T::Vector::<A>::LANES;
    }
    sums
}

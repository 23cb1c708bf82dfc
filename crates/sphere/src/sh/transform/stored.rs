//! Sums over r_k that was written before, in the precision of the transform, to where the first-level cache
//! holds it.

use super::kernel::{Part, Real, State, vectors};
use super::recursion::Unit;
use super::rings::BLOCK;
use std::mem::swap;
use steradian_simd::{Arch, Vector};

impl Part<'_> {
    /// r_k of the block of rings from `ring`, for a step k per row of `out` from `first`. The state is read
    /// only once the block has taken part.
    #[inline(always)]
    pub(super) fn legendre<A: Arch, T: Real>(
        &self,
        ring: usize,
        first: usize,
        unit: Unit,
        state: &mut State,
        out: &mut [[T; BLOCK]],
    ) {
        // As many registers as hide that each step waits for the one before it.
        match A::F64::LANES {
            8 => self.registers::<A, T, 2>(ring, first, unit, state, out),
            _ => self.registers::<A, T, 4>(ring, first, unit, state, out),
        }
    }

    #[inline(always)]
    fn registers<A: Arch, T: Real, const D: usize>(
        &self,
        ring: usize,
        first: usize,
        unit: Unit,
        state: &mut State,
        out: &mut [[T; BLOCK]],
    ) {
        let steps = &self.steps[first..first + out.len()];
        let starting = unit.all.clamp(first, first + out.len()) - first;
        let [state_now, state_before] = state;
        let mut at = 0;
        while at < BLOCK {
            let x2: [A::F64; D] = vectors(self.x2, ring + at);
            let (mut now, mut before) = ([A::F64::splat(0.0); D], [A::F64::splat(0.0); D]);
            if unit.begin < first {
                (now, before) = (vectors(state_now, at), vectors(state_before, at));
            }
            let mut k = 0;
            while k < starting {
                self.inject(ring + at, first + k, &mut now, &mut before);
                write::<A, T, D>(&now, &mut out[k][at..]);
                steps[k].advance(&x2, &now, &mut before);
                swap(&mut now, &mut before);
                k += 1;
            }
            // Two steps exchange their roles instead of their registers.
            while k + 2 <= out.len() {
                write::<A, T, D>(&now, &mut out[k][at..]);
                steps[k].advance(&x2, &now, &mut before);
                write::<A, T, D>(&before, &mut out[k + 1][at..]);
                steps[k + 1].advance(&x2, &before, &mut now);
                k += 2;
            }
            if k < out.len() {
                write::<A, T, D>(&now, &mut out[k][at..]);
                steps[k].advance(&x2, &now, &mut before);
                swap(&mut now, &mut before);
            }
            for v in 0..D {
                now[v].store(&mut state_now[at + v * A::F64::LANES..]);
                before[v].store(&mut state_before[at + v * A::F64::LANES..]);
            }
            at += D * A::F64::LANES;
        }
    }
}

#[inline(always)]
fn write<A: Arch, T: Real, const D: usize>(x: &[A::F64; D], out: &mut [T]) {
    for v in 0..D / T::PARTS {
        T::pack::<A, D>(x, v).store(&mut out[v * T::Vector::<A>::LANES..]);
    }
}

/// Adds Σ over steps of r_k · terms, six at a time, to a cell.
#[inline(always)]
pub(super) fn add_over_steps<A: Arch, T: Real>(legendre: &[[T; BLOCK]], terms: &[[T; 16]], cell: &mut [T]) {
    for first in [0, 6] {
        for at in (0..BLOCK).step_by(2 * T::Vector::<A>::LANES) {
            add_half::<A, T>(legendre, terms, first, at, cell);
        }
    }
}

/// Two registers of rings and six terms from the `first`.
#[inline(always)]
fn add_half<A: Arch, T: Real>(
    legendre: &[[T; BLOCK]],
    terms: &[[T; 16]],
    first: usize,
    at: usize,
    cell: &mut [T],
) {
    let (terms, base, lanes) = (&terms[..legendre.len()], first / 3 * 4, T::Vector::<A>::LANES);
    let mut sums = [[T::Vector::<A>::splat(T::default()); 2]; 6];
    for c in 0..6 {
        sums[c] = vectors(cell, (first + c) * BLOCK + at);
    }
    for k in 0..legendre.len() {
        let (r, terms): ([T::Vector<A>; 2], _) = (vectors(&legendre[k], at), &terms[k][base..]);
        for c in 0..6 {
            let term = T::Vector::<A>::splat(terms[c + c / 3]);
            for v in 0..2 {
                sums[c][v] = r[v].fma(term, sums[c][v]);
            }
        }
    }
    for c in 0..6 {
        for v in 0..2 {
            sums[c][v].store(&mut cell[(first + c) * BLOCK + at + v * lanes..]);
        }
    }
}

/// Σ over rings of r of two steps times values, `C` at a time.
#[inline(always)]
pub(super) fn over_rings<A: Arch, T: Real, const C: usize, const STEPS: usize>(
    values: &[[[T; BLOCK]; 12]],
    legendre: &[[[T; BLOCK]; STEPS]],
    step: usize,
) -> [[T::Vector<A>; 12]; 2] {
    let (legendre, lanes) = (&legendre[..values.len()], T::Vector::<A>::LANES);
    let zero = T::Vector::<A>::splat(T::default());
    let mut all = [[zero; 12]; 2];
    for first in (0..12).step_by(C) {
        let mut sums = [[zero; C]; 2];
        for b in 0..values.len() {
            let (values, legendre) = (&values[b][first..first + C], &legendre[b][step..step + 2]);
            for at in (0..BLOCK).step_by(lanes) {
                let r = T::Vector::<A>::load(&legendre[0][at..]);
                let s = T::Vector::<A>::load(&legendre[1][at..]);
                for c in 0..C {
                    let x = T::Vector::<A>::load(&values[c][at..]);
                    sums[0][c] = r.fma(x, sums[0][c]);
                    sums[1][c] = s.fma(x, sums[1][c]);
                }
            }
        }
        for c in 0..C {
            all[0][first + c] = sums[0][c];
            all[1][first + c] = sums[1][c];
        }
    }
    all
}

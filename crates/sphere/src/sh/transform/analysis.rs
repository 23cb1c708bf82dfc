//! The Legendre stage of analysis for one m: r_k times values at rings, summed over rings.

use super::kernel::{Part, Real, Row, Scratch, aligned, place, turn, vectors};
use super::recursion::Unit;
use super::rings::BLOCK;
use std::ops::Range;
use steradian_simd::{Arch, Kernel, Vector};

/// Steps of the recursion that are taken at a chunk of rings before the next chunk.
const STEPS: usize = 16;

/// Bytes of terms of the rings of a chunk, which stay in the first-level cache.
const CHUNK: usize = 24 << 10;

/// out[k] += Σ_rings r_k · (even or odd part).
pub(super) struct Analysis<'a, T: Real> {
    pub(super) part: Part<'a>,
    /// Cells of blocks, `stride` apart, from the one of this m.
    pub(super) cells: &'a [T],
    pub(super) stride: usize,
    pub(super) column: &'a mut [Row],
    pub(super) scratch: &'a mut Scratch<T>,
}

impl<T: Real> Kernel for Analysis<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        match (A::F64::REGISTERS >= 32, T::PARTS) {
            (true, 1) => self.with::<A, 2, 1>(),
            (true, _) => self.with::<A, 2, 2>(),
            (false, 1) => self.with::<A, 1, 1>(),
            (false, _) => self.with::<A, 1, 2>(),
        }
    }
}

impl<T: Real> Analysis<'_, T> {
    /// Rings in a chunk.
    const RINGS: usize = CHUNK / (12 * size_of::<T>());

    /// K steps at once; a register of rings is D of f64.
    #[inline(always)]
    fn with<A: Arch, const K: usize, const D: usize>(self) {
        let (part, all, steps) = (self.part, self.part.x2.len(), self.part.steps.len());
        let Scratch { state, values, sums, rows, .. } = self.scratch;
        let units = &part.starts.units[part.ring / BLOCK..];
        let mut start = 0;
        while start < all && units[start / BLOCK].begin >= steps {
            start += BLOCK;
        }
        if start == all {
            return;
        }
        let values = aligned(values, 12 * (all - start));
        gather::<T::Vector<A>>(self.cells, self.stride, start..all, values);
        let state = aligned(state, 2 * (all - start));
        state.fill(0.0);
        rows.clear();
        rows.resize(steps, [0.0; 16]);
        let mut rings = Rings { part, units, start, state, values };
        if all - start <= Self::RINGS {
            let mut k = 0;
            while k + K <= steps {
                let sums = rings.add::<A, K, D>(start..all, k, zero::<A, T, K>());
                for j in 0..K {
                    T::Vector::<A>::add_sums(&sums[j], &mut rows[k + j]);
                }
                k += K;
            }
            if k < steps {
                let sums = rings.add::<A, 1, D>(start..all, k, zero::<A, T, 1>());
                T::Vector::<A>::add_sums(&sums[0], &mut rows[k]);
            }
        } else {
            let width = 12 * T::Vector::<A>::LANES;
            let sums = aligned(sums, STEPS * width);
            for (block, rows) in rows.chunks_mut(STEPS).enumerate() {
                rings.block::<A, K, D>(all, block * STEPS, sums, rows);
            }
        }
        finish::<A::F64x4>(&part, rows, self.column);
    }
}

/// The rings from `start` on, where they stand in the recursion.
struct Rings<'a, T> {
    part: Part<'a>,
    units: &'a [Unit],
    start: usize,
    /// r_k and r_{k−1}, all of one after all of the other.
    state: &'a mut [f64],
    /// A register's twelve rows together.
    values: &'a [T],
}

impl<T: Real> Rings<'_, T> {
    /// A block of steps at all chunks of rings.
    #[inline(always)]
    fn block<A: Arch, const K: usize, const D: usize>(
        &mut self,
        all: usize,
        from: usize,
        sums: &mut [T],
        rows: &mut [[f64; 16]],
    ) {
        let (width, steps) = (12 * T::Vector::<A>::LANES, rows.len());
        let (mut ring, mut fresh) = (self.start, true);
        while ring < all {
            while ring < all && self.units[ring / BLOCK].begin >= from + steps {
                ring += BLOCK;
            }
            let end = all.min(ring + Analysis::<T>::RINGS);
            let mut k = if ring < end { 0 } else { steps };
            while k < steps {
                let sums = &mut sums[k * width..];
                if k + K <= steps {
                    let now = if fresh { zero::<A, T, K>() } else { load::<A, T, K>(sums) };
                    store::<A, T, K>(self.add::<A, K, D>(ring..end, from + k, now), sums);
                    k += K;
                } else {
                    let now = if fresh { zero::<A, T, 1>() } else { load::<A, T, 1>(sums) };
                    store::<A, T, 1>(self.add::<A, 1, D>(ring..end, from + k, now), sums);
                    k += 1;
                }
            }
            fresh &= ring == end;
            ring = end;
        }
        for k in 0..if fresh { 0 } else { steps } {
            T::Vector::<A>::add_sums(&vectors(sums, k * width), &mut rows[k]);
        }
    }

    /// Adds K steps from k at some rings.
    #[inline(always)]
    fn add<A: Arch, const K: usize, const D: usize>(
        &mut self,
        rings: Range<usize>,
        k: usize,
        mut sums: [[T::Vector<A>; 12]; K],
    ) -> [[T::Vector<A>; 12]; K] {
        let lanes = T::Vector::<A>::LANES;
        let steps = &self.part.steps[k..k + K];
        let (state_now, state_before) = self.state.split_at_mut(self.values.len() / 12);
        let mut ring = rings.start;
        while ring < rings.end && self.units[ring / BLOCK].begin >= k + K {
            ring += BLOCK;
        }
        while ring < rings.end {
            let at = ring - self.start;
            let values = &self.values[12 * at..12 * (at + lanes)];
            let x2: [A::F64; D] = vectors(self.part.x2, ring);
            let mut now: [A::F64; D] = vectors(state_now, at);
            let mut before: [A::F64; D] = vectors(state_before, at);
            let starting = k < self.units[ring / BLOCK].all;
            let mut r = [T::Vector::<A>::load(values); K];
            for j in 0..K {
                if starting {
                    self.part.inject(ring, k + j, &mut now, &mut before);
                }
                r[j] = T::pack::<A, D>(&now, 0);
                steps[j].advance(&x2, &mut now, &mut before);
            }
            for v in 0..D {
                now[v].store(&mut state_now[at + v * A::F64::LANES..]);
                before[v].store(&mut state_before[at + v * A::F64::LANES..]);
            }
            for c in 0..12 {
                let x = T::Vector::<A>::load(&values[c * lanes..]);
                for j in 0..K {
                    sums[j][c] = r[j].fma(x, sums[j][c]);
                }
            }
            ring += lanes;
        }
        sums
    }
}

#[inline(always)]
fn zero<A: Arch, T: Real, const K: usize>() -> [[T::Vector<A>; 12]; K] {
    [[T::Vector::<A>::splat(T::default()); 12]; K]
}

#[inline(always)]
fn load<A: Arch, T: Real, const K: usize>(sums: &[T]) -> [[T::Vector<A>; 12]; K] {
    let mut out = zero::<A, T, K>();
    for k in 0..K {
        out[k] = vectors(sums, k * 12 * T::Vector::<A>::LANES);
    }
    out
}

#[inline(always)]
fn store<A: Arch, T: Real, const K: usize>(x: [[T::Vector<A>; 12]; K], sums: &mut [T]) {
    let lanes = T::Vector::<A>::LANES;
    let sums = &mut sums[..12 * K * lanes];
    for k in 0..K {
        for c in 0..12 {
            x[k][c].store(&mut sums[(12 * k + c) * lanes..]);
        }
    }
}

/// The cells of `rings`, a register's twelve rows together.
#[inline(always)]
fn gather<V: Vector>(cells: &[V::T], stride: usize, rings: Range<usize>, values: &mut [V::T]) {
    let (mut ring, mut at) = (rings.start, 0);
    while ring < rings.end {
        for c in 0..12 {
            V::load(&cells[place(ring, stride, c)..]).store(&mut values[at..]);
            at += V::LANES;
        }
        ring += V::LANES;
    }
}

/// From sums over rings to coefficients.
#[inline(always)]
fn finish<V: Vector<T = f64>>(part: &Part<'_>, rows: &[[f64; 16]], column: &mut [Row]) {
    let phase = [V::splat(part.phase[0]), V::splat(part.phase[1])];
    let mut carry = [V::splat(0.0); 2];
    for k in 0..rows.len() {
        let (sums, step, column) = (&rows[k], &part.steps[k], &mut column[2 * k..]);
        let even = turn(phase, [V::load(sums), V::load(&sums[3..])]);
        let odd = turn(phase, [V::load(&sums[6..]), V::load(&sums[9..])]);
        for half in 0..2 {
            let out = &mut column[0][4 * half..];
            let sum = even[half].fma(V::splat(step.even[0]), carry[half]);
            sum.add(V::load(out)).store(out);
            carry[half] = even[half].mul(V::splat(step.even[1]));
            if column.len() > 1 {
                let out = &mut column[1][4 * half..];
                odd[half].fma(V::splat(step.odd), V::load(out)).store(out);
            }
        }
    }
}

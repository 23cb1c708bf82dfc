//! The Legendre stage of analysis for one m: r_k times values at rings, summed over rings.

use super::kernel::{CELL, Part, Real, Row, Scratch, State, aligned, turn};
use super::recursion::Unit;
use super::rings::BLOCK;
use super::{fused, stored};
use steradian_simd::{Arch, Kernel, Vector};

/// Steps whose r_k is written before sums are made of them; even.
const STEPS: usize = 8;

/// Bytes of values of a chunk of rings, which stay in the first-level cache together with r_k of them; of
/// twice as many rings where r_k is not written.
const CHUNK: usize = 12 << 10;

/// out[k] += Σ_rings r_k · (even or odd part), or = where it is the first part of the rings: to clear what is
/// written first was a tenth of the time at band 63.
pub(super) struct Analysis<'a, T: Real> {
    pub(super) part: Part<'a>,
    pub(super) first: bool,
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
            (true, 1) => self.with::<A, 12, true>(),
            // In image precision this is as quick as the other at high orders, and quicker at low ones.
            (true, _) => self.with::<A, 12, false>(),
            (false, _) => self.with::<A, 6, false>(),
        }
    }
}

impl<T: Real> Analysis<'_, T> {
    /// With sums of C terms at a time.
    #[inline(always)]
    fn with<A: Arch, const C: usize, const FUSED: bool>(self) {
        let (part, steps) = (self.part, self.part.steps.len());
        if part.x2.is_empty() {
            return if self.first {
                self.column.fill([0.0; 8])
            };
        }
        let Scratch { state, values, legendre, rows, .. } = self.scratch;
        let units = &part.starts.units[part.ring / BLOCK..][..part.x2.len() / BLOCK];
        if rows.len() < steps {
            rows.resize(steps, [0.0; 16]);
        }
        // The first chunk of rings overwrites what the last run left.
        let rows = &mut rows[..steps];
        let size = if FUSED { 2 * CHUNK } else { CHUNK } / (CELL * size_of::<T>());
        let values = aligned(values, size * CELL).as_chunks_mut::<BLOCK>().0.as_chunks_mut::<12>().0;
        let legendre = aligned(legendre, if FUSED { 0 } else { size * STEPS * BLOCK });
        let legendre = legendre.as_chunks_mut::<BLOCK>().0.as_chunks_mut::<STEPS>().0;
        state.resize(size, State::default());
        let mut first = 0;
        while first < units.len() {
            let units = &units[first..units.len().min(first + size)];
            for b in 0..units.len() {
                // Cells of blocks are so far apart that they would drive each other out of the cache.
                let cell = &self.cells[(first + b) * self.stride..][..CELL];
                values[b].as_flattened_mut().copy_from_slice(cell);
                if FUSED {
                    state[b] = State::default();
                }
            }
            let rings = Rings { part, units, first, values: &values[..units.len()] };
            if FUSED {
                rings.fused::<A>(state, rows);
            } else {
                rings.stored::<A, C>(state, legendre, rows);
            }
            first += size;
        }
        if self.first {
            finish::<A::F64x4, true>(&part, rows, self.column);
        } else {
            finish::<A::F64x4, false>(&part, rows, self.column);
        }
    }
}

/// A chunk of rings.
struct Rings<'a, T> {
    part: Part<'a>,
    units: &'a [Unit],
    /// The first block.
    first: usize,
    values: &'a [[[T; BLOCK]; 12]],
}

impl<T: Real> Rings<'_, T> {
    #[inline(always)]
    fn fused<A: Arch>(&self, state: &mut [State], rows: &mut [[f64; 16]]) {
        let mut k = 0;
        while k + 2 <= rows.len() {
            let sums =
                fused::over_rings::<A, T, 2, 1>(&self.part, self.units, self.first, self.values, state, k);
            self.add::<A>(&sums[0], &mut rows[k]);
            self.add::<A>(&sums[1], &mut rows[k + 1]);
            k += 2;
        }
        if k < rows.len() {
            let sums =
                fused::over_rings::<A, T, 1, 1>(&self.part, self.units, self.first, self.values, state, k);
            self.add::<A>(&sums[0], &mut rows[k]);
        }
    }

    /// Adds the sums over lanes to a row, or begins it with the first chunk of rings.
    #[inline(always)]
    fn add<A: Arch>(&self, sums: &[T::Vector<A>; 12], row: &mut [f64; 16]) {
        if self.first == 0 {
            *row = [0.0; 16];
        }
        T::Vector::<A>::add_sums(sums, row);
    }

    #[inline(always)]
    fn stored<A: Arch, const C: usize>(
        &self,
        state: &mut [State],
        legendre: &mut [[[T; BLOCK]; STEPS]],
        rows: &mut [[f64; 16]],
    ) {
        for k in (0..rows.len()).step_by(STEPS) {
            let n = STEPS.min(rows.len() - k);
            // Blocks from the pole that do not take part yet.
            let mut idle = 0;
            while idle < self.units.len() && self.units[idle].begin >= k + n {
                idle += 1;
            }
            for b in idle..self.units.len() {
                let ring = (self.first + b) * BLOCK;
                self.part.legendre::<A, T>(ring, k, self.units[b], &mut state[b], &mut legendre[b][..n]);
            }
            let (values, legendre) = (&self.values[idle..], &legendre[idle..self.units.len()]);
            for j in (0..n).step_by(2) {
                // Of an odd number of steps the one after the last is nothing in particular, and left out.
                let sums = stored::over_rings::<A, T, C, STEPS>(values, legendre, j);
                for i in 0..(n - j).min(2) {
                    self.add::<A>(&sums[i], &mut rows[k + j + i]);
                }
            }
        }
    }
}

/// From sums over rings to coefficients.
#[inline(always)]
fn finish<V: Vector<T = f64>, const FIRST: bool>(part: &Part<'_>, rows: &[[f64; 16]], column: &mut [Row]) {
    let phase = [V::splat(part.phase[0]), V::splat(part.phase[1])];
    let mut carry = [V::splat(0.0); 2];
    for k in 0..rows.len() {
        let (sums, step, column) = (&rows[k], &part.steps[k], &mut column[2 * k..]);
        let even = turn(phase, [V::load(sums), V::load(&sums[3..])]);
        let odd = turn(phase, [V::load(&sums[6..]), V::load(&sums[9..])]);
        for half in 0..2 {
            let out = &mut column[0][4 * half..];
            let sum = even[half].fma(V::splat(step.even[0]), carry[half]);
            if FIRST { sum } else { sum.add(V::load(out)) }.store(out);
            carry[half] = even[half].mul(V::splat(step.even[1]));
            if column.len() > 1 {
                let out = &mut column[1][4 * half..];
                let before = if FIRST { V::splat(0.0) } else { V::load(out) };
                odd[half].fma(V::splat(step.odd), before).store(out);
            }
        }
    }
}

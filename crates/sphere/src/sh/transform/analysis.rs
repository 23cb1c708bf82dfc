//! The Legendre stage of analysis for one m: the table times values at rings, summed over rings.

use super::kernel::{Part, RINGS, Real, Row, STEPS, Scratch, Terms, aligned, place, turn, vectors, zeros};
use super::rings::BLOCK;
use std::ops::Range;
use steradian_simd::{Arch, Kernel, Vector};

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
        if A::F64::REGISTERS >= 32 { self.with::<A, 2>() } else { self.with::<A, 1>() }
    }
}

impl<T: Real> Analysis<'_, T> {
    #[inline(always)]
    fn with<A: Arch, const K: usize>(self) {
        let (part, all, steps) = (self.part, self.part.x2.len(), self.part.steps.len());
        let Scratch { state, table, values, sums, rows, .. } = self.scratch;
        let units = &part.starts.units[part.ring / BLOCK..];
        let mut start = 0;
        while start < all && units[start / BLOCK].begin >= steps {
            start += BLOCK;
        }
        if start == all {
            return;
        }
        let width = 12 * T::Vector::<A>::LANES;
        let values = aligned(values, 12 * (all - start));
        gather::<T::Vector<A>>(self.cells, self.stride, start..all, values);
        let state = zeros::<A>(state, 2 * (all - start));
        rows.resize(steps, [0.0; 16]);
        let table = aligned(table, STEPS * RINGS);
        let sums = aligned(sums, STEPS * width);
        let mut from = 0;
        while from < steps {
            let to = steps.min(from + STEPS);
            let (mut ring, mut fresh) = (start, true);
            while ring < all {
                let end = all.min(ring + RINGS);
                let state = &mut state[2 * (ring - start)..2 * (end - start)];
                let begun = part.fill::<A, T>(units, ring..end, from..to, state, table);
                let table = &table[begun - ring..];
                let values = &values[12 * (begun - start)..12 * (end - start)];
                let mut k = if begun < end { 0 } else { to - from };
                while k + K <= to - from {
                    over_rings::<T::Vector<A>, K>(&table[k * RINGS..], values, &mut sums[k * width..], fresh);
                    k += K;
                }
                if k < to - from {
                    over_rings::<T::Vector<A>, 1>(&table[k * RINGS..], values, &mut sums[k * width..], fresh);
                }
                fresh &= begun == end;
                ring = end;
            }
            for k in from..to {
                rows[k] = [0.0; 16];
                if !fresh {
                    let sums = vectors(sums, (k - from) * width);
                    T::Vector::<A>::add_sums(&sums, &mut rows[k]);
                }
            }
            from = to;
        }
        finish(&part, rows, self.column);
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

/// sums of K steps += Σ over registers of rings of r_k · values; `fresh` sums are 0 before, whatever they hold.
#[inline(always)]
fn over_rings<V: Vector<T: Real>, const K: usize>(
    table: &[V::T],
    values: &[V::T],
    sums: &mut [V::T],
    fresh: bool,
) {
    let width = 12 * V::LANES;
    let mut acc = [[V::splat(V::T::default()); 12]; K];
    if !fresh {
        for k in 0..K {
            acc[k] = vectors(sums, k * width);
        }
    }
    let (mut at, mut ring) = (0, 0);
    while at < values.len() {
        let row = &values[at..at + width];
        let mut r = [V::load(row); K];
        for k in 0..K {
            r[k] = V::load(&table[k * RINGS + ring..]);
        }
        for c in 0..12 {
            let x = V::load(&row[c * V::LANES..]);
            for k in 0..K {
                acc[k][c] = r[k].fma(x, acc[k][c]);
            }
        }
        at += width;
        ring += V::LANES;
    }
    for k in 0..K {
        for c in 0..12 {
            acc[k][c].store(&mut sums[k * width + c * V::LANES..]);
        }
    }
}

/// From sums over rings to coefficients.
#[inline(always)]
fn finish(part: &Part<'_>, rows: &[[f64; 16]], column: &mut [Row]) {
    for k in 0..rows.len() {
        let step = &part.steps[k];
        let even = turn(part.phase, four(&rows[k], 0), four(&rows[k], 3));
        let odd = turn(part.phase, four(&rows[k], 6), four(&rows[k], 9));
        let after = &mut column[2 * k..];
        add(&mut after[0], step.even[0], &even);
        if after.len() > 1 {
            add(&mut after[1], step.odd, &odd);
        }
        if after.len() > 2 {
            add(&mut after[2], step.even[1], &even);
        }
    }
}

#[inline(always)]
fn four(row: &[f64; 16], at: usize) -> [f64; 4] {
    [row[at], row[at + 1], row[at + 2], row[at + 3]]
}

#[inline(always)]
fn add(row: &mut Row, factor: f64, x: &Terms) {
    for c in 0..3 {
        row[c] += factor * x[0][c];
        row[3 + c] += factor * x[1][c];
    }
}

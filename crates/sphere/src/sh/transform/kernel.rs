//! The Legendre stage for one m: sums over degrees at groups of rings, and over rings for blocks of degrees.
//!
//! Both directions take blocks of steps of the recursion at chunks of rings: first r_k of all of them is
//! computed, in f64, into a small table; then the table is multiplied with the six even and six odd terms, in
//! the precision of the transform, with the sums in registers.

use super::recursion::{Starts, Step, Unit};
use super::rings::BLOCK;
use rustfft::FftNum;
use std::ops::Range;
use steradian_simd::{Arch, Double, Kernel, Single, Vector};

/// Cosine terms of red, green and blue, then their sine terms.
pub(super) type Row = [f64; 6];

/// A row's cosine and sine terms, each a register wide: what the last lanes hold does not matter.
type Terms = [[f64; 4]; 2];

/// Numbers that a block of rings holds for one m: even parts of the six terms, then odd ones, ring by ring.
pub(super) const CELL: usize = 12 * BLOCK;

/// Steps of the recursion in a table.
const STEPS: usize = 16;

/// Rings in a table: it stays in the first-level cache, as do the terms of its rings.
const RINGS: usize = 128;

/// The precision of sums.
pub(super) trait Real: FftNum + Default {
    /// A register.
    type Vector<A: Arch>: Vector<T = Self>;
    /// The nearest number.
    fn of(x: f64) -> Self;
    /// As f64.
    fn f64(self) -> f64;
    /// Writes registers one after the other; their number is even.
    fn put<A: Arch, const N: usize>(v: &[A::F64; N], to: &mut [Self]);
}

impl Real for f64 {
    type Vector<A: Arch> = A::F64;
    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn put<A: Arch, const N: usize>(v: &[A::F64; N], to: &mut [Self]) {
        for k in 0..N {
            v[k].store(&mut to[k * A::F64::LANES..]);
        }
    }
}

impl Real for f32 {
    type Vector<A: Arch> = A::F32;
    #[inline(always)]
    fn of(x: f64) -> Self {
        x as Self
    }
    #[inline(always)]
    fn f64(self) -> f64 {
        self.into()
    }
    #[inline(always)]
    fn put<A: Arch, const N: usize>(v: &[A::F64; N], to: &mut [Self]) {
        for k in 0..N / 2 {
            A::F32::narrow(v[2 * k], v[2 * k + 1]).store(&mut to[k * A::F32::LANES..]);
        }
    }
}

/// What both directions share: one m and a range of rings.
#[derive(Clone, Copy)]
pub(super) struct Part<'a> {
    pub(super) steps: &'a [Step],
    pub(super) starts: &'a Starts,
    pub(super) x: &'a [f64],
    pub(super) x2: &'a [f64],
    /// The first ring's index in `starts`.
    pub(super) ring: usize,
    /// cos and sin of mφ0, times the norm of the azimuthal functions.
    pub(super) phase: [f64; 2],
}

/// The first `n` numbers of a buffer from a cache line's start, so that no vector straddles two lines.
pub(super) fn aligned<T: Real>(buffer: &mut Vec<T>, n: usize) -> &mut [T] {
    let line = 64 / size_of::<T>();
    if buffer.len() < n + line {
        buffer.resize(n + line, T::default());
    }
    let start = buffer.as_ptr().align_offset(64).min(line);
    &mut buffer[start..start + n]
}

/// One worker's buffers.
#[derive(Default)]
pub(super) struct Scratch<T> {
    state: Vec<f64>,
    table: Vec<T>,
    values: Vec<T>,
    sums: Vec<T>,
    terms: Vec<[T; 16]>,
    rows: Vec<[f64; 16]>,
}

impl Part<'_> {
    /// Sets lanes that start at step k.
    #[inline(always)]
    fn inject<V: Double, const N: usize>(
        &self,
        ring: usize,
        k: usize,
        now: &mut [V; N],
        before: &mut [V; N],
    ) {
        let k = V::splat(k as f64);
        for v in 0..N {
            let at = self.ring + ring + v * V::LANES;
            let first = V::load(&self.starts.first[at..]);
            now[v] = now[v].replace_if_equal(first, k, V::load(&self.starts.now[at..]));
            before[v] = before[v].replace_if_equal(first, k, V::load(&self.starts.before[at..]));
        }
    }

    /// The table of r_k for `steps` and those of `rings` from the first that takes part, which is returned;
    /// `state` holds r_k and r_{k−1} of `rings` for the next steps.
    #[inline(always)]
    fn fill<A: Arch, T: Real>(
        &self,
        units: &[Unit],
        rings: Range<usize>,
        steps: Range<usize>,
        state: &mut [f64],
        table: &mut [T],
    ) -> usize {
        let mut ring = rings.start;
        while ring < rings.end && units[ring / BLOCK].begin >= steps.end {
            ring += BLOCK;
        }
        let first = ring;
        while ring < rings.end {
            let mut unit = units[ring / BLOCK];
            if 4 * A::F64::LANES <= BLOCK {
                self.sweep::<A, T, 4>(unit, ring, rings.clone(), steps.clone(), state, table);
                ring += 4 * A::F64::LANES;
            } else if 4 * A::F64::LANES <= rings.end - ring {
                let next = units[ring / BLOCK + 1];
                unit = Unit { begin: unit.begin.min(next.begin), all: unit.all.max(next.all) };
                self.sweep::<A, T, 4>(unit, ring, rings.clone(), steps.clone(), state, table);
                ring += 4 * A::F64::LANES;
            } else {
                self.sweep::<A, T, 2>(unit, ring, rings.clone(), steps.clone(), state, table);
                ring += 2 * A::F64::LANES;
            }
        }
        first
    }

    /// The part of [`Part::fill`] of N registers of rings.
    #[inline(always)]
    fn sweep<A: Arch, T: Real, const N: usize>(
        &self,
        unit: Unit,
        ring: usize,
        rings: Range<usize>,
        steps: Range<usize>,
        state: &mut [f64],
        table: &mut [T],
    ) {
        let (lanes, at) = (A::F64::LANES, ring - rings.start);
        let (state_now, state_before) = state.split_at_mut(rings.len());
        let x2: [A::F64; N] = vectors(self.x2, ring);
        let mut now: [A::F64; N] = vectors(state_now, at);
        let mut before: [A::F64; N] = vectors(state_before, at);
        let begin = unit.begin.clamp(steps.start, steps.end);
        let all = unit.all.clamp(begin, steps.end);
        let mut k = steps.start;
        while k < steps.end {
            if k >= begin && k < all {
                self.inject(ring, k, &mut now, &mut before);
            }
            T::put::<A, N>(&now, &mut table[(k - steps.start) * RINGS + at..][..N * lanes]);
            let step = &self.steps[k];
            let (a, b) = (A::F64::splat(step.a), A::F64::splat(step.b));
            for v in 0..N {
                let next = x2[v].fma(a, b).fma(now[v], before[v]);
                before[v] = now[v];
                now[v] = next;
            }
            k += 1;
        }
        for v in 0..N {
            now[v].store(&mut state_now[at + v * lanes..]);
            before[v].store(&mut state_before[at + v * lanes..]);
        }
    }
}

#[inline(always)]
fn vectors<V: Vector, const N: usize>(x: &[V::T], from: usize) -> [V; N] {
    // Loops, not closures or iterators: these would be compiled for themselves, without the instruction set.
    let mut vectors = [V::load(&x[from..]); N];
    for v in 1..N {
        vectors[v] = V::load(&x[from + v * V::LANES..]);
    }
    vectors
}

/// Where in a cell row `c` of the vector that starts at `ring` lies, in cells of blocks `stride` apart.
#[inline(always)]
fn place(ring: usize, stride: usize, c: usize) -> usize {
    ring / BLOCK * stride + c * BLOCK + ring % BLOCK
}

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

/// The first `n` numbers of a buffer, whole registers, made 0.
#[inline(always)]
fn zeros<A: Arch>(buffer: &mut Vec<f64>, n: usize) -> &mut [f64] {
    let zeros = aligned(buffer, n);
    let mut at = 0;
    while at < n {
        A::F64::splat(0.0).store(&mut zeros[at..]);
        at += A::F64::LANES;
    }
    zeros
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

/// Cosine and sine terms, turned by an angle.
#[inline(always)]
fn turn([cos, sin]: [f64; 2], c: [f64; 4], s: [f64; 4]) -> Terms {
    let mut out = [[0.0; 4]; 2];
    for k in 0..4 {
        out[0][k] = cos * c[k] - sin * s[k];
        out[1][k] = sin * c[k] + cos * s[k];
    }
    out
}

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
        if A::F64::REGISTERS >= 32 { self.with::<A, 2>() } else { self.with::<A, 1>() }
    }
}

impl<T: Real> Synthesis<'_, T> {
    #[inline(always)]
    fn with<A: Arch, const N: usize>(self) {
        let (part, all, steps) = (self.part, self.part.x2.len(), self.part.steps.len());
        let Scratch { state, table, sums, terms, .. } = self.scratch;
        let units = &part.starts.units[part.ring / BLOCK..];
        prepare(&part, self.column, self.factors, terms);
        let (lanes, width) = (T::Vector::<A>::LANES, 12 * T::Vector::<A>::LANES);
        let table = aligned(table, STEPS * RINGS);
        let sums = aligned(sums, 12 * RINGS);
        let mut ring = 0;
        while ring < all {
            let end = all.min(ring + RINGS);
            for at in 0..12 * (end - ring) / lanes {
                T::Vector::<A>::splat(T::default()).store(&mut sums[at * lanes..]);
            }
            let state = zeros::<A>(state, 2 * (end - ring));
            let mut from = steps;
            for unit in &units[ring / BLOCK..end / BLOCK] {
                from = from.min(unit.begin / STEPS * STEPS);
            }
            while from < steps {
                let to = steps.min(from + STEPS);
                let mut begun = part.fill::<A, T>(units, ring..end, from..to, state, table) - ring;
                let terms = &terms[from..to];
                while begun + N * lanes <= end - ring {
                    over_steps::<T::Vector<A>, N>(&table[begun..], terms, &mut sums[12 * begun..]);
                    begun += N * lanes;
                }
                if begun < end - ring {
                    over_steps::<T::Vector<A>, 1>(&table[begun..], terms, &mut sums[12 * begun..]);
                }
                from = to;
            }
            let mut at = 0;
            while ring + at < end {
                let x = register::<A, T>(&part.x[ring + at..]);
                let sums = &sums[12 * at..12 * at + width];
                for c in 0..12 {
                    let sum = T::Vector::<A>::load(&sums[c * lanes..]);
                    let sum = if c < 6 { sum } else { sum.mul(x) };
                    sum.store(&mut self.cells[place(ring + at, self.stride, c)..]);
                }
                at += lanes;
            }
            ring = end;
        }
    }
}

/// A register of numbers that are given as f64.
#[inline(always)]
fn register<A: Arch, T: Real>(x: &[f64]) -> T::Vector<A> {
    let mut out = [T::default(); BLOCK];
    for k in 0..T::Vector::<A>::LANES {
        out[k] = T::of(x[k]);
    }
    T::Vector::<A>::load(&out)
}

/// sums at N registers of rings += Σ over steps of r_k · terms.
#[inline(always)]
fn over_steps<V: Vector, const N: usize>(table: &[V::T], terms: &[[V::T; 16]], sums: &mut [V::T]) {
    let width = 12 * V::LANES;
    let mut acc = [[V::load(sums); 12]; N];
    for v in 0..N {
        acc[v] = vectors(sums, v * width);
    }
    let mut k = 0;
    while k < terms.len() {
        let mut r = acc[0][0];
        let mut rs = [r; N];
        for v in 0..N {
            r = V::load(&table[k * RINGS + v * V::LANES..]);
            rs[v] = r;
        }
        for c in 0..12 {
            let term = V::splat(terms[k][c + c / 3]);
            for v in 0..N {
                acc[v][c] = rs[v].fma(term, acc[v][c]);
            }
        }
        k += 1;
    }
    for v in 0..N {
        for c in 0..12 {
            acc[v][c].store(&mut sums[v * width + c * V::LANES..]);
        }
    }
}

/// The six even and six odd terms of every step, each three followed by nothing in particular. Bands that the
/// column has not are 0.
#[inline(always)]
fn prepare<T: Real>(part: &Part<'_>, column: &[Row], factors: Option<&[f64]>, terms: &mut Vec<[T; 16]>) {
    let back = [part.phase[0], -part.phase[1]];
    terms.resize(part.steps.len(), [T::default(); 16]);
    let bands = column.len().min(factors.map_or(usize::MAX, <[f64]>::len));
    let mut even = band(back, column, factors, bands, 0);
    for k in 0..part.steps.len() {
        let step = &part.steps[k];
        let odd = band(back, column, factors, bands, 2 * k + 1);
        let next = band(back, column, factors, bands, 2 * k + 2);
        let terms = &mut terms[k];
        for half in 0..2 {
            for c in 0..4 {
                let even = step.even[0] * even[half][c] + step.even[1] * next[half][c];
                terms[4 * half + c] = T::of(even);
                terms[8 + 4 * half + c] = T::of(step.odd * odd[half][c]);
            }
        }
        even = next;
    }
}

/// One of the first `bands` of a column, turned and multiplied; 0 beyond.
#[inline(always)]
fn band(back: [f64; 2], column: &[Row], factors: Option<&[f64]>, bands: usize, k: usize) -> Terms {
    if k >= bands {
        return [[0.0; 4]; 2];
    }
    let factor = match factors {
        Some(factors) => factors[k],
        None => 1.0,
    };
    let r = &column[k];
    turn([factor * back[0], factor * back[1]], [r[0], r[1], r[2], 0.0], [r[3], r[4], r[5], 0.0])
}

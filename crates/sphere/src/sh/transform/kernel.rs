//! The Legendre stage for one m: sums over degrees at groups of rings, and over rings for blocks of degrees.
//!
//! Both directions take blocks of steps of the recursion at chunks of rings: first r_k of all of them is
//! computed, in f64, into a small table; then the table is multiplied with the six even and six odd terms, in
//! the precision of the transform, with the sums in registers.

use super::recursion::{Starts, Step, Unit};
use super::rings::BLOCK;
use rustfft::FftNum;
use std::ops::Range;
use steradian_simd::{Arch, Double, Single, Vector};

/// Cosine terms of red, green and blue, then their sine terms.
pub(super) type Row = [f64; 6];

/// A row's cosine and sine terms, each a register wide: what the last lanes hold does not matter.
pub(super) type Terms = [[f64; 4]; 2];

/// Numbers that a block of rings holds for one m: even parts of the six terms, then odd ones, ring by ring.
pub(super) const CELL: usize = 12 * BLOCK;

/// Steps of the recursion in a table.
pub(super) const STEPS: usize = 16;

/// Rings in a table: it stays in the first-level cache, as do the terms of its rings.
pub(super) const RINGS: usize = 128;

/// The precision of sums.
pub(in crate::sh) trait Real: FftNum + Default + super::Sample {
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
    pub(super) state: Vec<f64>,
    pub(super) table: Vec<T>,
    pub(super) values: Vec<T>,
    pub(super) sums: Vec<T>,
    pub(super) terms: Vec<[T; 16]>,
    pub(super) rows: Vec<[f64; 16]>,
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
    pub(super) fn fill<A: Arch, T: Real>(
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
pub(super) fn vectors<V: Vector, const N: usize>(x: &[V::T], from: usize) -> [V; N] {
    // Loops, not closures or iterators: these would be compiled for themselves, without the instruction set.
    let mut vectors = [V::load(&x[from..]); N];
    for v in 1..N {
        vectors[v] = V::load(&x[from + v * V::LANES..]);
    }
    vectors
}

/// Where in a cell row `c` of the vector that starts at `ring` lies, in cells of blocks `stride` apart.
#[inline(always)]
pub(super) fn place(ring: usize, stride: usize, c: usize) -> usize {
    ring / BLOCK * stride + c * BLOCK + ring % BLOCK
}

/// The first `n` numbers of a buffer, whole registers, made 0.
#[inline(always)]
pub(super) fn zeros<A: Arch>(buffer: &mut Vec<f64>, n: usize) -> &mut [f64] {
    let zeros = aligned(buffer, n);
    let mut at = 0;
    while at < n {
        A::F64::splat(0.0).store(&mut zeros[at..]);
        at += A::F64::LANES;
    }
    zeros
}

/// Cosine and sine terms, turned by an angle.
#[inline(always)]
pub(super) fn turn([cos, sin]: [f64; 2], c: [f64; 4], s: [f64; 4]) -> Terms {
    let mut out = [[0.0; 4]; 2];
    for k in 0..4 {
        out[0][k] = cos * c[k] - sin * s[k];
        out[1][k] = sin * c[k] + cos * s[k];
    }
    out
}

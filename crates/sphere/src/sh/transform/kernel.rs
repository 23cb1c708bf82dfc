//! The Legendre stage for one m: what sums over degrees at rings and sums over rings for degrees share.
//!
//! Sums of products of r_k with the six even and six odd terms are in registers: of a few registers of rings
//! over steps (synthesis), of two steps over rings (analysis). With 32 registers the recursion is in the same
//! loop ([`super::fused`]). With 16 it would drive sums out of them, and each addition would wait for a store
//! and a load, so that r_k of a few steps is written first and sums are made of that, half of the terms at a
//! time ([`super::stored`]): two thirds of the time with AVX2.

use super::Sample;
use super::recursion::{Starts, Step};
use super::rings::BLOCK;
use std::ops::{Add, AddAssign, Mul, Neg, Sub};
use steradian_simd::{Arch, Double, Single, Vector};

/// Cosine terms of red, green and blue, then their sine terms, each three followed by a number that does not
/// matter.
pub(super) type Row = [f64; 8];

/// Numbers that a block of rings holds for one m: even parts of the six terms, then odd ones, ring by ring.
pub(super) const CELL: usize = 12 * BLOCK;

/// The precision of sums.
pub(in crate::sh) trait Real:
    Sample
    + Default
    + std::fmt::Debug
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// A register.
    type Vector<A: Arch>: Vector<T = Self>;
    /// A register of at least four, which may be less than the widest.
    type Short<A: Arch>: Vector<T = Self>;
    /// The nearest number.
    fn of(x: f64) -> Self;
    /// As f64.
    fn f64(self) -> f64;
    /// Samples that are such numbers.
    fn same<S: Sample>(x: &[S]) -> Option<&[Self]>;
    /// Samples that are such numbers.
    fn same_mut<S: Sample>(x: &mut [S]) -> Option<&mut [Self]>;
    /// Rounds a register of four into the first places of a slice.
    fn put<V: Vector<T = f64>>(x: V, out: &mut [Self]);
    /// Registers of f64 that hold as many numbers as one of these.
    const PARTS: usize;
    /// The v-th register of numbers.
    fn pack<A: Arch, const D: usize>(x: &[A::F64; D], v: usize) -> Self::Vector<A>;
}

impl Real for f64 {
    type Vector<A: Arch> = A::F64;
    type Short<A: Arch> = A::F64x4;
    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn same<S: Sample>(x: &[S]) -> Option<&[Self]> {
        S::doubles(x)
    }
    #[inline(always)]
    fn same_mut<S: Sample>(x: &mut [S]) -> Option<&mut [Self]> {
        S::doubles_mut(x)
    }
    #[inline(always)]
    fn put<V: Vector<T = f64>>(x: V, out: &mut [Self]) {
        x.store(out);
    }
    const PARTS: usize = 1;
    #[inline(always)]
    fn pack<A: Arch, const D: usize>(x: &[A::F64; D], v: usize) -> A::F64 {
        x[v]
    }
}

impl Real for f32 {
    type Vector<A: Arch> = A::F32;
    type Short<A: Arch> = A::Octet;
    #[inline(always)]
    fn of(x: f64) -> Self {
        x as Self
    }
    #[inline(always)]
    fn f64(self) -> f64 {
        self.into()
    }
    #[inline(always)]
    fn same<S: Sample>(x: &[S]) -> Option<&[Self]> {
        S::singles(x)
    }
    #[inline(always)]
    fn same_mut<S: Sample>(x: &mut [S]) -> Option<&mut [Self]> {
        S::singles_mut(x)
    }
    #[inline(always)]
    fn put<V: Vector<T = f64>>(x: V, out: &mut [Self]) {
        let (mut all, out) = ([0.0; 4], &mut out[..4]);
        x.store(&mut all);
        for k in 0..4 {
            out[k] = all[k] as Self;
        }
    }
    const PARTS: usize = 2;
    #[inline(always)]
    fn pack<A: Arch, const D: usize>(x: &[A::F64; D], v: usize) -> A::F32 {
        A::F32::narrow(x[2 * v], x[2 * v + 1])
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
pub(in crate::sh) fn aligned<T: Real>(buffer: &mut Vec<T>, n: usize) -> &mut [T] {
    let line = 64 / size_of::<T>();
    if buffer.len() < n + line {
        buffer.resize(n + line, T::default());
    }
    let start = buffer.as_ptr().align_offset(64).min(line);
    &mut buffer[start..start + n]
}

/// r_k and r_{k−1} of a block of rings.
pub(super) type State = [[f64; BLOCK]; 2];

/// One worker's buffers.
#[derive(Default)]
pub(super) struct Scratch<T> {
    pub(super) state: Vec<State>,
    pub(super) values: Vec<T>,
    pub(super) legendre: Vec<T>,
    pub(super) terms: Vec<[T; 16]>,
    pub(super) rows: Vec<[f64; 16]>,
}

impl Part<'_> {
    /// Sets lanes that start at step k.
    #[inline(always)]
    pub(super) fn inject<V: Double, const D: usize>(
        &self,
        ring: usize,
        k: usize,
        now: &mut [V; D],
        before: &mut [V; D],
    ) {
        let k = V::splat(k as f64);
        for v in 0..D {
            let at = self.ring + ring + v * V::LANES;
            let first = V::load(&self.starts.first[at..]);
            now[v] = now[v].replace_if_equal(first, k, V::load(&self.starts.now[at..]));
            before[v] = before[v].replace_if_equal(first, k, V::load(&self.starts.before[at..]));
        }
    }
}

impl Step {
    /// r_{k−1} becomes r_{k+1}.
    #[inline(always)]
    pub(super) fn advance<V: Vector<T = f64>, const D: usize>(
        &self,
        x2: &[V; D],
        now: &[V; D],
        before: &mut [V; D],
    ) {
        let (a, b) = (V::splat(self.a), V::splat(self.b));
        for v in 0..D {
            before[v] = x2[v].fma(a, b).fma(now[v], before[v]);
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

/// Cosine and sine terms, turned by an angle that is given by its cosine and sine.
#[inline(always)]
pub(super) fn turn<V: Vector<T = f64>>([cos, sin]: [V; 2], [c, s]: [V; 2]) -> [V; 2] {
    [s.fnma(sin, c.mul(cos)), c.fma(sin, s.mul(cos))]
}

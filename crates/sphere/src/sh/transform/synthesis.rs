//! The Legendre stage of synthesis for one m: r_k times terms of steps, summed over steps.

use super::fold::register;
use super::kernel::{Part, Real, Row, Scratch, place, turn, vectors};
use super::recursion::Unit;
use super::rings::BLOCK;
use steradian_simd::{Arch, Kernel, Vector};

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
        if T::PARTS == 2 {
            self.with::<A, 1, 2>();
        } else if A::F64::REGISTERS >= 32 {
            self.with::<A, 2, 2>();
        } else {
            self.with::<A, 1, 1>();
        }
    }
}

impl<T: Real> Synthesis<'_, T> {
    /// With sums of N registers of rings at a time, D of f64.
    #[inline(always)]
    fn with<A: Arch, const N: usize, const D: usize>(self) {
        let (part, lanes) = (self.part, T::Vector::<A>::LANES);
        let units = &part.starts.units[part.ring / BLOCK..];
        let terms = &mut self.scratch.terms;
        prepare::<A::F64x4, T>(&part, self.column, self.factors, terms);
        let terms = &terms[..part.steps.len()];
        let mut ring = 0;
        while ring < part.x2.len() {
            let sums = over_steps::<A, T, N, D>(&part, units[ring / BLOCK], ring, terms);
            for v in 0..N {
                let x = register::<A, T>(&part.x[ring..]);
                for c in 0..12 {
                    let sum = if c < 6 { sums[v][c] } else { sums[v][c].mul(x) };
                    sum.store(&mut self.cells[place(ring, self.stride, c)..]);
                }
                ring += lanes;
            }
        }
    }
}

/// Σ over steps of r_k · terms at N registers of rings.
#[inline(always)]
fn over_steps<A: Arch, T: Real, const N: usize, const D: usize>(
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
        part.steps[k].advance(&x2, &mut now, &mut before);
        k += 1;
    }
    let steps = &part.steps[..terms.len()];
    while k < terms.len() {
        add::<A, T, N, D>(&now, &terms[k], &mut sums);
        steps[k].advance(&x2, &mut now, &mut before);
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

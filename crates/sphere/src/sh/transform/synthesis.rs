//! The Legendre stage of synthesis for one m: the table times terms of steps, summed over steps.

use super::kernel::{Part, RINGS, Real, Row, STEPS, Scratch, Terms, aligned, place, turn, vectors, zeros};
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

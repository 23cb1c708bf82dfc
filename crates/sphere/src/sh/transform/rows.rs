//! Rows of samples, transposed: a register holds one column of as many rows as it has lanes.

use super::Sample;
use super::kernel::Real;
use super::rings::BLOCK;
use steradian_simd::{Arch, Kernel, Vector};

/// Sums and differences of rows and their mirrors, as the real and imaginary parts of sequences; rows that are
/// not there are 0.
pub(super) struct Load<'a, T, S> {
    /// Rows of a block from the pole, and their mirrors from the last.
    pub(super) north: &'a [S],
    pub(super) south: &'a [S],
    pub(super) width: usize,
    /// The row of the first lane.
    pub(super) first: usize,
    pub(super) x: &'a mut [T],
}

impl<T: Real, S: Sample> Kernel for Load<'_, T, S> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let (width, lanes) = (self.width, T::Vector::<A>::LANES);
        let zero = T::Vector::<A>::splat(T::default());
        let pairs = T::Vector::<A>::view(self.x).as_chunks_mut::<2>().0;
        let (mut north, mut south) = ([&self.north[..0]; BLOCK], [&self.south[..0]; BLOCK]);
        for q in 0..lanes {
            let row = self.first + q;
            if (row + 1) * width <= self.north.len() {
                north[q] = &self.north[row * width..(row + 1) * width];
            }
            if (row + 1) * width <= self.south.len() {
                let end = self.south.len() - row * width;
                south[q] = &self.south[end - width..end];
            }
        }
        let mut at = 0;
        while at < width {
            let (mut s, mut d) = ([zero; BLOCK], [zero; BLOCK]);
            for q in 0..lanes {
                let (n, m) = (read::<A, T, S>(north[q], at), read::<A, T, S>(south[q], at));
                s[q] = n.add(m);
                d[q] = n.sub(m);
            }
            T::Vector::<A>::transpose(&mut s[..lanes]);
            T::Vector::<A>::transpose(&mut d[..lanes]);
            if at + lanes <= width {
                let pairs = &mut pairs[at..at + lanes];
                for k in 0..lanes {
                    pairs[k] = [s[k], d[k]];
                }
            } else {
                for k in 0..width - at {
                    pairs[at + k] = [s[k], d[k]];
                }
            }
            at += lanes;
        }
    }
}

/// A register of samples of a row; 0 beyond its end.
#[inline(always)]
fn read<A: Arch, T: Real, S: Sample>(row: &[S], at: usize) -> T::Vector<A> {
    let lanes = T::Vector::<A>::LANES;
    let mut x = [T::default(); BLOCK];
    if at + lanes <= row.len() {
        let row = &row[at..at + lanes];
        if let Some(row) = T::same(row) {
            return T::Vector::<A>::load(row);
        }
        for k in 0..lanes {
            x[k] = T::of(row[k].to_f64());
        }
    } else if at < row.len() {
        for k in 0..row.len() - at {
            x[k] = T::of(row[at + k].to_f64());
        }
    } else {
        return T::Vector::<A>::splat(T::default());
    }
    T::Vector::<A>::load(&x)
}

/// Rows from sequences whose first parts are the southern rows and whose second the northern.
pub(super) struct Store<'a, T, S> {
    pub(super) north: &'a mut [S],
    pub(super) south: &'a mut [S],
    pub(super) width: usize,
    pub(super) first: usize,
    pub(super) x: &'a mut [T],
}

impl<T: Real, S: Sample> Kernel for Store<'_, T, S> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let (width, lanes) = (self.width, T::Vector::<A>::LANES);
        let zero = T::Vector::<A>::splat(T::default());
        let pairs = &T::Vector::<A>::view(self.x).as_chunks_mut::<2>().0[..width];
        let rows = |n: usize| (n / width).saturating_sub(self.first);
        let (norths, souths) = (rows(self.north.len()), rows(self.south.len()));
        let (north, last) =
            (self.first * width, self.south.len() - (self.first * width).min(self.south.len()));
        let mut at = 0;
        while at < width {
            let (mut s, mut n) = ([zero; BLOCK], [zero; BLOCK]);
            let count = if at + lanes <= width { lanes } else { width - at };
            if count == lanes {
                let pairs = &pairs[at..at + lanes];
                for k in 0..lanes {
                    [s[k], n[k]] = pairs[k];
                }
            } else {
                for k in 0..count {
                    [s[k], n[k]] = pairs[at + k];
                }
            }
            T::Vector::<A>::transpose(&mut s[..lanes]);
            T::Vector::<A>::transpose(&mut n[..lanes]);
            for q in 0..lanes {
                if q < norths {
                    let row = north + q * width + at;
                    write::<A, T, S>(n[q], &mut self.north[row..row + count]);
                }
                if q < souths {
                    let row = last - (q + 1) * width + at;
                    write::<A, T, S>(s[q], &mut self.south[row..row + count]);
                }
            }
            at += lanes;
        }
    }
}

#[inline(always)]
fn write<A: Arch, T: Real, S: Sample>(v: T::Vector<A>, row: &mut [S]) {
    let lanes = T::Vector::<A>::LANES;
    let mut x = [T::default(); BLOCK];
    if row.len() == lanes {
        if let Some(row) = T::same_mut(row) {
            return v.store(row);
        }
        v.store(&mut x);
        for k in 0..lanes {
            row[k] = S::from_f64(x[k].f64());
        }
    } else {
        v.store(&mut x);
        for k in 0..row.len() {
            row[k] = S::from_f64(x[k].f64());
        }
    }
}

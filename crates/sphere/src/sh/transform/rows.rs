//! Rows of samples, transposed: a register holds one column of as many rows as it has lanes.

use super::Sample;
use super::kernel::Real;
use super::rings::BLOCK;
use steradian_simd::{Arch, Kernel, Vector};

/// Rows of samples of type R, which are read or written.
pub(super) struct Rows<'a, T, R> {
    /// Rows of a block from the pole, and their mirrors from the last.
    pub(super) north: R,
    pub(super) south: R,
    pub(super) width: usize,
    /// The row of the first lane.
    pub(super) first: usize,
    pub(super) x: &'a mut [T],
}

/// A pass over rows, N columns of N rows at a time, N the lanes of a register.
pub(super) trait Tiles<T: Real> {
    fn tiles<A: Arch, const N: usize>(self);
}

impl<T: Real, R> Kernel for Rows<'_, T, R>
where
    Self: Tiles<T>,
{
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        match T::Vector::<A>::LANES {
            2 => self.tiles::<A, 2>(),
            4 => self.tiles::<A, 4>(),
            8 => self.tiles::<A, 8>(),
            _ => self.tiles::<A, BLOCK>(),
        }
    }
}

/// Sums and differences of rows and their mirrors, as the real and imaginary parts of sequences; rows that
/// are not there are 0.
impl<T: Real, S: Sample> Tiles<T> for Rows<'_, T, &[S]> {
    #[inline(always)]
    fn tiles<A: Arch, const N: usize>(self) {
        let (width, zero) = (self.width, T::Vector::<A>::splat(T::default()));
        let pairs = &mut T::Vector::<A>::view(self.x).as_chunks_mut::<2>().0[..width];
        let rows = (self.first + N) * width;
        let mut at = 0;
        if let (Some(north), Some(south)) = (T::same(self.north), T::same(self.south))
            && rows <= north.len()
            && rows <= south.len()
        {
            let (north, south) = (&north[rows - N * width..rows], &south[south.len() - rows..]);
            let south = &south[..N * width];
            while at + N <= width {
                let pairs = &mut pairs[at..at + N];
                // Sums, then differences: both together do not fit the registers.
                let mut x = [zero; N];
                for q in 0..N {
                    let m = T::Vector::<A>::load(&south[(N - 1 - q) * width + at..]);
                    x[q] = T::Vector::<A>::load(&north[q * width + at..]).add(m);
                }
                T::Vector::<A>::transpose(&mut x);
                for k in 0..N {
                    pairs[k][0] = x[k];
                }
                for q in 0..N {
                    let m = T::Vector::<A>::load(&south[(N - 1 - q) * width + at..]);
                    x[q] = T::Vector::<A>::load(&north[q * width + at..]).sub(m);
                }
                T::Vector::<A>::transpose(&mut x);
                for k in 0..N {
                    pairs[k][1] = x[k];
                }
                at += N;
            }
        }
        let (mut north, mut south) = ([&self.north[..0]; N], [&self.south[..0]; N]);
        for q in 0..N {
            let row = self.first + q;
            if (row + 1) * width <= self.north.len() {
                north[q] = &self.north[row * width..(row + 1) * width];
            }
            if (row + 1) * width <= self.south.len() {
                let end = self.south.len() - row * width;
                south[q] = &self.south[end - width..end];
            }
        }
        while at < width {
            let (mut s, mut d) = ([zero; N], [zero; N]);
            for q in 0..N {
                let (n, m) = (read::<A, T, S>(north[q], at), read::<A, T, S>(south[q], at));
                s[q] = n.add(m);
                d[q] = n.sub(m);
            }
            T::Vector::<A>::transpose(&mut s);
            T::Vector::<A>::transpose(&mut d);
            for k in 0..if at + N <= width { N } else { width - at } {
                pairs[at + k] = [s[k], d[k]];
            }
            at += N;
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
impl<T: Real, S: Sample> Tiles<T> for Rows<'_, T, &mut [S]> {
    #[inline(always)]
    fn tiles<A: Arch, const N: usize>(self) {
        let (width, zero) = (self.width, T::Vector::<A>::splat(T::default()));
        let pairs = &T::Vector::<A>::view(self.x).as_chunks_mut::<2>().0[..width];
        let rows = (self.first + N) * width;
        let mut at = 0;
        if rows <= self.north.len()
            && rows <= self.south.len()
            && let (Some(north), Some(south)) = (T::same_mut(self.north), T::same_mut(self.south))
        {
            let end = south.len() - rows;
            let (north, south) = (&mut north[rows - N * width..rows], &mut south[end..end + N * width]);
            while at + N <= width {
                let pairs = &pairs[at..at + N];
                let mut x = [zero; N];
                for k in 0..N {
                    x[k] = pairs[k][0];
                }
                T::Vector::<A>::transpose(&mut x);
                for q in 0..N {
                    x[q].store(&mut south[(N - 1 - q) * width + at..]);
                }
                for k in 0..N {
                    x[k] = pairs[k][1];
                }
                T::Vector::<A>::transpose(&mut x);
                for q in 0..N {
                    x[q].store(&mut north[q * width + at..]);
                }
                at += N;
            }
        }
        let rows = |n: usize| (n / width).saturating_sub(self.first);
        let (norths, souths) = (rows(self.north.len()), rows(self.south.len()));
        let (north, last) =
            (self.first * width, self.south.len() - (self.first * width).min(self.south.len()));
        while at < width {
            let (mut s, mut n) = ([zero; N], [zero; N]);
            let count = if at + N <= width { N } else { width - at };
            for k in 0..count {
                [s[k], n[k]] = pairs[at + k];
            }
            T::Vector::<A>::transpose(&mut s);
            T::Vector::<A>::transpose(&mut n);
            for q in 0..N {
                if q < norths {
                    let row = north + q * width + at;
                    write::<A, T, S>(n[q], &mut self.north[row..row + count]);
                }
                if q < souths {
                    let row = last - (q + 1) * width + at;
                    write::<A, T, S>(s[q], &mut self.south[row..row + count]);
                }
            }
            at += N;
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

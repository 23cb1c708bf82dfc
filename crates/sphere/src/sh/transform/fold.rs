//! Between the spectra of ring pairs and cells of even and odd parts.

use super::kernel::{CELL, Real};
use super::passes::SIDE;
use super::rings::BLOCK;
use steradian_simd::{Arch, Kernel, Vector};

/// Spectra of one channel, weighted, into the lanes of a block's cells that `cells` begins with.
pub(super) struct Fold<'a, T> {
    /// Where a spectrum holds m and −m.
    pub(super) bins: &'a [[u32; 2]],
    /// Of each ring: half its weight, and that times cos θ.
    pub(super) even: [f64; BLOCK],
    pub(super) odd: [f64; BLOCK],
    pub(super) x: &'a mut [T],
    pub(super) cells: &'a mut [T],
}

impl<T: Real> Kernel for Fold<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let (even, odd) = (register::<A, T>(&self.even), register::<A, T>(&self.odd));
        let spectra = &*T::Vector::<A>::view(self.x).as_chunks_mut::<2>().0;
        let mut at = 0;
        for bins in self.bins {
            let (p, q) = (spectra[bins[0] as usize], spectra[bins[1] as usize]);
            let cell = &mut self.cells[at..][..9 * BLOCK + T::Vector::<A>::LANES];
            even.mul(p[0].add(q[0])).store(cell);
            even.mul(q[1].sub(p[1])).store(&mut cell[3 * BLOCK..]);
            odd.mul(p[1].add(q[1])).store(&mut cell[6 * BLOCK..]);
            odd.mul(p[0].sub(q[0])).store(&mut cell[9 * BLOCK..]);
            at += CELL;
        }
    }
}

/// A register of numbers that are given as f64.
#[inline(always)]
pub(super) fn register<A: Arch, T: Real>(x: &[f64]) -> T::Vector<A> {
    let mut out = [T::default(); BLOCK];
    for k in 0..T::Vector::<A>::LANES {
        out[k] = T::of(x[k]);
    }
    T::Vector::<A>::load(&out)
}

/// A block's cells among those of others: [m / SIDE][block][m % SIDE].
#[derive(Clone, Copy)]
pub(super) struct BlockCells<'a, T> {
    pub(super) cells: &'a [T],
    pub(super) blocks: usize,
    pub(super) block: usize,
}

/// Spectra of one channel: southern rings as first, northern ones as second parts of the sequences.
pub(super) struct Unfold<'a, T> {
    pub(super) bins: &'a [[u32; 2]],
    pub(super) unused: &'a [u32],
    pub(super) aliased: bool,
    pub(super) cells: BlockCells<'a, T>,
    /// The first lane in a cell.
    pub(super) at: usize,
    pub(super) x: &'a mut [T],
}

impl<T: Real> Kernel for Unfold<'_, T> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let spectra = T::Vector::<A>::view(self.x).as_chunks_mut::<2>().0;
        let zero = T::Vector::<A>::splat(T::default());
        for place in self.unused {
            spectra[*place as usize] = [zero; 2];
        }
        let BlockCells { cells, blocks, block } = self.cells;
        for (side, bins) in self.bins.chunks(SIDE).enumerate() {
            let mut at = (side * blocks + block) * SIDE * CELL + self.at;
            for (k, bins) in bins.iter().enumerate() {
                let cell = &cells[at..][..9 * BLOCK + T::Vector::<A>::LANES];
                at += CELL;
                let (ec, es) = (T::Vector::<A>::load(cell), T::Vector::<A>::load(&cell[3 * BLOCK..]));
                let oc = T::Vector::<A>::load(&cell[6 * BLOCK..]);
                let os = T::Vector::<A>::load(&cell[9 * BLOCK..]);
                // Halves c − is of the north and, times i, of the south.
                let ((nc, ns), (sc, ss)) = ((ec.add(oc), es.add(os)), (ec.sub(oc), es.sub(os)));
                let plus = [sc.sub(ns), nc.add(ss)];
                let minus = [sc.add(ns), nc.sub(ss)];
                let (p, q) = (bins[0] as usize, bins[1] as usize);
                if self.aliased {
                    spectra[p] = [spectra[p][0].add(plus[0]), spectra[p][1].add(plus[1])];
                    spectra[q] = [spectra[q][0].add(minus[0]), spectra[q][1].add(minus[1])];
                } else if side + k == 0 {
                    spectra[p] = [plus[0].add(minus[0]), plus[1].add(minus[1])];
                } else {
                    spectra[p] = plus;
                    spectra[q] = minus;
                }
            }
        }
    }
}

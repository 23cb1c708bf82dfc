//! The ring FFTs, between rows of samples and cells of even and odd parts of blocks of row pairs.
//!
//! Two real rings are the real and imaginary parts of one complex ring: north and south, or their sum and
//! difference. With Z the complex ring's spectrum, frequency m of the real part is (Z_m + Z̄_{n−m})/2, that
//! of the imaginary part (Z_m − Z̄_{n−m})/2i. Every lane of a register has its own ring, from the rows, which
//! are transposed on the way, to the cells.

use super::Sample;
use super::batch::Batch;
use super::fold::{BlockCells, Fold, Unfold};
use super::kernel::{Real, aligned};
use super::rings::{BLOCK, Rings};
use super::rows::Rows;
use std::f64::consts::{PI, SQRT_2};
use steradian_simd::{Arch, Kernel, Vector};

pub(super) struct Fourier<T: Real> {
    width: usize,
    /// None for an empty grid.
    batch: Option<Batch<T>>,
    /// Where a spectrum holds frequencies m and −m.
    bins: Vec<[u32; 2]>,
    /// Places of a spectrum that no order up to the plan's has; all, where some share one.
    unused: Vec<u32>,
    /// Rings side by side.
    lanes: usize,
}

/// One worker's buffers.
#[derive(Default)]
pub(super) struct Buffers<T> {
    spectra: Vec<T>,
}

/// Rows of a block's pairs of the three planes, from both poles towards the equator.
pub(super) struct RowBlock<R> {
    pub(super) north: [R; 3],
    pub(super) south: [R; 3],
}

/// Numbers per register.
pub(in crate::sh) struct Lanes<T>(pub(in crate::sh) std::marker::PhantomData<T>);

impl<T: Real> Kernel for Lanes<T> {
    type Output = usize;
    #[inline(always)]
    fn run<A: Arch>(self) -> usize {
        T::Vector::<A>::LANES
    }
}

impl<T: Real> Fourier<T> {
    pub(super) fn new(order: usize, width: usize) -> Self {
        let lanes = steradian_simd::run(Lanes::<T>(std::marker::PhantomData));
        let batch = (width > 0).then(|| Batch::new(width));
        let (mut bins, mut unused) = (vec![], vec![]);
        if let Some(batch) = &batch {
            let at = |m: usize| batch.places()[m % width];
            bins.extend((0..=order).map(|m| [at(m), at(width - m % width)]));
            let free = if 2 * order >= width { 0..width } else { order + 1..width - order };
            unused.extend(free.map(at));
        }
        Self { width, batch, bins, unused, lanes }
    }

    /// Do some orders share a frequency?
    fn aliased(&self) -> bool {
        2 * self.bins.len() > self.width + 1
    }

    /// Cells [ring block][m] of sums over φ from the rows of one block, weighted as the `rings` from `ring`
    /// on; without rings, of the sums and differences of rows and their mirrors as they are.
    pub(super) fn forward<S: Sample>(
        &self,
        block: &RowBlock<&[S]>,
        rings: Option<&Rings>,
        ring: usize,
        cells: &mut [T],
        buffers: &mut Buffers<T>,
    ) {
        let (Some(batch), width, lanes) = (&self.batch, self.width, self.lanes) else { return };
        let size = 2 * lanes * width;
        let x = aligned(&mut buffers.spectra, size);
        let bins = &self.bins;
        for k in 0..3 {
            let (north, south) = (block.north[k], block.south[k]);
            for first in (0..BLOCK).step_by(lanes) {
                if first * width < north.len() {
                    steradian_simd::run(Rows { north, south, width, first, x: &mut *x });
                    batch.forward(x);
                } else {
                    x.fill(T::default());
                }
                let [even, odd] = rings.map_or([[0.5; BLOCK]; 2], |rings| rings.halves(ring + first));
                let cells = &mut cells[k * BLOCK + first..];
                steradian_simd::run(Fold { bins, even, odd, x: &mut *x, cells });
            }
        }
    }

    /// Rows of samples from a block's cell for each m.
    pub(super) fn backward<S: Sample>(
        &self,
        cells: BlockCells<'_, T>,
        block: &mut RowBlock<&mut [S]>,
        buffers: &mut Buffers<T>,
    ) {
        let (Some(batch), width, lanes) = (&self.batch, self.width, self.lanes) else { return };
        let x = aligned(&mut buffers.spectra, 2 * lanes * width);
        let (bins, unused, aliased) = (&self.bins, &self.unused, self.aliased());
        for k in 0..3 {
            for first in (0..BLOCK).step_by(lanes) {
                if first * width < block.north[k].len() {
                    let at = k * BLOCK + first;
                    steradian_simd::run(Unfold { bins, unused, aliased, cells, at, x });
                    batch.backward(x);
                    let (north, south) = (&mut *block.north[k], &mut *block.south[k]);
                    steradian_simd::run(Rows { north, south, width, first, x });
                }
            }
        }
    }
}

/// What turns Σ f·(cos, sin) mφ counted from the first of `width` columns into the integral over φ times the
/// norm of the azimuthal functions. `sinc` integrates over texels in place of sampling their centres.
pub(super) fn analysis_phase(m: usize, width: usize, sinc: bool) -> [f64; 2] {
    let h = PI * m as f64 / width as f64;
    let sinc = if sinc && m > 0 { h.sin() / h } else { 1.0 };
    phase(m, width).map(|p| p * sinc * 2.0 * PI / width as f64)
}

/// What turns coefficients of (cos, sin) mφ into halves counted from the first of `width` columns.
pub(super) fn synthesis_phase(m: usize, width: usize) -> [f64; 2] {
    phase(m, width).map(|p| 0.5 * p)
}

/// (cos, sin) of mφ0 with φ0 = −π + π/width, the first column's centre, times the norm of the azimuthal
/// functions: 1 for m = 0, else √2. The angle is reduced exactly first.
fn phase(m: usize, width: usize) -> [f64; 2] {
    if m == 0 || width == 0 {
        return [1.0, 0.0];
    }
    // mφ0 = π m (1 − width)/width, modulo 2π: an integer modulo 2·width.
    let turns = 2 * width as i128;
    let k = (m as i128 * (1 - width as i128)).rem_euclid(turns);
    let (sin, cos) = (PI * k as f64 / width as f64).sin_cos();
    [SQRT_2 * cos, SQRT_2 * sin]
}

//! The ring FFTs, between rows of samples and cells of even and odd parts of blocks of row pairs.
//!
//! Two real rings are the real and imaginary parts of one complex ring: north and south, or their sum and
//! difference. With Z the complex ring's spectrum, frequency m of the real part is (Z_m + Z̄_{n−m})/2, that of
//! the imaginary part (Z_m − Z̄_{n−m})/2i.

use super::Sample;
use super::kernel::{CELL, Real};
use super::rings::{BLOCK, Rings};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::{PI, SQRT_2};
use std::ops::Range;
use std::sync::Arc;

/// Orders m that are moved together, so that rings and cells are met in runs.
const TILE: usize = 8;

/// Forward and inverse FFT of one ring.
type Plans<T> = (Arc<dyn Fft<T>>, Arc<dyn Fft<T>>);

pub(super) struct Fourier<T: Real> {
    order: usize,
    width: usize,
    /// None for an empty grid.
    plans: Option<Plans<T>>,
}

/// One worker's buffers.
#[derive(Default)]
pub(super) struct Buffers<T> {
    /// The pairs' rings or their spectra.
    rings: Vec<Complex<T>>,
    scratch: Vec<Complex<T>>,
}

impl<T: Real> Buffers<T> {
    /// Complex numbers from one ring to the next: streams through the cache that do not meet.
    fn stride(width: usize) -> usize {
        width.next_multiple_of(256) + 20
    }

    fn fit(&mut self, width: usize, scratch: usize) {
        let zero = Complex::new(T::default(), T::default());
        self.rings.resize(BLOCK * Self::stride(width), zero);
        if self.scratch.len() < scratch {
            self.scratch.resize(scratch, zero);
        }
    }
}

/// Rows of a block's pairs of the three planes, from both poles towards the equator.
pub(super) struct RowBlock<R> {
    pub(super) north: [R; 3],
    pub(super) south: [R; 3],
}

impl<T: Real> Fourier<T> {
    pub(super) fn new(order: usize, width: usize) -> Self {
        let plans = (width > 0).then(|| {
            let mut planner = FftPlanner::new();
            (planner.plan_fft_forward(width), planner.plan_fft_inverse(width))
        });
        Self { order, width, plans }
    }

    /// Where the spectrum of a ring holds frequencies m and −m.
    fn bins(&self, m: usize) -> (usize, usize) {
        let k = if m < self.width { m } else { m % self.width };
        (k, if k > 0 { self.width - k } else { 0 })
    }

    /// Cells [ring block][m] of weighted sums over φ from the rows of one block; `ring` is its first ring.
    pub(super) fn forward<S: Sample>(
        &self,
        block: &RowBlock<&[S]>,
        rings: &Rings,
        ring: usize,
        cells: &mut [T],
        buffers: &mut Buffers<T>,
    ) {
        let (Some((fft, _)), width) = (&self.plans, self.width) else { return };
        buffers.fit(width, fft.get_inplace_scratch_len());
        let stride = Buffers::<T>::stride(width);
        let read = |s: &S| T::of(s.to_f64());
        for k in 0..3 {
            for (lane, north) in block.north[k].chunks_exact(width).enumerate() {
                let ring = &mut buffers.rings[lane * stride..][..width];
                // The equator is its own mirror.
                if let Some(south) = block.south[k].rchunks_exact(width).nth(lane) {
                    for ((z, n), s) in ring.iter_mut().zip(north).zip(south) {
                        let (n, s) = (read(n), read(s));
                        *z = Complex::new(n + s, n - s);
                    }
                } else {
                    for (z, n) in ring.iter_mut().zip(north) {
                        *z = Complex::new(read(n), read(n));
                    }
                }
                fft.process_with_scratch(ring, &mut buffers.scratch);
            }
            for i in 0..rings.per_row {
                self.fold(k, i, rings, ring, &buffers.rings, cells);
            }
        }
    }

    /// Spectra of channel k, weighted, into the i-th BLOCK rings of a block.
    fn fold(&self, k: usize, i: usize, rings: &Rings, ring: usize, spectra: &[Complex<T>], cells: &mut [T]) {
        let (stride, at) = (Buffers::<T>::stride(self.width), ring + i * BLOCK);
        let cells = &mut cells[i * (self.order + 1) * CELL..(i + 1) * (self.order + 1) * CELL];
        for first in (0..=self.order).step_by(TILE) {
            let orders = first..(first + TILE).min(self.order + 1);
            for lane in 0..BLOCK {
                let spectrum = &spectra[(i * BLOCK + lane) / rings.per_row * stride..][..self.width];
                let even = 0.5 * rings.weight[at + lane];
                let (even, odd) = (T::of(even), T::of(even * rings.cos[at + lane]));
                let put = |cell: &mut [T], p: Complex<T>, q: Complex<T>| {
                    cell[k * BLOCK + lane] = even * (p.re + q.re);
                    cell[(3 + k) * BLOCK + lane] = even * (q.im - p.im);
                    cell[(6 + k) * BLOCK + lane] = odd * (p.im + q.im);
                    cell[(9 + k) * BLOCK + lane] = odd * (p.re - q.re);
                };
                let cells = &mut cells[first * CELL..orders.end * CELL];
                match mirrored(self.width, &orders) {
                    Some(mirror) => {
                        let pairs = spectrum[orders.clone()].iter().zip(spectrum[mirror].iter().rev());
                        for (cell, (p, q)) in cells.chunks_exact_mut(CELL).zip(pairs) {
                            put(cell, *p, *q);
                        }
                    }
                    None => {
                        for (cell, m) in cells.chunks_exact_mut(CELL).zip(orders.clone()) {
                            let (p, q) = self.bins(m);
                            put(cell, spectrum[p], spectrum[q]);
                        }
                    }
                }
            }
        }
    }

    /// Rows of samples from a block's cell for each m.
    pub(super) fn backward<'a, S: Sample>(
        &self,
        cell: impl Fn(usize) -> &'a [T],
        block: &mut RowBlock<&mut [S]>,
        buffers: &mut Buffers<T>,
    ) {
        let (Some((_, fft)), width) = (&self.plans, self.width) else { return };
        buffers.fit(width, fft.get_inplace_scratch_len());
        let stride = Buffers::<T>::stride(width);
        for k in 0..3 {
            self.unfold(k, &cell, &mut buffers.rings);
            let north = block.north[k].chunks_exact_mut(width);
            let mut south = block.south[k].rchunks_exact_mut(width);
            for (lane, north) in north.enumerate() {
                let ring = &mut buffers.rings[lane * stride..][..width];
                fft.process_with_scratch(ring, &mut buffers.scratch);
                for (o, z) in north.iter_mut().zip(&*ring) {
                    *o = S::from_f64(z.re.f64());
                }
                if let Some(south) = south.next() {
                    for (o, z) in south.iter_mut().zip(&*ring) {
                        *o = S::from_f64(z.im.f64());
                    }
                }
            }
        }
    }

    /// Spectra of channel k: north in the real, south in the imaginary part of the rings.
    fn unfold<'a>(&self, k: usize, cell: &impl Fn(usize) -> &'a [T], rings: &mut [Complex<T>]) {
        let (width, aliased) = (self.width, 2 * self.order >= self.width);
        let stride = Buffers::<T>::stride(width);
        for lane in 0..BLOCK {
            let spectrum = &mut rings[lane * stride..][..width];
            let unused = if aliased { 0..width } else { self.order + 1..width - self.order };
            spectrum[unused].fill(Complex::new(T::default(), T::default()));
        }
        for first in (0..=self.order).step_by(TILE) {
            let orders = first..(first + TILE).min(self.order + 1);
            let mut cells: [&[T]; TILE] = [&[]; TILE];
            for (c, m) in cells.iter_mut().zip(orders.clone()) {
                *c = &cell(m)[k * BLOCK..][..10 * BLOCK];
            }
            let cells = &cells[..orders.len()];
            for lane in 0..BLOCK {
                let spectrum = &mut rings[lane * stride..][..width];
                // Halves c − is of the north and, times i, of the south.
                let halves = |cell: &[T]| {
                    let (ec, es) = (cell[lane], cell[3 * BLOCK + lane]);
                    let (oc, os) = (cell[6 * BLOCK + lane], cell[9 * BLOCK + lane]);
                    let ((nc, ns), (sc, ss)) = ((ec + oc, es + os), (ec - oc, es - os));
                    (Complex::new(nc + ss, sc - ns), Complex::new(nc - ss, sc + ns))
                };
                match mirrored(width, &orders) {
                    Some(mirror) if !aliased => {
                        let (below, above) = spectrum.split_at_mut(mirror.start);
                        let pairs =
                            below[orders.clone()].iter_mut().zip(above[..orders.len()].iter_mut().rev());
                        for (cell, (p, q)) in cells.iter().zip(pairs) {
                            (*p, *q) = halves(cell);
                        }
                    }
                    _ => {
                        for (cell, m) in cells.iter().zip(orders.clone()) {
                            let (p, q) = self.bins(m);
                            let (plus, minus) = halves(cell);
                            if m == 0 && !aliased {
                                spectrum[0] = plus + minus;
                            } else {
                                spectrum[p] = if aliased { spectrum[p] + plus } else { plus };
                                spectrum[q] = if aliased { spectrum[q] + minus } else { minus };
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Where a spectrum holds −m of `orders`, backwards, if that is one run beyond all of them.
fn mirrored(width: usize, orders: &Range<usize>) -> Option<Range<usize>> {
    (orders.start > 0 && 2 * orders.end <= width).then(|| width + 1 - orders.end..width + 1 - orders.start)
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

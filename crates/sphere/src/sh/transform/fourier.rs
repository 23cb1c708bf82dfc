//! The ring FFTs, between rows of samples and cells of even and odd parts of eight row pairs.
//!
//! Two real rings are the real and imaginary parts of one complex ring: north and south, or their sum and
//! difference. With Z the complex ring's spectrum, frequency m of the real part is (Z_m + Z̄_{n−m})/2, that of
//! the imaginary part (Z_m − Z̄_{n−m})/2i.

use super::Sample;
use super::kernel::CELL;
use super::rings::{BLOCK, Rings};
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::{PI, SQRT_2};
use std::sync::Arc;

/// Forward and inverse FFT of one ring.
type Plans = (Arc<dyn Fft<f64>>, Arc<dyn Fft<f64>>);

pub(super) struct Fourier {
    order: usize,
    pub(super) width: usize,
    pub(super) height: usize,
    /// None for an empty grid.
    plans: Option<Plans>,
}

/// One worker's buffers.
#[derive(Default)]
pub(super) struct Buffers {
    /// The eight pairs' rings or their spectra.
    rings: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
}

impl Buffers {
    /// Complex numbers from one ring to the next: eight streams through the cache without meeting.
    fn stride(width: usize) -> usize {
        width.next_multiple_of(256) + 20
    }

    fn fit(&mut self, width: usize, scratch: usize) {
        let zero = Complex::new(0.0, 0.0);
        self.rings.resize(BLOCK * Self::stride(width), zero);
        if self.scratch.len() < scratch {
            self.scratch.resize(scratch, zero);
        }
    }
}

/// Rows of eight pairs of the three planes, from both poles towards the equator.
pub(super) struct RowBlock<T> {
    pub(super) north: [T; 3],
    pub(super) south: [T; 3],
}

impl Fourier {
    pub(super) fn new(order: usize, width: usize, height: usize) -> Self {
        let plans = (width > 0).then(|| {
            let mut planner = FftPlanner::new();
            (planner.plan_fft_forward(width), planner.plan_fft_inverse(width))
        });
        Self { order, width, height, plans }
    }

    /// Where the spectrum of a ring holds frequencies m and −m.
    fn bins(&self, m: usize) -> (usize, usize) {
        let k = if m < self.width { m } else { m % self.width };
        (k, if k > 0 { self.width - k } else { 0 })
    }

    /// What turns Σ f·(cos, sin) mφ counted from the first column into the integral over φ times the norm of
    /// the azimuthal functions. `sinc` integrates over texels in place of sampling their centres.
    pub(super) fn analysis_phase(&self, m: usize, sinc: bool) -> [f64; 2] {
        let h = PI * m as f64 / self.width as f64;
        let sinc = if sinc && m > 0 { h.sin() / h } else { 1.0 };
        phase(m, self.width).map(|p| p * sinc * 2.0 * PI / self.width as f64)
    }

    /// What turns coefficients of (cos, sin) mφ into halves counted from the first column.
    pub(super) fn synthesis_phase(&self, m: usize) -> [f64; 2] {
        phase(m, self.width).map(|p| 0.5 * p)
    }

    /// Cells [ring block][m] of weighted sums over φ from the rows of one block; `ring` is its first ring.
    pub(super) fn forward<S: Sample>(
        &self,
        block: &RowBlock<&[S]>,
        rings: &Rings,
        ring: usize,
        cells: &mut [f64],
        buffers: &mut Buffers,
    ) {
        let (Some((fft, _)), width) = (&self.plans, self.width) else { return };
        buffers.fit(width, fft.get_inplace_scratch_len());
        let stride = Buffers::stride(width);
        for k in 0..3 {
            for (lane, north) in block.north[k].chunks_exact(width).enumerate() {
                let ring = &mut buffers.rings[lane * stride..][..width];
                // The equator is its own mirror.
                if let Some(south) = block.south[k].rchunks_exact(width).nth(lane) {
                    for ((z, n), s) in ring.iter_mut().zip(north).zip(south) {
                        let (n, s) = (n.to_f64(), s.to_f64());
                        *z = Complex::new(n + s, n - s);
                    }
                } else {
                    for (z, n) in ring.iter_mut().zip(north) {
                        *z = Complex::new(n.to_f64(), n.to_f64());
                    }
                }
                fft.process_with_scratch(ring, &mut buffers.scratch);
            }
            for i in 0..rings.per_row {
                self.fold(k, i, rings, ring, &buffers.rings, cells);
            }
        }
    }

    /// Spectra of channel k, weighted, into the i-th eight rings of a block.
    fn fold(
        &self,
        k: usize,
        i: usize,
        rings: &Rings,
        ring: usize,
        spectra: &[Complex<f64>],
        cells: &mut [f64],
    ) {
        let (stride, at) = (Buffers::stride(self.width), ring + i * BLOCK);
        let spectra: [&[Complex<f64>]; BLOCK] =
            std::array::from_fn(|lane| &spectra[(i * BLOCK + lane) / rings.per_row * stride..][..self.width]);
        let even: [f64; BLOCK] = std::array::from_fn(|lane| 0.5 * rings.weight[at + lane]);
        let odd: [f64; BLOCK] = std::array::from_fn(|lane| even[lane] * rings.cos[at + lane]);
        let cells = &mut cells[i * (self.order + 1) * CELL..(i + 1) * (self.order + 1) * CELL];
        for (m, cell) in cells.chunks_exact_mut(CELL).enumerate() {
            let (p, q) = self.bins(m);
            let (first, second) = cell.split_at_mut(6 * BLOCK);
            let first = &mut first[2 * k * BLOCK..][..2 * BLOCK];
            let second = &mut second[2 * k * BLOCK..][..2 * BLOCK];
            for lane in 0..BLOCK {
                let (p, q) = (spectra[lane][p], spectra[lane][q]);
                first[lane] = even[lane] * (p.re + q.re);
                first[BLOCK + lane] = even[lane] * (q.im - p.im);
                second[lane] = odd[lane] * (p.im + q.im);
                second[BLOCK + lane] = odd[lane] * (p.re - q.re);
            }
        }
    }

    /// Rows of samples from a block's cell for each m.
    pub(super) fn backward<'a, S: Sample>(
        &self,
        cell: impl Fn(usize) -> &'a [f64],
        block: &mut RowBlock<&mut [S]>,
        buffers: &mut Buffers,
    ) {
        let (Some((_, fft)), width) = (&self.plans, self.width) else { return };
        buffers.fit(width, fft.get_inplace_scratch_len());
        let stride = Buffers::stride(width);
        for k in 0..3 {
            self.unfold(k, &cell, &mut buffers.rings);
            let north = block.north[k].chunks_exact_mut(width);
            let mut south = block.south[k].rchunks_exact_mut(width);
            for (lane, north) in north.enumerate() {
                let ring = &mut buffers.rings[lane * stride..][..width];
                fft.process_with_scratch(ring, &mut buffers.scratch);
                north.iter_mut().zip(&*ring).for_each(|(o, z)| *o = S::from_f64(z.re));
                if let Some(south) = south.next() {
                    south.iter_mut().zip(&*ring).for_each(|(o, z)| *o = S::from_f64(z.im));
                }
            }
        }
    }

    /// Spectra of channel k: north in the real, south in the imaginary part of the rings.
    fn unfold<'a>(&self, k: usize, cell: &impl Fn(usize) -> &'a [f64], rings: &mut [Complex<f64>]) {
        let (width, aliased) = (self.width, 2 * self.order >= self.width);
        let mut spectra = rings.chunks_exact_mut(Buffers::stride(width));
        let mut spectra: [&mut [Complex<f64>]; BLOCK] =
            std::array::from_fn(|_| &mut spectra.next().expect("`fit` made eight")[..width]);
        for spectrum in &mut spectra {
            let unused = if aliased { 0..width } else { self.order + 1..width - self.order };
            spectrum[unused].fill(Complex::new(0.0, 0.0));
        }
        for m in 0..=self.order {
            let (even, odd) = cell(m).split_at(6 * BLOCK);
            let (even, odd) = (&even[2 * k * BLOCK..][..2 * BLOCK], &odd[2 * k * BLOCK..][..2 * BLOCK]);
            let (p, q) = self.bins(m);
            for lane in 0..BLOCK {
                let spectrum = &mut *spectra[lane];
                let (ec, oc, es, os) = (even[lane], odd[lane], even[BLOCK + lane], odd[BLOCK + lane]);
                // Halves c − is of the north and, times i, of the south.
                let ((nc, ns), (sc, ss)) = ((ec + oc, es + os), (ec - oc, es - os));
                let plus = Complex::new(nc + ss, sc - ns);
                let minus = Complex::new(nc - ss, sc + ns);
                if aliased {
                    spectrum[p] += plus;
                    spectrum[q] += minus;
                } else if m == 0 {
                    spectrum[0] = plus + minus;
                } else {
                    spectrum[p] = plus;
                    spectrum[q] = minus;
                }
            }
        }
    }
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

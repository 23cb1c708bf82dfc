//! The ring FFTs, between rows of samples and cells of even and odd parts of eight row pairs.

use super::Sample;
use super::kernel::CELL;
use super::rings::{BLOCK, Rings};
use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::f64::consts::{PI, SQRT_2};
use std::sync::Arc;

/// Forward and inverse FFT of one ring.
type Plans = (Arc<dyn RealToComplex<f64>>, Arc<dyn ComplexToReal<f64>>);

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
    /// A pair's rows: north and south, or sum and difference.
    rings: [Vec<f64>; 2],
    /// Spectra of the eight pairs, side by side.
    bins: [Vec<Complex<f64>>; 2],
    scratch: Vec<Complex<f64>>,
}

impl Buffers {
    /// Complex numbers from one pair's spectrum to the next: eight streams through the cache without meeting.
    fn stride(width: usize) -> usize {
        (width / 2 + 1).next_multiple_of(256) + 20
    }

    fn fit(&mut self, width: usize, scratch: usize) {
        let zero = Complex::new(0.0, 0.0);
        self.rings.iter_mut().for_each(|r| r.resize(width, 0.0));
        self.bins.iter_mut().for_each(|b| b.resize(BLOCK * Self::stride(width), zero));
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
            let mut planner = RealFftPlanner::new();
            (planner.plan_fft_forward(width), planner.plan_fft_inverse(width))
        });
        Self { order, width, height, plans }
    }

    /// The bin of a real FFT that holds frequency m, and whether as its conjugate.
    fn bin(&self, m: usize) -> (usize, bool) {
        let k = m % self.width;
        if 2 * k <= self.width { (k, false) } else { (self.width - k, true) }
    }

    fn is_aliased(&self) -> bool {
        2 * self.order >= self.width
    }

    /// What turns Σ f·(cos, sin) mφ counted from the first column into the integral over φ times the norm of
    /// the azimuthal functions. `sinc` integrates over texels in place of sampling their centres.
    pub(super) fn analysis_phase(&self, m: usize, sinc: bool) -> [f64; 2] {
        let h = PI * m as f64 / self.width as f64;
        let sinc = if sinc && m > 0 { h.sin() / h } else { 1.0 };
        phase(m, self.width).map(|p| p * sinc * 2.0 * PI / self.width as f64)
    }

    /// What turns coefficients of (cos, sin) mφ into bins counted from the first column.
    pub(super) fn synthesis_phase(&self, m: usize) -> [f64; 2] {
        let bin = self.bin(m).0;
        let half = if bin == 0 || 2 * bin == self.width { 1.0 } else { 0.5 };
        phase(m, self.width).map(|p| p * half)
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
        buffers.fit(width, fft.get_scratch_len());
        let (bins, stride) = (width / 2 + 1, Buffers::stride(width));
        for k in 0..3 {
            for (lane, north) in block.north[k].chunks_exact(width).enumerate() {
                let [sum, difference] = &mut buffers.rings;
                // The equator is its own mirror.
                let south = block.south[k].rchunks_exact(width).nth(lane);
                if let Some(south) = south {
                    for (((a, b), n), s) in sum.iter_mut().zip(&mut *difference).zip(north).zip(south) {
                        let (n, s) = (n.to_f64(), s.to_f64());
                        (*a, *b) = (n + s, n - s);
                    }
                } else {
                    sum.iter_mut().zip(north).for_each(|(a, n)| *a = n.to_f64());
                    difference.copy_from_slice(sum);
                }
                for (ring, out) in buffers.rings.iter_mut().zip(&mut buffers.bins) {
                    let out = &mut out[lane * stride..][..bins];
                    fft.process_with_scratch(ring, out, &mut buffers.scratch)
                        .expect("buffers are as long as the plan asks");
                }
            }
            for i in 0..rings.per_row {
                self.fold(k, i, rings, ring, &buffers.bins, cells);
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
        bins: &[Vec<Complex<f64>>; 2],
        cells: &mut [f64],
    ) {
        let stride = Buffers::stride(self.width);
        let at = ring + i * BLOCK;
        let row: [usize; BLOCK] = std::array::from_fn(|lane| (i * BLOCK + lane) / rings.per_row * stride);
        let even: [f64; BLOCK] = std::array::from_fn(|lane| rings.weight[at + lane]);
        let odd: [f64; BLOCK] = std::array::from_fn(|lane| even[lane] * rings.cos[at + lane]);
        let cells = &mut cells[i * (self.order + 1) * CELL..(i + 1) * (self.order + 1) * CELL];
        for (m, cell) in cells.chunks_exact_mut(CELL).enumerate() {
            let (bin, conjugate) = self.bin(m);
            let sign = if conjugate { 1.0 } else { -1.0 };
            for (bins, weight, c) in [(&bins[0], &even, 2 * k), (&bins[1], &odd, 6 + 2 * k)] {
                let cell = &mut cell[c * BLOCK..(c + 2) * BLOCK];
                for lane in 0..BLOCK {
                    let f = bins[row[lane] + bin];
                    cell[lane] = weight[lane] * f.re;
                    cell[BLOCK + lane] = sign * weight[lane] * f.im;
                }
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
        buffers.fit(width, fft.get_scratch_len());
        let (bins, gap) = (width / 2 + 1, Buffers::stride(width));
        for k in 0..3 {
            self.unfold(k, &cell, &mut buffers.bins);
            let north = block.north[k].chunks_exact_mut(width).map(Some);
            let south = block.south[k].rchunks_exact_mut(width).map(Some);
            let south = south.chain(std::iter::repeat_with(|| None));
            for (lane, (north, south)) in north.zip(south).enumerate() {
                for (out, spectra) in [north, south].into_iter().zip(&mut buffers.bins) {
                    let Some(out) = out else { continue };
                    let spectrum = &mut spectra[lane * gap..][..bins];
                    let ring = &mut buffers.rings[0];
                    fft.process_with_scratch(spectrum, ring, &mut buffers.scratch)
                        .expect("buffers are as long as the plan asks, and ends are real");
                    out.iter_mut().zip(&*ring).for_each(|(o, r)| *o = S::from_f64(*r));
                }
            }
        }
    }

    /// Northern and southern spectra of channel k.
    fn unfold<'a>(
        &self,
        k: usize,
        cell: &impl Fn(usize) -> &'a [f64],
        bins: &mut [Vec<Complex<f64>>; 2],
    ) {
        let (size, gap) = (self.width / 2 + 1, Buffers::stride(self.width));
        let aliased = self.is_aliased();
        let keep = if aliased { 0 } else { self.order + 1 };
        let [north, south] = bins;
        for bins in [&mut *north, &mut *south] {
            bins.chunks_exact_mut(gap).for_each(|b| b[keep.min(size)..size].fill(Complex::new(0.0, 0.0)));
        }
        for m in 0..=self.order {
            let cell = cell(m);
            let (even, odd) = (&cell[2 * k * BLOCK..][..2 * BLOCK], &cell[(6 + 2 * k) * BLOCK..][..2 * BLOCK]);
            let mut n = [0.0; 2 * BLOCK];
            let mut s = n;
            for i in 0..2 * BLOCK {
                (n[i], s[i]) = (even[i] + odd[i], even[i] - odd[i]);
            }
            let (bin, conjugate) = self.bin(m);
            let sign = if bin == 0 || 2 * bin == self.width {
                0.0
            } else if conjugate {
                1.0
            } else {
                -1.0
            };
            for (part, bins) in [(n, &mut *north), (s, &mut *south)] {
                for lane in 0..BLOCK {
                    let f = Complex::new(part[lane], sign * part[BLOCK + lane]);
                    let bin = &mut bins[lane * gap + bin];
                    *bin = if aliased { *bin + f } else { f };
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

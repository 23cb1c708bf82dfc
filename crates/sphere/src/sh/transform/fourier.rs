//! The ring FFTs, folded into even and odd parts of row pairs.

use super::Sample;
use rayon::prelude::*;
use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::f64::consts::{PI, SQRT_2};
use std::ops::Range;
use std::sync::Arc;

/// Even part (north + south) as (cosine, sine) of red, green, blue and two zeros, then the odd part.
pub(super) type PairRow = [f64; 16];

/// Forward and inverse FFT of one ring.
type Plans = (Arc<dyn RealToComplex<f64>>, Arc<dyn ComplexToReal<f64>>);

pub(super) struct Fourier {
    order: usize,
    pub(super) width: usize,
    pub(super) height: usize,
    /// None for an empty grid.
    plans: Option<Plans>,
    /// e^{imφ0}, times the norm of the azimuthal functions: 1 for m = 0, else √2.
    phase: Vec<Complex<f64>>,
}

impl Fourier {
    pub(super) fn new(order: usize, width: usize, height: usize) -> Self {
        let plans = (width > 0).then(|| {
            let mut planner = RealFftPlanner::new();
            (planner.plan_fft_forward(width), planner.plan_fft_inverse(width))
        });
        let phase = (0..=order).map(|m| phase(m, width)).collect();
        Self { order, width, height, plans, phase }
    }

    /// Sums over φ of f·(cos, sin)·2π/width, times the basis' norm, for the row pairs of a range:
    /// [pair][m]. `sinc` integrates over texels in place of sampling their centres.
    pub(super) fn forward<S: Sample>(
        &self,
        planes: [&[S]; 3],
        pairs: Range<usize>,
        sinc: bool,
    ) -> Vec<PairRow> {
        let Some((fft, _)) = &self.plans else { return Vec::new() };
        let columns = self.order + 1;
        let mut rows = vec![[0.0; 16]; pairs.len() * columns];
        let scale: Vec<f64> = (0..columns)
            .map(|m| {
                let h = PI * m as f64 / self.width as f64;
                let sinc = if sinc && m > 0 { h.sin() / h } else { 1.0 };
                sinc * 2.0 * PI / self.width as f64
            })
            .collect();
        let init = || (fft.make_input_vec(), fft.make_output_vec(), fft.make_scratch_vec());
        rows.par_chunks_mut(columns).zip(pairs).for_each_init(init, |(ring, bins, scratch), (out, north)| {
            let south = self.height - 1 - north;
            for (k, plane) in planes.iter().enumerate() {
                for (row, sign) in [(north, 1.0), (south, -1.0)] {
                    if row == south && north == south && sign < 0.0 {
                        continue;
                    }
                    let samples = &plane[row * self.width..(row + 1) * self.width];
                    ring.iter_mut().zip(samples).for_each(|(r, s)| *r = s.to_f64());
                    fft.process_with_scratch(ring, bins, scratch).expect("buffers come from the plan");
                    self.fold(bins, &scale, k, sign, out);
                }
            }
        });
        rows
    }

    fn fold(&self, bins: &[Complex<f64>], scale: &[f64], k: usize, sign: f64, out: &mut [PairRow]) {
        for (m, row) in out.iter_mut().enumerate() {
            let (bin, conjugate) = self.bin(m);
            let f = if conjugate { bins[bin].conj() } else { bins[bin] };
            let f = f * self.phase[m].conj() * scale[m];
            row[2 * k] += f.re;
            row[2 * k + 1] -= f.im;
            row[8 + 2 * k] += sign * f.re;
            row[8 + 2 * k + 1] -= sign * f.im;
        }
    }

    /// The bin of a real FFT that holds frequency m, and whether as its conjugate.
    fn bin(&self, m: usize) -> (usize, bool) {
        let k = m % self.width;
        if 2 * k <= self.width { (k, false) } else { (self.width - k, true) }
    }

    /// Rows of samples from the sums over l: `spectra` is [m][pair].
    pub(super) fn backward<S: Sample>(
        &self,
        spectra: &[PairRow],
        pairs: Range<usize>,
        planes: &mut [&mut [S]; 3],
    ) {
        let Some((_, fft)) = &self.plans else { return };
        let stride = pairs.len();
        let init = || (fft.make_input_vec(), fft.make_output_vec(), fft.make_scratch_vec());
        for (k, plane) in planes.iter_mut().enumerate() {
            for south in [false, true] {
                let first = if south { self.height - pairs.end } else { pairs.start };
                let range = first * self.width..(first + stride) * self.width;
                let rows = plane[range].par_chunks_mut(self.width).enumerate();
                rows.for_each_init(init, |(bins, ring, scratch), (r, out)| {
                    let pair = if south { stride - 1 - r } else { r };
                    self.unfold(spectra, stride, pair, k, if south { -1.0 } else { 1.0 }, bins);
                    fft.process_with_scratch(bins, ring, scratch).expect("buffers come from the plan");
                    out.iter_mut().zip(&*ring).for_each(|(o, r)| *o = S::from_f64(*r));
                });
            }
        }
    }

    fn unfold(
        &self,
        spectra: &[PairRow],
        stride: usize,
        pair: usize,
        k: usize,
        sign: f64,
        bins: &mut [Complex<f64>],
    ) {
        bins.fill(Complex::new(0.0, 0.0));
        for m in 0..=self.order {
            let row = &spectra[m * stride + pair];
            let (c, s) = (row[2 * k] + sign * row[8 + 2 * k], row[2 * k + 1] + sign * row[8 + 2 * k + 1]);
            let g = Complex::new(c, -s) * self.phase[m];
            let (bin, conjugate) = self.bin(m);
            if bin == 0 || 2 * bin == self.width {
                bins[bin].re += g.re;
            } else {
                bins[bin] += if conjugate { g.conj() } else { g } * 0.5;
            }
        }
    }
}

/// e^{imφ0} with φ0 = −π + π/width, the first column's centre; the angle is reduced exactly first.
fn phase(m: usize, width: usize) -> Complex<f64> {
    if m == 0 || width == 0 {
        return Complex::new(1.0, 0.0);
    }
    // mφ0 = π m (1 − width)/width, modulo 2π: an integer modulo 2·width.
    let turns = 2 * width as i128;
    let k = (m as i128 * (1 - width as i128)).rem_euclid(turns);
    Complex::from_polar(SQRT_2, PI * k as f64 / width as f64)
}

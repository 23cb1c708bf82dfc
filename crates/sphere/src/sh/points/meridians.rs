//! Refinement of samples in θ: meridians over both poles are trigonometric polynomials.

use super::Grid2;
use super::bell::WindowSpectrum;
use crate::sh::transform::{Batch, Lanes, Real, aligned};
use std::f64::consts::PI;
use std::marker::PhantomData;
use steradian_parallel::prelude::*;

/// From `height` rows of `width` samples at texel centres to a grid twice as dense in θ.
pub(super) struct Meridians<T: Real> {
    width: usize,
    height: usize,
    forward: Batch<T>,
    backward: Batch<T>,
    /// Of frequency k ≥ 0, cos and sin: from the first texel's centre to the pole, and what undoes the
    /// window.
    factors: Vec<[T; 2]>,
}

/// Where a few columns, and those half a turn on, go in a row.
type Ends<'a, T> = [&'a mut [T]; 2];

impl<T: Real> Meridians<T> {
    pub(super) fn new(order: usize, width: usize, height: usize, spectrum: &WindowSpectrum) -> Self {
        let n = 2 * height;
        let factor = |k: usize| {
            let size = (n as f64 * spectrum.at(k as f64 / (2 * n) as f64)).recip();
            let (sin, cos) = (PI * k as f64 / n as f64).sin_cos();
            [T::of(size * cos), T::of(-size * sin)]
        };
        let factors = (0..=order).map(factor).collect();
        Self { width, height, forward: Batch::new(n), backward: Batch::new(2 * n), factors }
    }

    /// Fills the rows −border … 2·height + border of θ = jπ/(2·height), each with a border.
    pub(super) fn refine(&self, samples: &[Vec<T>; 3], grid: &mut Grid2<T>) {
        let (half, border, stride) = (self.width / 2, grid.border, grid.stride);
        let lanes = steradian_simd::run(Lanes::<T>(PhantomData));
        // Meridians of so many columns are transformed together.
        let side = 2 * lanes;
        for (samples, plane) in samples.iter().zip(&mut grid.planes) {
            let mut sides: Vec<Vec<Ends<'_, T>>> = Vec::new();
            sides.resize_with(half.div_ceil(side), || Vec::with_capacity(plane.len() / stride));
            for row in plane.chunks_exact_mut(stride) {
                let (there, back) = row[border..border + self.width].split_at_mut(half);
                let ends = there.chunks_mut(side).zip(back.chunks_mut(side));
                sides.iter_mut().zip(ends).for_each(|(side, (there, back))| side.push([there, back]));
            }
            let buffers = || (Vec::new(), Vec::new());
            sides.into_par_iter().enumerate().for_each_init(buffers, |buffers, (i, rows)| {
                self.side(samples, i * side, lanes, border, rows, buffers);
            });
            plane.par_chunks_exact_mut(stride).for_each(|row| {
                row.copy_within(self.width..self.width + border, 0);
                row.copy_within(border..2 * border, border + self.width);
            });
        }
    }

    /// Meridians of the columns from `first`: half of them as real, half as imaginary parts, a lane each.
    fn side(
        &self,
        samples: &[T],
        first: usize,
        lanes: usize,
        border: usize,
        rows: Vec<Ends<'_, T>>,
        (coarse, fine): &mut (Vec<T>, Vec<T>),
    ) {
        let (n, circle, half) = (2 * self.height, 4 * self.height, self.width / 2);
        let count = (half - first).min(2 * lanes);
        let coarse = aligned(coarse, 2 * lanes * n);
        if count < 2 * lanes {
            // What a buffer held before would round into the other half of its lane.
            coarse.fill(T::default());
        }
        for (j, row) in samples.chunks_exact(self.width).enumerate() {
            let (there, back) = (&row[first..first + count], &row[first + half..first + half + count]);
            coarse[2 * lanes * j..][..count].copy_from_slice(there);
            coarse[2 * lanes * (n - 1 - j)..][..count].copy_from_slice(back);
        }
        self.forward.forward(coarse);
        let fine = aligned(fine, 2 * lanes * circle);
        fine.fill(T::default());
        for (k, [cos, sin]) in self.factors.iter().enumerate() {
            self.scale(coarse, k, [*cos, *sin], lanes, fine, k);
            if k > 0 {
                self.scale(coarse, n - k, [*cos, T::default() - *sin], lanes, fine, circle - k);
            }
        }
        self.backward.backward(fine);
        for (row, [there, back]) in rows.into_iter().enumerate() {
            // Beyond half a turn of φ the circle is met on its way back.
            let j = (row + circle - border) % circle;
            for (j, out) in [(j, there), ((circle - j) % circle, back)] {
                let x = &fine[2 * lanes * j..][..2 * lanes];
                let real = count.min(lanes);
                out[..real].copy_from_slice(&x[lanes..lanes + real]);
                out[real..].copy_from_slice(&x[..count - real]);
            }
        }
    }

    /// A frequency times a complex factor, with real and imaginary parts exchanged.
    fn scale(&self, from: &[T], k: usize, [cos, sin]: [T; 2], lanes: usize, to: &mut [T], l: usize) {
        let (k, l) = (self.forward.places()[k] as usize, self.backward.places()[l] as usize);
        let (re, im) = from[2 * lanes * k..2 * lanes * (k + 1)].split_at(lanes);
        let (to_im, to_re) = to[2 * lanes * l..2 * lanes * (l + 1)].split_at_mut(lanes);
        for i in 0..lanes {
            to_re[i] = re[i] * cos - im[i] * sin;
            to_im[i] = re[i] * sin + im[i] * cos;
        }
    }
}

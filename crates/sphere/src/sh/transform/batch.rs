//! Complex FFTs of many sequences at once, one in every lane of a register: no step moves numbers between
//! lanes.
//!
//! Decimation in frequency leaves frequencies in the order of their digits reversed, and decimation in time
//! begins with that: whoever reads or writes a spectrum looks up where a frequency stands, and nothing is
//! ever put in order. A length with a prime factor above 7 is a convolution with a chirp, of two longer
//! transforms (Bluestein 1970).

use super::butterfly::{Pair, butterfly, times};
use super::fourier::Lanes;
use super::kernel::{Real, aligned};
use std::f64::consts::PI;
use std::marker::PhantomData;
use steradian_simd::{Arch, Kernel, Vector};

/// Bytes of sequences that the first-level cache holds: longer ones are done in parts.
const CACHE: usize = 32 << 10;

/// A plan for sequences of one length.
pub(in crate::sh) struct Batch<T: Real> {
    length: usize,
    stages: Vec<Stage<T>>,
    /// Where frequencies stand.
    place: Vec<u32>,
    chirp: Option<Box<Chirp<T>>>,
}

/// Butterflies of one radix over sequences of radix · `part` numbers.
struct Stage<T> {
    radix: usize,
    part: usize,
    /// e^{−2πi jq/(radix·part)} for j < part, 1 ≤ q < radix; none where all are 1.
    twiddles: Vec<[T; 2]>,
    /// cos and sin of 2πj/radix.
    roots: [[T; 2]; 8],
}

impl<T: Real> Batch<T> {
    pub(in crate::sh) fn new(length: usize) -> Self {
        let Some(radices) = radices(length) else {
            let chirp = (length > 0).then(|| Box::new(Chirp::new(length)));
            return Self { length, stages: vec![], place: (0..length as u32).collect(), chirp };
        };
        let mut part = length;
        let stages: Vec<Stage<T>> = radices
            .iter()
            .map(|&radix| {
                part /= radix;
                Stage::new(radix, part)
            })
            .collect();
        let place = |frequency: usize| {
            let (mut digits, mut place) = (frequency, 0);
            for stage in &stages {
                place += digits % stage.radix * stage.part;
                digits /= stage.radix;
            }
            place as u32
        };
        let place = (0..length).map(place).collect();
        Self { length, stages, place, chirp: None }
    }

    /// Where each frequency stands in a spectrum.
    pub(in crate::sh) fn places(&self) -> &[u32] {
        &self.place
    }

    /// Spectra Σ_j x_j e^{−2πi jk/length}, in place; sequences as registers of real and of imaginary parts by
    /// turns.
    pub(in crate::sh) fn forward(&self, x: &mut [T]) {
        if let Some(chirp) = &self.chirp {
            return chirp.transform(x);
        }
        steradian_simd::run(Transform::<T, true> { batch: self, x });
    }

    /// The same sums from spectra to sequences. Real and imaginary parts exchanged, on both ends, it is the
    /// inverse, times the length.
    pub(in crate::sh) fn backward(&self, x: &mut [T]) {
        if let Some(chirp) = &self.chirp {
            return chirp.transform(x);
        }
        steradian_simd::run(Transform::<T, false> { batch: self, x });
    }
}

/// A transform of any length n. With jk = (j² + k² − (k − j)²)/2 it is w_k Σ_j (x_j w_j) w̄_{k−j}, w_j =
/// e^{−πi j²/n}: a convolution, which transforms of a length of 2n − 1 and more make.
struct Chirp<T: Real> {
    length: usize,
    batch: Batch<T>,
    /// w_j.
    w: Vec<[T; 2]>,
    /// The spectrum of w̄, where the batch has its frequencies, over the batch's length.
    spectrum: Vec<[T; 2]>,
}

impl<T: Real> Chirp<T> {
    fn new(length: usize) -> Self {
        let mut long = 2 * length - 1;
        while radices(long).is_none() {
            long += 1;
        }
        // The angle is reduced exactly first.
        let turns = 2 * length as u128;
        let angle = |j: usize| -PI * ((j as u128).pow(2) % turns) as f64 / length as f64;
        let lanes = steradian_simd::run(Lanes::<f64>(PhantomData));
        let mut buffer = Vec::new();
        let x = aligned::<f64>(&mut buffer, 2 * lanes * long);
        for j in 0..length {
            let (sin, cos) = angle(j).sin_cos();
            for at in [j, (long - j) % long] {
                (x[2 * lanes * at], x[2 * lanes * at + lanes]) = (cos, -sin);
            }
        }
        Batch::<f64>::new(long).forward(x);
        let scale = 1.0 / long as f64;
        let spectrum = x.chunks_exact(2 * lanes).map(|x| [T::of(scale * x[0]), T::of(scale * x[lanes])]);
        let w = (0..length).map(|j| angle(j).sin_cos()).map(|(sin, cos)| [T::of(cos), T::of(sin)]);
        Self { length, w: w.collect(), spectrum: spectrum.collect(), batch: Batch::new(long) }
    }

    fn transform(&self, x: &mut [T]) {
        let lanes = x.len() / (2 * self.length);
        let mut buffer = Vec::new();
        let y = aligned(&mut buffer, 2 * lanes * self.spectrum.len());
        for ((y, x), w) in y.chunks_exact_mut(2 * lanes).zip(x.chunks_exact(2 * lanes)).zip(&self.w) {
            let (re, im) = y.split_at_mut(lanes);
            multiply(x, *w, re, im);
        }
        self.batch.forward(y);
        let mut z = vec![T::default(); 2 * lanes];
        for (y, s) in y.chunks_exact_mut(2 * lanes).zip(&self.spectrum) {
            z.copy_from_slice(y);
            let (im, re) = y.split_at_mut(lanes);
            multiply(&z, *s, re, im);
        }
        self.batch.backward(y);
        for ((y, x), w) in y.chunks_exact_mut(2 * lanes).zip(x.chunks_exact_mut(2 * lanes)).zip(&self.w) {
            y.rotate_left(lanes);
            let (re, im) = x.split_at_mut(lanes);
            multiply(y, *w, re, im);
        }
    }
}

/// Real parts and then imaginary parts of some lanes, times w.
fn multiply<T: Real>(x: &[T], w: [T; 2], re: &mut [T], im: &mut [T]) {
    let lanes = re.len();
    for i in 0..lanes {
        re[i] = x[i] * w[0] - x[lanes + i] * w[1];
        im[i] = x[i] * w[1] + x[lanes + i] * w[0];
    }
}

impl<T: Real> Stage<T> {
    fn new(radix: usize, part: usize) -> Self {
        let root = |j: usize, n: usize| (-2.0 * PI * (j % n) as f64 / n as f64).sin_cos();
        let length = radix * part;
        let mut twiddles = Vec::new();
        if part > 1 {
            for j in 0..part {
                twiddles.extend((1..radix).map(|q| {
                    let (sin, cos) = root(j * q, length);
                    [T::of(cos), T::of(sin)]
                }));
            }
        }
        let roots = std::array::from_fn(|j| {
            let (sin, cos) = root(j, radix);
            [T::of(cos), T::of(-sin)]
        });
        Self { radix, part, twiddles, roots }
    }
}

/// Factors of a length, eights and fours first; `None` for others than 2, 3, 5 and 7.
fn radices(length: usize) -> Option<Vec<usize>> {
    let mut radices = Vec::new();
    let mut rest = length;
    if rest == 0 {
        return None;
    }
    let twos = rest.trailing_zeros() as usize;
    rest >>= twos;
    let (eights, fours, pairs) = match (twos / 3, twos % 3) {
        (n, 0) => (n, 0, 0),
        (0, 1) => (0, 0, 1),
        (n, 1) => (n - 1, 2, 0),
        (n, _) => (n, 1, 0),
    };
    for (radix, count) in [(8, eights), (4, fours), (2, pairs)] {
        radices.extend(std::iter::repeat_n(radix, count));
    }
    for p in [7, 5, 3] {
        while rest.is_multiple_of(p) {
            radices.push(p);
            rest /= p;
        }
    }
    (rest == 1).then_some(radices)
}

/// In frequency (FORWARD: stages from the longest) or in time (from the shortest).
struct Transform<'a, T: Real, const FORWARD: bool> {
    batch: &'a Batch<T>,
    x: &'a mut [T],
}

impl<T: Real, const FORWARD: bool> Kernel for Transform<'_, T, FORWARD> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        let x = T::Vector::<A>::view(self.x).as_chunks_mut::<2>().0;
        let x = &mut x[..self.batch.length];
        let stages = &self.batch.stages[..];
        let size = 2 * T::Vector::<A>::LANES * size_of::<T>();
        let mut long = 0;
        while long < stages.len() && stages[long].radix * stages[long].part * size > CACHE {
            long += 1;
        }
        let (long, short) = stages.split_at(long);
        let part = if let Some(last) = long.last() { last.part } else { x.len() };
        if FORWARD {
            for stage in long {
                stage.pass::<T::Vector<A>, FORWARD>(x);
            }
        }
        for part in x.chunks_exact_mut(part) {
            for k in 0..short.len() {
                short[if FORWARD { k } else { short.len() - 1 - k }].pass::<T::Vector<A>, FORWARD>(part);
            }
        }
        if !FORWARD {
            for stage in long.iter().rev() {
                stage.pass::<T::Vector<A>, FORWARD>(x);
            }
        }
    }
}

impl<T: Real> Stage<T> {
    #[inline(always)]
    fn pass<V: Vector<T = T>, const FORWARD: bool>(&self, x: &mut [Pair<V>]) {
        match self.radix {
            2 => self.butterflies::<V, 2, FORWARD>(x),
            3 => self.butterflies::<V, 3, FORWARD>(x),
            4 => self.butterflies::<V, 4, FORWARD>(x),
            5 => self.butterflies::<V, 5, FORWARD>(x),
            7 => self.butterflies::<V, 7, FORWARD>(x),
            _ => self.butterflies::<V, 8, FORWARD>(x),
        }
    }

    #[inline(always)]
    #[expect(
        clippy::manual_memcpy,
        reason = "these are registers: a call that copies memory would spill them"
    )]
    fn butterflies<V: Vector<T = T>, const R: usize, const FORWARD: bool>(&self, x: &mut [Pair<V>]) {
        let part = self.part;
        for block in x.chunks_exact_mut(R * part) {
            if part == 1 {
                let mut y = [block[0]; R];
                for q in 1..R {
                    y[q] = block[q];
                }
                butterfly(&mut y, &self.roots);
                for q in 0..R {
                    block[q] = y[q];
                }
                continue;
            }
            for (j, w) in self.twiddles.chunks_exact(R - 1).enumerate() {
                let mut y = [block[j]; R];
                for q in 1..R {
                    let x = block[j + q * part];
                    y[q] = if FORWARD { x } else { times(x, w[q - 1]) };
                }
                butterfly(&mut y, &self.roots);
                block[j] = y[0];
                for q in 1..R {
                    block[j + q * part] = if FORWARD { times(y[q], w[q - 1]) } else { y[q] };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sh::fft::Complex;

    #[test]
    fn chirps_in_single_precision() {
        let lanes = steradian_simd::run(Lanes::<f32>(PhantomData));
        for n in [11, 97, 1022] {
            let (batch, mut buffer) = (Batch::<f32>::new(n), Vec::new());
            let x = aligned(&mut buffer, 2 * lanes * n);
            x.iter_mut().enumerate().for_each(|(i, x)| *x = ((i * i) as f32).sin());
            let before = x.to_vec();
            for _ in 0..2 {
                batch.forward(x);
                x.chunks_exact_mut(2 * lanes).for_each(|pair| pair.rotate_left(lanes));
            }
            for (a, b) in x.iter().zip(&before) {
                assert!((a / n as f32 - b).abs() < 4e-6, "{n}: {a} {b}");
            }
        }
    }

    #[test]
    fn spectra_are_sums_and_come_back() {
        let lanes = steradian_simd::run(Lanes::<f64>(PhantomData));
        for n in [1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 12, 13, 16, 22, 30, 49, 64, 97, 105, 128, 360, 1022, 1024] {
            let batch = Batch::<f64>::new(n);
            let mut buffer = Vec::new();
            let x = aligned(&mut buffer, 2 * lanes * n);
            x.iter_mut().enumerate().for_each(|(i, x)| *x = ((i * i) as f64).sin());
            let before = x.to_vec();
            batch.forward(x);
            let lane = |x: &[f64], i: usize| Complex::new(x[2 * lanes * i + 1], x[2 * lanes * i + lanes + 1]);
            for k in (0..n).step_by(1 + n / 7) {
                let sum = (0..n).fold(Complex::default(), |sum, j| {
                    let angle = -2.0 * PI * (j * k % n) as f64 / n as f64;
                    sum + lane(&before, j) * Complex::cis(angle)
                });
                let missed = sum + lane(x, batch.places()[k] as usize) * -1.0;
                assert!(missed.re.hypot(missed.im) < 1e-12 * n as f64, "{n} {k}");
            }
            let swap = |x: &mut [f64]| {
                for pair in x.chunks_exact_mut(2 * lanes) {
                    pair.rotate_left(lanes);
                }
            };
            swap(x);
            batch.backward(x);
            swap(x);
            for (a, b) in x.iter().zip(&before) {
                assert!((a / n as f64 - b).abs() < 1e-14 * n as f64, "{n}");
            }
        }
    }
}

//! Discrete Fourier transforms of complex sequences of any length, several at once.
//!
//! They are those that the harmonic transform makes of rings: a sequence in every lane of a register.

use super::transform::{Batch, Lanes, aligned};
use std::marker::PhantomData;
use std::ops::{Add, AddAssign, Mul};

/// A complex number.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Complex {
    /// Real part.
    pub re: f64,
    /// Imaginary part.
    pub im: f64,
}

impl Complex {
    /// From its parts.
    pub const fn new(re: f64, im: f64) -> Self {
        Self { re, im }
    }

    /// e^{i angle}.
    pub fn cis(angle: f64) -> Self {
        let (im, re) = angle.sin_cos();
        Self { re, im }
    }

    /// The conjugate.
    pub fn conj(self) -> Self {
        Self { im: -self.im, ..self }
    }
}

impl Add for Complex {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { re: self.re + o.re, im: self.im + o.im }
    }
}

impl AddAssign for Complex {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self { re: self.re * o.re - self.im * o.im, im: self.re * o.im + self.im * o.re }
    }
}

impl Mul<f64> for Complex {
    type Output = Self;
    fn mul(self, s: f64) -> Self {
        Self { re: self.re * s, im: self.im * s }
    }
}

/// A plan for sequences of one length.
pub struct Fft {
    length: usize,
    lanes: usize,
    batch: Batch<f64>,
}

impl Fft {
    /// For sequences of `length` numbers.
    pub fn new(length: usize) -> Self {
        Self { length, lanes: steradian_simd::run(Lanes::<f64>(PhantomData)), batch: Batch::new(length) }
    }

    /// Spectra Σ_j x_j e^{−2πi jk/length} of sequences that follow each other in `x`, in place. The buffer
    /// may hold anything.
    pub fn forward(&self, x: &mut [Complex], buffer: &mut Vec<f64>) {
        self.transform::<false>(x, buffer);
    }

    /// Sequences Σ_k x_k e^{2πi jk/length} of spectra that follow each other in `x`, in place: the inverse,
    /// times the length.
    pub fn inverse(&self, x: &mut [Complex], buffer: &mut Vec<f64>) {
        self.transform::<true>(x, buffer);
    }

    fn transform<const INVERSE: bool>(&self, x: &mut [Complex], buffer: &mut Vec<f64>) {
        let (n, lanes) = (self.length, self.lanes);
        if n == 0 {
            return;
        }
        let y = aligned(buffer, 2 * lanes * n);
        let places = self.batch.places();
        // Real and imaginary parts exchanged, on both ends, sums with e^{−…} are those with e^{+…}.
        let (re, im) = if INVERSE { (lanes, 0) } else { (0, lanes) };
        for x in x.chunks_mut(lanes * n) {
            if x.len() < lanes * n {
                y.fill(0.0);
            }
            for (lane, x) in x.chunks_exact(n).enumerate() {
                for (k, z) in x.iter().enumerate() {
                    let at = 2 * lanes * if INVERSE { places[k] as usize } else { k } + lane;
                    (y[at + re], y[at + im]) = (z.re, z.im);
                }
            }
            if INVERSE {
                self.batch.backward(y)
            } else {
                self.batch.forward(y)
            }
            for (lane, x) in x.chunks_exact_mut(n).enumerate() {
                for (k, z) in x.iter_mut().enumerate() {
                    let at = 2 * lanes * if INVERSE { k } else { places[k] as usize } + lane;
                    *z = Complex::new(y[at + re], y[at + im]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn transforms_are_sums() {
        steradian_testkit::on_every_isa(|| {
            for n in [1, 2, 6, 11, 16, 60, 121] {
                for count in [1, 3, 9] {
                    let before: Vec<Complex> = (0..n * count)
                        .map(|i| Complex::new((i * i) as f64 % 7.0, (3 * i) as f64 % 5.0))
                        .collect();
                    for sign in [-1.0, 1.0] {
                        let mut x = before.clone();
                        let mut buffer = vec![f64::NAN; 5];
                        let fft = Fft::new(n);
                        if sign < 0.0 {
                            fft.forward(&mut x, &mut buffer)
                        } else {
                            fft.inverse(&mut x, &mut buffer)
                        }
                        for (i, got) in x.iter().enumerate() {
                            let (first, k) = (i / n * n, i % n);
                            let of = |j: usize| {
                                before[first + j] * Complex::cis(sign * TAU * (j * k % n) as f64 / n as f64)
                            };
                            let sum = (0..n).map(of).fold(Complex::default(), Add::add);
                            let off = (sum.re - got.re).hypot(sum.im - got.im);
                            assert!(off < 1e-11, "{n} {count} {i}: {off}");
                        }
                    }
                }
            }
        });
    }
}

//! The exchange y ↔ z of SH coefficients: with it every rotation is made of turns about z, and lat-long
//! images (poles on y) meet the basis (poles on z).
//!
//! Trapani & Navaza 2006, Acta Cryst. A62, "Calculation of spherical harmonics and Wigner d functions by
//! FFT": Δ^l_mn = (−1)^{l−n} d^l_mn(π/2) by descent in m from Δ^l_ln = 2^−l √C(2l, l+n),
//!
//! > √((l−m)(l+m+1)) Δ_mn = 2n Δ_{m+1,n} − √((l−m−1)(l+m+2)) Δ_{m+2,n}.
//!
//! With σ_m = (−1)^⌈m/2⌉ for even l, (−1)^⌊m/2⌋ for odd l, and g_m = σ_m·(1 if m = 0, else √2), the matrix
//! X_ij = ∫ Y_i(x, y, z) Y_j(x, z, y) is g_m Δ_mn g_n between the cosine (c) and sine (s) terms
//!
//! > l+m, l+n even: c_m ↔ c_n;   even, odd: s_m ↔ c_n;   odd, even: c_m ↔ s_n;   odd, odd: s_m ↔ s_n,
//!
//! and zero elsewhere (derived from the parities in x, y and z; checked against quadrature). So a row with
//! l+m even reads and writes only c_n, one with l+m odd only s_n, and the parity of l+n picks the partner.

use super::basis::Scaled;
use std::f64::consts::SQRT_2;

const BIG: f64 = f64::from_bits((1023 + 800) << 52);
const SMALL: f64 = f64::from_bits((1023 - 800) << 52);
const LIMIT: f64 = f64::from_bits((1023 - 60) << 52);

/// Scratch of one band of `C` functions: rows of Δ, and coefficients split into cosines and sines, which
/// stand at index n with the two parities of n side by side.
pub(crate) struct Band<const C: usize> {
    rows: [Vec<f64>; 3],
    scale: Vec<i32>,
    input: [[Vec<f64>; 2]; C],
    output: [[Vec<f64>; 2]; C],
}

impl<const C: usize> Band<C> {
    pub(crate) fn new() -> Self {
        Self {
            rows: Default::default(),
            scale: Vec::new(),
            input: std::array::from_fn(|_| Default::default()),
            output: std::array::from_fn(|_| Default::default()),
        }
    }

    /// Exchanges y and z in band `l`; `band[c]` are its 2l+1 coefficients.
    pub(crate) fn exchange(&mut self, l: usize, band: &mut [&mut [f64]; C]) {
        self.load(l, band);
        steradian_simd::run(Sweep { l, band: self });
        self.store(l, band);
    }

    fn load(&mut self, l: usize, band: &[&mut [f64]; C]) {
        for (c, band) in band.iter().enumerate() {
            for v in self.input[c].iter_mut().chain(&mut self.output[c]) {
                v.clear();
                v.resize(l + 2, 0.0);
            }
            for m in 0..=l {
                let g = factor(l, m);
                self.input[c][0][m] = g * band[l + m];
                self.input[c][1][m] = if m > 0 { g * band[l - m] } else { 0.0 };
            }
        }
    }

    fn store(&self, l: usize, band: &mut [&mut [f64]; C]) {
        for (c, band) in band.iter_mut().enumerate() {
            for m in 0..=l {
                let g = factor(l, m);
                band[l + m] = g * self.output[c][0][m];
                if m > 0 {
                    band[l - m] = g * self.output[c][1][m];
                }
            }
        }
    }

    /// Row m = l of Δ, each entry with its own exponent.
    fn first_row(&mut self, l: usize) {
        for r in &mut self.rows {
            r.clear();
            r.resize(l + 2, 0.0);
        }
        self.scale.clear();
        self.scale.resize(l + 2, 0);
        let mut d = Scaled { v: 1.0, scale: 0 };
        // Δ_l0 = √((2l−1)!!/(2l)!!), then Δ_{l,n+1}/Δ_ln = √((l−n)/(l+n+1)).
        for k in 1..=l {
            d.v *= ((2 * k - 1) as f64 / (2 * k) as f64).sqrt();
        }
        for n in 0..=l {
            (self.rows[0][n], self.scale[n]) = (d.v, d.scale);
            d.v *= ((l - n) as f64 / (l + n + 1) as f64).sqrt();
            if d.v < SMALL * LIMIT && d.v > 0.0 {
                d = Scaled { v: d.v * BIG, scale: d.scale - 1 };
            }
        }
    }
}

/// g_m.
fn factor(l: usize, m: usize) -> f64 {
    let half = if l.is_multiple_of(2) { m.div_ceil(2) } else { m / 2 };
    let sign = if half.is_multiple_of(2) { 1.0 } else { -1.0 };
    if m == 0 { sign } else { sign * SQRT_2 }
}

/// The descent over the rows of Δ; each is used as it is made.
struct Sweep<'a, const C: usize> {
    l: usize,
    band: &'a mut Band<C>,
}

impl<const C: usize> steradian_simd::Kernel for Sweep<'_, C> {
    type Output = ();

    #[inline(always)]
    fn run<A: steradian_simd::Arch>(self) {
        let Self { l, band: b } = self;
        b.first_row(l);
        let mut active = b.scale[..=l].iter().take_while(|s| **s == 0).count();
        b.apply_row(l, l, active);
        let mut edge = 0.0;
        for m in (0..l).rev() {
            let root = (((l - m) * (l + m + 1)) as f64).sqrt();
            let [now, before, older] = &mut b.rows;
            next_row(2.0 / root, edge / root, &mut now[..=m], &before[..=m], &mut older[..=m]);
            edge = root;
            // The newest row moved from `older`'s place: rotate the names.
            b.rows.rotate_right(1);
            active = active.min(m + 1);
            if active <= m {
                active = rescale(&mut b.rows, &mut b.scale, active, m);
            }
            b.apply_row(l, m, active);
        }
    }
}

/// older ← a n now − b before.
#[inline(always)]
fn next_row(a: f64, b: f64, now: &mut [f64], before: &[f64], older: &mut [f64]) {
    for (n, ((o, p), q)) in older.iter_mut().zip(&*now).zip(before).enumerate() {
        *o = a * n as f64 * p - b * q;
    }
}

/// Brings entries from `active` up to the next exponent where they have grown, and returns the new number of
/// entries (from 0) that are plain numbers.
fn rescale(rows: &mut [Vec<f64>; 3], scale: &mut [i32], active: usize, m: usize) -> usize {
    for n in active..=m {
        if scale[n] < 0 && rows[0][n].abs() > LIMIT {
            rows[0][n] *= SMALL;
            rows[1][n] *= SMALL;
            scale[n] += 1;
        }
    }
    active + scale[active..=m].iter().take_while(|s| **s == 0).count()
}

impl<const C: usize> Band<C> {
    /// Row m of Δ, entries n < `active` ≤ m + 1, and by symmetry column m.
    #[inline(always)]
    fn apply_row(&mut self, l: usize, m: usize, active: usize) {
        let kind = (l + m) % 2;
        let full = active.min(m);
        let row = &self.rows[0];
        for c in 0..C {
            let mine = [self.input[c][0][m], self.input[c][1][m]];
            // Partner of entry n: cosine where l + n is even.
            let lanes = if l.is_multiple_of(2) { mine } else { [mine[1], mine[0]] };
            let (input, output) = (&self.input[c][kind], &mut self.output[c][kind]);
            let mut sum = row_product(&row[..full], &input[..full], &mut output[..full], lanes);
            if active > m {
                // The diagonal entry has no mirror image.
                sum[m % 2] += row[m] * input[m];
            }
            let [even, odd] = if l.is_multiple_of(2) { sum } else { [sum[1], sum[0]] };
            self.output[c][0][m] += even;
            self.output[c][1][m] += odd;
        }
    }
}

/// Sums row·input over even and odd n, and adds row·lanes to the output.
#[inline(always)]
fn row_product(row: &[f64], input: &[f64], output: &mut [f64], lanes: [f64; 2]) -> [f64; 2] {
    const N: usize = 16;
    let mut acc = [0.0; N];
    let whole = row.len() / N * N;
    let (r, i) = (row[..whole].chunks_exact(N), input[..whole].chunks_exact(N));
    for ((r, i), o) in r.zip(i).zip(output[..whole].chunks_exact_mut(N)) {
        for k in 0..N {
            acc[k] += r[k] * i[k];
            o[k] += r[k] * lanes[k % 2];
        }
    }
    for n in whole..row.len() {
        acc[n % 2] += row[n] * input[n];
        output[n] += row[n] * lanes[n % 2];
    }
    let mut sum = [0.0; 2];
    acc.iter().enumerate().for_each(|(k, a)| sum[k % 2] += a);
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sh::{count, eval};
    use glam::DVec3;

    /// Y(x, z, y) = X Y(x, y, z), at low and high bands.
    #[test]
    fn the_basis_itself_is_exchanged() {
        for (order, tolerance) in [(9, 1e-14), (64, 1e-12), (1100, 1e-10)] {
            let d = DVec3::new(0.61, -0.37, 0.52).normalize();
            let (mut y, mut swapped) = (vec![0.0; count(order)], vec![0.0; count(order)]);
            eval(order, d, &mut y);
            eval(order, DVec3::new(d.x, d.z, d.y), &mut swapped);
            let mut band = Band::<1>::new();
            for l in [0, 1, 2, 3, 4, 5, 8, 9, 33, 64, 1100] {
                if l > order {
                    break;
                }
                let mut v = y[l * l..(l + 1) * (l + 1)].to_vec();
                band.exchange(l, &mut [&mut v]);
                for (a, b) in v.iter().zip(&swapped[l * l..]) {
                    assert!((a - b).abs() < tolerance * 4.0, "l {l}: {a} {b}");
                }
            }
        }
    }

    #[test]
    fn twice_is_nothing_even_where_the_seeds_underflow() {
        let l = 3000;
        let v: Vec<f64> = (0..2 * l + 1).map(|i| ((i * i) as f64).sin()).collect();
        let mut w = v.clone();
        let mut band = Band::<1>::new();
        band.exchange(l, &mut [&mut w]);
        band.exchange(l, &mut [&mut w]);
        let worst = v.iter().zip(&w).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-9, "{worst}");
    }
}

//! The exchange y ↔ z of SH coefficients: with it every rotation is made of turns about z, and lat-long
//! images (poles on y) meet the basis (poles on z).
//!
//! Trapani & Navaza 2006, Acta Cryst. A62, "Calculation of spherical harmonics and Wigner d functions by
//! FFT": Δ^l_mn = (−1)^{l−n} d^l_mn(π/2) by descent in m from Δ^l_ln = 2^−l √C(2l, l+n),
//!
//! > r_m Δ_mn = 2n Δ_{m+1,n} − r_{m+1} Δ_{m+2,n},   r_m = √((l−m)(l+m+1)).
//!
//! Columns n do not meet in it: a few registers of them descend together, with their sums in registers too.
//! With Δ_mn = w_m p_mn, w_l = w_{l−1} = 1 and w_m = −w_{m+2} r_{m+1}/r_m it takes two operations,
//!
//! > p_mn = (2 w_{m+1}/(r_m w_m)) n p_{m+1,n} + p_{m+2,n},
//!
//! and w_m goes into the coefficients. p grows from far below f64 to where m² + n² ≤ l²: registers carry an
//! exponent until what they hold is not negligible.
//!
//! With σ_m = (−1)^⌈m/2⌉ for even l, (−1)^⌊m/2⌋ for odd l, and g_m = σ_m·(1 if m = 0, else √2), the matrix
//! X_ij = ∫ Y_i(x, y, z) Y_j(x, z, y) is g_m Δ_mn g_n between the cosine (c) and sine (s) terms
//!
//! > l+m, l+n even: c_m ↔ c_n;   even, odd: s_m ↔ c_n;   odd, even: c_m ↔ s_n;   odd, odd: s_m ↔ s_n,
//!
//! and zero elsewhere (derived from the parities in x, y and z; checked against quadrature). So a column with
//! l+n even reads only c_m, one with l+n odd only s_m, and rows with l+m even give c_n, others s_n.

mod columns;

use columns::{Columns, Row, seed};
use std::f64::consts::SQRT_2;
use steradian_simd::{Arch, Kernel, Vector};

/// Scratch of one band of `C` functions.
pub(crate) struct Band<const C: usize> {
    l: usize,
    /// g_m.
    factors: Vec<f64>,
    /// g_m w_m.
    weights: Vec<f64>,
    /// Rows m = l … 0, with the cosines and with the sines.
    rows: [Vec<Row<C>>; 2],
    columns: [Columns; 2],
}

impl<const C: usize> Band<C> {
    pub(crate) fn new() -> Self {
        Self {
            l: usize::MAX,
            factors: Vec::new(),
            weights: Vec::new(),
            rows: Default::default(),
            columns: Default::default(),
        }
    }

    /// Exchanges y and z in band `l`; `band[c]` are its 2l+1 coefficients.
    pub(crate) fn exchange(&mut self, l: usize, band: &mut [&mut [f64]; C]) {
        let stay = |_, c, s| (c, s);
        self.prepare(l);
        self.load(band, stay);
        steradian_simd::run(Sweep(self));
        self.store(band, stay);
    }

    /// A turn about z, an exchange, a turn, an exchange, and a turn of band `l`; turns take m, c_m and s_m.
    pub(crate) fn rotate<T: Fn(usize, f64, f64) -> (f64, f64)>(
        &mut self,
        l: usize,
        band: &mut [&mut [f64]; C],
        [first, second, third]: [T; 3],
    ) {
        self.prepare(l);
        self.load(band, first);
        steradian_simd::run(Sweep(self));
        for m in 0..=l {
            for c in 0..C {
                let [cos, sin] = self.sum(m, c);
                self.put(m, c, second(m, cos, sin));
            }
        }
        steradian_simd::run(Sweep(self));
        self.store(band, third);
    }

    fn load(&mut self, band: &[&mut [f64]; C], turn: impl Fn(usize, f64, f64) -> (f64, f64)) {
        let l = self.l;
        for c in 0..C {
            let (sines, cosines) = band[c][..2 * l + 1].split_at(l);
            self.put(0, c, (cosines[0], 0.0));
            for m in 1..=l {
                self.put(m, c, turn(m, cosines[m], sines[l - m]));
            }
        }
    }

    fn store(&self, band: &mut [&mut [f64]; C], turn: impl Fn(usize, f64, f64) -> (f64, f64)) {
        let l = self.l;
        for c in 0..C {
            let (sines, cosines) = band[c][..2 * l + 1].split_at_mut(l);
            cosines[0] = self.sum(0, c)[0];
            for m in 1..=l {
                let [cos, sin] = self.sum(m, c);
                (cosines[m], sines[l - m]) = turn(m, cos, sin);
            }
        }
    }

    #[inline(always)]
    fn put(&mut self, m: usize, c: usize, (cos, sin): (f64, f64)) {
        let w = self.weights[m];
        self.rows[0][self.l - m].values[c] = w * cos;
        self.rows[1][self.l - m].values[c] = w * sin;
    }

    /// Cosine and sine term of an exchanged function.
    #[inline(always)]
    fn sum(&self, n: usize, c: usize) -> [f64; 2] {
        let columns = &self.columns[(self.l + n) % 2];
        let at = 2 * c * columns.stride + n / 2;
        let g = self.factors[n];
        [g * columns.sums[at], if n > 0 { g * columns.sums[at + columns.stride] } else { 0.0 }]
    }

    /// All that depends on l only.
    fn prepare(&mut self, l: usize) {
        if self.l == l {
            return;
        }
        self.l = l;
        self.factors.clear();
        self.factors.extend((0..=l).map(|m| factor(l, m)));
        for rows in &mut self.rows {
            rows.clear();
            rows.resize(l + 1, Row { step: 0.0, values: [0.0; C] });
        }
        self.weights.clear();
        self.weights.resize(l + 1, 1.0);
        let mut edge = 0.0;
        for m in (0..l).rev() {
            let root = (((l - m) * (l + m + 1)) as f64).sqrt();
            if m + 2 <= l {
                self.weights[m] = -self.weights[m + 2] * edge / root;
            }
            let step = 2.0 * self.weights[m + 1] / (root * self.weights[m]);
            self.rows.iter_mut().for_each(|r| r[l - m - 1].step = step);
            edge = root;
        }
        self.weights.iter_mut().zip(&self.factors).for_each(|(w, g)| *w *= g);
        seed(l, C, &mut self.columns);
    }
}

/// g_m.
fn factor(l: usize, m: usize) -> f64 {
    let half = if l.is_multiple_of(2) { m.div_ceil(2) } else { m / 2 };
    let sign = if half.is_multiple_of(2) { 1.0 } else { -1.0 };
    if m == 0 { sign } else { sign * SQRT_2 }
}

/// The sums of all columns.
struct Sweep<'a, const C: usize>(&'a mut Band<C>);

impl<const C: usize> Kernel for Sweep<'_, C> {
    type Output = ();

    #[inline(always)]
    fn run<A: Arch>(self) {
        // As many columns at a time as the registers hold: sums, p, the last p and n.
        match (A::F64::REGISTERS >= 32, C > 1) {
            (true, true) => self.all::<A, 3>(),
            (true, false) => self.all::<A, 5>(),
            (false, true) => self.all::<A, 2>(),
            (false, false) => self.all::<A, 3>(),
        }
    }
}

impl<const C: usize> Sweep<'_, C> {
    #[inline(always)]
    fn all<A: Arch, const K: usize>(self) {
        for parity in 0..2 {
            let (rows, columns) = (&self.0.rows[parity][..], &mut self.0.columns[parity]);
            let lanes = A::F64::LANES;
            let mut at = 0;
            while at < columns.count {
                if at + K * lanes <= columns.stride {
                    columns.group::<A::F64, K, C>(at, rows);
                    at += K * lanes;
                } else {
                    columns.group::<A::F64, 1, C>(at, rows);
                    at += lanes;
                }
            }
        }
    }
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

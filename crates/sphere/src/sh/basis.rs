//! Point evaluation of the real orthonormal basis, stable to any band.

use super::count;
use glam::DVec3;
use std::sync::OnceLock;

/// Values below are kept as v·2^(800·s), s ≤ 0, so that sin^m θ never underflows (the idea of libsharp,
/// Reinecke & Seljebotn 2013, A&A 554 A112).
pub(super) const BIG: f64 = f64::from_bits((1023 + 800) << 52);
/// 2⁻⁸⁰⁰.
pub(super) const SMALL: f64 = f64::from_bits((1023 - 800) << 52);
/// A value above this, 2⁻⁶⁰, is moved to the next scale.
pub(super) const LIMIT: f64 = f64::from_bits((1023 - 60) << 52);

/// ε_lm = √((l² − m²)/(4l² − 1)), the coefficient of x P̄_l = ε_{l+1} P̄_{l+1} + ε_l P̄_{l−1}.
#[inline(always)]
pub fn epsilon(l: usize, m: usize) -> f64 {
    let (l2, m2) = ((l * l) as f64, (m * m) as f64);
    ((l2 - m2) / (4.0 * l2 - 1.0)).sqrt()
}

/// A number v·2^(800·scale).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scaled {
    pub(crate) v: f64,
    pub(crate) scale: i32,
}

impl Scaled {
    /// P̄_00 = √(1/4π), the start of [`Scaled::next_sectoral`].
    pub(crate) fn p00() -> Self {
        Self { v: (0.25 / std::f64::consts::PI).sqrt(), scale: 0 }
    }

    /// P̄_mm from P̄_{m−1,m−1}: times √((2m+1)/(2m)) sin θ.
    #[inline(always)]
    pub(crate) fn next_sectoral(mut self, m: usize, sin_theta: f64) -> Self {
        self.v *= ((2 * m + 1) as f64 / (2 * m) as f64).sqrt() * sin_theta;
        if self.v < SMALL * LIMIT && self.v != 0.0 {
            self.v *= BIG;
            self.scale -= 1;
        }
        self
    }

    /// The number itself, 0 where it is below f64.
    #[inline(always)]
    pub(crate) fn value(self) -> f64 {
        match self.scale {
            0 => self.v,
            -1 => self.v * SMALL,
            _ => 0.0,
        }
    }
}

/// The recursion's coefficients for all (l, m) up to an order, m-major.
pub struct Basis {
    order: usize,
    /// 1/ε_lm and ε_{l−1,m}/ε_lm for l = m+1…order, one column per m.
    ab: Vec<[f64; 2]>,
}

impl Basis {
    /// A table for [`Basis::eval`] up to `order`: 16 bytes per coefficient pair.
    pub fn new(order: usize) -> Self {
        let mut ab = Vec::with_capacity(order * (order + 1) / 2);
        for m in 0..=order {
            ab.extend((m + 1..=order).map(|l| coefficients(l, m)));
        }
        Self { order, ab }
    }

    /// Y_lm(d) for all l ≤ `order` ≤ the table's into `out[..count(order)]`.
    pub fn eval(&self, order: usize, d: DVec3, out: &mut [f64]) {
        assert!(order <= self.order, "the basis table ends below the order asked for");
        eval_with(order, d, out, |m| {
            let start = m * self.order - m * m.saturating_sub(1) / 2;
            let column = &self.ab[start..start + self.order - m];
            move |l: usize| column[l - m - 1]
        });
    }
}

/// (1/ε_lm, ε_{l−1,m}/ε_lm).
#[inline(always)]
fn coefficients(l: usize, m: usize) -> [f64; 2] {
    let e = epsilon(l, m).recip();
    let before = if l == m + 1 { 0.0 } else { epsilon(l - 1, m) };
    [e, before * e]
}

/// Orders up to this share one table.
const SHARED_ORDER: usize = 31;

/// Writes Y_lm(d) for all l ≤ order into `out[..count(order)]`; `d` is a unit vector (its length is divided
/// out; the zero vector counts as +Z).
///
/// Three-term recursion in l for each m, from the sectoral P̄_mm; values are held with an extended exponent,
/// so that no order underflows. Absolute error about ε l²/2·Y_lm within 1/l of the poles (where cos θ itself
/// limits it), less elsewhere.
pub fn eval(order: usize, d: DVec3, out: &mut [f64]) {
    static TABLE: OnceLock<Basis> = OnceLock::new();
    if order <= SHARED_ORDER {
        TABLE.get_or_init(|| Basis::new(SHARED_ORDER)).eval(order, d, out);
    } else {
        eval_with(order, d, out, |m| move |l| coefficients(l, m));
    }
}

#[inline(always)]
fn eval_with<C: Fn(usize) -> [f64; 2]>(order: usize, d: DVec3, out: &mut [f64], column: impl Fn(usize) -> C) {
    assert!(out.len() >= count(order), "room for all coefficients");
    let (cos_theta, sin_theta, cos_phi, sin_phi) = spherical(d);
    let (mut c, mut s) = (1.0, 0.0);
    let mut seed = Scaled::p00();
    for m in 0..=order {
        if m == 1 {
            (c, s) = (cos_phi * std::f64::consts::SQRT_2, sin_phi * std::f64::consts::SQRT_2);
        } else if m > 1 {
            (c, s) = (c * cos_phi - s * sin_phi, s * cos_phi + c * sin_phi);
        }
        if m > 0 {
            seed = seed.next_sectoral(m, sin_theta);
        }
        let ab = column(m);
        legendre_column(m, order, cos_theta, seed, &ab, |l, p| {
            let k = l * l + l;
            out[k + m] = p * c;
            if m > 0 {
                out[k - m] = p * s;
            }
        });
    }
}

/// cos θ, sin θ, cos φ, sin φ of a direction about +Z.
fn spherical(d: DVec3) -> (f64, f64, f64, f64) {
    // Not by `hypot`, which took 2 % of the conformance suite: squares of directions neither overflow nor
    // vanish.
    let (rho, r) = (d.truncate().length(), d.length());
    if r == 0.0 {
        return (1.0, 0.0, 1.0, 0.0);
    }
    let (c, s) = if rho > 0.0 { (d.x / rho, d.y / rho) } else { (1.0, 0.0) };
    (d.z / r, rho / r, c, s)
}

/// Hands P̄_lm for l = m…order to `put`.
#[inline(always)]
fn legendre_column(
    m: usize,
    order: usize,
    x: f64,
    seed: Scaled,
    ab: &impl Fn(usize) -> [f64; 2],
    mut put: impl FnMut(usize, f64),
) {
    let mut scale = seed.scale;
    let (mut before, mut p) = (0.0, seed.v);
    put(m, seed.value());
    let mut l = m + 1;
    while scale < 0 && l <= order {
        let [a, b] = ab(l);
        (before, p) = (p, a * x * p - b * before);
        if p.abs() > LIMIT {
            (before, p) = (before * SMALL, p * SMALL);
            scale += 1;
        }
        put(l, Scaled { v: p, scale }.value());
        l += 1;
    }
    while l <= order {
        let [a, b] = ab(l);
        (before, p) = (p, a * x * p - b * before);
        put(l, p);
        l += 1;
    }
}

/// P̄_lm(cos θ) for l = m…order (orthonormal: Y_lm = P̄_lm·{1, √2 cos mφ, √2 sin |m|φ}), without the
/// Condon–Shortley phase.
pub fn legendre(m: usize, order: usize, cos_theta: f64, sin_theta: f64) -> Vec<f64> {
    let mut seed = Scaled::p00();
    for k in 1..=m {
        seed = seed.next_sectoral(k, sin_theta);
    }
    let mut out = Vec::with_capacity((order + 1).saturating_sub(m));
    if m <= order {
        legendre_column(m, order, cos_theta, seed, &|l| coefficients(l, m), |_, p| out.push(p));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::gauss_legendre;
    use crate::sh::index;
    use std::f64::consts::PI;

    fn all(order: usize, d: DVec3) -> Vec<f64> {
        let mut y = vec![0.0; count(order)];
        eval(order, d, &mut y);
        y
    }

    /// Kautz's course notes (2006): the polynomials of the first bands.
    #[test]
    fn the_first_bands_are_kautzs_polynomials() {
        let d = DVec3::new(0.3, -0.5, 0.7).normalize();
        let y = all(2, d);
        let DVec3 { x, y: v, z } = d;
        let expected = [
            0.282095,
            0.488603 * v,
            0.488603 * z,
            0.488603 * x,
            1.092548 * x * v,
            1.092548 * v * z,
            0.315392 * (3.0 * z * z - 1.0),
            1.092548 * x * z,
            0.546274 * (x * x - v * v),
        ];
        for (a, b) in y.iter().zip(expected) {
            assert!((a - b).abs() < 2e-6, "{a} {b}");
        }
    }

    #[test]
    fn the_basis_is_orthonormal() {
        let order = 12;
        let (x, w) = gauss_legendre(order + 1);
        let n = 2 * order + 2;
        let k = count(order);
        let mut gram = vec![0.0; k * k];
        for (z, w) in x.iter().zip(&w) {
            for i in 0..n {
                let phi = 2.0 * PI * (i as f64 + 0.3) / n as f64;
                let r = (1.0 - z * z).sqrt();
                let y = all(order, DVec3::new(r * phi.cos(), r * phi.sin(), *z));
                for a in 0..k {
                    for b in 0..k {
                        gram[a * k + b] += w * 2.0 * PI / n as f64 * y[a] * y[b];
                    }
                }
            }
        }
        for a in 0..k {
            for b in 0..k {
                let delta = if a == b { 1.0 } else { 0.0 };
                assert!((gram[a * k + b] - delta).abs() < 1e-13);
            }
        }
    }

    /// Σ_m Y_lm(a) Y_lm(b) = (2l+1)/4π P_l(a·b), Unsöld's theorem at a = b.
    #[test]
    fn the_addition_theorem_holds_at_band_2047() {
        let l = 2047;
        for (a, b) in [
            (DVec3::new(0.1, 0.2, 0.9), DVec3::new(-0.7, 0.1, 0.3)),
            (DVec3::new(0.03, 2e-2, 1.0), DVec3::new(-0.04, -1e-2, 1.0)),
            (DVec3::new(0.6, 0.2, 1e-4), DVec3::new(0.6, 0.2, 1e-4)),
        ] {
            let (a, b) = (a.normalize(), b.normalize());
            let (ya, yb) = (all(l, a), all(l, b));
            let band = index(l, -(l as isize))..count(l);
            let sum: f64 = ya[band.clone()].iter().zip(&yb[band]).map(|(p, q)| p * q).sum();
            let x = a.dot(b).min(1.0);
            let pl =
                legendre(0, l, x, (1.0 - x * x).max(0.0).sqrt())[l] / ((2 * l + 1) as f64 / 4.0 / PI).sqrt();
            let norm = (2 * l + 1) as f64 / 4.0 / PI;
            assert!((sum / norm - pl).abs() < 1e-10, "{} {pl}", sum / norm);
            assert!(ya.iter().all(|v| v.is_finite()));
        }
    }

    /// P̄_mm = √((2m+1)!!/(4π (2m)!!)) sin^m θ, by logarithms.
    #[test]
    fn sectoral_terms_do_not_underflow_early() {
        let (m, theta) = (2047, 1.2_f64);
        let mut log = 0.5 * (0.25 / PI).ln() + m as f64 * theta.sin().ln();
        for k in 1..=m {
            log += 0.5 * ((2 * k + 1) as f64 / (2 * k) as f64).ln();
        }
        let p = legendre(m, m, theta.cos(), theta.sin())[0];
        assert!((p.ln() - log).abs() < 1e-10, "{} {log}", p.ln());
        // Deep below f64 at l = m, of order one at l = 2047: the scale comes back.
        let p = legendre(300, 2047, (0.3_f64).cos(), (0.3_f64).sin());
        assert!(p[0].abs() < 1e-150 && p[1747].abs() > 1e-3, "{:?}", (p[0], p[1747]));
    }

    #[test]
    fn poles_and_the_zero_vector_are_finite() {
        for d in [DVec3::Z, -DVec3::Z, DVec3::ZERO] {
            let y = all(40, d);
            assert!(y.iter().all(|v| v.is_finite()));
            assert!(y[index(40, 3)] == 0.0 && y[index(40, 0)] > 2.0);
        }
    }

    #[test]
    fn table_and_direct_recursion_agree() {
        let d = DVec3::new(0.3, -0.5, 0.7).normalize();
        let mut t = vec![0.0; count(50)];
        Basis::new(60).eval(50, d, &mut t);
        assert_eq!(t, all(50, d));
        assert_eq!(all(20, d), t[..count(20)]);
    }
}

//! Koenderink, van Doorn & Stavridi 1996, Bidirectional Reflection Distribution Function Expressed in Terms
//! of Surface Scattering Modes: products of Zernike polynomials on both hemispheres, for isotropic reciprocal
//! reflectance.
//!
//! With ϱ = √2 sin(θ/2), which maps the hemisphere to the unit disk with equal areas, R_n^l Zernike's radial
//! polynomials, n ≥ m ≥ l ≥ 0, n − l and m − l even:
//!
//! **H_nml = 1/2π √((n+1)(m+1)/q) (R_n^l(ϱ_i) R_m^l(ϱ_o) + R_m^l(ϱ_i) R_n^l(ϱ_o)) cos l(φ_o − φ_i)**,
//!
//! q = 4 where n = m and l = 0, 2 where n = m or l = 0, else 1: orthonormal over both hemispheres.

use glam::DVec3;
use std::sync::LazyLock;

/// The highest n: "order 8".
pub(super) const ORDER: usize = 8;
/// Modes up to it.
pub(super) const MODES: usize = 55;
/// Radial polynomials up to it.
const RADIAL: usize = 25;

/// One mode.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mode {
    pub n: usize,
    pub m: usize,
    l: usize,
    /// Indices of the radial polynomials.
    radial: [usize; 2],
    pub factor: f64,
}

struct Table {
    /// (n, l), and the coefficients of ϱ^l, ϱ^{l+2}, …
    radial: Vec<(usize, Vec<f64>)>,
    modes: Vec<Mode>,
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let keys: Vec<(usize, usize)> =
        (0..=ORDER).flat_map(|l| (l..=ORDER).step_by(2).map(move |n| (n, l))).collect();
    let mut modes = Vec::with_capacity(MODES);
    for (a, &(n, l)) in keys.iter().enumerate() {
        for (b, &(m, _)) in keys.iter().enumerate().filter(|(_, k)| k.1 == l && k.0 <= n) {
            let q = match (n == m, l == 0) {
                (true, true) => 4.0,
                (false, false) => 1.0,
                _ => 2.0,
            };
            let factor = (((n + 1) * (m + 1)) as f64 / q).sqrt() / (2.0 * std::f64::consts::PI);
            modes.push(Mode { n, m, l, radial: [a, b], factor });
        }
    }
    Table { radial: keys.into_iter().map(|(n, l)| (l, polynomial(n, l))).collect(), modes }
});

/// R_n^l = Σ_s (−1)^s (n−s)!/(s! ((n+l)/2−s)! ((n−l)/2−s)!) ϱ^{n−2s}, lowest power first.
fn polynomial(n: usize, l: usize) -> Vec<f64> {
    let factorial = |k: usize| (1..=k).map(|x| x as f64).product::<f64>();
    let term = |s: usize| {
        let sign = if s.is_multiple_of(2) { 1.0 } else { -1.0 };
        sign * factorial(n - s) / (factorial(s) * factorial((n + l) / 2 - s) * factorial((n - l) / 2 - s))
    };
    (0..=(n - l) / 2).rev().map(term).collect()
}

/// All R_n^l at one direction of the local frame.
fn radial(w: DVec3) -> [f64; RADIAL] {
    // ϱ² = 2 sin²(θ/2) = 1 − cos θ.
    let square = (1.0 - w.z).clamp(0.0, 1.0);
    let rho = square.sqrt();
    let mut out = [0.0; RADIAL];
    for (out, (l, c)) in out.iter_mut().zip(&TABLE.radial) {
        *out = c.iter().rev().fold(0.0, |sum, c| sum * square + c) * rho.powi(*l as i32);
    }
    out
}

/// The modes, in the order of [`values`].
pub(super) fn modes() -> &'static [Mode] {
    &TABLE.modes
}

/// H_nml(wi, wo) for every mode.
pub(super) fn values(wi: DVec3, wo: DVec3) -> [f64; MODES] {
    let (a, b) = (radial(wi), radial(wo));
    let size = (wi.x.hypot(wi.y) * wo.x.hypot(wo.y)).max(f64::MIN_POSITIVE);
    let cosine = ((wi.x * wo.x + wi.y * wo.y) / size).clamp(-1.0, 1.0);
    let mut cosines = [1.0; ORDER + 1];
    cosines[1] = cosine;
    for l in 2..=ORDER {
        cosines[l] = 2.0 * cosine * cosines[l - 1] - cosines[l - 2];
    }
    let mut out = [0.0; MODES];
    for (out, mode) in out.iter_mut().zip(modes()) {
        let [n, m] = mode.radial;
        *out = mode.factor * (a[n] * b[m] + a[m] * b[n]) * cosines[mode.l];
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;
    use steradian_sphere::quadrature::gauss_legendre;

    #[test]
    fn there_are_55_and_they_are_orthonormal() {
        assert_eq!((modes().len(), TABLE.radial.len()), (MODES, RADIAL));
        let (x, w) = gauss_legendre(18);
        let mut gram = vec![[0.0; MODES]; MODES];
        // In z = 1 − ϱ² the integrands are polynomials for every even sum of powers.
        let direction = |z: f64, phi: f64| {
            let s = (1.0 - z * z).sqrt();
            DVec3::new(s * phi.cos(), s * phi.sin(), z)
        };
        for (a, wa) in x.iter().zip(&w) {
            for (b, wb) in x.iter().zip(&w) {
                for k in 0..18 {
                    let wi = direction(0.5 + 0.5 * a, 0.3);
                    let h = values(wi, direction(0.5 + 0.5 * b, 0.3 + 2.0 * PI * f64::from(k) / 18.0));
                    let weight = 0.25 * wa * wb * 4.0 * PI * PI / 18.0;
                    for i in 0..MODES {
                        (0..MODES).for_each(|j| gram[i][j] += weight * h[i] * h[j]);
                    }
                }
            }
        }
        for i in 0..MODES {
            for j in 0..MODES {
                let want = if i == j { 1.0 } else { 0.0 };
                assert!((gram[i][j] - want).abs() < 1e-10, "{i} {j} {}", gram[i][j]);
            }
        }
    }

    #[test]
    fn known_polynomials() {
        assert_eq!(polynomial(0, 0), [1.0]);
        assert_eq!(polynomial(2, 0), [-1.0, 2.0]);
        assert_eq!(polynomial(3, 1), [-2.0, 3.0]);
        assert_eq!(polynomial(4, 0), [1.0, -6.0, 6.0]);
    }
}

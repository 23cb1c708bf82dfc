//! The window: its values, their polynomials, its spectrum.

use crate::quadrature::gauss_legendre;
use crate::sh::transform::Real;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Samples an axis of the widest window.
pub(super) const WIDEST: usize = 16;

/// β of the window at twofold density.
fn beta(w: usize) -> f64 {
    2.3 * w as f64
}

/// The window at a distance of u samples.
fn window<const W: usize>(u: f64) -> f64 {
    let z = 2.0 * u / W as f64;
    (beta(W) * ((1.0 - z * z).max(0.0).sqrt() - 1.0)).exp()
}

/// The window's Fourier transform, as a sum over nodes: u, and weights times the window there.
pub(super) struct WindowSpectrum(Vec<[f64; 2]>);

impl WindowSpectrum {
    /// u = W/2 sin s makes the integrand smooth.
    pub(super) fn new<const W: usize>() -> Self {
        let (x, w) = gauss_legendre(32 + 2 * W);
        let half = 0.5 * W as f64;
        let node = |(x, w): (&f64, &f64)| {
            let (sin, cos) = (FRAC_PI_4 * (1.0 + x)).sin_cos();
            [half * sin, w * FRAC_PI_2 * half * cos * (beta(W) * (cos - 1.0)).exp()]
        };
        Self(x.iter().zip(&w).map(node).collect())
    }

    /// ∫ window(u) cos 2πfu du at f cycles a sample.
    pub(super) fn at(&self, f: f64) -> f64 {
        self.0.iter().map(|[u, w]| w * (2.0 * PI * f * u).cos()).sum()
    }
}

/// Polynomials in 2t − 1 of the weights of the W samples about a place t beyond the middle ones, highest
/// power first, by Newton's interpolation at the nodes of Chebyshev; 0 for those beyond W.
pub(super) fn polynomials<T: Real, const W: usize>() -> Vec<[T; WIDEST]> {
    // More coefficients gain nothing: the window's edge, where its slope is infinite, sets what is left.
    let n = if W < 8 { W + 2 } else { W + 1 };
    let mut out = vec![[T::default(); WIDEST]; n];
    for c in 0..W {
        let nodes: Vec<f64> = (0..n).map(|k| (PI * (k as f64 + 0.5) / n as f64).cos()).collect();
        // Newton's divided differences, then powers.
        let mut d: Vec<f64> =
            nodes.iter().map(|s| window::<W>(c as f64 - (W / 2) as f64 + 1.0 - 0.5 * (s + 1.0))).collect();
        for level in 1..n {
            for k in (level..n).rev() {
                d[k] = (d[k] - d[k - 1]) / (nodes[k] - nodes[k - level]);
            }
        }
        let mut powers = vec![0.0; n];
        for k in (0..n).rev() {
            for p in (0..n).rev() {
                powers[p] = if p > 0 { powers[p - 1] } else { 0.0 } - nodes[k] * powers[p];
            }
            powers[0] += d[k];
        }
        for (p, v) in powers.iter().enumerate() {
            out[n - 1 - p][c] = T::of(*v);
        }
    }
    out
}

//! The split-sum tables of GGX.
//!
//! Karis 2013, Real Shading in Unreal Engine 4: with Schlick's F = f0 + (1 − f0)(1 − u)⁵,
//! ∫ f n·wi dwi = f0 A + B, A = ∫ (D G₂/4 n·wo)(1 − (1 − u)⁵) dwi, B = ∫ (D G₂/4 n·wo)(1 − u)⁵ dwi.
//!
//! Here by quadrature over half vectors: dwi = 4 (wo·h) dh, and with tan θ_h = α t, D cos θ_h dθ_h-measure
//! turns into q = t²/(1 + t²) ∈ (0, 1) of constant density. At polar angle θ_h the light is above the horizon
//! for cos φ_h > −cot θ_o cot 2θ_h, so both integrals have closed limits and a smooth integrand between.

pub mod charlie;
mod lut;
mod multiscatter;
mod ring;
pub mod text;

pub use lut::{Layout, Lut};
pub use multiscatter::{average_albedo, average_fresnel, kulla_conty, kulla_conty_fresnel};

use crate::math::pow5;
use ring::{NODES, Ring, Rule, rule};
use std::f64::consts::{FRAC_PI_2, PI};
use steradian_parallel::prelude::*;

/// The two factors of the split sum: albedo = f0 · `scale` + `bias`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dfg {
    /// A: multiplies f0.
    pub scale: f64,
    /// B: added.
    pub bias: f64,
}

/// A and B of isotropic GGX with height-correlated Smith masking at cosine `mu` = n·wo (0 … 1) and width
/// `alpha` (1e-4 … 1); absolute error below 1e-6.
pub fn ggx(mu: f64, alpha: f64) -> Dfg {
    let mu = mu.clamp(1e-6, 1.0);
    // θ_h at which the horizon begins to cut the circle of h, and at which it has cut all of it.
    let above = 0.5 * mu.asin();
    let end = 0.5 * (FRAC_PI_2 + mu.acos());
    let mut sum = Dfg { scale: 0.0, bias: 0.0 };
    let scale = alpha.min(1.0);
    let mut cuts = vec![0.0, above, end];
    cuts.extend([0.5 * scale, scale, 3.0 * scale, 10.0 * scale, 0.25 * above].iter().map(|t| t.atan()));
    cuts.extend([0.5 * (above + end), above + 0.1 * (end - above)]);
    cuts.retain(|t| *t <= end);
    cuts.sort_by(f64::total_cmp);
    let rule = rule();
    for w in cuts.windows(2) {
        for (theta, step) in rule.panel(w[0], w[1]) {
            add(&mut sum, rule, theta, step, mu, alpha);
        }
    }
    sum
}

/// Adds `step` times the ring of half vectors at θ_h.
fn add(sum: &mut Dfg, rule: &Rule, theta: f64, step: f64, mu: f64, alpha: f64) {
    let ring = Ring::new(theta, mu);
    let (s, c, a2) = (ring.sin, ring.cos, alpha * alpha);
    // D, and √(α² sin² + cos²) of both directions in Smith's G₂.
    let d = a2 / (PI * (s * s + a2 * c * c).powi(2));
    let length = |z: f64| (a2 + (1.0 - a2) * z * z).sqrt();
    let so = length(mu);
    let (mut value, mut fresnel) = ([0.0; NODES], [0.0; NODES]);
    let cosines = ring.cosines(rule);
    for k in 0..NODES {
        let (u, z) = ring.reflected(cosines[k]);
        let (u, z) = (u.max(0.0), z.max(0.0));
        value[k] = rule.weights[k] * z * u / (length(z) * mu + so * z);
        fresnel[k] = pow5((1.0 - u).max(0.0));
    }
    // dwi = 4 u dh, both halves of the ring.
    let all = d * 2.0 * s * step * ring.end;
    for k in 0..NODES {
        sum.scale += all * value[k] * (1.0 - fresnel[k]);
        sum.bias += all * value[k] * fresnel[k];
    }
}

/// A and B over n·wo and perceptual roughness.
#[derive(Debug, Clone, PartialEq)]
pub struct DfgTable {
    /// Texels per side.
    pub size: usize,
    /// Row-major `[scale, bias]`: column i at n·wo = (i + ½)/size, row j at perceptual roughness
    /// (j + ½)/size, alpha its square.
    pub values: Vec<[f32; 2]>,
}

impl DfgTable {
    /// The table of GGX; sizes of 64 … 256 are common.
    pub fn ggx(size: usize) -> Self {
        let at = |k: usize| (k as f64 + 0.5) / size as f64;
        let texel = |k: usize| {
            let roughness = at(k / size);
            let d = ggx(at(k % size), (roughness * roughness).max(1e-4));
            [d.scale as f32, d.bias as f32]
        };
        Self { size, values: (0..size * size).into_par_iter().map(texel).collect() }
    }

    /// Bilinear lookup at n·wo and perceptual roughness, both clamped to the outermost texel centres.
    pub fn lookup(&self, mu: f64, perceptual_roughness: f64) -> Dfg {
        let (i, x) = Self::split_at(self.size, mu);
        let (j, y) = Self::split_at(self.size, perceptual_roughness);
        let last = self.size.saturating_sub(1);
        let at = |i: usize, j: usize| {
            self.values.get(j.min(last) * self.size + i.min(last)).copied().unwrap_or([0.0; 2])
        };
        let mix = |c: usize| {
            let row = |j: usize| f64::from(at(i, j)[c]) * (1.0 - x) + f64::from(at(i + 1, j)[c]) * x;
            row(j) * (1.0 - y) + row(j + 1) * y
        };
        Dfg { scale: mix(0), bias: mix(1) }
    }

    /// Index of the texel below `v` (0 … 1) in a row of `size`, and the distance from it in texels.
    fn split_at(size: usize, v: f64) -> (usize, f64) {
        let x = (v * size as f64 - 0.5).clamp(0.0, size.saturating_sub(1) as f64);
        (x as usize, x.fract())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{albedo, parse};
    use glam::DVec3;

    #[test]
    fn agrees_with_adaptive_quadrature() {
        for alpha in [0.01, 0.1, 0.5, 1.0] {
            let white = parse(&format!("ggx:alpha={alpha},f0=1")).expect("spec");
            let black = parse(&format!("ggx:alpha={alpha},f0=0")).expect("spec");
            for mu in [0.02, 0.1, 0.5, 0.9, 1.0f64] {
                let wo = DVec3::new((1.0 - mu * mu).sqrt(), 0.0, mu);
                let d = ggx(mu, alpha);
                let all = albedo::directional(&*white, wo, 1e-8)[0];
                let bias = albedo::directional(&*black, wo, 1e-8)[0];
                let (e1, e2) = (d.scale + d.bias - all, d.bias - bias);
                assert!(e1.abs() < 1e-6 && e2.abs() < 1e-6, "alpha {alpha} mu {mu}: {e1:e} {e2:e}");
            }
        }
    }

    #[test]
    fn limits() {
        let mirror = ggx(0.7, 1e-4);
        let f = 0.3f64.powi(5);
        assert!((mirror.bias - f).abs() < 1e-6 && (mirror.scale - (1.0 - f)).abs() < 1e-6, "{mirror:?}");
        let t = DfgTable::ggx(16);
        let texel = t.lookup(5.5 / 16.0, 7.5 / 16.0);
        let exact = ggx(5.5 / 16.0, (7.5f64 / 16.0).powi(2));
        assert!((texel.scale - exact.scale).abs() < 1e-6 && (texel.bias - exact.bias).abs() < 1e-6);
    }
}

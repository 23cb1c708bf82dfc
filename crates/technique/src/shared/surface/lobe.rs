//! A point's own lobe: its width, and the normals under the point as lookups along several of them.
//!
//! Schilling (1997), *Towards Real-Time Photorealistic Rendering*, and Kautz's course notes (2006): the
//! covariance of the normals under a texel widens the footprint of the lookup. A normal that tilts by δ (in
//! the tangent plane, along the plane of incidence and across it) turns r = 2(n·wo)n − wo by 2δ_∥ and
//! 2(n·wo)δ_⊥, so
//!
//! > C = J Σ Jᵀ,  J = diag(2, 2 n·wo)
//!
//! is the covariance of r. With its eigenvalues λ₁ ≥ λ₂ and the unit eigenvector e₁, C = λ₂ I + (λ₁ − λ₂)
//! e₁e₁ᵀ: the round part joins the lobe, alpha'² = alpha² + λ₂/2 (a lobe of alpha spreads r by 2 alpha² per
//! axis, since slopes of variance alpha²/2 turn r twice as far), and the rest are taps on normals n + x
//! J⁻¹e₁, Gaussian in x. Taps lie no further apart than 1.5 lobes, which a Gaussian sum does not show; where
//! 17 of them do not suffice, the lobe is widened until they do, as graphics hardware limits its anisotropy.
//!
//! `lobe.wgsl` has the same functions.

use crate::shared::maths::vector::{cross, dot, normalized};
use crate::{PointLobe, Points, Radiance};

/// The functions in WGSL.
pub const WGSL: &str = include_str!("lobe.wgsl");

/// Extent of the taps, in standard deviations.
const REACH: f32 = 2.4;
/// Largest distance of taps in widths of the lobe.
const STEP: f32 = 1.5;
/// Least n·wo of a normal that is used for a lookup.
pub const GRAZING: f32 = 0.01;

/// A point to be shaded with a lobe of its own.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Mean normal.
    pub n: [f32; 3],
    /// Tangent.
    pub t: [f32; 3],
    /// To the viewer.
    pub wo: [f32; 3],
    /// n·wo in (0, 1].
    pub cos_o: f32,
    /// The lobe.
    pub lobe: PointLobe,
}

/// Lookups of a point: their normals, and the width of each.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Taps {
    /// One standard deviation of the normals that taps spread over.
    pub axis: [f32; 3],
    /// Taps on each side of the mean: 0, 2, 4 or 8.
    pub side: i32,
    /// alpha of each lookup.
    pub alpha: f32,
}

/// One lookup.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tap {
    /// Normal.
    pub n: [f32; 3],
    /// Mirror direction of wo, computed with n·wo clamped to at least [`GRAZING`].
    pub r: [f32; 3],
    /// n·wo, clamped to at least [`GRAZING`].
    pub cos_o: f32,
    /// Share of the result.
    pub weight: f32,
}

/// alpha of the point: its own or the material's.
#[inline(always)]
pub fn alpha_of(lobe: &PointLobe, own: f32) -> f32 {
    if lobe.alpha >= 0.0 { lobe.alpha } else { own }
}

impl Taps {
    /// The taps of a point whose material has width `own`; `finest` is the width of the sharpest map there
    /// is.
    #[inline(always)]
    pub fn new(q: &Point, own: f32, finest: f32) -> Self {
        let alpha = alpha_of(&q.lobe, own);
        let round = (alpha * alpha + q.lobe.widen).max(q.lobe.least * q.lobe.least);
        let [tt, tb, bb] = q.lobe.spread;
        if tt + bb <= 0.0 {
            return Self { axis: [0.0; 3], side: 0, alpha: round.sqrt() };
        }
        // The plane of incidence: p along it, s across, both in the tangent plane.
        let b = cross(q.n, q.t);
        let across: [f32; 3] = std::array::from_fn(|k| q.wo[k] - q.cos_o * q.n[k]);
        let length = dot(across, across).sqrt();
        let (c, s) =
            if length > 1e-4 { (dot(across, q.t) / length, dot(across, b) / length) } else { (1.0, 0.0) };
        let cos_o = q.cos_o.max(GRAZING);
        // Σ in the frame (p, s), then J Σ Jᵀ.
        let pp = c * c * tt + 2.0 * c * s * tb + s * s * bb;
        let ps = (c * c - s * s) * tb + c * s * (bb - tt);
        let ss = s * s * tt - 2.0 * c * s * tb + c * c * bb;
        let (a, h, d) = (4.0 * pp, 4.0 * cos_o * ps, 4.0 * cos_o * cos_o * ss);
        let (mean, half) = (0.5 * (a + d), 0.5 * (a - d));
        let radius = (half * half + h * h).sqrt();
        let (large, small) = (mean + radius, (mean - radius).max(0.0));
        // 8 taps a side reach as far as they may: lobe ≥ REACH/(8·STEP) √(λ₁ − λ₂).
        let limit = (REACH / (8.0 * STEP)) * (REACH / (8.0 * STEP));
        let sharpest = round.max(finest * finest);
        let small = small.max((limit * large - sharpest) / (0.5 + limit)).min(large);
        let rest = large - small;
        let alpha2 = round + 0.5 * small;
        let ratio = rest / alpha2.max(finest * finest);
        if ratio < 0.02 {
            return Self { axis: [0.0; 3], side: 0, alpha: (alpha2 + 0.25 * rest).sqrt() };
        }
        let reach = |side: f32| (side * STEP / REACH) * (side * STEP / REACH);
        let side = if ratio <= reach(2.0) {
            2
        } else if ratio <= reach(4.0) {
            4
        } else {
            8
        };
        // e₁ = (cos ψ, sin ψ), tan 2ψ = h/half, without the angle.
        let e = if half >= 0.0 { [radius + half, h] } else { [h, radius - half] };
        let scale = (rest / (e[0] * e[0] + e[1] * e[1]).max(1e-30)).sqrt();
        let (x, y) = (0.5 * scale * e[0], 0.5 * scale * e[1] / cos_o);
        let (u, v) = (x * c - y * s, x * s + y * c);
        Self { axis: std::array::from_fn(|k| u * q.t[k] + v * b[k]), side, alpha: alpha2.sqrt() }
    }

    /// Tap `k` of −side … side. Spacings are scaled so that the taps have the variance of the Gaussian.
    #[inline(always)]
    pub fn tap(&self, q: &Point, k: i32) -> Tap {
        if self.side == 0 {
            return tap(q, q.n, 1.0);
        }
        let (norm, stretch) = match self.side {
            2 => (0.479_438_33, 1.009_052_2),
            4 => (0.240_841_3, 1.027_569_9),
            _ => (0.120_950_19, 1.041_765_2),
        };
        let x = k as f32 * (REACH / self.side as f32);
        let weight = norm * (-0.5 * x * x).exp();
        let n = std::array::from_fn(|c| q.n[c] + stretch * x * self.axis[c]);
        tap(q, normalized(n), weight)
    }

    /// Σ weight f(tap).
    #[inline(always)]
    pub fn sum(&self, q: &Point, f: impl Fn(&Tap) -> [f32; 3]) -> [f32; 3] {
        let mut sum = [0.0; 3];
        for k in -self.side..=self.side {
            let tap = self.tap(q, k);
            let l = f(&tap);
            (0..3).for_each(|c| sum[c] += tap.weight * l[c]);
        }
        sum
    }
}

#[inline(always)]
fn tap(q: &Point, n: [f32; 3], weight: f32) -> Tap {
    let cos_o = dot(n, q.wo).clamp(GRAZING, 1.0);
    Tap { n, r: std::array::from_fn(|k| 2.0 * cos_o * n[k] - q.wo[k]), cos_o, weight }
}

/// Four normals with the mean and the covariance of the normals under the point, for functions that vary
/// slowly: n ± √2 times the columns of a root of Σ.
#[inline(always)]
pub fn normals(q: &Point) -> [[f32; 3]; 4] {
    let [tt, tb, bb] = q.lobe.spread;
    // Cholesky's root of 2Σ.
    let l11 = (2.0 * tt.max(0.0)).sqrt();
    let l21 = if l11 > 0.0 { 2.0 * tb / l11 } else { 0.0 };
    let l22 = (2.0 * bb - l21 * l21).max(0.0).sqrt();
    let b = cross(q.n, q.t);
    let at = |x: f32, y: f32| normalized(std::array::from_fn(|k| q.n[k] + x * q.t[k] + y * b[k]));
    [at(l11, l21), at(-l11, -l21), at(0.0, l22), at(0.0, -l22)]
}

/// Writes `f` of every point that faces the viewer, and 0 for all other points; `q` must have lobes.
#[inline]
pub fn shade(q: &Points<'_>, out: &mut Radiance<'_>, f: impl Fn(&Point) -> [f32; 3]) {
    steradian_simd::dispatch(|| {
        for i in 0..out.len() {
            let at = |v: &[&[f32]; 3]| v.map(|s| s[i]);
            let (n, t, wo) = (at(&q.n), at(&q.t), at(&q.wo));
            let d = dot(n, wo);
            let lobe = PointLobe::from_array(q.lobe.map(|s| s[i]));
            // False for NaN too.
            let l = if d > 0.0 { f(&Point { n, t, wo, cos_o: d.min(1.0), lobe }) } else { [0.0; 3] };
            (0..3).for_each(|c| out.rgb[c][i] = l[c]);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(theta: f32, phi: f32, spread: [f32; 3]) -> Point {
        let wo = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
        let lobe = PointLobe { spread, ..PointLobe::PLAIN };
        Point { n: [0.0, 0.0, 1.0], t: [1.0, 0.0, 0.0], wo, cos_o: theta.cos(), lobe }
    }

    /// The covariance of r over the taps, plus the lobe's own, is J Σ Jᵀ plus the material's.
    #[test]
    fn taps_and_lobe_have_the_covariance_of_the_reflection() {
        let spread = [4e-4, 1e-4, 1e-4];
        for (theta, phi) in [(0.0, 0.0), (0.6, 0.3), (1.2, 2.0), (1.4, 4.0)] {
            let q = point(theta, phi, spread);
            let taps = Taps::new(&q, 0.02, 0.0);
            let mean = tap(&q, q.n, 1.0).r;
            let mut total = 0.0;
            let mut got = 0.0;
            for k in -taps.side..=taps.side {
                let tap = taps.tap(&q, k);
                total += tap.weight;
                got += tap.weight * (0..3).map(|c| (tap.r[c] - mean[c]).powi(2)).sum::<f32>();
            }
            assert!((total - 1.0).abs() < 1e-5, "{total}");
            let (s, c) = phi.sin_cos();
            let pp = c * c * spread[0] + 2.0 * c * s * spread[1] + s * s * spread[2];
            let ss = s * s * spread[0] - 2.0 * c * s * spread[1] + c * c * spread[2];
            // The trace: taps along one axis, the lobe's increase along two.
            let want = 4.0 * pp + 4.0 * theta.cos().powi(2) * ss;
            let have = got + 2.0 * 2.0 * (taps.alpha * taps.alpha - 0.02 * 0.02);
            assert!((have / want - 1.0).abs() < 0.02, "{theta} {phi}: {have} {want}");
        }
    }

    #[test]
    fn one_normal_is_one_tap_of_the_own_width() {
        let q = point(0.5, 1.0, [0.0; 3]);
        assert_eq!(Taps::new(&q, 0.3, 0.01), Taps { axis: [0.0; 3], side: 0, alpha: 0.3 });
        let mut q = q;
        q.lobe = PointLobe { alpha: 0.1, widen: 0.03, least: 0.05, ..PointLobe::PLAIN };
        assert!((Taps::new(&q, 0.3, 0.01).alpha - 0.2).abs() < 1e-6);
        q.lobe.least = 0.7;
        assert!((Taps::new(&q, 0.3, 0.01).alpha - 0.7).abs() < 1e-6);
        assert_eq!(normals(&q), [[0.0, 0.0, 1.0]; 4]);
    }

    #[test]
    fn no_lookup_is_wider_apart_than_its_lobe() {
        for spread in [[0.2, 0.0, 0.0], [0.01, 0.01, 0.01], [1e-5, 0.0, 0.3], [0.5, -0.2, 0.4]] {
            for theta in [0.0, 0.8, 1.5, 1.57] {
                let q = point(theta, 0.9, spread);
                let taps = Taps::new(&q, 0.001, 0.004);
                let r = |k| taps.tap(&q, k).r;
                assert!(taps.alpha.is_finite() && taps.axis.iter().all(|x| x.is_finite()));
                if taps.side > 0 && theta < 0.9 {
                    let gap = (0..3).map(|c| (r(1)[c] - r(0)[c]).powi(2)).sum::<f32>().sqrt();
                    assert!(gap < 1.7 * taps.alpha.max(0.004), "{theta} {spread:?}: {gap} {}", taps.alpha);
                }
            }
        }
    }

    /// E[nₓ²] of four normals is Σ to first order.
    #[test]
    fn four_normals_have_the_second_moments() {
        let spread = [2e-3, -5e-4, 1e-3];
        let n = normals(&point(0.3, 0.0, spread));
        let mean = |f: &dyn Fn([f32; 3]) -> f32| n.iter().map(|n| f(*n)).sum::<f32>() / 4.0;
        for (got, want) in [
            (mean(&|n| n[0] * n[0]), spread[0]),
            (mean(&|n| n[0] * n[1]), spread[1]),
            (mean(&|n| n[1] * n[1]), spread[2]),
        ] {
            assert!((got - want).abs() < 2e-5, "{got} {want}");
        }
    }
}

//! Zonal functions: kernels of convolutions and lobes about an axis.
//!
//! For a kernel K(x), x = cos θ, k_l = 2π ∫ K(x) P_l(x) dx. Convolution multiplies band l by k_l
//! (Funk–Hecke; [`ShRgb::convolve`]); the kernel itself about unit direction a has coefficients
//! k_l Y_lm(a) ([`lobe`]), since K(a·d) = Σ (2l+1)/4π k_l P_l(a·d).

use super::{ShRgb, count, eval};
use crate::quadrature::gauss_legendre;
use glam::DVec3;
use std::f64::consts::PI;

/// k_l of the clamped cosine max(0, x), l = 0…order: π, 2π/3, π/4, 0, −π/24, 0, π/64, … (Ramamoorthi &
/// Hanrahan 2001, "An efficient representation for irradiance environment maps", eq. 8).
pub fn cosine(order: usize) -> Vec<f64> {
    (0..=order)
        .map(|l| match l {
            0 => PI,
            1 => 2.0 * PI / 3.0,
            l if l % 2 == 1 => 0.0,
            l => {
                // l!/(2^l (l/2)!²) as a product; sign (−1)^{l/2−1}.
                let ratio: f64 = (1..=l / 2).map(|k| (2 * k - 1) as f64 / (2 * k) as f64).product();
                let sign = if (l / 2) % 2 == 1 { 1.0 } else { -1.0 };
                sign * 2.0 * PI * ratio / ((l + 2) * (l - 1)) as f64
            }
        })
        .collect()
}

/// k_l of max(0, x)^n for real n > −1, not normalised: 2π I_l with I_0 = 1/(n+1), I_1 = 1/(n+2) and
/// I_l = I_{l−2} (n−l+2)/(n+l+1) (from Legendre's recursion by parts). Divide by `k[0]` for unit integral.
/// n = 1 is [`cosine`].
pub fn phong(order: usize, n: f64) -> Vec<f64> {
    let mut k = vec![2.0 * PI / (n + 1.0), 2.0 * PI / (n + 2.0)];
    for l in 2..=order {
        let lf = l as f64;
        k.push(k[l - 2] * (n - lf + 2.0) / (n + lf + 1.0));
    }
    k.truncate(order + 1);
    k
}

/// k_l = exp(−l(l+1)t) of the heat kernel at time t ≥ 0: unit integral, and k(s)·k(t) = k(s+t). Its width is
/// about √(2t) radians per axis.
pub fn heat(order: usize, t: f64) -> Vec<f64> {
    (0..=order).map(|l| (-((l * (l + 1)) as f64) * t).exp()).collect()
}

/// k_l of the spherical Gaussian exp(λ(x − 1)), not normalised: 4π e^−λ i_l(λ), with i_l the modified
/// spherical Bessel functions; by Miller's downward recursion i_{l−1} = i_{l+1} + (2l+1)/λ i_l.
pub fn gaussian(order: usize, lambda: f64) -> Vec<f64> {
    let k0 = if lambda > 1e-8 { 2.0 * PI * -(-2.0 * lambda).exp_m1() / lambda } else { 4.0 * PI };
    let mut k = vec![0.0; order + 1];
    k[0] = k0;
    if lambda <= 0.0 {
        return k;
    }
    // Ratios r_l = i_l/i_{l−1} = 1/((2l+1)/λ + r_{l+1}), from far above where they vanish.
    let far = order + 40 + (10.0 * lambda.sqrt()) as usize;
    let mut ratio = 0.0;
    let mut ratios = vec![0.0; order + 1];
    for l in (1..=far).rev() {
        ratio = 1.0 / ((2 * l + 1) as f64 / lambda + ratio);
        if l <= order {
            ratios[l] = ratio;
        }
    }
    for l in 1..=order {
        k[l] = k[l - 1] * ratios[l];
    }
    k
}

/// k_l of the cone that is 1 within `radius` radians of its axis and 0 outside:
/// 2π(1 − c) and 2π (P_{l−1}(c) − P_{l+1}(c))/(2l+1) with c = cos radius.
///
/// The difference of Legendre polynomials is summed from its own recursion in 1 − c, so small disks keep
/// their relative accuracy.
pub fn disk(order: usize, radius: f64) -> Vec<f64> {
    let half = (0.5 * radius).sin();
    let t = 2.0 * half * half;
    let mut k = vec![2.0 * PI * t];
    // (2l+1) ∫_c^1 P_l = P_{l−1} − P_{l+1} = −(d_l + d_{l+1}), d_l = P_l − P_{l−1}.
    let (mut p, mut d) = (1.0, 0.0);
    let mut difference = |l: usize| {
        // d_{l+1} = (l d_l − (2l+1) t P_l)/(l+1).
        d = (l as f64 * d - (2 * l + 1) as f64 * t * p) / (l + 1) as f64;
        p += d;
        d
    };
    let mut before = difference(0);
    for l in 1..=order {
        let next = difference(l);
        k.push(-2.0 * PI * (before + next) / (2 * l + 1) as f64);
        before = next;
    }
    k
}

/// k_l of any kernel, by composite Gauss–Legendre quadrature between the `breaks` (ascending, from −1 to 1;
/// e.g. `[-1.0, 0.0, 1.0]` for a kernel with an edge at the horizon) with `nodes` nodes per interval; exact
/// where K is a polynomial of degree below 2·nodes − order on each interval.
pub fn numeric(order: usize, kernel: impl Fn(f64) -> f64, breaks: &[f64], nodes: usize) -> Vec<f64> {
    let (x, w) = gauss_legendre(nodes);
    let mut k = vec![0.0; order + 1];
    for ab in breaks.windows(2) {
        let (middle, half) = (0.5 * (ab[0] + ab[1]), 0.5 * (ab[1] - ab[0]));
        for (x, w) in x.iter().zip(&w) {
            let x = middle + half * x;
            let v = 2.0 * PI * half * w * kernel(x);
            let (mut before, mut p) = (0.0, 1.0);
            for (l, k) in k.iter_mut().enumerate() {
                *k += v * p;
                let lf = l as f64;
                (before, p) = (p, ((2.0 * lf + 1.0) * x * p - lf * before) / (lf + 1.0));
            }
        }
    }
    k
}

/// The kernel's value at x = cos θ from its coefficients: Σ (2l+1)/4π k_l P_l(x).
pub fn value(k: &[f64], x: f64) -> f64 {
    let (mut before, mut p, mut sum) = (0.0, 1.0, 0.0);
    for (l, k) in k.iter().enumerate() {
        let lf = l as f64;
        sum += (2.0 * lf + 1.0) / (4.0 * PI) * k * p;
        (before, p) = (p, ((2.0 * lf + 1.0) * x * p - lf * before) / (lf + 1.0));
    }
    sum
}

/// Coefficients of the kernel about unit direction `axis`: k_l Y_lm(axis); order `k.len() − 1`.
pub fn lobe(k: &[f64], axis: DVec3) -> Vec<f64> {
    let Some(order) = k.len().checked_sub(1) else { return Vec::new() };
    let mut c = vec![0.0; count(order)];
    eval(order, axis, &mut c);
    for (l, k) in k.iter().enumerate() {
        c[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|c| *c *= k);
    }
    c
}

impl ShRgb {
    /// Adds the kernel `k` about `axis`, times `rgb`: a disk light's radiance with [`disk`], a directional
    /// light's irradiance with k_l = 1. Bands above this one's order are left out.
    pub fn add_lobe(&mut self, k: &[f64], axis: DVec3, rgb: [f64; 3]) {
        let lobe = lobe(&k[..k.len().min(self.order + 1)], axis);
        for (c, v) in self.c.iter_mut().zip(rgb) {
            c.iter_mut().zip(&lobe).for_each(|(c, l)| *c += v * l);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: &[f64], b: &[f64], tolerance: f64) {
        assert_eq!(a.len(), b.len());
        for (l, (a, b)) in a.iter().zip(b).enumerate() {
            assert!((a - b).abs() < tolerance, "{l}: {a} {b}");
        }
    }

    #[test]
    fn the_clamped_cosine_has_its_published_coefficients() {
        let e = [1.0, 2.0 / 3.0, 0.25, 0.0, -1.0 / 24.0, 0.0, 1.0 / 64.0].map(|x| x * PI);
        close(&cosine(6), &e, 1e-15);
        close(&cosine(40), &phong(40, 1.0), 1e-15);
        close(&cosine(40), &numeric(40, |x| x.max(0.0), &[-1.0, 0.0, 1.0], 30), 1e-14);
    }

    #[test]
    fn kernels_agree_with_quadrature() {
        close(&phong(30, 17.5), &numeric(30, |x| x.max(0.0).powf(17.5), &[-1.0, 0.0, 1.0], 60), 1e-13);
        close(&gaussian(30, 12.0), &numeric(30, |x| (12.0 * (x - 1.0)).exp(), &[-1.0, 1.0], 60), 1e-13);
        close(
            &gaussian(50, 900.0),
            &numeric(50, |x| (900.0 * (x - 1.0)).exp(), &[-1.0, 0.9, 1.0], 100),
            1e-13,
        );
        let c = 0.3_f64.cos();
        close(&disk(50, 0.3), &numeric(50, |x| f64::from(x > c), &[-1.0, c, 1.0], 60), 1e-13);
        assert_eq!(phong(0, 2.0).len(), 1);
        assert_eq!(gaussian(3, 0.0), [4.0 * PI, 0.0, 0.0, 0.0]);
    }

    /// For a half-degree sun k_l ≈ Ω (1 − l(l+1) ρ²/8): relative accuracy survives.
    #[test]
    fn a_small_disk_keeps_its_relative_accuracy() {
        let rho = 1e-4_f64;
        let k = disk(10, rho);
        let omega = PI * rho * rho * (1.0 - rho * rho / 12.0);
        for (l, k) in k.iter().enumerate() {
            let e = 1.0 - (l * (l + 1)) as f64 * rho * rho / 8.0;
            assert!((k / omega / e - 1.0).abs() < 1e-11, "{l} {}", k / omega / e - 1.0);
        }
        close(&disk(5, PI), &[4.0 * PI, 0.0, 0.0, 0.0, 0.0, 0.0], 1e-14);
    }

    #[test]
    fn the_heat_kernel_is_a_semigroup_and_lobes_sum_up() {
        for (l, k) in heat(9, 0.05).iter().enumerate() {
            assert!((heat(9, 0.02)[l] * heat(9, 0.03)[l] - k).abs() < 1e-15);
        }
        let k = gaussian(40, 10.0);
        let (a, d) = (DVec3::new(0.4, -0.3, 0.6).normalize(), DVec3::new(-0.1, 0.5, 0.6).normalize());
        assert!((value(&k, a.dot(d)) - (10.0 * (a.dot(d) - 1.0)).exp()).abs() < 1e-12);
        let mut sh = ShRgb::zero(40);
        sh.add_lobe(&k, a, [1.0, 2.0, 0.0]);
        let v = sh.value(d);
        assert!((v[0] - value(&k, a.dot(d))).abs() < 1e-13 && (v[1] - 2.0 * v[0]).abs() < 1e-13);
    }

    /// A directional light through the 9-term irradiance: p(x) = 1/4 + x/2 + (5/32)(3x² − 1).
    #[test]
    fn nine_terms_of_a_directional_light() {
        let k = cosine(2);
        for x in [1.0_f64, 0.0, -1.0, -8.0 / 15.0, 0.4] {
            assert!((value(&k, x) - (0.25 + 0.5 * x + 5.0 / 32.0 * (3.0 * x * x - 1.0))).abs() < 1e-15);
        }
    }
}

//! Lower bounds of band-limited functions from samples.
//!
//! Let P(x·y) be a non-negative polynomial of degree D with ∫P = 1 and P_l its Legendre factors, and h the
//! function with h_l = f_l/P_l. Then f = h ∗ P, and where a quadrature with positive weights is exact up to
//! order + D, f(x) = Σ_j w_j h(x_j) P(x·x_j) with Σ_j w_j P(x·x_j) = 1: an average, so f ≥ min_j h(x_j)
//! everywhere.
//!
//! The less P smooths, the less h differs from f. Of the non-negative polynomials of degree 2n the one with
//! the largest P_1 is the square of p_{n+1}(x)/(x − z), p_{n+1} Legendre's and z its largest zero, and P_1 =
//! z: by the Gauss rule on the zeros ∫ x q² / ∫ q² is an average of them (Szegő 1939, Orthogonal Polynomials,
//! 7.72). About 1 − P_l = l² (1.7/n)².

use crate::quadrature::gauss_legendre;
use crate::sh::transform::{Grid, ShTransform};
use crate::sh::{ShRgb, legendre};
use glam::DVec3;
use std::f64::consts::PI;

/// Half the degree of P over the order, where memory allows.
const FINENESS: usize = 4;

/// The least half of the degree.
const LEAST: usize = 220;

/// Samples of a channel, about, at most.
const SAMPLES: usize = 4 << 20;

/// A grid for functions of an order.
pub(super) struct Proof {
    plan: ShTransform,
    width: usize,
    height: usize,
    cos: Vec<f64>,
    /// 1/P_l.
    pub(super) sharpen: Vec<f64>,
}

impl Proof {
    pub(super) fn new(order: usize) -> Self {
        // Rows times columns are about (order + 2 n)²/2.
        let most = (((2 * SAMPLES) as f64).sqrt() as usize).saturating_sub(order) / 2;
        let n = (FINENESS * order).max(LEAST).min(most.max(order));
        let degree = order + 2 * n;
        let (width, height) = (smooth(degree + 1), degree / 2 + 1);
        let sharpen = kernel(n, order).into_iter().map(f64::recip).collect();
        Self::on(order, width, height, sharpen)
    }

    fn on(order: usize, width: usize, height: usize, sharpen: Vec<f64>) -> Self {
        let plan = ShTransform::new(order, width, height, Grid::GaussLegendre);
        let cos = plan.cos_theta();
        Self { plan, width, height, cos, sharpen }
    }

    /// h of each channel, after factors per band.
    pub(super) fn samples(&self, polar: &ShRgb, factors: &[&[f64]; 3]) -> [Vec<f64>; 3] {
        let mut sharp = polar.clone();
        for (c, factors) in sharp.c.iter_mut().zip(factors) {
            for l in 0..=polar.order {
                let w = factors[l] * self.sharpen[l];
                c[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|c| *c *= w);
            }
        }
        let mut planes = std::array::from_fn(|_| vec![0.0; self.width * self.height]);
        self.plan.synthesize_polar(&sharp, planes.each_mut().map(Vec::as_mut_slice));
        planes
    }

    /// What rounding may have changed in samples.
    pub(super) fn margin(&self, samples: &[f64]) -> f64 {
        let peak = samples.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        1e-14 * (10 + self.sharpen.len()) as f64 * peak
    }

    /// What no value of the function is below.
    pub(super) fn bound(&self, samples: &[f64]) -> f64 {
        samples.iter().fold(f64::INFINITY, |m, x| m.min(*x)) - self.margin(samples)
    }

    /// The direction of the largest sample.
    pub(super) fn peak(&self, samples: &[f64]) -> DVec3 {
        let at = (0..samples.len()).fold(0, |m, i| if samples[i] > samples[m] { i } else { m });
        let (j, i) = (at / self.width, at % self.width);
        // The centre of the samples about it.
        let mut sum = DVec3::ZERO;
        for j in j.saturating_sub(2)..(j + 3).min(self.height) {
            for i in i + self.width - 2..i + self.width + 3 {
                let i = i % self.width;
                sum += samples[j * self.width + i].max(0.0) * self.direction(j, i);
            }
        }
        sum.try_normalize().unwrap_or(DVec3::Y)
    }

    fn direction(&self, j: usize, i: usize) -> DVec3 {
        let phi = -PI + 2.0 * PI * (i as f64 + 0.5) / self.width as f64;
        let (y, r) = (self.cos[j], ((1.0 - self.cos[j]) * (1.0 + self.cos[j])).sqrt());
        DVec3::new(r * phi.cos(), y, r * phi.sin())
    }

    /// Directions of negative samples that are lowest among their neighbours: the `count` lowest, and the
    /// lowest in each of as many rings about an axis, as ringing about a sun has them.
    pub(super) fn lows(&self, samples: &[f64], axis: DVec3, count: usize) -> Vec<DVec3> {
        let (width, height) = (self.width, self.height);
        let mut lows = Vec::new();
        for j in 0..height {
            let row = &samples[j * width..(j + 1) * width];
            let above = &samples[j.saturating_sub(1) * width..][..width];
            let below = &samples[(j + 1).min(height - 1) * width..][..width];
            let (mut before, mut x) = (row[width - 1], row[0]);
            for i in 0..width {
                let after = row[if i + 1 < width { i + 1 } else { 0 }];
                if x < 0.0 && x <= before && x <= after && x <= above[i] && x <= below[i] {
                    lows.push((x, j, i));
                }
                (before, x) = (x, after);
            }
        }
        lows.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        let (mut rings, mut chosen) = (vec![false; count], Vec::new());
        for (k, (_, j, i)) in lows.into_iter().enumerate() {
            let d = self.direction(j, i);
            let ring = (d.dot(axis).clamp(-1.0, 1.0).acos() / PI * count as f64) as usize;
            let first = !std::mem::replace(&mut rings[ring.min(count - 1)], true);
            if k < count || first {
                chosen.push(d);
            }
        }
        chosen
    }
}

/// P_0 … P_order of the kernel of degree 2n.
fn kernel(n: usize, order: usize) -> Vec<f64> {
    let (zeros, _) = gauss_legendre(n + 1);
    let z = zeros[n];
    // Christoffel and Darboux: p_{n+1}(x)/(x − z) is Σ (2l+1) P_l(z) P_l(x) up to a factor.
    let q: Vec<f64> = orthonormal(n, z);
    let (x, w) = gauss_legendre(n + 1 + order.div_ceil(2));
    let mut sums = vec![0.0; order + 1];
    for (x, w) in x.iter().zip(&w) {
        let p = orthonormal(n.max(order), *x);
        let value: f64 = q.iter().zip(&p).map(|(a, b)| a * b).sum();
        let weight = w * value * value;
        sums.iter_mut().zip(&p).for_each(|(s, p)| *s += weight * p);
    }
    let first = sums[0];
    sums.iter().enumerate().map(|(l, s)| s / (first * ((2 * l + 1) as f64).sqrt())).collect()
}

/// √((2l+1)/4π) P_l(x).
fn orthonormal(n: usize, x: f64) -> Vec<f64> {
    legendre(0, n, x, ((1.0 - x) * (1.0 + x)).sqrt())
}

/// The smallest number from `n` without prime factors above 5.
fn smooth(n: usize) -> usize {
    let is_smooth = |mut n: usize| {
        for p in [2, 3, 5] {
            while n.is_multiple_of(p) {
                n /= p;
            }
        }
        n == 1
    };
    (n..).find(|n| is_smooth(*n)).unwrap_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernel_is_not_negative_and_its_first_factor_is_the_largest_zero() {
        for n in [1, 5, 40] {
            let p = kernel(n, 2 * n + 3);
            assert!((p[0] - 1.0).abs() < 1e-14 && (p[1] - gauss_legendre(n + 1).0[n]).abs() < 1e-13);
            assert!(p[..=2 * n].iter().all(|p| *p > 0.0) && p[2 * n + 1..].iter().all(|p| p.abs() < 1e-13));
            for i in 0..=1000 {
                let values = orthonormal(2 * n, f64::from(i) / 500.0 - 1.0);
                let sum: f64 = p
                    .iter()
                    .zip(&values)
                    .enumerate()
                    .map(|(l, (p, v))| p * v * ((2 * l + 1) as f64).sqrt())
                    .sum();
                assert!(sum > -1e-12 * (n * n) as f64, "{n} {i}: {sum:e}");
            }
        }
    }

    /// The grid's average by the kernel is the function: at points that are not of the grid.
    #[test]
    fn the_function_is_an_average_of_samples() {
        let order = 3;
        let (n, mut sh) = (4, ShRgb::zero(order));
        sh.c[0].iter_mut().enumerate().for_each(|(i, c)| *c = (i as f64 * 1.3).cos());
        let p = kernel(n, 2 * n);
        let degree = order + 2 * n;
        let proof = Proof::on(order, degree + 1, degree / 2 + 1, p.iter().map(|p| p.recip()).collect());
        let h = &proof.samples(&sh, &[&[1.0; 4]; 3])[0];
        let (cos, weights) = (&proof.cos, gauss_legendre(proof.height).1);
        for d in crate::quadrature::fibonacci(20).directions {
            let mut average = 0.0;
            for (j, row) in h.chunks_exact(proof.width).enumerate() {
                for (i, h) in row.iter().enumerate() {
                    let phi = -PI + 2.0 * PI * (i as f64 + 0.5) / proof.width as f64;
                    let r = (1.0 - cos[j] * cos[j]).sqrt();
                    let x = d.dot(DVec3::new(r * phi.cos(), cos[j], r * phi.sin()));
                    let k: f64 = orthonormal(2 * n, x.clamp(-1.0, 1.0))
                        .iter()
                        .zip(&p)
                        .enumerate()
                        .map(|(l, (y, p))| y * p * ((2 * l + 1) as f64 / (4.0 * PI)).sqrt())
                        .sum();
                    average += weights[j] * 2.0 * PI / proof.width as f64 * h * k;
                }
            }
            let value = sh.value(DVec3::new(d.x, d.z, d.y))[0];
            assert!((average - value).abs() < 1e-12, "{average} {value}");
        }
    }
}

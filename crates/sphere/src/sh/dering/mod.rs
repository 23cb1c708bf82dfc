//! Non-negative light: the smallest change per band after which a band-limited function is nowhere below zero, proved.
//!
//! Sloan 2008, Stupid Spherical Harmonics Tricks, and 2017, Deringing Spherical Harmonics, take one window of a fixed
//! form, at most to band 2, and look for its width. Here every band has a factor of its own, to any order: of all
//! factors 1 − δ_l that make f_δ = Σ (1 − δ_l) f_l non-negative by the proof below, those with the least
//! ∫ (f_δ − f)² = Σ P_l δ_l², P_l = Σ_m f_lm². Constraints Σ δ_l f_l(x) ≤ f(x) are linear in as many numbers as there
//! are bands, so this is a quadratic program; δ = 1 leaves the mean, so it has a solution where the mean is positive.
//! Constraints join it where the last solution is lowest. Factors per band turn with the function.
//!
//! The proof needs samples only ([`proof`]): f is the average of a sharper function by a non-negative kernel, and
//! a quadrature with positive weights is exact for that average, so that f is nowhere below the sharper function's
//! least sample. What the last solution still misses is made up for by moving all factors towards the mean: little up to
//! order 64, but where light itself with a sun is deringed at order 255 the search may end before the least change.

mod program;
mod proof;
#[cfg(test)]
mod tests;

use super::rotation::exchange_yz;
use super::{Basis, ShRgb, count};
use glam::DVec3;
use program::{Constraint, Program};
use proof::Proof;
use rayon::prelude::*;
use std::f64::consts::PI;

/// How often lowest points join the constraints.
const ROUNDS: usize = 40;

/// What need not be made up for by more constraints, relative to the mean.
const UNSURE: f64 = 1e-3;

/// What [`ShRgb::dering`] did, by channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Dering {
    /// Factor of each band.
    pub factors: [Vec<f64>; 3],
    /// Root mean square of the change of the function over its root mean square.
    pub change: [f64; 3],
    /// A proved lower bound of the function: not below zero, but where its mean is not positive.
    pub minimum: [f64; 3],
}

impl ShRgb {
    /// Multiplies bands by the factors nearest to 1 (see the module) after which Σ k_l c_lm Y_lm is nowhere negative,
    /// channel by channel: with k_l of the clamped cosine ([`super::zonal::cosine`]) the irradiance, with ones the
    /// function itself. Bands where k_l is 0 get the mean of their neighbours' factors. A channel whose mean is not
    /// positive stays.
    pub fn dering(&mut self, k: &[f64]) -> Dering {
        let f = Function::new(self, k);
        let (factors, minimum) = f.factors();
        let change = std::array::from_fn(|c| f.change(c, &factors[c]));
        for (c, factors) in self.c.iter_mut().zip(&factors) {
            for (l, w) in factors.iter().enumerate() {
                c[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|c| *c *= w);
            }
        }
        Dering { factors, change, minimum }
    }

    /// A proved lower bound of each channel, close to the minimum.
    pub fn lower_bound(&self) -> [f64; 3] {
        let ones = vec![1.0; self.order + 1];
        let f = Function::new(self, &ones);
        let proof = Proof::new(self.order);
        let samples = proof.samples(&f.polar, &[&ones, &ones, &ones]);
        samples.each_ref().map(|s| proof.bound(s))
    }
}

/// k_l c_lm.
struct Function {
    /// About the pole y: coefficients of Y(x, z, y).
    polar: ShRgb,
    /// P_l of each channel.
    power: [Vec<f64>; 3],
    mean: [f64; 3],
}

impl Function {
    fn new(sh: &ShRgb, k: &[f64]) -> Self {
        let mut polar = sh.clone();
        polar.convolve(k);
        exchange_yz(sh.order, polar.c.each_mut().map(Vec::as_mut_slice));
        let band = |c: &[f64], l: usize| c[l * l..(l + 1) * (l + 1)].iter().map(|c| c * c).sum();
        let power = polar.c.each_ref().map(|c| (0..=sh.order).map(|l| band(c, l)).collect());
        let mean = polar.c.each_ref().map(|c| c[0] / (4.0 * PI).sqrt());
        Self { polar, power, mean }
    }

    /// The factors, and the lower bounds that are proved of the result.
    fn factors(&self) -> ([Vec<f64>; 3], [f64; 3]) {
        let order = self.polar.order;
        let proof = Proof::new(order);
        let basis = Basis::new(order);
        let mut programs: [_; 3] = std::array::from_fn(|c| Program::new(order, self.mean[c]));
        let mut factors: [Vec<f64>; 3] = std::array::from_fn(|_| vec![1.0; order + 1]);
        let mut bounds = [0.0; 3];
        for round in 0..=ROUNDS {
            let samples = proof.samples(&self.polar, &factors.each_ref().map(Vec::as_slice));
            let mut done = true;
            for c in 0..3 {
                bounds[c] = proof.bound(&samples[c]);
                if self.mean[c] <= 0.0 || bounds[c] >= -UNSURE * self.mean[c] || round == ROUNDS {
                    continue;
                }
                let room = 2.0 * proof.margin(&samples[c]);
                let lows = proof.lows(&samples[c], 4 * (64 + order));
                let rows = lows.into_par_iter().map_init(
                    || vec![0.0; count(order)],
                    |y, d| self.constraint(c, &proof, &basis, y, d, room),
                );
                programs[c].add(rows.collect(), 4 * (64 + order));
                self.set(c, &programs[c].solve(), &mut factors[c]);
                done = false;
            }
            if done {
                break;
            }
        }
        for c in 0..3 {
            if self.mean[c] > 0.0 && bounds[c] < 0.0 {
                // mean + s (f − mean) ≥ mean + s (bound − mean) = 0.
                let s = self.mean[c] / (self.mean[c] - bounds[c]) * (1.0 - 1e-12);
                factors[c][1..].iter_mut().for_each(|w| *w *= s);
                bounds[c] = 0.0;
            }
            self.fill(c, &mut factors[c]);
        }
        (factors, bounds)
    }

    /// Σ δ_l h_l(d) ≤ h(d) − room, of the sharper function h, in √P_l δ_l.
    fn constraint(
        &self,
        c: usize,
        proof: &Proof,
        basis: &Basis,
        y: &mut [f64],
        d: DVec3,
        room: f64,
    ) -> Constraint {
        basis.eval(self.polar.order, DVec3::new(d.x, d.z, d.y), y);
        let (mut a, mut b) = (vec![0.0; self.polar.order], self.mean[c] - room);
        for l in 1..=self.polar.order {
            let band = l * l..(l + 1) * (l + 1);
            let value: f64 = self.polar.c[c][band.clone()].iter().zip(&y[band]).map(|(c, y)| c * y).sum();
            if self.power[c][l] > 0.0 {
                a[l - 1] = value * proof.sharpen[l] / self.power[c][l].sqrt();
                b += value * proof.sharpen[l];
            }
        }
        Constraint { a, b }
    }

    fn set(&self, c: usize, y: &[f64], factors: &mut [f64]) {
        for l in 1..factors.len() {
            let size = self.power[c][l].sqrt();
            factors[l] = if size > 0.0 { 1.0 - y[l - 1] / size } else { 1.0 };
        }
    }

    /// Bands that are not there: like their neighbours.
    fn fill(&self, c: usize, factors: &mut [f64]) {
        let there = |l: usize| self.power[c].get(l).is_some_and(|p| *p > 0.0);
        for l in (1..factors.len()).filter(|l| !there(*l)) {
            factors[l] = if there(l + 1) { 0.5 * (factors[l - 1] + factors[l + 1]) } else { factors[l - 1] };
        }
    }

    fn change(&self, c: usize, factors: &[f64]) -> f64 {
        let sum: f64 = self.power[c].iter().zip(factors).map(|(p, w)| p * (1.0 - w) * (1.0 - w)).sum();
        let all: f64 = self.power[c].iter().sum();
        if all > 0.0 { (sum / all).sqrt() } else { 0.0 }
    }
}

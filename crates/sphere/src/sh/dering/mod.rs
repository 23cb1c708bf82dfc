//! Non-negative light: the smallest change per band after which a band-limited function is nowhere below
//! zero, proved.
//!
//! Sloan 2008, Stupid Spherical Harmonics Tricks, and 2017, Deringing Spherical Harmonics, take one window of
//! a fixed form, at most to band 2, and look for its width. Here every band has a factor of its own, to any
//! order: of all factors 1 − δ_l that make f_δ = Σ (1 − δ_l) f_l non-negative by the proof below, those with
//! the least ∫ (f_δ − f)² = Σ P_l δ_l², P_l = Σ_m f_lm². Constraints Σ δ_l f_l(x) ≤ f(x) are linear in as
//! many numbers as there are bands, so this is a quadratic program; δ = 1 leaves the mean, so it has a
//! solution where the mean is positive. Constraints join it where the last solution is lowest. Factors per
//! band turn with the function.
//!
//! How little any such factors can change is bounded from below by the same program without the proof's
//! margin ([`Dering::least`]): duality needs only multipliers, no search that has ended.
//!
//! The proof needs samples only ([`proof`]): f is the average of a sharper function by a non-negative kernel,
//! and a quadrature with positive weights is exact for that average, so that f is nowhere below the sharper
//! function's least sample. What the last solution still misses is made up for by moving all factors towards
//! the mean.

mod program;
mod proof;
#[cfg(test)]
mod tests;

use super::rotation::exchange_yz;
use super::{Basis, ShRgb, count};
use glam::DVec3;
use program::{Constraint, Program};
use proof::Proof;
use std::f64::consts::PI;
use steradian_parallel::prelude::*;

/// How often lowest points join the constraints.
const ROUNDS: usize = 40;

/// What need not be made up for by more constraints, relative to the mean.
const UNSURE: f64 = 2e-5;

/// What [`ShRgb::dering`] did, by channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Dering {
    /// Factor of each band.
    pub factors: [Vec<f64>; 3],
    /// Root mean square of the change of the function over its root mean square.
    pub change: [f64; 3],
    /// No factors per band that leave the function nowhere negative change it less than this.
    pub least: [f64; 3],
    /// A proved lower bound of the function: not below zero, but where its mean is not positive.
    pub minimum: [f64; 3],
}

impl ShRgb {
    /// Multiplies bands by the factors nearest to 1 (see the module) after which Σ k_l c_lm Y_lm is nowhere
    /// negative, channel by channel: with k_l of the clamped cosine ([`super::zonal::cosine`]) the
    /// irradiance, with ones the function itself. Bands where k_l is 0 get the mean of their neighbours'
    /// factors. A channel whose mean is not positive stays.
    pub fn dering(&mut self, k: &[f64]) -> Dering {
        let f = Function::new(self, k);
        let found = f.search();
        let change = std::array::from_fn(|c| f.change(c, &found[c].factors));
        let least = found.each_ref().map(|f| f.least);
        let minimum = found.each_ref().map(|f| f.bound);
        let factors = found.map(|f| f.factors);
        for (c, factors) in self.c.iter_mut().zip(&factors) {
            for (l, w) in factors.iter().enumerate() {
                c[l * l..(l + 1) * (l + 1)].iter_mut().for_each(|c| *c *= w);
            }
        }
        Dering { factors, change, least, minimum }
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

/// Factors of a channel.
struct Found {
    factors: Vec<f64>,
    change: f64,
    least: f64,
    bound: f64,
}

impl Default for Found {
    fn default() -> Self {
        Self { factors: Vec::new(), change: f64::INFINITY, least: 0.0, bound: 0.0 }
    }
}

impl Found {
    /// Takes what changes less.
    fn offer(&mut self, other: Self) {
        if other.change < self.change {
            *self = other;
        }
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

    /// The factors of each channel, with what is proved of them.
    fn search(&self) -> [Found; 3] {
        let order = self.polar.order;
        let (proof, basis) = (Proof::new(order), Basis::new(order));
        let mut programs: [_; 3] = std::array::from_fn(|c| Program::new(order, self.mean[c]));
        let mut factors: [Vec<f64>; 3] = std::array::from_fn(|_| vec![1.0; order + 1]);
        let mut found: [Found; 3] = std::array::from_fn(|_| Found::default());
        let (mut axes, mut open) = ([DVec3::Y; 3], [true; 3]);
        for round in 0..=ROUNDS {
            let samples = proof.samples(&self.polar, &factors.each_ref().map(Vec::as_slice));
            for c in 0..3 {
                if !open[c] {
                    continue;
                }
                if round == 0 {
                    axes[c] = proof.peak(&samples[c]);
                }
                let bound = proof.bound(&samples[c]);
                let met = self.mean[c] <= 0.0 || bound >= -UNSURE * self.mean[c];
                found[c].offer(self.repaired(c, &factors[c], bound));
                open[c] = !met && round < ROUNDS;
                if open[c] {
                    let room = 2.0 * proof.margin(&samples[c]);
                    let lows = proof.lows(&samples[c], axes[c], 2 * (64 + order));
                    let rows = lows.into_par_iter().map_init(
                        || vec![0.0; count(order)],
                        |y, d| self.constraint(c, &proof, &basis, y, d, room),
                    );
                    programs[c].add(rows.collect(), 4 * (64 + order));
                    self.set(c, &programs[c].solve(), &mut factors[c]);
                }
            }
            if open == [false; 3] {
                break;
            }
        }
        for c in 0..3 {
            found[c].least = self.least(c, &proof, &programs[c]);
            self.fill(c, &mut found[c].factors);
        }
        found
    }

    /// Factors whose function is nowhere below `bound`, moved towards the mean until it is not negative.
    fn repaired(&self, c: usize, factors: &[f64], bound: f64) -> Found {
        let (mut factors, mut repaired) = (factors.to_vec(), bound);
        if self.mean[c] > 0.0 && bound < 0.0 {
            // mean + s (f − mean) ≥ mean + s (bound − mean) = 0.
            let s = self.mean[c] / (self.mean[c] - bound) * (1.0 - 1e-12);
            factors[1..].iter_mut().for_each(|w| *w *= s);
            repaired = 0.0;
        }
        Found { change: self.change(c, &factors), factors, least: 0.0, bound: repaired }
    }

    /// What any factors change that make the function itself, not the sharper one, non-negative where
    /// constraints are.
    fn least(&self, c: usize, proof: &Proof, program: &Program) -> f64 {
        let order = self.polar.order;
        let row = |row: &Constraint| {
            let a: Vec<f64> = (0..order).map(|i| row.a[i] / proof.sharpen[i + 1]).collect();
            let value: f64 = (0..order).map(|i| a[i] * self.power[c][i + 1].sqrt()).sum();
            Constraint { a, b: self.mean[c] + value }
        };
        let mut plain = Program::new(order, self.mean[c]);
        plain.add(program.rows().iter().map(row).collect(), 0);
        plain.solve();
        let all: f64 = self.power[c].iter().sum();
        if all > 0.0 { plain.least() / all.sqrt() } else { 0.0 }
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

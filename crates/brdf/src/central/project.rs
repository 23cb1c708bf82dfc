//! The third pass of 5.22: ρ̂_lpq = 2π ∫ k_lq(θ_o) f_pq(θ_o) sin θ_o dθ_o.

use super::kernel::Kernel;
use super::lpq::check_orders;
use super::rule::{self, POINTS};
use super::slices::Setup;
use super::theta::Polar;
use super::{Argument, CentralError, Centre, Lpq};
use crate::{Brdf, Lobe};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::Task;

/// Target accuracy in θ_o, relative to f_cos; the accuracy reached is usually far better than the estimate.
const TOLERANCE: f64 = 3e-5;
/// Target accuracy as a share of the task's tolerance, used where that is less strict.
const SHARE: f64 = 0.01;
/// Target accuracy of each slice; the accuracy reached is 1e-6 and better.
const SLICE_TOLERANCE: f64 = 1e-4;
/// Panels in θ_o at most.
const MAX_PANELS: usize = 12;
/// A panel spans at most this many radians of f_pq: a wave of 9 radians is integrated to 2e-6 by the 7-point
/// rule, by whose difference panels are divided, and to rounding by the 15-point rule.
const MAX_PHASE: f64 = 9.0;

impl Lpq {
    /// The plain projection of RH02 5.22, up to orders `f` and `p`; the total energy by the same quadrature.
    /// Panels in θ_o, at most 12, are added until the estimated error is below 3e-5 of f_cos, or below a
    /// hundredth of the task's tolerance if that is more (models with kinks in elevation reach the limit of
    /// panels first); [`Lpq::accuracy`] is the estimate.
    pub fn project(
        brdf: &dyn Brdf,
        centre: Centre,
        f: usize,
        p: usize,
        task: &Task,
    ) -> Result<Self, CentralError> {
        check_orders(f, p)?;
        let setup = Setup::new(brdf, centre, (f, p), SLICE_TOLERANCE)?;
        let mut sum = Projection::new(centre, f, p, setup.request.q);
        task.begin("BRDF coefficients", 0);
        let panels =
            rule::split(&breaks(brdf, centre.reach()), MAX_PHASE / (2.0 * centre.reach() * p.max(1) as f64));
        let done = sum.run(&setup, panels, task);
        task.end();
        done?;
        let Projection { rho, energy, square_error, quadrature, .. } = sum;
        let total: f64 = energy.iter().sum();
        let accuracy = if total > 0.0 { (square_error / total).sqrt() + quadrature } else { 0.0 };
        let of = Argument::View;
        Ok(Self { centre, of, f, p, rho, energy, scale: None, gram: None, accuracy })
    }
}

/// θ_o = reach (1 − (1 − s)²) and dθ_o/ds: the energy of a slice grows like 1/n·wo towards grazing views,
/// which this parameter evens out.
fn elevation(reach: f64, s: f64) -> (f64, f64) {
    let t = 1.0 - s;
    (reach * (1.0 - t * t), 2.0 * reach * t)
}

/// Parameters between which k_lq is smooth: steps that shrink towards grazing views, down to the width of the
/// lobe.
fn breaks(brdf: &dyn Brdf, reach: f64) -> Vec<f64> {
    let width = |l: &Lobe| match *l {
        Lobe::Axis { width, .. } | Lobe::Cone { width, .. } | Lobe::Arc { width, .. } => width,
    };
    let narrowest = brdf.lobes(DVec3::Z).iter().map(width).fold(0.25, f64::min).max(0.02);
    let (mut breaks, mut t) = (vec![0.0], 0.7);
    while reach * t * t > narrowest {
        breaks.push(1.0 - t);
        t *= 0.4;
    }
    breaks.push(1.0);
    breaks
}

struct Projection {
    centre: Centre,
    p: usize,
    q: usize,
    bands: usize,
    polar: Polar,
    rho: Vec<f64>,
    energy: [f64; 3],
    square_error: f64,
    quadrature: f64,
}

impl Projection {
    fn new(centre: Centre, f: usize, p: usize, q: usize) -> Self {
        let rho = vec![0.0; Lpq::rows(p) * 3 * (f + 1)];
        let polar = Polar::new(p, q);
        Self { centre, p, q, bands: f + 1, polar, rho, energy: [0.0; 3], square_error: 0.0, quadrature: 0.0 }
    }

    /// Panels, halved in rounds until the sum is accurate.
    fn run(&mut self, setup: &Setup, mut panels: Vec<[f64; 2]>, task: &Task) -> Result<(), CentralError> {
        let tolerance = task.tolerance().map_or(TOLERANCE, |t| (SHARE * t).max(TOLERANCE));
        let (mut made, limit, mut norm) = (panels.len(), MAX_PANELS.max(2 * panels.len()), 0.0f64);
        while !panels.is_empty() {
            let nodes: Vec<_> = panels.iter().flat_map(|w| rule::nodes(w[0], w[1])).collect();
            let slices: Vec<_> =
                nodes.iter().map(|n| self.centre.slice(elevation(self.centre.reach(), n.at).0)).collect();
            let kernels = setup.kernels(&slices, task)?;
            let parts: Vec<Part> =
                panels.iter().zip(kernels.chunks_exact(POINTS)).map(|(w, k)| self.part(*w, k)).collect();
            norm = norm.max(parts.iter().flat_map(|p| p.energy).sum::<f64>().sqrt());
            let mut next = Vec::new();
            for (part, [a, b]) in parts.iter().zip(panels) {
                if part.error > tolerance * norm && made < limit {
                    let middle = 0.5 * (a + b);
                    next.extend([[a, middle], [middle, b]]);
                    made += 1;
                } else {
                    self.add(part);
                }
            }
            panels = next;
        }
        Ok(())
    }

    fn add(&mut self, part: &Part) {
        self.rho.iter_mut().zip(&part.rho).for_each(|(r, p)| *r += p);
        (0..3).for_each(|c| self.energy[c] += part.energy[c]);
        self.square_error += part.error * part.error;
        self.quadrature = self.quadrature.max(part.quadrature);
    }

    /// One panel's sums from its slices.
    fn part(&self, ends: [f64; 2], kernels: &[Kernel]) -> Part {
        let mut part = Part { rho: vec![0.0; self.rho.len()], energy: [0.0; 3], error: 0.0, quadrature: 0.0 };
        let mut difference = part.rho.clone();
        let (mut missed, mut row) = (0.0, Vec::new());
        // The even continuation below the horizon doubles p + q even and cancels p + q odd.
        let even = self.centre == Centre::Normal;
        let fold = if even { 4.0 * PI } else { 2.0 * PI };
        for (node, kernel) in rule::nodes(ends[0], ends[1]).iter().zip(kernels) {
            let (theta_o, slope) = elevation(self.centre.reach(), node.at);
            let (s, c) = theta_o.sin_cos();
            let area = fold * s * slope;
            let (w, d) = (area * node.weight, area * node.difference);
            for (e, k) in part.energy.iter_mut().zip(kernel.energy) {
                *e += w * k;
                missed += d * k;
            }
            part.quadrature = part.quadrature.max(kernel.accuracy);
            self.polar.for_each(s, c, &mut row, |q, f| {
                if q > self.q {
                    return;
                }
                let n = 3 * self.bands;
                let k = &kernel.k[q * n..(q + 1) * n];
                for p in (q..=self.p).filter(|p| !even || (p + q) % 2 == 0) {
                    let at = (p * (p + 1) / 2 + q) * n;
                    axpy(&mut part.rho[at..at + n], w * f[p], k);
                    axpy(&mut difference[at..at + n], d * f[p], k);
                }
            });
        }
        let energy: f64 = part.energy.iter().sum();
        let norm = difference.iter().map(|d| 2.0 * d * d).sum::<f64>().sqrt();
        let coefficients = rule::error(norm, energy.max(0.0).sqrt());
        // An error of the energy weighs as half of it on the norm.
        let of_energy =
            rule::error(missed.abs(), energy.max(0.0)) / energy.max(0.0).sqrt().max(f64::MIN_POSITIVE);
        part.error = coefficients.max(0.5 * of_energy);
        part
    }
}

struct Part {
    rho: Vec<f64>,
    energy: [f64; 3],
    error: f64,
    quadrature: f64,
}

fn axpy(y: &mut [f64], a: f64, x: &[f64]) {
    y.iter_mut().zip(x).for_each(|(y, x)| *y += a * x);
}

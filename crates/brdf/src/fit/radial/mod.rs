//! Radially symmetric lobes: f_cos(wi, wo) ≈ Σ_i A_i(θ_v) p_i(θ_v, o_i·wi) with axes o_i(θ_v) in the plane of
//! n and wo.
//!
//! Kautz & McCool (2000), *Approximation of Glossy Reflection with Prefiltered Environment Maps*; Kautz 2004
//! (STAR), eqs 27–31. The profile of a view is the mean of f_cos over the azimuth about the axis, which is
//! the best fit in the mean square, and the q = 0 part of Ramamoorthi & Hanrahan's (2002) expansion about
//! that axis. The cosine is inside the mean (STAR's eq. 29 pulls it out as n·r): the energy of every view is
//! exact, and a lobe that the horizon cuts loses the part below it.
//!
//! [`RadialFit::new`] fits: with profiles of their own at every stacked view ([`Shape::Stack`], eq. 29), or
//! with one profile times a factor ([`Shape::Scaled`], eq. 31: the weighted least squares of rank 1); several
//! lobes by fitting the residual of those before, then refitting each to the residual of all others.

mod by_cosine;
mod profiles;
mod rank1;
mod rings;
#[cfg(test)]
mod tests;

pub use by_cosine::ByCosine;
pub use profiles::{Axis, Residual, Views};
pub use rings::{Curve, Rings};

use crate::Brdf;
use steradian_base::{Cancelled, Task};
use steradian_parallel::prelude::*;

/// Dependence of a lobe's profile on the view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A profile of its own at every stacked view.
    Stack,
    /// One for all views, times a factor.
    Scaled,
}

/// Settings of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Dependence of profiles on the view.
    pub shape: Shape,
    /// Stacked views, at least 2, spaced as [`Views`].
    pub stack: usize,
    /// Lobes, at least 1.
    pub lobes: usize,
    /// Every axis the mirror direction? Else each lobe takes the best of [`Axis::ALL`].
    pub mirror: bool,
}

/// Rows of the tables per stacked view: axes and amplitudes, four numbers a view, are stored at twice as many
/// views as profiles, of some hundred numbers.
const STRIDE: usize = 2;
/// Sweeps in which several lobes are refitted, each to the residual of all others. Of GGX of alpha 0.5 by two
/// lobes one sweep leaves 0.221, two 0.211 and four 0.204; of Oren and Nayar's model all leave 0.074.
const SWEEPS: usize = 2;
/// Step in views at which axes are compared and residuals measured, which saves time. 3 and 12 choose the
/// same axes for three of four reflectances.
const COARSE_STEP: usize = 6;

/// One lobe.
#[derive(Debug, Clone, PartialEq)]
pub struct RadialLobe {
    /// γ of each view: the axis lies in the plane of n and wo at this angle from n, away from wo.
    pub gamma: Vec<f64>,
    /// Values at the rings of each profile and channel: one profile, or one per stacked view.
    pub shapes: Vec<[Vec<f64>; 3]>,
    /// A of each view and channel.
    pub amplitude: Vec<[f64; 3]>,
}

/// A fit.
#[derive(Debug, Clone, PartialEq)]
pub struct RadialFit {
    /// The rings of all profiles.
    pub rings: Rings,
    /// The views of all tables.
    pub views: Views,
    /// Views from one stacked view to the next.
    pub stride: usize,
    /// The lobes, the strongest first.
    pub lobes: Vec<RadialLobe>,
    /// ∫ (f_cos − fit)² over wi and views (uniform in solid angle) relative to ∫ f_cos², by a sixth of the
    /// views, before energies are made exact.
    pub residual: f64,
}

/// Inputs of a fit.
struct Fitter<'a> {
    brdf: &'a dyn Brdf,
    plan: Plan,
    rings: Rings,
    views: Views,
    stride: usize,
}

impl RadialFit {
    /// Fits an isotropic reflectance.
    pub fn new(brdf: &dyn Brdf, plan: Plan, task: &Task) -> Result<Self, Cancelled> {
        let stack = plan.stack.max(2);
        let views = Views::new((stack - 1) * STRIDE + 1);
        let rings = Rings::graded(profiles::narrowest(brdf, &views));
        let fitter = Fitter { brdf, plan, rings, views, stride: STRIDE };
        fitter.fit(task)
    }
}

impl Fitter<'_> {
    fn fit(self, task: &Task) -> Result<RadialFit, Cancelled> {
        let all: Vec<usize> = (0..self.views.len()).collect();
        let mut lobes: Vec<RadialLobe> = Vec::new();
        let mut albedo: Vec<[f64; 3]> = Vec::new();
        for _ in 0..self.plan.lobes.max(1) {
            let gamma = self.axis(&lobes, task)?;
            let means = self.means(&lobes, &gamma, &all, task)?;
            if lobes.is_empty() {
                albedo = means.iter().map(|m| m.each_ref().map(|m| self.rings.integral(m))).collect();
            }
            lobes.push(self.lobe(gamma, &means));
        }
        if lobes.len() > 1 {
            for (sweep, k) in (0..SWEEPS * lobes.len()).map(|i| (i / self.plan.lobes, i % self.plan.lobes)) {
                let old = lobes.remove(k);
                // The first lobe was fitted alone; next to other lobes its best axis may be another.
                let gamma = if sweep == 0 && k == 0 { self.axis(&lobes, task)? } else { old.gamma };
                let means = self.means(&lobes, &gamma, &all, task)?;
                lobes.insert(k, self.lobe(gamma, &means));
            }
        }
        let residual = self.residual(&lobes, task)?;
        if let Some((first, others)) = lobes.split_first_mut() {
            self.keep_energy(first, others, &albedo);
        }
        Ok(RadialFit { rings: self.rings, views: self.views, stride: self.stride, lobes, residual })
    }

    /// The residual of the reflectance after `lobes`.
    fn left<'a>(&'a self, lobes: &'a [RadialLobe]) -> Residual<'a> {
        Residual::new(self.brdf, &self.rings, &self.views, self.stride, lobes)
    }

    /// Mean profiles about the axes `gamma` (of each of the views listed).
    fn means(
        &self,
        lobes: &[RadialLobe],
        gamma: &[f64],
        views: &[usize],
        task: &Task,
    ) -> Result<Vec<[Vec<f64>; 3]>, Cancelled> {
        task.check()?;
        let left = self.left(lobes);
        Ok(views.par_iter().zip(gamma).map(|(&k, &gamma)| left.mean(k, gamma)).collect())
    }

    /// Some of the views, grazing ones too.
    fn coarse(&self) -> Vec<usize> {
        (2..self.views.len()).step_by(COARSE_STEP).collect()
    }

    /// The axis of the next lobe.
    fn axis(&self, lobes: &[RadialLobe], task: &Task) -> Result<Vec<f64>, Cancelled> {
        let left = self.left(lobes);
        let all: Vec<usize> = (0..self.views.len()).collect();
        let gammas = |axis: Axis, views: &[usize]| -> Vec<f64> {
            views.par_iter().map(|&k| left.gamma(axis, k)).collect()
        };
        let mut best = (Axis::Mirror, f64::NEG_INFINITY);
        if !self.plan.mirror {
            let coarse = self.coarse();
            for axis in Axis::ALL {
                let means = self.means(lobes, &gammas(axis, &coarse), &coarse, task)?;
                let energy = |(m, &k): (&[Vec<f64>; 3], &usize)| {
                    self.views.weight(k) * m.iter().map(|m| self.rings.dot(m, m)).sum::<f64>()
                };
                let captured: f64 = means.iter().zip(&coarse).map(energy).sum();
                // A later axis must be better by 1e-3, since the earlier ones are simpler.
                if captured > best.1 * (1.0 + 1e-3) {
                    best = (axis, captured);
                }
            }
        }
        Ok(gammas(best.0, &all))
    }

    /// The lobe with these mean profiles.
    fn lobe(&self, gamma: Vec<f64>, means: &[[Vec<f64>; 3]]) -> RadialLobe {
        let weights: Vec<f64> = (0..means.len()).map(|k| self.views.weight(k)).collect();
        let mut amplitude = vec![[0.0; 3]; means.len()];
        let stacked = if self.plan.shape == Shape::Stack { means.len().div_ceil(self.stride) } else { 1 };
        let mut shapes: Vec<[Vec<f64>; 3]> = vec![Default::default(); stacked];
        for c in 0..3 {
            let rows: Vec<&[f64]> = means.iter().map(|m| m[c].as_slice()).collect();
            let size = rank1::size(&self.rings, &rows);
            match self.plan.shape {
                Shape::Stack => {
                    for (k, row) in rows.iter().enumerate() {
                        amplitude[k][c] = size(row);
                        if k % self.stride == 0 {
                            shapes[k / self.stride][c] = rank1::divided(row, size(row));
                        }
                    }
                }
                Shape::Scaled => {
                    let (factor, p) = rank1::fit(&self.rings, &rows, &weights);
                    let s = size(&p);
                    amplitude.iter_mut().zip(&factor).for_each(|(a, f)| a[c] = f * s);
                    shapes[0][c] = rank1::divided(&p, s);
                }
            }
        }
        RadialLobe { gamma, shapes, amplitude }
    }

    /// Adjusts the first lobe's factor so that all lobes together have each view's energy.
    fn keep_energy(&self, first: &mut RadialLobe, others: &[RadialLobe], albedo: &[[f64; 3]]) {
        let integral = |l: &RadialLobe, k: usize, c: usize, of: fn(f64) -> f64| {
            let (a, b, w) = l.around(k, self.stride);
            let mixed = |(a, b): (&f64, &f64)| of(a + (b - a) * w);
            let profile: Vec<f64> = l.shapes[a][c].iter().zip(&l.shapes[b][c]).map(mixed).collect();
            self.rings.integral(&profile)
        };
        for (k, albedo) in albedo.iter().enumerate() {
            for c in 0..3 {
                let theirs: f64 = others.iter().map(|l| l.amplitude[k][c] * integral(l, k, c, |v| v)).sum();
                let own = integral(first, k, c, |v| v);
                if own > 0.2 * integral(first, k, c, f64::abs) {
                    first.amplitude[k][c] = (albedo[c] - theirs) / own;
                }
            }
        }
    }

    fn residual(&self, lobes: &[RadialLobe], task: &Task) -> Result<f64, Cancelled> {
        task.check()?;
        let (left, whole) = (self.left(lobes), self.left(&[]));
        let of = |r: &Residual<'_>, k: usize| self.views.weight(k) * r.energy(k, self.views.theta[k]);
        let parts: Vec<[f64; 2]> =
            self.coarse().into_par_iter().map(|k| [of(&left, k), of(&whole, k)]).collect();
        let [left, all] = [0, 1].map(|i| parts.iter().map(|p| p[i]).sum::<f64>());
        Ok(if all > 0.0 { left / all } else { 0.0 })
    }
}

impl RadialLobe {
    /// The two shapes around view `k`, and the weight of the second.
    pub fn around(&self, k: usize, stride: usize) -> (usize, usize, f64) {
        let last = self.shapes.len() - 1;
        let a = (k / stride).min(last);
        (a, (a + 1).min(last), (k % stride) as f64 / stride as f64)
    }
}

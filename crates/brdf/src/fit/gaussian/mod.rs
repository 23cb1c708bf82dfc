//! Reflectance as a few Gaussians about the mirror direction.
//!
//! Green, Kautz & Durand 2007, *Efficient Reflectance and Visibility Approximations for Environment Map
//! Rendering*, eqs 3 and 8. With the diffuse part split off first, T_θo(δ) = (f − ρ_d/π) n·wi as a function
//! of the position δ relative to the mirror direction r, and at each of N elevations of the view
//!
//! **T_θo(δ) ≈ Σ_k w_k G_σk(μ_k − δ)**
//!
//! G_σ(m, d) = λ/(2π (1 − e^(−2λ))) exp(λ (m·d − 1)), λ = 1/σ²: the spherical Gaussian of integral 1. By the
//! symmetry of isotropic reflectance the means lie in the plane of n and wo, so that a mean is one angle from
//! r, positive away from n. A round lobe has five numbers.
//!
//! Beyond the paper a lobe may be stretched ([`Shape::Stretched`]): seen at a grazing angle, highlights are
//! many times as long as they are wide. It is then G_σ swept along the plane of n and wo with Von Mises's
//! density of the angle, which has a closed form and integral 1 (`swept`); its sixth number is the width of
//! that density. 15 elevations of three lobes are 552 bytes in half precision, with the diffuse part in
//! single.
//!
//! Anisotropic reflectance also depends on the azimuth of the view, and its lobes may lie off the plane of n
//! and wo: a lobe has two angles of its mean, and a third that gives the direction along which it is swept. M
//! azimuths are equally spaced, 2π(j + ½)/M; between views the logarithm of the 2 × 2 covariance, which has
//! widths and direction, is linear (Arsigny, Fillard, Pennec & Ayache 2006). Seen along the normal, one fit
//! serves all azimuths, rotated.
//!
//! The N elevations are equally spaced from 0 to [`LAST`], since at π/2 nothing is seen. In between (in θ_o)
//! the logarithm of the two widths, the angle of the mean and the weights are linear; beyond the last
//! elevation they stay. T is 0 below the horizon, and the whole sphere counts: light that a lobe gathers from
//! below is a part of its error, told as [`SliceReport::leak`].
//!
//! [`Objective::Published`] is eq. 8: least squares of the solid angle at every elevation alone, with bounds.
//! [`Objective::Energy`] also keeps each channel's albedo, Σ_k w_k = ∫ T, so that a white furnace stays
//! white, and of the minima that searches find at each elevation takes those whose errors are least in sum
//! over the elevations and midway between them, where parameters are interpolated.
//!
//! Only means and widths are searched for: for given ones the weights are the solution of a least-squares
//! problem with bounds, found exactly (variable projection: Golub & Pereyra 1973; Kaufman 1975 for the
//! derivatives).

mod azimuths;
mod chain;
mod halves;
mod order;
mod quadtree;
mod refine;
mod slice;
mod swept;
#[cfg(test)]
mod tests;
mod weights;

use crate::Brdf;
use glam::DVec3;
pub use halves::{HalfFit, HalfVector, HalfView, MIN_HALF_VECTORS};
use refine::{Fitted, Kind};
use slice::Slice;
use std::f64::consts::PI;
use steradian_base::{Cancelled, Task};
pub use swept::mean_cosine;
pub(crate) use swept::{Axes, Swept};

/// The last elevation of a fit, radians: 89°, since at 90° nothing is seen.
pub const LAST: f64 = 89.0 * PI / 180.0;
/// Most lobes: the weights are the best of minima on 2^K − 1 faces, 15 for four lobes, at every step.
pub const MAX_LOBES: usize = 4;

/// The objective of the fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Objective {
    /// Least squares under the condition that the weights of each channel sum to its albedo.
    Energy,
    /// Least squares (eq. 8 of the paper).
    Published,
}

/// Form of the lobes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// The paper's.
    Round,
    /// Swept along the plane of n and wo, each by its own angle.
    Stretched,
}

/// Settings of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// K, 1 … [`MAX_LOBES`].
    pub lobes: usize,
    /// N, 2 at least.
    pub views: usize,
    /// The objective.
    pub objective: Objective,
    /// Form of the lobes; those of anisotropic reflectance are always swept, along any direction.
    pub shape: Shape,
    /// M of anisotropic reflectance, [`MIN_AZIMUTHS`] at least.
    pub azimuths: usize,
}

/// Least M.
pub const MIN_AZIMUTHS: usize = 4;

impl Default for Plan {
    /// K = 3 and N = 15, the paper's, of stretched lobes; and M = 24.
    fn default() -> Self {
        Self { lobes: 3, views: 15, objective: Objective::Energy, shape: Shape::Stretched, azimuths: 24 }
    }
}

/// One Gaussian.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct GaussianLobe {
    /// Angle of the mean from the mirror direction, in the plane of n and wo, positive away from n; radians.
    pub angle: f64,
    /// Angle of the mean out of that plane, positive towards n × wo; radians. 0 where reflectance is
    /// isotropic.
    pub aside: f64,
    /// σ, radians: the width across the sweep.
    pub sigma: f64,
    /// s, radians: the width of the angle over which the Gaussian is swept; 0 for a round lobe.
    pub sweep: f64,
    /// Angle from the plane to the direction of the sweep; radians. 0 where reflectance is isotropic.
    pub turn: f64,
    /// Weight per channel: the lobe's reflected radiance under constant light of radiance 1.
    pub weight: [f64; 3],
}

impl GaussianLobe {
    /// Interpolation, at `t`, between this lobe and that of the next view.
    fn towards(&self, next: &Self, t: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * t;
        let mut out = Self {
            angle: mix(self.angle, next.angle),
            aside: mix(self.aside, next.aside),
            weight: std::array::from_fn(|c| mix(self.weight[c], next.weight[c])),
            ..Self::default()
        };
        if self.turn == 0.0 && next.turn == 0.0 {
            let along = mix(self.along().ln(), next.along().ln()).exp();
            out.sigma = mix(self.sigma.ln(), next.sigma.ln()).exp();
            out.sweep = ((along - out.sigma) * (along + out.sigma)).max(0.0).sqrt();
        } else {
            let (a, b) = (self.spread(), next.spread());
            out.widen([0, 1, 2].map(|i| mix(a[i], b[i])));
        }
        out
    }

    /// The width along the sweep, √(σ² + s²); radians.
    pub fn along(&self) -> f64 {
        self.sigma.hypot(self.sweep)
    }

    /// The logarithm of the widths as a matrix, half that of the covariance: in the plane, mixed, out of it.
    pub fn spread(&self) -> [f64; 3] {
        let (across, along) = (self.sigma.ln(), self.along().ln());
        let (s, c) = self.turn.sin_cos();
        [along * c * c + across * s * s, (along - across) * s * c, along * s * s + across * c * c]
    }

    /// Takes widths and direction from [`Self::spread`].
    fn widen(&mut self, [plane, mixed, out]: [f64; 3]) {
        let (mean, off) = (0.5 * (plane + out), 0.5 * (plane - out));
        let radius = off.hypot(mixed);
        self.sigma = (mean - radius).exp();
        let along = (mean + radius).exp();
        self.sweep = ((along - self.sigma) * (along + self.sigma)).max(0.0).sqrt();
        self.turn = 0.5 * mixed.atan2(off);
    }

    /// Mean, direction of the sweep, and direction across, for the view at polar angle `theta` in the plane
    /// of x and z (wo at positive x).
    pub(crate) fn axes(&self, theta: f64) -> Axes {
        Axes::new(theta + self.angle, self.aside, self.turn)
    }

    /// The lobe for the view at polar angle `theta`, ready to be evaluated.
    pub(crate) fn swept(&self, theta: f64) -> Swept {
        Swept::new(self.axes(theta), self.sigma, self.sweep)
    }
}

/// The peak of G_σ: λ/(2π (1 − e^(−2λ))).
pub(crate) fn density(sigma: f64) -> f64 {
    let lambda = (sigma * sigma).recip();
    lambda / (-2.0 * PI * (-2.0 * lambda).exp_m1())
}

/// Errors of a fit at one elevation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SliceReport {
    /// Polar angle of the view, radians.
    pub theta: f64,
    /// Azimuth of the view, radians; 0 where reflectance is isotropic.
    pub phi: f64,
    /// ∫ (T − fit)²/∫ T², all channels together: the paper's error as an energy.
    pub energy: f64,
    /// That integral relative to the one of the whole f·cos, squared.
    pub of_whole: f64,
    /// The norm of the difference of ln(1 + f·cos), relative to that of ln(1 + f·cos) (the error of Löw,
    /// Kronander, Ynnerman & Unger 2012): it gives weight to dim directions around the highlight.
    pub log: f64,
    /// The relative norm of the difference of the cube roots of f·cos (Fores, Ferwerda & Gu 2012).
    pub cube_root: f64,
    /// ∫ T per channel: the specular albedo.
    pub albedo: [f64; 3],
    /// Share of the weights that lies below the horizon.
    pub leak: f64,
    /// Did the search end at a minimum?
    pub converged: bool,
}

impl SliceReport {
    /// The plain norm ‖T − fit‖/‖T‖.
    pub fn norm(&self) -> f64 {
        self.energy.sqrt()
    }
}

/// Elevations that [`GaussianFit::within`] tries with each number of lobes: 15 are the paper's N.
const TRIED_VIEWS: [usize; 5] = [4, 8, 15, 22, MAX_VIEWS];
/// Most elevations: steps of 3.1°.
pub const MAX_VIEWS: usize = 30;

/// A fit.
#[derive(Debug, Clone, PartialEq)]
pub struct GaussianFit {
    /// ρ_d, the albedo of the diffuse part per channel.
    pub diffuse: [f64; 3],
    /// The lobes of every view, as many at each, in an order that is kept from one to the next: by elevation,
    /// and at each by azimuth.
    pub views: Vec<Vec<GaussianLobe>>,
    /// M, 1 where reflectance is isotropic.
    pub azimuths: usize,
    /// Errors at each elevation; empty where the fit comes from a file.
    pub report: Vec<SliceReport>,
}

impl GaussianFit {
    /// A fit of an isotropic reflectance from its parts.
    pub fn isotropic(diffuse: [f64; 3], views: Vec<Vec<GaussianLobe>>) -> Self {
        Self { diffuse, views, azimuths: 1, report: Vec::new() }
    }

    /// Fits a reflectance.
    pub fn new(brdf: &dyn Brdf, plan: Plan, task: &Task) -> Result<Self, Cancelled> {
        if !brdf.is_isotropic() {
            return azimuths::fit(brdf, plan, task);
        }
        let (views, lobes) = (plan.views.max(2), plan.lobes.clamp(1, MAX_LOBES));
        let keep = plan.objective == Objective::Energy;
        let kind = Kind { lobes, keep, stretched: plan.shape == Shape::Stretched, turned: false };
        let diffuse = chain::diffuse(brdf, kind);
        let slice = |x: f64| Slice::new(brdf, diffuse, [LAST * x / (views - 1) as f64, 0.0], kind);
        let slices: Vec<Slice> = (0..views).map(|i| slice(i as f64)).collect();
        let mut found = chain::candidates(&slices, kind, task)?;
        let mut fits: Vec<Fitted> = if keep {
            let between: Vec<Slice> = (1..views).map(|i| slice(i as f64 - 0.5)).collect();
            let jump = if kind.stretched { chain::JUMP } else { 0.0 };
            let choose = |found: &[Vec<Fitted>]| {
                let middles = chain::midways(found, &between);
                chain::smoothest(&slices, found, &middles, jump, &|_, _| 0.0)
            };
            let mut path = choose(&found);
            if kind.stretched && chain::mend(&slices, &mut found, &between, &path, kind) {
                path = choose(&found);
            }
            found.into_iter().zip(path).map(|(mut all, k)| all.swap_remove(k)).collect()
        } else {
            found.into_iter().filter_map(chain::least).collect()
        };
        order::align(&mut fits);
        let report = slices.iter().zip(&fits).map(|(s, f)| s.report(f)).collect();
        Ok(Self { report, ..Self::isotropic(diffuse, fits.into_iter().map(|f| f.lobes).collect()) })
    }

    /// The fit of fewest bytes whose [`GaussianFit::worst`] is at most `tolerance`, with K of 1 … 4 and N of
    /// 4 … 30, and that error; where there is none, the one of least error. All other settings are those of
    /// `plan`.
    pub fn within(
        brdf: &dyn Brdf,
        plan: Plan,
        tolerance: f64,
        task: &Task,
    ) -> Result<(Self, f64), Cancelled> {
        let mut sizes: Vec<(usize, usize)> =
            TRIED_VIEWS.iter().flat_map(|n| (1..=MAX_LOBES).map(|k| (k, *n))).collect();
        sizes.sort_by_key(|(k, n)| k * n);
        let mut best: Option<(Self, f64)> = None;
        for (lobes, views) in sizes {
            let fit = Self::new(brdf, Plan { lobes, views, ..plan }, task)?;
            let error = fit.worst(brdf);
            if best.as_ref().is_none_or(|b| error < b.1) {
                best = Some((fit, error));
            }
            if error <= tolerance {
                break;
            }
        }
        best.ok_or(Cancelled)
    }

    /// The largest norm of the error relative to that of the whole f·cos, over the views of the fit and
    /// midway between them.
    pub fn worst(&self, brdf: &dyn Brdf) -> f64 {
        let azimuths =
            if self.is_isotropic() { vec![0.0] } else { (0..self.azimuths).map(|j| self.phi(j)).collect() };
        let half = if self.is_isotropic() { 0.0 } else { PI / self.azimuths as f64 };
        let midway = (1..self.elevations()).flat_map(|k| {
            let theta = 0.5 * (self.theta(k - 1) + self.theta(k));
            azimuths.iter().map(move |phi| self.error_at(brdf, [theta, phi + half]).of_whole)
        });
        self.report.iter().map(|r| r.of_whole).chain(midway).fold(0.0, f64::max).sqrt()
    }

    /// The fit of the reflectance times `by`, per channel.
    #[must_use]
    pub fn scaled(mut self, by: [f64; 3]) -> Self {
        let times = |v: &mut [f64; 3]| v.iter_mut().zip(by).for_each(|(v, by)| *v *= by);
        times(&mut self.diffuse);
        self.views.iter_mut().flatten().for_each(|l| times(&mut l.weight));
        self
    }

    /// Lobes of each view.
    pub fn lobes(&self) -> usize {
        self.views.first().map_or(0, Vec::len)
    }

    /// N.
    pub fn elevations(&self) -> usize {
        self.views.len() / self.azimuths
    }

    /// Does the azimuth of the view not count?
    pub fn is_isotropic(&self) -> bool {
        self.azimuths == 1
    }

    /// The lobes for a view at polar angle `theta` and azimuth `phi`, which isotropic fits ignore; those
    /// beyond the last have no weight.
    pub fn at(&self, [theta, phi]: [f64; 2]) -> [GaussianLobe; MAX_LOBES] {
        let last = self.elevations() - 1;
        let x = (theta / LAST).clamp(0.0, 1.0) * last as f64;
        let i = (x as usize).min(last.saturating_sub(1));
        let t = x - i as f64;
        let mut out = [GaussianLobe { sigma: 1.0, ..GaussianLobe::default() }; MAX_LOBES];
        let row = |i: usize, j: usize| &self.views[i.min(last) * self.azimuths + j % self.azimuths];
        let y = (0.5 * phi / PI * self.azimuths as f64 - 0.5).rem_euclid(self.azimuths as f64);
        let j = if self.is_isotropic() { 0 } else { y as usize };
        for (k, out) in out.iter_mut().enumerate().take(self.lobes()) {
            let lobe = |j: usize| row(i, j)[k].towards(&row(i + 1, j)[k], t);
            *out = if self.is_isotropic() { lobe(0) } else { lobe(j).towards(&lobe(j + 1), y - j as f64) };
        }
        out
    }

    /// The fit as a reflectance: ρ_d/π n·wi above the horizon and the lobes over the whole sphere.
    pub fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let mut out = [[0.0; 3]];
        self.f_cos_batch(&[wi], wo, &mut out);
        out[0]
    }

    /// [`Self::f_cos`] for many directions to the light, into `out`; the lobes of the view are interpolated
    /// once.
    pub fn f_cos_batch(&self, wi: &[DVec3], wo: DVec3, out: &mut [[f64; 3]]) {
        if wo.z <= 0.0 {
            out.fill([0.0; 3]);
            return;
        }
        let sine = wo.x.hypot(wo.y);
        let (x, y) = if sine > 0.0 { (wo.x / sine, wo.y / sine) } else { (1.0, 0.0) };
        let view = view_of(wo);
        for (sum, wi) in out.iter_mut().zip(wi) {
            *sum = self.diffuse.map(|d| d / PI * wi.z.max(0.0));
        }
        for lobe in &self.at(view)[..self.lobes()] {
            let swept = lobe.swept(view[0]);
            for (sum, wi) in out.iter_mut().zip(wi) {
                let g = swept.value(DVec3::new(wi.x * x + wi.y * y, wi.y * x - wi.x * y, wi.z));
                (0..3).for_each(|c| sum[c] += lobe.weight[c] * g);
            }
        }
    }

    /// Errors of the fit against `brdf` at any view (polar angle and azimuth), as [`GaussianFit::report`] has
    /// them for the fit's own views.
    pub fn error_at(&self, brdf: &dyn Brdf, view: [f64; 2]) -> SliceReport {
        let stretched = self.views.iter().flatten().any(|l| l.sweep > 0.0);
        let kind = Kind { lobes: self.lobes(), keep: true, stretched, turned: !self.is_isotropic() };
        let slice = Slice::new(brdf, self.diffuse, view, kind);
        let lobes = self.at(view)[..self.lobes()].to_vec();
        slice.report(&Fitted { lobes, error: f64::NAN, converged: true })
    }

    /// The polar angle of an elevation.
    pub fn theta(&self, elevation: usize) -> f64 {
        LAST * elevation as f64 / (self.elevations() - 1) as f64
    }

    /// The `j`-th azimuth.
    pub fn phi(&self, j: usize) -> f64 {
        let half = if self.is_isotropic() { 0.0 } else { 0.5 };
        2.0 * PI * (j as f64 + half) / self.azimuths as f64
    }

    /// The numbers of the fit as files hold them, lobes in half precision: bytes.
    pub fn bytes(&self) -> usize {
        let numbers = if self.is_isotropic() { 6 } else { 8 };
        4 * 3 + 2 * numbers * self.views.len() * self.lobes()
    }
}

/// Polar angle and azimuth of `wo`, 0 along the normal.
pub(crate) fn view_of(wo: DVec3) -> [f64; 2] {
    let azimuth = if wo.x == 0.0 && wo.y == 0.0 { 0.0 } else { wo.y.atan2(wo.x) };
    [crate::math::polar_angle(wo), azimuth]
}

//! The material's factor, the fit; and the tables that shading reads of it.

use super::light::Light;
use super::params::Params;
use super::views::Views;
use super::visibility::{Blocked, MOST};
use super::{halves, looks};
use crate::certify::Report;
use crate::shared::material::reflectance;
use crate::tensors::{PartError, TensorFile, get_f64, put_f64};
use crate::{BakeError, Material, Part};
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_brdf::fit::gaussian::{
    GaussianFit, GaussianLobe, HalfFit, LAST, MAX_LOBES, Objective, Plan, Shape, mean_cosine,
};
use steradian_brdf::model::lobes;
use steradian_brdf::{Brdf, Domain, Form, SharedBrdf};
use steradian_sphere::sh::zonal;

/// Rows of the table per interval between the fit's views: levels follow from logarithms of σ, and are nearly
/// linear between rows so close.
const FINER: usize = 8;
/// Rows per interval, and columns per interval of azimuth, where the reflectance is anisotropic.
const FINER_TURNED: usize = 2;

/// A fit.
#[derive(Debug, PartialEq)]
pub enum Fit {
    /// A few lobes for each view.
    Lobes(GaussianFit),
    /// Gaussians about half vectors.
    Halves(HalfFit),
}

/// A reflectance and its lobes.
pub struct Fitted {
    /// `None` in a loaded bake without the contents of the files that its reflectance needs.
    brdf: Option<SharedBrdf>,
    spec: String,
    /// The lobes.
    pub fit: Fit,
}

impl Fitted {
    pub(super) fn new(m: &Material, p: &Params, task: &Task) -> Result<Self, BakeError> {
        let objective = if p.objective == 1 { Objective::Published } else { Objective::Energy };
        let fit = match m.brdf.form() {
            Form::Gaussians(fit) => Fit::Lobes(fit),
            _ => {
                let shape = if p.shape == 1 { Shape::Stretched } else { Shape::Round };
                let plan = Plan { lobes: p.lobes, views: p.views, objective, shape, azimuths: p.azimuths };
                // Of strands, which light passes from below, half vectors tell nothing.
                let above = m.brdf.domain() == Domain::Hemisphere;
                if p.anisotropic == 0 && above && !m.brdf.is_isotropic() {
                    Fit::Halves(HalfFit::new(&*m.brdf, plan, p.half_vectors, p.sigma.to_radians(), task)?)
                } else {
                    Fit::Lobes(GaussianFit::new(&*m.brdf, plan, task)?)
                }
            }
        };
        Ok(Self { brdf: Some(m.brdf.clone()), spec: m.brdf.spec(), fit })
    }
}

impl Part for Fitted {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let key = format!("steradian.{prefix}.brdf");
        match &self.brdf {
            Some(brdf) => reflectance::put(to, &key, &**brdf),
            None => _ = to.metadata.insert(key, self.spec.clone()),
        }
        match &self.fit {
            Fit::Lobes(fit) => {
                let numbers = lobes::numbers(fit);
                put_f64(to, format!("{prefix}.lobes"), vec![numbers.len()], numbers);
            }
            Fit::Halves(fit) => halves::save(fit, to, prefix),
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let key = format!("steradian.{prefix}.brdf");
        let spec = from.metadata.get(&key).ok_or_else(|| PartError::Missing(key.clone()))?.clone();
        let fit = match halves::load(from, prefix)? {
            Some(fit) => Fit::Halves(fit),
            None => {
                let name = format!("{prefix}.lobes");
                let (_, numbers) = get_f64(from, &name, 1)?;
                Fit::Lobes(lobes::from_numbers(&numbers).ok_or(PartError::Unexpected(name))?)
            }
        };
        Ok(Self { brdf: reflectance::kept(from, &key).ok(), spec, fit })
    }

    fn bytes(&self) -> usize {
        match &self.fit {
            Fit::Lobes(fit) => fit.bytes(),
            Fit::Halves(fit) => fit.bytes(),
        }
    }

    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        self.brdf.as_deref()
    }
}

/// Distance between the lookups of a stretched lobe, in widths σ: their sum is then even to a hundredth.
const APART: f64 = 2.0;
/// Distance to which lookups reach on either side, in standard deviations of the sweep; `shade` weights them
/// with a Gaussian whose ends are at 2 standard deviations.
const REACH: f64 = 2.27;
/// A sweep shorter than this times σ widens a lobe by at most a hundredth, and is ignored.
const LEAST: f64 = 0.15;

/// Lookups of a lobe: their σ, the standard deviation of their angles, and their number.
fn taps(lobe: &GaussianLobe, most: usize) -> [f64; 3] {
    if lobe.sweep < LEAST * lobe.sigma || most < 3 {
        // One lookup has the lobe's mean second moment.
        let sigma = (0.5 * (lobe.sigma.powi(2) + lobe.along().powi(2))).sqrt();
        return [if lobe.sweep < LEAST * lobe.sigma { lobe.sigma } else { sigma }, 0.0, 1.0];
    }
    // Width of the normal distribution that has Von Mises's mean cosine.
    let sweep = (-2.0 * mean_cosine(lobe.sweep).max(0.05).ln()).sqrt();
    let count = 2.0 * REACH * sweep / (APART * lobe.sigma);
    let most = most as f64;
    // Where lookups would lie too far apart, each is widened, and the sweep reduced so that the variance
    // along it stays.
    let sigma = lobe.sigma.max(2.0 * REACH * sweep / (APART * most));
    let rest = (sweep.powi(2) + lobe.sigma.powi(2) - sigma.powi(2)).max(0.0).sqrt();
    [sigma, rest, count.clamp(3.0, most)]
}

/// Joins chain and fit.
pub(super) fn link(light: &Light, m: &Fitted, blocked: &Blocked, p: &Params) -> (Views, Report) {
    let (views, report) = match &m.fit {
        Fit::Lobes(fit) => views(light, fit, p),
        Fit::Halves(fit) => halves::views(light, fit, p),
    };
    let report = looks::report(blocked, &views, report);
    (views, report)
}

/// The tables of a fit of a few lobes.
fn views(light: &Light, fit: &GaussianFit, p: &Params) -> (Views, Report) {
    let lobes = fit.lobes();
    let finer = if fit.is_isotropic() { FINER } else { FINER_TURNED };
    let rows = (fit.elevations() - 1) * finer + 1;
    let columns = if fit.is_isotropic() { 1 } else { fit.azimuths * finer + 1 };
    let view = |i: usize| {
        let around = 2.0 * PI * (i % columns) as f64 / (columns - 1).max(1) as f64;
        [LAST * (i / columns) as f64 / (rows - 1) as f64, around]
    };
    let at: Vec<_> = (0..rows * columns).map(|i| fit.at(view(i))).collect();
    let row = |k: usize, i: usize| at[i][k.min(MAX_LOBES - 1)];
    let all = || (0..lobes).flat_map(move |k| (0..rows * columns).map(move |i| (k, i)));
    let means = all().map(|(k, i)| {
        let lobe = row(k, i);
        let [sigma, sweep, count] = taps(&lobe, p.taps);
        let level = light.level(sigma);
        let numbers = if columns > 1 {
            [lobe.angle, lobe.aside, level, count]
        } else {
            [lobe.angle, level, sweep, count]
        };
        numbers.map(|v| v as f32)
    });
    let sweep = |(k, i): (usize, usize)| {
        let [_, sweep, _] = taps(&row(k, i), p.taps);
        let (s, c) = (2.0 * row(k, i).turn).sin_cos();
        [sweep * sweep * c, sweep * sweep * s, 0.0, 0.0].map(|v| v as f32)
    };
    let weight = |(k, i): (usize, usize)| {
        let [r, g, b] = row(k, i).weight;
        [r as f32, g as f32, b as f32, 0.0]
    };
    let zonal = |(k, i): (usize, usize)| {
        let [sigma, ..] = taps(&row(k, i), p.taps);
        let a = zonal::gaussian(MOST - 1, (sigma * sigma).recip());
        [1, 2, 3, 4].map(|l| a.get(l).map_or(0.0, |x| (x / a[0]) as f32))
    };
    let views = Views {
        means: means.collect(),
        sweeps: if columns > 1 { all().map(sweep).collect() } else { Vec::new() },
        half_vectors: Vec::new(),
        columns,
        weights: all().map(weight).collect(),
        zonal: if p.is_convolved() { all().map(zonal).collect() } else { Vec::new() },
        lobes,
        diffuse: fit.diffuse.map(|d| d as f32),
        used: Vec::new(),
    };
    let report = report(light, fit, p);
    let looked = |t: &[f32; 4]| f64::from(t[3]).ceil();
    let most = views.means.iter().map(looked).fold(0.0, f64::max);
    let mean = views.means.iter().map(looked).sum::<f64>() / views.count() as f64;
    (
        views,
        report
            .detail("lookups of the most stretched lobe", most)
            .detail("lookups of a point, mean over views", mean),
    )
}

fn report(light: &Light, fit: &GaussianFit, p: &Params) -> Report {
    let [narrow, wide] = light.range();
    let (mut all, mut sharper, mut wider, mut thick) = (0.0, 0.0, 0.0, 0.0);
    for lobe in fit.views.iter().flatten() {
        let weight = lobe.weight.iter().sum::<f64>();
        all += weight;
        sharper += if lobe.sigma < narrow { weight } else { 0.0 };
        wider += if lobe.sigma > wide { weight } else { 0.0 };
        thick += if taps(lobe, p.taps)[0] > 1.01 * lobe.sigma { weight } else { 0.0 };
    }
    let share = |part: f64| if all > 0.0 { part / all } else { 0.0 };
    let mut report = Report::default()
        .detail("bytes of the material", fit.bytes() as f64)
        .detail("levels", light.sigmas.len() as f64)
        .detail("weight sharper than level 0", share(sharper))
        .detail("weight wider than the last level", share(wider))
        .detail("weight looked up wider than it is", share(thick));
    if !fit.report.is_empty() {
        let n = fit.report.len() as f64;
        let mean = fit.report.iter().map(|r| r.energy).sum::<f64>() / n;
        let worst = fit.report.iter().map(|r| r.energy).fold(0.0, f64::max);
        let leak = fit.report.iter().map(|r| r.leak).fold(0.0, f64::max);
        let failed = fit.report.iter().filter(|r| !r.converged).count();
        report = report
            .detail("fit error of the specular part, energy, mean over views", mean)
            .detail("fit error of the specular part, energy, worst view", worst)
            .detail("weight below the horizon, worst view", leak)
            .detail("views whose fit did not converge", failed as f64);
    }
    report
}

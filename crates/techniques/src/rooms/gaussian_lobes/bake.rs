//! The material's factor, the fit; and what of it shading reads for the levels of a chain.

use super::light::Light;
use super::visibility::{self, Blocked, MOST};
use crate::certify::Report;
use crate::shared::material::reflectance;
use crate::tensors::{PartError, TensorFile, get_f32, get_f64, put_f32, put_f64};
use crate::{BakeError, Material, Part};
use std::f64::consts::PI;
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::fit::gaussian::{
    GaussianFit, GaussianLobe, LAST, MAX_LOBES, Objective, Plan, Shape, mean_cosine,
};
use steradian_brdf::model::lobes;
use steradian_brdf::{Brdf, Form, SharedBrdf};
use steradian_sphere::sh::zonal;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// K.
        pub lobes: usize = ParamInfo::whole("lobes", [1.0, 4.0], 3.0, "K, Gaussians of every view (a fit from a file keeps its own)"),
        /// N.
        pub views: usize = ParamInfo::whole("views", [2.0, 64.0], 15.0, "N, elevations of the view, equally spaced from 0 to 89 degrees (a fit from a file keeps its own)"),
        /// What the fit minimises: 0 with the albedo kept, 1 eq. 8.
        pub objective: usize = ParamInfo::choice("objective", &["energy", "published"], "least squares with the albedo of each view kept, or without that condition (eq. 8)").preset("energy"),
        /// M.
        pub azimuths: usize = ParamInfo::whole("azimuths", [4.0, 64.0], 24.0, "M, azimuths of the view where reflectance is anisotropic (a fit from a file keeps its own)"),
        /// What the fit's lobes may be: 0 round, 1 stretched.
        pub shape: usize = ParamInfo::choice("shape", &["round", "stretched"], "round lobes as the paper's, or each swept along the plane of incidence by its own angle: more lookups, far closer at grazing views (a fit from a file keeps its own; those of anisotropic reflectance are stretched, along any direction)").preset("round"),
        /// Lookups of a lobe at most.
        pub taps: usize = ParamInfo::whole("taps", [1.0, MAX_TAPS], 16.0, "lookups of the most stretched lobe; beyond it lookups widen"),
        /// What stands in the way of light, as one of [`VISIBILITY`].
        pub visibility: usize = ParamInfo::choice("visibility", &VISIBILITY, "what a mesh blocks of its own light, by spherical harmonics at its vertices: nothing; the unblocked fraction of the hemisphere; visibility at each lobe's mean (eq. 7); or its mean over the lobe"),
        /// Bands of visibility.
        pub visibility_bands: usize = ParamInfo::whole("visibility_bands", [2.0, 4.0], 4.0, "bands of spherical harmonics of visibility"),
        /// Absolute error of the coefficients of transfer.
        pub precision: f64 = ParamInfo::real("precision", [1e-4, 0.1], 5e-3, "absolute error of the coefficients of transfer, with visibility"),
        /// σ of level 1, degrees.
        pub sigma: f64 = ParamInfo::real("sigma", [0.25, 30.0], 1.0, "width of the first filtered map; level 0 is the light itself").unit("degrees"),
        /// Intervals per cube edge of level 0; the environment's own where `None`.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 1024.0], 0.0, "intervals per cube edge; auto: as fine as the environment, at most 256").auto(0.0).unit("texels"),
    }
}

/// Most lookups of a lobe.
pub(super) const MAX_TAPS: f64 = 64.0;
/// Words of `visibility`.
const VISIBILITY: [&str; 4] = ["none", "ambient", "published", "convolved"];

impl Params {
    /// Does anything block light?
    pub(super) fn is_shadowed(&self) -> bool {
        self.visibility > 0
    }

    /// Bands of visibility: the fraction of the hemisphere is one.
    pub(super) fn bands(&self) -> usize {
        if self.visibility == 1 { 1 } else { self.visibility_bands }
    }

    /// Is visibility convolved with the lobe?
    fn is_convolved(&self) -> bool {
        self.visibility == 3
    }
}

/// Rows of the table from one view of the fit to the next: enough for logarithms of σ to become levels.
const FINER: usize = 8;
/// The same where reflectance is anisotropic, and of columns from one azimuth to the next.
const FINER_TURNED: usize = 2;

/// A reflectance and its lobes.
pub struct Fitted {
    /// `None` in a loaded bake that does not keep what its reflectance's files hold.
    brdf: Option<SharedBrdf>,
    spec: String,
    /// The lobes.
    pub fit: GaussianFit,
}

impl Fitted {
    pub(super) fn new(m: &Material, p: &Params, task: &Task) -> Result<Self, BakeError> {
        let objective = if p.objective == 1 { Objective::Published } else { Objective::Energy };
        let fit = match m.brdf.form() {
            Form::Gaussians(fit) => fit,
            _ => {
                let shape = if p.shape == 1 { Shape::Stretched } else { Shape::Round };
                let plan = Plan { lobes: p.lobes, views: p.views, objective, shape, azimuths: p.azimuths };
                GaussianFit::new(&*m.brdf, plan, task)?
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
        let numbers = lobes::numbers(&self.fit);
        put_f64(to, format!("{prefix}.lobes"), vec![numbers.len()], numbers);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let key = format!("steradian.{prefix}.brdf");
        let spec = from.metadata.get(&key).ok_or_else(|| PartError::Missing(key.clone()))?.clone();
        let name = format!("{prefix}.lobes");
        let (_, numbers) = get_f64(from, &name, 1)?;
        let fit = lobes::from_numbers(&numbers).ok_or(PartError::Unexpected(name))?;
        Ok(Self { brdf: reflectance::kept(from, &key).ok(), spec, fit })
    }

    fn bytes(&self) -> usize {
        self.fit.bytes()
    }

    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        self.brdf.as_deref()
    }
}

/// What shading reads for a view, by θ_o from 0 to [`LAST`], lobe after lobe; where reflectance is anisotropic each row goes once around by the
/// azimuth of the view.
#[derive(Debug, Clone, PartialEq)]
pub struct Views {
    /// Angle of the mean, level of the chain, standard deviation of the angles at which it is looked up, their number; of anisotropic
    /// reflectance the mean's angles in the plane of incidence and out of it, level and number.
    pub means: Vec<[f32; 4]>,
    /// Of anisotropic reflectance that deviation squared, times cosine and sine of twice the angle from the plane to the sweep; 0, 0.
    pub sweeps: Vec<[f32; 4]>,
    /// Columns of a row: 1, or those by the azimuth.
    pub columns: usize,
    /// Weights, 0.
    pub weights: Vec<[f32; 4]>,
    /// A_1, A_2, A_3 of the Gaussian that is looked up, 0; empty where visibility is not convolved with it.
    pub zonal: Vec<[f32; 4]>,
    /// Lobes.
    pub lobes: usize,
    /// ρ_d.
    pub diffuse: [f32; 3],
}

impl Views {
    /// Views of each lobe.
    pub fn count(&self) -> usize {
        self.means.len() / self.lobes
    }

    /// Does the azimuth of the view count?
    pub(super) fn is_turned(&self) -> bool {
        self.columns > 1
    }

    /// Is there a diffuse part?
    pub(super) fn is_diffuse(&self) -> bool {
        self.diffuse.iter().any(|d| *d > 0.0)
    }
}

/// Lookups of a stretched lobe lie so many widths apart: their sum is even to a hundredth.
const APART: f64 = 2.0;
/// And reach so many standard deviations of the sweep to either side; `shade` weights them as a Gaussian with 2 at the ends.
const REACH: f64 = 2.27;
/// Sweeps of less than this times σ widen a lobe by a hundredth.
const LEAST: f64 = 0.15;

/// How a lobe is looked up: σ of the lookups, standard deviation of their angles, number.
fn taps(lobe: &GaussianLobe, most: usize) -> [f64; 3] {
    if lobe.sweep < LEAST * lobe.sigma || most < 3 {
        // One lookup has the lobe's mean second moment.
        let sigma = (0.5 * (lobe.sigma.powi(2) + lobe.along().powi(2))).sqrt();
        return [if lobe.sweep < LEAST * lobe.sigma { lobe.sigma } else { sigma }, 0.0, 1.0];
    }
    // The normal distribution with Von Mises's mean cosine.
    let sweep = (-2.0 * mean_cosine(lobe.sweep).max(0.05).ln()).sqrt();
    let count = 2.0 * REACH * sweep / (APART * lobe.sigma);
    let most = most as f64;
    // Where they would lie too far apart, each is wider, and the sweep so much less that the length stays.
    let sigma = lobe.sigma.max(2.0 * REACH * sweep / (APART * most));
    let rest = (sweep.powi(2) + lobe.sigma.powi(2) - sigma.powi(2)).max(0.0).sqrt();
    [sigma, rest, count.clamp(3.0, most)]
}

/// Joins chain and fit.
pub(super) fn link(light: &Light, m: &Fitted, blocked: &Blocked, p: &Params) -> (Views, Report) {
    let (fit, lobes) = (&m.fit, m.fit.lobes());
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
        columns,
        weights: all().map(weight).collect(),
        zonal: if p.is_convolved() { all().map(zonal).collect() } else { Vec::new() },
        lobes,
        diffuse: fit.diffuse.map(|d| d as f32),
    };
    let report = visibility::report(blocked, &views, report(light, fit, p));
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

impl Part for Views {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let shape = || match self.columns {
            1 => vec![self.lobes, self.count(), 4],
            columns => vec![self.lobes, self.count() / columns, columns, 4],
        };
        put_f32(to, format!("{prefix}.means"), shape(), self.means.concat());
        put_f32(to, format!("{prefix}.weights"), shape(), self.weights.concat());
        put_f32(to, format!("{prefix}.diffuse"), vec![3], self.diffuse.to_vec());
        if self.is_turned() {
            put_f32(to, format!("{prefix}.sweeps"), shape(), self.sweeps.concat());
        }
        if !self.zonal.is_empty() {
            put_f32(to, format!("{prefix}.zonal"), shape(), self.zonal.concat());
        }
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let sweeps = format!("{prefix}.sweeps");
        let turned = from.tensors.contains_key(&sweeps);
        // Lobes, columns, numbers.
        let table = |name: String| -> Result<([usize; 2], Vec<[f32; 4]>), PartError> {
            let (shape, v) = get_f32(from, &name, if turned { 4 } else { 3 })?;
            let columns = if turned { shape[2] } else { 1 };
            let valid = (1..=MAX_LOBES).contains(&shape[0])
                && shape[1] >= 2
                && shape[shape.len() - 1] == 4
                && (!turned || columns >= 2);
            if !valid {
                return Err(PartError::Unexpected(name));
            }
            Ok(([shape[0], columns], v.as_chunks().0.to_vec()))
        };
        let name = format!("{prefix}.means");
        let (size, means) = table(name.clone())?;
        let [lobes, columns] = size;
        // Shading looks up as often as the fourth says.
        if means.iter().any(|m| !(0.0..=MAX_TAPS as f32).contains(&m[3])) {
            return Err(PartError::Unexpected(name));
        }
        let name = format!("{prefix}.weights");
        let (other, weights) = table(name.clone())?;
        if other != size || weights.len() != means.len() {
            return Err(PartError::Unexpected(name));
        }
        let name = sweeps;
        let (other, sweeps) = if turned { table(name.clone())? } else { (size, Vec::new()) };
        if other != size || ![0, means.len()].contains(&sweeps.len()) {
            return Err(PartError::Unexpected(name));
        }
        let name = format!("{prefix}.diffuse");
        let (_, diffuse) = get_f32(from, &name, 1)?;
        let diffuse = diffuse[..].try_into().map_err(|_| PartError::Unexpected(name))?;
        let name = format!("{prefix}.zonal");
        let zonal = if from.tensors.contains_key(&name) { table(name.clone())?.1 } else { Vec::new() };
        if ![0, means.len()].contains(&zonal.len()) {
            return Err(PartError::Unexpected(name));
        }
        Ok(Self { means, sweeps, columns, weights, zonal, lobes, diffuse })
    }

    fn bytes(&self) -> usize {
        16 * (2 * self.means.len() + self.sweeps.len() + self.zonal.len()) + 12
    }
}

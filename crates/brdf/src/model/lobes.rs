//! Fitted Gaussian lobes as a reflectance.
//!
//! Green, Kautz & Durand 2007, eqs 3 and 4: **f n·wi = ρ_d/π ⟨n·wi⟩ + Σ_k w_k G_σk(μ_k − δ)** with what
//! [`crate::fit::gaussian`] interpolates for the view. The lobes cover the whole sphere, as filtered maps
//! hold them.
//!
//! File: safetensors with `lobes` `[N][K][6]` in half precision (angle of the mean from the mirror direction,
//! σ, weights of red, green, blue, s of the sweep), equally spaced views from 0 to 89°, and `diffuse` `[3]`.
//! Without s, `[N][K][5]`, lobes are round. Anisotropic: `lobes` `[N][M][K][8]`, with the angles of the mean
//! out of the plane of incidence and of the sweep at the end, and M azimuths of the view, 2π(j + ½)/M.

use crate::draw::{self, Draw};
use crate::fit::gaussian::{GaussianFit, GaussianLobe, LAST, MAX_LOBES, view_of};
use crate::registry::Entry;
use crate::shader::{four, rgb};
use crate::spec::Args;
use crate::{Brdf, BrdfShader, Domain, Form, Info, Lobe, Peak, Sample, SharedBrdf, SpecError};
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;
use std::sync::Arc;
use steradian_base::ParamInfo;
use steradian_formats::{Limits, Tensor, TensorData, TensorFile, decode_tensors};

/// The page.
pub static INFO: Info = Info {
    name: "lobes",
    source: "Green, Kautz & Durand 2007, eqs 3 and 4",
    formula: "f_cos = ρ_d/π ⟨n·wi⟩ + Σ_k w_k G_σk(μ_k − δ), G spherical Gaussians of integral 1, parameters by the view",
    units: "f_cos sr⁻¹",
    parameters: &[ParamInfo::file("file", "path of a fit (steradian fit)").positional()],
    reciprocity: "not reciprocal: a fit by the view",
    energy: "albedo of what was fitted, at the views of the fit",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

/// Of the file; the numbers in it are bounded by [`MAX_VIEWS`].
const MAX_BYTES: u64 = 1 << 20;
const MAX_VIEWS: usize = 4096;
/// Most densities for a lobe.
const MOST: f64 = 15.0;

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let Some(path) = a.file("file") else {
        return Err(a.syntax("needs the path of a fit, as in lobes:gold.safetensors".into()));
    };
    if let Some(numbers) = a.held() {
        let kept = from_numbers(numbers);
        return kept
            .map(|fit| Arc::new(Lobes::new(a.spec(), fit)) as SharedBrdf)
            .ok_or_else(|| a.syntax(format!("what is kept of {} is damaged", path.display())));
    }
    let bytes = a.bytes(&path, MAX_BYTES, "a fit of Gaussian lobes")?;
    let file = decode_tensors(&path, &bytes, &Limits::default())?;
    let fault = |what: String| SpecError::File { file: path.display().to_string(), what };
    Ok(Arc::new(Lobes::new(a.spec(), of_tensors(&file).map_err(fault)?)))
}

/// A lobe as files and [`numbers`] have it: six numbers, or eight where reflectance is anisotropic.
fn lobe_numbers(fit: &GaussianFit) -> impl Iterator<Item = f64> {
    let count = if fit.is_isotropic() { 6 } else { 8 };
    let lobe = move |l: &GaussianLobe| {
        let [r, g, b] = l.weight;
        [l.angle, l.sigma, r, g, b, l.sweep, l.aside, l.turn].into_iter().take(count)
    };
    fit.views.iter().flatten().flat_map(lobe)
}

/// The tensors of a fit's file; `metadata` goes with them.
pub fn to_tensors(fit: &GaussianFit, metadata: BTreeMap<String, String>) -> TensorFile {
    let lobes: Vec<f64> = lobe_numbers(fit).collect();
    let (n, m, k) = (fit.elevations(), fit.azimuths, fit.lobes());
    let shape = if fit.is_isotropic() { vec![n, k, 6] } else { vec![n, m, k, 8] };
    let diffuse = fit.diffuse.map(|v| v as f32).to_vec();
    let tensors = BTreeMap::from([
        ("lobes".to_owned(), Tensor { shape, data: TensorData::F64(lobes).halved() }),
        ("diffuse".to_owned(), Tensor { shape: vec![3], data: TensorData::F32(diffuse) }),
    ]);
    TensorFile { tensors, metadata }
}

fn of_tensors(file: &TensorFile) -> Result<GaussianFit, String> {
    let (lobes, diffuse) = (file.require("lobes")?, file.require("diffuse")?);
    let (views, azimuths, count) = match (lobes.shape.as_slice(), diffuse.shape.as_slice()) {
        (&[views, count, 5 | 6], &[3]) => (views, 1, count),
        (&[views, azimuths, count, 8], &[3]) => (views, azimuths, count),
        (lobes, diffuse) => {
            return Err(format!(
                "tensors 'lobes' and 'diffuse' have the shapes {lobes:?} and {diffuse:?}, not [N, K, 6] or [N, M, K, 8], and [3]"
            ));
        }
    };
    let mut numbers = vec![views as f64, count as f64];
    numbers.extend(diffuse.data.to_f64().iter());
    if lobes.shape.len() == 4 {
        numbers.push(azimuths as f64);
    }
    numbers.extend(lobes.data.to_f64().iter());
    from_numbers(&numbers).ok_or_else(|| {
        format!("{views} elevations and {azimuths} azimuths of {count} lobes: at least 2 elevations of 1 … {MAX_LOBES} lobes, σ in 1e-5 … 10 and finite numbers are needed, weights not negative")
    })
}

/// The numbers of a fit: N, K, ρ_d, where reflectance is anisotropic M, then those of each lobe as in files.
pub fn numbers(fit: &GaussianFit) -> Vec<f64> {
    let azimuths = Some(fit.azimuths as f64).filter(|_| !fit.is_isotropic());
    let head = [fit.elevations() as f64, fit.lobes() as f64];
    head.into_iter().chain(fit.diffuse).chain(azimuths).chain(lobe_numbers(fit)).collect()
}

/// Reads and checks the numbers of [`numbers`].
pub fn from_numbers(numbers: &[f64]) -> Option<GaussianFit> {
    let ([elevations, count, diffuse @ ..], mut lobes) = numbers.split_first_chunk::<5>()?;
    let (elevations, count) = (*elevations as usize, *count as usize);
    if numbers.iter().any(|v| !v.is_finite()) || elevations < 2 || !(1..=MAX_LOBES).contains(&count) {
        return None;
    }
    let mut azimuths = 1;
    // Round lobes, which have no s, have five numbers, stretched ones six.
    let mut each = [5, 6].into_iter().find(|each| elevations.checked_mul(each * count) == Some(lobes.len()));
    if each.is_none() {
        let (m, rest) = lobes.split_first()?;
        (azimuths, lobes, each) = (*m as usize, rest, Some(8));
    }
    let (views, each) = (elevations.checked_mul(azimuths)?, each?);
    if !(2..=MAX_VIEWS).contains(&views)
        || lobes.len() != each * views * count
        || (each == 8) != (azimuths > 1)
    {
        return None;
    }
    let lobe = |v: &[f64]| {
        let at = |k: usize| v.get(k).copied().unwrap_or(0.0);
        GaussianLobe {
            angle: v[0],
            sigma: v[1],
            weight: [v[2], v[3], v[4]],
            sweep: at(5),
            aside: at(6),
            turn: at(7),
        }
    };
    let all: Vec<GaussianLobe> = lobes.chunks_exact(each).map(lobe).collect();
    let valid = |l: &GaussianLobe| {
        (1e-5..=10.0).contains(&l.sigma)
            && (0.0..=10.0).contains(&l.sweep)
            && [l.angle, l.aside, l.turn].iter().all(|a| a.abs() < 4.0)
            && l.weight.iter().all(|w| *w >= 0.0)
    };
    let views = all.chunks_exact(count).map(<[_]>::to_vec).collect();
    let fit = GaussianFit { azimuths, ..GaussianFit::isotropic(*diffuse, views) };
    (all.iter().all(valid) && diffuse.iter().all(|d| *d >= 0.0)).then_some(fit)
}

/// A fit as a reflectance.
#[derive(Debug, Clone)]
pub struct Lobes {
    spec: String,
    fit: GaussianFit,
}

impl Lobes {
    /// A reflectance of `fit` with the canonical `spec`.
    pub fn new(spec: String, fit: GaussianFit) -> Self {
        Self { spec, fit }
    }

    /// The fit.
    pub fn fit(&self) -> &GaussianFit {
        &self.fit
    }

    /// Densities like the lobes: about their means, several along a stretched one, with weights as theirs.
    fn draw(&self, wo: DVec3) -> Vec<(f64, Draw)> {
        let view = view_of(wo);
        let sum = |w: &[f64; 3]| w.iter().sum::<f64>();
        let mut parts = vec![(sum(&self.fit.diffuse), Draw::Cosine), (0.0, Draw::Uniform)];
        for lobe in &self.fit.at(view)[..self.fit.lobes()] {
            let axes = lobe.axes(view[0]);
            // Round ones a width and a half apart, to two widths of the sweep.
            let count = (1.0 + 2.0 * (4.0 / 3.0 * lobe.sweep / lobe.sigma).ceil()).min(MOST);
            let apart = if count > 1.0 { 4.0 * lobe.sweep / (count - 1.0) } else { 0.0 };
            let sigma = lobe.sigma.max(apart / 1.5);
            let steps = (0..count as usize).map(|k| k as f64 - 0.5 * (count - 1.0));
            let share =
                |k: f64| if apart > 0.0 { (-0.5 * (k * apart / lobe.sweep).powi(2)).exp() } else { 1.0 };
            let all: f64 = steps.clone().map(share).sum();
            for k in steps {
                let weight = sum(&lobe.weight) * share(k) / all;
                // cos^n has the width of a Gaussian of σ² = 1/n; wider lobes reach over the whole sphere.
                if sigma < 0.7 {
                    let (s, c) = (k * apart).sin_cos();
                    let axis = turned(wo, axes.mean * c + axes.along * s);
                    parts.push((weight, Draw::Power { axis, n: (sigma * sigma).recip() * 0.8 }));
                } else {
                    parts[1].0 += weight;
                }
            }
        }
        let total: f64 = parts.iter().map(|p| p.0).sum();
        // Lobes have tails behind their powers' hemispheres.
        parts.iter_mut().for_each(|p| p.0 *= 0.95 / total.max(1e-300));
        parts[1].0 += 0.05;
        if total <= 0.0 {
            parts[0].0 = 0.95;
        }
        parts
    }
}

/// A direction of the frame in which wo has positive x and no y, in the frame of `wo`.
fn turned(wo: DVec3, m: DVec3) -> DVec3 {
    let sine = wo.x.hypot(wo.y);
    let (x, y) = if sine > 0.0 { (wo.x / sine, wo.y / sine) } else { (1.0, 0.0) };
    DVec3::new(m.x * x - m.y * y, m.x * y + m.y * x, m.z)
}

impl Brdf for Lobes {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn held(&self) -> Option<Vec<f64>> {
        Some(numbers(&self.fit))
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wi.z <= 0.0 {
            return [0.0; 3];
        }
        self.f_cos(wi, wo).map(|f| f / wi.z)
    }

    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.fit.f_cos(wi, wo)
    }

    fn f_cos_batch(&self, wi: &[DVec3], wo: DVec3, out: &mut [[f64; 3]]) {
        self.fit.f_cos_batch(wi, wo, out);
    }

    fn domain(&self) -> Domain {
        Domain::Sphere
    }

    fn is_isotropic(&self) -> bool {
        self.fit.is_isotropic()
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        let view = view_of(wo);
        let wanted = |l: &GaussianLobe| l.weight.iter().any(|w| *w > 0.0) && l.sigma < 1.0;
        let mut all: Vec<GaussianLobe> = self.fit.at(view)[..self.fit.lobes()].to_vec();
        all.retain(wanted);
        all.sort_by(|a, b| a.sigma.total_cmp(&b.sigma));
        // A stretched lobe is a ridge along its sweep; the narrowest one represents all.
        let ridge = |l: &&GaussianLobe| l.sweep > l.sigma;
        let arc = |l: &GaussianLobe| {
            let across = turned(wo, l.axes(view[0]).across);
            Lobe::Arc { normal: across, width: l.sigma }
        };
        let ridges: Vec<Lobe> = all.iter().filter(ridge).take(1).map(arc).collect();
        let axis = |l: GaussianLobe| Lobe::Axis { axis: turned(wo, l.axes(view[0]).mean), width: l.sigma };
        all.into_iter().map(axis).chain(ridges).collect()
    }

    fn peak(&self) -> Peak {
        let narrow = self.fit.views[0].iter().filter(|l| l.weight.iter().any(|w| *w > 0.0));
        match narrow.map(|l| l.sigma).min_by(f64::total_cmp) {
            // A width of half vectors is half of that of reflected directions.
            Some(sigma) => Peak::Mirror { narrow: 0.5 * sigma, wide: 0.5 * sigma },
            None => Peak::Smooth,
        }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let fit = &self.fit;
        let lobe =
            |l: &GaussianLobe| [[l.angle, l.aside, 0.0], l.spread(), l.weight].map(|v| v.map(|x| x as f32));
        let cells = fit.views.iter().flatten().flat_map(lobe).collect();
        let counts = four([fit.elevations() as f64, fit.lobes() as f64, LAST, fit.azimuths as f64]);
        let parameters = [rgb(fit.diffuse), counts];
        let shader =
            BrdfShader::new(include_str!("lobes.wgsl"), self.peak(), self.domain(), parameters).with_f_cos();
        // A fit in memory may have a single view; fits in files have at least two.
        (fit.elevations() > 1).then(|| shader.with_cells(Arc::new(cells)))
    }

    fn form(&self) -> Form {
        Form::Gaussians(self.fit.clone())
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.draw(wo), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        if wo.z <= 0.0 { 0.0 } else { draw::pdf(&self.draw(wo), wi, wo) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::check_measured;
    use crate::fit::gaussian::Plan;
    use crate::{Files, parse, parse_with};
    use steradian_base::Task;
    use steradian_formats::write_tensors;

    #[test]
    fn a_fit_goes_through_a_file_and_back() {
        let folder = std::env::temp_dir().join(format!("steradian-lobes-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("a folder");
        let path = folder.join("a.safetensors");
        let source = parse("dielectric:alpha=0.15,albedo=0.5/0.3/0.1").expect("spec");
        let fit = GaussianFit::new(&*source, Plan::default(), &Task::quiet()).expect("not cancelled");
        write_tensors(&path, &to_tensors(&fit, BTreeMap::new())).expect("written");
        assert!(std::fs::metadata(&path).expect("there").len() <= 1126, "one kilobyte and a tenth");
        let spec = format!("lobes:{}", path.display());
        let brdf = parse_with(&spec, Files::Any).expect("valid");
        check_measured(&*brdf);
        let (wi, wo) = (DVec3::new(-0.5, 0.1, 0.8).normalize(), DVec3::new(0.6, 0.0, 0.8));
        let (a, b) = (brdf.f_cos(wi, wo), fit.f_cos(wi, wo));
        assert!((0..3).all(|c| (a[c] - b[c]).abs() < 2e-3 * b[c]), "half precision: {a:?} {b:?}");
        let held = brdf.held().expect("numbers");
        assert_eq!(parse_with(&brdf.spec(), Files::Held(&held)).expect("kept").f_cos(wi, wo), a);
        assert!(parse_with(&brdf.spec(), Files::Held(&held[1..])).is_err());
        let mut wrong = to_tensors(&fit, BTreeMap::new());
        wrong.tensors.remove("diffuse");
        assert!(of_tensors(&wrong).expect_err("incomplete").contains("no tensor 'diffuse'"));
        let mut negative = fit.clone();
        negative.views[3][1].sigma = -0.1;
        assert!(of_tensors(&to_tensors(&negative, BTreeMap::new())).is_err());
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}

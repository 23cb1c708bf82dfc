//! Fitted Gaussian lobes as a reflectance: what a fit means.
//!
//! Green, Kautz & Durand 2007, eqs 3 and 4: **f n·wi = ρ_d/π ⟨n·wi⟩ + Σ_k w_k G_σk(μ_k − δ)** with what [`crate::fit::gaussian`]
//! interpolates for the view. The lobes cover the whole sphere, as filtered maps hold them.
//!
//! File: safetensors with `lobes` `[N][K][6]` in half precision (angle of the mean from the mirror direction, σ, weights of red,
//! green, blue, s of the sweep), equally spaced views from 0 to 89°, and `diffuse` `[3]`. Without s, `[N][K][5]`, lobes are round.

use crate::draw::{self, Draw};
use crate::fit::gaussian::{GaussianFit, GaussianLobe, LAST, MAX_LOBES};
use crate::math::polar_angle;
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

const MAX_BYTES: u64 = 1 << 20;
const MAX_VIEWS: usize = 1024;
/// Densities for a lobe at most.
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

/// The tensors of a fit's file; `metadata` goes with them.
pub fn to_tensors(fit: &GaussianFit, metadata: BTreeMap<String, String>) -> TensorFile {
    let lobe = |l: &GaussianLobe| {
        let [r, g, b] = l.weight;
        [l.angle, l.sigma, r, g, b, l.sweep]
    };
    let lobes: Vec<f64> = fit.views.iter().flatten().flat_map(lobe).collect();
    let shape = vec![fit.views.len(), fit.lobes(), 6];
    let diffuse = fit.diffuse.map(|v| v as f32).to_vec();
    let tensors = BTreeMap::from([
        ("lobes".to_owned(), Tensor { shape, data: TensorData::F64(lobes).halved() }),
        ("diffuse".to_owned(), Tensor { shape: vec![3], data: TensorData::F32(diffuse) }),
    ]);
    TensorFile { tensors, metadata }
}

fn of_tensors(file: &TensorFile) -> Result<GaussianFit, String> {
    let (lobes, diffuse) = (file.require("lobes")?, file.require("diffuse")?);
    let (&[views, count, 5 | 6], &[3]) = (lobes.shape.as_slice(), diffuse.shape.as_slice()) else {
        let found = (&lobes.shape, &diffuse.shape);
        return Err(format!(
            "tensors 'lobes' and 'diffuse' have the shapes {:?} and {:?}, not [N, K, 6] and [3]",
            found.0, found.1
        ));
    };
    let numbers: Vec<f64> = [views as f64, count as f64]
        .into_iter()
        .chain(diffuse.data.to_f64().iter().copied())
        .chain(lobes.data.to_f64().iter().copied())
        .collect();
    from_numbers(&numbers).ok_or_else(|| {
        format!("{views} views of {count} lobes: at least 2 views of 1 … {MAX_LOBES} lobes, σ in 1e-5 … 10 and finite numbers are needed, weights not negative")
    })
}

/// The numbers of a fit: views, lobes, ρ_d, then six per lobe as in files.
pub fn numbers(fit: &GaussianFit) -> Vec<f64> {
    let lobe = |l: &GaussianLobe| [l.angle, l.sigma, l.weight[0], l.weight[1], l.weight[2], l.sweep];
    let head = [fit.views.len() as f64, fit.lobes() as f64];
    head.into_iter().chain(fit.diffuse).chain(fit.views.iter().flatten().flat_map(lobe)).collect()
}

/// What [`numbers`] gave, checked.
pub fn from_numbers(numbers: &[f64]) -> Option<GaussianFit> {
    let ([views, count, r, g, b], lobes) = numbers.split_first_chunk::<5>()?;
    let (views, count) = (*views as usize, *count as usize);
    let fits = (2..=MAX_VIEWS).contains(&views) && (1..=MAX_LOBES).contains(&count);
    if !fits {
        return None;
    }
    // Without s five: round ones.
    let each = if lobes.len() == 5 * views * count { 5 } else { 6 };
    if lobes.len() != each * views * count || numbers.iter().any(|v| !v.is_finite()) {
        return None;
    }
    let lobe = |v: &[f64]| GaussianLobe {
        angle: v[0],
        sigma: v[1],
        sweep: v.get(5).copied().unwrap_or(0.0),
        weight: [v[2], v[3], v[4]],
    };
    let all: Vec<GaussianLobe> = lobes.chunks_exact(each).map(lobe).collect();
    let valid = |l: &GaussianLobe| {
        (1e-5..=10.0).contains(&l.sigma)
            && (0.0..=10.0).contains(&l.sweep)
            && l.angle.abs() < 4.0
            && l.weight.iter().all(|w| *w >= 0.0)
    };
    let views = all.chunks_exact(count).map(<[_]>::to_vec).collect();
    let diffuse = [*r, *g, *b];
    (all.iter().all(valid) && diffuse.iter().all(|d| *d >= 0.0)).then_some(GaussianFit {
        diffuse,
        views,
        report: Vec::new(),
    })
}

/// A fit as a reflectance.
#[derive(Debug, Clone)]
pub struct Lobes {
    spec: String,
    fit: GaussianFit,
}

impl Lobes {
    /// `spec` is what it says of itself.
    pub fn new(spec: String, fit: GaussianFit) -> Self {
        Self { spec, fit }
    }

    /// The fit.
    pub fn fit(&self) -> &GaussianFit {
        &self.fit
    }

    /// Densities like the lobes: about their means, several along a stretched one, with weights as theirs.
    fn draw(&self, wo: DVec3) -> Vec<(f64, Draw)> {
        let theta = polar_angle(wo);
        let sum = |w: &[f64; 3]| w.iter().sum::<f64>();
        let mut parts = vec![(sum(&self.fit.diffuse), Draw::Cosine), (0.0, Draw::Uniform)];
        for lobe in &self.fit.at(theta)[..self.fit.lobes()] {
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
                    let axis =
                        turned(wo, GaussianLobe { angle: lobe.angle + k * apart, ..*lobe }.mean(theta));
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

/// A direction of the plane of x and z in which wo has positive x, in the frame of `wo`.
fn turned(wo: DVec3, m: DVec3) -> DVec3 {
    let sine = wo.x.hypot(wo.y);
    let (x, y) = if sine > 0.0 { (wo.x / sine, wo.y / sine) } else { (1.0, 0.0) };
    DVec3::new(m.x * x, m.x * y, m.z)
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

    fn domain(&self) -> Domain {
        Domain::Sphere
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        let theta = polar_angle(wo);
        let wanted = |l: &GaussianLobe| l.weight.iter().any(|w| *w > 0.0) && l.sigma < 1.0;
        let mut all: Vec<GaussianLobe> = self.fit.at(theta)[..self.fit.lobes()].to_vec();
        all.retain(wanted);
        all.sort_by(|a, b| a.sigma.total_cmp(&b.sigma));
        // A stretched one is a ridge along the plane of incidence.
        let across = turned(wo, DVec3::X).cross(DVec3::Z).normalize_or(DVec3::Y);
        let ridge = |l: &&GaussianLobe| l.sweep > l.sigma;
        let ridges: Vec<Lobe> =
            all.iter().filter(ridge).take(1).map(|l| Lobe::Arc { normal: across, width: l.sigma }).collect();
        let axis = |l: GaussianLobe| Lobe::Axis { axis: turned(wo, l.mean(theta)), width: l.sigma };
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
        let GaussianFit { diffuse, views, .. } = &self.fit;
        let lobe = |l: &GaussianLobe| {
            [[l.angle, l.sigma.ln(), l.along().ln()], l.weight].map(|v| v.map(|x| x as f32))
        };
        let cells = views.iter().flatten().flat_map(lobe).collect();
        let parameters = [rgb(*diffuse), four([views.len() as f64, self.fit.lobes() as f64, LAST, 0.0])];
        let shader = BrdfShader::new(include_str!("lobes.wgsl"), self.peak(), self.domain(), parameters);
        // A fit in memory may have a single view; what files hold has two at least.
        (views.len() > 1).then(|| shader.with_cells(Arc::new(cells)))
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

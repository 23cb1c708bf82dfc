//! The array of cubes.

use super::BanksEnv;
use super::fibre::Fibre;
use super::plan::{self, Plan};
use crate::certify::{Model, Report, Target, one_by_one};
use crate::shared::light::distant::DistantLight;
use crate::shared::material::reflectance::Reflectance;
use crate::shared::tables::chain::Chain;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Part, Technique};
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::Form;
use steradian_brdf::model::strand::Kind;
use steradian_parallel::prelude::*;
use steradian_prefilter::cube_array;

/// Tolerance where the user gives none.
const TOLERANCE: f64 = 0.01;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Intervals per cube edge; where `None`, as many as the tolerance needs.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 512.0], 0.0, "intervals per cube edge of each map; auto: what the tolerance needs, at most 128").auto(0.0).unit("texels"),
        /// Slices; where `None`, as many as the tolerance needs.
        pub slices: Option<usize> = ParamInfo::whole("slices", [1.0, 97.0], 0.0, "maps over the angle between tangent and viewer, 0 to 90°, at least 2 (the other half is the same); auto: what the tolerance needs").auto(0.0),
        /// Does `banks` keep a mean cosine?
        pub mean_cosine: bool = ParamInfo::switch("mean_cosine", true, "banks keeps the mean of n·wi outside the integral; off: n·wi is dropped, as in eq. 35"),
    }
}

/// G(d, α) over d for α = 0 … π/2.
#[derive(Debug, Clone, PartialEq)]
pub struct ConeMaps {
    /// One map per α, equally spaced.
    pub maps: Chain,
    /// Factor of the model.
    pub scale: [f32; 3],
    /// d = sign · t where wo·t ≥ 0, else −sign · t.
    pub sign: f32,
}

/// Makes the cubes. Returns also their plan, and the flux that clipping added to them, relative to all flux.
pub fn make(
    light: &DistantLight,
    fibre: &Fibre,
    p: &Params,
    task: &Task,
) -> Result<(ConeMaps, Plan, f64), BakeError> {
    let slug = BanksEnv::CARD.slug;
    let tolerance = task.tolerance().unwrap_or(TOLERANCE).min(0.1);
    let plan =
        Plan::new(light.source(), fibre, p.slices.map_or(0, |n| n.max(2)), p.size.unwrap_or(0), tolerance);
    let samples = 6 * ((plan.size + 1) * (plan.size + 1)) as u64;
    let need = samples * (16 * plan.slices as u64 + 36);
    if need > task.max_memory() {
        return Err(BakeError::Memory { slug, need, allowed: task.max_memory() });
    }
    let kernel = |j: usize| {
        let k = fibre.coefficients(plan::alpha(j, plan.slices), plan.order);
        k.into_iter().enumerate().map(|(l, k)| k * plan.window(l)).collect()
    };
    let kernels: Vec<Vec<f64>> = (0..plan.slices).into_par_iter().map(kernel).collect();
    let made = cube_array(light.source(), &kernels, plan.size, task)?;
    let maps = Chain::new(made.cubes).ok_or_else(|| BakeError::Light { slug, why: "no slices".into() })?;
    Ok((ConeMaps { maps, scale: fibre.scale.map(|s| s as f32), sign: fibre.sign as f32 }, plan, made.clipped))
}

/// Makes the cubes.
pub fn link(
    light: &DistantLight,
    m: &Reflectance,
    p: &Params,
    task: &Task,
) -> Result<(ConeMaps, Report), BakeError> {
    let fibre = Fibre::new(m, p.mean_cosine);
    let (cones, plan, clipped) = make(light, &fibre, p, task)?;
    let report = Report::default()
        .detail("slices", plan.slices as f64)
        .detail("size", plan.size as f64)
        .detail("order", plan.order as f64)
        .detail("blur", plan.blur.sqrt())
        .detail("clipped", clipped);
    Ok((cones, report))
}

/// The reflectance that the tables integrate, where the parameters leave n·wi out as the paper does.
pub fn map<'a>(m: &'a Reflectance, p: &Params) -> Option<Target<'a>> {
    let fibre = Fibre::new(m, p.mean_cosine);
    let f_cos = one_by_one(fibre.f_map());
    let model = Model { whole: true, lobes: Box::new(|wo| m.brdf.lobes(wo)), f_cos };
    matches!(m.form(), Form::Strand { kind: Kind::Banks, .. }).then_some(Target::Integral(model))
}

impl Part for ConeMaps {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.maps.save(to, prefix);
        let factors = [&self.scale[..], &[self.sign]].concat();
        put_f32(to, format!("{prefix}.factors"), vec![4], factors);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.factors");
        let (_, v) = get_f32(from, &name, 1)?;
        let [r, g, b, sign] = v[..] else { return Err(PartError::Unexpected(name)) };
        Ok(Self { maps: Chain::load(from, prefix)?, scale: [r, g, b], sign })
    }

    fn bytes(&self) -> usize {
        self.maps.bytes() + 16
    }
}

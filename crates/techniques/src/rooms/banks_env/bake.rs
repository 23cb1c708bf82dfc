//! The stack of maps.

use super::fibre::Fibre;
use super::plan::{self, Plan};
use super::{BanksEnv, shade};
use crate::shared::certify;
use crate::shared::chain::Chain;
use crate::shared::distant::DistantLight;
use crate::shared::reflectance::Reflectance;
use crate::shared::turn::Turn;
use crate::tensors::{PartError, TensorFile, get_f32, put_f32};
use crate::{BakeError, Part, Technique};
use rayon::prelude::*;
use steradian_base::{Certificate, ParamError, ParamInfo, ParamValues, Task};
use steradian_prefilter::stack;

const SIZE: ParamInfo = ParamInfo::whole(
    "size",
    [0.0, 512.0],
    0.0,
    "intervals per cube edge of each map; 0: what the tolerance needs, at most 128",
)
.unit("texels");
const SLICES: ParamInfo = ParamInfo::whole(
    "slices",
    [0.0, 97.0],
    0.0,
    "maps over the angle between tangent and viewer, 0 to 90°, at least 2 (the other half is the same); 0: what the \
          tolerance needs",
);
const MEAN_COSINE: ParamInfo = ParamInfo::switch(
    "mean_cosine",
    true,
    "1: banks keeps the mean of n·wi outside the integral; 0: n·wi is dropped, as in eq. 35",
);

/// Tolerance where the user gives none.
const TOLERANCE: f64 = 0.01;

/// The parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Params {
    /// Intervals per cube edge; 0 takes what the tolerance needs.
    pub size: usize,
    /// Slices; 0 takes what the tolerance needs.
    pub slices: usize,
    /// Does `banks` keep a mean cosine?
    pub mean_cosine: bool,
}

impl steradian_base::Params for Params {
    const INFO: &'static [ParamInfo] = &[SIZE, SLICES, MEAN_COSINE];

    fn from_values(values: &ParamValues) -> Result<Self, ParamError> {
        values.check(Self::INFO)?;
        let slices = values.get(&SLICES) as usize;
        Ok(Self {
            size: values.get(&SIZE) as usize,
            slices: if slices == 0 { 0 } else { slices.max(2) },
            mean_cosine: values.get(&MEAN_COSINE) == 1.0,
        })
    }

    fn to_values(&self) -> ParamValues {
        let mean_cosine = if self.mean_cosine { 1.0 } else { 0.0 };
        let pairs = [(SIZE, self.size as f64), (SLICES, self.slices as f64), (MEAN_COSINE, mean_cosine)];
        ParamValues(pairs.into_iter().map(|(i, v)| (i.name.to_string(), v)).collect())
    }
}

/// G(d, α) over d for α = 0 … π/2.
#[derive(Debug, Clone, PartialEq)]
pub struct Cones {
    /// One map per α, equally spaced.
    pub maps: Chain,
    /// Factor of the model.
    pub scale: [f32; 3],
    /// d = sign · t where wo·t ≥ 0, else −sign · t.
    pub sign: f32,
}

/// The stack, how it was planned, and the flux that clipping added to it, relative to all.
pub fn make(
    light: &DistantLight,
    fibre: &Fibre,
    p: &Params,
    task: &Task,
) -> Result<(Cones, Plan, f64), BakeError> {
    let slug = BanksEnv::CARD.slug;
    let tolerance = task.tolerance().unwrap_or(TOLERANCE).min(0.1);
    let plan = Plan::new(&light.source, fibre, p.slices, p.size, tolerance);
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
    let made = stack(&light.source, &kernels, plan.size, task)?;
    let maps = Chain::new(made.cubes).ok_or_else(|| BakeError::Light { slug, why: "no slices".into() })?;
    Ok((Cones { maps, scale: fibre.scale.map(|s| s as f32), sign: fibre.sign as f32 }, plan, made.clipped))
}

/// Makes the stack; the certificate compares with the integral of the model itself (with its cosine and horizon).
pub fn link(
    light: &DistantLight,
    m: &Reflectance,
    p: &Params,
    task: &Task,
) -> Result<(Cones, Certificate), BakeError> {
    let fibre = Fibre::new(m, p.mean_cosine);
    let (cones, plan, clipped) = make(light, &fibre, p, task)?;
    let shade = |q: &crate::Points<'_>, out: &mut crate::Radiance<'_>| {
        shade::shade(&cones, &Turn::default(), q, out);
    };
    let mut certificate = certify::measure(&light.tree, &*m.brdf, task, shade)?
        .certificate()
        .detail("slices", plan.slices as f64)
        .detail("size", plan.size as f64)
        .detail("order", plan.order as f64)
        .detail("blur", plan.blur.sqrt())
        .detail("clipped", clipped);
    if m.name() == "banks" {
        // What the tables alone err by, n·wi aside.
        let lobes = |wo| m.brdf.lobes(wo);
        let model = certify::Model { whole: true, lobes: &lobes, f_cos: &fibre.f_map() };
        let maps = certify::measure_model(&light.tree, &model, task, shade)?;
        certificate = certificate.detail("maps", maps.all);
    }
    Ok((cones, certificate))
}

impl Part for Cones {
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

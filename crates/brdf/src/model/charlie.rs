//! Sheen of cloth.
//!
//! Estevez & Kulla 2017, Production Friendly Microfacet Sheen BRDF, eq. 2 and section 3, as glTF's
//! KHR_materials_sheen has it (without terminator softening): **f = color D/(4 n·wi n·wo (1 + Λ(n·wi) +
//! Λ(n·wo)))**, D = (2 + 1/α) sin^(1/α) θ_h/2π, Λ their fit.

use crate::dfg::charlie::lambda;
use crate::draw::{self, Draw};
use crate::math::{above, half, times};
use crate::registry::Entry;
use crate::shader::{BrdfShader, with};
use crate::spec::{self, Args};
use crate::{Brdf, Info, Lobe, Peak, Sample, SharedBrdf, SpecError};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page.
pub static INFO: Info = Info {
    name: "charlie",
    source: "Estevez & Kulla 2017, eq. 2 and section 3; KHR_materials_sheen",
    formula: "f = color D/(4 n·wi n·wo (1 + Λ(n·wi) + Λ(n·wo))), D = (2 + 1/α) sin^(1/α) θ_h/2π, Λ fitted",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::real("alpha", [0.01, 1.0], 0.0, "width of D, sheen roughness squared").required(),
        ParamInfo::rgb("color", [0.0, 1.0], 1.0, "sheen colour"),
    ],
    reciprocity: "reciprocal",
    energy: "not bounded by construction: albedo below 1 up to 88° from the normal for alpha ≥ 0.05",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let alpha = a.number("alpha")?;
    Ok(Arc::new(Charlie { alpha, color: a.rgb("color")? }))
}

/// Estevez and Kulla's sheen.
#[derive(Debug, Clone, Copy)]
pub struct Charlie {
    alpha: f64,
    color: [f64; 3],
}

/// Half of the samples by the cosine, half uniform: light comes from all sides, much of it from near the
/// horizon.
const DRAW: [(f64, Draw); 2] = [(0.5, Draw::Cosine), (0.5, Draw::Uniform)];

impl Brdf for Charlie {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        spec::print(&INFO, [("alpha", self.alpha.into()), ("color", self.color.into())])
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        let h = half(wi, wo);
        let power = 1.0 / self.alpha;
        let d = (2.0 + power) * h.x.hypot(h.y).min(1.0).powf(power) / (2.0 * PI);
        let shadow = 1.0 + lambda(wi.z.min(1.0), self.alpha) + lambda(wo.z.min(1.0), self.alpha);
        times(self.color, d / (4.0 * shadow * wi.z * wo.z).max(1e-150))
    }

    fn lobes(&self, _: DVec3) -> Vec<Lobe> {
        Vec::new()
    }

    fn peak(&self) -> Peak {
        Peak::Anywhere { width: self.alpha.sqrt() }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let parameters = [with(self.color, self.alpha)];
        Some(BrdfShader::new(include_str!("charlie.wgsl"), self.peak(), self.domain(), parameters))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&DRAW, wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&DRAW, wi, wo)
    }
}

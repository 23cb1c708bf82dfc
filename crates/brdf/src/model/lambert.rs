//! Ideal diffuse reflection.
//!
//! Lambert 1760, Photometria: the radiance does not depend on the view. **f = albedo/π**.

use crate::draw::{self, Draw};
use crate::math::{INV_PI, above, times};
use crate::registry::Entry;
use crate::shader::{BrdfShader, rgb};
use crate::spec;
use crate::{Brdf, Form, Info, Lobe, Peak, Sample};
use glam::{DVec2, DVec3};
use steradian_base::ParamInfo;

/// The page.
pub static INFO: Info = Info {
    name: "lambert",
    source: "Lambert 1760, Photometria",
    formula: "f = albedo/π",
    units: "sr⁻¹",
    parameters: &[ParamInfo::rgb("albedo", [0.0, 1.0], 1.0, "directional-hemispherical reflectance")],
    reciprocity: "reciprocal",
    energy: "albedo ≤ 1 for every view",
};

pub(crate) const ENTRY: Entry =
    Entry { info: &INFO, make: |a| Ok(std::sync::Arc::new(Lambert { albedo: a.rgb("albedo")? })) };

/// f = albedo/π.
#[derive(Debug, Clone, Copy)]
pub struct Lambert {
    /// Per channel, 0 … 1.
    pub albedo: [f64; 3],
}

const DRAW: &[(f64, Draw)] = &[(1.0, Draw::Cosine)];

impl Brdf for Lambert {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        spec::print(&INFO, [("albedo", self.albedo.into())])
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if above(wi, wo) { times(self.albedo, INV_PI) } else { [0.0; 3] }
    }

    fn lobes(&self, _wo: DVec3) -> Vec<Lobe> {
        Vec::new()
    }

    fn peak(&self) -> Peak {
        Peak::Smooth
    }

    fn form(&self) -> Form {
        Form::Lambert { albedo: self.albedo }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let parameters = [rgb(self.albedo)];
        Some(BrdfShader::new(include_str!("lambert.wgsl"), self.peak(), self.domain(), parameters))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(DRAW, wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(DRAW, wi, wo)
    }
}

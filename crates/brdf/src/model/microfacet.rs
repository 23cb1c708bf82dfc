//! The simplified microfacet model, defined with the cosine in.
//!
//! Ramamoorthi & Hanrahan 2002, Frequency Space Environment Map Rendering, eq. 5.34, θ_h = ∠(n, h):
//! **f_cos = exp(−(θ_h/σ)²)/(4πσ²)** above the horizon.

use crate::draw::{self, Draw};
use crate::math::{above, half, polar_angle};
use crate::registry::Entry;
use crate::shader::{BrdfShader, four};
use crate::spec;
use crate::{Brdf, Info, Lobe, Peak, Sample, hint};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use steradian_base::ParamInfo;

/// The page.
pub static INFO: Info = Info {
    name: "microfacet",
    source: "Ramamoorthi & Hanrahan 2002, eq. 5.34",
    formula: "f_cos = exp(−(θ_h/σ)²)/(4πσ²) above the horizon, θ_h = ∠(n, h)",
    units: "f_cos sr⁻¹",
    parameters: &[ParamInfo::real("sigma", [1e-4, 10.0], 0.0, "width in radians").required()],
    reciprocity: "not reciprocal: the formula holds the cosine of one direction only (f_cos itself is symmetric)",
    energy: "albedo ≤ 1; about n·wo at grazing views of narrow lobes, 1 − O(σ²) at normal view",
};

pub(crate) const ENTRY: Entry = Entry {
    info: &INFO,
    make: |a| {
        let sigma = a.number("sigma")?;
        Ok(std::sync::Arc::new(Microfacet { sigma }))
    },
};

/// RH02's Gaussian of the half angle.
#[derive(Debug, Clone, Copy)]
pub struct Microfacet {
    /// Radians.
    pub sigma: f64,
}

impl Microfacet {
    fn draw(&self) -> [(f64, Draw); 1] {
        let alpha = self.sigma.min(1.0);
        [(1.0, Draw::Visible { ax: alpha, ay: alpha })]
    }
}

impl Brdf for Microfacet {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        spec::print(&INFO, [("sigma", self.sigma.into())])
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if wi.z <= 0.0 {
            return [0.0; 3];
        }
        self.f_cos(wi, wo).map(|v| v / wi.z)
    }

    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        let x = polar_angle(half(wi, wo)) / self.sigma;
        [(-x * x).exp() / (4.0 * PI * self.sigma * self.sigma); 3]
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        let slope = 0.7 * self.sigma.min(1.0);
        hint::half_vector(self, wo, slope, slope)
    }

    fn peak(&self) -> Peak {
        let width = 1.4 * self.sigma.min(1.0);
        Peak::Mirror { narrow: width, wide: width }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let parameters = [four([self.sigma, 0.0, 0.0, 0.0])];
        Some(
            BrdfShader::new(include_str!("microfacet.wgsl"), self.peak(), self.domain(), parameters)
                .with_f_cos(),
        )
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.draw(), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&self.draw(), wi, wo)
    }
}

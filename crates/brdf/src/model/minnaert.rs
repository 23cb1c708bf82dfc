//! Limb darkening.
//!
//! Minnaert 1941, The reciprocity principle in lunar photometry; 1961, Photometry of the Moon: the radiance
//! goes as (n·wi)^k (n·wo)^(k−1): **f = albedo/π ((n·wi)(n·wo))^(k−1)**. k = 1 is Lambert; k < 1 brightens
//! the limb (and f grows without bound there), k > 1 darkens it. "albedo" is Minnaert's, not the albedo of
//! the surface: at normal view that is 2 albedo/(k + 1).

use crate::draw::{self, Draw};
use crate::math::{INV_PI, above, times};
use crate::registry::Entry;
use crate::shader::{BrdfShader, with};
use crate::spec::{self, Args};
use crate::{Brdf, Info, Lobe, Peak, Sample, SharedBrdf, SpecError};
use glam::{DVec2, DVec3};
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page.
pub static INFO: Info = Info {
    name: "minnaert",
    source: "Minnaert 1941; 1961, Photometry of the Moon",
    formula: "f = albedo/π ((n·wi)(n·wo))^(k−1)",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::real("k", [0.0, 100.0], 0.0, "limb darkening exponent, 1 is Lambert").required(),
        ParamInfo::rgb("albedo", [0.0, 1.0], 1.0, "factor"),
    ],
    reciprocity: "reciprocal",
    energy: "not conserved for k < 1: directional albedo 2 albedo/(k + 1) (n·wo)^(k−1); at most 1 for k ≥ 1",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let k = a.number("k")?;
    Ok(Arc::new(Minnaert { k, albedo: a.rgb("albedo")? }))
}

/// Minnaert's limb darkening.
#[derive(Debug, Clone, Copy)]
pub struct Minnaert {
    k: f64,
    albedo: [f64; 3],
}

impl Minnaert {
    /// Density (k + 1)/2π cos^k about n: exactly proportional to f_cos.
    fn draw(&self) -> [(f64, Draw); 1] {
        [(1.0, Draw::Power { axis: DVec3::Z, n: self.k })]
    }
}

impl Brdf for Minnaert {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        spec::print(&INFO, [("k", self.k.into()), ("albedo", self.albedo.into())])
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        times(self.albedo, INV_PI * (wi.z * wo.z).powf(self.k - 1.0))
    }

    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        times(self.albedo, INV_PI * wi.z.powf(self.k) * wo.z.powf(self.k - 1.0))
    }

    fn lobes(&self, _wo: DVec3) -> Vec<Lobe> {
        let width = (1.0 / (self.k + 1.0)).sqrt();
        if width < 0.5 { vec![Lobe::Axis { axis: DVec3::Z, width }] } else { Vec::new() }
    }

    fn peak(&self) -> Peak {
        Peak::Anywhere { width: (1.0 / (self.k + 1.0)).sqrt() }
    }

    fn shader(&self) -> Option<BrdfShader> {
        let parameters = [with(self.albedo, self.k)];
        Some(
            BrdfShader::new(include_str!("minnaert.wgsl"), self.peak(), self.domain(), parameters)
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

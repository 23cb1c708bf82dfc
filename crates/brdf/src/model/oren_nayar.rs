//! Rough diffuse surfaces of Lambertian V-cavities.
//!
//! Oren & Nayar 1994, Generalization of Lambert's Reflectance Model. α = max(θ_i, θ_o), β = min(θ_i, θ_o),
//! Δφ the azimuth between wi and wo. With c = wi·wo − n·wi n·wo = sin θ_i sin θ_o cos Δφ:
//! cos Δφ sin α tan β = c/max(n·wi, n·wo), which needs no angle.
//!
//! - `qualitative` (eq. 30): **f = albedo/π (A + B max(0, cos Δφ) sin α tan β)**, A = 1 − ½σ²/(σ² + 0.33),
//!   B = 0.45 σ²/(σ² + 0.09).
//! - `full` (eqs 27, 28): **f = albedo/π (C₁ + cos Δφ C₂ tan β + (1 − |cos Δφ|) C₃ tan((α + β)/2))
//!   + 0.17 albedo²/π σ²/(σ² + 0.13)(1 − cos Δφ (2β/π)²)**.
//! - `fujii` (Fujii 2012, A tiny improvement of Oren–Nayar reflectance model): **f = albedo (A + B c/t)**,
//!   t = 1 for c ≤ 0, else max(n·wi, n·wo); A = 1/(π + (π/2 − 2/3)σ), B = σA, with 0 ≤ σ ≤ 1.

use crate::draw::{self, Draw};
use crate::math::{INV_PI, above, times};
use crate::registry::Entry;
use crate::shader::{BrdfShader, four, rgb};
use crate::spec::{self, Args};
use crate::{Brdf, Info, Lobe, Peak, Sample, SharedBrdf, SpecError};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use steradian_base::ParamInfo;

/// The page.
pub static INFO: Info = Info {
    name: "oren-nayar",
    source: "Oren & Nayar 1994, eqs 27–30; Fujii 2012",
    formula: "f = albedo/π (A + B max(0, cos Δφ) sin α tan β), A = 1 − ½σ²/(σ² + 0.33), B = 0.45 σ²/(σ² + 0.09), \
              α = max(θ_i, θ_o), β = min(θ_i, θ_o); variants full (eqs 27, 28) and fujii",
    units: "sr⁻¹",
    parameters: &[
        ParamInfo::real(
            "sigma",
            [0.0, FRAC_PI_2],
            0.0,
            "standard deviation of the facet slope angle in radians (fujii: roughness 0 … 1)",
        )
        .required(),
        ParamInfo::rgb("albedo", [0.0, 1.0], 1.0, "facet albedo"),
        ParamInfo::choice("variant", &VARIANTS, "formula"),
    ],
    reciprocity: "reciprocal",
    energy: "not conserved strictly: albedo up to 1.015 (full: 1.051) at grazing views where albedo = 1 and sigma is near 0.2; fujii: at most 1",
};

pub(crate) const ENTRY: Entry = Entry { info: &INFO, make };

const VARIANTS: [&str; 3] = ["qualitative", "full", "fujii"];

fn make(a: &Args) -> Result<SharedBrdf, SpecError> {
    let (variant, sigma) = (a.word("variant")?, a.number("sigma")?);
    if variant == "fujii" && sigma > 1.0 {
        return Err(a.refuse("sigma", "a number in 0 … 1".into()));
    }
    Ok(Arc::new(OrenNayar { variant, sigma, albedo: a.rgb("albedo")? }))
}

/// Oren and Nayar's rough diffuse surface.
#[derive(Debug, Clone, Copy)]
pub struct OrenNayar {
    variant: &'static str,
    sigma: f64,
    albedo: [f64; 3],
}

const DRAW: &[(f64, Draw)] = &[(1.0, Draw::Cosine)];

impl OrenNayar {
    fn qualitative(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let s2 = self.sigma * self.sigma;
        let a = 1.0 - 0.5 * s2 / (s2 + 0.33);
        let b = 0.45 * s2 / (s2 + 0.09);
        let c = (wi.x * wo.x + wi.y * wo.y).max(0.0);
        times(self.albedo, INV_PI * (a + b * c / wi.z.max(wo.z)))
    }

    fn fujii(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let a = 1.0 / (PI + (FRAC_PI_2 - 2.0 / 3.0) * self.sigma);
        let c = wi.x * wo.x + wi.y * wo.y;
        let t = if c <= 0.0 { 1.0 } else { wi.z.max(wo.z) };
        times(self.albedo, a * (1.0 + self.sigma * c / t))
    }

    fn full(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let s2 = self.sigma * self.sigma;
        let (ti, to) = (crate::math::polar_angle(wi), crate::math::polar_angle(wo));
        let (alpha, beta) = (ti.max(to), ti.min(to));
        let across = wi.x.hypot(wi.y) * wo.x.hypot(wo.y);
        let cos_phi = if across > 0.0 { (wi.x * wo.x + wi.y * wo.y) / across } else { 1.0 };
        let c1 = 1.0 - 0.5 * s2 / (s2 + 0.33);
        let behind = if cos_phi >= 0.0 { 0.0 } else { (2.0 * beta / PI).powi(3) };
        let c2 = 0.45 * s2 / (s2 + 0.09) * (alpha.sin() - behind);
        let c3 = 0.125 * s2 / (s2 + 0.09) * (4.0 * alpha * beta / (PI * PI)).powi(2);
        let direct =
            c1 + cos_phi * c2 * beta.tan() + (1.0 - cos_phi.abs()) * c3 * (0.5 * (alpha + beta)).tan();
        let between = 0.17 * s2 / (s2 + 0.13) * (1.0 - cos_phi * (2.0 * beta / PI).powi(2));
        self.albedo.map(|rho| INV_PI * rho * (direct + rho * between).max(0.0))
    }
}

impl Brdf for OrenNayar {
    fn info(&self) -> &'static Info {
        &INFO
    }

    fn spec(&self) -> String {
        let shape = [("sigma", self.sigma.into()), ("albedo", self.albedo.into())];
        spec::print(&INFO, shape.into_iter().chain([("variant", self.variant.into())]))
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if !above(wi, wo) {
            return [0.0; 3];
        }
        match self.variant {
            "full" => self.full(wi, wo),
            "fujii" => self.fujii(wi, wo),
            _ => self.qualitative(wi, wo),
        }
    }

    fn lobes(&self, _wo: DVec3) -> Vec<Lobe> {
        Vec::new()
    }

    fn peak(&self) -> Peak {
        Peak::Smooth
    }

    fn shader(&self) -> Option<BrdfShader> {
        let variant = match self.variant {
            "full" => 1.0,
            "fujii" => 2.0,
            _ => 0.0,
        };
        let parameters = [rgb(self.albedo), four([self.sigma, variant, 0.0, 0.0])];
        Some(BrdfShader::new(include_str!("oren_nayar.wgsl"), self.peak(), self.domain(), parameters))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(DRAW, wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(DRAW, wi, wo)
    }
}

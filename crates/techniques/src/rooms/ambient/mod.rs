//! The ambient term with ambient occlusion: the light's mean, darkened by how little of the sky a point sees.
//!
//! STAR04 3.3.1, eq. 4 (the ambient term k_a L_a) and eq. 6 (ambient occlusion).
//!
//! > L_o(x) = albedo · L_a · ao(x),  ao(x) = (1/π) ∫ V(x, w) (n·w)₊ dw,  L_a = (1/4π) ∫ L dw
//!
//! Approximated: L, by its mean over the sphere. The survey's k_a stands for the albedo, and its integral
//! carries no 1/π; both are written so that a constant light gives the exact result. Refused: any reflectance
//! but Lambert's, and point lights.

mod bake;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::{Model, Report, Target};
use crate::shared::geometry::transport::PerSite;
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Check, Claim, Geometry, GpuTechnique, Material, Needs, Parts,
    Points, Radiance, Technique,
};
use bake::{Colour, Mean, Params};
use steradian_base::Task;
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;

/// The technique.
pub struct Ambient;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    match brdf.form() {
        Form::Lambert { .. } => Ok(()),
        _ => Err(format!("takes lambert only, not {}", brdf.info().name)),
    }
}

impl Technique for Ambient {
    const CARD: Card = Card {
        slug: "ambient",
        title: "Ambient term with ambient occlusion",
        citation: "STAR04 3.3.1, eqs 4 and 6",
        equation: "L_o = albedo · L_a · (1/π) ∫ V (n·w)₊ dw, L_a = (1/4π) ∫ L dw",
        light: "its mean over the sphere",
        visibility: "the share of the cosine-weighted hemisphere that a site sees",
        reflectance: "lambert, exact",
        materials,
        specimens: &["lambert:albedo=0.8/0.5/0.2"],
        exact_when: &[Claim::new(
            "the light is constant, whatever is blocked",
            lights::furnace,
            "lambert:albedo=0.8/0.5/0.2",
            2e-4,
        )],
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            shift_variant: true,
            self_shadowing: true,
            dynamic_lighting: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: true, uv: false, tangents: false, view: false },
        waived: &[(
            Check::ErrorBound,
            "the mean of the light knows no direction: it is not meant to be near",
        )],
    };
    type Params = Params;
    type Light = Mean;
    type Material = Colour;
    type Transfer = PerSite;
    type Linked = Colour;
    type Frame = ();

    fn reads_transfer(_: &Params) -> bool {
        true
    }

    fn light(l: &Lights, _: &Params, _: &Task) -> Result<Mean, BakeError> {
        Mean::bake(l)
    }

    fn material(m: &Material, _: &Params, _: &Task) -> Result<Colour, BakeError> {
        Ok(Colour::albedo(&*m.brdf))
    }

    fn transfer(g: Option<&Geometry>, _: &Colour, p: &Params, task: &Task) -> Result<PerSite, BakeError> {
        g.map_or_else(|| Ok(PerSite::default()), |g| bake::transfer(g, p, task))
    }

    fn link(parts: Parts<'_, Self>, _: &Params, _: &Task) -> Result<(Colour, Report), BakeError> {
        let product = Colour([0, 1, 2].map(|c| parts.light.rgb[c] * parts.material.0[c]));
        Ok((product, parts.light.report()))
    }

    fn target<'a>(b: &'a Bake<Self>, _: Option<&'a dyn Brdf>) -> Option<Target<'a>> {
        Some(Target::Integral(Model::diffuse(b.material.0)))
    }

    fn shade(b: &Bake<Self>, (): &(), q: &Points<'_>, out: &mut Radiance<'_>) {
        shade::shade(b, q, out);
    }

    fn gpu(b: &Bake<Self>, (): &()) -> GpuTechnique {
        shade::gpu(b)
    }
}

//! Irradiance from nine spherical harmonic coefficients.
//!
//! Ramamoorthi & Hanrahan (2001), *An Efficient Representation for Irradiance Environment Maps*, eqs 7–12;
//! STAR04 7.4.1, eqs 41–43 (whose sum "i = 0 to 9" means the nine terms 0 … 8).
//!
//! > L_o(n) = (albedo/π) Σ_{l≤2} A_l L_lm Y_lm(n) = nᵀMn,  A = π, 2π/3, π/4
//!
//! with homogeneous n = (x, y, z, 1); L in W sr⁻¹ m⁻². Approximated: L, by its bands 0 to 2 (band 3 of
//! irradiance is zero, so the first band missed is 4). V = 1; f is exact. Refused: any reflectance but
//! Lambert's, and point lights. Behind a lone small light the sum falls below zero (by 4 % of the peak); it
//! is not clamped, and the certificate states the negative part.

mod bake;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::{Model, Report, Target};
use crate::gpu::LightTables;
use crate::shared::maths::quadric::Quadric;
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Parts, Points,
    Radiance, Technique, Varies, View,
};
use bake::{Albedo, Light};
use steradian_base::Task;
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;

/// The technique.
pub struct ShIrradiance;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    let instead = match brdf.form() {
        Form::Lambert { .. } => return Ok(()),
        Form::Ggx { .. } => "split_sum",
        Form::Phong { .. } => "phong_diffuse_maps",
        _ => "reference",
    };
    Err(format!("takes lambert only, not {}: use {instead}", brdf.info().name))
}

const EXACT: &[Claim] = &[
    Claim::new("the light is constant", lights::furnace, "lambert:albedo=0.8/0.5/0.2", 1e-5),
    Claim::new(
        "the light has no bands above 2 (nor 4, 6, …: odd bands above 1 give no irradiance)",
        lights::quadratic,
        "lambert:albedo=0.8/0.5/0.2",
        1e-4,
    ),
];

impl Technique for ShIrradiance {
    const CARD: Card = Card {
        slug: "sh_irradiance",
        title: "Irradiance from nine spherical harmonic coefficients",
        citation: "Ramamoorthi & Hanrahan 2001, An Efficient Representation for Irradiance Environment Maps, \
                   eqs 7–12; STAR04 7.4.1, eqs 41–43",
        equation: "L_o = (albedo/π) Σ_{l≤2} A_l L_lm Y_lm(n) = nᵀMn",
        light: "spherical harmonics of order 2",
        visibility: "none: V = 1",
        reflectance: "lambert, exact",
        materials,
        specimens: &["lambert:albedo=0.8/0.5/0.2"],
        exact_when: EXACT,
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            bump_mapping: true,
            dynamic_lighting: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: false, view: false },
        waived: &[],
    };
    type Params = ();
    type Light = Light;
    type Material = Albedo;
    type Transfer = ();
    type Linked = Quadric;
    type Frame = Quadric;

    fn light(l: &Lights, (): &(), _: &Task) -> Result<Light, BakeError> {
        Light::bake(l)
    }

    fn material(m: &Material, (): &(), _: &Task) -> Result<Albedo, BakeError> {
        Ok(Albedo::of(&*m.brdf))
    }

    fn transfer(_: Option<&Geometry>, _: &Albedo, (): &(), _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, (): &(), _: &Task) -> Result<(Quadric, Report), BakeError> {
        let quadric = bake::link(parts.light, parts.material);
        let report = parts.light.report(&quadric);
        Ok((quadric, report))
    }

    fn target<'a>(b: &'a Bake<Self>, _: Option<&'a dyn Brdf>) -> Option<Target<'a>> {
        Some(Target::Integral(Model::diffuse(b.material.0)))
    }

    fn frame(b: &Bake<Self>, v: &View, f: &mut Quadric) {
        *f = b.linked.turned(v.light_rotation);
    }

    fn shade(_: &Bake<Self>, f: &Quadric, q: &Points<'_>, out: &mut Radiance<'_>) {
        if q.has_lobes() {
            shade::shade_lobe(f, q, out);
        } else {
            shade::shade(f, q, out);
        }
    }

    fn gpu(_: &Bake<Self>, f: &Quadric) -> GpuTechnique {
        shade::gpu(f)
    }

    fn light_tables(b: &Bake<Self>, _: bool) -> Option<LightTables> {
        let gain = b.material.0.map(|a| (a / std::f64::consts::PI) as f32);
        Some(LightTables { cubes: Vec::new(), irradiance: Some(gain) })
    }

    const VARIES: Varies = Varies::SHAPE;

    fn gpu_varied(_: &Bake<Self>, f: &Quadric) -> Option<GpuTechnique> {
        Some(shade::gpu_lobe(f))
    }
}

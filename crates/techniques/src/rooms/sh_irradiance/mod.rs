//! Irradiance from nine spherical harmonic coefficients.
//!
//! Ramamoorthi & Hanrahan (2001), *An Efficient Representation for Irradiance Environment Maps*, eqs 7–12;
//! STAR04 7.4.1, eqs 41–43.

mod bake;
mod shade;

use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuRoom, Material, Needs, Parts, Points, Radiance,
    Technique,
};
use bake::{Albedo, Light, Quadric};
use steradian_base::{Certificate, Task};
use steradian_brdf::Brdf;
use steradian_light::Lights;

/// The room.
pub struct ShIrradiance;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    if brdf.info().name == "lambert" {
        return Ok(());
    }
    Err(format!("takes lambert only, not {}", brdf.info().name))
}

const EXACT: &[Claim] = &[];

impl Technique for ShIrradiance {
    const CARD: Card = Card {
        slug: "sh_irradiance",
        title: "Irradiance from nine spherical harmonic coefficients",
        citation: "Ramamoorthi & Hanrahan 2001, An Efficient Representation for Irradiance Environment Maps, eqs 7-12; STAR04 7.4.1, eqs 41-43",
        equation: "L_o = (albedo/pi) n^T M n,  E(n) = sum_{l<=2} A_l L_lm Y_lm(n)",
        light: "projected to spherical harmonics of order 2",
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
    type Frame = shade::Turned;

    fn light(l: &Lights, (): &(), _: &Task) -> Result<Light, BakeError> {
        Light::bake(l)
    }

    fn material(m: &Material, (): &(), _: &Task) -> Result<Albedo, BakeError> {
        Ok(Albedo::of(&*m.brdf))
    }

    fn transfer(_: Option<&Geometry>, _: &Albedo, (): &(), _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, (): &(), _: &Task) -> Result<(Quadric, Certificate), BakeError> {
        Ok((Quadric::link(parts.light, parts.material), parts.light.certificate()))
    }

    fn frame(b: &Bake<Self>, v: &crate::View, f: &mut shade::Turned) {
        *f = shade::Turned::new(&b.linked, v.light_rotation);
    }

    fn shade(_: &Bake<Self>, f: &shade::Turned, q: &Points<'_>, out: &mut Radiance<'_>) {
        shade::shade(f, q, out);
    }

    fn gpu(_: &Bake<Self>, f: &shade::Turned) -> GpuRoom {
        shade::gpu(f)
    }
}

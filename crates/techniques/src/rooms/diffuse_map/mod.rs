//! The diffuse environment map.
//!
//! Miller & Hoffman (1984), *Illumination and Reflection Maps: Simulated Objects in Simulated and Real
//! Environments*; STAR04 7.3.2, eqs 19–21:
//!
//! > L_o(n) = albedo · E(n)/π,  E(n) = ∫ L(wi) ⟨n·wi⟩₊ dwi
//!
//! The map holds E/π (radiance of a white surface, W sr⁻¹ m⁻²) over n on a cube. Filtered in frequency space
//! with A_l to the order that the tolerance needs, small lights exactly; nothing of L is approximated beyond
//! that tolerance and the map's bilinear lookup. V = 1; f is exact. Refused: any reflectance but Lambert's,
//! and point lights.

mod bake;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::{Model, Report, Target};
use crate::gpu::{Kernel, LightTables, Uniform};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::material::reflectance::Reflectance;
use crate::shared::tables;
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Parts, Points,
    Radiance, Technique, Varies, View,
};
use bake::{Albedo, Light, Size};
use steradian_base::Task;
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;

/// The technique.
pub struct DiffuseMap;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    let instead = match brdf.form() {
        Form::Lambert { .. } => return Ok(()),
        Form::Ggx { .. } => "split_sum",
        Form::Phong { .. } => "phong_diffuse_maps",
        _ => "reference",
    };
    Err(format!("takes lambert only, not {}: use {instead}", brdf.info().name))
}

const WHITE: &str = "lambert:albedo=0.8/0.5/0.2";

const fn claim(statement: &'static str, light: fn() -> Lights, within: f64) -> Claim {
    Claim::new(statement, light, WHITE, within)
}

impl Technique for DiffuseMap {
    const CARD: Card = Card {
        slug: "diffuse_map",
        title: "Prefiltered diffuse environment map",
        citation: "Miller & Hoffman 1984, Illumination and Reflection Maps; STAR04 7.3.2, eqs 19–21",
        equation: "L_o = albedo E(n)/π",
        light: "irradiance on a cube map, to the tolerance",
        visibility: "none: V = 1",
        reflectance: "lambert, exact",
        materials,
        specimens: &[WHITE],
        exact_when: &[
            claim("the light is constant", lights::furnace, 1e-3),
            claim("always, up to the tolerance: a smooth sky", lights::smooth, 0.01),
            claim("always, up to the tolerance: soft boxes", lights::studio, 0.01),
            claim("always, up to the tolerance: a sun", lights::sunny, 0.01),
        ],
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            bump_mapping: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: false, view: false },
        waived: &[],
    };
    type Params = Size;
    type Light = Light;
    type Material = Albedo;
    type Transfer = ();
    type Linked = ();
    type Frame = LightRotation;

    fn light(l: &Lights, p: &Size, task: &Task) -> Result<Light, BakeError> {
        Light::bake(l, p, task)
    }

    fn material(m: &Material, _: &Size, _: &Task) -> Result<Albedo, BakeError> {
        Ok(Albedo::of(&Reflectance::of(m)))
    }

    fn transfer(_: Option<&Geometry>, _: &Albedo, _: &Size, _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, _: &Size, _: &Task) -> Result<((), Report), BakeError> {
        Ok(((), parts.light.report()))
    }

    fn target<'a>(b: &'a Bake<Self>, _: Option<&'a dyn Brdf>) -> Option<Target<'a>> {
        Some(Target::Integral(Model::diffuse(b.material.0.map(f64::from))))
    }

    fn frame(_: &Bake<Self>, v: &View, f: &mut LightRotation) {
        *f = LightRotation::new(v.light_rotation);
    }

    fn bytes(b: &Bake<Self>) -> usize {
        tables::cube_bytes(&b.light.cube)
    }

    fn shade(b: &Bake<Self>, f: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
        if q.has_lobes() {
            shade::shade_lobe(&b.light.cube, &b.material, f, q, out);
        } else {
            shade::shade(&b.light.cube, &b.material, f, q, out);
        }
    }

    fn gpu(b: &Bake<Self>, f: &LightRotation) -> GpuTechnique {
        shade::gpu(&b.light.cube, &b.material, f)
    }

    fn gpu_frame(_: &Bake<Self>, f: &LightRotation) -> Option<Vec<Uniform>> {
        Some(vec![f.uniform()])
    }

    fn light_tables(_: &Bake<Self>, _: bool) -> Option<LightTables> {
        let cubes = vec![LightTables::cube("irradiance_over_pi", Kernel::Lambert, 1.0)];
        Some(LightTables { cubes, irradiance: None })
    }

    const VARIES: Varies = Varies::SHAPE;

    fn gpu_varied(b: &Bake<Self>, f: &LightRotation) -> Option<GpuTechnique> {
        Some(shade::gpu_lobe(&b.light.cube, &b.material, f))
    }
}

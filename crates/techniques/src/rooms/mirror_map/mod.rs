//! The environment seen in a perfect mirror.
//!
//! Blinn & Newell (1976), *Texture and Reflection in Computer Generated Images*; STAR04 7.3.1, eqs 14–18:
//!
//! > f = k_s δ(r − wi)/(n·wi)  ⟹  L_o = k_s L(r),  r = 2(n·wo)n − wo
//!
//! The map is the environment itself on a cube, area-exact. Microfacet models are taken as the mirror that
//! they become as their roughness goes to zero, where k_s → F(n·wo) (Schlick): f is approximated by its
//! limit, L by the map's resolution, V = 1. The certificate compares with the model itself. Suns are spread
//! over the map's texels with their flux kept. Refused: models without a mirror limit, directional lights (a
//! mirror shows them infinitely bright) and point lights.

mod bake;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::{Report, Target};
use crate::gpu::{Kernel, LightTables, Uniform};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::material::reflectance::Reflectance;
use crate::shared::{tables, trials::lights};
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Parts, Points,
    Radiance, Technique, Varies, View,
};
use bake::{Light, Mirror, Size};
use steradian_base::Task;
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;

/// The technique.
pub struct MirrorMap;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    let instead = match brdf.form() {
        Form::Ggx { .. } | Form::CookTorrance { .. } => return Ok(()),
        Form::Lambert { .. } => "sh_irradiance",
        _ => "reference",
    };
    let name = brdf.info().name;
    Err(format!("takes ggx and cook-torrance as perfect mirrors, not {name}: use {instead}"))
}

impl Technique for MirrorMap {
    const CARD: Card = Card {
        slug: "mirror_map",
        title: "The environment in a perfect mirror",
        citation: "Blinn & Newell 1976, Texture and Reflection in Computer Generated Images; STAR04 7.3.1, eqs 14–18",
        equation: "L_o = F(n·wo) L(r)",
        light: "the environment on a cube map, bilinear",
        visibility: "none: V = 1",
        reflectance: "its limit at zero roughness: a mirror of reflectance F(n·wo)",
        materials,
        specimens: &["ggx:alpha=0.002,f0=0.9/0.6/0.3"],
        exact_when: &[
            Claim::new(
                "the light is constant and the roughness goes to zero",
                lights::furnace,
                "ggx:alpha=0.002,f0=0.9/0.6/0.3",
                1e-3,
            ),
            Claim::new(
                "the light is smooth over a texel and the roughness goes to zero",
                lights::smooth,
                "ggx:alpha=0.002,f0=0.9/0.6/0.3",
                1e-2,
            ),
        ],
        capabilities: Capabilities {
            global: true,
            certain_isotropic: true,
            bump_mapping: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: false, view: false },
        waived: &[],
    };
    type Params = Size;
    type Light = Light;
    type Material = Reflectance;
    type Transfer = ();
    type Linked = Mirror;
    type Frame = LightRotation;

    fn light(l: &Lights, p: &Size, task: &Task) -> Result<Light, BakeError> {
        Light::bake(l, p, task)
    }

    fn material(m: &Material, _: &Size, _: &Task) -> Result<Reflectance, BakeError> {
        Ok(Reflectance::of(m))
    }

    fn transfer(_: Option<&Geometry>, _: &Reflectance, _: &Size, _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, _: &Size, _: &Task) -> Result<(Mirror, Report), BakeError> {
        Ok(bake::link(parts.light, parts.material))
    }

    fn target<'a>(b: &'a Bake<Self>, _: Option<&'a dyn Brdf>) -> Option<Target<'a>> {
        Some(bake::target(&b.light, &b.material))
    }

    fn frame(_: &Bake<Self>, v: &View, f: &mut LightRotation) {
        *f = LightRotation::new(v.light_rotation);
    }

    fn bytes(b: &Bake<Self>) -> usize {
        tables::cube_bytes(&b.light.cube)
    }

    fn shade(b: &Bake<Self>, f: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
        if q.has_lobes() {
            shade::shade_lobe(b.light.halves(), &b.linked, f, q, out);
        } else {
            shade::shade(&b.light.cube, &b.linked, f, q, out);
        }
    }

    fn gpu(b: &Bake<Self>, f: &LightRotation) -> GpuTechnique {
        shade::gpu(&b.light.cube, &b.linked, f)
    }

    fn gpu_frame(_: &Bake<Self>, f: &LightRotation) -> Option<Vec<Uniform>> {
        Some(vec![f.uniform()])
    }

    fn light_tables(_: &Bake<Self>, varied: bool) -> Option<LightTables> {
        let cubes = vec![LightTables::cube("environment", Kernel::Mirror, 1.0)];
        (!varied).then_some(LightTables { cubes, irradiance: None })
    }

    const VARIES: Varies = Varies { normals: true, ..Varies::NONE };

    fn gpu_varied(b: &Bake<Self>, f: &LightRotation) -> Option<GpuTechnique> {
        Some(shade::gpu_lobe(b.light.halves(), &b.linked, f))
    }
}

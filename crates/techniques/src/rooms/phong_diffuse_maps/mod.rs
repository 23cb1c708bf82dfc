//! Prefiltered Phong and diffuse maps with a Fresnel blend.
//!
//! Miller & Hoffman (1984), *Illumination and Reflection Maps*; Heidrich & Seidel (1999), *Realistic,
//! Hardware-Accelerated Shading and Lighting*; STAR04 7.3.2–7.3.3, eqs 19–26:
//!
//! > L_phong(r) = k_s ∫ (r·wi)₊^N L(wi) dwi,  L_diffuse(n) = (k_d/π) ∫ ⟨n·wi⟩₊ L(wi) dwi
//! > L_o = (1 − F) L_diffuse(n) + F L_phong(r),  F = f0 + (1 − f0)(1 − n·wo)⁵
//!
//! The maps integrate the Phong lobe over the whole sphere: this is `phong-map`, and for `phong` (above the
//! horizon only) light from below the horizon leaks in; that is the one factor approximated. The
//! reflectance's spec gives N and k_s (with `scale=`); the parameters k_s, k_d and f0 blend as eq. 26 (f0 =
//! 1: Phong alone, the default). `lambert` takes the diffuse map alone. V = 1. Radiance in W sr⁻¹ m⁻².
//! Refused: other reflectances, point lights.

mod bake;
mod blend;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::{Report, Target};
use crate::gpu::{Kernel, LightTables, Uniform};
use crate::shared::light::distant::{DistantLight, ORDER};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::material::reflectance::Reflectance;
use crate::shared::{tables, trials::lights};
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Parts, Points,
    Radiance, Technique, Varies, View,
};
use bake::PhongMaps;
use blend::Params;
use steradian_base::Task;
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;

/// The technique.
pub struct PhongDiffuseMaps;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    let instead = match brdf.form() {
        Form::Phong { .. } | Form::Lambert { .. } => return Ok(()),
        Form::Ggx { .. } => "split_sum",
        _ => "reference",
    };
    let name = brdf.info().name;
    Err(format!("takes phong, phong-map, phong-normalized and lambert, not {name}: use {instead}"))
}

const fn claim(statement: &'static str, light: fn() -> Lights, brdf: &'static str) -> Claim {
    Claim::new(statement, light, brdf, 0.01)
}

impl Technique for PhongDiffuseMaps {
    const CARD: Card = Card {
        slug: "phong_diffuse_maps",
        title: "Prefiltered Phong and diffuse maps",
        citation: "Miller & Hoffman 1984, Illumination and Reflection Maps; Heidrich & Seidel 1999, Realistic, \
                   Hardware-Accelerated Shading and Lighting; STAR04 7.3.2–7.3.3, eqs 19–26",
        equation: "L_o = (1 − F) L_diffuse(n) + F L_phong(r)",
        light: "two cube maps, to the tolerance",
        visibility: "none: V = 1",
        reflectance: "phong-map and lambert exact; phong without its horizon",
        materials,
        specimens: &["phong-map:n=30", "phong:n=30", "phong-normalized:s=200", "lambert:albedo=0.8/0.5/0.2"],
        exact_when: &[
            claim(
                "the lobe covers the whole sphere (phong-map): constant light",
                lights::furnace,
                "phong-map:n=30",
            ),
            claim(
                "the lobe covers the whole sphere (phong-map): soft boxes",
                lights::studio,
                "phong-map:n=30",
            ),
            claim("the lobe covers the whole sphere (phong-map): a sun", lights::sunny, "phong-map:n=200"),
            claim("the surface is lambertian", lights::studio, "lambert:albedo=0.8/0.5/0.2"),
        ],
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            certain_isotropic: true,
            shift_variant: true,
            bump_mapping: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: false, view: false },
        waived: &[],
    };
    type Params = Params;
    type Light = DistantLight;
    type Material = Reflectance;
    type Transfer = ();
    type Linked = PhongMaps;
    type Frame = LightRotation;

    fn light(l: &Lights, _: &Params, task: &Task) -> Result<DistantLight, BakeError> {
        DistantLight::bake(Self::CARD.slug, l, ORDER, task)
    }

    fn material(m: &Material, _: &Params, _: &Task) -> Result<Reflectance, BakeError> {
        Ok(Reflectance::of(m))
    }

    fn transfer(_: Option<&Geometry>, _: &Reflectance, _: &Params, _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, p: &Params, task: &Task) -> Result<(PhongMaps, Report), BakeError> {
        bake::link(parts.light, parts.material, p, task)
    }

    fn target<'a>(b: &'a Bake<Self>, _: Option<&'a dyn Brdf>) -> Option<Target<'a>> {
        Some(bake::target(&b.material, &b.params))
    }

    fn frame(_: &Bake<Self>, v: &View, f: &mut LightRotation) {
        *f = LightRotation::new(v.light_rotation);
    }

    fn bytes(b: &Bake<Self>) -> usize {
        tables::cube_bytes(&b.linked.phong) + tables::cube_bytes(&b.linked.diffuse)
    }

    fn shade(b: &Bake<Self>, f: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
        if q.has_lobes() {
            shade::shade_lobe(&b.linked, b.linked.lobes(&b.light, &b.params), f, q, out);
        } else {
            shade::shade(&b.linked, f, q, out);
        }
    }

    fn gpu(b: &Bake<Self>, f: &LightRotation) -> GpuTechnique {
        shade::gpu(&b.linked, f)
    }

    fn gpu_frame(_: &Bake<Self>, f: &LightRotation) -> Option<Vec<Uniform>> {
        Some(vec![f.uniform()])
    }

    fn light_tables(b: &Bake<Self>, varied: bool) -> Option<LightTables> {
        let n = b.linked.n;
        let phong = Kernel::Phong { n: f64::from(n) };
        let cubes = vec![
            LightTables::cube("phong", phong, std::f32::consts::TAU / (n + 1.0)),
            LightTables::cube("irradiance", Kernel::Lambert, std::f32::consts::PI),
        ];
        (!varied && n >= 1.0).then_some(LightTables { cubes, irradiance: None })
    }

    const VARIES: Varies = Varies::SHAPE;

    fn gpu_varied(b: &Bake<Self>, f: &LightRotation) -> Option<GpuTechnique> {
        Some(shade::gpu_lobe(&b.linked, b.linked.lobes(&b.light, &b.params), f))
    }
}

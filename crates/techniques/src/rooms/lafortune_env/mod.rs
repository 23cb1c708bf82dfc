//! Environment maps of Lafortune's generalised cosine lobes.
//!
//! McAllister, Lastra & Heidrich (2002), *Efficient Rendering of Spatial Bi-directional Reflectance
//! Distribution Functions*; STAR04 7.3.7, eqs 36–40:
//!
//! > f = ρ_d/π + Σ_k ρ_k (c·wi)₊^n_k,  c = C_k wo componentwise,  r̂ = c/|c|
//! > L_o = ρ_d E(n)/π + Σ_k ⟨n·wi⟩_k ρ_k |c|^n_k Phong_n_k(r̂),  Phong_n(r) = ∫ (r·wi)₊^n L(wi) dwi
//!
//! The maps know neither C nor ρ: one stack over exponents serves all lobes. The cosine is the one factor
//! approximated: it leaves the integral as ⟨n·wi⟩_k, which the parameter `cosine` chooses: 0 is n·r̂ at the
//! lobe's axis, 1 is n·r of the mirror direction as eqs 39–40 print it (off-specular lobes have their axis
//! elsewhere; the two agree for C = (−1, −1, 1)), 2 is the cosine's mean over the lobe above the horizon, so
//! that constant light gives the albedo. C and n per channel take a lookup per channel. Where images say the
//! numbers (`rho_d`, `rho_1`, `c_1`, `n_1` …), texel by texel and filtered as the technique
//! `lafortune_svbrdf` filters them, each point looks its own lobes up, and mixes the two maps around its
//! exponent linearly in ln(n + 1). V = 1. Radiance in W sr⁻¹ m⁻². Refused: other reflectances, point lights.

mod bake;
mod material;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::{Model, Report, Target};
use crate::gpu::Uniform;
use crate::local::Plane;
use crate::shared::light::distant::{DistantLight, ORDER};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::surface::cosine_lobes::{PLANES, lobes_of};
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Part, Parts, Points,
    Radiance, Technique, View,
};
use bake::{LafortuneMaps, Params};
use material::Cosines;
use steradian_base::Task;
use steradian_brdf::Brdf;
use steradian_light::Lights;

/// The technique.
pub struct LafortuneEnv;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    if lobes_of(brdf).is_some() {
        return Ok(());
    }
    let instead = if brdf.is_isotropic() { "lobe_maps" } else { "reference" };
    Err(format!("takes lafortune and lambert, not {}: use {instead}", brdf.info().name))
}

impl Technique for LafortuneEnv {
    const CARD: Card = Card {
        slug: "lafortune_env",
        title: "Environment maps of Lafortune lobes",
        citation: "McAllister, Lastra & Heidrich 2002, Efficient Rendering of Spatial Bi-directional Reflectance \
                   Distribution Functions; STAR04 7.3.7, eqs 36–40",
        equation: "L_o = ρ_d E(n)/π + Σ_k ⟨n·wi⟩_k ρ_k |c|^n_k ∫ (r̂·wi)₊^n_k L dwi",
        light: "a cube map for each exponent and one of irradiance, to the tolerance",
        visibility: "none: V = 1",
        reflectance: "lafortune, and lambert as what images vary: lobes exact, over the whole sphere; the cosine outside the integral",
        materials,
        specimens: &[
            "lafortune:@skin",
            "lafortune:cx=-0.9,cy=-0.7,cz=0.95,n=40,ks=1/0.8/0.5,kd=0.2",
            "lafortune:@blue-paint",
        ],
        exact_when: &[
            Claim::new(
                "there is no lobe, only the diffuse part",
                lights::studio,
                "lafortune:cx=-1,cy=-1,cz=1,n=10,ks=0,kd=0.8/0.5/0.2",
                0.01,
            ),
            Claim::new("the light is constant", lights::furnace, "lafortune:@skin", 2e-3),
            Claim::new(
                "the exponent grows under a smooth light",
                lights::smooth,
                "lafortune:cx=-1,cy=-1,cz=1,n=20000",
                0.01,
            ),
        ],
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            certain_isotropic: true,
            certain_anisotropic: true,
            shift_variant: true,
            bump_mapping: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: true, view: false },
        waived: &[],
    };
    const PLANES: &'static [Plane] = &PLANES;
    type Params = Params;
    type Light = DistantLight;
    type Material = Cosines;
    type Transfer = ();
    type Linked = LafortuneMaps;
    type Frame = LightRotation;

    fn light(l: &Lights, _: &Params, task: &Task) -> Result<DistantLight, BakeError> {
        DistantLight::bake(Self::CARD.slug, l, ORDER, task)
    }

    fn material(m: &Material, p: &Params, task: &Task) -> Result<Cosines, BakeError> {
        p.check_read(m)?;
        Cosines::of(m, task)
    }

    fn transfer(_: Option<&Geometry>, _: &Cosines, _: &Params, _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, p: &Params, task: &Task) -> Result<(LafortuneMaps, Report), BakeError> {
        bake::link(parts.light, parts.material, p, task)
    }

    fn target<'a>(b: &'a Bake<Self>, brdf: Option<&'a dyn Brdf>) -> Option<Target<'a>> {
        match b.material.looked_at() {
            Some(places) => {
                Some(Target::Places(places.into_iter().map(|(uv, f)| (uv, Model::owned(f))).collect()))
            }
            None => brdf.map(|brdf| Target::Integral(Model::of(brdf))),
        }
    }

    fn is_textured(b: &Bake<Self>) -> bool {
        b.material.varied.is_some()
    }

    fn frame(_: &Bake<Self>, v: &View, f: &mut LightRotation) {
        *f = LightRotation::new(v.light_rotation);
    }

    fn bytes(b: &Bake<Self>) -> usize {
        b.linked.bytes() + b.material.varied.as_ref().map_or(0, |v| v.bytes())
    }

    fn shade(b: &Bake<Self>, f: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
        match &b.material.varied {
            Some(lobes) => shade::shade_texels(&b.linked, lobes, f, q, out),
            None => shade::shade(&b.linked, f, q, out),
        }
    }

    fn gpu(b: &Bake<Self>, f: &LightRotation) -> GpuTechnique {
        match &b.material.varied {
            Some(lobes) => shade::gpu_texels(&b.linked, lobes, f),
            None => shade::gpu(&b.linked, f),
        }
    }

    fn gpu_frame(_: &Bake<Self>, f: &LightRotation) -> Option<Vec<Uniform>> {
        Some(vec![f.uniform()])
    }
}

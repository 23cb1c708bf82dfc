//! The split sum: GGX, alone or over a diffuse base, by a chain of prefiltered maps and a table of its
//! albedo.
//!
//! Karis (2013), *Real Shading in Unreal Engine 4*; Lagarde & de Rousiers (2014), *Moving Frostbite to PBR*;
//! multiple scattering: Fdez-Agüera (2019), *A Multiple-Scattering Microfacet Model for Real-Time Image-based
//! Lighting*.
//!
//! > L_o ≈ (f0 A(n·wo, α) + B(n·wo, α)) · ∫ L K_α(r·wi) dwi,   K_α = D(n·h)/4 ⟨n·wi⟩ / ∫,  n = wo = r
//!
//! The integral of the product is taken as the product of two integrals: ∫ f cos (A and B, exact) times the
//! mean of L over a lobe that is round about r, whatever the view. So f is approximated by its shape at
//! normal incidence, without the stretch and the horizon of grazing views; L beyond the tolerance and V = 1.
//! Levels of the chain are equally spaced in perceptual roughness √α, level 0 is the environment itself, and
//! between levels the maps are mixed linearly. With `multiscatter`, the energy that single scattering loses
//! comes back as a diffuse term over the irradiance of order 2. The base of `dielectric` gets the light that
//! the layer transmits, albedo (1 − E(n·wo)) E_n/π, with the irradiance E_n of order 2 in place of light
//! weighted by 1 − E(n·wi). Points may have a width, normals, an albedo and an f0 of their own. Anisotropic
//! GGX and Ward's model are looked up along their long axis (`stretched.rs`), and take the mesh's tangents.
//! Radiance in W sr⁻¹ m⁻². Refused: α > 1, other reflectances, point lights.

mod bake;
mod shade;
mod stretched;
mod target;
#[cfg(test)]
mod tests;

use crate::certify::{Report, Target};
use crate::gpu::{LightTables, Uniform};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::material::reflectance::Reflectance;
use crate::shared::{maths::quadric::Quadric, trials::lights};
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Part, Parts, Points,
    Radiance, Technique, Varies, View,
};
use bake::{Light, Params, Specular};
use steradian_base::Task;
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;

/// The technique.
pub struct SplitSum;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    let instead = match brdf.form() {
        Form::Ggx { alpha, .. } if alpha.iter().any(|a| *a > 1.0) => {
            return Err("takes ggx with widths up to 1: use reference".into());
        }
        Form::Ggx { .. } | Form::Dielectric { .. } | Form::Ward { .. } => return Ok(()),
        Form::Lambert { .. } => "sh_irradiance or diffuse_map",
        Form::Phong { .. } => "phong_diffuse_maps",
        _ => "reference",
    };
    Err(format!("takes ggx, dielectric and ward only, not {}: use {instead}", brdf.info().name))
}

impl Technique for SplitSum {
    const CARD: Card = Card {
        slug: "split_sum",
        title: "Split sum: prefiltered chain and GGX albedo",
        citation: "Karis 2013, Real Shading in Unreal Engine 4; Lagarde & de Rousiers 2014, Moving Frostbite to \
                   PBR; Fdez-Agüera 2019, A Multiple-Scattering Microfacet Model for Real-Time Image-based Lighting",
        equation: "L_o = (f0 A + B) ∫ L K_α(r·wi) dwi",
        light: "a chain of cube maps, each convolved with the lobe of one roughness, to the tolerance",
        visibility: "none: V = 1",
        reflectance: "ggx: its albedo exact, its lobe as seen from n = wo = r; dielectric: a diffuse base below it; anisotropic \
                      ggx and ward by lookups along the long axis",
        materials,
        specimens: &[
            "ggx:alpha=0.04,f0=0.9/0.6/0.3",
            "ggx:alpha=0.25,f0=0.9/0.6/0.3",
            "ggx:alpha=0.64,f0=0.04",
            "dielectric:alpha=0.16,f0=0.04,albedo=0.6/0.3/0.1",
            "ggx:ax=0.1,ay=0.4,f0=0.9/0.6/0.3",
        ],
        exact_when: &[
            Claim::new(
                "the light is constant: the albedo is exact",
                lights::furnace,
                "ggx:alpha=0.25,f0=0.9/0.6/0.3",
                1e-3,
            ),
            Claim::new(
                "the light is constant: the layer and its base are exact",
                lights::furnace,
                "dielectric:alpha=0.25,f0=0.04,albedo=0.8/0.5/0.2",
                2e-3,
            ),
            Claim::new(
                "the roughness goes to zero under a smooth light",
                lights::smooth,
                "ggx:alpha=0.002,f0=0.9/0.6/0.3",
                0.02,
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
        needs: Needs { environment: true, sites: false, uv: false, tangents: false, view: false },
        waived: &[],
    };
    type Params = Params;
    type Light = Light;
    type Material = Reflectance;
    type Transfer = ();
    type Linked = Specular;
    type Frame = (LightRotation, Quadric);
    const EFFORT: f64 = 1.7;
    // Several lobes of the same filtered chain: errors of 0.2 to 1.05 times its own in the conformance suite.
    const REFINED_BY: Option<&'static str> = Some("gaussian_lobes");

    fn light(l: &Lights, p: &Params, task: &Task) -> Result<Light, BakeError> {
        Light::bake(l, p, task)
    }

    fn material(m: &Material, _: &Params, _: &Task) -> Result<Reflectance, BakeError> {
        Ok(Reflectance::of(m))
    }

    fn transfer(_: Option<&Geometry>, _: &Reflectance, _: &Params, _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, p: &Params, _: &Task) -> Result<(Specular, Report), BakeError> {
        Ok(bake::link(parts.light, parts.material, p))
    }

    fn target<'a>(b: &'a Bake<Self>, brdf: Option<&'a dyn Brdf>) -> Option<Target<'a>> {
        Some(target::target(&b.linked, brdf?))
    }

    fn frame(b: &Bake<Self>, v: &View, f: &mut (LightRotation, Quadric)) {
        *f = (LightRotation::new(v.light_rotation), b.light.mean_radiance.turned(v.light_rotation));
    }

    fn bytes(b: &Bake<Self>) -> usize {
        b.light.chain.bytes() + b.linked.bytes()
    }

    fn shade(b: &Bake<Self>, f: &(LightRotation, Quadric), q: &Points<'_>, out: &mut Radiance<'_>) {
        if q.has_lobes() && b.linked.stretched.is_none() {
            shade::shade_lobe(&b.light.chain, &b.linked, f, q, out);
        } else {
            shade::shade(&b.light.chain, &b.linked, f, q, out);
        }
    }

    fn gpu(b: &Bake<Self>, f: &(LightRotation, Quadric)) -> GpuTechnique {
        shade::gpu(&b.light.chain, &b.linked, f)
    }

    fn gpu_frame(_: &Bake<Self>, f: &(LightRotation, Quadric)) -> Option<Vec<Uniform>> {
        Some(shade::frame_uniforms(f).collect())
    }

    fn light_tables(b: &Bake<Self>, varied: bool) -> Option<LightTables> {
        Some(shade::light_tables(&b.light.chain, &b.linked, varied))
    }

    const VARIES: Varies = Varies::ALL;

    fn varies(b: &Bake<Self>) -> Varies {
        if b.linked.stretched.is_some() { Varies::NONE } else { Self::VARIES }
    }

    fn gpu_varied(b: &Bake<Self>, f: &(LightRotation, Quadric)) -> Option<GpuTechnique> {
        b.linked.stretched.is_none().then(|| shade::gpu_lobe(&b.light.chain, &b.linked, f))
    }
}

//! Highlights of fibres from a three-dimensional prefiltered environment map.
//!
//! Banks (1994), *Illumination in Diverse Codimensions*; Kautz, Vázquez, Heidrich & Seidel (2000), *A Unified
//! Approach to Prefiltered Environment Maps*; STAR04 7.3.6, eqs 33–35:
//!
//! > L(t, wo·t) = ∫ L(wi) (√(1 − (wi·t)²) √(1 − (wo·t)²) − (wi·t)(wo·t))₊^N dwi
//!
//! With θ_i and θ_o the angles from t this is cosᴺ(θ_i − α)₊, α = π − θ_o: a kernel that is round about t.
//! Kajiya & Kay's (1989) cosˢ(θ_i − θ_o)₊ (RH02 5.3.1, 5.7.1) is the same with α = θ_o. Both are one stack of
//! maps
//!
//! > G(d, α) = ∫ L(wi) cosᴺ(∠(d, wi) − α)₊ dwi,  G(−d, α) = G(d, π − α)
//!
//! of which α ≤ π/2 suffices: d = ±t by the sign of wo·t. `banks-map` and `kajiya-kay` are exact up to the
//! tolerance. `banks` has a cosine, which eq. 35 drops: its mean over the circle of wi at each θ_i, sin
//! θ_i/π, weighed with the kernel, stays outside the integral (parameter `mean_cosine` = 1; 0 drops it as the
//! paper does), and light from behind the surface leaks in. V = 1. Radiance in W sr⁻¹ m⁻². Refused: other
//! reflectances, point lights.

mod bake;
mod fibre;
mod plan;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::{self, Report, Target};
use crate::gpu::Uniform;
use crate::shared::light::distant::{DistantLight, ORDER};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::material::reflectance::Reflectance;
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Parts, Points,
    Radiance, Technique, View,
};
use bake::{ConeMaps, Params};
use steradian_base::Task;
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;

/// The technique.
pub struct BanksEnv;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    if matches!(brdf.form(), Form::Strand { .. }) {
        return certify::measurable(brdf);
    }
    let name = brdf.info().name;
    Err(format!("takes fibres (banks, banks-map, kajiya-kay), not {name}: use shrm or reference"))
}

impl Technique for BanksEnv {
    const CARD: Card = Card {
        slug: "banks_env",
        title: "Fibres' highlights from a stack of maps over the tangent",
        citation: "Kautz, Vázquez, Heidrich & Seidel 2000, A Unified Approach to Prefiltered Environment Maps; Banks \
                   1994, Illumination in Diverse Codimensions; STAR04 7.3.6, eqs 33–35; RH02 5.3.1",
        equation: "L_o = G(±t, ∠(t, wo)), G(d, α) = ∫ L(wi) cosᴺ(∠(d, wi) − α)₊ dwi",
        light: "cube maps over the tangent, one per angle between tangent and viewer, to the tolerance",
        visibility: "none: V = 1",
        reflectance: "banks-map and kajiya-kay exact; banks with a mean cosine in place of n·wi",
        materials,
        specimens: &["banks-map:n=30", "kajiya-kay:s=30", "banks:n=30"],
        exact_when: &[
            Claim::new(
                "the lobe covers the whole sphere (banks-map): constant light",
                lights::furnace,
                "banks-map:n=30",
                0.01,
            ),
            Claim::new(
                "the lobe covers the whole sphere (banks-map): soft boxes",
                lights::studio,
                "banks-map:n=30",
                0.01,
            ),
            Claim::new(
                "the lobe covers the whole sphere (banks-map): a sun",
                lights::sunny,
                "banks-map:n=100",
                0.01,
            ),
            Claim::new("Kajiya and Kay's fibres: soft boxes", lights::studio, "kajiya-kay:s=32", 0.01),
            Claim::new("constant light, with the mean cosine", lights::furnace, "banks:n=30", 0.01),
        ],
        capabilities: Capabilities {
            global: true,
            certain_anisotropic: true,
            bump_mapping: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: true, view: false },
        waived: &[],
    };
    type Params = Params;
    type Light = DistantLight;
    type Material = Reflectance;
    type Transfer = ();
    type Linked = ConeMaps;
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

    fn link(parts: Parts<'_, Self>, p: &Params, task: &Task) -> Result<(ConeMaps, Report), BakeError> {
        bake::link(parts.light, parts.material, p, task)
    }

    fn also_against(b: &Bake<Self>) -> Option<(&'static str, Target<'_>)> {
        Some(("maps", bake::map(&b.material, &b.params)?))
    }

    fn frame(_: &Bake<Self>, v: &View, f: &mut LightRotation) {
        *f = LightRotation::new(v.light_rotation);
    }

    fn shade(b: &Bake<Self>, f: &LightRotation, q: &Points<'_>, out: &mut Radiance<'_>) {
        shade::shade(&b.linked, f, q, out);
    }

    fn gpu(b: &Bake<Self>, f: &LightRotation) -> GpuTechnique {
        shade::gpu(&b.linked, f)
    }

    fn gpu_frame(_: &Bake<Self>, f: &LightRotation) -> Option<Vec<Uniform>> {
        Some(vec![f.uniform()])
    }
}

//! Prefiltered maps of radially symmetric lobes.
//!
//! Kautz & McCool (2000), *Approximation of Glossy Reflection with Prefiltered Environment Maps*; STAR04
//! 7.3.4, eqs 27–31:
//!
//! > 3-D: f_cos ≈ (n·r) p(n·r, r·wi),  L_o = (n·r) ∫ p(n·r, r·wi) L(wi) dwi
//! > 2-D: f_cos ≈ (n·r) F(n·r) p(r·wi),  L_o = (n·r) F(n·r) ∫ p(r·wi) L(wi) dwi
//!
//! f is the one factor approximated: its azimuth about the lobe's axis is averaged away
//! ([`steradian_brdf::fit::radial`]: the fit of least squares; with `cosine` 1 the cosine is inside the mean,
//! so that the energy of every view is exact, with 0 it is n·r outside the integral, as printed). With A =
//! (n·r) F and a normalised p, several lobes and axes o_i in place of r (the paper's multilobe approximation
//! and off-specular peaks):
//!
//! > L_o = Σ_i A_i(n·wo) ∫ p_i(n·wo, o_i·wi) L(wi) dwi,  o_i = a n + b_i(n·wo) r, |o_i| = 1
//!
//! Parameters: `dimensions` 3 (eq. 29, a stack of maps over the elevation) or 2 (eq. 31, one map), `lobes`,
//! `axis` (0: the mirror direction, as the equations are printed; 1: what captures most), `cosine`,
//! `elevations`, `size`. V = 1. Radiance in W sr⁻¹ m⁻². Refused: anisotropic reflectance, point lights.

mod bake;
mod material;
mod params;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::Report;
use crate::gpu::Uniform;
use crate::shared::light::distant::{DistantLight, ORDER};
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::{material::reflectance, trials::lights};
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Part, Parts, Points,
    Radiance, Technique, View,
};
use bake::LobeChains;
use material::Fitted;
use params::Params;
use steradian_base::Task;
use steradian_light::Lights;

/// The technique.
pub struct LobeMaps;

impl Technique for LobeMaps {
    const CARD: Card = Card {
        slug: "lobe_maps",
        title: "Maps of radially symmetric lobes",
        citation: "Kautz & McCool 2000, Approximation of Glossy Reflection with Prefiltered Environment Maps; STAR04 \
                   7.3.4, eqs 27–31",
        equation: "L_o = Σ_i A_i(n·wo) ∫ p_i(n·wo, o_i·wi) L dwi",
        light: "cube maps filtered by each lobe, in a stack over the elevation of the view, to the tolerance",
        visibility: "none: V = 1",
        reflectance: "any isotropic; the mean over the azimuth about an axis in the plane of n and wo, energy exact",
        materials: reflectance::isotropic,
        specimens: &[
            "ggx:alpha=0.25,f0=0.9/0.6/0.3",
            "lafortune:@skin",
            "phong:n=30",
            "oren-nayar:sigma=0.4,albedo=0.7",
        ],
        exact_when: &[
            Claim::new("the lobe is round (phong-map): soft boxes", lights::studio, "phong-map:n=30", 0.012),
            Claim::new(
                "the lobe is round (phong-map): one map, a sun",
                lights::sunny,
                "phong-map:n=200",
                0.01,
            )
            .with(&[("dimensions", 2.0)]),
            Claim::new("the surface is lambertian", lights::studio, "lambert:albedo=0.8/0.5/0.2", 0.01),
            Claim::new(
                "the light is constant: the energy of each view is exact",
                lights::furnace,
                "ggx:alpha=0.36,f0=0.9/0.6/0.3",
                2e-3,
            ),
            Claim::new(
                "the light is constant: two lobes, one map each",
                lights::furnace,
                "lafortune:@skin",
                3e-3,
            )
            .with(&[("dimensions", 2.0), ("lobes", 2.0)]),
            Claim::new(
                "the lobe narrows under a smooth light",
                lights::smooth,
                "ggx:alpha=0.01,f0=0.9",
                0.012,
            ),
        ],
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            certain_isotropic: true,
            all_isotropic: true,
            bump_mapping: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: false, view: false },
        waived: &[],
    };
    type Params = Params;
    type Light = DistantLight;
    type Material = Fitted;
    type Transfer = ();
    type Linked = LobeChains;
    type Frame = LightRotation;
    const EFFORT: f64 = 8.0;

    fn light(l: &Lights, _: &Params, task: &Task) -> Result<DistantLight, BakeError> {
        DistantLight::bake(Self::CARD.slug, l, ORDER, task)
    }

    fn material(m: &Material, p: &Params, task: &Task) -> Result<Fitted, BakeError> {
        Fitted::new(m, p, task)
    }

    fn transfer(_: Option<&Geometry>, _: &Fitted, _: &Params, _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, p: &Params, task: &Task) -> Result<(LobeChains, Report), BakeError> {
        bake::link(parts.light, parts.material, p, task)
    }

    fn frame(_: &Bake<Self>, v: &View, f: &mut LightRotation) {
        *f = LightRotation::new(v.light_rotation);
    }

    fn bytes(b: &Bake<Self>) -> usize {
        b.linked.bytes()
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

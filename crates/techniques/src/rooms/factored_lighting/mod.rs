//! The prefiltered light of an isotropic reflectance as a product of maps.
//!
//! Latta & Kolb (2002), *Homomorphic Factorization of BRDF-based Lighting Computation*; STAR04 7.3.5 (the
//! same 4-D input as Cabral's, compressed); McCool, Ang & Ahmad (2001), *Homomorphic Factorization of BRDFs
//! for High-Performance Rendering*; RH02 5.8 on factors over n:
//!
//! > **ln L_o(wo, n) ≈ Σ_j P_j(π_j)**, π ∈ {n, r, n·wo, wo} as the parameters choose
//!
//! by least squares over exact samples of L_o (eq. 32), uniform over normals and views. Each P_j is a map
//! whose bilinear weights are the entries of the sample's row; rows that ask each texel to be the mean of its
//! neighbours fill what the samples leave open. Rows count by a power `weight` of the radiance, and the
//! solution is refined about itself: with 1 the absolute error is minimised, with 0 the relative one, as
//! published, and the default is half-way. Radiance below 1e-4 of its mean counts as that. The maps hold
//! logarithms, in steps of halves.
//!
//! The factors' form is the one approximation: light and reflectance must be a product. V = 1. Radiance in W
//! sr⁻¹ m⁻². The light is static, up to a rotation, which turns the frame of n, r and wo. Refused:
//! anisotropic reflectance, point lights.

mod bake;
mod fit;
mod maps;
mod params;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::Report;
use crate::gpu::Uniform;
use crate::shared::light::distant::DistantLight;
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::material::views::Seen;
use crate::shared::{material::reflectance, trials::lights};
use crate::{
    Bake, BakeError, Capabilities, Card, Check, Claim, Geometry, GpuTechnique, Material, Needs, Part, Parts,
    Points, Radiance, Technique, View,
};
use bake::{Factors, ORDER};
use params::Params;
use steradian_base::Task;
use steradian_light::Lights;

/// The technique.
pub struct FactoredLighting;

impl Technique for FactoredLighting {
    const CARD: Card = Card {
        slug: "factored_lighting",
        title: "Factored lighting: a product of maps",
        citation: "Latta & Kolb 2002, Homomorphic Factorization of BRDF-based Lighting Computation; STAR04 7.3.5; \
                   McCool, Ang & Ahmad 2001; LSQR: Paige & Saunders 1982",
        equation: "ln L_o = ln s + P_n(n) + P_r(r) + P_e(n·wo) + P_v(wo)",
        light: "static, up to rotation: fitted together with the reflectance, floor 1e-4 of the mean radiance",
        visibility: "none: V = 1",
        reflectance: "any isotropic, fitted together with the light as a product of maps",
        materials: reflectance::isotropic,
        specimens: &[
            "lambert:albedo=0.8/0.5/0.2",
            "phong-map:n=30",
            "ggx:alpha=0.25,f0=0.9/0.6/0.3",
            "ashikhmin-shirley:nu=50,nv=50,rs=0.1,rd=0.5",
        ],
        exact_when: &[
            Claim::new(
                "the surface is lambertian: n alone",
                lights::smooth,
                "lambert:albedo=0.8/0.5/0.2",
                0.01,
            ),
            Claim::new(
                "the lobe is round about r and ends at no horizon: r alone",
                lights::smooth,
                "phong-map:n=30",
                0.01,
            ),
            Claim::new(
                "the light is constant: n·wo alone, the albedo",
                lights::furnace,
                "ggx:alpha=0.25,f0=0.9/0.6/0.3",
                0.01,
            ),
        ],
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            all_isotropic: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: false, view: false },
        waived: &[(Check::Linearity, "the logarithm of a sum of lights is not the sum of their logarithms")],
    };
    type Params = Params;
    type Light = DistantLight;
    type Material = Seen;
    type Transfer = ();
    type Linked = Factors;
    type Frame = LightRotation;
    const EFFORT: f64 = 2.2;

    fn light(l: &Lights, _: &Params, task: &Task) -> Result<DistantLight, BakeError> {
        DistantLight::bake(Self::CARD.slug, l, ORDER, task)
    }

    fn material(m: &Material, _: &Params, task: &Task) -> Result<Seen, BakeError> {
        bake::seen(m, task)
    }

    fn transfer(_: Option<&Geometry>, _: &Seen, _: &Params, _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, p: &Params, task: &Task) -> Result<(Factors, Report), BakeError> {
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

//! Shading with any reflectance by spherical harmonics.
//!
//! Kautz, Sloan & Snyder (2002), *Fast, Arbitrary BRDF Shading for Low-Frequency Lighting Using Spherical
//! Harmonics*, eq. 1; STAR04 7.4.4, eqs 47–51.
//!
//! > L_o(wo) = Σ_i L_i c_i(wo),  c_i(wo) = ∫ y_i(wi) f(wi, wo) ⟨n·wi⟩ dwi
//!
//! with L_i the light's coefficients in the frame of the point, W sr⁻¹ m⁻². Approximated: L, by its first
//! bands, and the view, by a table on the paraboloid; V = 1. f is exact up to those bands: no separation, no
//! symmetry is assumed. Where its widths vary over the surface, c_i(wo, q) has a table for each of some
//! widths q. Suns are taken out of the light and shaded with the reflectance itself (the paper's section 7).
//! Refused: point lights, and highlights along circles too narrow to certify.

mod bake;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::{self, Model, Report, Target};
use crate::gpu::Uniform;
use crate::local::{Content, Plane};
use crate::shared::light::sunlit_spectrum::{self, SunlitSpectrum};
use crate::shared::material::view_table::{self, SiteFrames, Views};
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Parts, Points,
    Radiance, Technique, View,
};
use bake::{Fix, Linked, Params};
use shade::Frame;
use steradian_base::Task;
use steradian_brdf::Brdf;
use steradian_light::Lights;

/// The technique.
pub struct ShBrdf;

const EXACT: &[Claim] = &[
    Claim::new(
        "the light is constant and the reflectance lambert's",
        lights::furnace,
        "lambert:albedo=0.8/0.5/0.2",
        1e-5,
    ),
    Claim::new(
        "the light has no bands above those of the table: up to the lookup between its texels",
        lights::quadratic,
        "ashikhmin-shirley:nu=12,nv=4",
        2e-4,
    )
    .with(&[("size", 256.0)]),
    Claim::new(
        "the reflectance is smooth and the light has no higher bands",
        lights::quadratic,
        "phong-map:n=2",
        1e-4,
    ),
];

impl Technique for ShBrdf {
    const CARD: Card = Card {
        slug: "sh_brdf",
        title: "Any reflectance as a table of spherical harmonics over the view",
        citation: "Kautz, Sloan & Snyder 2002, Fast, Arbitrary BRDF Shading for Low-Frequency Lighting Using Spherical \
                   Harmonics, eq. 1; STAR04 7.4.4, eqs 47–51",
        equation: "L_o = Σ_i L_i c_i(wo), c_i(wo) = ∫ y_i f_cos(·, wo) dwi",
        light: "spherical harmonics of 5 bands (3 to 15), turned with each point's frame; suns as disks",
        visibility: "none: V = 1",
        reflectance: "spherical harmonics of f_cos for each view, a table on the paraboloid",
        materials: certify::measurable,
        specimens: &[
            "ashikhmin-shirley:nu=12,nv=4",
            "ggx:ax=0.2,ay=0.5,f0=0.9/0.6/0.3",
            "lambert:albedo=0.8/0.5/0.2",
            "minnaert:k=0.65",
        ],
        exact_when: EXACT,
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            certain_isotropic: true,
            certain_anisotropic: true,
            all_isotropic: true,
            all_anisotropic: true,
            shift_variant: true,
            bump_mapping: true,
            dynamic_lighting: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: true, view: false },
        waived: &[],
    };
    /// Map of widths, from 0.0001, the least that any model accepts, or of exponents, to the largest.
    const PLANES: &'static [Plane] = &[Plane::new(view_table::PLANE, Content::Numbers).within(1e-4, 1e8, 2)];
    type Params = Params;
    type Light = SunlitSpectrum;
    type Material = Views;
    type Transfer = SiteFrames;
    type Linked = Linked;
    type Frame = Frame;

    fn light(l: &Lights, _: &Params, task: &Task) -> Result<SunlitSpectrum, BakeError> {
        sunlit_spectrum::bake(Self::CARD.slug, l, steradian_brdf::views::ORDER, task)
    }

    fn material(m: &Material, p: &Params, task: &Task) -> Result<Views, BakeError> {
        bake::views(m, p, task)
    }

    fn needs_sites(p: &Params) -> bool {
        p.fix() != Fix::Nothing
    }

    fn needs_view(p: &Params) -> bool {
        p.fix() == Fix::View
    }

    fn transfer(g: Option<&Geometry>, _: &Views, p: &Params, _: &Task) -> Result<SiteFrames, BakeError> {
        bake::frames(g, p)
    }

    fn link(parts: Parts<'_, Self>, p: &Params, task: &Task) -> Result<(Linked, Report), BakeError> {
        bake::link(parts.light, parts.material, p, task)
    }

    fn target<'a>(b: &'a Bake<Self>, brdf: Option<&'a dyn Brdf>) -> Option<Target<'a>> {
        let brdf = brdf?;
        let Some(places) = &b.material.places else { return Some(Target::Integral(Model::of(brdf))) };
        let model = |(uv, f)| (uv, Model::owned(f));
        Some(Target::Places(places.looked_at(brdf).into_iter().map(model).collect()))
    }

    fn is_textured(b: &Bake<Self>) -> bool {
        b.material.places.is_some()
    }

    fn bytes(b: &Bake<Self>) -> usize {
        crate::Part::bytes(&*b.material) + crate::Part::bytes(&b.linked) + crate::Part::bytes(&*b.transfer)
    }

    fn frame(b: &Bake<Self>, v: &View, f: &mut Frame) {
        f.renew(b, v);
    }

    fn shade(b: &Bake<Self>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
        shade::shade(b, f, q, out);
    }

    fn gpu(b: &Bake<Self>, f: &Frame) -> GpuTechnique {
        shade::gpu(b, f)
    }

    fn gpu_frame(b: &Bake<Self>, f: &Frame) -> Option<Vec<Uniform>> {
        shade::gpu_frame(b, f)
    }
}

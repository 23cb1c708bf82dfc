//! Spherical harmonic reflection maps, the local form.
//!
//! Ramamoorthi & Hanrahan (2002), *Frequency Space Environment Map Rendering*, section 5.4: B(C, wo') = Σ_{p
//! ≤ P} Σ_{|q| ≤ p} B_pq(C) y_pq(wo') (5.10), where B_pq(C) = Σ_l ρ̂_lp|q| L'_lq(C) (5.9) are maps over the
//! central direction C (the mirror direction of wo, the normal, or the tangent) and wo' is wo in the frame
//! about C. Approximated: the variation with the view, truncated at order P, and all frequencies beyond F.
//! Beyond the paper: about the mirror direction y_pq are functions of n', half way from C to wo', so that
//! they differ between grazing views; ρ̂ is a fit weighted by elevation of f_cos over its albedo, which
//! shading multiplies back; a diffuse part may take a map of its own about n; orders follow from the spectrum
//! of the light at hand; and where a sun needs higher orders than the maps have, it is taken out of the light
//! and shaded with the exact reflectance ([`steradian_prefilter::Apart`]). Radiance in W sr⁻¹ m⁻². Refused:
//! anisotropic reflectance (but Kajiya–Kay and Banks's map, about the tangent), point lights.

mod bake;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::Report;
use crate::gpu::Uniform;
use crate::shared::light::exact::TurnedSuns;
use crate::shared::light::sunlit_spectrum::{self, SunlitSpectrum};
use crate::shared::material::kernels::{self, Kernels};
use crate::shared::shrm::{self, Orders};
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Parts, Points,
    Radiance, Technique, View,
};
use bake::ReflectionMaps;
use steradian_base::Task;
use steradian_light::Lights;

/// Highest band to which light is analysed.
const ORDER: usize = 255;

/// The technique.
pub struct Shrm;

impl Technique for Shrm {
    const CARD: Card = Card {
        slug: "shrm",
        title: "Spherical harmonic reflection maps (local)",
        citation: "Ramamoorthi & Hanrahan 2002, Frequency Space Environment Map Rendering, eqs 5.9-5.10",
        equation: "L_o = a(n·wo) Σ_pq B_pq(C) y_pq(n') + Σ_k ∫_disk k L f_cos, y_pq(wo') as published",
        light: "spherical harmonics up to F, multiplied with the reflectance's into maps B_pq; suns that need more as disks",
        visibility: "none: V = 1",
        reflectance: "spherical harmonic coefficients about the central direction: l up to F, p up to P",
        materials: kernels::materials,
        specimens: &[
            "phong-normalized:s=30",
            "ggx:alpha=0.36,f0=0.9/0.6/0.3",
            "lafortune:@skin",
            "kajiya-kay:s=16",
        ],
        exact_when: &[
            Claim::new(
                "the light is constant: the albedo goes its own way",
                lights::furnace,
                "ggx:alpha=0.25,f0=0.9/0.6/0.3",
                2e-3,
            ),
            Claim::new(
                "the lobe is radially symmetric: P = 0 holds it",
                lights::smooth,
                "phong-normalized:s=30",
                2e-3,
            )
            .with(&[("p", 0.0), ("order", 48.0), ("size", 192.0)]),
            Claim::new(
                "strands are seen about the tangent, in the limit of P",
                lights::quadratic,
                "kajiya-kay:s=8",
                4e-3,
            )
            .with(&[("p", 16.0), ("order", 24.0), ("size", 96.0)]),
        ],
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            certain_isotropic: true,
            all_isotropic: true,
            certain_anisotropic: true,
            bump_mapping: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: false, view: false },
        waived: &[],
    };
    type Params = Orders;
    type Light = SunlitSpectrum;
    type Material = Kernels;
    type Transfer = ();
    type Linked = ReflectionMaps;
    type Frame = TurnedSuns;
    const EFFORT: f64 = 0.7;
    const REFINED_BY: Option<&'static str> = Some("shrm_slices");

    fn light(l: &Lights, _: &Orders, task: &Task) -> Result<SunlitSpectrum, BakeError> {
        sunlit_spectrum::bake(Self::CARD.slug, l, ORDER, task)
    }

    fn material(m: &Material, p: &Orders, task: &Task) -> Result<Kernels, BakeError> {
        shrm::material(Self::CARD.slug, m, p, task)
    }

    fn transfer(_: Option<&Geometry>, _: &Kernels, _: &Orders, _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, p: &Orders, task: &Task) -> Result<(ReflectionMaps, Report), BakeError> {
        bake::link(parts.light, parts.material, p, task)
    }

    fn frame(b: &Bake<Self>, v: &View, f: &mut TurnedSuns) {
        *f = TurnedSuns::new(&b.linked.suns, v);
    }

    fn shade(b: &Bake<Self>, f: &TurnedSuns, q: &Points<'_>, out: &mut Radiance<'_>) {
        shade::shade(b, f, q, out);
    }

    fn gpu(b: &Bake<Self>, f: &TurnedSuns) -> GpuTechnique {
        shade::gpu(b, f)
    }

    fn gpu_frame(_: &Bake<Self>, f: &TurnedSuns) -> Option<Vec<Uniform>> {
        Some(vec![f.turn.uniform()])
    }
}

//! Spherical harmonic reflection maps, the global form.
//!
//! Ramamoorthi & Hanrahan (2002), *Frequency Space Environment Map Rendering*: the coefficients of every
//! local map turned to the world (5.14), B̂(C, wo) = Σ_pq B̂_pq(C) y_pq(wo) (5.11), wo in world directions.
//! Unlike the local maps, which turn with the frame, B̂_pq are smooth functions of the sphere and fit cubes.
//! With `distant`, the viewer is far away: every frame sums them into one reflection map B̂(C) = Σ_pq
//! B̂_pq(C) y_pq(−forward) (5.35), which shading looks up once. As in the local form y_pq are functions of n
//! rather than of wo, n ∝ C − forward in the frame's map; and where only q = 0 is needed, as for strands,
//! B_p0 is a function of the sphere already: P + 1 cubes hold it. Suns that need higher orders than the maps
//! have are shaded with the exact reflectance, as in the local form. Approximated: as in the local form,
//! orders P and F; with `distant`, the view too. Radiance in W sr⁻¹ m⁻². Refused: anisotropic reflectance
//! (but Kajiya–Kay and Banks's map), point lights.

mod bake;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::Report;
use crate::gpu::Uniform;
use crate::shared::light::sunlit_spectrum::{self, SunlitSpectrum};
use crate::shared::material::kernels::{self, Kernels};
use crate::shared::shrm;
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Parts, Points,
    Radiance, Technique, View,
};
use bake::{Cubes, Params};
use shade::Now;
use steradian_base::Task;
use steradian_light::Lights;

/// Highest band to which light is analysed.
const ORDER: usize = 255;

/// The technique.
pub struct ShrmGlobal;

impl Technique for ShrmGlobal {
    const CARD: Card = Card {
        slug: "shrm_global",
        title: "Spherical harmonic reflection maps (global)",
        citation: "Ramamoorthi & Hanrahan 2002, Frequency Space Environment Map Rendering, eqs 5.11-5.14 and 5.35",
        equation: "L_o = a(n·wo) Σ_pq B̂_pq(C) y_pq(n) + Σ_k ∫_disk k L f_cos, y_pq(wo) as published",
        light: "spherical harmonics up to F, multiplied with the reflectance's and turned to the world: cubes B̂_pq; \
                suns that need more as disks",
        visibility: "none: V = 1",
        reflectance: "spherical harmonic coefficients about the central direction: l up to F, p up to P",
        materials: kernels::materials,
        specimens: &["phong-normalized:s=30", "ggx:alpha=0.36,f0=0.9/0.6/0.3", "kajiya-kay:s=16"],
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
            .with(&[("p", 0.0), ("order", 48.0), ("size", 96.0)]),
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
        needs: Needs { environment: true, sites: false, uv: false, tangents: false, view: true },
        waived: &[],
    };
    type Params = Params;
    type Light = SunlitSpectrum;
    type Material = Kernels;
    type Transfer = ();
    type Linked = Cubes;
    type Frame = Now;
    const EFFORT: f64 = 0.8;
    const REFINED_BY: Option<&'static str> = Some("shrm_slices");

    fn light(l: &Lights, _: &Params, task: &Task) -> Result<SunlitSpectrum, BakeError> {
        sunlit_spectrum::bake(Self::CARD.slug, l, ORDER, task)
    }

    fn material(m: &Material, p: &Params, task: &Task) -> Result<Kernels, BakeError> {
        shrm::material(Self::CARD.slug, m, &p.orders, task)
    }

    fn transfer(_: Option<&Geometry>, _: &Kernels, _: &Params, _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, p: &Params, task: &Task) -> Result<(Cubes, Report), BakeError> {
        bake::link(parts.light, parts.material, p, task)
    }

    fn frame(b: &Bake<Self>, v: &View, f: &mut Now) {
        f.renew(&b.linked, v);
    }

    fn shade(b: &Bake<Self>, f: &Now, q: &Points<'_>, out: &mut Radiance<'_>) {
        shade::shade(b, f, q, out);
    }

    fn gpu(b: &Bake<Self>, f: &Now) -> GpuTechnique {
        shade::gpu(b, f)
    }

    fn gpu_frame(b: &Bake<Self>, f: &Now) -> Option<Vec<Uniform>> {
        // A far viewer's map is a table that frames change.
        (!b.linked.distant).then(|| vec![f.shown.turn.uniform()])
    }
}

//! Explicit elevation slices: Fourier series in the viewer's azimuth, principal components in its elevation.
//!
//! Ramamoorthi & Hanrahan (2002) expand the reflected light in spherical harmonics of the view about the
//! mirror direction (5.10). At grazing angles broad lobes vary too fast for a few p, and the representation
//! fails first where reflection is strongest. The same coefficients before their last step (5.22), k_lq(θ_o)
//! instead of ρ̂_lpq, hold at every elevation: B(C; θ_v, φ_o) = a(θ_v) Σ_{|q| ≤ Q} a_q(φ_o) Σ_r u_rq(θ_v)
//! B_rq(C), B_rq = Σ_l v_lr|q| L'_lq(C), with a_q = 1, √2 cos qφ, √2 sin |q|φ, a the albedo, and
//! k_lq(θ_v)/a(θ_v) ≈ Σ_r u_rq(θ_v) v_lrq the fewest products that represent all elevations under the given
//! light (`components`). The centre lies between the mirror direction and the middle of the lobe, where it
//! needs few q, and the slices of all elevations are aligned. Suns, and as many small lights as the tolerance
//! needs, are taken out of the light and shaded with the exact reflectance ([`steradian_prefilter::Apart`]).
//! Approximated: F, Q, R_q, the lookups, each chosen by its exact error in the mean over frames. Radiance in
//! W sr⁻¹ m⁻². Refused: anisotropic reflectance (but Kajiya–Kay and Banks's map, about the tangent), point
//! lights.

mod bake;
mod choose;
mod components;
mod material;
mod pursue;
mod scaled;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::Report;
use crate::gpu::Uniform;
use crate::shared::light::exact::TurnedSuns;
use crate::shared::light::sunlit_spectrum::{self, SunlitSpectrum};
use crate::shared::material::kernels::{self, Kernels};
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Parts, Points,
    Radiance, Technique, View,
};
use bake::SliceMaps;
use material::Params;
use steradian_base::Task;
use steradian_light::Lights;

/// Highest band to which light is analysed.
const ORDER: usize = 255;

/// The technique.
pub struct ShrmSlices;

impl Technique for ShrmSlices {
    const CARD: Card = Card {
        slug: "shrm_slices",
        title: "Reflection maps by elevation slices",
        citation: "after Ramamoorthi & Hanrahan 2002, Frequency Space Environment Map Rendering, eqs 5.9 and 5.22; \
                   slices by elevation and their components are ours",
        equation: "L_o = a(θ_v) Σ_q a_q(φ_o) Σ_r u_rq(θ_v) B_rq(C) + Σ_k ∫_sun k L f_cos",
        light: "suns and what else is small and bright as texels and disks; the rest in spherical harmonics up to F, in maps B_rq",
        visibility: "none: V = 1",
        reflectance: "slices by elevation in spherical harmonics near the lobe's middle, as few products; exact for suns",
        materials: kernels::materials,
        specimens: &["phong-normalized:s=30", "ggx:alpha=0.36,f0=0.9/0.6/0.3", "kajiya-kay:s=16"],
        exact_when: &[
            Claim {
                statement: "the light is constant: the albedo goes its own way",
                light: lights::furnace,
                brdf: "ggx:alpha=0.25,f0=0.9/0.6/0.3",
                params: &[],
                within: 2e-3,
            },
            Claim {
                statement: "the lobe is radially symmetric: one map holds it",
                light: lights::smooth,
                brdf: "phong-normalized:s=30",
                params: &[("size", 192.0)],
                within: 4e-3,
            },
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
    type Params = Params;
    type Light = SunlitSpectrum;
    type Material = Kernels;
    type Transfer = ();
    type Linked = SliceMaps;
    type Frame = TurnedSuns;
    const EFFORT: f64 = 2.0;

    fn light(l: &Lights, _: &Params, task: &Task) -> Result<SunlitSpectrum, BakeError> {
        sunlit_spectrum::bake(Self::CARD.slug, l, ORDER, task)
    }

    fn material(m: &Material, p: &Params, task: &Task) -> Result<Kernels, BakeError> {
        material::bake(Self::CARD.slug, m, p, task)
    }

    fn transfer(_: Option<&Geometry>, _: &Kernels, _: &Params, _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, p: &Params, task: &Task) -> Result<(SliceMaps, Report), BakeError> {
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

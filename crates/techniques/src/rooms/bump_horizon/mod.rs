//! Bumps that shadow themselves: any reflectance about normals of a texture, times the part of the light that
//! each texel sees.
//!
//! Heidrich, Daubert, Kautz & Seidel (2000), *Illuminating Micro Geometry Based on Precomputed Visibility*;
//! Sloan & Cohen (2000), *Interactive Horizon Mapping*; Max (1988); STAR04 6.4.2. With the texel's normal n'
//! and its horizon
//!
//! > L_o = Σ_l E_l V(l) f'(l, v) (n'·l)₊
//!
//! f' in the frame of n'. V by `shadow=horizon`: the elevation e of the horizon at `azimuths` equal steps,
//! linear between them; lit where the light stands above it, or, for a light of angular radius ρ (`width`),
//! the part of its disk that a straight horizon leaves, 1 − (acos x − x √(1 − x²))/π with x = (θ − e)/ρ. By
//! `shadow=ellipse`: five numbers, lit where a x² + b xy + c y² + d x + e y ≤ 1 of the light's tangential
//! part (x, y). Approximated: the horizon between azimuths or by its conic, and both between texels, where
//! elevations and coefficients are interpolated, and averaged under a footprint, as normals are. Where n'
//! turns away from the viewer it is bent back, as other shading normals are. Exact without bumps.
//!
//! With `bounces` light from bump to bump is added, along links S_i(p) that were followed beforehand from
//! each texel along fixed directions d_i (the paper's scattering textures; STAR04 6.4.3):
//!
//! > L(p) += Σ_i w_i f'(d_i, v)(n'·d_i) L_d(S_i(p), −d_i), w_i (n'·d_i) = π/N
//!
//! with the direct light L_d, shadows included, of the texel that is met. The directions here are fixed in
//! the frame of n' (in that of the surface half of a set lies below any bump) and cosine-distributed. Light
//! of b + 1 reflections takes at each texel one link more, that of another direction, so that the cost is
//! `bounces` · N lookups and no power of N. Approximated: the integral over directions by N, the texel that
//! is met by the nearest one. Units: radiance in W sr⁻¹ m⁻². The height map repeats, and its texels count as
//! squares on the surface.

mod bake;
mod error;
mod horizon;
mod links;
mod scatter;
mod shade;
#[cfg(test)]
mod tests;

use crate::local::{self, LocalText, Place, Plane, TexturedTechnique};
use crate::shared::{surface::bumps, trials::lights};
use crate::{BakeError, Capabilities, Card, Claim, Material};
use bake::{Params, Relief};
use horizon::Texel;
use std::sync::Arc;
use steradian_base::Task;
use steradian_brdf::Brdf;
use steradian_scene::surface::NormalMap;

/// The technique.
pub struct BumpHorizon;

fn materials(_: &dyn Brdf) -> Result<(), String> {
    Ok(())
}

impl TexturedTechnique for BumpHorizon {
    const CARD: Card = Card {
        slug: "bump_horizon",
        title: "Bumps that shadow themselves: horizons or ellipses by texel",
        citation: "Heidrich, Daubert, Kautz & Seidel 2000, Illuminating Micro Geometry Based on Precomputed Visibility; Sloan & \
                   Cohen 2000, Interactive Horizon Mapping; Max 1988; STAR04 6.4.2",
        equation: "L_o = Σ_l E_l V(l) f'(l, v) (n'·l)₊",
        light: local::LIGHT,
        visibility: "of bumps: the horizon at equal azimuths, or one ellipse, and light from bump to bump along links; rays at each point \
                     where asked for",
        reflectance: "any, about normals by texel",
        materials,
        specimens: &["lambert:albedo=0.6", "ggx:alpha=0.3,f0=0.9"],
        exact_when: &[
            Claim::new("no bumps: a near point light", lights::near_point, "ggx:alpha=0.3", 1e-6),
            Claim::new(
                "no bumps: three directional lights",
                lights::three_directionals,
                "minnaert:k=0.65",
                1e-6,
            ),
        ],
        capabilities: Capabilities {
            diffuse: true,
            certain_isotropic: true,
            certain_anisotropic: true,
            all_isotropic: true,
            all_anisotropic: true,
            bump_mapping: true,
            self_shadowing: true,
            interreflections: true,
            ..local::CAPABILITIES
        },
        needs: local::NEEDS_TEXELS,
        waived: &[],
    };
    const PLANES: &'static [Plane] = &bumps::PLANES;
    const METRIC: &'static str = "relative RMS error of V f cos over texels and directions of light and view, of one local light, \
                                  against rays over the heights";
    type Params = Params;
    type Tables = Relief;
    type Texel = Texel;

    fn bake(m: &Material, p: &Params, task: &Task) -> Result<Relief, BakeError> {
        bake::bake(m, p, task)
    }

    fn details(t: &Relief) -> Vec<(&'static str, f64)> {
        error::details(t)
    }

    fn bytes(t: &Relief) -> usize {
        t.normals.bytes() + t.horizons.bytes() + t.scatter.as_ref().map_or(0, |s| s.bytes())
    }

    fn normals(t: &Relief) -> Option<Arc<NormalMap>> {
        t.bumps.as_ref().map(|b| b.map.clone())
    }

    fn error(t: &Relief, m: &Material) -> f64 {
        error::error(t, m)
    }

    fn texel(t: &Relief, at: Place, wo: [f32; 3]) -> Texel {
        horizon::texel(t, at, wo)
    }

    fn f_cos(t: &Relief, x: &Texel, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        shade::f_cos(t, x, wi, wo)
    }

    fn text(t: &Relief) -> Option<LocalText> {
        shade::text(t)
    }
}

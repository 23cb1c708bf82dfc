//! Light from surface to surface of a mesh along links that were followed beforehand, any reflectance.
//!
//! Daubert, Heidrich, Kautz, Dischler & Seidel (2003), *Efficient Light Transport Using Precomputed
//! Visibility*; Carr, Hall & Hart (2003), *GPU Algorithms for Radiosity and Subsurface Scattering*; STAR04
//! 6.4.3. A ray from each vertex p of a mesh along each of N directions d_i that all vertices share finds
//! once the surface point S_i(p) that p sees there: the scattering textures of Heidrich et al. (2000) where
//! nothing parametrizes the surface. Under lights, with the direct light L_d of the corners of what is seen,
//!
//! > L(p, v) = Σ_l V_l E_l f(l, v)(n·l)₊ + Σ_i w f(d_i, v)(n·d_i)₊ L_d(S_i(p), −d_i), w = π / Σ_i (n·d_i)₊
//!
//! and b reflections between surfaces are b such sums one after the other (`bounces`). Where the reflectance
//! is Lambert's, radiance leaves equally in all directions, and the sums are a radiosity solution, with form
//! factors from the links, as in Carr et al. Links end in triangles, between whose corners light is
//! interpolated (`hits=barycentric`), or at the nearest corner (`hits=vertex`), as Daubert et al. do where a
//! mesh has no parametrization.
//!
//! The radiance that arrives at each vertex along each d_i is found once a frame, on the CPU, and serves all
//! viewers; points interpolate it between the corners of their triangle and reflect it by their own normal.
//! V_l is tried by a ray at each vertex (`shadow=vertex`) and interpolated for points; where the caller asks
//! for shadows, rays are cast from the points themselves instead. Approximated: the integral over directions
//! by N; light between vertices. Lobes narrower than the distance between directions show as several lobes.
//! Exact without a mesh (`bounces=0,shadow=none`), where only the reflectance remains. Units: radiance in W
//! sr⁻¹ m⁻². Surfaces seen from behind are black. Lights may move in every frame, the mesh may not.

mod bake;
mod shade;
mod tables;
#[cfg(test)]
mod tests;

use crate::local::{self, LocalBaked, LocalFrame, LocalShading, LocalText, Place, Plane, TexturedTechnique};
use crate::shared::trials::lights;
use crate::{BakeError, Capabilities, Card, Claim, Geometry, Material, Needs};
use steradian_base::Task;
use steradian_brdf::Brdf;
use tables::{Params, Tables};

const SLUG: &str = "precomputed_visibility";

/// The technique.
pub struct PrecomputedVisibility;

fn materials(_: &dyn Brdf) -> Result<(), String> {
    Ok(())
}

/// The parameters with which points need no mesh.
const ALONE: &[(&str, f64)] = &[("bounces", 0.0), ("shadow", 1.0)];

impl TexturedTechnique for PrecomputedVisibility {
    const CARD: Card = Card {
        slug: SLUG,
        title: "Light from surface to surface along precomputed links",
        citation: "Daubert, Heidrich, Kautz, Dischler & Seidel 2003, Efficient Light Transport Using Precomputed Visibility; Carr, \
                   Hall & Hart 2003, GPU Algorithms for Radiosity and Subsurface Scattering; STAR04 6.4.3",
        equation: "L(p, v) = Σ_l V_l E_l f(l, v)(n·l)₊ + Σ_i w f(d_i, v)(n·d_i)₊ L_d(S_i(p), −d_i)",
        visibility: "links from each vertex along fixed directions, followed beforehand; of lights a ray at each vertex, or at each \
                     point where asked for",
        reflectance: "any",
        materials,
        specimens: &["lambert:albedo=0.6", "ggx:alpha=0.3,f0=0.9"],
        exact_when: &[
            Claim::new("without a mesh: a near point light", lights::near_point, "ggx:alpha=0.3", 1e-6)
                .with(ALONE),
            Claim::new(
                "without a mesh: three directional lights",
                lights::three_directionals,
                "minnaert:k=0.65",
                1e-6,
            )
            .with(ALONE),
        ],
        capabilities: Capabilities {
            diffuse: true,
            certain_isotropic: true,
            certain_anisotropic: true,
            all_isotropic: true,
            all_anisotropic: true,
            self_shadowing: true,
            interreflections: true,
            dynamic_objects: false,
            ..local::CARD.capabilities
        },
        needs: Needs { sites: true, ..local::NEEDS },
        ..local::CARD
    };
    const PLANES: &'static [Plane] = &[];
    const METRIC: &'static str = "relative RMS error of outgoing radiance over points of the mesh and views, by the area that these show \
                                  of it, half of them mirroring light, under three directional lights, against paths through it; \
                                  without a mesh that of f cos over directions";
    const PER_POINT: &'static [(&'static str, f64)] = ALONE;
    type Params = Params;
    type Tables = Tables;
    type Texel = ();

    fn bake(m: &Material, _: &Params, _: &Task) -> Result<Tables, BakeError> {
        Ok(bake::bake(m))
    }

    fn needs_sites(p: &Params) -> bool {
        !p.alone()
    }

    fn transfer(t: Tables, m: &Material, g: &Geometry, p: &Params, task: &Task) -> Result<Tables, BakeError> {
        bake::transfer(t, m, g, p, task)
    }

    fn details(t: &Tables) -> Vec<(&'static str, f64)> {
        bake::details(t)
    }

    fn bytes(t: &Tables) -> usize {
        t.seen.as_ref().map_or(0, |s| s.bytes())
    }

    fn error(t: &Tables, m: &Material) -> f64 {
        bake::error_of(t, m)
    }

    fn texel(_: &Tables, _: Place, _: [f32; 3]) {}

    fn f_cos(t: &Tables, (): &(), wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        shade::f_cos(t, wi, wo)
    }

    fn text(t: &Tables) -> Option<LocalText> {
        LocalText::of_model(&*t.brdf)
    }

    fn lit(b: &LocalBaked<Self>, frame: &LocalFrame<'_>) -> Result<Box<dyn LocalShading>, BakeError> {
        shade::lit(b, frame)
    }
}

//! Reflection-space image-based rendering: twelve prefiltered spheres, warped and blended.
//!
//! Cabral, Olano & Nemec (1999), *Reflection Space Image Based Rendering*; STAR04 7.3.5, eq. 32; twelve views
//! at the vertices of an icosahedron: RH02 5.3.2, 5.6.2. For each view wo_i, B_i(n) = L_o(wo_i, n) is exact
//! for any isotropic reflectance. For another view,
//!
//! > **r = 2(n·wo)n − wo, n_i = (wo_i + r)/|wo_i + r|, L_o(wo, n) ≈ Σ_i w_i B_i(n_i)**
//!
//! over the three nearest views, w barycentric on the sphere. The warp n → n_i keeps the mirror direction, so
//! B_i is stored over r and one direction serves all three lookups. No n_i faces away from its view:
//! n_i·wo_i = √((1 + r·wo_i)/2) ≥ 0. The one singular direction is r = −wo_i, where n_i may be any normal at
//! a right angle to wo_i: there the map holds the mean over these, the view grazing.
//!
//! With `warp` = 0 it is the normal that the warp keeps, STAR04's other choice: n_i = n, over the views that
//! see the surface, the less the nearer it is to their horizon.
//!
//! The one factor approximated is the dependence on the view other than through r. For a Lambertian surface
//! it is all wrong (it depends on n, not on r), so with `diffuse_split` (the default) the largest Lambertian
//! part of the reflectance is looked up by n in a map of its own. V = 1. Radiance in W sr⁻¹ m⁻². Refused:
//! anisotropic reflectance, point lights.

mod bake;
mod icosahedron;
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
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Part, Parts, Points,
    Radiance, Technique, View,
};
use bake::{ORDER, Params, ViewMaps};
use steradian_base::Task;
use steradian_light::Lights;

/// The technique.
pub struct ReflectionSpaceIbr;

impl Technique for ReflectionSpaceIbr {
    const CARD: Card = Card {
        slug: "reflection_space_ibr",
        title: "Reflection-space IBR: twelve views, warped and blended",
        citation: "Cabral, Olano & Nemec 1999, Reflection Space Image Based Rendering; STAR04 7.3.5, eq. 32; RH02 5.6.2",
        equation: "L_o = Σ_i w_i B_i((wo_i + r)/|wo_i + r|) over the three nearest of twelve views",
        light: "twelve cube maps of outgoing radiance, prefiltered in frequency space, to the tolerance",
        visibility: "none: V = 1",
        reflectance: "any isotropic: exact at twelve views, elsewhere blended along r; its Lambertian part along n",
        materials: reflectance::isotropic,
        specimens: &[
            "lambert:albedo=0.8/0.5/0.2",
            "phong-map:n=30",
            "ggx:alpha=0.25,f0=0.9/0.6/0.3",
            "microfacet:sigma=0.2",
            "oren-nayar:sigma=0.5",
        ],
        exact_when: &[
            Claim::new(
                "the lobe is round about r and ends at no horizon: soft boxes",
                lights::studio,
                "phong-map:n=30",
                0.01,
            ),
            Claim::new(
                "the lobe is round about r and ends at no horizon: a sun",
                lights::sunny,
                "phong-normalized:s=60",
                0.01,
            ),
            Claim::new(
                "the surface is lambertian and split off",
                lights::studio,
                "lambert:albedo=0.8/0.5/0.2",
                0.01,
            )
            .with(&[("diffuse_split", 1.0)]),
        ],
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            all_isotropic: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: false, view: false },
        waived: &[],
    };
    type Params = Params;
    type Light = DistantLight;
    type Material = Seen;
    type Transfer = ();
    type Linked = ViewMaps;
    type Frame = LightRotation;

    fn light(l: &Lights, _: &Params, task: &Task) -> Result<DistantLight, BakeError> {
        DistantLight::bake(Self::CARD.slug, l, ORDER, task)
    }

    fn material(m: &Material, p: &Params, task: &Task) -> Result<Seen, BakeError> {
        bake::seen(m, p, task)
    }

    fn transfer(_: Option<&Geometry>, _: &Seen, _: &Params, _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(parts: Parts<'_, Self>, p: &Params, task: &Task) -> Result<(ViewMaps, Report), BakeError> {
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

//! Phong's lobe filtered on a dual paraboloid map.
//!
//! Kautz, Vázquez, Heidrich & Seidel (2000), *A Unified Approach to Prefiltered Environment Maps*; Heidrich &
//! Seidel (1998), *View-Independent Environment Maps*; STAR04 7.4.2:
//!
//! > B(r) ≈ (1 − ρ²) S(s, t) + ρ² L(s, t),  (s, t) = (r.x, r.y)/(1 + |r.z|),  ρ² = s² + t²
//!
//! A round kernel about a direction is nearly a disk on the paraboloid (the map is conformal), of radius (1 +
//! ρ²)/2 · R_L: R_S = R_L/2 in the middle, R_L at the rim. So two shift-invariant filters of the image, S
//! with radius R_S and L with R_L, are blended texel by texel: what filtering hardware can do. Wide kernels
//! are filtered on a small map. The map stands for ∫ (r·wi)₊ᴺ L dwi over the whole sphere (`phong-map`,
//! `phong-normalized`); `phong`'s horizon is dropped, and `lambert` is the lobe of exponent 1 about n, far
//! wider than the idea is made for. V = 1. Radiance in W sr⁻¹ m⁻². Refused: other reflectances, point lights.

mod bake;
mod lobe;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::Report;
use crate::gpu::Uniform;
use crate::shared::light::distant::DistantLight;
use crate::shared::light::light_rotation::LightRotation;
use crate::shared::material::reflectance::Reflectance;
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Parts, Points,
    Radiance, Technique, View,
};
use bake::{FilteredParaboloids, Params};
use steradian_base::Task;
use steradian_brdf::{Brdf, Form};

/// The technique.
pub struct ParaboloidFilter;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    if matches!(brdf.form(), Form::Phong { .. } | Form::Lambert { .. }) {
        return Ok(());
    }
    let instead = "lobe_maps, shrm or reference";
    let name = brdf.info().name;
    Err(format!("takes phong, phong-map, phong-normalized and lambert, not {name}: use {instead}"))
}

impl Technique for ParaboloidFilter {
    const CARD: Card = Card {
        slug: "paraboloid_filter",
        title: "Phong's lobe filtered on a dual paraboloid",
        citation: "Kautz, Vázquez, Heidrich & Seidel 2000, A Unified Approach to Prefiltered Environment Maps; Heidrich \
                   & Seidel 1998, View-Independent Environment Maps; STAR04 7.4.2",
        equation: "L_o = k_s ((1 − ρ²) S + ρ² L), S and L the light filtered on paraboloids with radii R_S and 2 R_S",
        light: "two paraboloids, convolved in the plane with two radii",
        visibility: "none: V = 1",
        reflectance: "phong-map: its lobe as a disk on the paraboloid; phong without its horizon",
        materials,
        specimens: &["phong-map:n=30", "phong:n=30", "phong-normalized:s=200", "lambert:albedo=0.8/0.5/0.2"],
        exact_when: &[
            Claim::new("the light is constant (phong-map)", lights::furnace, "phong-map:n=30", 1e-4),
            Claim::new(
                "the light is constant and the surface lambertian",
                lights::furnace,
                "lambert:albedo=0.8/0.5/0.2",
                1e-4,
            ),
            Claim::new("the lobe narrows and the light is smooth", lights::smooth, "phong-map:n=500", 5e-3),
        ],
        capabilities: Capabilities {
            global: true,
            certain_isotropic: true,
            bump_mapping: true,
            dynamic_lighting: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: false, view: false },
        waived: &[],
    };
    type Params = Params;
    type Light = DistantLight;
    type Material = Reflectance;
    type Transfer = ();
    type Linked = FilteredParaboloids;
    type Frame = LightRotation;

    fn light(l: &steradian_light::Lights, _: &Params, task: &Task) -> Result<DistantLight, BakeError> {
        DistantLight::bake(Self::CARD.slug, l, 0, task)
    }

    fn material(m: &Material, _: &Params, _: &Task) -> Result<Reflectance, BakeError> {
        Ok(Reflectance::of(m))
    }

    fn transfer(_: Option<&Geometry>, _: &Reflectance, _: &Params, _: &Task) -> Result<(), BakeError> {
        Ok(())
    }

    fn link(
        parts: Parts<'_, Self>,
        p: &Params,
        task: &Task,
    ) -> Result<(FilteredParaboloids, Report), BakeError> {
        bake::link(parts.light, parts.material, p, task)
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

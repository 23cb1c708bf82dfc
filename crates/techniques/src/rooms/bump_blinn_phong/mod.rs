//! Bump mapping: Blinn's highlight and a diffuse part about normals of a texture.
//!
//! Kilgard (2000), *A Practical and Robust Bump-mapping Technique for Today's GPUs*; Blinn (1978),
//! *Simulation of Wrinkled Surfaces*; STAR04 6.3.1. With n' the normal of the texel and h between l and v,
//!
//! > L_o = Σ_l E_l s(n·l) (k_d/π (n'·l)₊ + k_s (n'·h)₊ᴺ)
//!
//! Where the surface itself turns away from the light it is dark, whatever its texels say: s is 1 above the
//! surface's horizon and 0 below, or Kilgard's ramp min(1, 8 (n·l)₊), which hides the step. n' comes from a
//! height map by central differences (error O(Δ²) in the distance Δ of texels) or from a normal map.
//! Approximated: what lies under a sample's footprint. Levels hold the mean n̄ of the normals and their
//! covariance Σ. The diffuse part takes n̄ as it is, shorter than 1: exact where n'·l > 0 throughout. The
//! highlight is widened in one of three ways:
//!
//! - `mean`: not at all, about n̄/|n̄|;
//! - `toksvig` (Toksvig 2005, *Mipmapping Normal Maps*): N' = N |n̄|/(|n̄| + N (1 − |n̄|)), times (1 +
//!   N')/(1 + N);
//! - `covariance`: (n'·h)ᴺ is nearly a Gaussian of variance 1/N in the tangential part δ of h; with the
//!   normals' own it is the Gaussian of covariance I/N + Σ, times 1/√det(I + N Σ). Its exponent along δ,
//!   δᵀ(I/N + Σ)⁻¹δ/|δ|², stands in the power of n'·h, so that Σ = 0 gives the formula itself.
//!
//! Bumps cast no shadows on each other ([`super::bump_horizon`] has those). Exact per texel. Units: k_d and
//! k_s as those of `blinn-phong-gl`, radiance in W sr⁻¹ m⁻². Refused: other models than `blinn-phong-gl` and
//! `lambert`.

mod bake;
mod error;
mod shade;
#[cfg(test)]
mod tests;

use crate::local::{self, LocalText, Place, Plane, TexturedTechnique};
use crate::shared::{surface::bumps, trials::lights};
use crate::{BakeError, Capabilities, Card, Claim, Material};
use bake::{Bumped, Params};
use shade::Texel;
use std::sync::Arc;
use steradian_base::Task;
use steradian_brdf::{Brdf, Form};
use steradian_scene::surface::NormalMap;

/// The technique.
pub struct BumpBlinnPhong;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    match brdf.form() {
        Form::BlinnPhongGl { .. } | Form::Lambert { .. } => Ok(()),
        _ => {
            let name = brdf.info().name;
            Err(format!(
                "takes blinn-phong-gl and lambert, not {name}: use bump_horizon, which takes any model"
            ))
        }
    }
}

impl TexturedTechnique for BumpBlinnPhong {
    const CARD: Card = Card {
        slug: "bump_blinn_phong",
        title: "Bump mapping: Blinn's highlight and a diffuse part about the normals of a texture",
        citation: "Kilgard 2000, A Practical and Robust Bump-mapping Technique for Today's GPUs; Blinn 1978, Simulation of \
                   Wrinkled Surfaces; Toksvig 2005, Mipmapping Normal Maps; STAR04 6.3.1",
        equation: "L_o = Σ_l E_l s(n·l) (k_d/π (n'·l)₊ + k_s (n'·h)₊ᴺ)",
        light: local::LIGHT,
        visibility: "rays at each point where asked for; none between bumps",
        reflectance: "blinn-phong-gl and lambert, about normals by texel with their mean and covariance",
        materials,
        specimens: &["blinn-phong-gl:kd=0.5,ks=0.4,n=20", "lambert:albedo=0.6"],
        exact_when: &[
            Claim::new(
                "no bumps: a near point light",
                lights::near_point,
                "blinn-phong-gl:kd=0.3,n=40",
                1e-6,
            ),
            Claim::new(
                "no bumps: three directional lights",
                lights::three_directionals,
                "blinn-phong-gl:kd=0.3,n=40",
                1e-6,
            ),
        ],
        capabilities: Capabilities {
            diffuse: true,
            certain_isotropic: true,
            bump_mapping: true,
            ..local::CAPABILITIES
        },
        needs: local::NEEDS_TEXELS,
        waived: &[],
    };
    const PLANES: &'static [Plane] = &bumps::PLANES;
    type Params = Params;
    type Tables = Bumped;
    type Texel = Texel;

    fn bake(m: &Material, p: &Params, _: &Task) -> Result<Bumped, BakeError> {
        bake::bake(m, p)
    }

    fn details(t: &Bumped) -> Vec<(&'static str, f64)> {
        error::details(t)
    }

    fn bytes(t: &Bumped) -> usize {
        t.texels.bytes()
    }

    fn normals(t: &Bumped) -> Option<Arc<NormalMap>> {
        t.bumps.as_ref().map(|b| b.map.clone())
    }

    fn error(t: &Bumped, m: &Material) -> f64 {
        error::error(t, m)
    }

    #[inline(always)]
    fn texel(t: &Bumped, at: Place, _: [f32; 3]) -> Texel {
        shade::texel(t, at)
    }

    #[inline(always)]
    fn f_cos(t: &Bumped, x: &Texel, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        shade::f_cos(t, x, wi, wo)
    }

    fn text(t: &Bumped) -> Option<LocalText> {
        Some(shade::text(t))
    }
}

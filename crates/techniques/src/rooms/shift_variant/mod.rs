//! Ward's model, GGX, Blinn's highlight and Lafortune's lobe with normals, tangents and all numbers by texel.
//!
//! Kautz & Seidel (2000), *Towards Interactive Bump Mapping with Anisotropic Shift-Variant BRDFs*; STAR04
//! 6.3.2; the moments by which levels are filtered: Olano & Baker (2010), *LEAN Mapping*. In the frame of the
//! texel's normal n', whose tangent is turned by the texel's angle,
//!
//! > L_o = Σ_l E_l [n·l > 0] f'(l, v) (n'·l)₊,  f' of the texel's widths, factors and albedo
//!
//! A lobe of widths α_x along the tangent and α_y across it is one of the slopes of h, whose covariance
//!
//! > Σ = (α_x² + α_y²)/4 I + (α_x² − α_y²)/4 (cos 2φ, sin 2φ; sin 2φ, −cos 2φ)
//!
//! determines the models' dependence on widths and tangent: Ward's exponent and GGX's are ½ sᵀΣ⁻¹s, their
//! peaks have √det Σ for α_x α_y/2, GGX's masking √(2 wᵀΣw + w_z²), and (n·h)ᴺ is taken as Σ = I/N. Σ does
//! not distinguish t from −t, is independent of the tangent where α_x = α_y, and unchanged where t is turned
//! by 90° and the widths are swapped. It averages linearly under a footprint, and the covariance of the
//! normals' slopes there adds to it (LEAN mapping); factors and albedo average as they are. Nothing is
//! approximated at the texels. Where n' turns away from the viewer it is bent back, as other shading normals
//! are. Units: f in sr⁻¹, radiance in W sr⁻¹ m⁻². Lafortune's lobe (C ∘ v·l)ⁿ has C in place of Σ, with the
//! same turned form in the tangent plane; the covariance of the normals adds twice its trace to 1/n, since a
//! mirror turns light twice as far, and the lobe keeps its integral. Refused: other models than `ward`,
//! `ggx`, `blinn-phong-gl` and `lafortune` of one lobe whose C and n are those of all channels.

mod bake;
mod error;
mod shade;
#[cfg(test)]
mod tests;

use crate::local::{self, Content, LocalText, Place, Plane, TexturedTechnique};
use crate::shared::{surface::bumps, trials::lights};
use crate::{BakeError, Capabilities, Card, Claim, Material};
use bake::{LEAST, Params, Varied};
use shade::Texel;
use std::sync::Arc;
use steradian_base::Task;
use steradian_brdf::{Brdf, Form};
use steradian_scene::surface::NormalMap;

/// The technique.
pub struct ShiftVariant;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    match brdf.form() {
        Form::Ward { .. } | Form::Ggx { .. } | Form::BlinnPhongGl { .. } => Ok(()),
        Form::Lafortune(l) if bake::single(&l).is_some() => Ok(()),
        Form::Lafortune(_) => {
            Err("takes lafortune of one lobe with one C and n for all channels: use lafortune_svbrdf".into())
        }
        _ => {
            let name = brdf.info().name;
            Err(format!("takes ward, ggx, blinn-phong-gl and lafortune, not {name}: use exact"))
        }
    }
}

impl TexturedTechnique for ShiftVariant {
    const CARD: Card = Card {
        slug: "shift_variant",
        title: "Anisotropic lobes with normals, tangents and all numbers by texel",
        citation: "Kautz & Seidel 2000, Towards Interactive Bump Mapping with Anisotropic Shift-Variant BRDFs; Olano & Baker 2010, LEAN \
                   Mapping; STAR04 6.3.2",
        equation: "L_o = Σ_l E_l [n·l > 0] f'(l, v) (n'·l)₊, f' of the texel's Σ, factors and albedo",
        light: local::LIGHT,
        visibility: "rays at each point where asked for; none between bumps",
        reflectance: "ward, ggx, blinn-phong-gl and lafortune of one lobe, their numbers, normals and tangents by texel",
        materials,
        specimens: &[
            "ward:ax=0.15,ay=0.4,rs=0.3,rd=0.4",
            "ggx:ax=0.2,ay=0.4,f0=0.9/0.7/0.4",
            "blinn-phong-gl:kd=0.5,ks=0.4,n=20",
            "lafortune:cx=-0.95,cy=-0.8,cz=0.9,n=15,ks=0.5/0.4/0.2,kd=0.3",
        ],
        exact_when: &[
            Claim::new(
                "one reflectance everywhere: a near point light",
                lights::near_point,
                "ward:ax=0.2,ay=0.3,rs=0.4,rd=0.3,variant=duer",
                1e-5,
            ),
            Claim::new(
                "one reflectance everywhere: three directional lights",
                lights::three_directionals,
                "ggx:ax=0.3,ay=0.15,f0=0.8",
                1e-5,
            ),
        ],
        capabilities: Capabilities {
            diffuse: true,
            certain_isotropic: true,
            certain_anisotropic: true,
            shift_variant: true,
            bump_mapping: true,
            ..local::CAPABILITIES
        },
        needs: local::NEEDS_TEXELS,
        waived: &[],
    };
    const PLANES: &'static [Plane] = &[
        bumps::PLANES[0],
        bumps::PLANES[1],
        Plane::new("tangent", Content::Numbers),
        Plane::new("widths", Content::Numbers).within(LEAST as f32, 1e8, 2),
        Plane::new("lobe", Content::Numbers),
        Plane::new("specular", Content::Colours).within(0.0, 1e30, 3),
        Plane::new("albedo", Content::Colours).within(0.0, 1e30, 3),
    ];
    type Params = Params;
    type Tables = Varied;
    type Texel = Texel;

    fn bake(m: &Material, p: &Params, _: &Task) -> Result<Varied, BakeError> {
        bake::bake(m, p)
    }

    fn bytes(t: &Varied) -> usize {
        t.texels.bytes()
    }

    fn normals(t: &Varied) -> Option<Arc<NormalMap>> {
        t.bumps.as_ref().map(|b| b.map.clone())
    }

    fn error(t: &Varied, m: &Material) -> f64 {
        error::error(t, m)
    }

    #[inline(always)]
    fn texel(t: &Varied, at: Place, wo: [f32; 3]) -> Texel {
        shade::texel(t, at, wo)
    }

    #[inline(always)]
    fn f_cos(t: &Varied, x: &Texel, wi: [f32; 3], _: [f32; 3]) -> [f32; 3] {
        shade::f_cos(t, x, wi)
    }

    fn text(t: &Varied) -> Option<LocalText> {
        Some(shade::text(t))
    }
}

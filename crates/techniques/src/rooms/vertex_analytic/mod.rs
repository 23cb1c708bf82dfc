//! Any reflectance model evaluated at the corners of triangles and interpolated (Gouraud 1971), or at every
//! point.
//!
//! STAR04 6.1 and 6.2.1, eqs 10 and 11: vertex shaders evaluate a reflectance at vertices alone, whatever the
//! model (Minnaert's by NVIDIA, Blinn's Phong by OpenGL),
//!
//! > L_o(v) = Σ_l f(wi_l, wo)(n·wi_l)₊ E_l at a corner v,  L_o(x) = Σ_v b_v(x) L_o(v) inside
//!
//! with the barycentric weights b. Approximated: L_o between corners; a highlight that lies inside a triangle
//! is missed. Exact at the corners, and everywhere with `rate=pixel`, which is the exact shading of
//! [`crate::direct`] to the bit. The error falls with the square of the length of edges. Shadows are looked
//! up at each point, not at the corners. Units: radiance in W sr⁻¹ m⁻². Refused: nothing but a mesh without
//! normals.

mod bake;
mod shade;
#[cfg(test)]
mod tests;

use crate::local::{self, FCos, LocalBaked, LocalFrame, LocalShading, LocalTechnique, LocalText};
use crate::shared::trials::lights;
use crate::{BakeError, Capabilities, Card, Claim, Material, Needs};
use bake::{Model, Params};
use steradian_base::Task;
use steradian_brdf::Brdf;

/// The technique.
pub struct VertexAnalytic;

fn materials(_: &dyn Brdf) -> Result<(), String> {
    Ok(())
}

impl LocalTechnique for VertexAnalytic {
    const CARD: Card = Card {
        slug: "vertex_analytic",
        title: "Any model at the corners of triangles, interpolated, or at every point",
        citation: "Gouraud 1971, Continuous Shading of Curved Surfaces; STAR04 6.1 and 6.2.1, eqs 10 and 11",
        equation: "L_o(x) = Σ_v b_v(x) Σ_l f(wi_l, wo)(n·wi_l)₊ E_l at corners v",
        reflectance: "any; between corners interpolated, with rate=pixel exact",
        materials,
        specimens: &["blinn-phong-gl:n=20", "minnaert:k=0.65", "ggx:alpha=0.3,f0=0.9"],
        exact_when: &[
            Claim::new(
                "shaded at every point: a near point light",
                lights::near_point,
                "ggx:alpha=0.3",
                1e-6,
            )
            .with(PIXEL),
            Claim::new(
                "shaded at every point: three directional lights",
                lights::three_directionals,
                "minnaert:k=0.65",
                1e-6,
            )
            .with(PIXEL),
        ],
        capabilities: Capabilities {
            diffuse: true,
            certain_isotropic: true,
            certain_anisotropic: true,
            all_isotropic: true,
            all_anisotropic: true,
            bump_mapping: false,
            ..local::CARD.capabilities
        },
        needs: Needs { sites: true, view: true, ..local::CARD.needs },
        ..local::CARD
    };
    const PER_POINT: &'static [(&'static str, f64)] = PIXEL;
    type Params = Params;
    type Tables = Model;

    fn bake(m: &Material, _: &Params, _: &Task) -> Result<Model, BakeError> {
        Ok(Model(m.brdf.clone()))
    }

    fn needs_sites(p: &Params) -> bool {
        !p.pixel()
    }

    fn bytes(_: &Model) -> usize {
        0
    }

    fn stands_for<'a>(_: &'a Model, brdf: &'a dyn Brdf) -> FCos<'a> {
        Box::new(move |wi, wo| brdf.f_cos(wi, wo))
    }

    fn f_cos(t: &Model, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        t.f_cos(wi, wo)
    }

    fn text(t: &Model) -> Option<LocalText> {
        LocalText::of_model(&*t.0)
    }

    fn lit(b: &LocalBaked<Self>, frame: &LocalFrame<'_>) -> Result<Box<dyn LocalShading>, BakeError> {
        Ok(shade::lit(b, frame))
    }
}

/// The parameters of claims.
const PIXEL: &[(&str, f64)] = &[("rate", 1.0)];

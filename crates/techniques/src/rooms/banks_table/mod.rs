//! Banks's model of fibres from one table over two angles.
//!
//! Heidrich & Seidel (1998), *Efficient Rendering of Anisotropic Surfaces Using Computer Graphics Hardware*;
//! Banks (1994), *Illumination in Diverse Codimensions*; STAR04 6.2.2 and eq. 33. With sin a = l·t and sin
//! b = v·t
//!
//! > f (n·l) = (n·l) (k_d cos a + k_s cosᴺ(a + b)₊)
//!
//! The bracket depends on two numbers: it is a texture with two coordinates. Approximated: the bracket,
//! linear between entries. Over the angles the error of cosᴺ is at most N h²/4 with the spacing h of entries
//! in radians, because both second derivatives are N at most; over l·t and v·t themselves, as texture
//! coordinates of 1998 were (`coordinate=cosine`), the square root at |l·t| = 1 costs far more. Entries on
//! b = −a are 1. V is 1 or a shadow's. Exact up to that interpolation. Units: f in sr⁻¹, radiance in W sr⁻¹
//! m⁻². Refused: other models, and fibres that take light from behind (`banks-map`, `kajiya-kay`).

mod bake;
mod shade;
mod table;
#[cfg(test)]
mod tests;

use crate::local::{self, FCos, LocalTechnique, LocalText, far, near};
use crate::{BakeError, Capabilities, Card, Material};
use bake::Params;
use steradian_base::Task;
use steradian_brdf::model::strand::Kind;
use steradian_brdf::{Brdf, Form};
use table::Table;

/// The technique.
pub struct BanksTable;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    match brdf.form() {
        Form::Strand { kind: Kind::Banks, .. } => Ok(()),
        Form::Strand { .. } => {
            let why = "takes banks, which reflects light from above the surface, not";
            Err(format!("{why} {}: use exact", brdf.info().name))
        }
        _ => Err(format!("takes banks only, not {}: use vertex_analytic or exact", brdf.info().name)),
    }
}

impl LocalTechnique for BanksTable {
    const CARD: Card = Card {
        slug: "banks_table",
        title: "Fibres' highlights from one table over two angles to the tangent",
        citation: "Heidrich & Seidel 1998, Efficient Rendering of Anisotropic Surfaces Using Computer Graphics Hardware; \
                   Banks 1994, Illumination in Diverse Codimensions; STAR04 6.2.2, eq. 33",
        equation: "L_o = Σ_l E_l (n·l)(k_d cos a + k_s cosᴺ(a + b)₊), sin a = l·t, sin b = v·t",
        reflectance: "banks, linear between the entries of a table",
        materials,
        specimens: &["banks:n=30", "banks:n=60"],
        exact_when: &[
            near("up to the spacing of entries: a near point light", "banks:n=60"),
            far("up to the spacing of entries: three directional lights", "banks:n=30"),
        ],
        capabilities: Capabilities { certain_anisotropic: true, ..local::CARD.capabilities },
        ..local::CARD
    };
    type Params = Params;
    type Tables = Table;

    fn bake(m: &Material, p: &Params, task: &Task) -> Result<Table, BakeError> {
        bake::bake(m, p, task)
    }

    fn details(t: &Table) -> Vec<(&'static str, f64)> {
        vec![("resolution", t.resolution as f64)]
    }

    fn bytes(t: &Table) -> usize {
        t.grid.bytes()
    }

    fn stands_for<'a>(t: &'a Table, _: &'a dyn Brdf) -> FCos<'a> {
        Box::new(move |wi, wo| t.model.f_cos(wi, wo))
    }

    #[inline(always)]
    fn f_cos(t: &Table, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        shade::f_cos(t, wi, wo)
    }

    fn text(t: &Table) -> Option<LocalText> {
        Some(shade::text(t))
    }
}

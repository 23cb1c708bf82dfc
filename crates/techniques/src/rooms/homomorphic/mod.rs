//! Any reflectance as a product of a function of the view, one of the half vector, and the first again of the
//! light.
//!
//! McCool, Ang & Ahmad (2001), *Homomorphic Factorization of BRDFs for High-Performance Rendering*; STAR04
//! 6.2.3:
//!
//! > f (n·l) ≈ p(v) q(h) p(l) (n·l)
//!
//! In the logarithm the product is a sum, ln f = P(v) + Q(h) + P(l), and the fit a sparse linear one: each
//! sample is a row of interpolation weights. Rows weigh f (n·l) and the density of samples, so that the error
//! is that of f (n·l) to first order; Gauss–Newton steps then make it so. Further rows keep the maps smooth,
//! the more the less f is such a product. The product is reciprocal, to the bit. Exactly of this form are
//! Cook and Torrance's model with Smith's masking and f0 = 1 (p = G₁/n·v, q = D/4), Ward's of 1992 (p =
//! (n·v)^−½) and Dür's (p = (n·v)^−1), anisotropic ones too. GGX's height-correlated masking is no product,
//! and F with f0 < 1 depends on h·l, which no factor has.
//!
//! The tables are combined with two closed forms, both found by trial: the power of n·v with which p grows at
//! the horizon, and the widths of the highlight, in units of which Q's map has the slopes of h.
//!
//! Approximated: the form; both logarithms bilinear between entries. V is 1 or a shadow's. Units: f in sr⁻¹,
//! radiance in W sr⁻¹ m⁻². Refused: reflectance that takes light from behind.

mod bake;
mod fit;
mod form;
mod shade;
#[cfg(test)]
mod tests;

use crate::local::{self, LocalTechnique, LocalText, far, near};
use crate::shared::material::reflectance::one_sided;
use crate::{BakeError, Capabilities, Card, Material};
use bake::{Params, Tables};
use steradian_base::Task;

/// The technique.
pub struct Homomorphic;

impl LocalTechnique for Homomorphic {
    const CARD: Card = Card {
        slug: "homomorphic",
        title: "Any reflectance as a product of maps over view, half vector and light",
        citation: "McCool, Ang & Ahmad 2001, Homomorphic Factorization of BRDFs for High-Performance Rendering; \
                   STAR04 6.2.3; LSQR: Paige & Saunders 1982",
        equation: "L_o = Σ_l E_l p(v) q(h) p(l) (n·l)",
        reflectance: "any that takes light from above: a product of maps, fitted in the logarithm",
        materials: one_sided,
        specimens: &[
            "cook-torrance:m=0.3,f0=1,g=smith",
            "ggx:alpha=0.2,f0=0.9/0.6/0.3",
            "dielectric:alpha=0.3,albedo=0.6/0.3/0.1",
        ],
        exact_when: &[
            near(
                "f is such a product: Cook and Torrance's with Smith's masking and f0 = 1, a near point light",
                "cook-torrance:m=0.3,f0=1,g=smith",
            ),
            far(
                "f is such a product: Ward's of 1992, three directional lights",
                "ward:alpha=0.3,variant=1992",
            ),
            far(
                "f is such a product: Dür's form of Ward's, anisotropic, three directional lights",
                "ward:ax=0.2,ay=0.4,variant=duer",
            ),
        ],
        capabilities: Capabilities {
            diffuse: true,
            all_isotropic: true,
            all_anisotropic: true,
            ..local::CARD.capabilities
        },
        ..local::CARD
    };
    type Params = Params;
    type Tables = Tables;

    fn bake(m: &Material, p: &Params, task: &Task) -> Result<Tables, BakeError> {
        bake::bake(m, p, task)
    }

    fn details(t: &Tables) -> Vec<(&'static str, f64)> {
        vec![
            ("residual", t.residual),
            ("samples", t.samples as f64),
            ("steps", t.steps as f64),
            ("power at the horizon", f64::from(t.grazing)),
            ("entries over v and l", t.sides.len() as f64),
            ("entries over h", t.halves.len() as f64),
        ]
    }

    fn bytes(t: &Tables) -> usize {
        t.side.bytes() + t.half.bytes()
    }

    #[inline(always)]
    fn f_cos(t: &Tables, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        shade::f_cos(t, wi, wo)
    }

    fn text(t: &Tables) -> Option<LocalText> {
        Some(shade::text(t))
    }
}

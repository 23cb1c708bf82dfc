//! Any reflectance as a sum of products of two functions of a direction each.
//!
//! Kautz & McCool (1999), *Interactive Rendering with Arbitrary BRDFs using Separable Approximations*; STAR04
//! 6.2.3:
//!
//! > f (n·l) ≈ (n·l) Σ_k g_k(x) h_k(y),  k < K
//!
//! with (x, y) = (v, l), (h, d) or (h, v): h the half vector, d the light in a frame about h (of anisotropic
//! reflectance with the first axis along the tangent's part across h; of isotropic reflectance in the plane
//! of h and n, where x is the angle of h alone). With M the matrix of f at pairs of nodes, the terms minimise
//! the error of f (n·l) over directions of light and view, that is the error of M with weights (n·l)² dω_l
//! dω_v. Over (v, l) these are products of a weight of v and one of l, and the terms are the singular vectors
//! of √w M, so that ‖M − M_K‖² = Σ_{k≥K} σ_k². Over (h, d) and (h, v) a pair whose light or view lies below
//! the horizon is missing, which is not the same as 0: there the terms are found one by one, by alternating
//! least squares over the pairs that exist. `method=nd` is the normalised decomposition, one term without
//! least squares: g the mean of M over y, h that of M/g over x.
//!
//! Approximated: the sum, and both functions bilinear between entries. Sums below 0 count as 0. V is 1 or a
//! shadow's. Units: f in sr⁻¹, radiance in W sr⁻¹ m⁻². Refused: reflectance that takes light from behind.

mod bake;
mod coordinates;
mod samples;
mod shade;
#[cfg(test)]
mod tests;

use crate::local::{self, LocalTechnique, LocalText};
use crate::shared::material::reflectance::one_sided;
use crate::shared::trials::lights;
use crate::{BakeError, Capabilities, Card, Claim, Material};
use bake::{Params, Tables};
use steradian_base::Task;

/// The technique.
pub struct SeparableSvd;

impl LocalTechnique for SeparableSvd {
    const CARD: Card = Card {
        slug: "separable_svd",
        title: "Any reflectance as a sum of products of two maps",
        citation: "Kautz & McCool 1999, Interactive Rendering with Arbitrary BRDFs using Separable Approximations; \
                   STAR04 6.2.3; block Lanczos: Golub, Luk & Overton 1981; Halko, Martinsson & Tropp 2011",
        equation: "L_o = Σ_l E_l (n·l) Σ_k g_k(x) h_k(y), (x, y) = (v, l), (h, d) or (h, v)",
        reflectance: "any that takes light from above: a sum of products of two maps",
        materials: one_sided,
        specimens: &[
            "lambert:albedo=0.8/0.5/0.2",
            "ggx:alpha=0.2,f0=0.9/0.6/0.3",
            "ward:ax=0.15,ay=0.4",
            "dielectric:alpha=0.3,albedo=0.6/0.3/0.1",
        ],
        exact_when: &[
            Claim::new(
                "f is a function of the light times one of the view, as Lambert's: a near point light",
                lights::near_point,
                "lambert:albedo=0.8/0.5/0.2",
                1e-3,
            ),
            Claim::new(
                "f is a function of the light times one of the view, as Minnaert's: three directional lights",
                lights::three_directionals,
                "minnaert:k=1.4,albedo=0.9/0.6/0.3",
                1e-3,
            )
            .with(&[("parametrisation", 2.0), ("terms", 1.0)]),
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
        let [x, y] = [t.coordinates.x.len(), t.coordinates.y.len()].map(|n| n as f64);
        let mut all = vec![("terms", t.terms as f64), ("residual", t.residual)];
        all.extend(t.ratio.map(|r| ("second singular value over the first", r)));
        all.extend([("entries over x", x), ("entries over y", y)]);
        all
    }

    fn bytes(t: &Tables) -> usize {
        t.bytes()
    }

    #[inline(always)]
    fn f_cos(t: &Tables, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        shade::f_cos(t, wi, wo)
    }

    fn text(t: &Tables) -> Option<LocalText> {
        Some(shade::text(t))
    }
}

//! Microfacet models as products of tables of two numbers each.
//!
//! Heidrich & Seidel (1999), *Realistic, Hardware-Accelerated Shading and Lighting*, section 3; STAR04 6.2.2,
//! eq. 12:
//!
//! > f (n·l) = T1(h·l, n·h) T2(n·l, n·v),  T1 = F D/4,  T2 = G/(n·v)
//!
//! (the papers' 1/π with a D that has no 1/π). The n·l of the integral cancels that of the model. As in
//! Steigleder (2002), *Factorization of the Ashikhmin BRDF for Real-Time Rendering*, Ashikhmin and Shirley's
//! model takes three tables,
//!
//! > f (n·l) = (n·l) [T1(θ_h, φ_h) T2(h·l)/(h·l W) + T3(n·l, n·v)],  W = max(n·l, n·v)
//!
//! Approximated: the tables, linear between entries; entries are exact to rounding, and the error falls
//! fourfold as entries double. Three choices make it so. The coordinate of n·h is the angle θ_h, over which
//! narrow lobes are smooth at their peak. Of G the table holds the reciprocal (n·l)(n·v)/G, and shading
//! divides by it: at n·v → 0, where G/(n·v) has a limit that the corner n·l = n·v = 0 has not, it is smooth
//! and in closed form. And W is tabulated over the smaller and the larger cosine, which has no kink. V is 1
//! or a shadow's. Units: f in sr⁻¹, radiance in W sr⁻¹ m⁻². Refused: a G that needs n·h too (the V-cavity's),
//! a D that depends on φ_h together with a Fresnel term (anisotropic GGX), other models.

mod bake;
mod shade;
mod tables;
#[cfg(test)]
mod tests;

use crate::local::{self, LocalTechnique, LocalText, far, near};
use crate::{BakeError, Capabilities, Card, Material};
use bake::Params;
use steradian_base::Task;
use tables::Tables;

/// The technique.
pub struct AnalyticDecomposition;

impl LocalTechnique for AnalyticDecomposition {
    const CARD: Card = Card {
        slug: "analytic_decomposition",
        title: "Microfacet models as products of two or three tables",
        citation: "Heidrich & Seidel 1999, Realistic, Hardware-Accelerated Shading and Lighting; Steigleder 2002, \
                   Factorization of the Ashikhmin BRDF for Real-Time Rendering; STAR04 6.2.2, eq. 12",
        equation: "L_o = Σ_l E_l T1(h·l, n·h) T2(n·l, n·v), T1 = F D/4, T2 = G/(n·v)",
        reflectance: "ggx of one alpha, cook-torrance with g=smith, ashikhmin-shirley, linear between entries of tables",
        materials: tables::materials,
        specimens: &[
            "ggx:alpha=0.2,f0=0.9/0.6/0.3",
            "cook-torrance:m=0.3,f0=0.5,g=smith",
            "ashikhmin-shirley:nu=20,nv=200,rs=0.3,rd=0.5",
        ],
        exact_when: &[
            near("up to the spacing of entries: GGX, a near point light", "ggx:alpha=0.2,f0=0.9/0.6/0.3"),
            far(
                "up to the spacing of entries: Smith's masking, three directional lights",
                "cook-torrance:m=0.3,f0=0.5,g=smith",
            ),
            near(
                "up to the spacing of entries: Ashikhmin and Shirley, a near point light",
                "ashikhmin-shirley:nu=20,nv=200,rs=0.3,rd=0.5",
            ),
        ],
        capabilities: Capabilities {
            certain_isotropic: true,
            certain_anisotropic: true,
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
        vec![("resolution", t.resolution() as f64), ("tables", t.count() as f64)]
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

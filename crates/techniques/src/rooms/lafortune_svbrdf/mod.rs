//! Generalised cosine lobes that differ from texel to texel.
//!
//! McAllister, Lastra & Heidrich (2002), *Efficient Rendering of Spatial Bi-directional Reflectance
//! Distribution Functions*; Lafortune, Foo, Torrance & Greenberg (1997); STAR04 6.3.2, eqs 36 to 38. With the
//! products of components C ∘ v,
//!
//! > L_o = Σ_l E_l (n·l)₊ (ρ_d/π + Σ_k ρ_k ((C_k ∘ v)·l)₊^n_k)
//!
//! ρ_d, ρ_k, C_k and n_k by texel, up to four lobes; C = (−1, −1, 1) is Phong's lobe. At the texels they are
//! right to integers of `bits` between the least and the largest of each number. Under a footprint, where C
//! and n do not average, levels hold means of C, |C|² and 1/n, the lobe's variance across its axis, weighed
//! with the largest value ρ max|C|ⁿ of each texel's lobe, about axes of max|C| = 1: the length of C is the
//! root of the mean of |C|², its direction that of the mean, and what the directions scatter, 1 −
//! |E\[C\]|²/E\[|C|²\], half of it each way, adds to 1/n, with ρ scaled so that the lobe keeps its integral.
//! Units: f in sr⁻¹, radiance in W sr⁻¹ m⁻². Refused: other reflectances than `lafortune` and `lambert`,
//! whose parameters apply where no file gives them, and more than four lobes.

mod bake;
mod shade;
#[cfg(test)]
mod tests;

use crate::local::{self, LocalText, Place, Plane, TexturedTechnique};
use crate::shared::surface::cosine_lobes::{CosineLobes, MOST, PLANES, Texel, lobes_of};
use crate::shared::trials::lights;
use crate::tensors::{PartError, TensorFile};
use crate::{BakeError, Capabilities, Card, Claim, Material};
use bake::Params;
use steradian_base::Task;
use steradian_brdf::Brdf;

/// The technique.
pub struct LafortuneSvbrdf;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    match lobes_of(brdf).map(|l| l.lobes.len()) {
        Some(count) if count <= MOST => Ok(()),
        Some(count) => Err(format!("takes {MOST} lobes at most, not {count}: use exact")),
        None => {
            Err(format!("takes lafortune and lambert, not {}: use shift_variant or exact", brdf.info().name))
        }
    }
}

impl TexturedTechnique for LafortuneSvbrdf {
    const CARD: Card = Card {
        slug: "lafortune_svbrdf",
        title: "Generalised cosine lobes by texel",
        citation: "McAllister, Lastra & Heidrich 2002, Efficient Rendering of Spatial Bi-directional Reflectance Distribution \
                   Functions; Lafortune, Foo, Torrance & Greenberg 1997, Non-Linear Approximation of Reflectance Functions; STAR04 6.3.2, eqs 36–38",
        equation: "L_o = Σ_l E_l (n·l)₊ (ρ_d/π + Σ_k ρ_k ((C_k ∘ v)·l)₊^n_k)",
        light: local::LIGHT,
        visibility: local::VISIBILITY,
        reflectance: "lafortune and lambert, their numbers by texel",
        materials,
        specimens: &[
            "lafortune:cx=-1,cy=-1,cz=1,n=20,ks=0.4,kd=0.3",
            "lafortune:cx=-0.9,cy=0.4,cz=0.8,n=6,kd=0.2",
        ],
        exact_when: &[
            Claim::new(
                "one reflectance everywhere: a near point light",
                lights::near_point,
                "lafortune:cx=-1,cy=-1,cz=0.9,n=12,kd=0.3",
                1e-5,
            ),
            Claim::new(
                "one reflectance everywhere: three directional lights",
                lights::three_directionals,
                "lafortune:@skin",
                1e-5,
            ),
        ],
        capabilities: Capabilities {
            diffuse: true,
            certain_isotropic: true,
            certain_anisotropic: true,
            shift_variant: true,
            ..local::CAPABILITIES
        },
        needs: local::NEEDS_TEXELS,
        waived: &[],
    };
    const PLANES: &'static [Plane] = &PLANES;
    type Params = Params;
    type Tables = CosineLobes;
    type Texel = Texel;

    fn bake(m: &Material, p: &Params, task: &Task) -> Result<CosineLobes, BakeError> {
        bake::bake(m, p, task)
    }

    fn details(t: &CosineLobes) -> Vec<(&'static str, f64)> {
        let bits = |bytes: usize| (8 * bytes) as f64;
        vec![
            ("lobes", t.count as f64),
            ("bytes a texel", t.stride() as f64),
            ("bits of rho", bits(t.widths.rho)),
            ("bits of C", bits(t.widths.c)),
            ("bits of n", bits(t.widths.n)),
        ]
    }

    fn bytes(t: &CosineLobes) -> usize {
        t.bytes()
    }

    fn save(t: &CosineLobes, to: &mut TensorFile) -> bool {
        t.save(to);
        true
    }

    fn load(from: &TensorFile) -> Result<Option<CosineLobes>, PartError> {
        CosineLobes::load(from)
    }

    fn varies(t: &CosineLobes) -> bool {
        t.patch.texels() > 1
    }

    fn error(t: &CosineLobes, m: &Material) -> f64 {
        bake::error(t, m)
    }

    #[inline(always)]
    fn texel(t: &CosineLobes, at: Place, _: [f32; 3]) -> Texel {
        t.at(at.uv, at.footprint)
    }

    #[inline(always)]
    fn f_cos(t: &CosineLobes, x: &Texel, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        x.f_cos(t.count, wi, wo)
    }

    fn text(t: &CosineLobes) -> Option<LocalText> {
        Some(shade::text(t))
    }
}

//! Surfaces as photographs from many views under many lights show them: compressed bidirectional texture
//! functions.
//!
//! Dana, van Ginneken, Nayar & Koenderink (1999), *Reflectance and Texture of Real-World Surfaces*; STAR04
//! 6.4.5. With the three views v and the three lights l of the function around the viewer and a light,
//!
//! > L_o = Σ_lights E (n·wi)₊/π Σ_v Σ_l b_v b_l B̂(x, v, l)/(n·l)
//!
//! B̂ stands for the pictures B: π times the radiance under an irradiance of 1 across the light's direction,
//! so that white is 1. b are barycentric weights between directions ([`steradian_relight::btf::Net`]).
//! Pictures are divided by the light's cosine before interpolation, which makes them smoother in the light's
//! direction: Lambert's law is exact between lights. `method` is the form of B̂ ([`steradian_relight::btf`]):
//! principal components of clusters of texels (`local`, Müller, Meseth & Klein 2003) or of each view's
//! pictures (`view`, Sattler, Sarlette & Klein 2003), or a chain of sums of products over half vector and
//! difference, and over the light (`chained`, Suykens, vom Berge, Lagae & Dutré 2003). Every number is
//! decoded on its own when shading reads it. Bumps, their shadows, occlusion and interreflection are in the
//! pictures.
//!
//! Approximated: B by B̂, by least squares; B between its directions; beyond the last ring of directions it
//! stays as it is there. Numbers are of half precision over the largest of the function. Negative sums are 0.
//! Coarser texels are means: of `local` in one of the finer ones' clusters. Without a map the function is
//! that of the reflectance, of one texel, from the 81 directions of the Bonn measurements. Units: radiance in
//! W sr⁻¹ m⁻². Refused: nothing.

mod bake;
mod error;
mod saved;
mod shade;
#[cfg(test)]
mod tests;

use crate::local::{self, Content, LocalText, Place, Plane, TexturedTechnique};
use crate::tensors::{PartError, TensorFile};
use crate::{BakeError, Capabilities, Card, Material};
use bake::{Params, Tables};
use steradian_base::Task;
use steradian_brdf::Brdf;

/// The technique.
pub struct BtfPca;

fn materials(_: &dyn Brdf) -> Result<(), String> {
    Ok(())
}

impl TexturedTechnique for BtfPca {
    const CARD: Card = Card {
        slug: "btf_pca",
        title: "Bidirectional texture functions: principal components, or a chain of products",
        citation: "Müller, Meseth & Klein 2003, Compression and Real-Time Rendering of Measured BTFs Using Local PCA; Sattler, Sarlette & Klein 2003, Efficient and Realistic Visualization of Cloth; Suykens, vom Berge, Lagae & Dutré 2003, Interactive Rendering with Bidirectional Texture Functions; STAR04 6.4.5",
        equation: "L_o = Σ_l E_l (n·wi)₊/π Σ_v Σ_l b_v b_l B̂(x, v, l)/(n·l)",
        light: local::LIGHT,
        visibility: "as the pictures have it; rays at each point where asked for",
        reflectance: "as the pictures have it; without a map the model from 81 views under 81 lights",
        materials,
        specimens: &[
            "lambert:albedo=0.6",
            "ggx:alpha=0.6,f0=0.9/0.6/0.3",
            "ward:ax=0.4,ay=0.6,rs=0.4,rd=0.4",
        ],
        exact_when: &[
            local::near("Lambert's law is constant over the cosine", "lambert:albedo=0.7"),
            local::far("Lambert's law is constant over the cosine", "lambert:albedo=0.7"),
        ],
        capabilities: Capabilities {
            diffuse: true,
            all_isotropic: true,
            all_anisotropic: true,
            shift_variant: true,
            bump_mapping: true,
            self_shadowing: true,
            interreflections: true,
            ..local::CAPABILITIES
        },
        needs: local::NEEDS_TEXELS,
        waived: &[],
    };
    const PLANES: &'static [Plane] = &[Plane::new(bake::MAP, Content::Bidirectional)];
    const METRIC: &'static str = "relative RMS error of f cos over texels and directions of light and view, of one local light, against \
                                  the map between its directions, or the reflectance where there is none";
    type Params = Params;
    type Tables = Tables;
    type Texel = shade::Texel;

    fn bake(m: &Material, p: &Params, task: &Task) -> Result<Tables, BakeError> {
        bake::bake(m, p, task)
    }

    fn save(t: &Tables, to: &mut TensorFile) -> bool {
        saved::save(t, to);
        true
    }

    fn load(from: &TensorFile) -> Result<Option<Tables>, PartError> {
        saved::load(from).map(Some)
    }

    fn varies(t: &Tables) -> bool {
        t.small.levels.texels(0) > 1
    }

    fn details(t: &Tables) -> Vec<(&'static str, f64)> {
        vec![
            ("error over all pairs of directions", t.small.error()),
            ("numbers for each that is kept", t.small.ratio()),
        ]
    }

    fn bytes(t: &Tables) -> usize {
        shade::bytes(t)
    }

    fn error(t: &Tables, m: &Material) -> f64 {
        error::error(t, m)
    }

    fn texel(t: &Tables, at: Place, wo: [f32; 3]) -> shade::Texel {
        shade::texel(t, at, wo)
    }

    fn f_cos(t: &Tables, x: &shade::Texel, wi: [f32; 3], _: [f32; 3]) -> [f32; 3] {
        shade::f_cos(t, x, wi)
    }

    fn text(t: &Tables) -> Option<LocalText> {
        Some(shade::text(t))
    }
}

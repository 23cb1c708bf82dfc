//! Surfaces as photographs show them: luminance or colour of each texel as a polynomial of the light's
//! direction.
//!
//! Malzbender, Gelb & Wolters (2001), *Polynomial Texture Maps*; STAR04 6.4.4. With (u, v) = (l·t, l·b)
//!
//! > L_o = Σ_l E_l (a₀u² + a₁v² + a₂uv + a₃u + a₄v + a₅)₊/π,  n·l > 0
//!
//! with six coefficients a texel and channel, those of a `.ptm` file or of photographs under known lights
//! (`.lp`). In the file's numbers white is 1 (255 as they stand): a polynomial of 1 is what a white
//! Lambertian surface that faces the light reflects, 1/π of its irradiance. It contains all effects in the
//! photographs: bumps, their shadows and interreflection, all as smooth as a parabola. Approximated: the
//! dependence on the light, by least squares, and that on the view, which is left out; highlights are as wide
//! as a parabola is. `basis=sh9` and `sh16` have the real spherical harmonics up to order 2 and 3 in place of
//! the parabola's six terms,
//!
//! > L_o = Σ_l E_l (Σ_lm a_lm Y_lm(l))₊/π,
//!
//! which follow the cosine itself and, of 16, tilted facets three times as closely; they are fitted to
//! photographs. Radiance is linear in the coefficients, so that their means over a footprint are exact but
//! for the clamp at 0. Without a map the polynomials are those of the reflectance seen along its normal under
//! lights uniform over the hemisphere: of Lambert's (−15/16, −15/16, 0, 0, 0, 9/8) times the albedo, off by
//! an eighth of its RMS. Units: radiance in W sr⁻¹ m⁻². Refused: nothing.

mod bake;
mod error;
mod shade;
#[cfg(test)]
mod tests;

use crate::local::{self, Content, LocalText, Place, Plane, TexturedTechnique};
use crate::{BakeError, Capabilities, Card, Material};
use bake::{Params, Polynomials};
use steradian_base::Task;
use steradian_brdf::Brdf;
use steradian_relight::polynomial::Basis;

/// The technique.
pub struct PolynomialTextureMap;

fn materials(_: &dyn Brdf) -> Result<(), String> {
    Ok(())
}

impl TexturedTechnique for PolynomialTextureMap {
    const CARD: Card = Card {
        slug: "polynomial_texture_map",
        title: "Photographed surfaces: a polynomial of the light's direction by texel",
        citation: "Malzbender, Gelb & Wolters 2001, Polynomial Texture Maps; STAR04 6.4.4",
        equation: "L_o = Σ_l E_l (a₀u² + a₁v² + a₂uv + a₃u + a₄v + a₅)₊/π, (u, v) = (l·t, l·b); or (Σ_lm a_lm Y_lm(l))₊/π",
        light: local::LIGHT,
        visibility: "as the photographs have it, smooth; rays at each point where asked for",
        reflectance: "as the photographs have it, the same from every view; without a map the model seen along its normal",
        materials,
        specimens: &["lambert:albedo=0.6"],
        exact_when: &[
            local::far("the cosine is among the harmonics", "lambert:albedo=0.7").with(&[("basis", 1.0)]),
            local::near("the cosine is among the harmonics", "lambert:albedo=0.3").with(&[("basis", 2.0)]),
        ],
        capabilities: Capabilities {
            diffuse: true,
            shift_variant: true,
            bump_mapping: true,
            self_shadowing: true,
            interreflections: true,
            ..local::CAPABILITIES
        },
        needs: local::NEEDS_TEXELS,
        waived: &[],
    };
    const PLANES: &'static [Plane] = &[Plane::new(bake::MAP, Content::Polynomials)];
    const METRIC: &'static str = "relative RMS error of f cos over texels and directions of light and view, of one local light, against \
                                  the map, or the reflectance where there is none";
    type Params = Params;
    type Tables = Polynomials;
    type Texel = shade::Texel;

    fn basis(p: &Params) -> Basis {
        p.basis()
    }

    fn bake(m: &Material, p: &Params, _: &Task) -> Result<Polynomials, BakeError> {
        bake::bake(m, p.basis())
    }

    fn bytes(t: &Polynomials) -> usize {
        t.texels.bytes()
    }

    fn error(t: &Polynomials, m: &Material) -> f64 {
        error::error(t, m)
    }

    #[inline(always)]
    fn texel(t: &Polynomials, at: Place, _: [f32; 3]) -> shade::Texel {
        shade::texel(t, at)
    }

    #[inline(always)]
    fn f_cos(t: &Polynomials, x: &shade::Texel, wi: [f32; 3], _: [f32; 3]) -> [f32; 3] {
        shade::f_cos(t, x, wi)
    }

    fn text(t: &Polynomials) -> Option<LocalText> {
        Some(shade::text(t))
    }
}

//! Precomputed radiance transfer of glossy surfaces: a matrix per site that takes any light to the unblocked
//! light, and reflectance on top.
//!
//! Sloan, Kautz & Snyder (2002), *Precomputed Radiance Transfer for Real-Time Rendering in Dynamic,
//! Low-Frequency Lighting Environments*, section 4.2; STAR04 7.5.1, eqs 53 and 54.
//!
//! > L' = M(x) L,  M_ij(x) = ∫ V(x, w) y_i(w) y_j(w) dw;  L_o = Σ_i c_i(wo) L'_i;  Phong: L_o = Σ_lm k_l L'_lm y_lm(r)
//!
//! with L_i the light's coefficients about world axes in W sr⁻¹ m⁻², and c_i(wo) those of f_cos, from a table
//! over the view (Kautz, Sloan & Snyder 2002) turned to the world. For `phong` r = 2(n·wo)n − wo and k_l = 2π
//! ∫ x₊ⁿ P_l(x) dx of its lobe: a convolution at the mirror direction, without any table (Funk–Hecke); V is
//! then zero below the horizon, where the lobe ends. Approximated: L and the lobe, by their first bands; V is
//! sampled by rays, and interpolated between the sites of a triangle. Refused: point lights, and reflections
//! between surfaces, which would need the reflectance in M. Small lights ring: a window over the bands trades
//! sharpness for that.

mod bake;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::Report;
use crate::gpu::Uniform;
use crate::shared::geometry::matrices::{Accuracy, Matrices};
use crate::shared::light::sh_light::ShLight;
use crate::shared::material::glossy::{self, Glossy};
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Check, Claim, Geometry, GpuTechnique, Material, Needs, Parts,
    Points, Radiance, Technique, View,
};
use bake::Params;
use shade::Frame;
use steradian_base::Task;
use steradian_light::Lights;

/// The technique.
pub struct PrtGlossy;

const EXACT: &[Claim] = &[Claim::new(
    "light and lobe have no bands above those that are baked, whatever is blocked",
    lights::quadratic,
    "phong:n=1",
    0.002,
)];

impl Technique for PrtGlossy {
    const CARD: Card = Card {
        slug: "prt_glossy",
        title: "Precomputed radiance transfer, glossy",
        citation: "Sloan, Kautz & Snyder 2002, Precomputed Radiance Transfer for Real-Time Rendering in Dynamic, \
                   Low-Frequency Lighting Environments, section 4.2; STAR04 7.5.1, eqs 53 and 54",
        equation: "L' = M L, M_ij = ∫ V y_i y_j dw; L_o = Σ_i c_i(wo) L'_i; Phong: Σ_lm k_l L'_lm y_lm(r)",
        light: "spherical harmonics of 5 bands (1 to 8)",
        visibility: "self-shadowing by a matrix per site",
        reflectance: "spherical harmonics of f_cos for each view; phong by its lobe alone",
        materials: glossy::materials,
        specimens: &["phong:n=10", "ggx:alpha=0.4,f0=0.9"],
        exact_when: EXACT,
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            certain_isotropic: true,
            certain_anisotropic: true,
            all_isotropic: true,
            all_anisotropic: true,
            self_shadowing: true,
            dynamic_lighting: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: true, uv: false, tangents: true, view: false },
        waived: &[(Check::Rotation, "matrices of 16-bit floats, which round otherwise about turned axes")],
    };
    type Params = Params;
    type Light = ShLight;
    type Material = Glossy;
    type Transfer = Matrices;
    type Linked = ();
    type Frame = Frame;

    fn reads_transfer(_: &Params) -> bool {
        true
    }

    fn light(l: &Lights, p: &Params, _: &Task) -> Result<ShLight, BakeError> {
        ShLight::bake(Self::CARD.slug, l, p.window)
    }

    fn material(m: &Material, p: &Params, task: &Task) -> Result<Glossy, BakeError> {
        Glossy::bake(Self::CARD.slug, m, p.bands, p.size, task)
    }

    fn transfer(g: Option<&Geometry>, m: &Glossy, p: &Params, task: &Task) -> Result<Matrices, BakeError> {
        let Some(g) = g else { return Ok(Matrices::default()) };
        let of = Accuracy { bands: p.bands, precision: p.precision };
        Matrices::bake(Self::CARD.slug, g, of, m.below(), p.halves, task)
    }

    fn link(parts: Parts<'_, Self>, p: &Params, _: &Task) -> Result<((), Report), BakeError> {
        let (error, elevations) = parts.material.left_out(parts.light, p.bands);
        Ok(((), Report::estimated(error, elevations)))
    }

    /// Directions below the horizon are blocked for Phong's lobe and open for tables, so the transfer depends
    /// on the material.
    fn transfer_reads_material(_: &Params) -> bool {
        true
    }

    fn same_transfer(_: &Params, before: &Glossy, after: &Glossy) -> bool {
        before.below() == after.below()
    }

    fn is_whole(b: &Bake<Self>) -> bool {
        [0, b.params.bands * b.params.bands].contains(&b.transfer.coefficients())
    }

    fn frame(b: &Bake<Self>, v: &View, f: &mut Frame) {
        f.update(&b.light, &b.material, &b.transfer, v);
    }

    fn shade(b: &Bake<Self>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
        shade::shade(b, f, q, out);
    }

    fn gpu(b: &Bake<Self>, f: &Frame) -> GpuTechnique {
        shade::gpu(b, f)
    }

    fn gpu_frame(_: &Bake<Self>, f: &Frame) -> Option<Vec<Uniform>> {
        Some(crate::shared::light::sh_light::uniforms(&f.light))
    }
}

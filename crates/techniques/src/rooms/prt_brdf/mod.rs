//! Precomputed radiance transfer with any reflectance: self-shadowing under light that changes, seen from
//! anywhere.
//!
//! Kautz, Sloan & Snyder (2002), *Fast, Arbitrary BRDF Shading for Low-Frequency Lighting Using Spherical
//! Harmonics*, section 5; STAR04 7.4.4, eq. 54.
//!
//! > L_o(x, wo) = Σ_i c_i(wo) Σ_j (R M(x))_ij L_j,  M_ij = ∫ V(x, w) y_i(w) y_j(w) dw
//!
//! with L_j the light's coefficients in the world, W sr⁻¹ m⁻², M the glossy transfer matrix of a site, and R
//! the rotation into its frame, folded into the matrix. Approximated: L and f_cos, by their first bands, the
//! view by a table on the paraboloid; V is sampled by rays, and projected to 2·bands − 1 bands, all that the
//! products need; radiance is interpolated between the sites of a triangle. Without interreflection: the
//! reflectance may change without another transfer. Refused: point lights, and highlights along circles too
//! narrow to certify.

mod bake;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::{self, Report};
use crate::gpu::Uniform;
use crate::shared::light::spectrum::Spectrum;
use crate::shared::material::view_table::Views;
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Check, Claim, Geometry, GpuTechnique, Material, Needs, Parts,
    Points, Radiance, Technique, View,
};
use bake::{Matrices, Params};
use shade::Frame;
use steradian_base::Task;
use steradian_light::Lights;

/// The technique.
pub struct PrtBrdf;

const EXACT: &[Claim] = &[Claim::new(
    "the light has no bands above those of the table, and nothing is blocked: up to the lookup between texels",
    lights::quadratic,
    "ashikhmin-shirley:nu=8,nv=8",
    2e-4,
)
.with(&[("size", 256.0)])];

impl Technique for PrtBrdf {
    const CARD: Card = Card {
        slug: "prt_brdf",
        title: "Precomputed radiance transfer, any reflectance",
        citation: "Kautz, Sloan & Snyder 2002, Fast, Arbitrary BRDF Shading for Low-Frequency Lighting Using Spherical \
                   Harmonics, section 5; STAR04 7.4.4, eq. 54",
        equation: "L_o = Σ_i c_i(wo) Σ_j (R M)_ij L_j, M_ij = ∫ V y_i y_j dw",
        light: "spherical harmonics of 5 bands (3 to 6)",
        visibility: "self-shadowing per site, as a matrix with the rotation into the site's frame",
        reflectance: "spherical harmonics of f_cos for each view, a table on the paraboloid",
        materials: certify::measurable,
        // The suite's points are sites without tangents, and paths, which certificates are measured by, are
        // noisy where reflectance is glossy.
        specimens: &["lambert:albedo=0.8/0.5/0.2"],
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
        waived: &[(
            Check::Rotation,
            "frames of sites without tangents do not turn with the sites, and the lookup between texels differs by 3e-5 with the frame",
        )],
    };
    type Params = Params;
    type Light = Spectrum;
    type Material = Views;
    type Transfer = Matrices;
    type Linked = ();
    type Frame = Frame;

    fn reads_transfer(_: &Params) -> bool {
        true
    }

    fn light(l: &Lights, _: &Params, task: &Task) -> Result<Spectrum, BakeError> {
        Spectrum::bake(Self::CARD.slug, l, steradian_brdf::views::ORDER, task)
    }

    fn material(m: &Material, p: &Params, task: &Task) -> Result<Views, BakeError> {
        Views::bake(Self::CARD.slug, m, [p.bands, p.size], p.halves, task)
    }

    fn transfer(g: Option<&Geometry>, _: &Views, p: &Params, task: &Task) -> Result<Matrices, BakeError> {
        g.map_or_else(|| Ok(Matrices::default()), |g| Matrices::bake(g, p, task))
    }

    fn link(parts: Parts<'_, Self>, p: &Params, _: &Task) -> Result<((), Report), BakeError> {
        Ok(((), bake::report(parts.light, parts.material, p)))
    }

    fn bytes(b: &Bake<Self>) -> usize {
        b.material.table.bytes() + crate::Part::bytes(&*b.transfer)
    }

    fn frame(b: &Bake<Self>, v: &View, f: &mut Frame) {
        f.renew(b, v);
    }

    fn shade(b: &Bake<Self>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
        shade::shade(b, f, q, out);
    }

    fn gpu(b: &Bake<Self>, f: &Frame) -> GpuTechnique {
        shade::gpu(b, f)
    }

    fn gpu_frame(_: &Bake<Self>, _: &Frame) -> Option<Vec<Uniform>> {
        // Turned light changes the transferred light of every site.
        None
    }
}

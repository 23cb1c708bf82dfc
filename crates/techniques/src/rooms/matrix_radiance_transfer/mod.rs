//! Matrix radiance transfer: from the light's coefficients straight to radiance at directions, four of which
//! are interpolated for a view.
//!
//! Lehtinen & Kautz (2003), *Matrix Radiance Transfer*; STAR04 7.4.4, eq. 52.
//!
//! > L_o(x, wo) = Σ_j g_j(wo) (A(x) L)_j,  A(x) = G B R(x) M(x)
//!
//! with L_i the light's coefficients about world axes in W sr⁻¹ m⁻², M_ij = ∫ V y_i y_j dw, R the rotation
//! into the frame of the site, B_ij the reflectance f_cos(wi, wo) ≈ Σ B_ij y_i(wo) y_j(wi) projected to
//! harmonics on both sides, G the change of basis to bilinear hats g_j on the paraboloid of outgoing
//! directions (least squares over the hemisphere). The matrices are kept as principal components, of all
//! sites or by clusters of them. Approximated: L and f, by their first bands; V is what rays find,
//! interpolated between the sites of a triangle. Refused: anisotropic reflectance and lobes that reach below
//! the horizon, point lights, reflections between surfaces. Another reflectance bakes the transfer anew.

mod bake;
mod frame;
mod hats;
mod reflected;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::{self, Report};
use crate::shared::light::sh_light::{self, ShLight};
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Check, Claim, Geometry, GpuTechnique, Material, Needs, Part, Parts,
    Points, Radiance, Technique, View,
};
use bake::{Compressed, Params};
use frame::Frame;
use hats::Hats;
use reflected::Reflected;
use steradian_base::Task;
use steradian_brdf::{Brdf, Domain};
use steradian_light::Lights;
use steradian_prefilter::{Cosine, Zonal};

/// The technique.
pub struct MatrixRadianceTransfer;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    if brdf.is_isotropic() && brdf.domain() == Domain::Hemisphere {
        return certify::measurable(brdf);
    }
    Err(format!("takes isotropic reflectance above the horizon only, not this {}", brdf.info().name))
}

const EXACT: &[Claim] = &[Claim::new(
    "the light has no bands above those that are baked, and the reflectance is lambert's",
    lights::quadratic,
    "lambert:albedo=0.8/0.5/0.2",
    1e-3,
)];

impl Technique for MatrixRadianceTransfer {
    const CARD: Card = Card {
        slug: "matrix_radiance_transfer",
        title: "Matrix radiance transfer",
        citation: "Lehtinen & Kautz 2003, Matrix Radiance Transfer; STAR04 7.4.4, eq. 52",
        equation: "L_o = Σ_j g_j(wo) (A L)_j, A = G B R M",
        light: "spherical harmonics of 5 bands (1 to 6)",
        visibility: "self-shadowing by matrices of clusters, weighted per site",
        reflectance: "spherical harmonics on both sides, as hats of the outgoing direction",
        materials,
        specimens: &["lambert:albedo=0.8/0.5/0.2", "ggx:alpha=0.4,f0=0.9"],
        exact_when: EXACT,
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            certain_isotropic: true,
            all_isotropic: true,
            self_shadowing: true,
            dynamic_lighting: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: true, uv: false, tangents: false, view: false },
        waived: &[(
            Check::Rotation,
            "clusters and 16-bit weights, which come out otherwise about turned axes",
        )],
    };
    type Params = Params;
    type Light = ShLight;
    type Material = Reflected;
    type Transfer = Compressed;
    type Linked = ();
    type Frame = Frame;

    fn reads_transfer(_: &Params) -> bool {
        true
    }

    fn light(l: &Lights, p: &Params, _: &Task) -> Result<ShLight, BakeError> {
        ShLight::bake(Self::CARD.slug, l, p.window)
    }

    fn material(m: &Material, p: &Params, task: &Task) -> Result<Reflected, BakeError> {
        Reflected::bake(m, Hats { side: p.hats }, p.bands, task)
    }

    fn transfer(
        g: Option<&Geometry>,
        m: &Reflected,
        p: &Params,
        task: &Task,
    ) -> Result<Compressed, BakeError> {
        g.map_or_else(|| Ok(Compressed::default()), |g| Compressed::bake(g, m, p, task))
    }

    fn link(parts: Parts<'_, Self>, p: &Params, _: &Task) -> Result<((), Report), BakeError> {
        let left_out = parts.light.left_out(&Cosine.coefficients(sh_light::ORDER), p.bands);
        let lost = parts.transfer.lost;
        let report = Report::estimated(left_out.hypot(lost), Vec::new())
            .detail("error of the matrices", lost)
            .detail("bytes", parts.transfer.bytes() as f64);
        Ok(((), report))
    }

    fn transfer_reads_material(_: &Params) -> bool {
        true
    }

    fn same_transfer(_: &Params, before: &Reflected, after: &Reflected) -> bool {
        before.rows == after.rows
    }

    fn frame(b: &Bake<Self>, v: &View, f: &mut Frame) {
        f.update(&b.light, &b.transfer, v);
    }

    fn shade(b: &Bake<Self>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
        shade::shade(b.material.hats, &b.transfer, f, q, out);
    }

    fn gpu(b: &Bake<Self>, f: &Frame) -> GpuTechnique {
        shade::gpu(b, f)
    }

    /// The clusters' radiance is a buffer, not uniforms.
    fn gpu_frame(_: &Bake<Self>, _: &Frame) -> Option<Vec<crate::gpu::Uniform>> {
        None
    }
}

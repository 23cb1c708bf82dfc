//! Precomputed radiance transfer of glossy surfaces, compressed by clustered principal components.
//!
//! Sloan, Hall, Hart & Snyder (2003), *Clustered Principal Components for Precomputed Radiance Transfer*, ACM
//! Transactions on Graphics 22(3); STAR04 7.4.4 (reference 84).
//!
//! > L' ≈ M_k0 L + Σ_i w_i(x) M_ki L,  k the cluster of x;  L_o = Σ_i c_i(wo) L'_i
//!
//! Light, visibility and reflectance are those of `prt_glossy` (Sloan, Kautz & Snyder 2002). A site keeps its
//! cluster and a few weights; the matrices of the clusters are multiplied with the light once a frame,
//! whatever the number of sites. The error of the compression, and its steps across seams between clusters,
//! are measured and stated. Refused: point lights, reflections between surfaces.

mod bake;
mod shade;
#[cfg(test)]
mod tests;

use crate::certify::Report;
use crate::shared::geometry::clustered::{Clustered, Size};
use crate::shared::geometry::matrices::Accuracy;
use crate::shared::light::sh_light::ShLight;
use crate::shared::material::glossy::{self, Glossy};
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Check, Claim, Geometry, GpuTechnique, Material, Needs, Part, Parts,
    Points, Radiance, Technique, View,
};
use bake::Params;
use shade::Frame;
use steradian_base::Task;
use steradian_light::Lights;

/// The technique.
pub struct ClusteredPca;

const EXACT: &[Claim] = &[Claim::new(
    "light and lobe have no bands above those that are baked, and every cluster has a component for each dimension of its \
     sites",
    lights::quadratic,
    "phong:n=1",
    0.002,
)];

impl Technique for ClusteredPca {
    const CARD: Card = Card {
        slug: "clustered_pca",
        title: "Clustered principal components of glossy transfer",
        citation: "Sloan, Hall, Hart & Snyder 2003, Clustered Principal Components for Precomputed Radiance Transfer; \
                   STAR04 7.4.4",
        equation: "L' = M_k0 L + Σ_i w_i M_ki L; L_o = Σ_i c_i(wo) L'_i",
        light: "spherical harmonics of 5 bands (1 to 8)",
        visibility: "self-shadowing by matrices of clusters, weighted per site",
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
        waived: &[(
            Check::Rotation,
            "clusters and 16-bit weights, which come out otherwise about turned axes",
        )],
    };
    type Params = Params;
    type Light = ShLight;
    type Material = Glossy;
    type Transfer = Clustered;
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

    fn transfer(g: Option<&Geometry>, m: &Glossy, p: &Params, task: &Task) -> Result<Clustered, BakeError> {
        let Some(g) = g else { return Ok(Clustered::default()) };
        let of = Accuracy { bands: p.bands, precision: p.precision };
        let size = Size { clusters: p.clusters, components: p.components };
        Clustered::bake(Self::CARD.slug, g, of, m.below(), size, task)
    }

    fn link(parts: Parts<'_, Self>, p: &Params, _: &Task) -> Result<((), Report), BakeError> {
        let (left_out, elevations) = parts.material.left_out(parts.light, p.bands);
        let lost = parts.transfer.lost;
        let report = Report::estimated(left_out.hypot(lost.matrices), elevations)
            .detail("error of the matrices", lost.matrices)
            .detail("seams", lost.seams)
            .detail("within clusters", lost.within)
            .detail("bytes", parts.transfer.bytes() as f64);
        Ok(((), report))
    }

    /// Directions below the horizon are blocked for Phong's lobe and open for tables, so the transfer depends
    /// on the material.
    fn transfer_reads_material(_: &Params) -> bool {
        true
    }

    fn same_transfer(_: &Params, before: &Glossy, after: &Glossy) -> bool {
        before.below() == after.below()
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

    /// The clusters' light is a buffer, not uniforms.
    fn gpu_frame(_: &Bake<Self>, _: &Frame) -> Option<Vec<crate::gpu::Uniform>> {
        None
    }
}

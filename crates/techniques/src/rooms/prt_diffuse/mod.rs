//! Precomputed radiance transfer of diffuse surfaces: self-shadowing and interreflection under light from far
//! away.
//!
//! Sloan, Kautz & Snyder (2002), *Precomputed Radiance Transfer for Real-Time Rendering in Dynamic,
//! Low-Frequency Lighting Environments*, sections 3 and 4; STAR04 7.4.4, eq. 53.
//!
//! > L_o(x) = (albedo/π) Σ_i t_i(x) L_i,  t_i(x) = ∫ V(x, w) (n·w)₊ y_i(w) dw
//!
//! with L_i the light's coefficients in W sr⁻¹ m⁻². Approximated: L, by its first bands, as t sees it; V is
//! sampled by rays, and interpolated between the sites of a triangle; f is exact. With more than one
//! scattering event t also holds light that the mesh reflects to x, for the albedo at bake time: another
//! albedo bakes the transfer anew. Refused: any reflectance but Lambert's, and point lights. With `normals`,
//! direct irradiance is a function of the normal, for normal maps (Sloan 2006, *Normal Mapping for
//! Precomputed Radiance Transfer*); interreflected light is that of the mesh's normal. Of suns that are
//! shaded exactly, t holds the interreflected part only. Small lights ring: a window over the bands trades
//! sharpness for that.

mod bake;
mod normals;
mod shade;
mod sums;
#[cfg(test)]
mod tests;

use crate::certify::{Model, Report, Target};
use crate::shared::geometry::grouped::Grouped;
use crate::shared::light::sh_light::{self, Albedo, ShLight};
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Parts, Points,
    Radiance, Technique, View,
};
use bake::Params;
use normals::HARMONICS;
use shade::Frame;
use steradian_base::Task;
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;
use steradian_prefilter::{Cosine, Zonal};

/// The technique.
pub struct PrtDiffuse;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    match brdf.form() {
        Form::Lambert { .. } => Ok(()),
        _ => Err(format!(
            "takes lambert only, not {}: what surfaces reflect to each other holds one reflectance (prt_glossy and \
             prt_brdf take others, without reflections)",
            brdf.info().name
        )),
    }
}

const EXACT: &[Claim] = &[
    Claim::new("the light is constant", lights::furnace, "lambert:albedo=0.8/0.5/0.2", 2e-4),
    Claim::new(
        "the light has no bands above those that are baked, whatever is blocked",
        lights::quadratic,
        "lambert:albedo=0.8/0.5/0.2",
        2e-4,
    ),
];

impl Technique for PrtDiffuse {
    const CARD: Card = Card {
        slug: "prt_diffuse",
        title: "Precomputed radiance transfer, diffuse",
        citation: "Sloan, Kautz & Snyder 2002, Precomputed Radiance Transfer for Real-Time Rendering in Dynamic, \
                   Low-Frequency Lighting Environments, sections 3 and 4; Sloan 2006, Normal Mapping for Precomputed Radiance \
                   Transfer; STAR04 7.4.4, eq. 53",
        equation: "L_o = (albedo/π) Σ_i t_i L_i, t_i = ∫ V (n·w)₊ y_i dw",
        light: "spherical harmonics of 5 bands (1 to 6)",
        visibility: "self-shadowing, and interreflection where asked for, per site",
        reflectance: "lambert, exact",
        materials,
        specimens: &["lambert:albedo=0.8/0.5/0.2"],
        exact_when: EXACT,
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            shift_variant: true,
            self_shadowing: true,
            interreflections: true,
            dynamic_lighting: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: true, uv: false, tangents: false, view: false },
        waived: &[],
    };
    type Params = Params;
    type Light = ShLight;
    type Material = Albedo;
    type Transfer = Grouped;
    type Linked = ();
    type Frame = Frame;

    fn settled(p: Params, m: &Material) -> Params {
        Params { normals: p.normals.or(Some(m.bumpy)), ..p }
    }

    fn reads_transfer(_: &Params) -> bool {
        true
    }

    fn light(l: &Lights, p: &Params, _: &Task) -> Result<ShLight, BakeError> {
        ShLight::bake(Self::CARD.slug, l, p.window)
    }

    fn material(m: &Material, _: &Params, _: &Task) -> Result<Albedo, BakeError> {
        Ok(Albedo::of(&*m.brdf))
    }

    fn transfer(g: Option<&Geometry>, m: &Albedo, p: &Params, task: &Task) -> Result<Grouped, BakeError> {
        g.map_or_else(|| Ok(Grouped::default()), |g| bake::transfer(g, m, p, task))
    }

    fn link(parts: Parts<'_, Self>, p: &Params, _: &Task) -> Result<((), Report), BakeError> {
        let kernel = Cosine.coefficients(sh_light::ORDER);
        Ok(((), Report::estimated(parts.light.left_out(&kernel, p.bands), Vec::new())))
    }

    fn is_whole(b: &Bake<Self>) -> bool {
        let (n, stride) = (b.params.bands * b.params.bands, b.transfer.stride());
        let more = if b.params.by_normal() { HARMONICS * n } else { 0 };
        // The stride of data that are not there yet is 0; else sites have vectors of direct light, of
        // reflected light in no, one or three channels, and of other normals.
        stride == 0 || [n, 2 * n, 4 * n].map(|k| k + more).contains(&stride)
    }

    fn target<'a>(b: &'a Bake<Self>, _: Option<&'a dyn Brdf>) -> Option<Target<'a>> {
        Some(Target::Integral(Model::diffuse(b.material.0)))
    }

    fn transfer_reads_material(p: &Params) -> bool {
        p.bounces > 1
    }

    fn events(b: &Bake<Self>) -> u32 {
        b.params.bounces as u32
    }

    fn frame(b: &Bake<Self>, v: &View, f: &mut Frame) {
        f.update(b, v);
    }

    fn shade(_: &Bake<Self>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
        shade::shade(f, q, out);
    }

    fn gpu(b: &Bake<Self>, f: &Frame) -> GpuTechnique {
        shade::gpu(b, f)
    }

    fn gpu_frame(_: &Bake<Self>, f: &Frame) -> Option<Vec<crate::gpu::Uniform>> {
        Some(shade::uniforms(f))
    }
}

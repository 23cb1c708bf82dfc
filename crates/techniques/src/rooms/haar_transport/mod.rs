//! All-frequency shadows of diffuse surfaces: light and transport in Haar wavelets on the faces of a cube.
//!
//! Ng, Ramamoorthi & Hanrahan (2003), *All-Frequency Shadows Using Non-linear Wavelet Lighting
//! Approximation*; STAR04 7.5.1.
//!
//! > L_o(x) = albedo (E(n) − Σ_k B_k(x) L_k),  B(x) = H b(x),  b_j(x) = (1/π) ∫_{texel j} (1 − V(x, w)) (n·w)₊ dw,  L = H l
//!
//! with l_j the mean radiance of texel j in W sr⁻¹ m⁻², H the orthonormal Haar transform of each face, so
//! that sums over texels are sums over wavelets, and E(n) = (1/π) ∫ L (n·w)₊ dw in spherical harmonics. The
//! paper sums Σ_k T_k L_k, T of V; with few wavelets, the sum of blocked light has errors in shadows only,
//! and most sites are hardly blocked. Approximated: blocked light is constant over texels, and only those of
//! its wavelets are summed that matter most in a frame; of each site's blocked transport the largest
//! coefficients are kept, in eight bits; V is sampled by rays, and interpolated between the sites of a
//! triangle. Interreflected light is smooth, and is represented in spherical harmonics. f is exact. Refused:
//! any reflectance but Lambert's, and point lights.

mod bake;
mod cube;
mod light;
mod shade;
#[cfg(test)]
mod tests;
mod transport;
mod visibility;

use crate::certify::{Model, Report, Target};
use crate::shared::light::sh_light::Albedo;
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Check, Claim, Geometry, GpuTechnique, Material, Needs, Parts,
    Points, Radiance, Technique, View,
};
use bake::Params;
use light::Light;
use shade::Frame;
use steradian_base::Task;
use steradian_brdf::{Brdf, Form};
use steradian_light::Lights;
use transport::Transport;

/// The technique.
pub struct HaarTransport;

fn materials(brdf: &dyn Brdf) -> Result<(), String> {
    match brdf.form() {
        Form::Lambert { .. } => Ok(()),
        _ => Err(format!("takes lambert only, not {}", brdf.info().name)),
    }
}

const EXACT: &[Claim] = &[
    Claim::new("the light is constant", lights::furnace, "lambert:albedo=0.8/0.5/0.2", 1e-5),
    Claim::new(
        "nothing is blocked and the light ends at band 24",
        lights::quadratic,
        "lambert:albedo=0.8/0.5/0.2",
        3e-4,
    ),
];

const WAIVED: &[(Check, &str)] = &[
    (Check::Linearity, "which wavelets are summed depends on the light"),
    (Check::Rotation, "turned light falls on other texels of the cube, and is resampled"),
];

impl Technique for HaarTransport {
    const CARD: Card = Card {
        slug: "haar_transport",
        title: "Non-linear wavelet lighting",
        citation: "Ng, Ramamoorthi & Hanrahan 2003, All-Frequency Shadows Using Non-linear Wavelet Lighting \
                   Approximation; STAR04 7.5.1",
        equation: "L_o = albedo (E(n) − Σ_k B_k L_k) over Haar wavelets, B = H b, b_j = (1/π) ∫_texel (1 − V) (n·w)₊ dw",
        light: "Haar wavelets on a cube (6 × 64²), the 200 that matter most in a frame",
        visibility: "self-shadowing of all frequencies, and interreflection in spherical harmonics, per site",
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
        waived: WAIVED,
    };
    /// Half a diagonal behind its occluder, a penumbra of 5° is wide enough that four edges of this length
    /// cross it.
    const SPACING: f32 = 1.0 / 96.0;
    type Params = Params;
    type Light = Light;
    type Material = Albedo;
    type Transfer = Transport;
    type Linked = ();
    type Frame = Frame;

    fn reads_transfer(p: &Params) -> bool {
        p.bounces > 1
    }

    fn light(l: &Lights, _: &Params, _: &Task) -> Result<Light, BakeError> {
        Light::bake(l)
    }

    fn material(m: &Material, _: &Params, _: &Task) -> Result<Albedo, BakeError> {
        Ok(Albedo::of(&*m.brdf))
    }

    fn transfer(g: Option<&Geometry>, m: &Albedo, p: &Params, task: &Task) -> Result<Transport, BakeError> {
        g.map_or_else(|| Ok(Transport::default()), |g| bake::transfer(g, m, p, task))
    }

    fn link(parts: Parts<'_, Self>, p: &Params, _: &Task) -> Result<((), Report), BakeError> {
        let t = parts.transfer;
        let mean = t.entries.len() as f64 / t.sites.max(1) as f64;
        let error = shade::left_out(parts.light, t, p);
        Ok(((), Report::estimated(error, Vec::new()).detail("wavelets a site", mean)))
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
        *f = Frame::new(&b.light, b.material.0, &b.transfer, &b.params, v);
    }

    fn shade(_: &Bake<Self>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
        shade::shade(f, q, out);
    }

    fn gpu(b: &Bake<Self>, f: &Frame) -> GpuTechnique {
        shade::gpu(b, f)
    }

    fn gpu_frame(_: &Bake<Self>, _: &Frame) -> Option<Vec<crate::gpu::Uniform>> {
        // Radiance of all sites changes.
        None
    }
}

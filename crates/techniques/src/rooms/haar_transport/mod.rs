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
//! triangle. Interreflected light is smooth, and is represented in spherical harmonics. Lambert's f is exact.
//!
//! With `fix=view` any other reflectance is seen by one eye, and as in the paper
//!
//! > L_o(x) = Σ_k T_k(x) L_k,  T(x) = H t(x),  t_j(x) = ∫_{texel j} V(x, w) f(x, w, v) (n·w)₊ dw
//!
//! with v the direction to the eye. V is kept as it was sampled; f is integrated over the texels anew where
//! the eye moves. Refused: point lights, any reflectance but Lambert's where the view may change or where
//! surfaces reflect light to each other, reflectance that takes light from below the surface, and highlights
//! along circles that are too narrow to certify.

mod bake;
mod choice;
mod cube;
mod fixed;
mod keep;
mod light;
mod material;
mod params;
mod seen;
mod shade;
mod sights;
#[cfg(test)]
mod tests;
mod transport;
mod visibility;
mod weigh;

use crate::certify::{Model, Report, Target};
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Check, Claim, Geometry, GpuTechnique, Material, Needs, Parts,
    Points, Radiance, Technique, View,
};
use fixed::Frame;
use light::Light;
use material::Matter;
use params::{Fix, Params};
use seen::{Linked, Towards};
use sights::Transfer;
use steradian_base::Task;
use steradian_brdf::Brdf;
use steradian_light::Lights;
use transport::Transport;

/// The technique.
pub struct HaarTransport;

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
        equation: "L_o = albedo (E(n) − Σ_k B_k L_k) over Haar wavelets, B = H b, b_j = (1/π) ∫_texel (1 − V) (n·w)₊ dw; \
                   with fix=view L_o = Σ_k T_k L_k, T = H t, t_j = ∫_texel V f (n·w)₊ dw",
        light: "Haar wavelets on a cube (6 × 64²), the 200 that matter most in a frame",
        visibility: "self-shadowing of all frequencies, and interreflection in spherical harmonics, per site",
        reflectance: "lambert, exact; with fix=view any other one too, for one camera: integrals of f over the texels",
        materials: material::lambert,
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
    type Material = Matter;
    type Transfer = Transfer;
    type Linked = Linked;
    type Frame = Frame;

    fn reads_transfer(p: &Params) -> bool {
        p.bounces > 1
    }

    fn light(l: &Lights, _: &Params, _: &Task) -> Result<Light, BakeError> {
        Light::bake(l)
    }

    fn takes(brdf: &dyn Brdf, p: &Params) -> Result<(), String> {
        material::takes(brdf, p)
    }

    fn needs_view(p: &Params) -> bool {
        p.fix() == Fix::View
    }

    fn material(m: &Material, _: &Params, _: &Task) -> Result<Matter, BakeError> {
        Ok(Matter::of(&m.brdf))
    }

    fn transfer(g: Option<&Geometry>, m: &Matter, p: &Params, task: &Task) -> Result<Transfer, BakeError> {
        g.map_or_else(|| Ok(Transfer::Diffuse(Transport::default())), |g| bake::transfer(g, m, p, task))
    }

    fn link(parts: Parts<'_, Self>, p: &Params, _: &Task) -> Result<(Linked, Report), BakeError> {
        let (linked, error, mean) = match (parts.material, parts.transfer) {
            (Matter::Glossy(matter), Transfer::Sights(sights)) => {
                let towards = Towards { sights, matter, precision: p.precision };
                fixed::link(towards, parts.light, p)
            }
            (_, Transfer::Diffuse(t)) => {
                let mean = t.columns.entries.len() as f64 / t.columns.sites.max(1) as f64;
                (Linked::default(), shade::left_out(parts.light, t, p), mean)
            }
            (Matter::Lambert(_), Transfer::Sights(_)) => (Linked::default(), f64::INFINITY, 0.0),
        };
        Ok((linked, Report::estimated(error, Vec::new()).detail("wavelets a site", mean)))
    }

    fn is_whole(b: &Bake<Self>) -> bool {
        match (&*b.material, &*b.transfer) {
            (Matter::Lambert(_), Transfer::Diffuse(_)) => b.linked.norms.is_empty(),
            (Matter::Glossy(_), Transfer::Sights(s)) => {
                let texels = 6 * s.cube.side * s.cube.side;
                b.params.fix() == Fix::View && b.linked.norms.len() == texels
            }
            _ => false,
        }
    }

    fn target<'a>(b: &'a Bake<Self>, _: Option<&'a dyn Brdf>) -> Option<Target<'a>> {
        Some(Target::Integral(match &*b.material {
            Matter::Lambert(albedo) => Model::diffuse(albedo.0),
            Matter::Glossy(g) => Model::of(&*g.brdf),
        }))
    }

    fn transfer_reads_material(p: &Params) -> bool {
        p.bounces > 1 || p.fix() == Fix::View
    }

    fn same_transfer(p: &Params, before: &Matter, after: &Matter) -> bool {
        match (before, after) {
            (Matter::Lambert(_), Matter::Lambert(_)) => p.bounces == 1,
            (Matter::Glossy(_), Matter::Glossy(_)) => true,
            _ => false,
        }
    }

    fn events(b: &Bake<Self>) -> u32 {
        b.params.bounces as u32
    }

    fn frame(b: &Bake<Self>, v: &View, f: &mut Frame) {
        match (&*b.material, &*b.transfer) {
            (Matter::Lambert(albedo), Transfer::Diffuse(t)) => {
                *f = Frame::new(&b.light, albedo.0, t, &b.params, v);
            }
            (Matter::Glossy(matter), Transfer::Sights(sights)) => {
                let towards = Towards { sights, matter, precision: b.params.precision };
                fixed::renew(f, towards, &b.light, &b.params, v);
            }
            _ => *f = Frame::default(),
        }
    }

    fn first_frame(b: &Bake<Self>, f: &mut Frame) {
        match (&*b.material, &*b.transfer) {
            (Matter::Glossy(matter), Transfer::Sights(sights)) => {
                let towards = Towards { sights, matter, precision: b.params.precision };
                fixed::unseen(f, towards, &b.light);
            }
            _ => Self::frame(b, &View::default(), f),
        }
    }

    fn shade(b: &Bake<Self>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
        shade::shade(b, f, q, out);
    }

    fn gpu(b: &Bake<Self>, f: &Frame) -> GpuTechnique {
        shade::gpu(b, f)
    }

    fn gpu_frame(_: &Bake<Self>, _: &Frame) -> Option<Vec<crate::gpu::Uniform>> {
        // Radiance of all sites changes.
        None
    }
}

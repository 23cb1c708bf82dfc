//! A few Gaussians about the mirror direction, looked up in one chain of maps that serves every material.
//!
//! Green, Kautz & Durand (2007), *Efficient Reflectance and Visibility Approximations for Environment Map
//! Rendering*, eqs 2–5 and 8:
//!
//! > L_o ≈ ρ_d E(n)/π + Σ_k w_k (G_σk ⋆ L)(r + μ_k),  w, σ, μ functions of n·wo
//!
//! The light is a chain of cubes: level 0 the light itself, then L convolved with spherical Gaussians,
//! σ_{j+1} = 2σ_j; it depends on no material. The reflectance is the fit of
//! [`steradian_brdf::fit::gaussian`], about a kilobyte: N elevations of K lobes, round or stretched along the
//! plane of incidence, whose logarithms of widths, angles and weights are linear in between. A lobe's width
//! lies between two levels, mixed so that the mean cosine about its axis is its own: the second moment,
//! exactly also where lobes are wide. The diffuse part, split off before the fit, is looked up in a map of
//! E/π. Radiance in W sr⁻¹ m⁻².
//!
//! V = 1, or section 3.3 with eq. 7: each lookup is multiplied by the visibility V(r + μ_k) of the point, of
//! a few bands of spherical harmonics baked at the vertices of a mesh (`visibility`); from the diffuse part
//! their blocked irradiance is taken (PRT: Sloan, Kautz & Snyder 2002). Light that surfaces send to each
//! other is left out. Anisotropic reflectance has lobes by elevation and azimuth of the view: about mirror
//! images of the view in fixed half vectors (`halves`), or beside the plane of incidence and along directions
//! of their own (`turned`). Refused: point lights.

mod bake;
#[cfg(test)]
mod cost;
mod frame;
mod halves;
mod light;
mod looks;
mod lookups;
mod normals;
mod params;
mod place;
mod shade;
#[cfg(test)]
mod tests;
mod turned;
mod views;
mod visibility;

use crate::certify::Report;
use crate::gpu::{LightTables, Uniform};
use crate::shared::trials::lights;
use crate::{
    Bake, BakeError, Capabilities, Card, Claim, Geometry, GpuTechnique, Material, Needs, Part, Parts, Points,
    Radiance, Technique, Varies, View,
};
use bake::Fitted;
use frame::Frame;
use light::Light;
use params::Params;
use steradian_base::Task;
use steradian_light::Lights;
use views::Views;
use visibility::Blocked;

/// The technique.
pub struct GaussianLobes;

impl Technique for GaussianLobes {
    const CARD: Card = Card {
        slug: "gaussian_lobes",
        title: "Gaussian lobes about the mirror direction",
        citation: "Green, Kautz & Durand 2007, Efficient Reflectance and Visibility Approximations for Environment \
                   Map Rendering",
        equation: "L_o = ρ_d E/π + Σ_k w_k V(r + μ_k) (G_σk ⋆ L)(r + μ_k)",
        light: "one chain of cube maps for all materials: itself, then convolved with Gaussians of doubling width",
        visibility: "none: V = 1; or where asked for per site and lobe, spherical harmonics of 2 to 4 bands outside the integral",
        reflectance: "any, measured too: a diffuse part and up to four Gaussians by the elevation of the view, in a kilobyte; where it is \
                      anisotropic Gaussians about half vectors, by the azimuth too; the albedo of every fitted view exact",
        materials: |_| Ok(()),
        specimens: &[
            "ggx:alpha=0.04,f0=0.9/0.6/0.3",
            "ggx:alpha=0.25,f0=0.9/0.6/0.3",
            "dielectric:alpha=0.16,f0=0.04,albedo=0.6/0.3/0.1",
            "sgd:gold-metallic-paint",
            "phong-normalized:s=200",
        ],
        exact_when: &[
            Claim::new(
                "the light is constant: the energy of each view is exact",
                lights::furnace,
                "ggx:alpha=0.25,f0=0.9/0.6/0.3",
                3e-3,
            ),
            Claim::new(
                "the light is constant: a diffuse base under a layer",
                lights::furnace,
                "dielectric:alpha=0.16,f0=0.04,albedo=0.6/0.3/0.1",
                3e-3,
            ),
            Claim::new("the surface is lambertian", lights::studio, "lambert:albedo=0.8/0.5/0.2", 0.01),
            Claim::new(
                "the lobe is a narrow Gaussian (Phong's, s = 2000)",
                lights::smooth,
                "phong-normalized:s=2000",
                0.01,
            ),
        ],
        capabilities: Capabilities {
            global: true,
            diffuse: true,
            certain_isotropic: true,
            certain_anisotropic: true,
            all_isotropic: true,
            all_anisotropic: true,
            bump_mapping: true,
            self_shadowing: true,
            dynamic_objects: true,
            ..Capabilities::NONE
        },
        needs: Needs { environment: true, sites: false, uv: false, tangents: true, view: false },
        waived: &[],
    };
    type Params = Params;
    type Light = Light;
    type Material = Fitted;
    type Transfer = Blocked;
    type Linked = Views;
    type Frame = Frame;
    const EFFORT: f64 = 2.0;

    fn reads_transfer(p: &Params) -> bool {
        p.is_shadowed()
    }

    fn light(l: &Lights, p: &Params, task: &Task) -> Result<Light, BakeError> {
        Light::bake(l, p, task)
    }

    fn material(m: &Material, p: &Params, task: &Task) -> Result<Fitted, BakeError> {
        Fitted::new(m, p, task)
    }

    fn needs_sites(p: &Params) -> bool {
        p.is_shadowed()
    }

    fn transfer(g: Option<&Geometry>, _: &Fitted, p: &Params, task: &Task) -> Result<Blocked, BakeError> {
        Blocked::new(g, p, task)
    }

    fn self_shadowing(p: &Params) -> bool {
        p.is_shadowed()
    }

    fn link(parts: Parts<'_, Self>, p: &Params, _: &Task) -> Result<(Views, Report), BakeError> {
        Ok(bake::link(parts.light, parts.material, parts.transfer, p))
    }

    fn frame(b: &Bake<Self>, v: &View, f: &mut Frame) {
        *f = Frame::new(b, v);
    }

    fn bytes(b: &Bake<Self>) -> usize {
        b.light.bytes() + b.transfer.bytes() + b.linked.bytes()
    }

    fn shade(b: &Bake<Self>, f: &Frame, q: &Points<'_>, out: &mut Radiance<'_>) {
        if b.linked.is_turned() {
            turned::shade(b, f, q, out);
        } else if q.has_lobes() && b.transfer.bands() == 0 {
            normals::shade(b, f, q, out);
        } else {
            shade::shade(b, f, q, out);
        }
    }

    fn gpu(b: &Bake<Self>, f: &Frame) -> GpuTechnique {
        shade::gpu(b, f)
    }

    fn gpu_frame(_: &Bake<Self>, f: &Frame) -> Option<Vec<Uniform>> {
        Some(f.uniforms())
    }

    fn light_tables(b: &Bake<Self>, _: bool) -> Option<LightTables> {
        // With visibility, uniforms depend on the light too.
        (b.transfer.bands() == 0).then(|| b.light.tables())
    }

    const VARIES: Varies = Varies { normals: true, ..Varies::NONE };

    fn varies(b: &Bake<Self>) -> Varies {
        Varies { normals: widens(b), ..Varies::NONE }
    }

    fn gpu_varied(b: &Bake<Self>, f: &Frame) -> Option<GpuTechnique> {
        widens(b).then(|| normals::gpu(b, f))
    }
}

/// Do lobes widen where normals vary?
fn widens(b: &Bake<GaussianLobes>) -> bool {
    b.transfer.bands() == 0 && !b.linked.is_turned()
}

//! The coefficients: of a map, or of a reflectance.

use super::shade;
use crate::Material;
use crate::local::{FileName, error_at, texel};
use crate::shared::surface::texels::Texels;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::{ParamInfo, params};
use steradian_brdf::Brdf;
use steradian_relight::polynomial::{Fit, evaluate};
use steradian_scene::surface::Texture;

/// The plane of polynomials.
pub const MAP: &str = "map";
/// Lights that a reflectance is fitted under.
const LIGHTS: usize = 2048;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// The map.
        pub map: Option<FileName> = ParamInfo::file("map", "polynomial texture map (.ptm), or a list of lights with their photographs (.lp); auto: the reflectance seen along its normal").auto(f64::NAN),
    }
}

/// The polynomials of a surface.
#[derive(Debug, Clone)]
pub struct Polynomials {
    /// a₀ … a₅ in red, green and blue.
    pub texels: Texels,
    /// Do they come from a map?
    pub mapped: bool,
}

pub(super) fn bake(m: &Material) -> Polynomials {
    let planes: Vec<_> = (0..6).filter_map(|k| m.textures.get(&format!("{MAP}.{k}")).cloned()).collect();
    if planes.len() == 6 {
        return Polynomials { texels: Texels::new(planes), mapped: true };
    }
    let of = fitted(&*m.brdf).map(|c| Arc::new(Texture::constant(c.map(|x| x as f32))));
    Polynomials { texels: Texels::new(of.into()), mapped: false }
}

/// π f · ⟨n·wi⟩ seen along the normal, as polynomials of red, green and blue: coefficient by coefficient.
fn fitted(brdf: &dyn Brdf) -> [[f64; 3]; 6] {
    let lights: Vec<DVec3> = (0..LIGHTS)
        .map(|k| {
            let z = (k as f64 + 0.5) / LIGHTS as f64;
            let (s, phi) = ((1.0 - z * z).sqrt(), 2.399_963_229_728_653 * k as f64);
            DVec3::new(s * phi.cos(), s * phi.sin(), z)
        })
        .collect();
    // Lights all over the hemisphere determine a polynomial.
    let Ok(fit) = Fit::new(&lights) else { return [[0.0; 3]; 6] };
    let values: Vec<[f64; 3]> = lights.iter().map(|l| brdf.f_cos(*l, DVec3::Z).map(|x| PI * x)).collect();
    let of = [0, 1, 2].map(|c| fit.coefficients(values.iter().map(|v| v[c])));
    std::array::from_fn(|k| [0, 1, 2].map(|c| of[c][k]))
}

pub(super) fn error(t: &Polynomials, m: &Material) -> f64 {
    let size = t.texels.size();
    let shaded = |at, wi, _: [f32; 3]| shade::f_cos(&shade::texel(t, at), wi);
    let place = |k| texel(k, size).0;
    if !t.mapped {
        return error_at(&*m.brdf, place, |_, wi, wo| m.brdf.f_cos(wi, wo), shaded);
    }
    let exact = |at: crate::local::Place, wi: DVec3, _: DVec3| {
        let all: [[f32; 3]; 6] = std::array::from_fn(|k| t.texels.sample(k, at.uv, 0.0));
        [0, 1, 2].map(|c| evaluate(&all.map(|a| f64::from(a[c])), wi).max(0.0) / PI)
    };
    error_at(&*m.brdf, place, exact, shaded)
}

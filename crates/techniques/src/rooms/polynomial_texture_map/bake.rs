//! The coefficients: of a map, or of a reflectance.

use crate::local::FileName;
use crate::shared::surface::texels::TextureLayers;
use crate::{BakeError, Material};
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::{ParamInfo, params};
use steradian_brdf::Brdf;
use steradian_relight::polynomial::{Basis, Fit};
use steradian_scene::surface::Texture;

/// The plane of polynomials.
pub const MAP: &str = "map";
/// Number of lights under which polynomials are fitted to a reflectance.
const LIGHTS: usize = 2048;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// The map.
        pub map: Option<FileName> = ParamInfo::file("map", "polynomial texture map (.ptm, of basis=biquadratic), or a list of lights with their photographs (.lp); auto: the reflectance seen along its normal").auto(f64::NAN),
        /// Basis of the texels' sums, an index of the choices.
        pub basis: usize = ParamInfo::choice("basis", &Basis::NAMES, "a parabola of the light's direction (6 numbers a texel and channel), or spherical harmonics up to order 2 (9) or 3 (16), which are fitted to photographs").numbered(0.0).preset("biquadratic"),
    }
}

impl Params {
    pub(super) fn basis(&self) -> Basis {
        Basis::ALL[self.basis]
    }
}

/// The polynomials of a surface.
#[derive(Debug, Clone)]
pub struct Polynomials {
    /// Basis of the sums.
    pub basis: Basis,
    /// The coefficients in red, green and blue.
    pub texels: TextureLayers,
    /// Do they come from a map?
    pub mapped: bool,
}

pub(super) fn bake(m: &Material, basis: Basis) -> Result<Polynomials, BakeError> {
    let planes: Vec<_> =
        (0..basis.terms()).map_while(|k| m.textures.get(&format!("{MAP}.{k}")).cloned()).collect();
    if planes.len() == basis.terms() {
        return Ok(Polynomials { basis, texels: TextureLayers::new(planes), mapped: true });
    }
    if !planes.is_empty() {
        let why = format!("basis={} needs {} planes, not {}", basis.name(), basis.terms(), planes.len());
        return Err(BakeError::Material { slug: "polynomial_texture_map", why });
    }
    let of = match basis {
        Basis::Biquadratic => fitted::<6>(&*m.brdf),
        Basis::Harmonics9 => fitted::<9>(&*m.brdf),
        Basis::Harmonics16 => fitted::<16>(&*m.brdf),
    };
    let of = of.into_iter().map(|c| Arc::new(Texture::constant(c.map(|x| x as f32))));
    Ok(Polynomials { basis, texels: TextureLayers::new(of.collect()), mapped: false })
}

/// π f · ⟨n·wi⟩ seen along the normal, as polynomials of red, green and blue: coefficient by coefficient.
fn fitted<const N: usize>(brdf: &dyn Brdf) -> Vec<[f64; 3]> {
    let lights: Vec<DVec3> = (0..LIGHTS)
        .map(|k| {
            let z = (k as f64 + 0.5) / LIGHTS as f64;
            let (s, phi) = ((1.0 - z * z).sqrt(), 2.399_963_229_728_653 * k as f64);
            DVec3::new(s * phi.cos(), s * phi.sin(), z)
        })
        .collect();
    // Lights all over the hemisphere determine a polynomial.
    let Ok(fit) = Fit::<N>::new(&lights) else { return vec![[0.0; 3]; N] };
    let values: Vec<[f64; 3]> = lights.iter().map(|l| brdf.f_cos(*l, DVec3::Z).map(|x| PI * x)).collect();
    let of = [0, 1, 2].map(|c| fit.coefficients(values.iter().map(|v| v[c])));
    (0..N).map(|k| [0, 1, 2].map(|c| of[c][k])).collect()
}

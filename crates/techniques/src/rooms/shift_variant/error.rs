//! The error at texels, against the models of the reflectance crate.

use super::bake::Varied;
use super::shade;
use crate::Material;
use crate::local::{Place, error_at, texel};
use steradian_brdf::Brdf;

/// Against the models of the reflectance crate at the texels themselves.
pub(super) fn error(t: &Varied, m: &Material) -> f64 {
    let brdf: &dyn Brdf = &*m.brdf;
    let size = t.texels.size();
    let exact = |at: Place, wi, wo| t.exact(at.uv, wi, wo);
    error_at(brdf, |k| texel(k, size).0, exact, |at, wi, wo| shade::f_cos(t, &shade::texel(t, at, wo), wi))
}

//! The reflectance that the technique approximates.

use super::bake::Specular;
use super::shade;
use crate::certify::{Model, Target};
use std::f64::consts::PI;
use steradian_brdf::Brdf;

/// The target of the integral: the model, to which `multiscatter` adds the diffuse term of Fdez-Agüera.
pub fn target<'a>(specular: &'a Specular, brdf: &'a dyn Brdf) -> Target<'a> {
    let mut model = Model::of(brdf);
    if specular.multiscatter > 0.0 {
        model.f_cos = Box::new(move |wi, wo| {
            let mut f = brdf.f_cos(wi, wo);
            let ms = shade::multiscatter(specular.multiscatter, specular.f0, specular.albedo_at(wo.z as f32));
            (0..3).for_each(|c| f[c] += f64::from(specular.scale[c] * ms[c]) / PI * wi.z.max(0.0));
            f
        });
    }
    Target::Integral(model)
}

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
        model.f_cos = Box::new(move |wi, wo, out| {
            brdf.f_cos_batch(wi, wo, out);
            let ms = shade::multiscatter(specular.multiscatter, specular.f0, specular.albedo_at(wo.z as f32));
            let ms: [f64; 3] = std::array::from_fn(|c| f64::from(specular.scale[c] * ms[c]) / PI);
            for (f, wi) in out.iter_mut().zip(wi) {
                (0..3).for_each(|c| f[c] += ms[c] * wi.z.max(0.0));
            }
        });
    }
    Target::Integral(model)
}

//! The reflectance's factor of techniques that see it view by view ([`steradian_prefilter::ViewImage`]).

use crate::shared::material::reflectance::Reflectance;
use crate::tensors::{PartError, TensorFile, get_f32, get_f64, put_f32, put_f64};
use crate::{Material, Part};
use steradian_base::{Cancelled, Task};
use steradian_brdf::Brdf;
use steradian_brdf::views::{Slices, half_count, lambertian_part};

/// Highest order that techniques use; the light's spectrum must reach it.
pub const MOST: usize = 96;

/// A reflectance and its slices, from which the image of any view follows.
pub struct Seen {
    /// The model.
    pub reflectance: Reflectance,
    /// The coefficients of the reflectance.
    pub slices: Slices,
}

impl Seen {
    /// Bakes the slices of a material to `tolerance`, with bands up to `most`; with `split`, the Lambertian
    /// part is left out of them.
    pub fn bake(
        m: &Material,
        split: bool,
        tolerance: f64,
        most: usize,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        let diffuse = if split { lambertian_part(&*m.brdf) } else { [0.0; 3] };
        let slices = Slices::bake(&*m.brdf, diffuse, tolerance, most, task)?;
        Ok(Self { reflectance: Reflectance::of(m), slices })
    }
}

impl Part for Seen {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        self.reflectance.save(to, prefix);
        self.slices.save(to, prefix);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        Ok(Self { slices: Slices::load(from, prefix)?, reflectance: Reflectance::load(from, prefix)? })
    }

    fn bytes(&self) -> usize {
        self.slices.bytes()
    }

    fn kept_reflectance(&self) -> Option<&dyn Brdf> {
        self.reflectance.kept_reflectance()
    }
}

impl Part for Slices {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        let shape = vec![self.elevations(), half_count(self.order()), 3];
        put_f32(to, format!("{prefix}.slices"), shape, self.coefficients().concat());
        let [r, g, b] = self.diffuse;
        let split = vec![self.order() as f64, self.missing, self.blur, r, g, b];
        put_f64(to, format!("{prefix}.split"), vec![6], split);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.split");
        let (_, v) = get_f64(from, &name, 1)?;
        let [order, missing, blur, r, g, b] = v[..] else { return Err(PartError::Unexpected(name)) };
        let order = if (0.0..=MOST as f64).contains(&order) { order as usize } else { 0 };
        let name = format!("{prefix}.slices");
        let (shape, v) = get_f32(from, &name, 3)?;
        let rgb = if shape[2] == 3 { v.as_chunks().0.to_vec() } else { Vec::new() };
        let mut slices = Self::from_coefficients(order, shape[0], rgb).ok_or(PartError::Unexpected(name))?;
        (slices.diffuse, slices.missing, slices.blur) = ([r, g, b], missing, blur);
        Ok(slices)
    }

    fn bytes(&self) -> usize {
        12 * self.coefficients().len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::light::distant::DistantLight;
    use crate::shared::trials::lights;
    use glam::DVec3;
    use steradian_light::Lights;
    use steradian_prefilter::{ViewImage, probe};
    use steradian_reference::{Lookup, Reference, ReferencePoint};
    use steradian_sphere::Frame;

    fn brdf(spec: &str) -> steradian_brdf::SharedBrdf {
        steradian_brdf::parse(spec).unwrap()
    }

    /// Relative RMS over normals that face `view`, up to `limit` degrees, against the reference.
    fn error(spec: &str, lights: &Lights, order: usize, limit: f64) -> f64 {
        let task = Task::quiet();
        let b = brdf(spec);
        let slices = Slices::of_order(&*b, [0.0; 3], order, &task).unwrap();
        let light = DistantLight::bake("views", lights, order, &task).unwrap();
        let view = DVec3::new(0.3, 0.5, -0.8).normalize();
        let image = ViewImage::new(&slices, &light.source().coefficients(order), view);
        let normals = (0..200).map(|k| probe::direction(k, 200));
        let points: Vec<ReferencePoint> = normals
            .filter(|n| n.dot(view) > limit.to_radians().cos())
            .map(|n| ReferencePoint { frame: Frame::from_normal(n), wo: view, position: None })
            .collect();
        let reference = Reference::new(lights, Lookup::Constant, &task).unwrap();
        let exact = reference.radiance_batch(&*b, &points, 1e-3, &task).unwrap();
        let got = points.iter().map(|p| image.towards(steradian_sphere::frame::reflect(view, p.frame.n)));
        probe::relative_rms(got.zip(exact.iter().map(|e| e.rgb)))
    }

    #[test]
    fn an_image_is_the_integral() {
        for (spec, order, bound) in [
            ("lambert:albedo=0.8/0.5/0.2", 32, 1e-3),
            ("phong:n=30", 48, 5e-3),
            ("phong-map:n=10", 32, 1e-3),
            ("ggx:alpha=0.3,f0=0.9/0.6/0.3", 48, 5e-3),
            ("oren-nayar:sigma=0.5", 32, 2e-3),
        ] {
            for lights in [lights::studio(), lights::sunny()] {
                let e = error(spec, &lights, order, 88.0);
                assert!(e < bound, "{spec}: {e}");
            }
        }
    }
}

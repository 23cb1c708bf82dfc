//! The reflectance's factor of techniques that see it view by view.

use super::{Slices, lambertian_part};
use crate::shared::material::reflectance::Reflectance;
use crate::tensors::{PartError, TensorFile};
use crate::{Material, Part};
use steradian_base::{Cancelled, Task};
use steradian_brdf::Brdf;

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

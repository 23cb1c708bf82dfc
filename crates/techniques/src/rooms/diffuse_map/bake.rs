//! The map of E/π and the albedo.

use super::DiffuseMap;
use crate::certify::Report;
use crate::shared::light::distant::DistantLight;
use crate::shared::material::reflectance::Reflectance;
use crate::shared::tables::{cube_bytes, load_cube, save_cube};
use crate::tensors::{PartError, TensorFile, get_f32, get_f64, put_f32, put_f64};
use crate::{BakeError, Part, Technique};
use std::f64::consts::PI;
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::Form;
use steradian_light::Lights;
use steradian_prefilter::{Cosine, CubeMethod, EdgeCube, Zonal, filter};

params! {
    /// Size of the map.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Size {
        /// Intervals per cube edge; where `None`, as many as the tolerance needs.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 512.0], 0.0, "intervals per cube edge; auto: what the tolerance needs, at most 64").auto(0.0).unit("texels"),
    }
}

/// Tolerance where the user gives none.
const TOLERANCE: f64 = 2e-3;
/// The cosine's coefficients fall like l^−5/2: truncation after order 64 leaves an error of 1e-4 even under
/// the sharpest light.
const ORDER: usize = 64;

/// ⟨cos⟩₊/π: radiance to E/π.
struct Lambert;

impl Zonal for Lambert {
    fn value(&self, x: f64) -> f64 {
        Cosine.value(x) / PI
    }

    fn width(&self) -> f64 {
        Cosine.width()
    }

    fn coefficients(&self, order: usize) -> Vec<f64> {
        Cosine.coefficients(order).into_iter().map(|k| k / PI).collect()
    }
}

/// E/π over normals.
pub struct Light {
    pub(super) cube: EdgeCube,
    /// Computed by the filter: bands left out, and lookups.
    error: f64,
    order: f64,
    clipped: f64,
}

impl Light {
    pub(super) fn bake(lights: &Lights, p: &Size, task: &Task) -> Result<Self, BakeError> {
        let light = DistantLight::bake(DiffuseMap::CARD.slug, lights, ORDER, task)?;
        let size = p.size.map_or(filter::Size::UpTo(64), filter::Size::Fixed);
        let tolerance = task.tolerance().unwrap_or(TOLERANCE).min(0.1);
        let f = filter(light.source(), &light.tree, &Lambert, size, tolerance, task)?;
        let order = if let CubeMethod::Frequency { order } = f.way { order as f64 } else { -1.0 };
        let error = f.tail.hypot(f.interpolation);
        Ok(Self { cube: f.cube, error, order, clipped: f.clipped })
    }

    pub(super) fn report(&self) -> Report {
        Report::estimated(self.error, Vec::new())
            .detail("size", self.cube.size() as f64)
            .detail("order", self.order)
            .detail("clipped", self.clipped)
    }
}

impl Part for Light {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        save_cube(&self.cube, to, format!("{prefix}.irradiance_over_pi"));
        put_f64(to, format!("{prefix}.report"), vec![3], vec![self.error, self.order, self.clipped]);
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let cube = load_cube(from, &format!("{prefix}.irradiance_over_pi"))?;
        let name = format!("{prefix}.report");
        let (_, v) = get_f64(from, &name, 1)?;
        let [error, order, clipped] = v[..] else { return Err(PartError::Unexpected(name)) };
        Ok(Self { cube, error, order, clipped })
    }

    fn bytes(&self) -> usize {
        cube_bytes(&self.cube)
    }
}

/// Lambert's albedo.
pub struct Albedo(pub(super) [f32; 3]);

impl Albedo {
    pub(super) fn of(m: &Reflectance) -> Self {
        let Form::Lambert { albedo } = m.form() else { return Self([0.0; 3]) };
        Self(albedo.map(|a| a as f32))
    }
}

impl Part for Albedo {
    fn save(&self, to: &mut TensorFile, prefix: &str) {
        put_f32(to, format!("{prefix}.albedo"), vec![3], self.0.to_vec());
    }

    fn load(from: &TensorFile, prefix: &str) -> Result<Self, PartError> {
        let name = format!("{prefix}.albedo");
        let (_, v) = get_f32(from, &name, 1)?;
        Ok(Self(v.try_into().map_err(|_| PartError::Unexpected(name))?))
    }

    fn bytes(&self) -> usize {
        12
    }
}

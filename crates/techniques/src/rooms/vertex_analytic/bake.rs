//! The model itself: nothing is tabulated.

use glam::DVec3;
use steradian_base::{ParamInfo, params};
use steradian_brdf::SharedBrdf;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Where the model is evaluated.
        pub rate: usize = ParamInfo::choice("rate", &["vertex", "pixel"], "where the model is evaluated: at the vertices of the mesh, and interpolated, or at every point").numbered(0.0),
    }
}

impl Params {
    pub(super) fn pixel(&self) -> bool {
        self.rate == 1
    }
}

/// A reflectance model.
pub struct Model(pub SharedBrdf);

impl Model {
    pub(super) fn f_cos(&self, wi: [f32; 3], wo: [f32; 3]) -> [f32; 3] {
        let unit = |v: [f32; 3]| DVec3::from_array(v.map(f64::from)).normalize_or_zero();
        self.0.f_cos(unit(wi), unit(wo)).map(|x| x as f32)
    }
}

//! STAR04 eq. 26: the parameters of the blend, and the reflectance that they make together.

use crate::shared::material::reflectance::Reflectance;
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::{ParamInfo, params};
use steradian_brdf::{Domain, Form};
use steradian_sphere::frame::reflect;

params! {
    /// The parameters of the blend.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Intervals per cube edge of the Phong map; where `None`, as many as the tolerance needs.
        pub size: Option<usize> = ParamInfo::whole("size", [1.0, 2048.0], 0.0, "intervals per cube edge of the Phong map; auto: what the tolerance needs, at most 256").auto(0.0).unit("texels"),
        /// Factor of the Phong map.
        pub k_s: f64 = ParamInfo::real("k_s", [0.0, 1.0], 1.0, "factor of the Phong map (eq. 22)"),
        /// Albedo of the diffuse map.
        pub k_d: f64 = ParamInfo::real("k_d", [0.0, 1.0], 0.0, "albedo of the diffuse map (eq. 19); lambert brings its own"),
        /// Fresnel reflectance at normal incidence.
        pub f0: f64 = ParamInfo::real("f0", [0.0, 1.0], 1.0, "Fresnel reflectance at normal incidence (eq. 26); 1: Phong alone"),
    }
}

/// f_cos = (1 − F) k_d/π ⟨n·wi⟩₊ + F k_s (r·wi)₊^n, F = f0 + (1 − f0)(1 − n·wo)⁵.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blend {
    /// Exponent.
    pub n: f64,
    /// Factor of the lobe.
    pub k_s: [f64; 3],
    /// Albedo of the diffuse part.
    pub k_d: [f64; 3],
    /// Fresnel reflectance at normal incidence; `None` for the diffuse part alone (F = 0).
    pub f0: Option<f64>,
    /// Does the lobe end at the horizon?
    pub horizon: bool,
}

impl Blend {
    /// The blend of a reflectance under these parameters.
    pub fn new(m: &Reflectance, p: &Params) -> Self {
        match m.form() {
            Form::Lambert { albedo } => Self { n: 1.0, k_s: [0.0; 3], k_d: albedo, f0: None, horizon: false },
            form => {
                let (n, factor, domain) = match form {
                    Form::Phong { n, factor, domain } => (n, factor, domain),
                    _ => (1.0, [1.0; 3], Domain::Sphere),
                };
                let (k_s, k_d) = (factor.map(|f| f * p.k_s), [p.k_d; 3]);
                Self { n, k_s, k_d, f0: Some(p.f0), horizon: domain == Domain::Hemisphere }
            }
        }
    }

    /// F at n·wo.
    pub fn fresnel(&self, cos_o: f64) -> f64 {
        self.f0.map_or(0.0, |f0| f0 + (1.0 - f0) * (1.0 - cos_o).powi(5))
    }

    /// f_cos in the local frame.
    pub fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let f = self.fresnel(wo.z);
        let x = reflect(wo, DVec3::Z).dot(wi).max(0.0);
        let lobe = if self.horizon && wi.z <= 0.0 { 0.0 } else { x.powf(self.n) };
        std::array::from_fn(|c| (1.0 - f) * self.k_d[c] / PI * wi.z.max(0.0) + f * self.k_s[c] * lobe)
    }
}

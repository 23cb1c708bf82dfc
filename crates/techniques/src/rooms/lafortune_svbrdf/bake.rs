//! The numbers of the lobes by texel.

use super::shade;
use crate::local::{FileName, Place, error_at, texel};
use crate::shared::surface::cosine_lobes::{CosineLobes, LAYERS, lobes_of};
use crate::{BakeError, Material};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::{ParamInfo, params};

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Albedo of the diffuse part.
        pub rho_d: Option<FileName> = ParamInfo::file("rho_d", "image of the diffuse albedo; auto: that of the reflectance").auto(f64::NAN),
        /// Factor of the first lobe.
        pub rho_1: Option<FileName> = ParamInfo::file("rho_1", "image of the first lobe's factor; auto: that of the reflectance, or 0").auto(f64::NAN),
        /// C of the first lobe.
        pub c_1: Option<FileName> = ParamInfo::file("c_1", "image of the first lobe's C, as red, green and blue (.exr or .pfm); auto: that of the reflectance, or -1, -1, 1").auto(f64::NAN),
        /// Exponent of the first lobe.
        pub n_1: Option<FileName> = ParamInfo::file("n_1", "image of the first lobe's exponent, 0.001 at least (.exr or .pfm); auto: that of the reflectance, or 1").auto(f64::NAN),
        /// Factor of the second lobe.
        pub rho_2: Option<FileName> = ParamInfo::file("rho_2", "the same of the second lobe").auto(f64::NAN),
        /// C of the second lobe.
        pub c_2: Option<FileName> = ParamInfo::file("c_2", "the same of the second lobe").auto(f64::NAN),
        /// Exponent of the second lobe.
        pub n_2: Option<FileName> = ParamInfo::file("n_2", "the same of the second lobe").auto(f64::NAN),
    }
}

pub(super) fn bake(m: &Material) -> Result<CosineLobes, BakeError> {
    let refuse =
        || BakeError::Material { slug: "lafortune_svbrdf", why: "takes lafortune and lambert only".into() };
    let own = lobes_of(&*m.brdf).ok_or_else(refuse)?;
    Ok(CosineLobes::new(own.kd, &own.lobes, &m.textures))
}

/// Against the equation at the texels themselves.
pub(super) fn error(t: &CosineLobes, m: &Material) -> f64 {
    let size = t.texels.size();
    let exact = |at: Place, wi: DVec3, wo: DVec3| {
        let layer = |k: usize| t.texels.sample(k, at.uv, 0.0).map(f64::from);
        let mut f = layer(0).map(|x| x / PI);
        for k in 0..t.count {
            let [rho, x, y, z, s, _] = std::array::from_fn(|j| layer(1 + LAYERS * k + j));
            for c in (0..3).filter(|c| rho[*c] > 0.0) {
                let cosine = (x[c] * wo.x * wi.x + y[c] * wo.y * wi.y + z[c] * wo.z * wi.z) / rho[c];
                f[c] += if cosine > 0.0 { rho[c] * cosine.powf(rho[c] / s[c]) } else { 0.0 };
            }
        }
        f.map(|f| f * wi.z)
    };
    error_at(
        &*m.brdf,
        |k| texel(k, size).0,
        exact,
        |at, wi, wo| shade::f_cos(t, &t.at(at.uv, at.footprint), wi, wo),
    )
}

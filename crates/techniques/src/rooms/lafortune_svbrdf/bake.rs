//! The numbers of the lobes by texel.

use crate::local::FileName;
use crate::shared::surface::cosine_lobes::{Averages, CosineLobes, Storage, TOLERANCE, Widths, lobes_of};
use crate::{BakeError, Material};
use steradian_base::{ParamInfo, Task, params};

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Bits of a number; as few as the tolerance allows where `None`.
        pub bits: Option<usize> = ParamInfo::whole("bits", [8.0, 24.0], 0.0, "bits in which each number of a texel is stored, rounded up to 8, 16 or 24; auto: 8, or 16 for C or for all, or 24, as few as keep the error of f cos at the texels to the tolerance or 1 %").auto(0.0),
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

pub(super) fn bake(m: &Material, p: &Params, task: &Task) -> Result<CosineLobes, BakeError> {
    let storage = match p.bits {
        Some(bits) => Storage::Of(Widths::all(bits.div_ceil(8))),
        None => Storage::Within(task.tolerance().unwrap_or(TOLERANCE)),
    };
    Ok(CosineLobes::of(&averages(m)?, storage))
}

/// The numbers as the images have them.
fn averages(m: &Material) -> Result<Averages, BakeError> {
    let refuse =
        || BakeError::Material { slug: "lafortune_svbrdf", why: "takes lafortune and lambert only".into() };
    let own = lobes_of(&*m.brdf).ok_or_else(refuse)?;
    Ok(Averages::new(own.kd, &own.lobes, &m.textures))
}

/// Against the equation with the numbers of the images, at texels.
pub(super) fn error(t: &CosineLobes, m: &Material) -> f64 {
    averages(m).map_or(f64::NAN, |exact| t.error(&exact))
}

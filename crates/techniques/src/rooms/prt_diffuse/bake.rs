//! Transfer vectors.

use super::PrtDiffuse;
use super::normals::{self, HARMONICS};
use crate::shared::geometry::grouped::Grouped;
use crate::shared::geometry::transport::{self, PerSite};
use crate::shared::light::sh_light::Albedo;
use crate::{BakeError, Geometry, Technique};
use steradian_base::{ParamInfo, Task, params};
use steradian_transfer::Settings;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Bands of light and transfer.
        pub bands: usize = ParamInfo::whole("bands", [1.0, 6.0], 5.0, "bands of spherical harmonics"),
        /// Scattering events.
        pub bounces: usize = ParamInfo::whole("bounces", [1.0, 64.0], 1.0, "scattering events at surfaces: 1 is direct light alone"),
        /// Absolute error of the coefficients of transfer.
        pub precision: f64 = ParamInfo::real("precision", [1e-4, 0.1], 5e-3, "absolute error of the coefficients of transfer"),
        /// Where the window ends; 0 for none.
        pub window: f64 = ParamInfo::real("window", [0.0, 32.0], 0.0, "band at which a window of Hann ends that takes ringing off the light; 0: none"),
        /// Transfer by normal.
        pub normals: Option<bool> = ParamInfo::switch("normals", false, "transfer to other normals than the mesh's, at ten times the memory; auto: where the material has a normal map").auto(f64::NAN),
        /// 16-bit transfer.
        pub halves: bool = ParamInfo::switch("halves", false, "transfer of 16-bit floats"),
    }
}

impl Params {
    /// Is there transfer to other normals than the mesh's?
    pub(super) fn by_normal(&self) -> bool {
        self.normals == Some(true)
    }
}

/// Transfer vectors of all sites: first that of direct light; where light is reflected, one or three more;
/// and last, where the parameters ask for other normals, those of [`normals`].
pub(super) fn transfer(g: &Geometry, m: &Albedo, p: &Params, task: &Task) -> Result<Grouped, BakeError> {
    let settings = Settings {
        bands: p.bands,
        tolerance: p.precision,
        bounces: p.bounces as u32,
        matrices: p.by_normal(),
        ..Settings::default()
    };
    let t = transport::bake(PrtDiffuse::CARD.slug, g, m.0, settings, task)?;
    let n = p.bands * p.bands;
    let reflected = transport::reflected(&t);
    let by_normal = if p.by_normal() { normals::by_normal(g, &t)? } else { Vec::new() };
    let all = match t.direct {
        None => PerSite { stride: n, data: t.t },
        Some(direct) => PerSite { stride: n, data: direct }.beside(&reflected),
    };
    let all =
        if p.by_normal() { all.beside(&PerSite { stride: HARMONICS * n, data: by_normal }) } else { all };
    Ok(Grouped::from_sites(all.stride, &all.data, p.halves))
}

//! Choice of the tables' sizes.

use super::shade;
use super::tables::{Tables, model};
use crate::local;
use crate::{BakeError, Material};
use steradian_base::{ParamInfo, Task, params};

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Entries a side; where `None`, as many as the tolerance needs.
        pub resolution: Option<usize> = ParamInfo::whole("resolution", [2.0, 4096.0], 0.0, "entries of each table a side; auto: what the tolerance needs, 64 to 2048").auto(0.0),
    }
}

pub(super) fn bake(m: &Material, p: &Params, task: &Task) -> Result<Tables, BakeError> {
    let slug = "analytic_decomposition";
    let model = model(&*m.brdf).map_err(|why| BakeError::Material { slug, why })?;
    let exact = |wi, wo| m.brdf.f_cos(wi, wo);
    let error = |t: &Tables| local::error(&*m.brdf, &exact, |wi, wo| shade::f_cos(t, wi, wo));
    local::tables(p.resolution, task, |n| Tables::new(&model, n), error)
}

//! Choice of the table's size.

use super::shade;
use super::table::{Model, Table};
use crate::local;
use crate::{BakeError, Material};
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::Form;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Entries a side; where `None`, as many as the tolerance needs.
        pub resolution: Option<usize> = ParamInfo::whole("resolution", [2.0, 4096.0], 0.0, "entries of the table a side; auto: what the tolerance needs, 64 to 2048").auto(0.0),
        /// Coordinates of the table, an index of the choices.
        pub coordinate: usize = ParamInfo::choice("coordinate", &["angle", "cosine"], "coordinates of the table: the angles a and b, or l·t and v·t, which is worse").numbered(0.0),
        /// k_d of eq. 33.
        pub kd: f64 = ParamInfo::real("kd", [0.0, 1.0], 0.0, "diffuse factor k_d of eq. 33, beside the reflectance's own highlight"),
    }
}

pub(super) fn bake(m: &Material, p: &Params, task: &Task) -> Result<Table, BakeError> {
    let Form::Strand { n, scale, .. } = m.brdf.form() else {
        return Err(BakeError::Material { slug: "banks_table", why: "takes banks only".into() });
    };
    let model = Model { n, diffuse: [p.kd; 3], specular: scale };
    let exact = |wi, wo| model.f_cos(wi, wo);
    let error = |t: &Table| local::error(&*m.brdf, &exact, |wi, wo| shade::f_cos(t, wi, wo));
    local::tables(p.resolution, task, |n| Table::new(model, n, p.coordinate == 0), error)
}

//! Parameters, and the maps as tables.

use super::fit::{Layout, Samples, fit};
use super::form::Form;
use crate::shared::tables::grid::GridStack;
use crate::shared::tables::hemisphere::Map;
use crate::{BakeError, Material};
use steradian_base::{ParamInfo, Task, params};
use steradian_brdf::Symmetry;
use steradian_numerics::lsqr::Rgb;

/// Default number of entries a side.
const SIDE: usize = 64;

params! {
    /// The parameters.
    #[derive(Debug, Clone, PartialEq)]
    pub struct Params {
        /// Entries a side; 64 where `None`.
        pub resolution: Option<usize> = ParamInfo::whole("resolution", [8.0, 256.0], 0.0, "rows of the map over v and l, of which the one over h has twice as many, four times of isotropic reflectance; columns as symmetry asks; auto: 64").auto(0.0),
        /// Samples for each unknown.
        pub samples: usize = ParamInfo::whole("samples", [4.0, 4096.0], 48.0, "samples of the reflectance for each unknown of the fit"),
        /// Power of f by which errors of its logarithm count.
        pub weight: f64 = ParamInfo::real("weight", [0.0, 1.0], 1.0, "what the fit minimises: 1 the absolute error of f cos, 0 its relative error, which the dark parts rule"),
    }
}

/// The maps of P and Q.
#[derive(Debug, Clone, PartialEq)]
pub struct Tables {
    /// Map of P, over v and l.
    pub sides: Map,
    /// Map of Q, over h.
    pub halves: Map,
    /// P.
    pub side: GridStack,
    /// Q.
    pub half: GridStack,
    /// f where P and Q and the closed form are 0.
    pub scale: [f32; 3],
    /// The power of 1/(n·v) and 1/(n·l) that multiplies the tables.
    pub grazing: f32,
    /// Factors of the half vector's tangential components before Q is looked up.
    pub stretch: [f32; 2],
    /// Relative RMS error of f · ⟨n·wi⟩ at the samples.
    pub residual: f64,
    pub samples: usize,
    pub steps: usize,
}

/// Largest logarithm in maps: where there is no sample, smoothness alone decides them. P is at most 0, so
/// that no sum exceeds this, and its exponential, 2e17, is finite in single precision.
const MAX_LOGARITHM: f64 = 40.0;
/// Smallest logarithm in maps: its exponential is 0 in single precision.
const MIN_LOGARITHM: f64 = -200.0;

/// A map's logarithms as a table.
fn table(map: &Map, layout: &Layout, start: usize, x: &[Rgb]) -> GridStack {
    GridStack::new(map.width, map.height, 1, |i, j, _| {
        let [r, g, b] =
            x[start + layout.node(map, i, j)].map(|x| x.clamp(MIN_LOGARITHM, MAX_LOGARITHM) as f32);
        [r, g, b, 0.0]
    })
}

pub(super) fn bake(m: &Material, p: &Params, task: &Task) -> Result<Tables, BakeError> {
    let symmetry = Symmetry::of(&*m.brdf);
    let form = Form::of(&*m.brdf, symmetry.isotropic);
    let layout = Layout::new(symmetry, p.resolution.unwrap_or(SIDE), form);
    let count = p.samples * layout.count();
    // Samples, their rows twice, and vectors of the solver or its normal equations.
    let need = (count * (72 + 24 * 8 + 24 * 6) + layout.normal_bytes()) as u64;
    let allowed = task.max_memory();
    if need > allowed {
        return Err(BakeError::Memory { slug: "homomorphic", need, allowed });
    }
    let samples = Samples::new(&*m.brdf, count, symmetry.isotropic, form, task)?;
    let found = fit(&layout, &samples, p.weight, task)?;
    Ok(Tables {
        side: table(&layout.sides, &layout, 0, &found.x),
        half: table(&layout.halves, &layout, layout.first_half(), &found.x),
        sides: layout.sides,
        halves: layout.halves,
        scale: found.scale.map(|s| s as f32),
        grazing: form.grazing as f32,
        stretch: form.widths.map(|w| w.recip() as f32),
        residual: found.residual,
        samples: found.samples,
        steps: found.steps,
    })
}

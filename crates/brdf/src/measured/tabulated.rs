//! Common code of reflectances that are given only by their values: samplers, hints, the peak, and the part
//! of the file that is kept.

use super::shape::Shape;
use crate::draw;
use crate::math::above;
use crate::spec::Args;
use crate::{Brdf, BrdfShader, Info, Lobe, MAX_CELLS, Peak, Sample, SharedBrdf, SpecError};
use glam::{DVec2, DVec3};
use std::fmt::Debug;
use std::path::Path;
use std::sync::Arc;

/// Measurements, or a fit of them that is as expensive to sample.
pub(super) trait Tabulated: Debug + Send + Sync + 'static {
    /// The page.
    fn info(&self) -> &'static Info;

    /// See [`Brdf::held`].
    fn held(&self) -> Vec<f64>;

    /// See [`Brdf::is_interpolated`].
    fn is_interpolated(&self) -> bool {
        true
    }

    /// See [`Brdf::notes`].
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }

    /// f of two directions above the horizon.
    fn value(&self, wi: DVec3, wo: DVec3) -> [f64; 3];

    /// [`Tabulated::value`] of each of `wi`, into `out`; values for directions below the horizon are ignored.
    fn values(&self, wi: &[DVec3], wo: DVec3, out: &mut [[f64; 3]]) {
        for (f, wi) in out.iter_mut().zip(wi) {
            *f = if wi.z > 0.0 { self.value(*wi, wo) } else { [0.0; 3] };
        }
    }

    /// See [`Brdf::is_isotropic`].
    fn is_isotropic(&self) -> bool {
        true
    }

    /// See [`Brdf::shader`].
    fn twin(&self) -> Option<Twin> {
        None
    }
}

/// The reflectance's data for a GPU.
pub(super) struct Twin {
    /// Defines `brdf_eval`.
    pub source: &'static str,
    /// Members of `struct Brdf` in addition to the common ones.
    pub parameters: Vec<[f32; 4]>,
    /// Values that `brdf_cell` reads.
    pub cells: Arc<Vec<[f32; 3]>>,
}

/// Measurements as a reflectance.
#[derive(Debug)]
pub(super) struct Measured<T> {
    spec: String,
    data: T,
    shape: Shape,
}

impl<T: Tabulated> Measured<T> {
    /// A reflectance of `data` with the canonical `spec`.
    pub fn new(spec: String, data: T) -> Self {
        let isotropic = data.is_isotropic();
        let f = |wi, wo| if above(wi, wo) { data.value(wi, wo) } else { [0.0; 3] };
        let shape = Shape::measure(&f, isotropic);
        Self { spec, data, shape }
    }
}

/// The reflectance of a spec with one file: `read` makes it of the path, or `keep` of the numbers that were
/// kept of the file. `example` is a whole spec, for messages.
pub(super) fn make<T: Tabulated>(
    a: &Args<'_>,
    example: &str,
    read: impl FnOnce(&Path) -> Result<T, SpecError>,
    keep: impl FnOnce(&[f64]) -> Option<T>,
) -> Result<SharedBrdf, SpecError> {
    Ok(Arc::new(Measured::new(a.spec(), load(a, example, read, keep)?)))
}

/// The data from which [`make`] makes a reflectance.
pub(super) fn load<T>(
    a: &Args<'_>,
    example: &str,
    read: impl FnOnce(&Path) -> Result<T, SpecError>,
    keep: impl FnOnce(&[f64]) -> Option<T>,
) -> Result<T, SpecError> {
    let Some(path) = a.file("file") else {
        return Err(a.syntax(format!("needs the path of a file, as in {example}")));
    };
    match a.held() {
        Some(numbers) => {
            keep(numbers).ok_or_else(|| a.syntax(format!("what is kept of {} is damaged", path.display())))
        }
        None => read(&path),
    }
}

impl<T: Tabulated> Brdf for Measured<T> {
    fn info(&self) -> &'static Info {
        self.data.info()
    }

    fn spec(&self) -> String {
        self.spec.clone()
    }

    fn held(&self) -> Option<Vec<f64>> {
        Some(self.data.held())
    }

    fn is_interpolated(&self) -> bool {
        self.data.is_interpolated()
    }

    fn notes(&self) -> Vec<String> {
        self.data.notes()
    }

    fn eval(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        if above(wi, wo) { self.data.value(wi, wo) } else { [0.0; 3] }
    }

    fn f_cos_batch(&self, wi: &[DVec3], wo: DVec3, out: &mut [[f64; 3]]) {
        if wo.z <= 0.0 {
            out.fill([0.0; 3]);
            return;
        }
        self.data.values(wi, wo, out);
        for (f, wi) in out.iter_mut().zip(wi) {
            *f = if wi.z > 0.0 { f.map(|f| f * wi.z) } else { [0.0; 3] };
        }
    }

    fn is_isotropic(&self) -> bool {
        self.data.is_isotropic()
    }

    fn lobes(&self, wo: DVec3) -> Vec<Lobe> {
        self.shape.lobes(self, wo)
    }

    fn peak(&self) -> Peak {
        self.shape.peak()
    }

    fn shader(&self) -> Option<BrdfShader> {
        let Twin { source, parameters, cells } = self.data.twin().filter(|t| t.cells.len() <= MAX_CELLS)?;
        Some(BrdfShader::new(source, self.peak(), self.domain(), parameters).with_cells(cells))
    }

    fn sample(&self, wo: DVec3, u: DVec2) -> Option<Sample> {
        draw::sample(&self.shape.draw(wo), wo, u)
    }

    fn pdf(&self, wi: DVec3, wo: DVec3) -> f64 {
        draw::pdf(&self.shape.draw(wo), wi, wo)
    }
}

//! The inputs as they were given, and the certificate that a bake gets by them.

use crate::certify::{Report, sites};
use crate::shared::light::distant;
use crate::{Bake, BakeError, Geometry, Part, Technique};
use steradian_base::{Certificate, Task};
use steradian_brdf::{Brdf, SharedBrdf};
use steradian_light::Lights;

/// Light, reflectance and geometry as the caller gave them, where available: a loaded bake has only what its
/// factors keep.
#[derive(Clone, Default)]
pub(super) struct Given {
    pub lights: Option<Lights>,
    pub brdf: Option<SharedBrdf>,
    pub geometry: Option<Geometry>,
}

impl Given {
    /// The certificate of `b`, whose technique reports `report`: shading is compared with the integral of the
    /// original inputs, not of the inputs as the factors hold them.
    pub fn certificate<T: Technique>(
        &self,
        b: &Bake<T>,
        report: &Report,
        task: &Task,
    ) -> Result<Certificate, BakeError> {
        let slug = T::CARD.slug;
        let measured = self.measured(b, report, task)?.or_else(|| report.unmeasured());
        let mut c = measured.ok_or(BakeError::Unmeasured { slug })?;
        c.tolerance = task.tolerance();
        // An error that is not finite says that something overflowed.
        if c.error.is_finite() { Ok(c) } else { Err(BakeError::NotFinite { slug }) }
    }

    /// Measures the error. `None` where light, reflectance or, for techniques that shade with shadows, the
    /// mesh are not available.
    fn measured<T: Technique>(
        &self,
        b: &Bake<T>,
        report: &Report,
        task: &Task,
    ) -> Result<Option<Certificate>, BakeError> {
        if T::self_shadowing(&b.params) {
            return self.at_sites(b, report, task);
        }
        let brdf: Option<&dyn Brdf> = self.brdf.as_deref().or_else(|| b.material.kept_reflectance());
        let Some(target) = T::target(b, brdf) else { return Ok(None) };
        let own = match (b.light.kept_light(), &self.lights) {
            (None, Some(lights)) => Some(distant::tree(lights, task)?),
            _ => None,
        };
        let Some(tree) = b.light.kept_light().or(own.as_ref()) else { return Ok(None) };
        let mut frame = T::Frame::default();
        T::first_frame(b, &mut frame);
        let shade = |q: &crate::Points<'_>, out: &mut crate::Radiance<'_>| T::shade(b, &frame, q, out);
        let mut c = target.errors(tree, task, &shade)?.certificate(report);
        if let Some((name, target)) = T::also_against(b) {
            c = c.detail(name, target.errors(tree, task, &shade)?.all);
        }
        Ok(Some(c))
    }

    /// The error over points of the mesh and views.
    fn at_sites<T: Technique>(
        &self,
        b: &Bake<T>,
        report: &Report,
        task: &Task,
    ) -> Result<Option<Certificate>, BakeError> {
        let (Some(lights), Some(brdf), Some(geometry)) = (&self.lights, &self.brdf, &self.geometry) else {
            return Ok(None);
        };
        let mut frame = T::Frame::default();
        T::first_frame(b, &mut frame);
        let shade = |q: &crate::Points<'_>, out: &mut crate::Radiance<'_>| T::shade(b, &frame, q, out);
        let paths = sites::Paths {
            geometry,
            lights,
            brdf: &**brdf,
            events: T::events(b),
            points: sites::SITES,
            projected: false,
        };
        Ok(Some(paths.certificate(T::CARD.slug, report, task, &shade)?))
    }
}

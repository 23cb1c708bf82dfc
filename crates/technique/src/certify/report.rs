//! A technique's own account of a bake.

use super::errors::COMPUTED;
use steradian_base::{Certificate, Elevation, Evidence};

/// A technique's own account of a bake: figures, and the error that it estimated while it chose its orders,
/// if it did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Report {
    /// The technique's estimate of its own error. It is compared with a measurement wherever the inputs are
    /// available.
    pub estimate: Option<Estimate>,
    /// See [`Certificate::missing_energy`].
    pub missing_energy: Option<f64>,
    /// Further figures by name: orders used, sizes, energies lost.
    pub details: Vec<(String, f64)>,
}

/// An error computed from the technique's own form of the inputs: cheaper than a measurement, but it does not
/// see what that form has already lost.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Relative RMS error of outgoing radiance, views uniform in solid angle.
    pub error: f64,
    /// The error by angle of view, ascending; empty where angles are not measured from the normal.
    pub elevations: Vec<Elevation>,
}

impl Report {
    /// A report with an estimate and no figures.
    pub fn estimated(error: f64, elevations: Vec<Elevation>) -> Self {
        Self { estimate: Some(Estimate { error, elevations }), ..Self::default() }
    }

    /// This report with one more figure.
    #[must_use]
    pub fn detail(mut self, name: impl Into<String>, value: f64) -> Self {
        self.details.push((name.into(), value));
        self
    }

    /// A figure of `details` by name.
    pub fn figure(&self, name: &str) -> Option<f64> {
        self.details.iter().find(|d| d.0 == name).map(|d| d.1)
    }

    /// Writes the figures into `c`.
    pub(super) fn figures(&self, c: &mut Certificate) {
        c.missing_energy = self.missing_energy;
        c.details.clone_from(&self.details);
    }

    /// The certificate where nothing can be measured: the estimate, if there is one.
    pub fn unmeasured(&self) -> Option<Certificate> {
        let e = self.estimate.as_ref()?;
        let mut c = Certificate::new(e.error, Evidence::Estimated).metric(COMPUTED);
        c.elevations.clone_from(&e.elevations);
        self.figures(&mut c);
        Some(c)
    }
}

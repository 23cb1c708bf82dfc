//! Bakes: a technique's precomputed data for a light, a reflectance and, where it bakes on one, a mesh.

mod halves;
mod output;
mod report;
mod stages;
mod tables;

pub use output::{Output, Written};

use crate::transfer::check_reads;
use crate::{Adjust, Error, Outcome, Session};
use stages::Stages;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;
use steradian_base::{Certificate, ParamValues};
use steradian_formats::TensorFile;
use steradian_techniques::{AnyBake, AnyTechnique, BakedMesh, Geometry, Made, Material, Sites, not_finite};

/// Request for a bake.
#[derive(Clone)]
pub struct Request {
    /// Light: an image, or a sky spec.
    pub environment: String,
    /// How the light is read, rotated and scaled.
    pub adjust: Adjust,
    /// A file of disk and directional lights that become part of the data.
    pub sun_lights: Option<PathBuf>,
    /// Spec of the reflectance.
    pub brdf: String,
    /// The technique.
    pub technique: &'static dyn AnyTechnique,
    /// Its parameters.
    pub params: ParamValues,
    /// Required accuracy.
    pub accuracy: Accuracy,
    /// Mesh, for techniques that bake per vertex.
    pub mesh: Option<String>,
    /// Transfer of the mesh's vertices that a file holds, in place of rays.
    pub transfer: Option<PathBuf>,
    /// Are 16-bit floats stored where the error allows?
    pub half: bool,
}

/// A required accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Accuracy {
    /// None.
    Usual,
    /// A relative RMS error of radiance.
    Error(f64),
    /// A share of the reflectance's energy.
    Energy(f64),
}

/// Name of the parameter that bounds the share of energy beyond the orders.
const EPSILON: &str = "energy_epsilon";

impl Accuracy {
    /// The accuracy that a tolerance, or else an energy, means for a technique: where it has no parameter for
    /// the energy, the square root of that is the tolerance.
    pub fn of(tolerance: Option<f64>, energy: Option<f64>, technique: &dyn AnyTechnique) -> Self {
        match (tolerance, energy) {
            (Some(t), _) => Self::Error(t),
            (None, Some(e)) if technique.params().iter().any(|p| p.name == EPSILON) => Self::Energy(e),
            (None, Some(e)) => Self::Error(e.sqrt()),
            (None, None) => Self::Usual,
        }
    }

    /// The relative RMS error of radiance.
    pub fn tolerance(self) -> Option<f64> {
        if let Self::Error(t) = self { Some(t) } else { None }
    }
}

/// A finished bake and how it came about.
pub struct Baked {
    /// The bake.
    pub bake: Box<dyn AnyBake>,
    /// Certificate, including the rounding of the file's numbers.
    pub certificate: Certificate,
    /// The inputs that it was made from.
    pub made: Made,
    /// The required accuracy.
    pub accuracy: Accuracy,
    /// Seconds of wall time that reading the inputs took.
    pub read_seconds: f64,
    /// Seconds of wall time of the bake itself.
    pub seconds: f64,
    /// The same by stage; they add up.
    pub stages: Vec<(String, f64)>,
    tensors: TensorFile,
}

impl Baked {
    /// The required accuracy and the one reached, where the request gives one.
    pub fn reached(&self) -> Option<(f64, f64)> {
        match self.accuracy {
            Accuracy::Usual => None,
            Accuracy::Error(t) => Some((t, self.certificate.error)),
            Accuracy::Energy(e) => self.certificate.missing_energy.map(|missed| (e, missed)),
        }
    }

    /// Was it missed?
    pub fn missed(&self) -> bool {
        self.reached().is_some_and(|(asked, reached)| reached.is_nan() || reached > asked)
    }

    /// Writes it where `output` says, marked where the accuracy was missed.
    pub fn write(&self, output: &Output, session: &Session) -> Result<Vec<Written>, Error> {
        session.check()?;
        output.write(self, &self.tensors, session)
    }
}

impl Session {
    /// Bakes. Everything that can be refused is refused before the work.
    pub fn bake(&mut self, request: &Request) -> Result<Outcome<Baked>, Error> {
        let start = Instant::now();
        let brdf = self.brdf(&request.brdf)?;
        let (technique, card) = (request.technique, request.technique.card());
        let refused = |why: String| Error::usage(format!("{}: {why}", card.slug));
        technique.takes(&*brdf, &request.params).map_err(refused)?;
        let mut params = request.params.clone();
        if let Accuracy::Energy(e) = request.accuracy {
            params.0.insert(EPSILON.into(), e.into());
        }
        params.check(technique.params())?;
        let planes = self.technique_planes(technique, &params, None)?;
        let geometry = geometry(request, self)?;
        let adjust = &request.adjust;
        let mut lights = self.light(&request.environment, adjust)?;
        if let Some(path) = &request.sun_lights {
            self.join_lights(path, &mut lights, adjust)?;
        }
        self.check()?;
        let read_seconds = start.elapsed().as_secs_f64();
        let stages = Arc::new(Stages::new(self.task.progress()));
        let tolerance = request.accuracy.tolerance();
        let task = self.task.clone().with_progress(stages.clone()).with_tolerance(tolerance);
        let material = Material::new(brdf).with_textures(planes);
        let bake = technique.bake(&lights, &material, geometry.as_ref(), &params, &task)?;
        let (rotate, exposure) = (adjust.rotate, adjust.light_exposure);
        let held = material.brdf.held();
        let (seconds, stages) = stages.finish();
        let mut done = Baked {
            certificate: bake.certificate().clone(),
            bake,
            made: Made {
                mesh: geometry.as_ref().map(|g| BakedMesh::of(&g.mesh)),
                ..Made::of(&request.brdf, held, &request.environment, rotate, exposure)
            },
            accuracy: request.accuracy,
            read_seconds,
            seconds,
            stages,
            tensors: TensorFile::default(),
        };
        done.tensors = halves::tensors(&mut done, technique, request.half, self)?;
        if let Some(name) = not_finite(&done.tensors) {
            let why = format!("tensor '{name}' came out not finite: scale the light down");
            return Err(Error::failed(format!("{}: {why}", card.slug)));
        }
        done.made.save(&mut done.tensors);
        let c = &done.certificate;
        self.note_error(format!("{} {:.3e} ({})", c.metric, c.error, c.known.word()));
        let reached = done.reached();
        Ok(Outcome::new(done, reached.map(|r| r.0), reached.map_or(0.0, |r| r.1)))
    }
}

fn geometry(request: &Request, session: &mut Session) -> Result<Option<Geometry>, Error> {
    let card = request.technique.card();
    match (&request.mesh, request.technique.needs_sites(&request.params)) {
        (None, false) => Ok(None),
        (None, true) => Err(Error::usage(format!("{} bakes on a mesh: give `mesh`", card.slug))),
        (Some(_), false) => Err(Error::usage(format!("{} bakes no mesh: leave `mesh` out", card.slug))),
        (Some(mesh), true) => {
            if request.transfer.is_some() {
                check_reads(request.technique, &request.params)?;
            }
            let mesh = Arc::new(session.mesh(mesh)?);
            let known = request
                .transfer
                .as_ref()
                .map(|path| session.transfer_of(path, &mesh, "vertices"))
                .transpose()?;
            Ok(Some(Geometry { transfer: known, ..Geometry::new(mesh, Sites::Vertices) }))
        }
    }
}

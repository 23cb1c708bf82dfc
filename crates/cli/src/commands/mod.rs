//! One file per command.

mod atlas;
mod bake;
mod capture;
mod compare;
mod convert;
mod demo;
mod eval;
mod export_web;
mod fit;
mod inspect;
mod irradiance;
mod lut;
mod prefilter;
mod probes;
pub mod render;
mod sample;
mod techniques;
mod transfer;
mod verify;
mod view;

use crate::context::{Backend, Context};
use crate::failure::{Failure, Outcome};
use clap::Subcommand;

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// The README's first picture: split sum, reflection maps and the reference beside each other; needs no
    /// files
    Demo(demo::Options),
    /// Render a mesh, a built-in shape or a scene file under an environment
    Render(Box<render::Options>),
    /// Any technique's precomputed data for a light and a reflectance, with its certified error
    Bake(Box<bake::Options>),
    /// Evaluate radiance at points of a CSV file by any technique or by the reference
    Eval(eval::Options),
    /// Spherical harmonic coefficients of an environment's radiance and irradiance
    #[command(alias = "sh")]
    Irradiance(irradiance::Options),
    /// Tables of the split sum's second factor and of sheen, as a texture or as source text (alias: dfg)
    #[command(alias = "dfg")]
    Lut(lut::Options),
    /// Environment to filtered map, chain of levels, or an engine's files
    Prefilter(Box<prefilter::Options>),
    /// Measured or analytic reflectance to a kilobyte of Gaussian lobes, with its error
    Fit(fit::Options),
    /// What a prefiltered file of any tool really holds, level by level, and how far off it is
    Verify(Box<verify::Options>),
    /// Mesh to self-shadowing and interreflection: ambient occlusion, visibility and transfer of light, per
    /// vertex, texel or given point
    Transfer(transfer::Options),
    /// Photographs of a height field from many views under many lights, by the path tracer: a bidirectional
    /// texture function, and the light positions and polynomial texture map of the view from above
    Capture(Box<capture::Options>),
    /// Incident light at many places of a scene, for objects that move through it
    Probes(Box<probes::Options>),
    /// A static web page of a scene that the browser shades (needs the feature `web`)
    ExportWeb(Box<export_web::Options>),
    /// A window onto a scene, with live techniques, lights and materials (needs the feature `view`)
    View(view::Options),
    /// Compare techniques with the reference: table, contact sheet, report
    Compare(compare::Options),
    /// Every technique on the same scenes: pictures, errors, bytes and times, and each claim of the survey's
    /// figure 11 tried
    Atlas(atlas::Options),
    /// What a file or a reflectance is: layout, range, energy, spectrum, advice
    Inspect(inspect::Options),
    /// Convert an environment from one layout, format, size or orientation to another
    Convert(Box<convert::Options>),
    /// Values of a map along given directions
    Sample(sample::Options),
    /// The techniques, and the works that they come from as BibTeX
    Techniques(techniques::Options),
}

impl Command {
    /// Runs the command.
    pub fn run(self, context: &mut Context) -> Outcome {
        self.check_backend(context.common.backend)?;
        match self {
            Self::Demo(o) => demo::run(o, context),
            Self::Compare(o) => compare::run(o, context),
            Self::Atlas(o) => atlas::run(o, context),
            Self::Render(o) => render::run(*o, context),
            Self::Bake(o) => bake::run(*o, context),
            Self::Eval(o) => eval::run(o, context),
            Self::Irradiance(o) => irradiance::run(o, context),
            Self::Fit(o) => fit::run(o, context),
            Self::Lut(o) => lut::run(o, context),
            Self::Prefilter(o) => prefilter::run(*o, context),
            Self::Verify(o) => verify::run(*o, context),
            Self::Inspect(o) => inspect::run(o, context),
            Self::Convert(o) => convert::run(*o, context),
            Self::Sample(o) => sample::run(o, context),
            Self::Techniques(o) => techniques::run(o, context),
            Self::ExportWeb(o) => export_web::run(*o, context),
            Self::View(o) => view::run(o, context),
            Self::Transfer(o) => transfer::run(o, context),
            Self::Probes(o) => probes::run(*o, context),
            Self::Capture(o) => capture::run(*o, context),
        }
    }

    /// Says which commands draw on a GPU, rather than computing elsewhere than asked.
    fn check_backend(&self, backend: Backend) -> Outcome {
        match (self, backend) {
            (_, Backend::Auto | Backend::Cpu)
            | (Self::Compare(_) | Self::Atlas(_), _)
            | (Self::Render(_), Backend::Gpu) => Ok(()),
            (Self::Render(_), Backend::Both) => {
                Err(Failure::usage("--backend both belongs to compare: render takes auto, cpu or gpu"))
            }
            _ => Err(Failure::usage("this command computes on the CPU: use --backend cpu or auto")),
        }
    }
}

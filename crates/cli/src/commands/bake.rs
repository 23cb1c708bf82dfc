//! `steradian bake`: a technique's precomputed data for a light, a reflectance and, where it bakes on one, a mesh.

mod halves;
mod maps;
mod output;
mod report;
mod stages;

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, Adjust, Method};
use crate::suns;
use clap::Args;
use output::Output;
use stages::Stages;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;
use steradian_base::Certificate;
use steradian_techniques::{AnyBake, AnyTechnique, Geometry, Made, Material, Sites, not_finite};

/// Options of `steradian bake`.
#[derive(Debug, Args)]
pub struct Options {
    /// Light: an image, or a sky spec such as sky:elevation=35
    #[arg(value_name = "ENV")]
    environment: String,
    #[command(flatten)]
    adjust: Adjust,
    /// Disk and directional lights beside the environment, as --extract-sun writes them; they become part of the data
    #[arg(long, value_name = "FILE.json")]
    sun_lights: Option<PathBuf>,
    /// BRDF spec, such as ggx:alpha=0.3
    #[arg(short, long, value_name = "SPEC")]
    brdf: String,
    /// Technique
    #[arg(short, long, value_name = "SLUG")]
    technique: String,
    /// Parameter of the technique
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = inputs::parameter)]
    params: Vec<(String, f64)>,
    /// Relative RMS error of radiance over normals and views asked for, such as 0.03; orders, resolutions and what is
    /// stored follow from it; a miss writes the marked output and exits 4
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive, conflicts_with = "energy_epsilon")]
    tolerance: Option<f64>,
    /// The same as an energy, epsilon of RH02's 5.16 to 5.18: the share of the reflectance's energy that orders may miss,
    /// in techniques that have a parameter of this name; in others the square of --tolerance
    #[arg(long, value_name = "E", allow_negative_numbers = true, value_parser = inputs::positive)]
    energy_epsilon: Option<f64>,
    /// Mesh file or shape, for techniques that bake per vertex
    #[arg(long, value_name = "FILE|SHAPE")]
    mesh: Option<String>,
    /// Store 16-bit floats in .safetensors where the error allows
    #[arg(long)]
    half: bool,
    /// Output: .safetensors holds everything (for --bake); .ktx2 the maps, as one array texture of halves; a folder
    /// holds both, a texture per table, with shader text and numbers
    #[arg(short, long, value_name = "FILE|DIR")]
    output: PathBuf,
}

/// A finished bake and how it came about.
struct Done {
    bake: Box<dyn AnyBake>,
    /// With what the file's numbers add.
    certificate: Certificate,
    made: Made,
    /// What was asked for.
    asked: Asked,
    seconds: f64,
    stages: Vec<(String, f64)>,
}

/// An explicit accuracy.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Asked {
    /// None.
    Nothing,
    /// A relative RMS error of radiance.
    Error(f64),
    /// A share of the reflectance's energy.
    Energy(f64),
}

/// The name of the parameter that bounds the energy which orders miss.
const EPSILON: &str = "energy_epsilon";
/// The detail of a certificate that says what they miss.
const MISSING: &str = "missing energy of the reflectance";

impl Asked {
    /// What the options ask of a technique.
    fn of(o: &Options, technique: &dyn AnyTechnique) -> Self {
        match (o.tolerance, o.energy_epsilon) {
            (Some(t), _) => Self::Error(t),
            (None, Some(e)) if technique.params().iter().any(|p| p.name == EPSILON) => Self::Energy(e),
            (None, Some(e)) => Self::Error(e.sqrt()),
            (None, None) => Self::Nothing,
        }
    }

    /// The relative RMS error of radiance.
    fn tolerance(self) -> Option<f64> {
        if let Self::Error(t) = self { Some(t) } else { None }
    }
}

impl Done {
    /// The explicit accuracy, and what was reached of it.
    fn outcome(&self) -> Option<(f64, f64)> {
        let details = &self.certificate.details;
        match self.asked {
            Asked::Nothing => None,
            Asked::Error(t) => Some((t, self.certificate.error)),
            Asked::Energy(e) => details.iter().find(|d| d.0 == MISSING).map(|d| (e, d.1)),
        }
    }

    /// Was it missed?
    fn missed(&self) -> bool {
        self.outcome().is_some_and(|(asked, reached)| reached.is_nan() || reached > asked)
    }
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let Method::Technique(technique) = Method::find(&o.technique)? else {
        return Err(Failure::usage("the reference bakes nothing: name a technique"));
    };
    let output = Output::of(&o.output)?;
    if o.half && matches!(output, Output::Texture(_)) {
        return Err(Failure::usage("--half is for .safetensors; textures hold halves already"));
    }
    let mut done = bake(&o, technique, context)?;
    let tensors = halves::tensors(&mut done, technique, &o, context)?;
    if let Some(name) = not_finite(&tensors) {
        let why = format!("{}: tensor '{name}' came out not finite: scale the light down", o.technique);
        return Err(Failure::failed(why));
    }
    let t = &done.certificate;
    context.note_error(format!("{} {:.3e} ({})", t.metric, t.error, t.known.word()));
    context.task.check()?;
    let start = Instant::now();
    let files = output.write(&done, tensors, context)?;
    report::say(&o, &done, &files, start.elapsed().as_secs_f64(), context)?;
    match done.outcome() {
        Some((asked, reached)) if done.missed() => Err(Failure::missed(format!(
            "tolerance {asked} missed: the error reached is {reached:.3e}; the output is marked"
        ))),
        _ => Ok(()),
    }
}

fn bake(o: &Options, technique: &'static dyn AnyTechnique, context: &mut Context) -> Result<Done, Failure> {
    let brdf = inputs::brdf(&o.brdf, context)?;
    let material = Material::new(brdf);
    let slug = technique.card().slug;
    (technique.card().materials)(&*material.brdf).map_err(|why| Failure::usage(format!("{slug}: {why}")))?;
    let asked = Asked::of(o, technique);
    let mut params = inputs::parameters(&o.params)?;
    if let Asked::Energy(e) = asked {
        params.0.insert(EPSILON.into(), e);
    }
    params.check(technique.params())?;
    let geometry = geometry(o, technique, context)?;
    let mut lights = inputs::light(&o.environment, &o.adjust, context)?;
    if let Some(path) = &o.sun_lights {
        suns::join_file(path, &mut lights, &o.adjust, context)?;
    }
    let stages = Arc::new(Stages::new(context));
    let task = context.task.clone().with_progress(stages.clone()).with_tolerance(asked.tolerance());
    let start = Instant::now();
    let bake = technique.bake(&lights, &material, geometry.as_ref(), &params, &task)?;
    Ok(Done {
        certificate: bake.certificate().clone(),
        bake,
        made: Made::of(
            &o.brdf,
            material.brdf.held(),
            &o.environment,
            o.adjust.rotate,
            o.adjust.light_exposure,
        ),
        asked,
        seconds: start.elapsed().as_secs_f64(),
        stages: stages.finish(),
    })
}

fn geometry(
    o: &Options,
    technique: &dyn AnyTechnique,
    context: &mut Context,
) -> Result<Option<Geometry>, Failure> {
    let card = technique.card();
    match (&o.mesh, card.needs.sites) {
        (None, false) => Ok(None),
        (None, true) => Err(Failure::usage(format!("{} bakes on a mesh: give --mesh", card.slug))),
        (Some(_), false) => Err(Failure::usage(format!("{} bakes no mesh: leave --mesh out", card.slug))),
        (Some(mesh), true) => {
            let mesh = Arc::new(inputs::mesh(mesh, context)?);
            Ok(Some(Geometry { mesh, sites: Sites::Vertices }))
        }
    }
}

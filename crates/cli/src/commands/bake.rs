//! `steradian bake`: a technique's precomputed data for a light, a reflectance and, where it bakes on one, a
//! mesh.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, AdjustArgs};
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;
use steradian_session::bake::{Accuracy, Output, Request};
use steradian_session::{Local, LocalRequest, Method};

/// Options of `steradian bake`.
#[derive(Debug, Args)]
pub struct Options {
    /// Light: an image, or a sky spec such as sky:elevation=35; required unless --local is given
    #[arg(value_name = "ENV", required_unless_present = "local")]
    environment: Option<String>,
    #[command(flatten)]
    adjust: AdjustArgs,
    /// Disk and directional lights beside the environment, as --extract-sun writes them; they become part of
    /// the data
    #[arg(long, value_name = "FILE.json")]
    sun_lights: Option<PathBuf>,
    /// BRDF spec, such as ggx:alpha=0.3
    #[arg(short, long, value_name = "SPEC")]
    brdf: String,
    /// Technique; required unless --local is given. `steradian techniques` lists them, `steradian inspect
    /// brdf:SPEC` those that take a reflectance
    #[arg(short, long, value_name = "SLUG", required_unless_present = "local")]
    technique: Option<String>,
    /// In place of both, a technique for directional and point lights, with its parameters; --local takes the
    /// file that is written (.safetensors), and opens no other one
    #[arg(long, value_name = "SLUG[:NAME=VALUE,…]", conflicts_with_all = ["environment", "technique", "params", "sun_lights", "energy_epsilon", "mesh", "half"])]
    local: Option<String>,
    /// Parameter of the technique
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = inputs::parameter)]
    params: Vec<inputs::Parameter>,
    /// Relative RMS error of radiance over normals and views asked for, such as 0.03; orders, resolutions and
    /// what is stored follow from it; a miss writes the marked output and exits 4
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive, conflicts_with = "energy_epsilon")]
    tolerance: Option<f64>,
    /// The same as an energy, epsilon of RH02's 5.16 to 5.18: the share of the reflectance's energy that
    /// orders may miss, in techniques that have a parameter of this name; in others the square of --tolerance
    #[arg(long, value_name = "E", allow_negative_numbers = true, value_parser = inputs::positive)]
    energy_epsilon: Option<f64>,
    /// Mesh file or shape, for techniques that bake per vertex
    #[arg(long, value_name = "FILE|SHAPE")]
    mesh: Option<String>,
    /// Transfer of the mesh's vertices, as `transfer` writes it, in place of rays
    #[arg(long, value_name = "FILE", requires = "mesh")]
    transfer: Option<PathBuf>,
    /// Store 16-bit floats in .safetensors where the error allows
    #[arg(long)]
    half: bool,
    /// Output: .safetensors holds everything (for --bake); .ktx2 the maps, as one array texture of halves; a
    /// folder holds both, a texture per table, with shader text and numbers
    #[arg(short, long, value_name = "FILE|DIR")]
    output: PathBuf,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    if let Some(spec) = &o.local {
        return local(&o, spec, context);
    }
    let (environment, technique) = (o.environment.clone().unwrap_or_default(), o.technique.as_deref());
    let Method::Technique(technique) = Method::find(technique.unwrap_or_default())? else {
        return Err(Failure::usage("the reference bakes nothing: name a technique"));
    };
    let output = output(&o, context)?;
    if o.half && matches!(output, Output::Texture(_)) {
        return Err(Failure::usage("--half is for .safetensors; textures hold halves already"));
    }
    let request = Request {
        environment,
        adjust: o.adjust.get(),
        sun_lights: o.sun_lights.clone(),
        brdf: o.brdf.clone(),
        technique,
        params: inputs::parameters(&o.params)?,
        accuracy: Accuracy::of(o.tolerance, o.energy_epsilon, technique),
        mesh: o.mesh.clone(),
        transfer: o.transfer.clone(),
        half: o.half,
    };
    let (done, missed) = context.bake(&request)?.even_if_missed();
    let start = Instant::now();
    let files = done.write(&output, context)?;
    let writing = start.elapsed().as_secs_f64();
    context.report(|| done.document(&files, writing, o.energy_epsilon), || done.lines(&files, writing))?;
    missed.map_or(Ok(()), |m| Err(Failure::missed(format!("{m}; the output is marked"))))
}

/// Where the bake goes, which is none of the inputs.
fn output(o: &Options, context: &mut Context) -> Result<Output, Failure> {
    let output = Output::of(&o.output)?;
    if !matches!(output, Output::Folder(_)) {
        context.writes(&o.output)?;
    }
    Ok(output)
}

/// A technique for directional and point lights.
fn local(o: &Options, spec: &str, context: &mut Context) -> Outcome {
    let Output::Tensors(path) = output(o, context)? else {
        let why = "--local writes .safetensors, which --local takes";
        return Err(Failure::usage(format!("{}: {why}", o.output.display())));
    };
    let Some(local) = Local::parse(spec)? else {
        return Err(Failure::usage("exact shading bakes nothing: name a technique"));
    };
    let request = LocalRequest { local, brdf: o.brdf.clone(), tolerance: o.tolerance };
    let (done, missed) = context.baked_local(&request)?.even_if_missed();
    let bytes = done.write(&path, context)?;
    let met = missed.is_none();
    context.report(|| done.document(bytes, o.tolerance, met), || done.lines(bytes))?;
    missed.map_or(Ok(()), |m| Err(Failure::missed(m.to_string())))
}

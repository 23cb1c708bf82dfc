//! `steradian fit`: measured or analytic reflectance to a kilobyte of Gaussian lobes, with its error.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs;
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;
use steradian_brdf::fit::gaussian::{MAX_LOBES, MAX_VIEWS, MIN_AZIMUTHS, Objective, Plan, Shape};
use steradian_session::Destinations;
use steradian_session::fit::{brdf_name, expand_brdfs, table};

/// Options of `steradian fit`.
#[derive(Debug, Args)]
pub struct Options {
    /// Files of measurements (.binary, .bsdf), folders or patterns with * of them, specs such as
    /// ggx:alpha=0.2, or all materials of a table: npf:FILE,* nbrdf:FILE,* sgd:* abc:*
    #[arg(value_name = "INPUT", required = true, num_args = 1..)]
    input: Vec<String>,
    /// Gaussians of every view
    #[arg(long, value_name = "K", default_value_t = 3, value_parser = clap::value_parser!(u8).range(1..=MAX_LOBES as i64))]
    lobes: u8,
    /// Elevations of the view, equally spaced from 0 to 89 degrees
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u8).range(2..=64))]
    views: u8,
    /// Azimuths of the view, once around, where reflectance is anisotropic
    #[arg(long, value_name = "M", default_value_t = 24, value_parser = clap::value_parser!(u8).range(MIN_AZIMUTHS as i64..=64))]
    azimuths: u8,
    #[arg(long, value_name = "ERROR", conflicts_with_all = ["lobes", "views"], allow_negative_numbers = true, value_parser = inputs::positive, help = format!("Error to be met, relative to f cos of the view, at every elevation and midway: as few lobes and elevations as it takes, up to {MAX_LOBES} and {MAX_VIEWS}; a miss writes the nearest and exits 4"))]
    tolerance: Option<f64>,
    /// What is least: the squared error with every view's albedo kept, or without that condition (the
    /// paper's)
    #[arg(long, value_name = "energy|published", default_value = "energy", value_parser = objective)]
    objective: Objective,
    /// What lobes may be: each swept along the plane of incidence by its own angle, or round (the paper's);
    /// those of anisotropic reflectance are swept along any direction
    #[arg(long, value_name = "stretched|round", default_value = "stretched", value_parser = shape)]
    shape: Shape,
    /// Folder of a web page for each fit, and index.html of several: pictures of every view beside what is
    /// fitted, errors, parameters, spheres under light beside the reference
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
    /// Lights of the pages' spheres: files or skies [default: studio and sky]
    #[arg(long, value_name = "FILE|SKY", requires = "report")]
    environment: Vec<String>,
    /// Output: .safetensors; {} in its name stands for the material's
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
}

fn objective(text: &str) -> Result<Objective, String> {
    match text {
        "energy" => Ok(Objective::Energy),
        "published" => Ok(Objective::Published),
        _ => Err(steradian_base::unknown("objective", text, &["energy", "published"])),
    }
}

fn shape(text: &str) -> Result<Shape, String> {
    match text {
        "stretched" => Ok(Shape::Stretched),
        "round" => Ok(Shape::Round),
        _ => Err(steradian_base::unknown("shape", text, &["stretched", "round"])),
    }
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    if o.output.is_dir() || o.output.as_os_str().to_string_lossy().ends_with('/') {
        let why = "is a folder: name files in it, such as {}.safetensors, where {} stands for the material";
        return Err(Failure::usage(format!("{}: {why}", o.output.display())));
    }
    context.check_output(&o.output, &["safetensors"])?;
    let mut specs = Vec::new();
    for input in &o.input {
        specs.extend(expand_brdfs(input)?);
    }
    let jobs = jobs(&o, specs)?;
    jobs.iter().try_for_each(|(_, output)| context.writes(output))?;
    let plan = Plan {
        lobes: o.lobes.into(),
        views: o.views.into(),
        objective: o.objective,
        shape: o.shape,
        azimuths: o.azimuths.into(),
    };
    let done = context.fit(jobs, plan, o.tolerance)?;
    if let Some(folder) = &o.report {
        let usual = || vec!["studio".to_string(), "sky".to_string()];
        let lights = if o.environment.is_empty() { usual() } else { o.environment.clone() };
        context.fit_pages(&done, plan, &lights, folder)?;
    }
    if context.common.json {
        let fits: Vec<Value> = done.iter().map(|f| f.document(o.tolerance)).collect();
        context.print_json(json!({ "fits": fits }))?;
    } else {
        context.print_words(&table(&done))?;
    }
    let missed = o.tolerance.and_then(|t| done.iter().find_map(|f| f.missed(t)));
    missed.map_or(Ok(()), |why| Err(Failure::missed(why)))
}

/// Each spec with its output.
fn jobs(o: &Options, specs: Vec<String>) -> Result<Vec<(String, PathBuf)>, Failure> {
    let file = o.output.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    if specs.len() > 1 && !file.contains("{}") {
        let why = "several inputs need a {} in the output's name, such as {}.safetensors";
        return Err(Failure::usage(format!("{}: {why}", o.output.display())));
    }
    let mut places = Destinations::default();
    if let Some(folder) = &o.report {
        places.folder(folder, false)?;
    }
    let mut out = Vec::with_capacity(specs.len());
    for spec in specs {
        let output = o.output.with_file_name(file.replacen("{}", &brdf_name(&spec), 1));
        places.file("--output", &output)?;
        out.push((spec, output));
    }
    Ok(out)
}

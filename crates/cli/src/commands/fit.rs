//! `steradian fit`: measured or analytic reflectance to a kilobyte of Gaussian lobes, with its error.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs;
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;
use steradian_brdf::fit::gaussian::{MAX_LOBES, MIN_AZIMUTHS, Objective, Plan, Shape, SliceReport};
use steradian_session::fit::{Fitted, Summary, brdf_name, expand_brdfs};
use steradian_session::{Destinations, check_output};

/// Options of `steradian fit`.
#[derive(Debug, Args)]
pub struct Options {
    /// Files of measurements (.binary, .bsdf), folders or patterns with * of them, specs such as ggx:alpha=0.2, or all
    /// materials of a table: npf:FILE,* nbrdf:FILE,* sgd:* abc:*
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
    /// Error to be met, relative to f cos of the view, at every elevation and midway: as few lobes and elevations as it
    /// takes, up to 4 and 30; a miss writes the nearest and exits 4
    #[arg(long, value_name = "ERROR", conflicts_with_all = ["lobes", "views"], allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// What is least: the squared error with every view's albedo kept, or without that condition (the paper's)
    #[arg(long, value_name = "energy|published", default_value = "energy", value_parser = objective)]
    objective: Objective,
    /// What lobes may be: each swept along the plane of incidence by its own angle, or round (the paper's); those of
    /// anisotropic reflectance are swept along any direction
    #[arg(long, value_name = "stretched|round", default_value = "stretched", value_parser = shape)]
    shape: Shape,
    /// Folder of a web page for each fit, and index.html of several: pictures of every view beside what is fitted, errors, parameters, spheres under
    /// light beside the reference
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
    check_output(&o.output, &["safetensors"])?;
    let mut specs = Vec::new();
    for input in &o.input {
        specs.extend(expand_brdfs(input)?);
    }
    let jobs = jobs(&o, specs)?;
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
        let fits: Vec<Value> = done.iter().map(|f| document(f, o.tolerance)).collect();
        context.print_json(json!({ "fits": fits }))?;
    } else {
        context.print(&table(&done))?;
    }
    let asked = o.tolerance.unwrap_or(f64::INFINITY);
    match done.iter().filter_map(|f| Some((f, f.reached?))).find(|(_, e)| *e > asked) {
        Some((f, e)) => Err(Failure::missed(format!(
            "{}: the error is {e:.2e}, asked {asked:.2e}: no fit of 4 lobes and 30 views is nearer; the nearest is written",
            f.name
        ))),
        None => Ok(()),
    }
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

fn document(f: &Fitted, tolerance: Option<f64>) -> Value {
    let view = |r: &SliceReport| {
        json!({
            "degrees": r.theta.to_degrees(), "azimuth": r.phi.to_degrees(), "energy": r.energy, "norm": r.norm(), "of_whole": r.of_whole,
            "log": r.log, "cube_root": r.cube_root,
            "albedo": r.albedo, "below_horizon": r.leak, "converged": r.converged,
        })
    };
    json!({
        "name": f.name,
        "output": f.output.file_name().map(|n| n.to_string_lossy()),
        "bytes": f.fit.bytes(),
        "lobes": f.fit.lobes(),
        "tolerance": tolerance,
        "error": f.reached,
        "tolerance_met": f.reached.zip(tolerance).map(|(e, t)| e <= t),
        "seconds": f.seconds,
        "diffuse": f.fit.diffuse,
        "views": f.fit.report.iter().map(view).collect::<Vec<_>>(),
    })
}

fn table(done: &[Fitted]) -> String {
    let width = done.iter().map(|f| f.name.len()).max().unwrap_or(0).max(8);
    let mut out = format!(
        "{:width$}  {:>7}  {:>6}  {:>7}  {:>12}  {:>16}  {:>7}  {:>9}  {:>11}\n",
        "material",
        "lobes",
        "bytes",
        "seconds",
        "mean to 60°",
        "worst view",
        "log",
        "cube root",
        "unconverged"
    );
    for f in done {
        let Summary { mean, worst, degrees, unconverged } = f.summary();
        let worst = format!("{:.2} % at {degrees:.0}°", 100.0 * worst);
        out += &format!(
            "{:width$}  {:>7}  {:>6}  {:>7.3}  {:>10.3} %  {worst:>16}  {:>5.2} %  {:>7.2} %  {unconverged:>11}\n",
            f.name,
            lobes(f),
            f.fit.bytes(),
            f.seconds,
            100.0 * mean,
            100.0 * over_views(f, |r| r.log),
            100.0 * over_views(f, |r| r.cube_root),
        );
    }
    out + "lobes: views (by elevation, and azimuth where reflectance is anisotropic) x lobes of each. Errors of the specular part: squared, relative to its square at the view; log and cube root: norms \
           for ln(1 + f cos) and the cube root of f cos, relative, in the mean over views\n"
}

/// Elevations, azimuths where reflectance is anisotropic, lobes.
fn lobes(f: &Fitted) -> String {
    let (n, m, k) = (f.fit.elevations(), f.fit.azimuths, f.fit.lobes());
    if f.fit.is_isotropic() { format!("{n} x {k}") } else { format!("{n} x {m} x {k}") }
}

/// The mean of a figure over the views.
fn over_views(f: &Fitted, of: impl Fn(&SliceReport) -> f64) -> f64 {
    f.fit.report.iter().map(of).sum::<f64>() / f.fit.report.len().max(1) as f64
}

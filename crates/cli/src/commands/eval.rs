//! `steradian eval`: CSV of points in, CSV of radiance out.

mod room;

use crate::context::Context;
use crate::csv;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, Adjust, Method};
use crate::suns::Beside;
use clap::{Args, ValueEnum};
use glam::DVec3;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;
use steradian_brdf::SharedBrdf;
use steradian_formats::CsvTable;
use steradian_light::Lights;
use steradian_reference::{Judge, JudgePoint, Lookup};
use steradian_sphere::Frame;

/// Tolerance of the reference where none is asked for.
const REFERENCE_TOLERANCE: f64 = 1e-4;

/// Options of `steradian eval`.
#[derive(Debug, Args)]
pub struct Options {
    /// Light: an image, or a sky spec such as sky:elevation=35; may be left out beside --light, --sun-lights and --bake
    #[arg(short, long, value_name = "FILE|SKY", required_unless_present_any = ["light", "sun_lights", "bake"])]
    environment: Option<String>,
    #[command(flatten)]
    adjust: Adjust,
    #[command(flatten)]
    beside: Beside,
    /// BRDF spec, such as ggx:alpha=0.1
    #[arg(short, long, value_name = "SPEC", required_unless_present = "bake")]
    brdf: Option<String>,
    /// A saved bake (.safetensors, or the folder of one) in place of light, BRDF and technique; --rotate turns its light
    #[arg(long, value_name = "FILE", conflicts_with_all = ["environment", "sun_lights", "light", "suns", "brdf", "technique", "params", "mesh"])]
    bake: Option<PathBuf>,
    /// CSV with columns nx,ny,nz,vx,vy,vz and optionally tx,ty,tz and px,py,pz; - is standard input
    #[arg(short, long, value_name = "FILE.csv")]
    points: PathBuf,
    /// Technique, or reference [default: reference]
    #[arg(short, long, value_name = "SLUG")]
    technique: Option<String>,
    /// Parameter of the technique
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = inputs::parameter)]
    params: Vec<(String, f64)>,
    /// Relative error asked for: of each point by the reference [default: 1e-4], in the RMS over normals and views by a
    /// technique; a miss exits 4
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// How the reference reads texels [default: constant]
    #[arg(long, value_enum)]
    lookup: Option<Reading>,
    /// Mesh for techniques that bake transfer
    #[arg(long, value_name = "FILE|SHAPE")]
    mesh: Option<String>,
    /// Output CSV [default: standard output]
    #[arg(short, long, value_name = "OUT.csv")]
    output: Option<PathBuf>,
}

/// How the reference reads texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Reading {
    /// Each texel's value over its exact cell.
    Constant,
    /// Interpolated between texel centres.
    Bilinear,
}

/// The points of the table.
struct Request {
    n: Vec<DVec3>,
    wo: Vec<DVec3>,
    t: Vec<DVec3>,
    p: Option<Vec<DVec3>>,
}

/// Radiance and relative error of one point.
type Answer = ([f64; 3], f64);

/// All points, and the error that a tolerance speaks of.
struct Answers {
    rows: Vec<Answer>,
    /// The largest of the points for the reference, the RMS over normals and views for a technique.
    error: f64,
    /// What a technique certifies.
    certificate: Option<Value>,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let method = method(&o, context)?;
    if o.lookup.is_some() && !matches!(method, Method::Reference) {
        return Err(Failure::usage(
            "--lookup belongs to --technique reference; techniques fix their own lookup",
        ));
    }
    let brdf = o.brdf.as_deref().map(|spec| inputs::brdf(spec, context)).transpose()?;
    let lights = lights(&o, context)?;
    let table = csv::read(&o.points, &context.limits())?;
    context.note_input(&o.points);
    let request = request(&table)?;
    if request.p.is_none() && !lights.points.is_empty() {
        let why = "point lights need the columns px,py,pz";
        return Err(Failure::input(format!("{}: {why}", o.points.display())));
    }
    let answers = match (method, brdf) {
        (Method::File(file), _) => room::saved(&file, &request)?,
        (Method::Technique(t), Some(brdf)) => room::baked(t, &o, &brdf, &lights, &request, context)?,
        (_, Some(brdf)) => reference(&o, &brdf, &lights, &request, context)?,
        (_, None) => return Err(Failure::usage("--brdf is missing")),
    };
    write(&o, table, &answers, context)?;
    match o.tolerance {
        Some(t) if answers.error > t => Err(Failure::missed(format!(
            "tolerance {t} missed: the error reached is {:.3e} ({})",
            answers.error,
            if answers.certificate.is_some() { "RMS over normals and views" } else { "column err" }
        ))),
        _ => Ok(()),
    }
}

fn method(o: &Options, context: &mut Context) -> Result<Method, Failure> {
    match &o.bake {
        Some(path) => Ok(Method::File(Arc::new(crate::saved::read(path, &o.adjust, context)?))),
        None => Method::find(o.technique.as_deref().unwrap_or("reference")),
    }
}

fn lights(o: &Options, context: &mut Context) -> Result<Lights, Failure> {
    let mut lights = match &o.environment {
        Some(spec) => inputs::light(spec, &o.adjust, context)?,
        None => Lights::default(),
    };
    o.beside.join(&mut lights, &o.adjust, context)?;
    Ok(lights)
}

fn request(table: &CsvTable) -> Result<Request, Failure> {
    let n = csv::unit(table, ["nx", "ny", "nz"])?;
    let wo = csv::unit(table, ["vx", "vy", "vz"])?;
    let t = match csv::optional_unit(table, ["tx", "ty", "tz"])? {
        Some(t) => n.iter().zip(t).map(|(n, t)| Frame::from_normal_tangent(*n, t).t).collect(),
        None => n.iter().map(|n| Frame::from_normal(*n).t).collect(),
    };
    Ok(Request { n, wo, t, p: csv::optional(table, ["px", "py", "pz"])? })
}

fn reference(
    o: &Options,
    brdf: &SharedBrdf,
    lights: &Lights,
    q: &Request,
    context: &Context,
) -> Result<Answers, Failure> {
    if !o.params.is_empty() {
        return Err(Failure::usage("the reference takes no --param"));
    }
    let lookup = match o.lookup {
        Some(Reading::Bilinear) => Lookup::Bilinear,
        Some(Reading::Constant) | None => Lookup::Constant,
    };
    let judge = Judge::new(lights, lookup, &context.task)?;
    let points: Vec<JudgePoint> = (0..q.n.len())
        .map(|i| JudgePoint {
            frame: Frame { n: q.n[i], t: q.t[i], b: q.n[i].cross(q.t[i]) },
            wo: q.wo[i],
            position: q.p.as_ref().map(|p| p[i]),
        })
        .collect();
    let tolerance = o.tolerance.unwrap_or(REFERENCE_TOLERANCE);
    let estimates = judge.radiance_batch(&**brdf, &points, tolerance, &context.task)?;
    let rows: Vec<Answer> = estimates.into_iter().map(|e| (e.rgb, e.error)).collect();
    let error = rows.iter().map(|a| a.1).fold(0.0, f64::max);
    Ok(Answers { rows, error, certificate: None })
}

fn write(o: &Options, mut table: CsvTable, answers: &Answers, context: &mut Context) -> Outcome {
    let rows = &answers.rows;
    // The last guard: light and reflectance are finite when they are read.
    if let Some(k) = rows.iter().position(|(rgb, err)| err.is_nan() || !rgb.iter().all(|x| x.is_finite())) {
        let name = o.points.display();
        let why = format!("{name}: the radiance of point {} is not finite: scale the light down", k + 1);
        return Err(Failure::failed(why));
    }
    let worst = rows.iter().map(|a| a.1).fold(0.0, f64::max);
    context.note_error(format!("relative error at most {worst:.3e}"));
    if context.common.json && o.output.is_none() {
        let points: Vec<_> = rows.iter().map(|(rgb, err)| json!({"rgb": rgb, "err": err})).collect();
        let certificate = &answers.certificate;
        return context.print_json(json!({"points": points, "max_err": worst, "certificate": certificate}));
    }
    for (c, name) in ["r", "g", "b"].into_iter().enumerate() {
        table.set_column(name, rows.iter().map(|a| a.0[c]));
    }
    table.set_column("err", rows.iter().map(|a| a.1));
    context.write_text(o.output.as_deref(), &csv::text(&table))?;
    if context.common.json {
        let certificate = &answers.certificate;
        return context
            .print_json(json!({"points": rows.len(), "max_err": worst, "certificate": certificate}));
    }
    Ok(())
}

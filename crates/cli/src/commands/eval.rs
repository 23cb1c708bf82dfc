//! `steradian eval`: CSV of points in, CSV of radiance out.

use crate::context::Context;
use crate::csv;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, Adjust, Method};
use crate::suns::Beside;
use clap::{Args, ValueEnum};
use glam::DVec3;
use serde_json::json;
use std::path::PathBuf;
use std::sync::Arc;
use steradian_brdf::SharedBrdf;
use steradian_formats::CsvTable;
use steradian_light::Lights;
use steradian_reference::{Judge, JudgePoint, Lookup};
use steradian_sphere::Frame;
use steradian_techniques::direct::split;
use steradian_techniques::{Geometry, Material, PointsBuf, Radiance, Sites};

/// Tolerance of the reference where none is asked for.
const REFERENCE_TOLERANCE: f64 = 1e-4;

/// Options of `steradian eval`.
#[derive(Debug, Args)]
pub struct Options {
    /// Light: an image, or a sky spec such as sky:elevation=35; may be left out beside --light and --sun-lights
    #[arg(short, long, value_name = "FILE|SKY", required_unless_present_any = ["light", "sun_lights"])]
    environment: Option<String>,
    #[command(flatten)]
    adjust: Adjust,
    #[command(flatten)]
    beside: Beside,
    /// BRDF spec, such as ggx:alpha=0.1
    #[arg(short, long, value_name = "SPEC")]
    brdf: String,
    /// CSV with columns nx,ny,nz,vx,vy,vz and optionally tx,ty,tz and px,py,pz; - is standard input
    #[arg(short, long, value_name = "FILE.csv")]
    points: PathBuf,
    /// Technique, or reference
    #[arg(short, long, value_name = "SLUG", default_value = "reference")]
    technique: String,
    /// Parameter of the technique
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = inputs::parameter)]
    params: Vec<(String, f64)>,
    /// Relative error asked for: of each point by the reference [default: 1e-4], in the RMS over normals and views by a
    /// technique; a miss exits 4
    #[arg(long, value_name = "T", value_parser = inputs::positive)]
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

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let brdf = inputs::brdf(&o.brdf, context)?;
    let method = Method::find(&o.technique)?;
    if o.lookup.is_some() && !matches!(method, Method::Reference) {
        return Err(Failure::usage(
            "--lookup belongs to --technique reference; techniques fix their own lookup",
        ));
    }
    let mut lights = match &o.environment {
        Some(spec) => inputs::light(spec, &o.adjust, context)?,
        None => Lights::default(),
    };
    o.beside.join(&mut lights, &o.adjust, context)?;
    context.note_input(&o.points);
    let table = csv::read(&o.points, &context.limits())?;
    let request = request(&table)?;
    if request.p.is_none() && !lights.points.is_empty() {
        let why = "point lights need the columns px,py,pz";
        return Err(Failure::input(format!("{}: {why}", o.points.display())));
    }
    let answers = match method {
        Method::Reference => reference(&o, &brdf, &lights, &request, context)?,
        Method::Technique(t) => technique(t, &o, &brdf, &lights, &request, context)?,
    };
    write(&o, table, &answers, context)?;
    let worst = answers.iter().map(|a| a.1).fold(0.0, f64::max);
    match o.tolerance {
        Some(t) if worst > t => Err(Failure::missed(format!(
            "tolerance {t} missed: the error reached is {worst:.3e} (column err)"
        ))),
        _ => Ok(()),
    }
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
) -> Result<Vec<Answer>, Failure> {
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
    Ok(estimates.into_iter().map(|e| (e.rgb, e.error)).collect())
}

fn technique(
    technique: &'static dyn steradian_techniques::AnyTechnique,
    o: &Options,
    brdf: &SharedBrdf,
    lights: &Lights,
    q: &Request,
    context: &mut Context,
) -> Result<Vec<Answer>, Failure> {
    let geometry = geometry(o, technique, q, context)?;
    let task = context.task.clone().with_tolerance(o.tolerance);
    let params = inputs::parameters(&o.params);
    let (baked, direct) = split(lights, o.beside.suns());
    let bake = technique.bake(&baked, &Material::new(brdf.clone()), geometry.as_ref(), &params, &task)?;
    let mut buf = PointsBuf::with_capacity(q.n.len());
    for i in 0..q.n.len() {
        let p = q.p.as_ref().map_or(DVec3::ZERO, |p| p[i]);
        buf.push(q.n[i].as_vec3(), q.t[i].as_vec3(), q.wo[i].as_vec3(), p.as_vec3());
    }
    let sites: Vec<u32> = (0..q.n.len() as u32).collect();
    let weights = vec![0.0f32; q.n.len()];
    let mut points = buf.as_points();
    if geometry.is_some() {
        points.site.index = [&sites, &sites, &sites];
        points.site.weight = [&weights, &weights];
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.n.len()]);
    bake.shade(&points, &mut Radiance::of(&mut rgb));
    direct.add(&**brdf, &points, &mut Radiance::of(&mut rgb));
    let error = bake.certificate().error;
    Ok((0..q.n.len()).map(|i| (std::array::from_fn(|c| csv::shortest(rgb[c][i])), error)).collect())
}

fn geometry(
    o: &Options,
    technique: &dyn steradian_techniques::AnyTechnique,
    q: &Request,
    context: &mut Context,
) -> Result<Option<Geometry>, Failure> {
    let needs = technique.card().needs.sites;
    let Some(mesh) = &o.mesh else {
        if needs {
            let slug = technique.card().slug;
            return Err(Failure::usage(format!("{slug} bakes on a mesh: give --mesh")));
        }
        return Ok(None);
    };
    let mesh = inputs::mesh(mesh, context)?;
    if !needs {
        return Ok(None);
    }
    let Some(p) = &q.p else {
        return Err(Failure::input(format!("{}: needs columns px,py,pz with --mesh", o.points.display())));
    };
    let sites = Sites::Points {
        p: p.iter().map(|v| v.as_vec3()).collect(),
        n: q.n.iter().map(|v| v.as_vec3()).collect(),
    };
    Ok(Some(Geometry { mesh: Arc::new(mesh), sites }))
}

fn write(o: &Options, mut table: CsvTable, answers: &[Answer], context: &mut Context) -> Outcome {
    let worst = answers.iter().map(|a| a.1).fold(0.0, f64::max);
    context.note_error(format!("relative error at most {worst:.3e}"));
    if context.common.json && o.output.is_none() {
        let rows: Vec<_> = answers.iter().map(|(rgb, err)| json!({"rgb": rgb, "err": err})).collect();
        return context.print_json(json!({"points": rows, "max_err": worst}));
    }
    for (c, name) in ["r", "g", "b"].into_iter().enumerate() {
        table.set_column(name, answers.iter().map(|a| a.0[c]));
    }
    table.set_column("err", answers.iter().map(|a| a.1));
    context.write_text(o.output.as_deref(), &csv::text(&table))?;
    if context.common.json {
        return context.print_json(json!({"points": answers.len(), "max_err": worst}));
    }
    Ok(())
}

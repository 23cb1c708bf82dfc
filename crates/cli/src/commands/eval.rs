//! `steradian eval`: CSV of points in, CSV of radiance out.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, AdjustArgs, ExtraLights, LocalArg, PathArgs, ShadowArg};
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::sync::Arc;
use steradian_formats::CsvTable;
use steradian_light::Lights;
use steradian_reference::Lookup;
use steradian_session::eval::{Answers, Points, Request};
use steradian_session::{Method, Shadows};

/// Options of `steradian eval`.
#[derive(Debug, Args)]
pub struct Options {
    /// Light: an image, or a sky spec such as sky:elevation=35; may be left out beside --light, --sun-lights
    /// and --bake
    #[arg(short, long, value_name = "FILE|SKY", required_unless_present_any = ["light", "sun_lights", "bake", "probes"])]
    environment: Option<String>,
    #[command(flatten)]
    adjust: AdjustArgs,
    #[command(flatten)]
    lights: ExtraLights,
    #[command(flatten)]
    local: LocalArg,
    /// BRDF spec, such as ggx:alpha=0.1
    #[arg(short, long, value_name = "SPEC", required_unless_present = "bake")]
    brdf: Option<String>,
    /// A saved bake (.safetensors, or the folder of one) in place of light, BRDF and technique; --rotate
    /// turns its light
    #[arg(long, value_name = "FILE", conflicts_with_all = ["environment", "sun_lights", "light", "suns", "local", "brdf", "technique", "params", "mesh"])]
    bake: Option<PathBuf>,
    /// Light that varies over space, as `probes` writes it, in place of every other; needs px,py,pz
    #[arg(long, value_name = "FILE", conflicts_with_all = ["environment", "sun_lights", "light", "suns", "local", "bake"])]
    probes: Option<PathBuf>,
    /// CSV with columns nx,ny,nz,vx,vy,vz and optionally tx,ty,tz, px,py,pz and u,v; - is standard input
    #[arg(short, long, value_name = "FILE.csv")]
    points: PathBuf,
    /// Technique, or reference [default: reference]
    #[arg(short, long, value_name = "SLUG")]
    technique: Option<String>,
    /// Parameter of the technique
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = inputs::parameter)]
    params: Vec<inputs::Parameter>,
    /// Relative error asked for: of each point by the reference [default: 1e-4], in the RMS over normals and
    /// views by a technique; a miss exits 4
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// How the reference reads texels [default: constant]
    #[arg(long, value_enum)]
    lookup: Option<Reading>,
    #[command(flatten)]
    paths: PathArgs,
    /// Mesh for path and for techniques that bake transfer
    #[arg(long, value_name = "FILE|SHAPE")]
    mesh: Option<String>,
    /// Transfer of the mesh at these points, as `transfer --points` writes it, in place of rays
    #[arg(long, value_name = "FILE", requires = "mesh", requires = "technique")]
    transfer: Option<PathBuf>,
    #[command(flatten)]
    shadows: ShadowArg,
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

impl Reading {
    fn lookup(self) -> Lookup {
        match self {
            Self::Constant => Lookup::Constant,
            Self::Bilinear => Lookup::Bilinear,
        }
    }
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    inputs::check_text(o.output.as_deref(), context)?;
    context.suns = o.lights.suns();
    let mut request = request(&o, context)?;
    let table = context.read_table(&o.points)?;
    let points = Points::of_table(&table)?;
    let name = o.points.display();
    if points.p.is_none() && !request.lights.points.is_empty() {
        return Err(Failure::input(format!("{name}: point lights need the columns px,py,pz")));
    }
    let lacks = ["u", "v", "tx", "ty", "tz"].into_iter().find(|c| table.column(c).is_none());
    if let (Some(column), true) = (lacks, request.is_textured()) {
        let why = format!("data per texel need the columns u,v and tx,ty,tz: there is no {column}");
        return Err(Failure::input(format!("{name}: {why}")));
    }
    if let Some(path) = &o.transfer {
        request.transfer = Some(context.transfer_at(path, &request, &points)?);
    }
    let (answers, missed) = context.eval(&request, &points)?.even_if_missed();
    write(&o, table, &answers, context)?;
    let of = if answers.certificate.is_some() { "RMS over normals and views" } else { "column err" };
    missed.map_or(Ok(()), |m| Err(Failure::missed(format!("{m} ({of})"))))
}

fn request(o: &Options, context: &mut Context) -> Result<Request, Failure> {
    let adjust = o.adjust.get();
    let method = match &o.bake {
        Some(path) => Method::File(Arc::new(context.saved_bake(path, &adjust)?)),
        None => Method::find(o.technique.as_deref().unwrap_or("reference"))?,
    };
    context.paths = o.paths.get(matches!(method, Method::Path))?;
    context.shadows = o.shadows.shadows.unwrap_or_default();
    let why = match context.shadows {
        Shadows::Auto | Shadows::Off => None,
        _ if matches!(method, Method::Reference) => {
            Some("the reference has no shadows: --technique path has")
        }
        Shadows::Lobe => Some("lobe belongs to pictures: give ray, map or volume"),
        _ if o.mesh.is_none() => Some("what stands in the way is missing: give --mesh"),
        _ => None,
    };
    if let Some(why) = why {
        return Err(Failure::usage(format!("--shadows: {why}")));
    }
    if o.lookup.is_some() && !matches!(method, Method::Reference) {
        return Err(Failure::usage(
            "--lookup belongs to --technique reference; techniques fix their own lookup",
        ));
    }
    // Of no part in shading by a saved bake.
    let brdf = context.brdf(o.brdf.as_deref().unwrap_or("lambert"))?;
    let mut lights = match &o.environment {
        Some(spec) => context.light(spec, &adjust)?,
        None => Lights::default(),
    };
    o.lights.join(&mut lights, &adjust, context)?;
    let mesh = o.mesh.as_ref().map(|m| context.mesh(m)).transpose()?.map(Arc::new);
    let request = Request {
        params: inputs::parameters(&o.params)?,
        local: o.local.open(context)?.flatten(),
        tolerance: o.tolerance,
        lookup: o.lookup.map(Reading::lookup),
        probes: o.probes.as_ref().map(|p| context.probes(p)).transpose()?.map(Arc::new),
        mesh,
        ..Request::new(lights, brdf, method)
    };
    Ok(Request { planes: context.planes(&request)?, ..request })
}

fn write(o: &Options, mut table: CsvTable, answers: &Answers, context: &mut Context) -> Outcome {
    // The last guard: light and reflectance are finite when they are read.
    if let Some(k) = answers.not_finite() {
        let (name, k) = (o.points.display(), k + 1);
        return Err(match &o.bake {
            Some(bake) => Failure::input(format!(
                "{}: gives point {k} of {name} a radiance that is not finite: bake it again",
                bake.display()
            )),
            None => Failure::failed(format!(
                "{name}: the radiance of point {k} is not finite: scale the light down"
            )),
        });
    }
    if context.common.json && o.output.is_none() {
        return context.print_json(answers.document(true));
    }
    answers.add_columns(&mut table);
    context.write_text(o.output.as_deref(), &table.text())?;
    if context.common.json { context.print_json(answers.document(false)) } else { Ok(()) }
}

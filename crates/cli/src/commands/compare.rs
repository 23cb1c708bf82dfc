//! `steradian compare`: techniques side by side against the reference.

use crate::commands::render::{size, tone_mapper};
use crate::context::{self, Context};
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, AdjustArgs, LocalArg, PathArgs, ShadowArg};
use clap::Args;
use std::path::PathBuf;
use steradian_light::Lamp;
use steradian_render::ToneMapper;
use steradian_session::compare::Plan;
use steradian_session::comparison::{
    Finding, Request, Sweep, csv, document, drawing, html, latex, sheet, short, table,
};
use steradian_session::{Destinations, Renderer};

/// Options of `steradian compare`.
#[derive(Debug, Args)]
pub struct Options {
    /// Mesh file, built-in shape, or scene file (.toml), in which a technique shades the materials that it
    /// takes and the reference the others
    #[arg(value_name = "MESH|SHAPE|SCENE", default_value = "sphere")]
    mesh: String,
    /// Light: image or sky spec; may be given several times [default: sky, or the scene file's]
    #[arg(short, long, value_name = "FILE|SKY")]
    environment: Vec<String>,
    #[command(flatten)]
    adjust: AdjustArgs,
    /// A light beside the environment: directional:direction=X/Y/Z,irradiance=R/G/B,
    /// point:position=X/Y/Z,intensity=R/G/B or disk:direction=X/Y/Z,angular-radius=DEGREES,irradiance=R/G/B;
    /// may be given several times. Without --environment there is no other light
    #[arg(long, value_name = "SPEC", value_parser = Lamp::parse)]
    light: Vec<Lamp>,
    #[command(flatten)]
    local: LocalArg,
    /// BRDF spec; may be given several times [default: the mesh file's materials, else lambert:albedo=0.6 and
    /// ggx:alpha=0.2]
    #[arg(short, long, value_name = "SPEC")]
    brdf: Vec<String>,
    /// Technique; may be given several times [default: all that take the material; beside --bake none]
    #[arg(short, long, value_name = "SLUG")]
    technique: Vec<String>,
    /// Parameter of the techniques that have it
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = inputs::parameter)]
    params: Vec<inputs::Parameter>,
    /// Transfer of the mesh's vertices, as `transfer` writes it, in place of rays for the techniques that
    /// take it
    #[arg(long, value_name = "FILE")]
    transfer: Option<PathBuf>,
    /// A saved bake (.safetensors, or the folder of one) of the light and the reflectance; may be given
    /// several times
    #[arg(long, value_name = "FILE")]
    bake: Vec<PathBuf>,
    /// Contact sheet
    #[arg(short, long, value_name = "OUT.png")]
    output: Option<PathBuf>,
    /// Report as one web page: table, pictures, maps of the differences
    #[arg(long, value_name = "OUT.html")]
    html: Option<PathBuf>,
    /// The table as .csv, or as .tex (LaTeX, booktabs)
    #[arg(long, value_name = "OUT.csv|OUT.tex")]
    table: Option<PathBuf>,
    /// Varies a parameter of --brdf, as brdf:alpha=0.05..0.5:8 (8 values by equal steps, with :log at the end
    /// by equal factors), or of the techniques that have it, as param:NAME=A..B:N
    #[arg(long, value_name = "SPEC", value_parser = Sweep::parse)]
    sweep: Option<Sweep>,
    /// Chart of the sweep, .svg or .png: error, bytes and seconds of baking against its parameter
    #[arg(long, value_name = "OUT.svg|OUT.png", requires = "sweep")]
    plot: Option<PathBuf>,
    /// File that keeps the numbers of each finished row, by a digest of inputs, specs, options and version;
    /// rows that it holds are not computed again. With --output or --html their pictures are kept too, in the
    /// folder FILE.json.pictures
    #[arg(long, value_name = "FILE.json")]
    resume: Option<PathBuf>,
    /// Size of each picture, pixels
    #[arg(long, value_name = "WxH", default_value = "160x160", value_parser = size)]
    size: (usize, usize),
    /// Relative error of the reference at each point
    #[arg(long, value_name = "T", default_value_t = 5e-3, allow_negative_numbers = true, value_parser = inputs::positive)]
    reference_tolerance: f64,
    /// Compare with paths, which know shadows and light from surface to surface, instead of the integral
    /// without them; suns are shaded exactly then, and shadowed by rays under techniques that know shadows
    #[arg(long)]
    path: bool,
    #[command(flatten)]
    paths: PathArgs,
    #[command(flatten)]
    shadows: ShadowArg,
    /// Light that varies over space, as `probes` writes it, in place of every other light; --environment is
    /// seen behind
    #[arg(long, value_name = "FILE.safetensors", conflicts_with = "path")]
    probes: Option<PathBuf>,
    /// Exit 4 where a technique's relative RMS error is larger
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// Tone mapper of the pictures and of FLIP: linear, reinhard, aces, agx, neutral, … [default: neutral]
    #[arg(long, value_name = "NAME", value_parser = tone_mapper)]
    tone_mapper: Option<ToneMapper>,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let mut places = Destinations::default();
    let outputs = [(&o.output, &["png"][..]), (&o.html, &["html", "htm"]), (&o.table, &["csv", "tex"])];
    for (path, known) in outputs {
        if let Some(path) = path {
            context.check_output(path, known)?;
            places.file("--output", path)?;
        }
    }
    if let Some(path) = &o.plot {
        context.check_output(path, &["svg", "png"])?;
        places.file("--plot", path)?;
    }
    if let Some(path) = &o.resume {
        places.file("--resume", path)?;
        // It holds earlier results, which are no input of the comparison.
        context.writes(path)?;
    }
    let findings = compare(&o, context)?;
    if let (Some(path), Some(sweep)) = (&o.plot, &o.sweep) {
        context.write_drawing(path, &drawing(&findings, sweep))?;
    }
    if let Some(path) = &o.output {
        context.write_display(path, &sheet(&short(&o.mesh), &findings).draw(), Vec::new())?;
    }
    if let Some(path) = &o.html {
        context.write_words(Some(path), &html(&short(&o.mesh), &findings)?)?;
    }
    if let Some(path) = &o.table {
        let tex = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tex"));
        context.write_words(Some(path), &if tex { latex(&findings) } else { csv(&findings) })?;
    }
    if context.common.json {
        context.print_json(document(&findings))?;
    } else {
        context.print_words(&table(&findings))?;
    }
    gate(&o, &findings)
}

fn compare(o: &Options, context: &mut Context) -> Result<Vec<Finding>, Failure> {
    context.paths = o.paths.get(o.path)?;
    context.shadows = o.shadows.shadows.unwrap_or_default();
    let request = Request {
        model: o.mesh.clone(),
        environments: o.environment.clone(),
        adjust: o.adjust.get(),
        lights: o.light.clone(),
        local: o.local.get()?,
        brdfs: o.brdf.clone(),
        techniques: o.technique.clone(),
        params: inputs::parameters(&o.params)?,
        transfer: o.transfer.clone(),
        bakes: o.bake.clone(),
        sweep: o.sweep.clone(),
        probes: o.probes.clone(),
        size: o.size.into(),
        plan: Plan { reference_tolerance: o.reference_tolerance, paths: o.path, ev: 0.0, certificates: true },
        tolerance: o.tolerance,
        tone_mapper: o.tone_mapper.unwrap_or_default(),
        results: o.resume.clone(),
        pictured: o.output.is_some() || o.html.is_some(),
    };
    let renderers = renderers(context)?;
    let (findings, reused) = context.findings(&request, &renderers)?;
    if let Some(path) = o.resume.as_ref().filter(|_| reused > 0) {
        context.say(format_args!("{reused} of {} rows are those of {}", findings.len(), path.display()));
    }
    Ok(findings)
}

/// What `--backend` asks for: one renderer, or both.
pub fn renderers(context: &Context) -> Result<Vec<Renderer>, Failure> {
    let asked = Renderer::open(context)?;
    let both = context.common.backend == context::Backend::Both;
    Ok(if both { vec![Renderer::Cpu, asked] } else { vec![asked] })
}

fn gate(o: &Options, findings: &[Finding]) -> Outcome {
    match o.tolerance.and_then(|t| findings.iter().find_map(|f| f.missed(t))) {
        Some(why) => Err(Failure::missed(why)),
        None => Ok(()),
    }
}

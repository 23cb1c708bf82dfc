//! `steradian inspect`: what a file or a reflectance is.

mod bake;
mod brdf;
mod btf;
mod light;
mod mesh;
mod probes;
mod rti;
mod transfer;

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::AdjustArgs;
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use steradian_session::inspect::{is_bake, is_lp, is_mesh, is_ptm};
use steradian_session::{IMAGES, check_output};

/// Options of `steradian inspect`.
#[derive(Debug, Args)]
pub struct Options {
    /// Environment, sky spec, mesh, saved bake (.safetensors, the folder of one, or its .ktx2), transfer or probes (.safetensors), polynomial
    /// texture map (.ptm), light positions of photographs (.lp), pictures of a bidirectional texture function (.csv), brdf:SPEC, or brdf: for the list of models
    #[arg(value_name = "FILE|SKY|brdf:SPEC")]
    what: String,
    #[command(flatten)]
    adjust: AdjustArgs,
    /// Level of a texture (.ktx2, .ktx, .dds)
    #[arg(long, value_name = "M", default_value_t = 0)]
    level: usize,
    /// Polar plots of a BRDF, as .svg or .png
    #[arg(long, value_name = "OUT")]
    plot: Option<PathBuf>,
    /// Image slice of a BRDF (Burley 2012): f in sr-1 over the half vector's angle (left to right, 0 to 90 degrees) and the difference
    /// angle (bottom to top), for images as render writes them
    #[arg(long, value_name = "OUT")]
    slice: Option<PathBuf>,
}

/// One line of a report in words.
type Line = (&'static str, String);

/// A report in both forms.
struct Report {
    json: Value,
    lines: Vec<Line>,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    crate::inputs::check_text(o.plot.as_deref())?;
    if let Some(path) = &o.slice {
        check_output(path, &IMAGES)?;
    }
    let report = if let Some(spec) = o.what.strip_prefix("brdf:") {
        brdf::report(spec, o.plot.as_deref(), o.slice.as_deref(), context)?
    } else if o.plot.is_some() || o.slice.is_some() {
        return Err(Failure::usage("--plot and --slice draw a BRDF: inspect brdf:SPEC --plot OUT.svg"));
    } else if is_mesh(&o.what) {
        mesh::report(&o.what, context)?
    } else if is_ptm(&o.what) {
        rti::ptm(&o.what, context)?
    } else if is_lp(&o.what) {
        rti::lp(&o.what, context)?
    } else if let Some(report) = btf::report(&o.what, context)? {
        report
    } else if let Some(report) = transfer::report(&o.what, context)? {
        report
    } else if let Some(report) = probes::report(&o.what, context)? {
        report
    } else if is_bake(&o.what) {
        bake::report(&o.what, context)?
    } else if let Some(array) = bake::array(&o.what, context) {
        array
    } else {
        light::report(&o.what, &o.adjust.get(), o.level, context)?
    };
    if context.common.json {
        let mut document = report.json;
        if let Value::Object(map) = &mut document {
            map.insert("peak_memory_bytes".into(), json!(peak_memory()));
        }
        return context.print_json(document);
    }
    let width = report.lines.iter().map(|l| l.0.len()).max().unwrap_or(0);
    let text: String = report.lines.iter().map(|(name, value)| format!("{name:width$}  {value}\n")).collect();
    context.print(&text)
}

/// Largest resident size of this process so far, bytes; `None` where the system does not say.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kib << 10)
}

/// A file's name without its folders.
fn file_name(spec: &str) -> String {
    if steradian_session::is_sky(spec) {
        return spec.into();
    }
    Path::new(spec).file_name().map_or_else(|| spec.into(), |n| n.to_string_lossy().into_owned())
}

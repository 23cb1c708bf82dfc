//! `steradian inspect`: what a file or a reflectance is.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::AdjustArgs;
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;
use steradian_formats::WriteOptions;
use steradian_session::IMAGES;
use steradian_session::inspect::{Report, image_slice, polar_plot};

/// Options of `steradian inspect`.
#[derive(Debug, Args)]
pub struct Options {
    /// Environment, sky spec, mesh, saved bake (.safetensors, the folder of one, or its .ktx2), transfer or
    /// probes (.safetensors), polynomial texture map (.ptm), light positions of photographs (.lp), pictures
    /// of a bidirectional texture function (.csv), what lies beside an engine's maps (.gltf with a light,
    /// lights as .json, sh.txt, outputLUT.png), measurements of a reflectance (.binary, .bsdf, .brdf, .astm),
    /// brdf:SPEC, brdf: for the list of models, or brdf:MODEL:* for that of its materials, such as brdf:sgd:*
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
    /// Image slice of a BRDF (Burley 2012): f in sr-1 over the half vector's angle (left to right, 0 to 90
    /// degrees) and the difference angle (bottom to top), for images as render writes them
    #[arg(long, value_name = "OUT")]
    slice: Option<PathBuf>,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    crate::inputs::check_text(o.plot.as_deref(), context)?;
    if let Some(path) = &o.slice {
        context.check_output(path, &IMAGES)?;
    }
    let report = match o.what.strip_prefix("brdf:").filter(|spec| !is_list(spec)) {
        Some(spec) => reflectance(spec, &o, context)?,
        None if (o.plot.is_some() || o.slice.is_some()) && !o.what.starts_with("brdf:") => {
            return Err(Failure::usage("--plot and --slice draw a BRDF: inspect brdf:SPEC --plot OUT.svg"));
        }
        None => context.inspect(&o.what, &o.adjust.get(), o.level)?,
    };
    if context.common.json {
        let mut document = report.json;
        if let Value::Object(map) = &mut document {
            map.insert("peak_memory_bytes".into(), json!(peak_memory()));
        }
        return context.print_json(document);
    }
    context.print_words(&report.text())
}

/// Is a spec that of a list: of models, or of a model's materials?
fn is_list(spec: &str) -> bool {
    spec.is_empty() || spec.ends_with('*')
}

/// The report on a reflectance, beside what is drawn of it.
fn reflectance(spec: &str, o: &Options, context: &mut Context) -> Result<Report, Failure> {
    let facts = context.inspect_brdf(spec)?;
    if let Some(path) = &o.plot {
        context.write_drawing(path, &polar_plot(&*facts.brdf))?;
    }
    if let Some(path) = &o.slice {
        context.write_image(path, &image_slice(&*facts.brdf), WriteOptions::default())?;
    }
    Ok(facts.report())
}

/// Largest resident size of this process so far, bytes; `None` where the system does not say.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kib << 10)
}

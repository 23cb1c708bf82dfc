//! `steradian lut`: what the split sum's second factor is, as a texture or as source text.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use steradian_brdf::dfg::{
    Layout, Lut,
    text::{Language, source},
};
use steradian_formats::{Container, Raster, TexelFormat, TextureLevels, WriteOptions};
use steradian_session::{IMAGES, LookupTable, check_format, check_output};

/// Options of `steradian lut`.
#[derive(Debug, Args)]
pub struct Options {
    /// ggx (scale, bias, mean albedo E_avg), filament (bias, albedo, sheen), khronos (scale, bias, sheen), charlie or
    /// charlie-neubelt
    #[arg(value_name = "TABLE", value_parser = layout)]
    table: Layout,
    /// Output: .ktx2 .ktx .dds .exr .pfm .png (16 bits), or source text: .wgsl .glsl .rs
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Texels a side [default: 128, of source text 32]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(2..=1024))]
    size: Option<u16>,
    /// Texels of a texture: rgba16f or rgba32f [default: rgba32f]
    #[arg(long, value_name = "NAME", value_parser = TexelFormat::parse)]
    format: Option<TexelFormat>,
}

fn layout(text: &str) -> Result<Layout, String> {
    let names = Layout::ALL.map(Layout::name);
    Layout::from_name(text).ok_or_else(|| steradian_base::unknown("table", text, &names))
}

const TEXTS: [&str; 3] = ["wgsl", "glsl", "rs"];

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let path = &o.output;
    check_output(path, &[IMAGES.as_slice(), &Container::EXTENSIONS, &TEXTS].concat())?;
    check_format(o.format, path)?;
    if let Some(f) = o.format.filter(|f| !matches!(f, TexelFormat::Rgba16f | TexelFormat::Rgba32f)) {
        return Err(Failure::usage(format!("--format {}: tables are rgba16f or rgba32f", f.name())));
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    let language = Language::of_extension(&extension);
    let size = usize::from(o.size.unwrap_or(if language.is_some() { 32 } else { 128 }));
    let LookupTable { lut, quadrature, worst, rms, points } = context.lookup_table(o.table, size)?;
    match language {
        Some(language) => {
            let notes: Vec<String> =
                context.provenance_pairs().into_iter().map(|(k, v)| format!("{k}: {v}")).collect();
            context.write_text(Some(path), &source(&lut, language, &notes))?;
        }
        None => write(&o, &lut, path, context)?,
    }
    if context.common.json {
        return context.print_json(json!({
            "output": path.file_name().map(|n| n.to_string_lossy()),
            "table": o.table.name(),
            "size": size,
            "channels": o.table.channels(),
            "axes": Lut::AXES,
            "quadrature_error": quadrature,
            "lookup_error": {"rms": rms, "worst": worst, "points": points},
        }));
    }
    context.say(format_args!(
        "{}: {} {size} x {size}, bilinear lookup rms {rms:.1e}, worst {worst:.1e}",
        path.display(),
        o.table.name()
    ));
    Ok(())
}

/// What the file says of its texels.
fn metadata(lut: &Lut) -> Vec<(String, String)> {
    let mut pairs = vec![
        ("steradian.table".to_string(), lut.layout.name().to_string()),
        ("steradian.axes".to_string(), Lut::AXES.to_string()),
    ];
    for (c, what) in ["red", "green", "blue"].iter().zip(lut.layout.channels()) {
        pairs.push((format!("steradian.{c}"), (*what).to_string()));
    }
    pairs
}

fn write(o: &Options, lut: &Lut, path: &Path, context: &Context) -> Outcome {
    if let Some(container) = Container::of_name(path) {
        let mut pairs = context.provenance_pairs();
        pairs.extend(metadata(lut));
        let texels = lut.values.iter().flat_map(|v| [v[0], v[1], v[2], 1.0]).collect();
        let (width, height) = (lut.size, lut.size);
        let t = TextureLevels { width, height, faces: 1, levels: vec![texels], metadata: pairs };
        let report = container.write(path, &t, o.format.unwrap_or(TexelFormat::Rgba32f))?;
        context.tell_lost(path, report);
        return Ok(());
    }
    let plane = |c: usize| lut.values.iter().map(|v| v[c]).collect();
    let raster = Raster::rgb(lut.size, lut.size, [plane(0), plane(1), plane(2)]);
    let options = WriteOptions {
        metadata: metadata(lut),
        png_bits: 16,
        already_encoded: true,
        ..WriteOptions::default()
    };
    context.write_image(path, &raster, options)?;
    Ok(())
}

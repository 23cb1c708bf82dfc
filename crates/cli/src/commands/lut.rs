//! `steradian lut`: what the split sum's second factor is, as a texture or as source text.

use crate::context::Context;
use crate::failure::Outcome;
use crate::names;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use steradian_brdf::dfg::{Layout, Lut};
use steradian_formats::TexelFormat;
use steradian_session::{LookupTable, check_table, file_name};

/// Options of `steradian lut`.
#[derive(Debug, Args)]
pub struct Options {
    #[arg(value_name = "TABLE", value_parser = layout, help = names::tables())]
    table: Layout,
    /// Output: .ktx2 .ktx .dds .exr .pfm .png (16 bits), or source text: .wgsl .glsl .hlsl .rs
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

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let path = &o.output;
    let usual = check_table(path, o.format)?;
    let size = o.size.map_or(usual, usize::from);
    let table = context.lookup_table(o.table, size)?;
    context.write_lookup_table(&table, path, o.format)?;
    let LookupTable { quadrature, worst, rms, points, .. } = table;
    let name = o.table.name();
    context.report(
        || {
            json!({
                "output": file_name(path),
                "table": name,
                "size": size,
                "channels": o.table.channels(),
                "axes": Lut::AXES,
                "quadrature_error": quadrature,
                "lookup_error": {"rms": rms, "worst": worst, "points": points},
            })
        },
        || {
            let errors = format!("bilinear lookup rms {rms:.1e}, worst {worst:.1e}");
            [format!("{}: {name} {size} x {size}, {errors}", path.display())]
        },
    )
}

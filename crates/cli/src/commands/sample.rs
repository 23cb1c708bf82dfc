//! `steradian sample`: values of a map along directions.

use crate::context::Context;
use crate::failure::Outcome;
use crate::inputs::{self, AdjustArgs};
use clap::Args;
use glam::DMat3;
use serde_json::json;
use std::path::PathBuf;
use steradian_session::columns::unit;
use steradian_session::eval::shortest;
use steradian_session::is_sky;
use steradian_sphere::image::Filter;

/// Options of `steradian sample`.
#[derive(Debug, Args)]
pub struct Options {
    /// Image on the sphere, sky spec, or a texture (.ktx2, .ktx, .dds)
    #[arg(value_name = "MAP")]
    map: String,
    /// CSV with columns x,y,z: world directions; - is standard input
    #[arg(short, long, value_name = "FILE.csv")]
    directions: PathBuf,
    /// Level of a texture
    #[arg(long, value_name = "M", default_value_t = 0)]
    level: usize,
    #[command(flatten)]
    adjust: AdjustArgs,
    /// Output CSV [default: standard output]
    #[arg(short, long, value_name = "OUT.csv")]
    output: Option<PathBuf>,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    inputs::check_text(o.output.as_deref(), context)?;
    let adjust = o.adjust.get();
    let (image, back) = if is_sky(&o.map) {
        // A sky is turned and scaled with its sun, which is a disk of texels here.
        (context.light(&o.map, &adjust)?.with_disks_drawn(), DMat3::IDENTITY)
    } else {
        let mut image = context.map(&o.map, &adjust, o.level)?.image;
        steradian_light::adjust::scale(&mut image, adjust.gain());
        (image, adjust.rotation().transpose())
    };
    let mut table = context.read_table(&o.directions)?;
    let directions: Vec<_> = unit(&table, ["x", "y", "z"])?.into_iter().map(|d| back * d).collect();
    let values = image.lookup_many(Filter::CatmullRom, &directions);
    if context.common.json && o.output.is_none() {
        return context.print_json(json!({ "rgb": values }));
    }
    for (c, name) in ["r", "g", "b"].into_iter().enumerate() {
        table.set_column(name, values.iter().map(|v| shortest(v[c])));
    }
    context.write_text(o.output.as_deref(), &table.text())?;
    if context.common.json {
        return context.print_json(json!({ "directions": values.len() }));
    }
    Ok(())
}

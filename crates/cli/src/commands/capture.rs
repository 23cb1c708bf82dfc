//! `steradian capture`: photographs of a surface, computed.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;
use steradian_brdf::spec_without_folders;
use steradian_session::btf::{FORMATS, Pattern, Shape, Surface};

/// Options of `steradian capture`.
#[derive(Debug, Args)]
pub struct Options {
    /// Heights of the surface, which repeat: hemispheres, grooves, weave, cracks, or an image (its alpha,
    /// else its luminance)
    #[arg(value_name = "HEIGHT")]
    height: String,
    /// Folder of the pictures: btf.csv lists them, rti.lp and rti.ptm are those of the view along the normal.
    /// One that the same capture began is gone on with
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Reflectance
    #[arg(short, long, value_name = "SPEC", default_value = "lambert:albedo=0.6")]
    brdf: String,
    /// Image that multiplies it
    #[arg(long, value_name = "IMAGE")]
    base_color_texture: Option<PathBuf>,
    /// Height of white over the width of the surface
    #[arg(long, value_name = "X", default_value_t = 0.1, allow_negative_numbers = true, value_parser = inputs::finite)]
    relief: f64,
    /// Texels a side, of heights by formula [default: 128]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=4096))]
    size: Option<u32>,
    /// Directions of light: 81 are those of the Bonn measurements, other numbers equal parts of the same cap
    /// of 75 degrees
    #[arg(long, value_name = "N", default_value_t = 81)]
    lights: usize,
    /// Directions of view
    #[arg(long, value_name = "M", default_value_t = 81)]
    views: usize,
    /// Reflections of a path at most; 1 is direct light alone
    #[arg(long, value_name = "B", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    bounces: u32,
    /// Paths of a texel at random points of it; a single one looks at its middle [default: 1, with --bounces
    /// 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65_536))]
    samples: Option<u32>,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Format of the pictures: exr (half floats, linear) or png (8 bits, clips above white)
    #[arg(long, value_name = "exr|png", default_value = "exr", value_parser = format)]
    format: &'static str,
}

fn format(text: &str) -> Result<&'static str, String> {
    let found = FORMATS.into_iter().find(|f| *f == text);
    found.ok_or_else(|| format!("'{text}' is not {}", FORMATS.join(" or ")))
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let shape = match Pattern::of_name(&o.height) {
        Some(p) => Shape::Pattern(p, o.size.unwrap_or(128) as usize),
        None if o.size.is_some() => {
            return Err(Failure::usage("--size is for heights by formula: an image has its own"));
        }
        None => Shape::File(PathBuf::from(&o.height)),
    };
    let surface = Surface {
        shape,
        relief: o.relief,
        brdf: context.brdf(&o.brdf)?,
        base_colour: o.base_color_texture,
        views: o.views,
        lights: o.lights,
        bounces: o.bounces,
        samples: o.samples.unwrap_or(if o.bounces > 1 { 16 } else { 1 }),
        seed: o.seed,
        format: o.format,
    };
    let done = context.capture_surface(&surface, &o.output)?;
    let (w, h) = done.size;
    if context.common.json {
        return context.print_json(json!({
            "output": o.output.file_name().map(|n| n.to_string_lossy()),
            "source": "synthetic",
            "brdf": spec_without_folders(&o.brdf),
            "width": w,
            "height": h,
            "views": done.views,
            "views_kept": done.kept,
            "lights": done.lights,
            "seed": o.seed,
            "variance": done.variance,
            "polynomials": done.polynomials,
            "seconds": done.seconds,
        }));
    }
    let kept = if done.kept > 0 { format!(" ({} of them kept)", done.kept) } else { String::new() };
    let (views, lights, variance, seconds) = (done.views, done.lights, done.variance, done.seconds);
    context.say(format_args!(
        "{}: {views} views{kept} x {lights} lights of {w} x {h} texels, synthetic, variance {variance:.1e}, {seconds:.2} s",
        o.output.display()
    ));
    Ok(())
}

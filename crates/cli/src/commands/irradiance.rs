//! `steradian irradiance`: SH coefficients of radiance and irradiance, or a diffuse map.

use crate::commands::render::{size, tone_mapper};
use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, AdjustArgs};
use clap::Args;
use std::path::{Path, PathBuf};
use steradian_brdf::dfg::text::Language;
use steradian_engines::irradiance_source;
use steradian_formats::{TexelFormat, WriteOptions};
use steradian_light::load::Arrangement;
use steradian_render::ToneMapper;
use steradian_session::irradiance::{Request, WindowSpec};
use steradian_session::{IMAGES, has_extension};
use steradian_sphere::Layout;

/// Options of `steradian irradiance`.
#[derive(Debug, Args)]
pub struct Options {
    /// Light: an image, or a sky spec such as sky:elevation=35
    #[arg(value_name = "ENV")]
    environment: String,
    #[command(flatten)]
    adjust: AdjustArgs,
    /// Bands of spherical harmonics of the coefficients; 3 bands are orders 0 to 2, 9 coefficients. A map is
    /// of the whole light, whatever --bands, --window and --dering say [default: 3]
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=512))]
    bands: Option<u16>,
    /// Window over the coefficients' bands: none, hann, lanczos or gauss, as hann:W with a width in bands
    /// [default: none]
    #[arg(long, value_name = "NAME[:W]", value_parser = WindowSpec::parse)]
    window: Option<WindowSpec>,
    /// Change the coefficients as little as possible such that the irradiance is nowhere negative, at any
    /// number of bands
    #[arg(long)]
    dering: bool,
    /// Add ZH3 to the JSON document: linear coefficients and one zonal number per channel, stored and
    /// hallucinated
    #[arg(long)]
    zh3: bool,
    /// Coefficients as .csv, .txt or .json; those of up to 16 bands as shader text with a function
    /// irradiance(n), .wgsl, .glsl or .hlsl; or, as .exr .hdr .pfm .png .ktx2, the map of irradiance E over
    /// normals in W m⁻² (no 1/π), beside the coefficients on standard output [default: coefficients on
    /// standard output]
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,
    /// Layout of the map: latlong, cube, cross, octahedral, … [default: latlong; cube for .ktx2]
    #[arg(long, value_name = "LAYOUT", value_parser = Arrangement::parse)]
    to: Option<Arrangement>,
    /// Side of a face of the map, or WIDTHxHEIGHT of a lat-long map, pixels [default: 32, 128x64]
    #[arg(long, value_name = "N|WxH", value_parser = size)]
    size: Option<(usize, usize)>,
    /// Tone mapper of a .png [default: linear, which clips]
    #[arg(long, value_name = "NAME", value_parser = tone_mapper)]
    tone_mapper: Option<ToneMapper>,
}

impl Options {
    fn bands(&self) -> u16 {
        self.bands.unwrap_or(3)
    }
}

/// Extensions of coefficients.
const TEXTS: [&str; 6] = ["csv", "json", "txt", "wgsl", "glsl", "hlsl"];
/// Bands of shader text at most: more have errors of single precision and thousands of lines.
const SHADER_BANDS: u16 = 16;

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let map = match o.output.as_deref().filter(|p| *p != Path::new("-")) {
        None => None,
        // Devices have no extension: text.
        Some(path) if path.extension().is_none() => {
            inputs::check_text(Some(path), context)?;
            None
        }
        Some(path) => {
            context.check_output(path, &[TEXTS.as_slice(), &IMAGES, &["ktx2"]].concat())?;
            (!has_extension(path, &TEXTS)).then_some(path)
        }
    };
    if map.is_none() && (o.to.is_some() || o.size.is_some() || o.tone_mapper.is_some()) {
        return Err(Failure::usage(
            "--to, --size and --tone-mapper belong to a map: give -o with .exr, .hdr, …",
        ));
    }
    if let Some(path) = map {
        write_map(&o, path, context)?;
        if o.bands.is_some() || o.window.is_some() || o.dering {
            context
                .say("the map is of the whole light; --bands, --window, --dering concern the coefficients");
        }
    }
    let json = context.common.json || o.output.as_deref().is_some_and(|p| has_extension(p, &["json"]));
    if o.zh3 && !json {
        return Err(Failure::usage("--zh3 belongs to a JSON document: give --json or -o FILE.json"));
    }
    let extension =
        o.output.as_deref().and_then(|p| p.extension()).map(|e| e.to_string_lossy().to_lowercase());
    let language = extension.as_deref().and_then(Language::of_extension).filter(|_| map.is_none());
    if language.is_some() && o.bands() > SHADER_BANDS {
        let why = format!("shader text has {SHADER_BANDS} bands at most: give fewer --bands, or write .csv");
        return Err(Failure::usage(why));
    }
    let c = context.irradiance(&Request {
        environment: o.environment.clone(),
        adjust: o.adjust.get(),
        bands: o.bands().into(),
        window: o.window,
        dering: o.dering,
        zh3: o.zh3,
    })?;
    if let Some(d) = &c.dering {
        let change = d.change.iter().fold(0.0, |m: f64, c| m.max(*c));
        context.say(format_args!("deringed: irradiance changed by {:.2} % (rms)", 100.0 * change));
        if d.minimum.iter().any(|m| *m < 0.0) {
            context.warn("the mean of a channel is negative: its irradiance stays so");
        }
    }
    if let Some(source) =
        language.and_then(|l| irradiance_source(&c.radiance, l, &context.provenance_lines()))
    {
        return context.write_text(o.output.as_deref(), &source);
    }
    let text = if json { context.json_text(c.document()) } else { c.table() };
    context.write_text(if map.is_some() { None } else { o.output.as_deref() }, &text)
}

fn write_map(o: &Options, path: &Path, context: &mut Context) -> Outcome {
    let texture = has_extension(path, &["ktx2"]);
    let target = o.to.unwrap_or(if texture { Arrangement::Cube } else { Arrangement::LatLong });
    if texture && target != Arrangement::Cube {
        return Err(Failure::usage(format!("{}: holds cube faces; --to is another layout", path.display())));
    }
    let layout = target.layout();
    let default = if layout == Layout::LatLong { (128, 64) } else { (32, 32) };
    let (w, h) = o.size.map_or(Ok(default), |s| inputs::side(s, target))?;
    let image = context.irradiance_map(&o.environment, &o.adjust.get(), (layout, w, h))?;
    let quantity = ("steradian.quantity".to_string(), "irradiance E, W m^-2 (no 1/pi)".to_string());
    if texture {
        context.write_cube(path, &image, TexelFormat::Rgba32f, vec![quantity])?;
    } else {
        let mut options = WriteOptions { metadata: target.metadata(), ..WriteOptions::default() };
        options.metadata.push(quantity);
        context.write_toned(path, target.arranged(image), o.tone_mapper, options)?;
    }
    context.say(format_args!("{}: irradiance E in W m⁻², {} {w} x {h}", path.display(), target.name()));
    Ok(())
}

//! `steradian prefilter`: an environment convolved with a kernel, as one map, a chain of levels, or an engine's files.

mod report;

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs;
use clap::Args;
use std::path::{Path, PathBuf};
use std::time::Instant;
use steradian_engines::{Engine, Filtered, MethodChoice, Request, kernel_name};
use steradian_formats::TexelFormat;
use steradian_light::load::{FileLayout, Profile};
use steradian_session::{Adjust, Destinations, is_sky};

/// Options of `steradian prefilter`.
#[derive(Debug, Args)]
pub struct Options {
    /// Image or sky spec
    #[arg(value_name = "ENV")]
    environment: String,
    /// Output: .ktx2 .ktx .dds (a cube), .exr .hdr .pfm (lat-long); with --profile a folder
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// ggx, beckmann, charlie, phong, blinn-phong, lambert, gaussian (of the angle), spherical-gaussian, or
    /// brdf:SPEC for any isotropic reflectance as it is seen at normal incidence
    #[arg(long, value_name = "NAME|brdf:SPEC", default_value = "ggx", value_parser = kernel_name)]
    kernel: String,
    /// Perceptual roughness of ggx, beckmann and charlie, 0 to 1; 0 is a mirror
    #[arg(long, value_name = "R", allow_negative_numbers = true, value_parser = unit)]
    perceptual_roughness: Option<f64>,
    /// Width of ggx, beckmann and charlie: perceptual roughness squared
    #[arg(long, value_name = "A", allow_negative_numbers = true, value_parser = unit, conflicts_with = "perceptual_roughness")]
    alpha: Option<f64>,
    /// Exponent of phong and blinn-phong
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = inputs::positive)]
    exponent: Option<f64>,
    /// Standard deviation of gaussian and spherical-gaussian, degrees
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = inputs::positive)]
    sigma: Option<f64>,
    /// Files of an engine: bevy, three, filament, gltf, khronos, godot, unreal, blender or raw
    #[arg(long, value_name = "NAME", value_parser = Engine::parse)]
    profile: Option<&'static Engine>,
    /// Side of level 0; of a lat-long image the width, or WIDTHxHEIGHT [default: 256, or the profile's]
    #[arg(long, value_name = "N|WxH", value_parser = super::render::size)]
    size: Option<(usize, usize)>,
    /// Levels of a chain, from a mirror to perceptual roughness 1 [default: one, or the profile's]
    #[arg(long, value_name = "L", value_parser = clap::value_parser!(u8).range(1..=16))]
    levels: Option<u8>,
    /// Texels of a cube: rgba16f, rgba32f, rgb9e5, r11g11b10, bc6h or bc6h-signed [default: rgba32f, or the profile's]
    #[arg(long, value_name = "NAME", value_parser = TexelFormat::parse)]
    format: Option<TexelFormat>,
    /// Relative RMS error [default: 2e-3]; with it a miss exits with 4, the rounding of the file's texels included
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// Texels of each level that are compared with the integral over all texels of the light: some spread evenly, most
    /// where the level is bright
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 64)]
    check: u16,
    /// A way to prefilter by name, for comparison: auto, brute, truncated-angular, hierarchical, lat-long-angular,
    /// per-face, box-mip, dual-paraboloid or frequency
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = MethodChoice::parse)]
    method: MethodChoice,
    /// Takes suns and lamps out of the light before it is filtered, and writes them to this file as disk lights: the flux, direction and
    /// size of their texels, not their outline, which lobes as sharp as a texel show beside the sun
    #[arg(long, value_name = "LIGHTS.json")]
    extract_sun: Option<PathBuf>,
    /// Folder for every level as a lat-long .exr
    #[arg(long, value_name = "DIR")]
    dump_levels: Option<PathBuf>,
    /// Name in the names of the files of --profile and --dump-levels [default: that of the input]
    #[arg(long, value_name = "NAME", value_parser = file_name)]
    name: Option<String>,
    /// Arrangement of the input: latlong, cross, strip, angular, … [default: by its shape]
    #[arg(long, value_name = "NAME", value_parser = FileLayout::parse)]
    layout: Option<FileLayout>,
    /// Convention of the input: openexr, cmgen, usd, … [default: steradian, or what the file says]
    #[arg(long, value_name = "NAME", value_parser = Profile::parse)]
    input_profile: Option<&'static Profile>,
    /// Rotation of the light about +Y, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true, value_parser = inputs::finite)]
    rotate: f64,
    /// Exposure value by which the light is scaled
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = inputs::exposure)]
    light_exposure: f64,
}

fn unit(text: &str) -> Result<f64, String> {
    let v = inputs::finite(text)?;
    if (0.0..=1.0).contains(&v) { Ok(v) } else { Err(format!("'{text}' is not within 0 to 1")) }
}

/// A part of files' names: it names no folder.
fn file_name(text: &str) -> Result<String, String> {
    let odd = |c: char| matches!(c, '/' | '\\') || c.is_control();
    if text.is_empty() || text == "." || text == ".." || text.contains(odd) {
        return Err(format!("'{text}' is no name of a file: give one without / and \\"));
    }
    Ok(text.into())
}

fn request(o: &Options, context: &mut Context) -> Result<Request, Failure> {
    if o.name.is_some() && o.profile.is_none() && o.dump_levels.is_none() {
        let why = "names the files of --profile and --dump-levels; --output names this one";
        return Err(Failure::usage(format!("--name {why}")));
    }
    let mut request = Request {
        output: o.output.clone(),
        name: o.name.clone().unwrap_or_else(|| stem(&o.environment)),
        kernel: o.kernel.clone(),
        brdf: None,
        perceptual_roughness: o.perceptual_roughness,
        alpha: o.alpha,
        exponent: o.exponent,
        sigma: o.sigma,
        engine: o.profile,
        size: o.size,
        levels: o.levels.map(usize::from),
        format: o.format,
        tolerance: o.tolerance.unwrap_or(Request::TOLERANCE),
        check: o.check.into(),
        method: o.method,
        dump: o.dump_levels.is_some(),
    };
    request.brdf = request.brdf_spec().map(|spec| context.brdf(spec)).transpose()?;
    // Refused before any work.
    request.plan(context.common.max_memory)?;
    destinations(o)?;
    Ok(request)
}

/// Refuses outputs that cannot be written, or of which one would replace another.
fn destinations(o: &Options) -> Outcome {
    let mut places = Destinations::default();
    if o.profile.is_none() {
        places.file("--output", &o.output)?;
    } else {
        places.folder(&o.output, false)?;
    }
    if let Some(folder) = &o.dump_levels {
        places.folder(folder, true)?;
    }
    if let Some(path) = &o.extract_sun {
        places.file("--extract-sun", path)?;
    }
    Ok(())
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let start = Instant::now();
    let request = request(&o, context)?;
    let adjust = Adjust {
        layout: o.layout,
        profile: o.input_profile,
        rotate: o.rotate,
        light_exposure: o.light_exposure,
    };
    let mut lights = context.light(&o.environment, &adjust)?;
    let suns = o.extract_sun.as_ref().map(|_| steradian_light::suns::take(&mut lights));
    if let Some(taken) = &suns {
        context.note(taken.metadata());
    }
    let mut clock = report::Clock::new(start, "reading");
    let mut made = Filtered::new(request, lights, &context.task)?;
    let worst = made.error();
    let how = if o.check > 0 { "measured" } else { "bound" };
    let packing = match made.format_error() {
        e if e > 0.0 => format!(", {e:.2e} of the texels' format"),
        _ => String::new(),
    };
    context.note_error(format!("relative RMS error {worst:.2e} ({how}{packing})"));
    clock.parts(&made.seconds);
    let metadata = context.provenance_pairs();
    let written = made.write(&metadata)?;
    written.iter().for_each(|w| context.tell_lost(Path::new(&w.name), w.report));
    clock.lap("writing");
    if let Some(folder) = &o.dump_levels {
        made.dump(folder, &metadata, &context.task)?;
        clock.lap("dumping");
    }
    let snippet = made.snippet();
    let mut document = report::report(&made, &written, clock, snippet.as_deref());
    if let (Some(path), Some(taken)) = (&o.extract_sun, &suns) {
        inputs::write_suns(taken, path, context)?;
        document["suns"] = taken.json();
    }
    if context.common.json {
        context.print_json(document)?;
    } else {
        report::say(&made, &written, context);
        if let Some(s) = snippet {
            context.print(&s)?;
        }
    }
    match o.tolerance {
        Some(t) if worst > t => {
            Err(Failure::missed(format!("relative RMS error {worst:.2e} is above {t:.2e} ({how}{packing})")))
        }
        _ => Ok(()),
    }
}

/// A name without folders, extensions and odd characters.
fn stem(environment: &str) -> String {
    let path = Path::new(environment);
    let stem = if is_sky(environment) { None } else { path.file_stem() };
    let text = stem.map_or_else(|| environment.to_string(), |s| s.to_string_lossy().into_owned());
    let clean = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    text.chars().map(clean).take(80).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_stay_in_their_folder() {
        for bad in ["", ".", "..", "../evil", "a/b", "a\\b", "a\nb"] {
            assert!(file_name(bad).is_err(), "{bad}");
        }
        assert_eq!(file_name("a..b"), Ok("a..b".into()));
    }
}

//! `steradian convert`: one layout, format, size or orientation to another.

use crate::commands::render::tone_mapper;
use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, AdjustArgs};
use crate::names;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use steradian_brdf::spec_without_folders;
use steradian_formats::{Container, ExrSamples, TexelFormat, WriteOptions};
use steradian_light::load::Arrangement;
use steradian_render::ToneMapper;
use steradian_session::btf::MOST_LOBES;
use steradian_session::convert::{Request, files};
use steradian_session::inspect::{is_lp, is_ptm};
use steradian_session::{
    Basis, Destinations, HORIZONS, HorizonForm, IMAGES, MAX_AZIMUTHS, MEASUREMENTS, POLYNOMIALS,
    PolynomialKind, PolynomialPart, check_format, file_name, has_extension,
};

/// Options of `steradian convert`.
#[derive(Debug, Args)]
pub struct Options {
    /// Image, several separated by commas, a pattern with {}, a texture (.ktx2, .ktx, .dds), a sky spec,
    /// brdf:SPEC, a reflectance that becomes a table of measurements, a list of light positions (.lp), whose
    /// photographs become a polynomial texture map, such a map (.ptm), with --horizons a height map, or with
    /// --lobes a list of pictures (.csv)
    #[arg(value_name = "INPUT")]
    input: String,
    /// Output: .exr .hdr .pfm .png, cubes as .ktx2 .ktx .dds; {} in the name stands for a face; .binary
    /// (MERL) or .csv for a reflectance; .ptm for photographs; a folder for --lobes
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    adjust: AdjustArgs,
    /// Layout of the output: latlong, cube, cross, vertical-cross, strip, vertical-strip, angular,
    /// sphere-map, octahedral, paraboloid [default: that of the input; cube for textures and {}]
    #[arg(long, value_name = "LAYOUT", value_parser = Arrangement::parse)]
    to: Option<Arrangement>,
    /// Side of a face, or WIDTHxHEIGHT of a lat-long image [default: what the input resolves]
    #[arg(long, value_name = "N|WxH", value_parser = super::render::size)]
    size: Option<(usize, usize)>,
    /// Level of a texture to read
    #[arg(long, value_name = "M", default_value_t = 0)]
    level: usize,
    /// Takes suns and lamps out of the image, and writes them to this file as disk lights: the flux,
    /// direction and size of their texels, not their outline, which lobes as sharp as a texel show beside the
    /// sun
    #[arg(long, value_name = "LIGHTS.json")]
    extract_sun: Option<PathBuf>,
    /// Tone mapper of .png [default: linear, which clips]
    #[arg(long, value_name = "NAME", value_parser = tone_mapper)]
    tone_mapper: Option<ToneMapper>,
    /// Write an .exr or a texture in half floats
    #[arg(long)]
    half: bool,
    /// What the bumps of a height map (its alpha, else its luminance; it repeats) hide of the light, as an
    /// array texture (.ktx2): elevations of each texel's horizon in radians at N azimuths from the right of
    /// the picture to its top, four a layer; or `ellipses`, one conic a texel
    #[arg(long, value_name = "N|ellipses", value_parser = horizon_form)]
    horizons: Option<HorizonForm>,
    /// Of a polynomial texture map (.ptm), or of photographs under known lights (.lp): normal, where each
    /// texel is brightest, as a normal map, green up; or albedo, what it reflects there [default: normal]
    #[arg(long, value_name = "normal|albedo", value_parser = polynomial_part)]
    map: Option<PolynomialPart>,
    /// With --map, of photographs under known lights (.lp): what a texel's brightness is a sum of
    #[arg(long, value_name = "biquadratic|sh9|sh16", value_parser = basis, requires = "map")]
    basis: Option<Basis>,
    /// Of photographs under known lights (.lp): polynomials of luminance, which scales one colour a texel
    /// (lrgb), or of red, green and blue (rgb), for colours that change with the light [default: lrgb]
    #[arg(long, value_name = "lrgb|rgb", value_parser = polynomial_kind, conflicts_with = "map")]
    ptm: Option<PolynomialKind>,
    /// Of pictures from many views under many lights (.csv, as capture writes them): a diffuse part and N
    /// generalised cosine lobes for each texel, as the images that --local lafortune_svbrdf reads, into the
    /// folder of --output
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=MOST_LOBES as i64))]
    lobes: Option<u8>,
    /// With --horizons: how far white is above black, as a part of the map's width
    #[arg(long, value_name = "R", value_parser = relief, default_value_t = 0.08)]
    relief: f64,
    #[arg(long, value_name = "NAME", value_parser = TexelFormat::parse, conflicts_with = "half", help = format!("Texels of a texture: {} [default: 32-bit floats, or 16-bit ones with --half]", names::formats()))]
    format: Option<TexelFormat>,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let map = is_ptm(&o.input);
    if o.map.is_some() && !map && !is_lp(&o.input) {
        let why = "--map belongs to a polynomial texture map (.ptm) or a list of lights (.lp)";
        return Err(Failure::usage(format!("{}: {why}", o.input)));
    }
    if let Some(spec) = o.input.strip_prefix("brdf:") {
        return tabulated(spec, &o.output, context);
    }
    if o.ptm.is_some() && !is_lp(&o.input) {
        return Err(Failure::usage(format!("{}: --ptm belongs to a list of lights (.lp)", o.input)));
    }
    if let Some(count) = o.lobes {
        return lobes(&o, count.into(), context);
    }
    if is_lp(&o.input) && o.map.is_none() {
        return polynomials(&o, context);
    }
    if let Some(form) = o.horizons {
        return horizons(&o, form, context);
    }
    if o.map.is_some() || map {
        return part(&o, context);
    }
    context.check_output(&o.output, &[IMAGES.as_slice(), &Container::EXTENSIONS].concat())?;
    check_format(o.format, &o.output)?;
    let mut places = Destinations::default();
    for path in files(&o.output) {
        places.file("--output", &path)?;
        context.writes(&path)?;
    }
    if let Some(path) = &o.extract_sun {
        places.file("--extract-sun", path)?;
        context.writes(path)?;
    }
    let done = context.convert(&Request {
        input: o.input,
        adjust: o.adjust.get(),
        level: o.level,
        extract_suns: o.extract_sun.is_some(),
        to: o.to,
        size: o.size,
        output: o.output.clone(),
        format: o.format,
        half: o.half,
        tone_mapper: o.tone_mapper,
    })?;
    if let (Some(path), Some(taken)) = (&o.extract_sun, &done.suns) {
        inputs::write_suns(taken, path, context)?;
    }
    let ((w, h), layout, report, share) = (done.size, done.layout.name(), done.report, done.share);
    context.report(
        || {
            json!({
                "output": file_name(&o.output), "layout": layout, "width": w, "height": h,
                "clipped": report.clipped, "vanished": report.vanished, "lost": report.lost,
                "share_of_light_clipped": share,
            })
        },
        || [format!("{}: {layout} {w} x {h}", o.output.display())],
    )
}

/// A reflectance as a table of measurements.
fn tabulated(spec: &str, path: &Path, context: &mut Context) -> Outcome {
    context.check_output(path, &MEASUREMENTS)?;
    context.tabulate(spec, path)?;
    context.report(
        || json!({"output": file_name(path), "brdf": spec_without_folders(spec)}),
        || [format!("{}: {spec}, 90 x 90 x 180 cells", path.display())],
    )
}

/// Pictures from many views under many lights as lobes by texel.
fn lobes(o: &Options, count: usize, context: &mut Context) -> Outcome {
    if !has_extension(Path::new(&o.input), &["csv"]) {
        let why = "--lobes are fitted to pictures that a .csv lists, as capture writes them";
        return Err(Failure::usage(format!("{}: {why}", o.input)));
    }
    Destinations::default().folder(&o.output, true)?;
    let x = context.fit_lobes(Path::new(&o.input), count, &o.output)?;
    let (output, names, percent) = (o.output.display(), x.files.join(", "), 100.0 * x.error);
    let (w, h, n) = (x.width, x.height, x.pictures);
    context.report(
        || json!({"files": x.files, "width": w, "height": h, "pictures": n, "error": x.error}),
        || [format!("{output}: {w} x {h} texels of {n} pictures, {percent:.2} % off: {names}")],
    )
}

/// Photographs under known lights as a polynomial texture map.
fn polynomials(o: &Options, context: &mut Context) -> Outcome {
    context.check_output(&o.output, &POLYNOMIALS)?;
    let x = context.fit_polynomials(Path::new(&o.input), &o.output, o.ptm.unwrap_or_default())?;
    let (output, name) = (o.output.display(), file_name(&o.output));
    let (w, h, n, c) = (x.width, x.height, x.photographs, x.condition);
    context.report(
        || json!({"output": name, "width": w, "height": h, "photographs": n, "condition": c}),
        || [format!("{output}: {w} x {h} polynomials of {n} photographs, condition number {c:.2}")],
    )
}

fn polynomial_kind(text: &str) -> Result<PolynomialKind, String> {
    match text {
        "lrgb" => Ok(PolynomialKind::Lrgb),
        "rgb" => Ok(PolynomialKind::Rgb),
        _ => Err(steradian_base::unknown("kind", text, &["lrgb", "rgb"])),
    }
}

fn polynomial_part(text: &str) -> Result<PolynomialPart, String> {
    match text {
        "normal" => Ok(PolynomialPart::Normal),
        "albedo" => Ok(PolynomialPart::Albedo),
        _ => Err(steradian_base::unknown("map", text, &["normal", "albedo"])),
    }
}

fn basis(text: &str) -> Result<Basis, String> {
    let found = Basis::ALL.into_iter().find(|b| b.name() == text);
    found.ok_or_else(|| steradian_base::unknown("basis", text, &Basis::NAMES))
}

/// The normals or the albedo of a polynomial texture map.
fn part(o: &Options, context: &mut Context) -> Outcome {
    context.check_output(&o.output, &IMAGES)?;
    let part = o.map.unwrap_or(PolynomialPart::Normal);
    let raster = context.polynomial_map(Path::new(&o.input), part, o.basis.unwrap_or_default())?;
    let name = if part == PolynomialPart::Normal { "normals" } else { "albedo" };
    let mut options =
        WriteOptions { already_encoded: part == PolynomialPart::Normal, ..WriteOptions::default() };
    if o.half {
        options.exr_samples = ExrSamples::Half;
    }
    let report = context.write_image(&o.output, &raster, options)?;
    let (w, h) = (raster.width, raster.height);
    context.report(
        || {
            json!({
                "output": file_name(&o.output), "map": name, "width": w, "height": h,
                "clipped": report.clipped, "vanished": report.vanished, "lost": report.lost,
            })
        },
        || [format!("{}: {name}, {w} x {h}", o.output.display())],
    )
}

fn horizon_form(text: &str) -> Result<HorizonForm, String> {
    let all = 1..=MAX_AZIMUTHS;
    match text.parse() {
        Ok(n) if all.contains(&n) => Ok(HorizonForm::Azimuths(n)),
        _ if text == "ellipses" => Ok(HorizonForm::Ellipses),
        _ => Err(format!("1 to {MAX_AZIMUTHS} azimuths, or ellipses")),
    }
}

fn relief(text: &str) -> Result<f64, String> {
    let good = text.parse().ok().filter(|r: &f64| *r > 0.0 && *r <= 100.0);
    good.ok_or_else(|| "above 0 and at most 100".into())
}

/// A height map as horizons.
fn horizons(o: &Options, form: HorizonForm, context: &mut Context) -> Outcome {
    context.check_output(&o.output, &HORIZONS)?;
    let mut places = Destinations::default();
    places.file("--output", &o.output)?;
    let usual = if o.half { TexelFormat::Rgba16f } else { TexelFormat::Rgba32f };
    let output = (o.output.as_path(), o.format.unwrap_or(usual));
    let x = context.horizons((Path::new(&o.input), o.relief), form, output)?;
    let (output, percent) = (o.output.display(), 100.0 * x.open);
    let (w, h, n, lost) = (x.width, x.height, x.layers, x.written);
    context.report(
        || {
            json!({
                "output": file_name(&o.output), "width": w, "height": h, "layers": n, "open": x.open,
                "clipped": lost.clipped, "vanished": lost.vanished, "lost": lost.lost,
            })
        },
        || {
            let left = format!("{percent:.1} % of the light of an even sky is left by the bumps");
            [format!("{output}: {w} x {h} texels, {n} layers; {left}")]
        },
    )
}

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
use steradian_formats::{Container, ExrSamples, Raster, TexelFormat, WriteOptions, WriteReport};
use steradian_light::adjust;
use steradian_light::load::{Arrangement, arrangement};
use steradian_render::{Develop, Film, ToneMapper};
use steradian_session::Basis;
use steradian_session::btf::MOST_LOBES;
use steradian_session::inspect::is_lp;
use steradian_session::{
    Adjust, Destinations, HORIZONS, HorizonForm, IMAGES, MAX_AZIMUTHS, MEASUREMENTS, POLYNOMIALS,
    PolynomialPart, check_format, check_output, is_sky,
};
use steradian_sphere::SphereImage;

/// Options of `steradian convert`.
#[derive(Debug, Args)]
pub struct Options {
    /// Image, several separated by commas, a pattern with {}, a texture (.ktx2, .ktx, .dds), a sky spec,
    /// brdf:SPEC, a reflectance that becomes a table of measurements, a list of light positions (.lp), whose
    /// photographs become a polynomial texture map, such a map (.ptm), with --horizons a height map, or with --lobes a list of pictures (.csv)
    #[arg(value_name = "INPUT")]
    input: String,
    /// Output: .exr .hdr .pfm .png, cubes as .ktx2 .ktx .dds; {} in the name stands for a face; .binary (MERL) or
    /// .csv for a reflectance; .ptm for photographs; a folder for --lobes
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    #[command(flatten)]
    adjust: AdjustArgs,
    /// Layout of the output: latlong, cube, cross, vertical-cross, strip, vertical-strip, angular, sphere-map,
    /// octahedral, paraboloid [default: that of the input; cube for textures and {}]
    #[arg(long, value_name = "LAYOUT", value_parser = Arrangement::parse)]
    to: Option<Arrangement>,
    /// Side of a face, or WIDTHxHEIGHT of a lat-long image [default: what the input resolves]
    #[arg(long, value_name = "N|WxH", value_parser = super::render::size)]
    size: Option<(usize, usize)>,
    /// Level of a texture to read
    #[arg(long, value_name = "M", default_value_t = 0)]
    level: usize,
    /// Takes suns and lamps out of the image, and writes them to this file as disk lights: the flux, direction and
    /// size of their texels, not their outline, which lobes as sharp as a texel show beside the sun
    #[arg(long, value_name = "LIGHTS.json")]
    extract_sun: Option<PathBuf>,
    /// Tone mapper of .png [default: linear, which clips]
    #[arg(long, value_name = "NAME", value_parser = tone_mapper)]
    tone_mapper: Option<ToneMapper>,
    /// Write an .exr or a texture in half floats
    #[arg(long)]
    half: bool,
    /// What the bumps of a height map (its alpha, else its luminance; it repeats) hide of the light, as an array texture
    /// (.ktx2): elevations of each texel's horizon in radians at N azimuths from the right of the picture to its top, four
    /// a layer; or `ellipses`, one conic a texel
    #[arg(long, value_name = "N|ellipses", value_parser = horizon_form)]
    horizons: Option<HorizonForm>,
    /// Of a polynomial texture map (.ptm), or of photographs under known lights (.lp): normal, where each texel is brightest, as a normal map, green up; or albedo, what
    /// it reflects there [default: normal]
    #[arg(long, value_name = "normal|albedo", value_parser = polynomial_part)]
    map: Option<PolynomialPart>,
    /// With --map, of photographs under known lights (.lp): what a texel's brightness is a sum of
    #[arg(long, value_name = "biquadratic|sh9|sh16", value_parser = basis, requires = "map")]
    basis: Option<Basis>,
    /// Of pictures from many views under many lights (.csv, as capture writes them): a diffuse part and N generalised cosine lobes for each
    /// texel, as the images that --local lafortune_svbrdf reads, into the folder of --output
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=MOST_LOBES as i64))]
    lobes: Option<u8>,
    /// With --horizons: how far white is above black, as a part of the map's width
    #[arg(long, value_name = "R", value_parser = relief, default_value_t = 0.08)]
    relief: f64,
    #[arg(long, value_name = "NAME", value_parser = TexelFormat::parse, conflicts_with = "half", help = format!("Texels of a texture: {} [default: 32-bit floats, or 16-bit ones with --half]", names::formats()))]
    format: Option<TexelFormat>,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let map = Path::new(&o.input).extension().is_some_and(|e| e.eq_ignore_ascii_case("ptm"));
    if o.map.is_some() && !map && !is_lp(&o.input) {
        let why = "--map belongs to a polynomial texture map (.ptm) or a list of lights (.lp)";
        return Err(Failure::usage(format!("{}: {why}", o.input)));
    }
    if let Some(spec) = o.input.strip_prefix("brdf:") {
        return tabulated(spec, &o.output, context);
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
    check_output(&o.output, &[IMAGES.as_slice(), &Container::EXTENSIONS].concat())?;
    check_format(o.format, &o.output)?;
    let texture = Container::of_name(&o.output).is_some();
    let six = o.output.file_name().is_some_and(|n| n.to_string_lossy().contains("{}"));
    let mut places = Destinations::default();
    for path in if six { faces(&o.output) } else { vec![o.output.clone()] } {
        places.file("--output", &path)?;
    }
    if let Some(path) = &o.extract_sun {
        places.file("--extract-sun", path)?;
    }
    let image = match &o.extract_sun {
        Some(path) => sunless(&o, path, context)?,
        None => {
            let mut image = source(&o, context)?;
            adjust::scale(&mut image, o.adjust.get().gain());
            image
        }
    };
    let cube = six || texture;
    let target = o.to.unwrap_or(if cube { Arrangement::Cube } else { Arrangement::of(image.layout) });
    if cube && target != Arrangement::Cube {
        return Err(Failure::usage(format!(
            "{}: holds cube faces; --to is another layout",
            o.output.display()
        )));
    }
    context.task.check()?;
    let image = target.shaped(image, o.size.map(|s| inputs::side(s, target)).transpose()?);
    let ((w, h), report) = if texture {
        write_texture(&o, image, context)?
    } else if six {
        write_faces(&o, &image, context)?
    } else {
        let raster = target.arranged(image);
        ((raster.width, raster.height), write(&o, &o.output, raster, target, context)?)
    };
    if context.common.json {
        let name = o.output.file_name().map(|n| n.to_string_lossy());
        return context.print_json(json!({
            "output": name, "layout": target.name(), "width": w, "height": h,
            "clipped": report.clipped, "vanished": report.vanished, "lost": report.lost,
        }));
    }
    context.say(format_args!("{}: {} {w} x {h}", o.output.display(), target.name()));
    Ok(())
}

/// A reflectance as a table of measurements.
fn tabulated(spec: &str, path: &Path, context: &mut Context) -> Outcome {
    check_output(path, &MEASUREMENTS)?;
    context.tabulate(spec, path)?;
    if context.common.json {
        let name = path.file_name().map(|n| n.to_string_lossy());
        return context.print_json(json!({"output": name, "brdf": spec_without_folders(spec)}));
    }
    context.say(format_args!("{}: {spec}, 90 x 90 x 180 cells", path.display()));
    Ok(())
}

/// Pictures from many views under many lights as lobes by texel.
fn lobes(o: &Options, count: usize, context: &mut Context) -> Outcome {
    let csv = Path::new(&o.input).extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
    if !csv {
        let why = "--lobes are fitted to pictures that a .csv lists, as capture writes them";
        return Err(Failure::usage(format!("{}: {why}", o.input)));
    }
    let x = context.fit_lobes(Path::new(&o.input), count, &o.output)?;
    if context.common.json {
        return context.print_json(json!({
            "files": x.files, "width": x.width, "height": x.height, "pictures": x.pictures, "error": x.error,
        }));
    }
    context.say(format_args!(
        "{}: {} x {} texels of {} pictures, {:.2} % off: {}",
        o.output.display(),
        x.width,
        x.height,
        x.pictures,
        100.0 * x.error,
        x.files.join(", ")
    ));
    Ok(())
}

/// Photographs under known lights as a polynomial texture map.
fn polynomials(o: &Options, context: &mut Context) -> Outcome {
    check_output(&o.output, &POLYNOMIALS)?;
    let x = context.fit_polynomials(Path::new(&o.input), &o.output)?;
    if context.common.json {
        let name = o.output.file_name().map(|n| n.to_string_lossy());
        return context.print_json(json!({
            "output": name, "width": x.width, "height": x.height, "photographs": x.photographs,
            "condition": x.condition,
        }));
    }
    context.say(format_args!(
        "{}: {} x {} polynomials of {} photographs, condition number {:.2}",
        o.output.display(),
        x.width,
        x.height,
        x.photographs,
        x.condition
    ));
    Ok(())
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
    check_output(&o.output, &IMAGES)?;
    let part = o.map.unwrap_or(PolynomialPart::Normal);
    let raster = context.polynomial_map(Path::new(&o.input), part, o.basis.unwrap_or_default())?;
    let name = if part == PolynomialPart::Normal { "normals" } else { "albedo" };
    let mut options =
        WriteOptions { already_encoded: part == PolynomialPart::Normal, ..WriteOptions::default() };
    if o.half {
        options.exr_samples = ExrSamples::Half;
    }
    let report = context.write_image(&o.output, &raster, options)?;
    if context.common.json {
        let file = o.output.file_name().map(|n| n.to_string_lossy());
        return context.print_json(json!({
            "output": file, "map": name, "width": raster.width, "height": raster.height,
            "clipped": report.clipped, "vanished": report.vanished, "lost": report.lost,
        }));
    }
    context.say(format_args!("{}: {name}, {} x {}", o.output.display(), raster.width, raster.height));
    Ok(())
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
    check_output(&o.output, &HORIZONS)?;
    let mut places = Destinations::default();
    places.file("--output", &o.output)?;
    let usual = if o.half { TexelFormat::Rgba16f } else { TexelFormat::Rgba32f };
    let output = (o.output.as_path(), o.format.unwrap_or(usual));
    let x = context.horizons((Path::new(&o.input), o.relief), form, output)?;
    if context.common.json {
        let name = o.output.file_name().map(|n| n.to_string_lossy());
        return context.print_json(json!({
            "output": name, "width": x.width, "height": x.height, "layers": x.layers, "open": x.open,
            "clipped": x.written.clipped, "vanished": x.written.vanished, "lost": x.written.lost,
        }));
    }
    context.say(format_args!(
        "{}: {} x {} texels, {} layers; {:.1} % of the light of an even sky is left by the bumps",
        o.output.display(),
        x.width,
        x.height,
        x.layers,
        100.0 * x.open
    ));
    Ok(())
}

/// The input, turned and scaled, without its suns, whose file is written.
fn sunless(o: &Options, path: &Path, context: &mut Context) -> Result<SphereImage, Failure> {
    if o.level > 0 {
        return Err(Failure::usage("--extract-sun takes level 0"));
    }
    let mut lights = context.light(&o.input, &o.adjust.get())?;
    let taken = steradian_light::suns::take(&mut lights);
    inputs::write_suns(&taken, path, context)?;
    context.note(taken.metadata());
    Ok(lights.into_image())
}

/// The input, turned.
fn source(o: &Options, context: &mut Context) -> Result<SphereImage, Failure> {
    if is_sky(&o.input) {
        let still = Adjust { light_exposure: 0.0, ..o.adjust.get() };
        let lights = context.light(&o.input, &still)?;
        if !lights.disks.is_empty() {
            context.warn("the sun is part of the image now: a disk of texels");
        }
        return Ok(lights.with_disks_drawn());
    }
    let image = context.map(&o.input, &o.adjust.get(), o.level)?.image;
    if o.adjust.rotate == 0.0 {
        return Ok(image);
    }
    Ok(adjust::turned_about_y(&image, o.adjust.rotate))
}

/// Size of a face or of the whole image, and what the file could not hold.
type Done = ((usize, usize), WriteReport);

fn write(
    o: &Options,
    path: &Path,
    raster: Raster,
    target: Arrangement,
    context: &Context,
) -> Result<WriteReport, Failure> {
    let png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if let (true, Some(mapper)) = (png, o.tone_mapper) {
        let film = Film::from_raster(raster).ok_or_else(|| Failure::failed("the image has no colour"))?;
        let metadata = vec![("steradian.tone_mapper".to_string(), mapper.name().to_string())];
        context.write_display(path, &Develop { ev: 0.0, mapper }.film(&film), metadata)?;
        return Ok(WriteReport::default());
    }
    let mut options = WriteOptions { metadata: target.metadata(), ..WriteOptions::default() };
    if o.half {
        options.exr_samples = ExrSamples::Half;
    }
    Ok(context.write_image(path, &raster, options)?)
}

/// The files of the six faces.
fn faces(output: &Path) -> Vec<PathBuf> {
    let name = output.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let parts = ["px", "nx", "py", "ny", "pz", "nz"];
    parts.map(|part| output.with_file_name(name.replacen("{}", part, 1))).into()
}

fn write_faces(o: &Options, image: &SphereImage, context: &Context) -> Result<Done, Failure> {
    let mut all = WriteReport::default();
    for (face, path) in faces(&o.output).into_iter().enumerate() {
        let r = write(o, &path, arrangement::face(image, face), Arrangement::Cube, context)?;
        all.merge(r);
    }
    Ok(((image.width, image.height), all))
}

fn write_texture(o: &Options, image: SphereImage, context: &Context) -> Result<Done, Failure> {
    let usual = if o.half { TexelFormat::Rgba16f } else { TexelFormat::Rgba32f };
    let format = o.format.unwrap_or(usual);
    let report = context.write_cube(&o.output, &image, format, Vec::new())?;
    Ok(((image.width, image.height), report))
}

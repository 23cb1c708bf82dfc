//! `steradian prefilter`: an environment convolved with a kernel, as one map, a chain of levels, or an engine's files.

mod asked;
pub mod engines;
mod files;
mod method;

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, Adjust};
use crate::layouts::{self, Target};
use clap::Args;
use engines::{Curve, Engine, Files};
pub use files::{filament_numbers, irradiance};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use steradian_brdf::NormalKernel;
use steradian_formats::{TexelFormat, WriteOptions};
use steradian_light::load::{FileLayout, Profile};
use steradian_prefilter::{
    Deviation, FilteredImage, Lobe, Radial, Sampled, Zonal, deviation, filter_image, mirror_image,
};
use steradian_sphere::Layout;

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
    #[arg(long, value_name = "NAME", value_parser = texel_format)]
    format: Option<TexelFormat>,
    /// Relative RMS error [default: 2e-3]; with it a miss exits with 4, the rounding of the file's texels included
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// Texels of each level that are compared with the sum over all texels of the light
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 6)]
    check: u16,
    /// A way to prefilter by name, for comparison: auto, brute, truncated-angular, hierarchical, lat-long-angular,
    /// per-face, box-mip, dual-paraboloid or frequency
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = method::choice)]
    method: method::Choice,
    /// Takes suns and lamps out of the light before it is filtered, and writes them to this file as disk lights
    #[arg(long, value_name = "LIGHTS.json")]
    extract_sun: Option<PathBuf>,
    /// Folder for every level as a lat-long .exr
    #[arg(long, value_name = "DIR")]
    dump_levels: Option<PathBuf>,
    /// Name in the files' names [default: that of the input]
    #[arg(long, value_name = "NAME", value_parser = asked::file_name)]
    name: Option<String>,
    /// Arrangement of the input: latlong, cross, strip, angular, … [default: by its shape]
    #[arg(long, value_name = "NAME", value_parser = layout)]
    layout: Option<FileLayout>,
    /// Convention of the input: openexr, cmgen, usd, … [default: steradian, or what the file says]
    #[arg(long, value_name = "NAME", value_parser = convention)]
    input_profile: Option<&'static Profile>,
    /// Rotation of the light about +Y, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true, value_parser = inputs::finite)]
    rotate: f64,
    /// Exposure value by which the light is scaled
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = inputs::exposure)]
    light_exposure: f64,
}

const KERNELS: [&str; 8] =
    ["ggx", "beckmann", "charlie", "phong", "blinn-phong", "lambert", "gaussian", "spherical-gaussian"];
/// What precedes the spec of a reflectance.
const BRDF: &str = "brdf:";
/// Relative RMS error where nothing is asked for.
const TOLERANCE: f64 = 2e-3;

fn kernel_name(text: &str) -> Result<String, String> {
    if text.starts_with(BRDF) {
        return Ok(text.into());
    }
    let name = text.to_ascii_lowercase().replace('_', "-");
    let found = KERNELS.into_iter().find(|k| *k == name);
    found.map(String::from).ok_or_else(|| steradian_render::scenefile::unknown("kernel", text, &KERNELS))
}

fn unit(text: &str) -> Result<f64, String> {
    let v = inputs::finite(text)?;
    if (0.0..=1.0).contains(&v) { Ok(v) } else { Err(format!("'{text}' is not within 0 to 1")) }
}

fn texel_format(text: &str) -> Result<TexelFormat, String> {
    let names = TexelFormat::ALL.map(TexelFormat::name);
    TexelFormat::from_name(text).ok_or_else(|| steradian_render::scenefile::unknown("format", text, &names))
}

fn layout(text: &str) -> Result<FileLayout, String> {
    FileLayout::from_name(text).ok_or_else(|| format!("there is no layout '{text}'"))
}

fn convention(text: &str) -> Result<&'static Profile, String> {
    let names: Vec<&str> = steradian_light::load::PROFILES.iter().map(|p| p.name).collect();
    Profile::find(text).ok_or_else(|| steradian_render::scenefile::unknown("profile", text, &names))
}

/// What one map holds.
#[derive(Clone)]
struct Filter {
    /// `None`: a mirror.
    lobe: Option<Kernel>,
    /// Of the microfacet kernels.
    roughness: Option<f64>,
}

/// What a map is convolved with.
#[derive(Clone)]
enum Kernel {
    Lobe(Lobe),
    /// A reflectance at normal incidence.
    Radial(Arc<Radial>),
}

impl Kernel {
    fn zonal(&self) -> &dyn Zonal {
        match self {
            Self::Lobe(lobe) => lobe,
            Self::Radial(radial) => &**radial,
        }
    }

    /// How far its band coefficients may be from the reflectance's; nothing where they are known.
    fn accuracy(&self) -> f64 {
        match self {
            Self::Lobe(_) => 0.0,
            Self::Radial(radial) => radial.accuracy(),
        }
    }
}

/// One level, filtered.
struct Level {
    filter: Filter,
    filtered: FilteredImage,
    measured: Option<Deviation>,
    /// What the format of the file's texels changes, relative RMS.
    format_error: f64,
    seconds: f64,
    /// Where a way was asked for by name.
    by: Option<method::Work>,
}

/// A kernel of the family `name` at a perceptual roughness.
fn microfacet(name: &str, r: f64) -> Filter {
    let alpha = r * r;
    let lobe = match name {
        "charlie" => Some(Lobe::charlie(alpha)),
        _ if alpha == 0.0 => None,
        "beckmann" => Some(Lobe::beckmann(alpha)),
        _ => Some(Lobe::ggx(alpha)),
    };
    Filter { lobe: lobe.map(Kernel::Lobe), roughness: Some(r) }
}

fn has_roughness(name: &str) -> bool {
    matches!(name, "ggx" | "beckmann" | "charlie")
}

/// The kernel of a reflectance: f ⟨n·wi⟩ at n = wo, its channels' mean.
fn normal_incidence(spec: &str, context: &mut Context) -> Result<Kernel, Failure> {
    let kernel = NormalKernel::new(inputs::brdf(spec, context)?).ok_or_else(|| {
        Failure::usage(format!(
            "--kernel {BRDF}{spec}: is anisotropic; a filtered map needs an isotropic one"
        ))
    })?;
    let radial = Radial::new(|theta| kernel.at_angle(theta).iter().sum::<f64>() / 3.0);
    let radial = radial.ok_or_else(|| {
        Failure::usage(format!(
            "--kernel {BRDF}{spec}: reflects nothing, or no finite amount, at normal incidence"
        ))
    })?;
    Ok(Kernel::Radial(Arc::new(radial)))
}

/// The single kernel that the options name; `given` is that of a reflectance.
fn single(o: &Options, given: Option<Kernel>) -> Result<Filter, Failure> {
    if given.is_some() {
        return Ok(Filter { lobe: given, roughness: None });
    }
    let needs = |option: &str| Failure::usage(format!("--kernel {} needs {option}", o.kernel));
    let plain = |lobe| Ok(Filter { lobe: Some(Kernel::Lobe(lobe)), roughness: None });
    match o.kernel.as_str() {
        "lambert" => plain(Lobe::lambert()),
        "phong" => plain(Lobe::phong(o.exponent.ok_or_else(|| needs("--exponent"))?)),
        "blinn-phong" => plain(Lobe::blinn_phong(o.exponent.ok_or_else(|| needs("--exponent"))?)),
        "gaussian" => plain(Lobe::gaussian(o.sigma.ok_or_else(|| needs("--sigma"))?.to_radians())),
        "spherical-gaussian" => {
            let sigma = o.sigma.ok_or_else(|| needs("--sigma"))?;
            plain(Lobe::spherical_gaussian(sigma.to_radians()))
        }
        name => {
            let r = o.perceptual_roughness.or(o.alpha.map(f64::sqrt));
            Ok(microfacet(name, r.ok_or_else(|| needs("--perceptual-roughness or --alpha, or --levels"))?))
        }
    }
}

/// Everything that is to be made.
struct Plan {
    engine: &'static Engine,
    filters: Vec<Filter>,
    /// Width and height of level 0.
    size: (usize, usize),
    layout: Layout,
}

fn plan(o: &Options, given: Option<Kernel>) -> Result<Plan, Failure> {
    let raw = || Engine::parse("raw").map_err(Failure::failed);
    let engine = o.profile.map_or_else(raw, Ok)?;
    let extension = o.output.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    if matches!(engine.files, Files::LatLong { cube: None, .. }) {
        return panorama(o, engine);
    }
    let lat_long = o.profile.is_none() && matches!(extension.as_str(), "exr" | "hdr" | "pfm");
    if o.profile.is_none() && !lat_long && !matches!(extension.as_str(), "ktx2" | "ktx" | "dds") {
        let why = "the output is a .ktx2, .ktx, .dds, .exr, .hdr or .pfm file; with --profile it is a folder";
        return Err(Failure::usage(format!("{}: {why}", o.output.display())));
    }
    let target = if lat_long { Target::LatLong } else { Target::Cube };
    let usual = if lat_long { 4 * engine.size } else { engine.size };
    let size = layouts::side(o.size.unwrap_or((usual, usual)), target)?;
    let chain = o.profile.is_some() || o.levels.is_some();
    if !chain {
        let layout = if lat_long { Layout::LatLong } else { Layout::Cube };
        return Ok(Plan { engine, filters: vec![single(o, given)?], size, layout });
    }
    if lat_long {
        return Err(Failure::usage("--levels: a lat-long file has one level; --dump-levels writes them all"));
    }
    if !has_roughness(&o.kernel) || (o.profile.is_some() && o.kernel != "ggx") {
        return Err(Failure::usage(format!(
            "--kernel {}: chains go over the roughness of ggx{}",
            o.kernel,
            if o.profile.is_some() { "" } else { ", beckmann or charlie" }
        )));
    }
    if !size.0.is_power_of_two() {
        return Err(Failure::usage(format!("--size {}: the side of a chain is a power of two", size.0)));
    }
    let most = size.0.ilog2() as usize + 1;
    let whole = engine.unfiltered() || size.0 <= engine.last;
    let usual = if whole { 1 } else { (size.0 / engine.last).ilog2() as usize + 1 };
    let levels = o.levels.map_or(usual, usize::from);
    if levels > most {
        return Err(Failure::usage(format!(
            "--levels {levels}: {} texels a side have {most} at most",
            size.0
        )));
    }
    if o.profile.is_some_and(|e| e.name == "three") {
        asked::three(size.0, levels)?;
    }
    let filters = (0..levels).map(|m| microfacet(&o.kernel, engine.curve.roughness(m, levels - 1))).collect();
    Ok(Plan { engine, filters, size, layout: Layout::Cube })
}

/// The light as it is, lat-long; as large as the input where nothing else is asked for.
fn panorama(o: &Options, engine: &'static Engine) -> Result<Plan, Failure> {
    if o.levels.is_some_and(|l| l > 1) {
        let name = engine.name;
        return Err(Failure::usage(format!(
            "--levels: {name} filters by itself and takes one lat-long image"
        )));
    }
    let size = o.size.map_or(Ok((0, 0)), |s| layouts::side(s, Target::LatLong))?;
    Ok(Plan {
        engine,
        filters: vec![Filter { lobe: None, roughness: Some(0.0) }],
        size,
        layout: Layout::LatLong,
    })
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    o.method.verify(o.check)?;
    asked::options(&o)?;
    let given = o.kernel.strip_prefix(BRDF).map(|spec| normal_incidence(spec, context)).transpose()?;
    let mut plan = plan(&o, given)?;
    asked::destinations(&o)?;
    asked::memory(&plan, context)?;
    let adjust = Adjust {
        layout: o.layout,
        profile: o.input_profile,
        rotate: o.rotate,
        light_exposure: o.light_exposure,
    };
    let mut lights = inputs::light(&o.environment, &adjust, context)?;
    let suns = o.extract_sun.as_ref().map(|_| crate::suns::take(&mut lights));
    if let Some(taken) = &suns {
        context.note(taken.metadata());
    }
    let tolerance = o.tolerance.unwrap_or(TOLERANCE);
    let start = Instant::now();
    let diffuse = Lobe::lambert();
    let mut lobes: Vec<&dyn Zonal> =
        plan.filters.iter().filter_map(|f| f.lobe.as_ref().map(Kernel::zonal)).collect();
    if o.profile.is_some() {
        lobes.push(&diffuse);
    }
    let light = Sampled::of(lights, &lobes, tolerance, &context.task)?;
    if plan.size.0 == 0 {
        plan.size = (light.image.width, light.image.height);
        asked::memory(&plan, context)?;
    }
    let analysis = start.elapsed().as_secs_f64();
    let job = Job { light: &light, tolerance, check: o.check.into(), method: o.method };
    let mut levels = Vec::new();
    for (m, filter) in plan.filters.iter().enumerate() {
        let size = ((plan.size.0 >> m).max(1), (plan.size.1 >> m).max(1));
        levels.push(job.level(filter.clone(), (plan.layout, size.0, size.1), context)?);
    }
    let changes = files::format_errors(&o, &plan, &levels, context);
    levels.iter_mut().zip(changes).for_each(|(l, e)| l.format_error = e);
    let worst = levels.iter().map(Level::error).fold(0.0, f64::max);
    let how = if o.check > 0 { "measured" } else { "bound" };
    let packing = levels.iter().map(|l| l.format_error).fold(0.0, f64::max);
    let packing =
        if packing > 0.0 { format!(", {packing:.2e} of the texels' format") } else { String::new() };
    context.note_error(format!("relative RMS error {worst:.2e} ({how}{packing})"));
    let name = o.name.clone().unwrap_or_else(|| stem(&o.environment));
    let written = files::write(&o, &plan, &job, &levels, &name, context)?;
    if let Some(folder) = &o.dump_levels {
        dump(folder, &job, &plan, &name, context)?;
    }
    let format = o.format.unwrap_or(plan.engine.format);
    let snippet = o.profile.map(|e| engines::snippet(e, &name).replace("rgb9e5", format.name()));
    let mut document = report(&o, &plan, &job, &levels, analysis, &written, snippet.as_deref());
    if let (Some(path), Some(taken)) = (&o.extract_sun, &suns) {
        taken.write(path, context)?;
        document["suns"] = taken.json();
    }
    if context.common.json {
        context.print_json(document)?;
    } else {
        say(&levels, &written, context);
        if let Some(s) = snippet {
            context.print(&s)?;
        }
    }
    if o.tolerance.is_some() && worst > tolerance {
        return Err(Failure::missed(format!(
            "relative RMS error {worst:.2e} is above {tolerance:.2e} ({how}{packing})"
        )));
    }
    Ok(())
}

/// The prepared light and what is asked of every level.
struct Job<'a> {
    light: &'a Sampled,
    tolerance: f64,
    check: usize,
    method: method::Choice,
}

impl Job<'_> {
    fn level(
        &self,
        filter: Filter,
        shape: (Layout, usize, usize),
        context: &Context,
    ) -> Result<Level, Failure> {
        let start = Instant::now();
        let mut by = None;
        let filtered = match (&filter.lobe, self.method.0) {
            (Some(lobe), Some(way)) => {
                let (made, work) =
                    method::filter(way, self.light, lobe.zonal(), shape, self.tolerance, context)?;
                by = Some(work);
                made
            }
            (Some(lobe), None) => {
                filter_image(self.light, lobe.zonal(), shape, self.tolerance, &context.task)?
            }
            (None, _) => mirror_image(self.light, shape),
        };
        let seconds = start.elapsed().as_secs_f64();
        context.task.check()?;
        let lobe = filter.lobe.as_ref().filter(|_| self.check > 0);
        let measured = lobe.map(|l| deviation(self.light, l.zonal(), &filtered.image, self.check));
        Ok(Level { filter, filtered, measured, format_error: 0.0, seconds, by })
    }
}

impl Level {
    /// Relative RMS error of the file: the filter's, measured where it was, and the texel format's, which are
    /// independent.
    fn error(&self) -> f64 {
        self.measured.map_or(self.filtered.predicted, |m| m.rms).hypot(self.format_error)
    }
}

/// A name without folders, extensions and odd characters.
fn stem(environment: &str) -> String {
    let path = Path::new(environment);
    let stem = if inputs::is_sky(environment) { None } else { path.file_stem() };
    let text = stem.map_or_else(|| environment.to_string(), |s| s.to_string_lossy().into_owned());
    let clean = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    text.chars().map(clean).take(80).collect()
}

fn dump(folder: &Path, job: &Job<'_>, plan: &Plan, name: &str, context: &Context) -> Outcome {
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::failed(format!("{}: cannot write: {e}", folder.display())))?;
    let quick = Job { check: 0, ..*job };
    for (m, filter) in plan.filters.iter().enumerate() {
        let n = (plan.size.0 >> m).max(1);
        let (w, h) = if plan.layout == Layout::LatLong { plan.size } else { (4 * n, 2 * n) };
        let level = quick.level(filter.clone(), (Layout::LatLong, w, h), context)?;
        let raster = layouts::arranged(level.filtered.image, Target::LatLong);
        let options =
            WriteOptions { metadata: layouts::metadata(Target::LatLong), ..WriteOptions::default() };
        context.write_image(&folder.join(format!("{name}_level{m}.exr")), &raster, options)?;
    }
    Ok(())
}

fn report(
    o: &Options,
    plan: &Plan,
    job: &Job<'_>,
    levels: &[Level],
    analysis: f64,
    written: &[files::Written],
    snippet: Option<&str>,
) -> Value {
    let rows: Vec<Value> = levels.iter().enumerate().map(|(m, l)| row(m, l)).collect();
    let chain = levels.len() > 1;
    let curve: Option<Curve> = chain.then_some(plan.engine.curve);
    json!({
        "kernel": o.kernel,
        "profile": o.profile.map(|e| e.name),
        "profile_doc": o.profile.map(|e| e.doc),
        "curve": curve.map(Curve::name),
        "tolerance": job.tolerance,
        "analysis": {
            "order": job.light.order(),
            "suns": job.light.suns().len(),
            "bright_texels": job.light.sparks().len(),
            "seconds": analysis,
        },
        "levels": rows,
        "files": written.iter().map(files::Written::json).collect::<Vec<_>>(),
        "snippet": snippet,
    })
}

/// A level in the report. Errors are relative RMS: `predicted_error` and `measured_error` of the filter, `format_error`
/// of the texels' format (what comes back from the file less what was given), `error` of the file, which is the root of
/// the sum of squares of the last two.
fn row(m: usize, l: &Level) -> Value {
    let f = &l.filtered;
    let measured =
        l.measured.map(|d| json!({"rms": d.rms, "bias": d.bias, "worst": d.worst, "texels": d.texels}));
    let mut row = json!({
        "level": m,
        "width": f.image.width,
        "height": f.image.height,
        "perceptual_roughness": l.filter.roughness,
        "alpha": l.filter.roughness.map(|r| r * r),
        "way": f.way.name(),
        "order": f.way.order(),
        "kernel_accuracy": l.filter.lobe.as_ref().map(Kernel::accuracy),
        "predicted_error": f.predicted,
        "measured_error": measured,
        "format_error": l.format_error,
        "error": l.error(),
        "energy_in": f.energy_in,
        "energy_out": f.energy_out,
        "raised_to_zero": f.clipped,
        "seconds": l.seconds,
    });
    if let Some(work) = &l.by {
        work.report(&mut row);
    }
    row
}

fn say(levels: &[Level], written: &[files::Written], context: &Context) {
    for (m, l) in levels.iter().enumerate() {
        let f = &l.filtered;
        let r = l.filter.roughness.map(|r| format!(" r {r:.3}")).unwrap_or_default();
        let e = l
            .measured
            .map(|d| format!(", error rms {:.1e} worst {:.1e}", d.rms, d.worst))
            .unwrap_or_default();
        let engine = || format!("{} to band {}", f.way.name(), f.way.order());
        let way = l.by.as_ref().map_or_else(engine, |work| work.name().into());
        context.say(format_args!(
            "level {m}: {} x {}{r}, {way}{e}, {:.0} ms",
            f.image.width,
            f.image.height,
            l.seconds * 1e3
        ));
    }
    for w in written {
        context.say(&w.name);
    }
}

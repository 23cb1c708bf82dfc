//! `steradian prefilter`: an environment convolved with a kernel, as one map, a chain of levels, or an engine's files.

mod asked;
mod beside;
mod files;
mod gltf;
mod method;
mod packing;
mod plan;
mod report;
mod snippet;

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, Adjust};
use beside::Beside;
use clap::Args;
pub use files::{filament_numbers, irradiance};
use packing::Packed;
use plan::{Filter, Kernel, Plan};
use report::Clock;
use std::path::{Path, PathBuf};
use std::time::Instant;
use steradian_formats::{TexelFormat, WriteOptions};
use steradian_light::load::{Arrangement, FileLayout, Profile};
use steradian_prefilter::{Deviation, FilteredImage, Sampled, Zonal, deviation, filter_image, mirror_image};
use steradian_sphere::Layout;
use steradian_verify::engines::{ENGINES, Engine};

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
    #[arg(long, value_name = "NAME", value_parser = engine)]
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
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = method::choice)]
    method: method::Choice,
    /// Takes suns and lamps out of the light before it is filtered, and writes them to this file as disk lights: the flux, direction and
    /// size of their texels, not their outline, which lobes as sharp as a texel show beside the sun
    #[arg(long, value_name = "LIGHTS.json")]
    extract_sun: Option<PathBuf>,
    /// Folder for every level as a lat-long .exr
    #[arg(long, value_name = "DIR")]
    dump_levels: Option<PathBuf>,
    /// Name in the names of the files of --profile and --dump-levels [default: that of the input]
    #[arg(long, value_name = "NAME", value_parser = asked::file_name)]
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
    found.map(String::from).ok_or_else(|| steradian_base::unknown("kernel", text, &KERNELS))
}

fn engine(text: &str) -> Result<&'static Engine, String> {
    let names = ENGINES.map(|e| e.name);
    Engine::find(text).ok_or_else(|| steradian_base::unknown("profile", text, &names))
}

fn unit(text: &str) -> Result<f64, String> {
    let v = inputs::finite(text)?;
    if (0.0..=1.0).contains(&v) { Ok(v) } else { Err(format!("'{text}' is not within 0 to 1")) }
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

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let mut clock = Clock::start();
    o.method.verify(o.check)?;
    asked::options(&o)?;
    let given = o.kernel.strip_prefix(BRDF).map(|spec| plan::normal_incidence(spec, context)).transpose()?;
    let mut plan = plan::plan(&o, given)?;
    asked::destinations(&o)?;
    asked::memory(&o, &plan, context)?;
    let adjust = Adjust {
        layout: o.layout,
        profile: o.input_profile,
        rotate: o.rotate,
        light_exposure: o.light_exposure,
    };
    let mut lights = inputs::light(&o.environment, &adjust, context)?;
    let suns = o.extract_sun.as_ref().map(|_| steradian_light::suns::take(&mut lights));
    if let Some(taken) = &suns {
        context.note(taken.metadata());
    }
    clock.lap("reading");
    let tolerance = o.tolerance.unwrap_or(TOLERANCE);
    let others = if o.profile.is_some() { beside::kernels(&plan) } else { Vec::new() };
    let lobes = plan.filters.iter().filter_map(|f| f.lobe.as_ref());
    let lobes: Vec<&dyn Zonal> = lobes.chain(&others).map(Kernel::zonal).collect();
    let light = Sampled::of(lights, &lobes, tolerance, &context.task)?;
    if plan.size.0 == 0 {
        plan.size = (light.image.width, light.image.height);
        asked::memory(&o, &plan, context)?;
    }
    clock.lap("analysis");
    let job = Job { light: &light, tolerance, check: o.check.into(), method: o.method };
    let mut levels = Vec::new();
    for (m, filter) in plan.filters.iter().enumerate() {
        let size = ((plan.size.0 >> m).max(1), (plan.size.1 >> m).max(1));
        levels.push(job.level(filter.clone(), (plan.layout, size.0, size.1), context)?);
    }
    let mut beside = match o.profile {
        Some(_) => Beside::new(&plan, &job, &levels, context)?,
        None => Beside::nothing(),
    };
    clock.lap("filtering");
    let mut packed = Packed::new(&o, &plan, &mut levels, &mut beside)?;
    let all = || levels.iter().chain(beside.maps().map(|(_, l)| l));
    let worst = all().map(Level::error).fold(0.0, f64::max);
    let how = if o.check > 0 { "measured" } else { "bound" };
    let packing = all().map(|l| l.format_error).fold(0.0, f64::max);
    let packing =
        if packing > 0.0 { format!(", {packing:.2e} of the texels' format") } else { String::new() };
    context.note_error(format!("relative RMS error {worst:.2e} ({how}{packing})"));
    packed.sign(context);
    clock.lap("packing");
    let name = o.name.clone().unwrap_or_else(|| stem(&o.environment));
    let written = files::write(&o, &plan, packed, &levels, &beside, &name, context)?;
    clock.lap("writing");
    if let Some(folder) = &o.dump_levels {
        dump(folder, &job, &plan, &name, context)?;
        clock.lap("dumping");
    }
    let format = plan.with_format(&o).format;
    let snippet = o.profile.map(|e| snippet::snippet(e, &name).replace("rgb9e5", format.name()));
    let made = report::Made { levels: &levels, beside: &beside, written: &written };
    let mut document = report::report(&o, &plan, &job, &made, clock, snippet.as_deref());
    if let (Some(path), Some(taken)) = (&o.extract_sun, &suns) {
        crate::suns::write(taken, path, context)?;
        document["suns"] = taken.json();
    }
    if context.common.json {
        context.print_json(document)?;
    } else {
        report::say(&made, context);
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
        let raster = Arrangement::LatLong.arranged(level.filtered.image);
        let options = WriteOptions { metadata: Arrangement::LatLong.metadata(), ..WriteOptions::default() };
        context.write_image(&folder.join(format!("{name}_level{m}.exr")), &raster, options)?;
    }
    Ok(())
}

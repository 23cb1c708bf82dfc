//! `steradian prefilter`: an environment convolved with a kernel, as one map, a chain of levels, or an
//! engine's files.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::{inputs, names};
use clap::Args;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use steradian_engines::{Engine, MethodChoice, Request, kernel_name};
use steradian_formats::TexelFormat;
use steradian_light::load::{FileLayout, Profile};
use steradian_session::prefilter;
use steradian_session::{Adjust, Destinations, check_replaced, is_sky, light_mark, probe_of};

/// Options of `steradian prefilter`.
#[derive(Debug, Args)]
pub struct Options {
    /// Images or sky specs; a folder or a pattern with * stands for the images in it, a file that `probes
    /// --image` wrote for its probes, or FILE#N for one
    #[arg(value_name = "ENV", required = true, num_args = 1..)]
    environment: Vec<String>,
    /// Output: .ktx2 .ktx .dds (a cube), .exr .hdr .pfm (lat-long); with --profile a folder, with several
    /// profiles the folder of theirs; {} in a file's name stands for the input's
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    #[arg(long, value_name = "NAME|brdf:SPEC", default_value = Request::KERNEL, value_parser = kernel_name, help = names::kernels())]
    kernel: String,
    #[arg(long, value_name = "R", allow_negative_numbers = true, value_parser = unit, help = names::kernel_parameter("Perceptual roughness, 0 (a mirror) to 1,", "perceptual-roughness"))]
    perceptual_roughness: Option<f64>,
    #[arg(long, value_name = "A", allow_negative_numbers = true, value_parser = unit, conflicts_with = "perceptual_roughness", help = names::kernel_parameter("Perceptual roughness squared", "alpha"))]
    alpha: Option<f64>,
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = inputs::positive, help = names::kernel_parameter("Exponent", "exponent"))]
    exponent: Option<f64>,
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = inputs::positive, help = names::kernel_parameter("Standard deviation in degrees", "sigma"))]
    sigma: Option<f64>,
    #[arg(long, value_name = "NAME", value_parser = Engine::parse, value_delimiter = ',', help = format!("Files of an engine: {}; several, separated by commas", names::engines()))]
    profile: Vec<&'static Engine>,
    /// Side of level 0; of a lat-long image the width, or WIDTHxHEIGHT [default: 256, or the profile's]
    #[arg(long, value_name = "N|WxH", value_parser = super::render::size)]
    size: Option<(usize, usize)>,
    /// Levels of a chain, from a mirror to perceptual roughness 1 [default: one, or the profile's]
    #[arg(long, value_name = "L", value_parser = clap::value_parser!(u8).range(1..=16))]
    levels: Option<u8>,
    #[arg(long, value_name = "NAME", value_parser = TexelFormat::parse, help = format!("Texels of a cube: {} [default: 32-bit floats, or the profile's]", names::formats()))]
    format: Option<TexelFormat>,
    /// Relative RMS error [default: 2e-3]; with it a miss exits with 4, the rounding of the file's texels
    /// included
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// Texels of each level that are compared with the integral over all texels of the light: some spread
    /// evenly, most where the level is bright
    #[arg(long, value_name = "N", allow_negative_numbers = true, default_value_t = 64)]
    check: u16,
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = MethodChoice::parse, help = names::methods())]
    method: MethodChoice,
    /// Takes suns and lamps out of the light before it is filtered, and writes them to this file as disk
    /// lights: the flux, direction and size of their texels, not their outline, which lobes as sharp as a
    /// texel show beside the sun
    #[arg(long, value_name = "LIGHTS.json")]
    extract_sun: Option<PathBuf>,
    /// Folder for every level as a lat-long .exr
    #[arg(long, value_name = "DIR")]
    dump_levels: Option<PathBuf>,
    /// Name in the names of the files of --profile and --dump-levels, or where these are fixed of their
    /// folder [default: that of the input]
    #[arg(long, value_name = "NAME", value_parser = file_name)]
    name: Option<String>,
    /// Arrangement of the input: latlong, cross, strip, angular, … [default: by its shape]
    #[arg(long, value_name = "NAME", value_parser = FileLayout::parse)]
    layout: Option<FileLayout>,
    #[arg(long, value_name = "NAME", value_parser = Profile::parse, help = format!("Convention of the input: {} [default: steradian, or what the file says]", names::profiles()))]
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

/// One input for one consumer.
struct Job {
    environment: String,
    engine: Option<&'static Engine>,
    output: PathBuf,
    name: String,
    /// Files of fixed names go into a folder called by `name`.
    own_folder: bool,
}

/// Every input for every consumer.
fn jobs(o: &Options, context: &mut Context) -> Result<Vec<Job>, Failure> {
    let mut inputs = Vec::new();
    for spec in &o.environment {
        inputs.extend(context.lights_of(spec)?);
    }
    inputs.iter().for_each(|file| context.reads(Path::new(file)));
    let (several, profiles) = (inputs.len() > 1, o.profile.len() > 1);
    let names: Vec<String> = inputs.iter().map(|i| o.name.clone().unwrap_or_else(|| stem(i))).collect();
    let twice = names.iter().enumerate().find(|(i, n)| names[..*i].contains(n));
    if let Some((_, name)) = twice {
        let why = "several inputs would have it: their files would replace one another";
        return Err(Failure::usage(format!("name '{name}': {why}")));
    }
    let file = o.output.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let engines: Vec<Option<&'static Engine>> =
        if o.profile.is_empty() { vec![None] } else { o.profile.iter().copied().map(Some).collect() };
    if several && o.profile.is_empty() && !file.contains("{}") {
        let why = "several inputs need a {} in the output's name, such as rough-{}.ktx2";
        return Err(Failure::usage(format!("{}: {why}", o.output.display())));
    }
    let mut out = Vec::new();
    for (environment, name) in inputs.into_iter().zip(names) {
        for engine in &engines {
            let output = match engine {
                Some(e) if profiles => o.output.join(e.name),
                Some(_) => o.output.clone(),
                None => o.output.with_file_name(file.replacen("{}", &name, 1)),
            };
            let own_folder = several || o.name.is_some();
            let (environment, name) = (environment.clone(), name.clone());
            out.push(Job { environment, engine: *engine, output, name, own_folder });
        }
    }
    if out.len() > 1 && o.extract_sun.is_some() {
        return Err(Failure::usage("--extract-sun names one file: give one input and one profile"));
    }
    Ok(out)
}

fn request(o: &Options, job: &Job, context: &mut Context) -> Result<Request, Failure> {
    if o.name.is_some() && o.profile.is_empty() && o.dump_levels.is_none() {
        let why = "names the files of --profile and --dump-levels; --output names this one";
        return Err(Failure::usage(format!("--name {why}")));
    }
    let mut request = Request {
        output: job.output.clone(),
        name: job.name.clone(),
        own_folder: job.own_folder,
        kernel: o.kernel.clone(),
        brdf: None,
        perceptual_roughness: o.perceptual_roughness,
        alpha: o.alpha,
        exponent: o.exponent,
        sigma: o.sigma,
        engine: job.engine,
        size: o.size,
        levels: o.levels.map(usize::from),
        format: o.format,
        tolerance: o.tolerance.unwrap_or(Request::TOLERANCE),
        check: o.check.into(),
        method: o.method,
        dump: o.dump_levels.is_some(),
        suns: Vec::new(),
    };
    request.brdf = request.brdf_spec().map(|spec| context.brdf(spec)).transpose()?;
    // Refused before any work.
    request.plan(context.common.max_memory)?;
    destinations(o, job, context)?;
    if let Some(file) = request.fixed_file() {
        check_replaced(&file, &light_mark(&job.environment), &context.limits())?;
    }
    Ok(request)
}

/// Refuses outputs that cannot be written, or of which one would replace another.
fn destinations(o: &Options, job: &Job, context: &mut Context) -> Outcome {
    let mut places = Destinations::default();
    match job.engine {
        None => {
            places.file("--output", &job.output)?;
            context.writes(&job.output)?;
        }
        // The folder of several profiles is made; one of a single profile is made in a folder that is there.
        Some(_) => places.folder(&job.output, o.profile.len() > 1)?,
    }
    if let Some(folder) = &o.dump_levels {
        places.folder(folder, true)?;
    }
    if let Some(path) = &o.extract_sun {
        places.file("--extract-sun", path)?;
        context.writes(path)?;
    }
    Ok(())
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let jobs = jobs(&o, context)?;
    let (several, mut documents, mut failures) = (jobs.len() > 1, Vec::new(), Vec::new());
    // What cannot be met is refused before any work.
    for job in &jobs {
        request(&o, job, context)?;
    }
    if let Some(bars) = context.bars().filter(|_| several) {
        bars.begin_batch(jobs.len() as u64);
    }
    for (k, job) in jobs.iter().enumerate() {
        if several {
            context.say(format_args!("{}: {}", job.environment, job.output.display()));
            if let Some(bars) = context.bars() {
                bars.next_of_batch(&job.name, k as u64);
            }
        }
        match one(&o, job, context) {
            Ok((document, miss)) => {
                documents.push(document);
                let named = |why| if several { format!("{}: {why}", job.environment) } else { why };
                failures.extend(miss.map(|why| Failure::missed(named(why))));
            }
            // One input that cannot be read is no reason to leave the others out.
            Err(f) if several && !f.message.is_empty() && context.check().is_ok() => {
                context.say(&f.message);
                documents.push(json!({"environment": job.environment, "failed": f.message}));
                failures.push(f);
            }
            Err(f) => return Err(f),
        }
    }
    if let Some(bars) = context.bars().filter(|_| several) {
        bars.end_batch();
    }
    if context.common.json {
        let document = if several { json!({ "outputs": documents }) } else { documents.remove(0) };
        context.print_json(document)?;
    }
    all_failures(failures, jobs.len())
}

/// The failures of `outputs` outputs in one line, with the code of the first.
fn all_failures(failures: Vec<Failure>, outputs: usize) -> Outcome {
    let Some(first) = failures.first() else { return Ok(()) };
    if outputs == 1 {
        return Err(first.clone());
    }
    let (code, count) = (first.code, failures.len());
    // An input that is damaged fails for every profile alike.
    let mut whys: Vec<String> = failures.into_iter().map(|f| f.message).collect();
    whys.dedup();
    Err(Failure { code, message: format!("{count} of {outputs} outputs failed: {}", whys.join("; ")) })
}

/// Makes and writes one output; its report, and the miss where its tolerance was missed.
fn one(o: &Options, job: &Job, context: &mut Context) -> Result<(Value, Option<String>), Failure> {
    context.begin_output();
    let map = request(o, job, context)?;
    if let Some(folder) = job.output.parent().filter(|_| job.engine.is_some() && o.profile.len() > 1) {
        std::fs::create_dir_all(folder)
            .map_err(|e| Failure::failed(format!("{}: cannot write: {e}", folder.display())))?;
    }
    let adjust = Adjust {
        layout: o.layout,
        profile: o.input_profile,
        rotate: o.rotate,
        light_exposure: o.light_exposure,
    };
    let (environment, extract_suns) = (job.environment.clone(), o.extract_sun.is_some());
    let asked = prefilter::Request { environment, adjust, map, extract_suns, dump: o.dump_levels.clone() };
    let (done, missed) = context.prefilter(asked)?.even_if_missed();
    if let (Some(path), Some(taken)) = (&o.extract_sun, &done.suns) {
        inputs::write_suns(taken, path, context)?;
    }
    if !context.common.json {
        done.lines().iter().for_each(|line| context.say(line));
        if let Some(s) = done.made.snippet() {
            context.print(&s)?;
        }
    }
    // A tolerance that nobody named is an aim.
    let missed = missed.filter(|_| o.tolerance.is_some()).map(|m| done.missed(m));
    Ok((done.document(), missed))
}

/// A name without folders, extensions and odd characters.
fn stem(environment: &str) -> String {
    if let Some((path, k)) = probe_of(environment) {
        return format!("{}-{k}", stem(&path.display().to_string()));
    }
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

//! `steradian probes`: the light of a scene at many places.

use super::render;
use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, AdjustArgs, ExtraLights};
use clap::Args;
use glam::DVec3;
use serde_json::json;
use std::path::PathBuf;
use steradian_session::file_name;
use steradian_session::probes::{Request, Where};

/// Options of `steradian probes`.
#[derive(Debug, Args)]
pub struct Options {
    /// Scene file (.toml), mesh file, or built-in shape
    #[arg(value_name = "SCENE|MESH|SHAPE")]
    input: String,
    /// Probes along x, y and z, in the middles of equal parts of the scene's bounds
    #[arg(long, value_name = "X,Y,Z", value_parser = counts, required_unless_present = "at", conflicts_with = "at")]
    grid: Option<[u32; 3]>,
    /// Corners of the grid, its first probe and its last, in place of the scene's bounds
    #[arg(long, value_name = "X,Y,Z,X,Y,Z", allow_hyphen_values = true, value_parser = bounds, requires = "grid")]
    bounds: Option<[DVec3; 2]>,
    /// CSV of places with columns px,py,pz in place of a grid; - is standard input
    #[arg(long, value_name = "FILE.csv")]
    at: Option<PathBuf>,
    /// Bands of spherical harmonics, 1 to 64
    #[arg(long, value_name = "B", default_value_t = 5)]
    bands: usize,
    /// Rows of a lat-long image that each probe gets beside its harmonics, for reflectances sharper than
    /// these
    #[arg(long, value_name = "ROWS")]
    image: Option<usize>,
    /// Paths of a texel of --image
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(2..=65_536), requires = "image")]
    texel_paths: u32,
    /// Reflections of a path at most; 1 is light that surfaces reflect once
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=1000))]
    bounces: u32,
    /// Noise at which to stop: the standard error of a probe's coefficients over their size; a miss exits 4
    #[arg(long, value_name = "X", default_value_t = 0.02, allow_negative_numbers = true, value_parser = inputs::positive)]
    noise: f64,
    /// Seed of the random numbers
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Light of the scene: an image, or a sky spec [default: what the scene file says; of a mesh the sky, or
    /// none beside --light and --sun-lights]
    #[arg(short, long, value_name = "FILE|SKY")]
    environment: Option<String>,
    #[command(flatten)]
    adjust: AdjustArgs,
    #[command(flatten)]
    lights: ExtraLights,
    /// Reflectance of a mesh [default: what its file says, else lambert:albedo=0.6]
    #[arg(short, long, value_name = "SPEC")]
    brdf: Option<String>,
    /// Output: .safetensors
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
}

fn counts(text: &str) -> Result<[u32; 3], String> {
    let bad = || format!("'{text}' is not X,Y,Z, three numbers of probes from 1");
    let parts: Vec<u32> =
        text.split(',').map(|p| p.trim().parse().map_err(|_| bad())).collect::<Result<_, _>>()?;
    <[u32; 3]>::try_from(parts).ok().filter(|n| n.iter().all(|n| *n > 0)).ok_or_else(bad)
}

fn bounds(text: &str) -> Result<[DVec3; 2], String> {
    let bad = || format!("'{text}' is not X,Y,Z,X,Y,Z, the smallest corner and the largest");
    let v: Vec<f64> = text.split(',').map(|p| inputs::finite(p.trim())).collect::<Result<_, _>>()?;
    let [a, b, c, d, e, f] = v[..] else { return Err(bad()) };
    let (lo, hi) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
    if lo.cmple(hi).all() && lo.abs().max(hi.abs()).max_element() <= 1e15 { Ok([lo, hi]) } else { Err(bad()) }
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    context.check_output(&o.output, &["safetensors"])?;
    let at = match (o.grid, &o.at) {
        (Some(n), _) => {
            let [lo, hi] = o.bounds.unwrap_or([DVec3::ZERO, DVec3::ONE]);
            if let Some(k) = (0..3).find(|&k| n[k] > 1 && lo[k] >= hi[k]) {
                let why = format!(
                    "--bounds have no extent along {}, where --grid asks for {} probes: they would lie in one place",
                    ["x", "y", "z"][k],
                    n[k]
                );
                return Err(Failure::usage(why));
            }
            Where::Grid(n, o.bounds)
        }
        (None, Some(path)) => {
            let table = context.read_table(path)?;
            let p = table.vectors(["px", "py", "pz"])?;
            if p.is_empty() {
                return Err(Failure::input(format!("{}: has no points", path.display())));
            }
            Where::Points(p.into_iter().map(DVec3::from).collect())
        }
        (None, None) => return Err(Failure::usage("say where: --grid X,Y,Z or --at FILE.csv")),
    };
    let scene = render::Options {
        input: o.input,
        environment: o.environment,
        adjust: o.adjust,
        lights: o.lights,
        brdf: o.brdf,
        ..render::Options::default()
    };
    let scene = render::scene(&scene, context)?;
    let image = o.image.map(|rows| (rows, o.texel_paths));
    let request = Request {
        at,
        bands: o.bands,
        bounces: o.bounces,
        noise: o.noise,
        seed: o.seed,
        image,
        output: Some(o.output.clone()),
    };
    let (done, missed) = context.capture(&scene, &request)?.even_if_missed();
    let (n, inside) = (done.field.light.len(), done.inside());
    let (noise, image_noise, paths, seconds) = (done.noise, done.image_noise, done.paths, done.seconds);
    let resumed = done.resumed;
    context.write_probes(done, &o.output)?;
    context.report(
        || {
            json!({
                "output": file_name(&o.output),
                "probes": n,
                "inside": inside,
                "bands": request.bands,
                "noise": noise,
                "image_noise": image_noise,
                "paths": paths,
                "resumed_parts": resumed,
                "seconds": seconds,
            })
        },
        || {
            let (path, noise) = (o.output.display(), 100.0 * noise);
            let images = image_noise.map_or(String::new(), |n| format!(" (of images {:.1} %)", 100.0 * n));
            [format!(
                "{path}: {n} probes, {inside} inside solids, noise at most {noise:.2} %{images}, {seconds:.2} s"
            )]
        },
    )?;
    missed.map_or(Ok(()), |m| Err(Failure::missed(format!("{m} (the noisiest probe)"))))
}

//! `steradian render`: a lit picture of a mesh, a built-in shape or a scene file.

mod report;
mod scene;
mod values;

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, AdjustArgs, ExtraLights, LocalArg, PathArgs, ShadowArg};
use clap::Args;
use report::report;
pub use scene::scene;
use std::path::{Path, PathBuf};
use steradian_formats::{Raster, WriteOptions};
use steradian_render::scenefile::SceneBackground;
use steradian_render::{NormalFiltering, ToneMapper};
use steradian_session::{ANIMATION, Backend, FRAME_RATE, Method, Renderer, Scene, is_animation};
pub use values::{Exposure, blur, exposure, size, tone_mapper};
use values::{background, normal_filtering};

/// Options of `steradian render`.
#[derive(Debug, Default, Args)]
pub struct Options {
    /// Scene file (.toml), mesh file, or built-in shape
    #[arg(value_name = "SCENE|MESH|SHAPE")]
    pub input: String,
    /// Output: .png is tone-mapped; .exr, .hdr and .pfm are linear
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Light: an image, or a sky spec such as sky:elevation=35 [default: sky, or none beside --light and
    /// --sun-lights]
    #[arg(short, long, value_name = "FILE|SKY")]
    pub environment: Option<String>,
    #[command(flatten)]
    pub adjust: AdjustArgs,
    #[command(flatten)]
    pub lights: ExtraLights,
    #[command(flatten)]
    pub local: LocalArg,
    /// Reflectance of the mesh, such as ggx:alpha=0.2; the base colours of its file multiply it [default:
    /// what the file says, else lambert:albedo=0.6]
    #[arg(short, long, value_name = "SPEC")]
    pub brdf: Option<String>,
    /// Technique, or reference, which integrates at every point and takes longer [default: the technique of
    /// the smallest error in this picture that some processor seconds find; with --tolerance the smallest
    /// that meets it]
    #[arg(short, long, value_name = "SLUG")]
    pub technique: Option<String>,
    /// Parameter of the named technique
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = inputs::parameter)]
    pub params: Vec<inputs::Parameter>,
    /// A saved bake (.safetensors, or the folder of one) in place of reflectance and technique; --rotate
    /// turns its light, --environment is seen behind the surfaces [default: the sky that it was baked from,
    /// or nothing]
    #[arg(long, value_name = "FILE", conflicts_with_all = ["sun_lights", "light", "suns", "local", "brdf", "technique", "params"])]
    pub bake: Option<PathBuf>,
    /// Transfer of the mesh's vertices, as `transfer` writes it, in place of rays for techniques that bake on
    /// the mesh
    #[arg(long, value_name = "FILE", requires = "technique", conflicts_with_all = ["bake", "ground"])]
    pub transfer: Option<PathBuf>,
    /// Relative RMS error of radiance asked for, such as 0.01; a miss exits 4
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    pub tolerance: Option<f64>,
    /// Image that multiplies the net reflectance, in place of the file's base colours
    #[arg(long, visible_alias = "base-color", value_name = "FILE")]
    pub base_color_texture: Option<PathBuf>,
    /// Tangent-space normal map, green up (as in glTF), in place of the file's
    #[arg(long, value_name = "FILE")]
    pub normal_map: Option<PathBuf>,
    /// Factor of the bumps of --normal-map [default: 1]
    #[arg(long, value_name = "S", value_parser = inputs::finite, allow_negative_numbers = true, requires = "normal_map")]
    pub normal_scale: Option<f64>,
    /// Image of perceptual roughness (its green channel), in place of the reflectance's
    #[arg(long, value_name = "FILE")]
    pub roughness_map: Option<PathBuf>,
    /// How the normals under a pixel are filtered: covariance (along their spread), isotropic (rounder
    /// highlights, less work) or none (highlights of distant bumps alias) [default: covariance]
    #[arg(long, value_name = "HOW", value_parser = normal_filtering)]
    pub normal_filtering: Option<NormalFiltering>,
    /// Light that varies over space, as `probes` writes it, in place of every light of the scene;
    /// --environment is seen behind the surfaces
    #[arg(long, value_name = "FILE", conflicts_with_all = ["sun_lights", "light", "suns", "local", "bake", "orbit"])]
    pub probes: Option<PathBuf>,
    /// Moves the mesh, metres, before the camera is placed
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = inputs::vector)]
    pub translate: Option<[f64; 3]>,
    #[command(flatten)]
    pub paths: PathArgs,
    /// With path: the variance of each pixel's radiance
    #[arg(long, value_name = "FILE.exr|FILE.pfm")]
    pub variance: Option<PathBuf>,
    #[command(flatten)]
    pub shadows: ShadowArg,
    /// Leave out the materials of the mesh file
    #[arg(long)]
    pub plain: bool,
    /// Size of the picture, pixels [default: 512x512, or what the scene file says]
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(usize, usize)>,
    /// Exposure in stops (EV) before the tone mapper of .png, or auto [default: auto]
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure)]
    pub exposure: Option<Exposure>,
    /// Tone mapper of .png: linear, reinhard, aces, agx, neutral, … [default: neutral]
    #[arg(long, value_name = "NAME", value_parser = tone_mapper)]
    pub tone_mapper: Option<ToneMapper>,
    /// Samples per pixel and axis on edges [default: 4]; a GPU takes 4 in each of 1, 4, 9 or 16 parts of a
    /// pixel, for N up to 4, 8, 12 or more
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u8).range(1..=32))]
    pub samples: Option<u8>,
    /// What shows beside the surfaces: environment, none (black), or linear R/G/B [default: environment]
    #[arg(long, value_name = "WHAT", value_parser = background)]
    pub background: Option<SceneBackground>,
    /// Blur of the background, degrees [default: 0]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = blur)]
    pub blur: Option<f64>,
    /// Position of the camera, metres [default: framed]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = inputs::vector)]
    pub from: Option<[f64; 3]>,
    /// A plane of this reflectance under the mesh, as far as the horizon, with the mesh's shadow where the
    /// CPU renders it. They shadow one another with --shadows lobe (with ray from suns and lamps alone),
    /// under techniques that know shadows, and under path, which also reflects light from one onto the other.
    /// --technique shades it too where it takes its reflectance; else one is chosen [default of the SPEC:
    /// lambert:albedo=0.4]
    #[arg(long, value_name = "SPEC", num_args = 0..=1, require_equals = true, default_missing_value = "lambert:albedo=0.4")]
    pub ground: Option<String>,
    /// Technique of the ground, with its parameters, such as prt_diffuse:precision=0.05, which knows the
    /// mesh's shadows on it
    #[arg(long, value_name = "SLUG[:NAME=VALUE,…]", requires = "ground")]
    pub ground_technique: Option<String>,
    /// Upward direction of the camera [default: 0,1,0]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = inputs::vector)]
    pub up: Option<[f64; 3]>,
    /// N pictures around the target, all exposed as the first one is: as an animation where the output is
    /// .apng, else {} in its name stands for the number
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=3600))]
    pub orbit: Option<u16>,
    /// Target of the camera, metres [default: centre of the mesh]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = inputs::vector)]
    pub at: Option<[f64; 3]>,
    /// Vertical field of view, degrees [default: 32, or what the scene file says]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = inputs::positive)]
    pub fov: Option<f64>,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    match o.orbit {
        Some(_) => context.check_output(&o.output, &["png", "exr", "hdr", "pfm", ANIMATION])?,
        None => context.check_output(&o.output, &["png", "exr", "hdr", "pfm"])?,
    }
    let traced = o.technique.as_deref() == Some(Method::Path.slug());
    context.paths = o.paths.get(traced)?;
    if let Some(path) = &o.variance {
        context.check_output(path, &["exr", "pfm"])?;
        if !traced || o.orbit.is_some() {
            return Err(Failure::usage("--variance belongs to one picture by --technique path"));
        }
    }
    if matches!(o.technique.as_deref(), Some("reference" | "path")) && o.local.get()?.flatten().is_some() {
        return Err(Failure::usage(
            "--local belongs to a technique: the reference and path shade all light themselves; leave it out, name another \
             --technique, or see both side by side with compare --local",
        ));
    }
    let scene = scene(&o, context)?;
    // What is asked for by name fails before the work.
    let renderer = (context.backend != Backend::Auto).then(|| Renderer::open(context)).transpose()?;
    if let Some(frames) = o.orbit {
        return orbit(&o, &scene, frames.into(), renderer, context);
    }
    let (mut picture, missed) = context.render_on(&scene, renderer)?.even_if_missed();
    let film = std::mem::take(&mut picture.film);
    if let (Some(path), Some(variance)) = (&o.variance, picture.variance.take()) {
        context.write_image(
            path,
            &Raster::rgb(film.width, film.height, variance),
            WriteOptions::default(),
        )?;
    }
    context.write_film(&o.output, film, picture.develop)?;
    report(&o, &scene, &picture, context)?;
    missed.map_or(Ok(()), |m| Err(m.into()))
}

/// The name of frame `k` of several.
fn frame(output: &Path, k: usize) -> PathBuf {
    let name = output.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    output.with_file_name(name.replacen("{}", &format!("{k:04}"), 1))
}

fn orbit(
    o: &Options,
    scene: &Scene,
    frames: usize,
    renderer: Option<Renderer>,
    context: &mut Context,
) -> Outcome {
    let animated = is_animation(&o.output);
    if !animated && !o.output.file_name().is_some_and(|n| n.to_string_lossy().contains("{}")) {
        let why = "--orbit writes several pictures: put {} into the name, such as turn-{}.png, or use .apng";
        return Err(Failure::usage(format!("{}: {why}", o.output.display())));
    }
    if !animated {
        (0..frames).try_for_each(|k| context.writes(&frame(&o.output, k)))?;
    }
    let mut shown = Vec::new();
    let orbit = context.orbit(scene, frames, renderer, |session, k, picture| {
        let film = std::mem::take(&mut picture.film);
        if animated {
            shown.push(picture.develop.film(&film));
            return Ok(());
        }
        session.write_film(&frame(&o.output, k), film, picture.develop)
    })?;
    if animated {
        context.write_animation(&o.output, &shown, FRAME_RATE)?;
    }
    let (last, missed) = orbit.even_if_missed();
    if let Some(picture) = last {
        report(o, scene, &picture, context)?;
    }
    missed.map_or(Ok(()), |m| Err(m.into()))
}

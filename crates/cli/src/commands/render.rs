//! `steradian render`: a lit picture of a mesh, a built-in shape or a scene file.

use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, AdjustArgs, ExtraLights, LocalArg, PathArgs};
use clap::Args;
use glam::{Affine3A, Vec3};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_formats::{Raster, WriteOptions};
use steradian_light::Lights;
use steradian_render::scenefile::SceneBackground;
use steradian_render::{NormalFiltering, SurfaceMaps, ToneMapper};
use steradian_scene::shadow::MapOptions;
use steradian_scene::{Camera, Mesh};
use steradian_session::{
    ANIMATION, Backend, Choice, DEFAULT_SKY, FOV, FRAME_RATE, Local, Material, Method, Model, Picture,
    Prepared, Renderer, Scene, SceneOverrides, Shadows, Trial, check_output, for_any_mesh, is_animation,
    make_tangents,
};
use steradian_techniques::SavedBake;

/// Options of `steradian render`.
#[derive(Debug, Default, Args)]
pub struct Options {
    /// Scene file (.toml), mesh file, or built-in shape
    #[arg(value_name = "SCENE|MESH|SHAPE")]
    pub input: String,
    /// Output: .png is tone-mapped; .exr, .hdr and .pfm are linear
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Light: an image, or a sky spec such as sky:elevation=35 [default: sky, or none beside --light and --sun-lights]
    #[arg(short, long, value_name = "FILE|SKY")]
    pub environment: Option<String>,
    #[command(flatten)]
    pub adjust: AdjustArgs,
    #[command(flatten)]
    pub lights: ExtraLights,
    #[command(flatten)]
    pub local: LocalArg,
    /// Reflectance of the mesh, such as ggx:alpha=0.2; the base colours of its file multiply it [default: what
    /// the file says, else lambert:albedo=0.6]
    #[arg(short, long, value_name = "SPEC")]
    pub brdf: Option<String>,
    /// Technique, or reference, which integrates at every point and takes longer [default: the technique of the smallest
    /// error in this picture that some processor seconds find; with --tolerance the smallest that meets it]
    #[arg(short, long, value_name = "SLUG")]
    pub technique: Option<String>,
    /// Parameter of the named technique
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = inputs::parameter)]
    pub params: Vec<inputs::Parameter>,
    /// A saved bake (.safetensors, or the folder of one) in place of reflectance and technique; --rotate turns its light,
    /// --environment is seen behind the surfaces [default: the sky that it was baked from, or nothing]
    #[arg(long, value_name = "FILE", conflicts_with_all = ["sun_lights", "light", "suns", "local", "brdf", "technique", "params"])]
    pub bake: Option<PathBuf>,
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
    /// How the normals under a pixel are filtered: covariance (along their spread), isotropic (rounder highlights, less
    /// work) or none (highlights of distant bumps alias) [default: covariance]
    #[arg(long, value_name = "HOW", value_parser = normal_filtering)]
    pub normal_filtering: Option<NormalFiltering>,
    /// Light that varies over space, as `probes` writes it, in place of every light of the scene; --environment is seen
    /// behind the surfaces
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
    /// What shadows suns, points and other lights beside a technique's data: ray, none, or auto (ray under techniques that
    /// know shadows); map, map:size=1024,taps=3 (shadow maps) or volume (shadow volumes); lobe: as ray, and the environment by
    /// rays over the reflectance's lobe, under the reference too [default: auto]
    #[arg(long, value_name = "HOW", value_parser = shadows)]
    pub shadows: Option<Shadows>,
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
    /// Samples per pixel and axis on edges [default: 4]; a GPU takes 4 in each of 1, 4, 9 or 16 parts of a pixel, for N up
    /// to 4, 8, 12 or more
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
    /// A plane of this reflectance under the mesh, as far as the horizon; path alone lets them shadow one another.
    /// --technique shades it too where it takes its reflectance; else one is chosen [default of the SPEC: lambert:albedo=0.4]
    #[arg(long, value_name = "SPEC", num_args = 0..=1, require_equals = true, default_missing_value = "lambert:albedo=0.4")]
    pub ground: Option<String>,
    /// Upward direction of the camera [default: 0,1,0]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = inputs::vector)]
    pub up: Option<[f64; 3]>,
    /// N pictures around the target, all exposed as the first one is: as an animation where the output is .apng, else {} in
    /// its name stands for the number
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=3600))]
    pub orbit: Option<u16>,
    /// Target of the camera, metres [default: centre of the mesh]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = inputs::vector)]
    pub at: Option<[f64; 3]>,
    /// Vertical field of view, degrees [default: 32, or what the scene file says]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = inputs::positive)]
    pub fov: Option<f64>,
}

/// Exposure of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Exposure {
    Auto,
    Ev(f32),
}

pub fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" { Ok(Exposure::Auto) } else { Ok(Exposure::Ev(inputs::finite(text)? as f32)) }
}

pub fn blur(text: &str) -> Result<f64, String> {
    let degrees = inputs::finite(text)?;
    if (0.0..=90.0).contains(&degrees) {
        Ok(degrees)
    } else {
        Err(format!("'{text}' is not 0 to 90 degrees"))
    }
}

pub fn size(text: &str) -> Result<(usize, usize), String> {
    let bad = || format!("'{text}' is not WIDTHxHEIGHT with sides of 1 to 32768 pixels");
    let (w, h) = text.split_once(['x', 'X', '×']).unwrap_or((text, text));
    let side = |s: &str| s.parse().ok().filter(|n| (1..=32768).contains(n)).ok_or_else(bad);
    Ok((side(w)?, side(h)?))
}

pub fn tone_mapper(text: &str) -> Result<ToneMapper, String> {
    let names = ToneMapper::ALL.map(ToneMapper::name);
    ToneMapper::from_name(text).ok_or_else(|| steradian_base::unknown("tone mapper", text, &names))
}

fn normal_filtering(text: &str) -> Result<NormalFiltering, String> {
    let names = NormalFiltering::ALL.map(|a| a.0);
    NormalFiltering::from_name(text).ok_or_else(|| steradian_base::unknown("way", text, &names))
}

fn shadows(text: &str) -> Result<Shadows, String> {
    match text {
        "auto" => Ok(Shadows::Auto),
        "none" => Ok(Shadows::Off),
        "ray" => Ok(Shadows::Ray),
        "volume" => Ok(Shadows::Volume),
        "lobe" => Ok(Shadows::Lobe),
        _ => match text.strip_prefix("map") {
            Some("") => Ok(Shadows::Map(MapOptions::default())),
            Some(rest) if rest.starts_with(':') => Ok(Shadows::Map(map_options(&rest[1..])?)),
            _ => Err(steradian_base::unknown(
                "shadows",
                text,
                &["auto", "none", "ray", "map", "volume", "lobe"],
            )),
        },
    }
}

/// `size=N,taps=N` of shadow maps.
fn map_options(text: &str) -> Result<MapOptions, String> {
    let mut options = MapOptions::default();
    for pair in text.split(',') {
        let (key, value) = pair.split_once('=').unwrap_or((pair, ""));
        let number = |range: std::ops::RangeInclusive<usize>| {
            let n = value.parse().ok().filter(|n| range.contains(n));
            n.ok_or_else(|| {
                format!("{key} = '{value}' is no whole number in {} … {}", range.start(), range.end())
            })
        };
        match key {
            "size" => options.size = number(16..=16384)?,
            "taps" => options.taps = number(1..=15)?,
            _ => return Err(steradian_base::unknown("parameter of map", key, &["size", "taps"])),
        }
    }
    if options.taps.is_multiple_of(2) {
        return Err(format!("taps = {} is even: a square about a texel has 1, 3, 5 … a side", options.taps));
    }
    Ok(options)
}

fn background(text: &str) -> Result<SceneBackground, String> {
    match text {
        "environment" => Ok(SceneBackground::Environment(0.0)),
        "none" => Ok(SceneBackground::Colour([0.0; 3])),
        _ => {
            let c = inputs::vector(&text.replace('/', ","));
            c.map(|c| SceneBackground::Colour(c.map(|v| v as f32)))
                .map_err(|_| format!("'{text}' is not environment, none or R/G/B"))
        }
    }
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    match o.orbit {
        Some(_) => check_output(&o.output, &["png", "exr", "hdr", "pfm", ANIMATION])?,
        None => check_output(&o.output, &["png", "exr", "hdr", "pfm"])?,
    }
    let traced = o.technique.as_deref() == Some(Method::Path.slug());
    context.paths = o.paths.get(traced)?;
    if let Some(path) = &o.variance {
        check_output(path, &["exr", "pfm"])?;
        if !traced || o.orbit.is_some() {
            return Err(Failure::usage("--variance belongs to one picture by --technique path"));
        }
    }
    if matches!(o.technique.as_deref(), Some("reference" | "path")) && o.local.get()?.flatten().is_some() {
        return Err(Failure::usage(
            "--local belongs to a technique: the reference and path shade all light themselves",
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

pub fn scene(o: &Options, context: &mut Context) -> Result<Scene, Failure> {
    context.suns = o.lights.suns();
    context.shadows = o.shadows.unwrap_or_default();
    let mut scene = if Path::new(&o.input).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        let overrides = overrides(o, context)?;
        context.scene_file(Path::new(&o.input), &overrides)?
    } else {
        bare(o, context)?
    };
    if let Some((w, h)) = o.size {
        (scene.settings.width, scene.settings.height) = (w, h);
    }
    if let Some(n) = o.samples {
        scene.settings.edge = usize::from(n);
        scene.settings.inner = scene.settings.inner.min(usize::from(n));
    }
    match o.exposure {
        Some(Exposure::Ev(ev)) => scene.exposure = Some(ev),
        Some(Exposure::Auto) => scene.exposure = None,
        None => {}
    }
    scene.tone_mapper = o.tone_mapper.unwrap_or(scene.tone_mapper);
    scene.background = o.background.unwrap_or(scene.background);
    if let (Some(blur), SceneBackground::Environment(b)) = (o.blur, &mut scene.background) {
        *b = blur.to_radians();
    }
    o.lights.join(&mut scene.lights, &o.adjust.get(), context)?;
    let local = scene.materials.iter().find_map(|m| m.local.as_ref());
    if let Some(local) =
        local.filter(|_| scene.lights.directionals.is_empty() && scene.lights.points.is_empty())
    {
        let name = local.technique.card().slug;
        context.say(format_args!("no directional and no point light: {name} has nothing to shade (--light)"));
    }
    scene.tolerance = o.tolerance;
    if let Some(path) = &o.probes {
        let field = context.probes(path)?;
        scene.probes = Some(Arc::new(field));
    }
    if let Some(filtering) = o.normal_filtering {
        scene.materials.iter_mut().for_each(|m| m.maps.filtering = filtering);
    }
    camera(o, &mut scene)?;
    if let Some(spec) = &o.ground {
        scene.ground = Some(ground(o, spec, context)?);
    }
    Ok(scene)
}

/// The technique of the mesh shades the ground too where it takes its reflectance; else one is chosen.
fn ground(o: &Options, spec: &str, context: &mut Context) -> Result<Material, Failure> {
    let brdf = context.brdf(spec)?;
    let named = o.technique.as_deref().map(Method::find).transpose()?;
    let method = named.filter(|m| match m {
        Method::Technique(t) => (t.card().materials)(&*brdf).is_ok(),
        _ => true,
    });
    let asked = o.local.get()?.flatten();
    let taken = |l: &Local| (l.technique.card().materials)(&*brdf).is_ok() && !l.is_textured(false);
    let local = asked.clone().filter(taken);
    if let (Some(l), None) = (&asked, &local) {
        let name = l.technique.card().slug;
        let why =
            if l.is_textured(false) { "its files belong to the mesh" } else { "of another reflectance" };
        context
            .say(format_args!("ground: not by {name} ({why}): directional and point lights are exact there"));
    }
    Ok(Material { method, local, ..Material::new(brdf) })
}

/// What the command line changes in a scene file.
fn overrides(o: &Options, context: &mut Context) -> Result<SceneOverrides, Failure> {
    let maps = [&o.base_color_texture, &o.normal_map, &o.roughness_map].iter().any(|m| m.is_some());
    if o.brdf.is_some()
        || o.bake.is_some()
        || maps
        || o.plain
        || o.translate.is_some()
        || !o.params.is_empty()
    {
        let why = "--brdf, --bake, --base-color-texture, --normal-map, --roughness-map, --plain, --translate and --param belong \
                   to a mesh; a scene file has materials";
        return Err(Failure::usage(why));
    }
    let method = o.technique.as_deref().map(Method::find).transpose()?;
    let local = o.local.open(context)?;
    Ok(SceneOverrides { environment: o.environment.clone(), adjust: o.adjust.get(), method, local })
}

/// A mesh or shape with the material of the command line, of its file, or of clay.
fn bare(o: &Options, context: &mut Context) -> Result<Scene, Failure> {
    if o.technique.is_none() && !o.params.is_empty() {
        return Err(Failure::usage("--param belongs to a technique: name it with --technique"));
    }
    let params = inputs::parameters(&o.params)?;
    let local = o.local.open(context)?.flatten();
    let file = o.bake.as_deref().map(|p| saved_bake(p, o, context)).transpose()?;
    let method = match &file {
        Some(file) => Some(Method::File(file.clone())),
        None => o.technique.as_deref().map(Method::find).transpose()?,
    };
    let given = match (&file, &o.brdf) {
        // Of no part in shading: what the bake was made of, in name.
        (Some(file), _) => Some(file.brdf().map_or_else(|| context.brdf("lambert"), Ok)?),
        (None, spec) => spec.as_deref().map(|spec| context.brdf(spec)).transpose()?,
    };
    let texture = o.base_color_texture.as_deref().map(|p| context.texture(p)).transpose()?;
    let mut model = context.model(&o.input)?;
    if texture.is_some() && model.mesh.uvs.is_empty() {
        let why = format!("{}: has no texture coordinates for --base-color-texture", o.input);
        return Err(Failure::usage(why));
    }
    let given_maps = maps(o, &model.mesh, context)?;
    let textured = local.as_ref().is_some_and(|l| l.is_textured(false));
    if let Some(local) = &local {
        local.check_mesh(&model.mesh, false, &o.input)?;
    }
    if given_maps.normal.is_some() || textured {
        make_tangents(std::slice::from_mut(&mut model.mesh));
    }
    if o.plain {
        model.materials.clear();
        model.mesh.materials.clear();
    }
    if let Some(by) = o.translate {
        let by = Affine3A::from_translation(Vec3::from(by.map(|x| x as f32)));
        model.mesh = model.mesh.transformed(&by);
    }
    let lights = lights(o, file.as_deref(), context)?;
    let material = |brdf, base_colour, file: SurfaceMaps| {
        let maps = SurfaceMaps {
            normal: given_maps.normal.clone().or(file.normal),
            alpha2: given_maps.alpha2.clone().or(file.alpha2),
            ..file
        };
        let (method, params, local) = (method.clone(), params.clone(), local.clone());
        Material { brdf, method, params, local, base_colour, maps }
    };
    let mut materials = Vec::new();
    for m in &model.materials {
        let brdf = match &given {
            Some(brdf) => brdf.clone(),
            None => m.brdf()?,
        };
        let base_colour = texture.clone().or_else(|| m.tint(given.is_none()));
        materials.push(material(brdf, base_colour, m.maps(given.is_none())));
    }
    if materials.is_empty() {
        let usual = if texture.is_some() { "lambert" } else { "lambert:albedo=0.6" };
        let brdf = given.clone().map_or_else(|| context.brdf(usual), Ok)?;
        materials.push(material(brdf, texture.clone(), SurfaceMaps::default()));
    }
    say_materials(o, &model, given.is_some(), texture.is_some(), context);
    Ok(Scene::new(model.mesh, materials, lights))
}

/// A saved bake for a picture.
fn saved_bake(path: &Path, o: &Options, context: &mut Context) -> Result<Arc<SavedBake>, Failure> {
    let file = context.saved_bake(path, &o.adjust.get())?;
    for_any_mesh(&file)?;
    Ok(Arc::new(file))
}

/// The lights of a mesh; with a saved bake what is seen of them.
fn lights(o: &Options, file: Option<&SavedBake>, context: &mut Context) -> Result<Lights, Failure> {
    let adjust = o.adjust.get();
    match (&o.environment, file) {
        (spec, Some(file)) => {
            let seen = context.light_of_bake(file, spec.as_deref(), &adjust)?;
            if seen.is_none() && o.background.is_none() {
                let light = &file.made.environment;
                context.say(format_args!("nothing is seen behind: --environment {light} would be"));
            }
            Ok(seen.unwrap_or_default())
        }
        (Some(spec), None) => Ok(context.light(spec, &adjust)?),
        (None, None) if o.lights.is_some() || o.probes.is_some() => Ok(Lights::default()),
        (None, None) => Ok(context.light(DEFAULT_SKY, &adjust)?),
    }
}

/// The maps of the command line.
fn maps(o: &Options, mesh: &Mesh, context: &mut Context) -> Result<SurfaceMaps, Failure> {
    let mut out = SurfaceMaps::default();
    for (name, option) in [(&o.normal_map, "--normal-map"), (&o.roughness_map, "--roughness-map")] {
        if name.is_some() && mesh.uvs.is_empty() {
            let why = format!("{}: has no texture coordinates for {option}", o.input);
            return Err(Failure::usage(why));
        }
    }
    if let Some(path) = &o.normal_map {
        out.normal = context.normal_map(path, o.normal_scale.unwrap_or(1.0) as f32)?.normal;
    }
    if let Some(path) = &o.roughness_map {
        out.alpha2 = context.roughness_map(path)?.alpha2;
    }
    Ok(out)
}

/// Says what of the file's materials is used; of many, the first ones.
fn say_materials(o: &Options, model: &Model, given: bool, texture: bool, context: &Context) {
    const LINES: usize = 4;
    if given {
        let own = model.materials.iter().filter(|m| m.base_colour.is_some()).count();
        if own > 0 && !texture {
            context.say(format_args!(
                "{}: base colours of {own} materials multiply --brdf (--plain leaves them out)",
                o.input
            ));
        }
        return;
    }
    model
        .materials
        .iter()
        .take(LINES)
        .for_each(|m| context.say(format_args!("{}: {}", o.input, m.assumed())));
    if let Some(more @ 1..) = model.materials.len().checked_sub(LINES) {
        context.say(format_args!("{}: and {more} more materials", o.input));
    }
}

fn camera(o: &Options, scene: &mut Scene) -> Outcome {
    if scene.mesh.bounds().is_none() {
        return Err(Failure::input(format!("{}: has no triangles", o.input)));
    }
    let fov = o.fov.map(|d| d as f32);
    if o.up.is_some_and(|v| v == [0.0; 3]) {
        return Err(Failure::usage("--up must not be zero"));
    }
    if fov.is_some_and(|f| f >= 180.0) {
        return Err(Failure::usage("--fov must be below 180 degrees"));
    }
    let vector = |v: [f64; 3]| Vec3::from(v.map(|c| c as f32));
    let framed = || scene.framed(fov.unwrap_or(FOV), o.up.map_or(Vec3::Y, vector));
    scene.camera = Some(match scene.camera.map_or_else(framed, Ok)? {
        Camera::Pinhole { from, at, up, fov_y } => Camera::Pinhole {
            from: o.from.map_or(from, vector),
            at: o.at.map_or(at, vector),
            up: o.up.map_or(up, vector),
            fov_y: fov.map_or(fov_y, f32::to_radians),
        },
        Camera::Orthographic { from, at, up, height } => Camera::Orthographic {
            from: o.from.map_or(from, vector),
            at: o.at.map_or(at, vector),
            up: o.up.map_or(up, vector),
            height,
        },
    });
    Ok(())
}

fn report(o: &Options, scene: &Scene, picture: &Picture, context: &Context) -> Outcome {
    let Picture { develop, materials, seconds, backend, .. } = picture;
    let (w, h, ev) = (scene.settings.width, scene.settings.height, develop.ev);
    if context.common.json {
        return context.print_json(json!({
            "output": o.output.file_name().map(|n| n.to_string_lossy()),
            "width": w,
            "height": h,
            "exposure": ev,
            "triangles": scene.mesh.triangles.len(),
            "backend": backend,
            "render_seconds": seconds,
            "materials": materials.iter().map(material_json).collect::<Vec<_>>(),
        }));
    }
    let bake: f64 = materials.iter().map(|m| m.seconds).sum();
    let choice: f64 = materials.iter().filter_map(|m| m.choice.as_ref()).map(|c| c.seconds).sum();
    let samples = materials.iter().filter(|m| m.choice.is_none()).map(|m| m.sample_seconds).sum();
    let taken = |what: &str, seconds: f64| {
        if seconds > 0.0 { format!("{what} {seconds:.2} processor s, ") } else { String::new() }
    };
    let looked = taken("choice", choice) + &taken("error in the picture", samples);
    let path = o.output.display();
    context.say(format_args!(
        "{path}: {w} x {h}, {looked}bake {bake:.2} s, render {seconds:.2} s, exposure {ev:+.2} EV"
    ));
    Ok(())
}

fn material_json(m: &Prepared) -> Value {
    json!({
        "brdf": m.spec(),
        "technique": m.method.slug(),
        "local": m.material.local.as_ref().map(Local::label),
        "bake_seconds": m.seconds,
        "bytes": m.bytes,
        "error": m.error(),
        "error_known": m.known(),
        "picture_error": m.picture_error,
        "picture_unmeasured": m.picture_unmeasured,
        "sample_processor_seconds": m.sample_seconds,
        "choice": m.choice.as_deref().map(choice_json),
    })
}

fn choice_json(c: &Choice) -> Value {
    let trial = |t: &Trial| {
        json!({
            "technique": t.technique,
            "processor_seconds": t.seconds,
            "error": t.error,
            "verdict": t.verdict.word(),
        })
    };
    json!({
        "processor_seconds": c.seconds,
        "trials": c.trials.iter().map(trial).collect::<Vec<_>>(),
    })
}

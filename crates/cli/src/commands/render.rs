//! `steradian render`: a lit picture of a mesh, a built-in shape or a scene file.

use crate::context::{Backend, Context, check_output};
use crate::engine::Engine;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, Adjust, Method};
use crate::looks::{self, Wanted};
use crate::model::{self, Model};
use crate::saved;
use crate::studio::{self, Baked, Look};
use crate::suns::Beside;
use clap::Args;
use glam::Vec3;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;
use steradian_formats::WriteOptions;
use steradian_light::Lights;
use steradian_render::scenefile::SceneBackground;
use steradian_render::tone::auto_exposure;
use steradian_render::{
    Backdrop, Background, Develop, Film, Maps, NormalFiltering, Settings, Stage, ToneMapper,
};
use steradian_scene::{Bvh, Camera, Mesh};
use steradian_techniques::SavedBake;

/// Options of `steradian render`.
#[derive(Debug, Args)]
pub struct Options {
    /// Scene file (.toml), mesh file, or built-in shape
    #[arg(value_name = "SCENE|MESH|SHAPE")]
    input: String,
    /// Output: .png is tone-mapped; .exr, .hdr and .pfm are linear
    #[arg(short, long, value_name = "OUT")]
    output: PathBuf,
    /// Light: an image, or a sky spec such as sky:elevation=35 [default: sky, or none beside --light and --sun-lights]
    #[arg(short, long, value_name = "FILE|SKY")]
    environment: Option<String>,
    #[command(flatten)]
    adjust: Adjust,
    #[command(flatten)]
    beside: Beside,
    /// Reflectance of the mesh, such as ggx:alpha=0.2; the base colours of its file multiply it [default: what
    /// the file says, else lambert:albedo=0.6]
    #[arg(short, long, value_name = "SPEC")]
    brdf: Option<String>,
    /// Technique, or reference, which integrates at every point and takes longer [default: the technique of the
    /// smallest certified error; with --tolerance the smallest that meets it]
    #[arg(short, long, value_name = "SLUG")]
    technique: Option<String>,
    /// Parameter of the named technique
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = inputs::parameter)]
    params: Vec<(String, f64)>,
    /// A saved bake (.safetensors, or the folder of one) in place of reflectance and technique; --rotate turns its light,
    /// --environment is seen behind the surfaces [default: the sky that it was baked from, or nothing]
    #[arg(long, value_name = "FILE", conflicts_with_all = ["sun_lights", "light", "suns", "brdf", "technique", "params"])]
    bake: Option<PathBuf>,
    /// Relative RMS error of radiance asked for, such as 0.01; a miss exits 4
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// Image that multiplies the net reflectance, in place of the file's base colours
    #[arg(long, visible_alias = "base-color", value_name = "FILE")]
    base_color_texture: Option<PathBuf>,
    /// Tangent-space normal map, green up (as in glTF), in place of the file's
    #[arg(long, value_name = "FILE")]
    normal_map: Option<PathBuf>,
    /// Factor of the bumps of --normal-map [default: 1]
    #[arg(long, value_name = "S", value_parser = inputs::finite, allow_negative_numbers = true, requires = "normal_map")]
    normal_scale: Option<f64>,
    /// Image of perceptual roughness (its green channel), in place of the reflectance's
    #[arg(long, value_name = "FILE")]
    roughness_map: Option<PathBuf>,
    /// How the normals under a pixel are filtered: covariance (along their spread), isotropic (rounder highlights, less
    /// work) or none (highlights of distant bumps alias) [default: covariance]
    #[arg(long, value_name = "HOW", value_parser = normal_filtering)]
    normal_filtering: Option<NormalFiltering>,
    /// Leave out the materials of the mesh file
    #[arg(long)]
    plain: bool,
    /// Size of the picture, pixels [default: 512x512, or what the scene file says]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(usize, usize)>,
    /// Exposure in stops (EV) before the tone mapper of .png, or auto [default: auto]
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure)]
    exposure: Option<Exposure>,
    /// Tone mapper of .png: linear, reinhard, aces, agx, neutral, … [default: neutral]
    #[arg(long, value_name = "NAME", value_parser = tone_mapper)]
    tone_mapper: Option<ToneMapper>,
    /// Samples per pixel and axis on edges [default: 4]; a GPU takes 4 in each of 1, 4, 9 or 16 parts of a pixel, for N up
    /// to 4, 8, 12 or more
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = clap::value_parser!(u8).range(1..=32))]
    samples: Option<u8>,
    /// What shows beside the surfaces: environment, none (black), or linear R/G/B [default: environment]
    #[arg(long, value_name = "WHAT", value_parser = background)]
    background: Option<SceneBackground>,
    /// Blur of the background, degrees [default: 0]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = blur)]
    blur: Option<f64>,
    /// Position of the camera, metres [default: framed]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = inputs::vector)]
    from: Option<[f64; 3]>,
    /// Target of the camera, metres [default: centre of the mesh]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = inputs::vector)]
    at: Option<[f64; 3]>,
    /// Vertical field of view, degrees [default: 32, or what the scene file says]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = inputs::positive)]
    fov: Option<f64>,
}

/// Exposure of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Exposure {
    Auto,
    Ev(f32),
}

fn exposure(text: &str) -> Result<Exposure, String> {
    if text == "auto" { Ok(Exposure::Auto) } else { Ok(Exposure::Ev(inputs::finite(text)? as f32)) }
}

fn blur(text: &str) -> Result<f64, String> {
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

/// Everything that a picture is made of.
pub struct Plan {
    pub mesh: Mesh,
    pub looks: Vec<Wanted>,
    pub lights: Lights,
    pub camera: Option<Camera>,
    pub settings: Settings,
    pub exposure: Option<f32>,
    pub tone_mapper: ToneMapper,
    pub background: SceneBackground,
    pub tolerance: Option<f64>,
}

/// A finished picture.
struct Picture {
    film: Film,
    looks: Vec<Look>,
    baked: Vec<Baked>,
    backend: &'static str,
    seconds: f64,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    check_output(&o.output, &["png", "exr", "hdr", "pfm"])?;
    let plan = plan(&o, context)?;
    // What is asked for by name fails before the work.
    let engine = (context.common.backend != Backend::Auto).then(|| Engine::open(context)).transpose()?;
    let mut picture = paint(&plan, engine, context)?;
    let ev = plan.exposure.unwrap_or_else(|| expose(&picture.film));
    let worst = picture.baked.iter().map(Baked::error).fold(0.0, f64::max);
    context.note_error(format!("relative error {worst:.3e}"));
    save(&o.output, std::mem::take(&mut picture.film), Develop { ev, mapper: plan.tone_mapper }, context)?;
    report(&o, &plan, &picture, ev, context)?;
    match o.tolerance {
        Some(t) if worst > t => {
            Err(Failure::missed(format!("tolerance {t} missed: the error reached is {worst:.3e}")))
        }
        _ => Ok(()),
    }
}

fn plan(o: &Options, context: &mut Context) -> Result<Plan, Failure> {
    context.suns = o.beside.suns();
    let mut plan = if Path::new(&o.input).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        crate::scene::plan(Path::new(&o.input), &SceneOverrides::of(o)?, context)?
    } else {
        bare(o, context)?
    };
    if let Some((w, h)) = o.size {
        (plan.settings.width, plan.settings.height) = (w, h);
    }
    if let Some(n) = o.samples {
        plan.settings.edge = usize::from(n);
        plan.settings.inner = plan.settings.inner.min(usize::from(n));
    }
    match o.exposure {
        Some(Exposure::Ev(ev)) => plan.exposure = Some(ev),
        Some(Exposure::Auto) => plan.exposure = None,
        None => {}
    }
    plan.tone_mapper = o.tone_mapper.unwrap_or(plan.tone_mapper);
    plan.background = o.background.unwrap_or(plan.background);
    if let (Some(blur), SceneBackground::Environment(b)) = (o.blur, &mut plan.background) {
        *b = blur.to_radians();
    }
    o.beside.join(&mut plan.lights, &o.adjust, context)?;
    plan.tolerance = o.tolerance;
    if let Some(filtering) = o.normal_filtering {
        plan.looks.iter_mut().for_each(|l| l.maps.filtering = filtering);
    }
    camera(o, &mut plan)?;
    Ok(plan)
}

/// What the command line changes in a scene file.
pub struct SceneOverrides {
    pub environment: Option<String>,
    pub adjust: Adjust,
    pub method: Option<Method>,
}

impl SceneOverrides {
    fn of(o: &Options) -> Result<Self, Failure> {
        let maps = [&o.base_color_texture, &o.normal_map, &o.roughness_map].iter().any(|m| m.is_some());
        if o.brdf.is_some() || o.bake.is_some() || maps || o.plain || !o.params.is_empty() {
            let why = "--brdf, --bake, --base-color-texture, --normal-map, --roughness-map, --plain and --param belong \
                       to a mesh; a scene file has materials";
            return Err(Failure::usage(why));
        }
        let method = o.technique.as_deref().map(Method::find).transpose()?;
        Ok(Self { environment: o.environment.clone(), adjust: o.adjust.clone(), method })
    }
}

/// A mesh or shape with the material of the command line, of its file, or of clay.
fn bare(o: &Options, context: &mut Context) -> Result<Plan, Failure> {
    if o.technique.is_none() && !o.params.is_empty() {
        return Err(Failure::usage("--param belongs to a technique: name it with --technique"));
    }
    let params = inputs::parameters(&o.params)?;
    let file = o.bake.as_deref().map(|p| saved_bake(p, o, context)).transpose()?;
    let method = match &file {
        Some(file) => Some(Method::File(file.clone())),
        None => o.technique.as_deref().map(Method::find).transpose()?,
    };
    let given = match (&file, &o.brdf) {
        // Of no part in shading: what the bake was made of, in name.
        (Some(file), _) => Some(file.brdf().map_or_else(|| inputs::brdf("lambert", context), Ok)?),
        (None, spec) => spec.as_deref().map(|spec| inputs::brdf(spec, context)).transpose()?,
    };
    let texture = o.base_color_texture.as_deref().map(|p| inputs::texture(p, context)).transpose()?;
    let mut model = model::model(&o.input, context)?;
    if texture.is_some() && model.mesh.uvs.is_empty() {
        let why = format!("{}: has no texture coordinates for --base-color-texture", o.input);
        return Err(Failure::usage(why));
    }
    let given_maps = maps(o, &model.mesh, context)?;
    if given_maps.normal.is_some() {
        model::make_tangents(std::slice::from_mut(&mut model.mesh));
    }
    if o.plain {
        model.materials.clear();
        model.mesh.materials.clear();
    }
    let lights = lights(o, file.as_deref(), context)?;
    let wanted = |brdf, texture, file: Maps| {
        let maps = Maps {
            normal: given_maps.normal.clone().or(file.normal),
            alpha2: given_maps.alpha2.clone().or(file.alpha2),
            ..file
        };
        Wanted { brdf, method: method.clone(), params: params.clone(), texture, maps }
    };
    let mut looks = Vec::new();
    for m in &model.materials {
        let brdf = match &given {
            Some(brdf) => brdf.clone(),
            None => m.brdf()?,
        };
        let base_colour = texture.clone().or_else(|| m.base_colour.clone());
        looks.push(wanted(brdf, base_colour, m.maps(given.is_none())));
    }
    if looks.is_empty() {
        let brdf = match given.clone() {
            Some(brdf) => brdf,
            None => inputs::brdf(if texture.is_some() { "lambert" } else { "lambert:albedo=0.6" }, context)?,
        };
        looks.push(wanted(brdf, texture.clone(), Maps::default()));
    }
    say_materials(o, &model, given.is_some(), texture.is_some(), context);
    Ok(Plan {
        mesh: model.mesh,
        looks,
        lights,
        camera: None,
        settings: Settings::new(512, 512),
        exposure: None,
        tone_mapper: ToneMapper::default(),
        background: SceneBackground::Environment(0.0),
        tolerance: None,
    })
}

/// A saved bake for a picture.
fn saved_bake(path: &Path, o: &Options, context: &mut Context) -> Result<Arc<SavedBake>, Failure> {
    let file = saved::read(path, &o.adjust, context)?;
    saved::for_any_mesh(&file)?;
    Ok(Arc::new(file))
}

/// The lights of a mesh; with a saved bake what is seen of them.
fn lights(o: &Options, file: Option<&SavedBake>, context: &mut Context) -> Result<Lights, Failure> {
    match (&o.environment, file) {
        (spec, Some(file)) => {
            let seen = saved::lights(file, spec.as_deref(), &o.adjust, context)?;
            if seen.is_none() && o.background.is_none() {
                let light = &file.made.environment;
                context.say(format_args!("nothing is seen behind: --environment {light} would be"));
            }
            Ok(seen.unwrap_or_default())
        }
        (Some(spec), None) => inputs::light(spec, &o.adjust, context),
        (None, None) if o.beside.is_some() => Ok(Lights::default()),
        (None, None) => inputs::light(inputs::DEFAULT_SKY, &o.adjust, context),
    }
}

/// The maps of the command line.
fn maps(o: &Options, mesh: &Mesh, context: &mut Context) -> Result<Maps, Failure> {
    let mut out = Maps::default();
    for (name, option) in [(&o.normal_map, "--normal-map"), (&o.roughness_map, "--roughness-map")] {
        if name.is_some() && mesh.uvs.is_empty() {
            let why = format!("{}: has no texture coordinates for {option}", o.input);
            return Err(Failure::usage(why));
        }
    }
    if let Some(path) = &o.normal_map {
        out.normal = inputs::normal_map(path, o.normal_scale.unwrap_or(1.0) as f32, context)?.normal;
    }
    if let Some(path) = &o.roughness_map {
        out.alpha2 = inputs::roughness_map(path, context)?.alpha2;
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

fn camera(o: &Options, plan: &mut Plan) -> Outcome {
    let aspect = plan.settings.width as f32 / plan.settings.height as f32;
    let (low, high) =
        plan.mesh.bounds().ok_or_else(|| Failure::input(format!("{}: has no triangles", o.input)))?;
    let fov = o.fov.map(|d| d as f32);
    if fov.is_some_and(|f| f >= 180.0) {
        return Err(Failure::usage("--fov must be below 180 degrees"));
    }
    let vector = |v: [f64; 3]| Vec3::from(v.map(|c| c as f32));
    let framed = Camera::framing(low, high, fov.unwrap_or(32.0).to_radians(), aspect);
    let base = plan.camera.unwrap_or(framed);
    plan.camera = Some(match base {
        Camera::Pinhole { from, at, up, fov_y } => Camera::Pinhole {
            from: o.from.map_or(from, vector),
            at: o.at.map_or(at, vector),
            up,
            fov_y: fov.map_or(fov_y, f32::to_radians),
        },
        Camera::Orthographic { from, at, up, height } => Camera::Orthographic {
            from: o.from.map_or(from, vector),
            at: o.at.map_or(at, vector),
            up,
            height,
        },
    });
    Ok(())
}

fn paint(plan: &Plan, engine: Option<Engine>, context: &Context) -> Result<Picture, Failure> {
    let camera = plan.camera.ok_or_else(|| Failure::failed("no camera"))?;
    let (looks, baked): (Vec<Look>, Vec<Baked>) =
        looks::bake(&plan.looks, &plan.lights, &camera, plan.tolerance, context)?.into_iter().unzip();
    let judged = looks.iter().any(|l| matches!(l.method, Method::Reference));
    let engine = match engine {
        Some(engine) => engine,
        None if judged => Engine::Cpu,
        None => Engine::open(context)?,
    };
    let footprint = studio::footprint(&camera, plan.settings.height);
    let background = match plan.background {
        SceneBackground::Colour(c) => Background::Colour(c),
        SceneBackground::Environment(blur) => {
            Background::Sky(Backdrop::new(&plan.lights, footprint.max(blur)))
        }
    };
    let bvh = Bvh::build(&plan.mesh);
    let surfaces: Vec<_> = baked.iter().map(|b| b.surface.clone()).collect();
    let stage = Stage { mesh: &plan.mesh, bvh: &bvh, surfaces: &surfaces, background: &background, camera };
    let mut settings = plan.settings;
    if judged {
        // The judge integrates each point on its own: one in a pixel and surface is enough, coverage gets its samples.
        settings.inner = 1;
        settings.share = true;
    }
    let start = Instant::now();
    let rooms: Vec<&Baked> = baked.iter().collect();
    let (film, backend) = engine.film(&stage, &rooms, &settings, context)?;
    Ok(Picture { film, looks, baked, backend, seconds: start.elapsed().as_secs_f64() })
}

/// Automatic exposure: of the surfaces, where there are any.
pub fn expose(film: &Film) -> f32 {
    let covered = film.alpha.iter().any(|a| *a > 0.0);
    auto_exposure(film, |i| if covered { film.alpha[i] } else { 1.0 })
}

/// Writes a film: tone-mapped as PNG, linear otherwise.
pub fn save(path: &Path, film: Film, develop: Develop, context: &Context) -> Outcome {
    // Tone mapping would make black of it.
    let bad = |plane: &Vec<f32>| plane.iter().position(|x| !x.is_finite());
    if let Some(k) = film.rgb.iter().find_map(bad) {
        let (x, y) = (k % film.width, k / film.width);
        let why = format!("pixel ({x}, {y}) is not finite: scale the light down");
        return Err(Failure::failed(format!("{}: {why}", path.display())));
    }
    let png = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if !png {
        return context.write_image(path, &film.into_raster(), WriteOptions::default());
    }
    let metadata = vec![
        ("steradian.exposure".to_string(), develop.ev.to_string()),
        ("steradian.tone_mapper".to_string(), develop.mapper.name().to_string()),
    ];
    save_display(path, &develop.film(&film), metadata, context)
}

/// Writes a display picture as PNG.
pub fn save_display(
    path: &Path,
    picture: &steradian_render::Display,
    metadata: Vec<(String, String)>,
    context: &Context,
) -> Outcome {
    let plane = |c: usize| picture.rgb.iter().skip(c).step_by(3).map(|v| f32::from(*v) / 255.0).collect();
    let raster =
        steradian_formats::Raster::rgb(picture.width, picture.height, [plane(0), plane(1), plane(2)]);
    context.write_image(
        path,
        &raster,
        WriteOptions { metadata, already_encoded: true, ..WriteOptions::default() },
    )
}

fn report(o: &Options, plan: &Plan, picture: &Picture, ev: f32, context: &Context) -> Outcome {
    let Picture { looks, baked, seconds, backend, .. } = picture;
    if context.common.json {
        let materials: Vec<Value> = looks
            .iter()
            .zip(baked)
            .map(|(look, b)| {
                json!({
                    "brdf": look.spec(),
                    "technique": look.method.slug(),
                    "bake_seconds": b.seconds,
                    "bytes": b.bytes,
                    "error": b.error(),
                    "error_known": b.known(),
                })
            })
            .collect();
        return context.print_json(json!({
            "output": o.output.file_name().map(|n| n.to_string_lossy()),
            "width": plan.settings.width,
            "height": plan.settings.height,
            "exposure": ev,
            "triangles": plan.mesh.triangles.len(),
            "backend": backend,
            "render_seconds": seconds,
            "materials": materials,
        }));
    }
    let bake: f64 = baked.iter().map(|b| b.seconds).sum();
    let (w, h) = (plan.settings.width, plan.settings.height);
    let path = o.output.display();
    context.say(format_args!(
        "{path}: {w} x {h}, bake {bake:.2} s, render {seconds:.2} s, exposure {ev:+.2} EV"
    ));
    Ok(())
}

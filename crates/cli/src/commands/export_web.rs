//! `steradian export-web`: a static page that shades a scene in the browser.

use crate::commands::render::{self, Exposure, exposure, size, tone_mapper};
use crate::context::Context;
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, AdjustArgs, ExtraLights};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use steradian_render::ToneMapper;
use steradian_session::web::{Request, Truth};
use steradian_session::{DEFAULT_SKY, Destinations, Method, is_shape};

/// Options of `steradian export-web`.
#[derive(Debug, Args)]
pub struct Options {
    /// Scene file (.toml), mesh file, or built-in shape
    #[arg(value_name = "SCENE|MESH|SHAPE")]
    input: String,
    /// Folder of the page: open its index.html, from a server or from the disk
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Light: an image, or a sky spec such as sky:elevation=35 [default: sky, or the scene file's]
    #[arg(short, long, value_name = "FILE|SKY")]
    environment: Option<String>,
    /// Another light to choose; may be given several times
    #[arg(long, value_name = "FILE|SKY")]
    also: Vec<String>,
    /// How the page calls a light, in the order of the lights; may be given several times [default: after the
    /// file or sky]
    #[arg(long, value_name = "NAME")]
    light_name: Vec<String>,
    #[command(flatten)]
    adjust: AdjustArgs,
    #[command(flatten)]
    lights: ExtraLights,
    /// Reflectance of the mesh, such as ggx:alpha=0.2 [default: what the file says, else lambert:albedo=0.6]
    #[arg(short, long, value_name = "SPEC")]
    brdf: Option<String>,
    /// Technique to choose; may be given several times. Each shades the materials that it takes, the others
    /// are shaded as without it [default: what the scene file says, else the technique of the smallest error]
    #[arg(short, long, value_name = "SLUG")]
    technique: Vec<String>,
    /// Leave out the materials of the mesh file
    #[arg(long)]
    plain: bool,
    /// A plane of this reflectance under the mesh, as far as the horizon [default of the SPEC:
    /// lambert:albedo=0.4]
    #[arg(long, value_name = "SPEC", num_args = 0..=1, require_equals = true, default_missing_value = "lambert:albedo=0.4")]
    ground: Option<String>,
    /// Bake the reference's picture of the first view in, for the heat map and for errors; it is computed on
    /// the CPU
    #[arg(long)]
    reference: bool,
    /// The same by paths, which know shadows and light from surface to surface
    #[arg(long, conflicts_with = "reference")]
    path: bool,
    /// Relative error of the reference at each point
    #[arg(long, value_name = "T", default_value_t = 1e-2, allow_negative_numbers = true, value_parser = inputs::positive)]
    reference_tolerance: f64,
    /// Relative RMS error of radiance asked of the techniques; a miss writes the page and exits 4
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// Size of the pictures that stand in where a browser draws nothing, pixels [default: 640x400]
    #[arg(long, value_name = "WxH", value_parser = size)]
    size: Option<(usize, usize)>,
    /// Heading of the page [default: after the scene]
    #[arg(long, value_name = "TEXT")]
    title: Option<String>,
    /// Exposure in stops (EV) before the tone mapper, or auto [default: auto]
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure)]
    exposure: Option<Exposure>,
    /// Tone mapper: linear, reinhard, aces, agx, neutral, … [default: neutral]
    #[arg(long, value_name = "NAME", value_parser = tone_mapper)]
    tone_mapper: Option<ToneMapper>,
    /// Blur of the background, degrees [default: that of 512 texels around the horizon]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = render::blur)]
    blur: Option<f64>,
    /// Position of the camera, metres [default: framed]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = inputs::vector)]
    from: Option<[f64; 3]>,
    /// What the camera looks at and turns around, metres [default: centre of the mesh]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = inputs::vector)]
    at: Option<[f64; 3]>,
    /// Vertical field of view, degrees [default: 32, or what the scene file says]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true, value_parser = inputs::positive)]
    fov: Option<f64>,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    context.check_web()?;
    let mut places = Destinations::default();
    places.folder(&o.output, false)?;
    let (folder, request) = request(o, context)?;
    let (written, missed) = context.export_web(&request, &folder)?.even_if_missed();
    let bytes: usize = written.files.iter().map(|f| f.1).sum();
    if context.common.json {
        let files: Vec<_> = written.files.iter().map(|(n, b)| json!({"name": n, "bytes": b})).collect();
        let variant = |(t, l, e): &(String, String, Option<f64>)| json!({"technique": t, "light": l, "relative_rms": e});
        let variants: Vec<_> = written.variants.iter().map(variant).collect();
        context.print_json(json!({"bytes": bytes, "files": files, "variants": variants}))?;
    } else {
        for (technique, light, error) in &written.variants {
            let error =
                error.map_or_else(String::new, |e| format!(", {:.2} % from the reference", 100.0 * e));
            context.say(format_args!("{technique} under {light}{error}"));
        }
        let (count, megabytes) = (written.files.len(), bytes as f64 / 1e6);
        let index = folder.join("index.html");
        context.say(format_args!("{count} files, {megabytes:.2} MB; open {}", index.display()));
    }
    missed.map_or(Ok(()), |m| Err(m.into()))
}

fn request(o: Options, context: &mut Context) -> Result<(PathBuf, Request), Failure> {
    let methods: Vec<Method> = o.technique.iter().map(|t| Method::find(t)).collect::<Result<_, _>>()?;
    let count = 1 + o.also.len();
    if o.light_name.len() > count {
        return Err(Failure::usage(format!("{} names for {count} lights", o.light_name.len())));
    }
    let adjust = o.adjust.get();
    let also: Vec<_> = o
        .also
        .iter()
        .map(|spec| Ok((spec.clone(), context.light(spec, &adjust)?)))
        .collect::<Result<_, Failure>>()?;
    let toml = Path::new(&o.input).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    let first = o.environment.clone().unwrap_or(if toml { "Light of the scene" } else { DEFAULT_SKY }.into());
    let stem = Path::new(&o.input).file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let name = if is_shape(&o.input) { o.input.split(':').next().unwrap_or_default().into() } else { stem };
    let title = o.title.unwrap_or_else(|| capital(&name));
    let truth = match (o.path, o.reference) {
        (true, _) => Truth::Paths,
        (_, true) => Truth::Integral(o.reference_tolerance),
        _ => Truth::None,
    };
    let mut scene = render::scene(
        &render::Options {
            input: o.input,
            environment: o.environment,
            adjust: o.adjust,
            lights: o.lights,
            brdf: o.brdf,
            technique: (methods.len() == 1).then(|| methods[0].slug().into()),
            plain: o.plain,
            ground: o.ground,
            tolerance: o.tolerance,
            size: Some(o.size.unwrap_or((640, 400))),
            exposure: o.exposure,
            tone_mapper: o.tone_mapper,
            blur: o.blur,
            from: o.from,
            at: o.at,
            fov: o.fov,
            ..render::Options::default()
        },
        context,
    )?;
    // Techniques are chosen anew for each light.
    if !methods.is_empty() {
        scene.materials.iter_mut().chain(&mut scene.ground).for_each(|m| m.method = None);
    }
    let all = [(first, scene.lights.clone())].into_iter().chain(also);
    let names = o.light_name.into_iter().map(Some).chain(std::iter::repeat(None));
    let lights = all.zip(names).map(|((spec, lights), name)| (name.unwrap_or_else(|| called(&spec)), lights));
    Ok((o.output, Request { lights: lights.collect(), scene, methods, truth, title }))
}

/// The name of a light: of a file its own, of a sky its spec.
fn called(spec: &str) -> String {
    let path = Path::new(spec);
    match path.file_stem() {
        Some(stem) if path.is_file() => capital(&stem.to_string_lossy()),
        _ => capital(&spec.replacen(':', ", ", 1).replace(',', ", ").replace(",  ", ", ").replace('=', " ")),
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |c| c.to_uppercase().chain(letters).collect())
}

//! `steradian compare`: techniques side by side against the reference.

use crate::commands::render::{size, tone_mapper};
use crate::context::{self, Context};
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, AdjustArgs, LocalArg, PathArgs, ShadowArg};
use clap::Args;
use glam::Vec3;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_base::ParamValues;
use steradian_brdf::SharedBrdf;
use steradian_light::{Lamp, Lights};
use steradian_render::scenefile::SceneBackground;
use steradian_render::{Settings, SurfaceMaps, ToneMapper};
use steradian_session::compare::Plan;
use steradian_session::comparison::{
    Finding, Kept, Sweep, Swept, csv, digest, document, drawing, html, latex, mark as file_mark, sheet, table,
};
use steradian_session::{
    DEFAULT_SKY, Destinations, Material, Method, Model, Renderer, Scene, SceneOverrides, Shadows,
    check_output, light_as_baked, make_tangents,
};
use steradian_techniques::SavedBake;
use steradian_techniques::direct::Suns;

/// Options of `steradian compare`.
#[derive(Debug, Args)]
pub struct Options {
    /// Mesh file, built-in shape, or scene file (.toml), in which a technique shades the materials that it takes and the
    /// reference the others
    #[arg(value_name = "MESH|SHAPE|SCENE", default_value = "sphere")]
    mesh: String,
    /// Light: image or sky spec; may be given several times [default: sky, or the scene file's]
    #[arg(short, long, value_name = "FILE|SKY")]
    environment: Vec<String>,
    #[command(flatten)]
    adjust: AdjustArgs,
    /// A light beside the environment: directional:direction=X/Y/Z,irradiance=R/G/B, point:position=X/Y/Z,intensity=R/G/B
    /// or disk:direction=X/Y/Z,angular-radius=DEGREES,irradiance=R/G/B; may be given several times. Without --environment
    /// there is no other light
    #[arg(long, value_name = "SPEC", value_parser = Lamp::parse)]
    light: Vec<Lamp>,
    #[command(flatten)]
    local: LocalArg,
    /// BRDF spec; may be given several times [default: the mesh file's materials, else lambert:albedo=0.6 and
    /// ggx:alpha=0.2]
    #[arg(short, long, value_name = "SPEC")]
    brdf: Vec<String>,
    /// Technique; may be given several times [default: all that take the material; beside --bake none]
    #[arg(short, long, value_name = "SLUG")]
    technique: Vec<String>,
    /// Parameter of the techniques that have it
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = inputs::parameter)]
    params: Vec<inputs::Parameter>,
    /// A saved bake (.safetensors, or the folder of one) of the light and the reflectance; may be given several times
    #[arg(long, value_name = "FILE")]
    bake: Vec<PathBuf>,
    /// Contact sheet
    #[arg(short, long, value_name = "OUT.png")]
    output: Option<PathBuf>,
    /// Report as one web page: table, pictures, maps of the differences
    #[arg(long, value_name = "OUT.html")]
    html: Option<PathBuf>,
    /// The table as .csv, or as .tex (LaTeX, booktabs)
    #[arg(long, value_name = "OUT.csv|OUT.tex")]
    table: Option<PathBuf>,
    /// Varies a parameter of --brdf, as brdf:alpha=0.05..0.5:8 (8 values by equal steps, with :log at the end by equal
    /// factors), or of the techniques that have it, as param:NAME=A..B:N
    #[arg(long, value_name = "SPEC", value_parser = Sweep::parse)]
    sweep: Option<Sweep>,
    /// Chart of the sweep, .svg or .png: error, bytes and seconds of baking against its parameter
    #[arg(long, value_name = "OUT.svg|OUT.png", requires = "sweep")]
    plot: Option<PathBuf>,
    /// File that keeps the numbers of each finished row, by a digest of inputs, specs, options and version; rows that it
    /// holds are not computed again. With --output or --html their pictures are kept too, in the folder FILE.json.pictures
    #[arg(long, value_name = "FILE.json")]
    resume: Option<PathBuf>,
    /// Size of each picture, pixels
    #[arg(long, value_name = "WxH", default_value = "160x160", value_parser = size)]
    size: (usize, usize),
    /// Relative error of the reference at each point
    #[arg(long, value_name = "T", default_value_t = 5e-3, allow_negative_numbers = true, value_parser = inputs::positive)]
    reference_tolerance: f64,
    /// Compare with paths, which know shadows and light from surface to surface, instead of the integral without them; suns
    /// are shaded exactly then, and shadowed by rays under techniques that know shadows
    #[arg(long)]
    path: bool,
    #[command(flatten)]
    paths: PathArgs,
    #[command(flatten)]
    shadows: ShadowArg,
    /// Light that varies over space, as `probes` writes it, in place of every other light; --environment is seen behind
    #[arg(long, value_name = "FILE.safetensors", conflicts_with = "path")]
    probes: Option<PathBuf>,
    /// Exit 4 where a technique's relative RMS error is larger
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// Tone mapper of the pictures and of FLIP: linear, reinhard, aces, agx, neutral, … [default: neutral]
    #[arg(long, value_name = "NAME", value_parser = tone_mapper)]
    tone_mapper: Option<ToneMapper>,
}

pub fn run(o: Options, context: &mut Context) -> Outcome {
    let mut places = Destinations::default();
    let outputs = [(&o.output, &["png"][..]), (&o.html, &["html", "htm"]), (&o.table, &["csv", "tex"])];
    for (path, known) in outputs {
        if let Some(path) = path {
            check_output(path, known)?;
            places.file("--output", path)?;
        }
    }
    if let Some(path) = &o.plot {
        check_output(path, &["svg", "png"])?;
        places.file("--plot", path)?;
    }
    if let Some(path) = &o.resume {
        places.file("--resume", path)?;
    }
    let findings = compare(&o, context)?;
    if let (Some(path), Some(sweep)) = (&o.plot, &o.sweep) {
        context.write_drawing(path, &drawing(&findings, sweep))?;
    }
    if let Some(path) = &o.output {
        context.write_display(path, &sheet(&short(&o.mesh), &findings).draw(), Vec::new())?;
    }
    if let Some(path) = &o.html {
        context.write_text(Some(path), &html(&short(&o.mesh), &findings)?)?;
    }
    if let Some(path) = &o.table {
        let tex = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("tex"));
        context.write_text(Some(path), &if tex { latex(&findings) } else { csv(&findings) })?;
    }
    if context.common.json {
        context.print_json(document(&findings))?;
    } else {
        context.print(&table(&findings))?;
    }
    gate(&o, &findings)
}

fn compare(o: &Options, context: &mut Context) -> Result<Vec<Finding>, Failure> {
    let bakes = bakes(o, context)?;
    if !bakes.is_empty() && (!o.light.is_empty() || o.local.get()?.is_some()) {
        return Err(Failure::usage("--bake: has its own light; leave --light and --local out"));
    }
    let methods = methods(o, &bakes)?;
    context.paths = o.paths.get(o.path)?;
    if o.path {
        // Suns beside techniques that know shadows are shadowed by rays, as paths are.
        context.suns = Suns::Exact;
    }
    context.shadows = o.shadows.shadows.unwrap_or_default();
    if !o.path && !matches!(context.shadows, Shadows::Auto | Shadows::Off | Shadows::Lobe) {
        let why = "the reference has no shadows: add --path, or give lobe, which shadows both";
        return Err(Failure::usage(format!("--shadows: {why}")));
    }
    let plan = Plan { reference_tolerance: o.reference_tolerance, paths: o.path, ev: 0.0 };
    let renderers = renderers(context)?;
    let scenes = if Path::new(&o.mesh).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        scenes(o, &methods, context)?
    } else {
        meshes(o, &bakes, &methods, context)?
    };
    let field = o.probes.as_deref().map(|path| context.probes(path)).transpose()?.map(Arc::new);
    let pictured = o.output.is_some() || o.html.is_some();
    let mut kept = o.resume.as_deref().map(|path| Kept::open(path, pictured)).transpose()?;
    let (mut findings, mut reused) = (Vec::new(), 0);
    for Case { environment, brdf, base, value, mark, mut scene } in scenes {
        scene.probes = field.clone().or(scene.probes);
        let keys = keys(o, &mark, &methods, &renderers);
        if let Some(answers) = kept.as_ref().and_then(|k| k.row(&keys)) {
            findings.push(Finding { environment, brdf, base, value, answers });
            reused += 1;
            continue;
        }
        scene.settings = Settings::new(o.size.0, o.size.1);
        scene.tone_mapper = o.tone_mapper.unwrap_or_default();
        scene.tolerance = o.tolerance;
        if scene.mesh.bounds().is_none() {
            return Err(Failure::input(format!("{}: has no triangles", o.mesh)));
        }
        let framed = || scene.framed(FOV, Vec3::Y);
        scene.camera = Some(scene.camera.map_or_else(framed, Ok)?);
        // All findings are held against the tolerance at the end, those of earlier runs too.
        let (answers, _) = context.compare(&scene, &methods, &renderers, &plan)?.even_if_missed();
        let finding = Finding { environment, brdf, base, value, answers };
        if let Some(kept) = &mut kept {
            kept.add(&finding, &keys)?;
        }
        findings.push(finding);
    }
    if let Some(path) = o.resume.as_ref().filter(|_| reused > 0) {
        context.say(format_args!("{reused} of {} rows are those of {}", findings.len(), path.display()));
    }
    Ok(findings)
}

/// The keys of a row's results: the reference's, then each method's on each renderer.
fn keys(o: &Options, mark: &str, methods: &[Method], renderers: &[Renderer]) -> Vec<String> {
    let number = |v: Option<f64>| v.map_or_else(|| "-".into(), |v| v.to_string());
    let common = [
        env!("CARGO_PKG_VERSION").to_string(),
        file_mark(&o.mesh),
        mark.into(),
        format!("{:?}", o.adjust),
        format!("{:?} {:?} {:?}", o.params, o.light, o.local),
        // Files as they are.
        o.params.iter().map(|(_, value)| file_mark(&value.to_string())).collect(),
        o.probes.as_ref().map_or_else(String::new, |path| file_mark(&path.display().to_string())),
        format!("{}x{}", o.size.0, o.size.1),
        format!("{} {} {} {:?}", o.reference_tolerance, number(o.tolerance), o.path, o.paths),
        format!("{:?}", o.shadows),
        o.tone_mapper.unwrap_or_default().name().into(),
    ];
    let one = |label: String, backend: &str| digest(&[&common[..], &[label, backend.into()]].concat());
    let file = |m: &Method| match m {
        Method::File(f) => file_mark(&f.path.display().to_string()),
        _ => m.label(),
    };
    let answers = methods.iter().flat_map(|m| renderers.iter().map(move |r| (file(m), r.name())));
    let reference = (Method::Reference.label(), Renderer::Cpu.name());
    [reference].into_iter().chain(answers).map(|(label, backend)| one(label, backend)).collect()
}

/// What a row is called whose light is that of --light alone.
const NO_ENVIRONMENT: &str = "the lights given";
/// Vertical field of view, degrees.
const FOV: f32 = 30.0;
/// Blur of the background, radians.
const BLUR: f64 = 0.02;

/// The saved bakes, which are of one light.
fn bakes(o: &Options, context: &mut Context) -> Result<Vec<Arc<SavedBake>>, Failure> {
    let mut out: Vec<Arc<SavedBake>> = Vec::new();
    let adjust = o.adjust.get();
    for path in &o.bake {
        let file = context.saved_bake(path, &adjust)?;
        if let Some(first) = out.first()
            && (light_as_baked(first, &adjust).rotate, first.made.exposure)
                != (light_as_baked(&file, &adjust).rotate, file.made.exposure)
        {
            let why = "its light was turned or scaled otherwise than that of the first --bake";
            return Err(Failure::usage(format!("{}: {why}", path.display())));
        }
        out.push(Arc::new(file));
    }
    if out.is_empty() {
        return Ok(out);
    }
    if o.environment.len() > 1 || o.brdf.len() > 1 {
        return Err(Failure::usage("--bake: is of one light and one reflectance; give each once at most"));
    }
    Ok(out)
}

/// What is beside the reference.
fn methods(o: &Options, bakes: &[Arc<SavedBake>]) -> Result<Vec<Method>, Failure> {
    let slugs: Vec<&str> = if o.technique.is_empty() && bakes.is_empty() {
        Method::slugs()
    } else {
        o.technique.iter().map(String::as_str).collect()
    };
    let all =
        slugs.into_iter().map(Method::find).filter(|m| !matches!(m, Ok(Method::Reference | Method::Path)));
    let mut out: Vec<Method> = all.collect::<Result<_, _>>()?;
    let swept = o.sweep.iter().filter(|s| s.of == Swept::Param).map(|s| &s.key);
    for name in o.params.iter().map(|p| &p.0).chain(swept) {
        let has = |m: &Method| matches!(m, Method::Technique(t) if t.params().iter().any(|p| p.name == name));
        if !out.iter().any(has) {
            return Err(Failure::usage(format!("--param {name}: no technique that is compared has it")));
        }
    }
    out.extend(bakes.iter().cloned().map(Method::File));
    Ok(out)
}

/// What is compared.
struct Case {
    environment: String,
    brdf: String,
    base: String,
    value: Option<f64>,
    /// Light and materials with the contents of their files.
    mark: String,
    scene: Scene,
}

/// Materials of a mesh.
struct MeshMaterials {
    name: String,
    base: String,
    value: Option<f64>,
    mark: String,
    materials: Vec<Material>,
}

/// The specs that a sweep makes of one, each with its value and the parameters of the techniques.
fn swept(o: &Options, spec: &str) -> Result<Vec<(String, Option<f64>, ParamValues)>, Failure> {
    let params = inputs::parameters(&o.params)?;
    let Some(sweep) = &o.sweep else { return Ok(vec![(spec.into(), None, params)]) };
    let one = |value: f64| match sweep.of {
        Swept::Brdf => (sweep.spec(spec, value), Some(value), params.clone()),
        Swept::Param => {
            let mut params = params.clone();
            params.0.insert(sweep.key.clone(), value.into());
            (spec.to_string(), Some(value), params)
        }
    };
    Ok(sweep.values.iter().map(|v| one(*v)).collect())
}

fn given<'a>(list: &'a [String], default: &[&'a str]) -> Vec<&'a str> {
    if list.is_empty() { default.to_vec() } else { list.iter().map(String::as_str).collect() }
}

/// A mesh or shape: every light with every reflectance, which the base colours of the mesh file multiply; without a
/// reflectance the file's own materials.
fn meshes(
    o: &Options,
    bakes: &[Arc<SavedBake>],
    methods: &[Method],
    context: &mut Context,
) -> Result<Vec<Case>, Failure> {
    let Model { mut mesh, materials } = context.model(&o.mesh)?;
    if o.sweep.is_some() && (o.brdf.is_empty() || !bakes.is_empty()) {
        return Err(Failure::usage(
            "--sweep varies a reflectance or its techniques: give --brdf, and no --bake",
        ));
    }
    let local = o.local.open(context)?.flatten();
    if let Some(local) = &local {
        local.check_mesh(&mesh, false, &o.mesh)?;
    }
    if local.as_ref().is_some_and(|l| l.is_textured(false)) {
        make_tangents(std::slice::from_mut(&mut mesh));
    }
    let material = |brdf, params: &ParamValues, base_colour, maps| Material {
        params: params.clone(),
        local: local.clone(),
        base_colour,
        maps,
        ..Material::new(brdf)
    };
    let mut sets: Vec<MeshMaterials> = Vec::new();
    if o.brdf.is_empty() && !materials.is_empty() {
        let params = inputs::parameters(&o.params)?;
        let own = materials.iter().map(|m| Ok(material(m.brdf()?, &params, m.tint(true), m.maps(true))));
        let materials = own.collect::<Result<_, Failure>>()?;
        let name = String::from("the file's materials");
        sets.push(MeshMaterials { base: name.clone(), value: None, mark: name.clone(), name, materials });
    } else {
        let specs: Vec<String> = match bakes.first() {
            Some(file) if o.brdf.is_empty() => vec![baked_brdf(file)?.0.into()],
            _ => given(&o.brdf, &["lambert:albedo=0.6", "ggx:alpha=0.2"])
                .into_iter()
                .map(String::from)
                .collect(),
        };
        for base in &specs {
            for (spec, value, params) in swept(o, base)? {
                let brdf = match bakes.first() {
                    Some(file) if o.brdf.is_empty() => baked_brdf(file)?.1,
                    _ => context.brdf(&spec)?,
                };
                bakes.iter().for_each(|file| context.tell_other_brdf(file, &brdf.spec()));
                let of_file =
                    materials.iter().map(|m| material(brdf.clone(), &params, m.tint(false), m.maps(false)));
                let mut all: Vec<_> = of_file.collect();
                if all.is_empty() {
                    all.push(material(brdf, &params, None, SurfaceMaps::default()));
                }
                let mut name = short(&spec);
                if let (Some(s), Some(v)) = (o.sweep.as_ref().filter(|s| s.of == Swept::Param), value) {
                    name += &format!(" [{}={v}]", s.key);
                }
                let mark = format!("{} {name}", file_mark(&spec));
                sets.push(MeshMaterials { name, base: short(base), value, mark, materials: all });
            }
        }
    }
    for m in sets.iter_mut().flat_map(|s| &mut s.materials) {
        *m = context.open_compared(m.clone(), methods, None)?;
        if !m.planes.is_empty() {
            if mesh.uvs.len() != mesh.positions.len() {
                let why = "has no texture coordinates, which the images of --param need";
                return Err(Failure::usage(format!("{}: {why}", o.mesh)));
            }
            make_tangents(std::slice::from_mut(&mut mesh));
        }
    }
    let mut out = Vec::new();
    let sky = bakes.first().map_or(DEFAULT_SKY, |b| &b.made.environment);
    let none = !o.light.is_empty() && o.environment.is_empty() && bakes.is_empty();
    for environment in given(&o.environment, &[if none { NO_ENVIRONMENT } else { sky }]) {
        let mut lights = match bakes.first() {
            Some(file) => {
                bakes.iter().skip(1).for_each(|other| context.tell_other_light(other, environment));
                baked_light(file, o, context)?
            }
            None if none => Lights::default(),
            None => context.light(environment, &o.adjust.get())?,
        };
        o.light.iter().for_each(|l| l.join(&mut lights));
        for set in &sets {
            let mut scene = Scene::new(mesh.clone(), set.materials.clone(), lights.clone());
            scene.background = SceneBackground::Environment(BLUR);
            out.push(Case {
                environment: short(environment),
                brdf: set.name.clone(),
                base: set.base.clone(),
                value: set.value,
                mark: format!("{} {}", file_mark(environment), set.mark),
                scene,
            });
        }
    }
    Ok(out)
}

/// The reflectance that a bake names.
fn baked_brdf(file: &SavedBake) -> Result<(&str, SharedBrdf), Failure> {
    let spec = &file.made.brdf;
    file.brdf().map(|brdf| (spec.as_str(), brdf)).ok_or_else(|| {
        Failure::usage(format!("{}: was baked of {spec}: name it with --brdf", file.path.display()))
    })
}

/// The light of a bake.
fn baked_light(file: &SavedBake, o: &Options, context: &mut Context) -> Result<Lights, Failure> {
    let given = o.environment.first().map(String::as_str);
    context.light_of_bake(file, given, &o.adjust.get())?.ok_or_else(|| {
        let (name, light) = (file.path.display(), &file.made.environment);
        Failure::usage(format!("{name}: was baked from {light}: name it with --environment"))
    })
}

/// A scene file, under its own light or those of the command line.
fn scenes(o: &Options, methods: &[Method], context: &mut Context) -> Result<Vec<Case>, Failure> {
    if o.sweep.is_some() || o.resume.is_some() {
        // What a scene file refers to is not part of its digest.
        return Err(Failure::usage("--sweep and --resume belong to a mesh or shape, not to a scene file"));
    }
    if !(o.brdf.is_empty() && o.bake.is_empty()) {
        let why = "--brdf and --bake belong to a mesh; a scene file has materials";
        return Err(Failure::usage(why));
    }
    let lights = if o.environment.is_empty() { vec![None] } else { o.environment.iter().map(Some).collect() };
    let mut out = Vec::new();
    for environment in lights {
        let overrides = SceneOverrides {
            environment: environment.cloned(),
            adjust: o.adjust.get(),
            method: None,
            local: o.local.open(context)?,
        };
        let mut scene = context.scene_file(Path::new(&o.mesh), &overrides)?;
        o.light.iter().for_each(|l| l.join(&mut scene.lights));
        if let SceneBackground::Environment(blur) = &mut scene.background {
            *blur = blur.max(BLUR);
        }
        for m in scene.materials.iter_mut().chain(&mut scene.ground) {
            let params = inputs::parameters(&o.params)?;
            let named = Material { params: params.clone(), ..m.clone() };
            m.planes = context.open_compared(named, methods, None)?.planes;
            m.params.0.extend(params.0);
        }
        let light = environment.map_or_else(|| "the scene's light".into(), |e| short(e));
        let brdf = short(&o.mesh);
        let (base, mark) = (brdf.clone(), String::new());
        out.push(Case { environment: light, brdf, base, value: None, mark, scene });
    }
    Ok(out)
}

/// What `--backend` asks for: one renderer, or both.
pub fn renderers(context: &Context) -> Result<Vec<Renderer>, Failure> {
    let asked = Renderer::open(context)?;
    let both = context.common.backend == context::Backend::Both;
    Ok(if both { vec![Renderer::Cpu, asked] } else { vec![asked] })
}

/// A name without its folders.
fn short(spec: &str) -> String {
    let (head, tail) = spec.split_once(':').unwrap_or(("", spec));
    let name = if tail.contains(['=', ',']) && !Path::new(spec).exists() {
        tail.to_string()
    } else {
        Path::new(tail).file_name().map_or_else(|| tail.into(), |n| n.to_string_lossy().into_owned())
    };
    if head.is_empty() || head.contains(['/', '\\']) { name } else { format!("{head}:{name}") }
}

fn gate(o: &Options, findings: &[Finding]) -> Outcome {
    match o.tolerance.and_then(|t| findings.iter().find_map(|f| f.missed(t))) {
        Some(why) => Err(Failure::missed(why)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lose_folders() {
        assert_eq!(short("/a/b/c.hdr"), "c.hdr");
        assert_eq!(short("merl:/a/b.binary"), "merl:b.binary");
        assert_eq!(short("ggx:alpha=0.1,f0=1/0.8/0.3"), "ggx:alpha=0.1,f0=1/0.8/0.3");
    }
}

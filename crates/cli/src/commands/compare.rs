//! `steradian compare`: techniques side by side against the reference.

mod forms;

use crate::commands::render::{size, tone_mapper};
use crate::context::{self, Context};
use crate::failure::{Failure, Outcome};
use crate::inputs::{self, AdjustArgs};
use clap::Args;
use forms::{csv, document, html, latex, sheet, table};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_brdf::SharedBrdf;
use steradian_light::Lights;
use steradian_render::scenefile::SceneBackground;
use steradian_render::{Maps, Settings, ToneMapper};
use steradian_session::compare::{Answer, Plan};
use steradian_session::{
    DEFAULT_SKY, Destinations, Material, Method, Model, Renderer, Scene, SceneOverrides, check_output,
    for_any_mesh, light_as_baked,
};
use steradian_techniques::SavedBake;

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
    /// Size of each picture, pixels
    #[arg(long, value_name = "WxH", default_value = "160x160", value_parser = size)]
    size: (usize, usize),
    /// Relative error of the reference at each point
    #[arg(long, value_name = "T", default_value_t = 5e-3, allow_negative_numbers = true, value_parser = inputs::positive)]
    reference_tolerance: f64,
    /// Exit 4 where a technique's relative RMS error is larger
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = inputs::positive)]
    tolerance: Option<f64>,
    /// Tone mapper of the pictures and of FLIP: linear, reinhard, aces, agx, neutral, … [default: neutral]
    #[arg(long, value_name = "NAME", value_parser = tone_mapper)]
    tone_mapper: Option<ToneMapper>,
}

/// A row of the table: light, material and what every technique makes of them.
struct Finding {
    environment: String,
    brdf: String,
    answers: Vec<Answer>,
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
    let findings = compare(&o, context)?;
    if let Some(path) = &o.output {
        context.write_display(path, &sheet(&o, &findings).draw(), Vec::new())?;
    }
    if let Some(path) = &o.html {
        context.write_text(Some(path), &html(&o, &findings)?)?;
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
    let methods = methods(o, &bakes)?;
    let plan = Plan { reference_tolerance: o.reference_tolerance, ev: 0.0 };
    let renderers = renderers(context)?;
    let scenes = if Path::new(&o.mesh).extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        scenes(o, context)?
    } else {
        meshes(o, &bakes, context)?
    };
    let mut findings = Vec::new();
    for (environment, brdf, mut scene) in scenes {
        scene.settings = Settings::new(o.size.0, o.size.1);
        scene.tone_mapper = o.tone_mapper.unwrap_or_default();
        scene.tolerance = o.tolerance;
        if scene.mesh.bounds().is_none() {
            return Err(Failure::input(format!("{}: has no triangles", o.mesh)));
        }
        scene.camera = Some(scene.camera_or_framed(Some(FOV))?);
        let answers = context.compare(&scene, &methods, &renderers, &plan)?;
        findings.push(Finding { environment, brdf, answers });
    }
    Ok(findings)
}

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
        for_any_mesh(&file)?;
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
    let all = slugs.into_iter().map(Method::find).filter(|m| !matches!(m, Ok(Method::Reference)));
    let mut out: Vec<Method> = all.collect::<Result<_, _>>()?;
    for (name, _) in &o.params {
        let has = |m: &Method| matches!(m, Method::Technique(t) if t.params().iter().any(|p| p.name == name));
        if !out.iter().any(has) {
            return Err(Failure::usage(format!("--param {name}: no technique that is compared has it")));
        }
    }
    out.extend(bakes.iter().cloned().map(Method::File));
    Ok(out)
}

/// What is compared, with the names of its light and its materials.
type Named = (String, String, Scene);

fn given<'a>(list: &'a [String], default: &[&'a str]) -> Vec<&'a str> {
    if list.is_empty() { default.to_vec() } else { list.iter().map(String::as_str).collect() }
}

/// A mesh or shape: every light with every reflectance, which the base colours of the mesh file multiply; without a
/// reflectance the file's own materials.
fn meshes(o: &Options, bakes: &[Arc<SavedBake>], context: &mut Context) -> Result<Vec<Named>, Failure> {
    let Model { mesh, materials } = context.model(&o.mesh)?;
    let params = inputs::parameters(&o.params)?;
    let material =
        |brdf, base_colour, maps| Material { brdf, method: None, params: params.clone(), base_colour, maps };
    let mut looks: Vec<(String, Vec<Material>)> = Vec::new();
    if o.brdf.is_empty() && !materials.is_empty() {
        let own = materials.iter().map(|m| Ok(material(m.brdf()?, m.tint(true), m.maps(true))));
        looks.push(("the file's materials".into(), own.collect::<Result<_, Failure>>()?));
    } else {
        let own: Vec<(&str, SharedBrdf)> = match bakes.first() {
            Some(file) if o.brdf.is_empty() => vec![baked_brdf(file)?],
            _ => given(&o.brdf, &["lambert:albedo=0.6", "ggx:alpha=0.2"])
                .into_iter()
                .map(|spec| Ok((spec, context.brdf(spec)?)))
                .collect::<Result<_, Failure>>()?,
        };
        for (spec, brdf) in own {
            bakes.iter().for_each(|file| context.tell_other_brdf(file, &brdf.spec()));
            let of_file = materials.iter().map(|m| material(brdf.clone(), m.tint(false), m.maps(false)));
            let mut all: Vec<_> = of_file.collect();
            if all.is_empty() {
                all.push(material(brdf, None, Maps::default()));
            }
            looks.push((short(spec), all));
        }
    }
    let mut out = Vec::new();
    let sky = bakes.first().map_or(DEFAULT_SKY, |b| &b.made.environment);
    for environment in given(&o.environment, &[sky]) {
        let lights = match bakes.first() {
            Some(file) => {
                bakes.iter().skip(1).for_each(|other| context.tell_other_light(other, environment));
                baked_light(file, o, context)?
            }
            None => context.light(environment, &o.adjust.get())?,
        };
        for (name, materials) in &looks {
            let mut scene = Scene::new(mesh.clone(), materials.clone(), lights.clone());
            scene.background = SceneBackground::Environment(BLUR);
            out.push((short(environment), name.clone(), scene));
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
fn scenes(o: &Options, context: &mut Context) -> Result<Vec<Named>, Failure> {
    if !(o.brdf.is_empty() && o.bake.is_empty() && o.params.is_empty()) {
        let why = "--brdf, --param and --bake belong to a mesh; a scene file has materials";
        return Err(Failure::usage(why));
    }
    let lights = if o.environment.is_empty() { vec![None] } else { o.environment.iter().map(Some).collect() };
    let mut out = Vec::new();
    for environment in lights {
        let overrides =
            SceneOverrides { environment: environment.cloned(), adjust: o.adjust.get(), method: None };
        let mut scene = context.scene_file(Path::new(&o.mesh), &overrides)?;
        if let SceneBackground::Environment(blur) = &mut scene.background {
            *blur = blur.max(BLUR);
        }
        let light = environment.map_or_else(|| "the scene's light".into(), |e| short(e));
        out.push((light, short(&o.mesh), scene));
    }
    Ok(out)
}

fn renderers(context: &Context) -> Result<Vec<Renderer>, Failure> {
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
    let Some(t) = o.tolerance else { return Ok(()) };
    for f in findings {
        for r in f.answers.iter().filter_map(Answer::rendering) {
            if let Some((e, _)) = &r.errors
                && (e.relative_rms > t || e.relative_rms.is_nan())
            {
                let why = format!(
                    "{} on {} under {}: error {:.4} is above {t}",
                    r.label, f.brdf, f.environment, e.relative_rms
                );
                return Err(Failure::missed(why));
            }
        }
    }
    Ok(())
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

//! Scene files: what they refer to is loaded here.

use crate::commands::render::{Plan, SceneOverrides};
use crate::context::Context;
use crate::failure::Failure;
use crate::inputs::{self, Adjust, Method};
use crate::looks::Wanted;
use crate::model::{complete, make_tangents};
use glam::Affine3A;
use std::path::{Path, PathBuf};
use steradian_brdf::Files;
use steradian_formats::{file_below, read_text};
use steradian_light::Lights;
use steradian_render::scenefile::{At, MeshSource, SceneMaterial, SceneMesh};
use steradian_render::{Maps, SceneFile, Settings};
use steradian_scene::Mesh;

/// A thousand meshes with materials of their own take a tenth of it.
const MAX_BYTES: u64 = 4 << 20;

/// Loads the scene file `path` and all that it refers to.
pub fn plan(path: &Path, overrides: &SceneOverrides, context: &mut Context) -> Result<Plan, Failure> {
    let text = read_text(path, MAX_BYTES, "a scene file")?;
    context.note_input(path);
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let file = SceneFile::parse(&path.display().to_string(), &text, Files::Below(&folder))?;
    let mut meshes = Vec::new();
    for m in &file.meshes {
        meshes.push(load_mesh(&file, m, &folder, context)?.with_material(m.material as u32));
    }
    complete(&mut meshes);
    let mesh = Mesh::merged(&meshes);
    let looks = file
        .materials
        .iter()
        .map(|m| look(&file, m, &folder, overrides, context))
        .collect::<Result<_, _>>()?;
    let output = &file.output;
    Ok(Plan {
        mesh,
        looks,
        lights: lights(&file, &folder, overrides, context)?,
        camera: file.camera,
        settings: Settings { edge: output.samples, ..Settings::new(output.width, output.height) },
        exposure: output.exposure,
        tone_mapper: output.tone_mapper,
        background: output.background,
        tolerance: None,
    })
}

/// Errors of what the file refers to point at the place that refers to it.
fn located<T, V>(file: &SceneFile, at: &At<V>, result: Result<T, Failure>) -> Result<T, Failure> {
    result.map_err(|f| match f.code {
        1 => f,
        _ => file.error(at, f.message).into(),
    })
}

/// The file below the scene file's folder that `name` says.
fn below(folder: &Path, name: &str) -> Result<PathBuf, Failure> {
    file_below(folder, name).map_err(Failure::input)
}

/// The files below the scene file's folder that make an environment: `name` itself, or several as
/// [`inputs::light_files`] takes them.
fn environment(folder: &Path, name: &str) -> Result<Vec<PathBuf>, Failure> {
    let files = inputs::light_files(&below(folder, name)?, |part| below(folder, part), name)?;
    // A pattern has become the names of files, which may be links.
    for file in &files {
        let inside = file.strip_prefix(folder).unwrap_or(file);
        below(folder, &inside.to_string_lossy())?;
    }
    Ok(files)
}

fn load_mesh(file: &SceneFile, m: &SceneMesh, folder: &Path, context: &mut Context) -> Result<Mesh, Failure> {
    let loaded = match &m.source.value {
        MeshSource::Shape(name) => inputs::shape(name),
        MeshSource::File(name) => below(folder, name).and_then(|p| inputs::mesh_file(&p, context)),
    };
    let mut mesh = located(file, &m.source, loaded)?;
    if file.materials[m.material].normal.is_some() {
        make_tangents(std::slice::from_mut(&mut mesh));
    }
    if let Some(direction) = m.brushing {
        mesh.brush(direction);
    }
    Ok(mesh.transformed(&Affine3A::from_mat4(m.transform)))
}

fn look(
    file: &SceneFile,
    m: &SceneMaterial,
    folder: &Path,
    overrides: &SceneOverrides,
    context: &mut Context,
) -> Result<Wanted, Failure> {
    let named = m.technique.as_ref().or(file.output.technique.as_ref());
    let method = match (overrides.method.clone(), named) {
        (Some(method), _) => Some(method),
        (None, Some(slug)) => Some(located(file, slug, Method::find(&slug.value))?),
        (None, None) if !m.params.0.is_empty() => {
            let why = "params belong to a technique: name it with technique = \"…\"";
            return Err(Failure::input(format!("{}: material '{}': {why}", file.file, m.name)));
        }
        (None, None) => None,
    };
    let texture = m.base_colour.as_ref().map(|t| {
        let loaded = below(folder, &t.value).and_then(|p| inputs::texture(&p, context));
        located(file, t, loaded)
    });
    let image = |name: &At<String>,
                 make: &dyn Fn(&Path, &mut Context) -> Result<Maps, Failure>,
                 context: &mut Context| {
        let loaded = below(folder, &name.value).and_then(|p| make(&p, context));
        located(file, name, loaded)
    };
    let mut maps = Maps { filtering: file.output.normal_filtering, ..Maps::default() };
    if let Some(name) = &m.normal {
        let scale = m.normal_scale;
        maps.normal = image(name, &|p, c| inputs::normal_map(p, scale, c), context)?.normal;
    }
    if let Some(name) = &m.roughness {
        maps.alpha2 = image(name, &|p, c| inputs::roughness_map(p, c), context)?.alpha2;
    }
    Ok(Wanted { brdf: m.brdf.clone(), method, params: m.params.clone(), texture: texture.transpose()?, maps })
}

fn lights(
    file: &SceneFile,
    folder: &Path,
    o: &SceneOverrides,
    context: &mut Context,
) -> Result<Lights, Failure> {
    let l = &file.light;
    let adjust = Adjust {
        rotate: l.rotation.to_degrees() + o.adjust.rotate,
        light_exposure: l.exposure + o.adjust.light_exposure,
        ..o.adjust
    };
    let mut lights = match (&o.environment, &l.environment) {
        (Some(spec), _) => inputs::light(spec, &adjust, context)?,
        (None, Some(spec)) => {
            let loaded = if inputs::is_sky(&spec.value) {
                inputs::light(&spec.value, &adjust, context)
            } else {
                environment(folder, &spec.value)
                    .and_then(|files| inputs::light_of(&files, &spec.value, &adjust, context))
            };
            located(file, spec, loaded)?
        }
        (None, None) => Lights::default(),
    };
    if let Some(name) = &l.sun_lights {
        let joined = below(folder, &name.value)
            .and_then(|p| crate::suns::join_file(&p, &mut lights, &adjust, context));
        located(file, name, joined)?;
    }
    lights.disks.extend(&l.disks);
    lights.directionals.extend(&l.directionals);
    lights.points.extend(&l.points);
    Ok(lights)
}

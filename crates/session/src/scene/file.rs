//! Scene files: loading of the files that they refer to.

use super::{complete, make_tangents};
use crate::inputs::{self, Adjust, Method};
use crate::{Error, Kind, Local, Material, Scene, Session, has_extension};
use glam::Affine3A;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_base::Value;
use steradian_brdf::Files;
use steradian_formats::{file_below, read_text};
use steradian_light::Lights;
use steradian_render::scenefile::{At, MeshSource, SceneMaterial, SceneMesh};
use steradian_render::{SceneFile, Settings, SurfaceMaps};
use steradian_scene::Mesh;

/// Largest size of a scene file; a thousand meshes with materials of their own take a tenth of it.
const MAX_BYTES: u64 = 4 << 20;

/// Values of a scene file that the caller overrides.
#[derive(Clone, Default)]
pub struct SceneOverrides {
    /// Another light in place of the file's.
    pub environment: Option<String>,
    /// Rotation and scale of the light in addition to the file's.
    pub adjust: Adjust,
    /// A technique, or the reference, for every material.
    pub method: Option<Method>,
    /// A technique for directional and point lights for every material; `Some(None)` shades them exactly.
    pub local: Option<Option<Local>>,
}

/// Is this the name of a scene file?
pub fn is_scene_file(input: &str) -> bool {
    has_extension(Path::new(input), &["toml"])
}

impl Session {
    /// Loads a scene file and all that it refers to, which lies below its folder.
    pub fn scene_file(&mut self, path: &Path, overrides: &SceneOverrides) -> Result<Scene, Error> {
        scene(path, overrides, self)
    }
}

/// Memory that a vertex takes, bytes: its attributes, once more while meshes are merged.
const VERTEX_BYTES: u64 = 2 * 60;
/// Memory that a triangle takes, bytes: its indices and slot twice, and its share of the tree and of its
/// building.
const TRIANGLE_BYTES: u64 = 2 * 16 + 160;

fn scene(path: &Path, overrides: &SceneOverrides, session: &mut Session) -> Result<Scene, Error> {
    let text = read_text(path, MAX_BYTES, "a scene file")?;
    session.note_input(path);
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let file = SceneFile::parse(&path.display().to_string(), &text, Files::Below(&folder))?;
    let materials = file
        .materials
        .iter()
        .map(|m| material(&file, m, &folder, overrides, session))
        .collect::<Result<Vec<_>, _>>()?;
    let mut meshes = Vec::new();
    for m in &file.meshes {
        meshes.push(
            load_mesh(&file, m, &materials[m.material], &folder, session)?.with_material(m.material as u32),
        );
        let [vertices, triangles] = [|m: &Mesh| m.positions.len(), |m: &Mesh| m.triangles.len()]
            .map(|count| meshes.iter().map(count).sum::<usize>() as u64);
        let limit = session.task.max_memory();
        if VERTEX_BYTES * vertices + TRIANGLE_BYTES * triangles > limit {
            let (file, mib) = (path.display(), limit >> 20);
            return Err(Error::input(format!(
                "{file}: its meshes of {triangles} triangles take more than {mib} MiB: fewer of them, fewer segments, or a larger `max-memory`"
            )));
        }
    }
    complete(&mut meshes);
    let mesh = Mesh::merged(&meshes);
    let ground = file.ground.map(|i| materials[i].clone());
    let output = &file.output;
    let scene = Scene::new(mesh, materials, lights(&file, &folder, overrides, session)?);
    let field = |name: &At<String>, session: &mut Session| {
        let read = below(&folder, &name.value).and_then(|p| session.probes(&p));
        located(&file, name, read).map(Arc::new)
    };
    // An environment from the caller replaces the file's probes as well.
    let named = file.light.probes.as_ref().filter(|_| overrides.environment.is_none());
    let probes = named.map(|name| field(name, session)).transpose()?;
    Ok(Scene {
        probes,
        ground,
        camera: file.camera,
        settings: Settings { edge: output.samples, ..Settings::new(output.width, output.height) },
        exposure: output.exposure,
        tone_mapper: output.tone_mapper,
        background: output.background,
        ..scene
    })
}

/// Adds to errors of a file the place in the scene file that refers to it.
fn located<T, V>(file: &SceneFile, at: &At<V>, result: Result<T, Error>) -> Result<T, Error> {
    result.map_err(|e| match e.kind() {
        Kind::Failed => e,
        _ => file.error(at, e.to_string()).into(),
    })
}

/// The file below the scene file's folder that `name` says.
pub(crate) fn below(folder: &Path, name: &str) -> Result<PathBuf, Error> {
    file_below(folder, name).map_err(Error::input)
}

/// The files below the scene file's folder that make an environment: `name` itself, or several as
/// [`inputs::light_files`] takes them.
fn environment(folder: &Path, name: &str) -> Result<Vec<PathBuf>, Error> {
    let files = inputs::light_files(&below(folder, name)?, |part| below(folder, part), name)?;
    // A pattern was expanded to files, any of which may be a link.
    for file in &files {
        let inside = file.strip_prefix(folder).unwrap_or(file);
        below(folder, &inside.to_string_lossy())?;
    }
    Ok(files)
}

fn load_mesh(
    file: &SceneFile,
    m: &SceneMesh,
    material: &Material,
    folder: &Path,
    session: &mut Session,
) -> Result<Mesh, Error> {
    let loaded = match &m.source.value {
        MeshSource::Shape(name) => inputs::shape(name),
        MeshSource::File(name) => below(folder, name).and_then(|p| session.mesh_file(&p)),
    };
    let mut mesh = located(file, &m.source, loaded)?;
    let (MeshSource::Shape(name) | MeshSource::File(name)) = &m.source.value;
    located(file, &m.source, material.check_mesh(&mesh, name))?;
    if material.maps.normal.is_some() || material.is_textured() {
        make_tangents(std::slice::from_mut(&mut mesh));
    }
    if let Some(direction) = m.brushing {
        mesh.brush(direction);
    }
    Ok(mesh.transformed(&Affine3A::from_mat4(m.transform)))
}

fn material(
    file: &SceneFile,
    m: &SceneMaterial,
    folder: &Path,
    overrides: &SceneOverrides,
    session: &mut Session,
) -> Result<Material, Error> {
    m.opened.iter().for_each(|path| session.note_input(path));
    let named = m.technique.as_ref().or(file.output.technique.as_ref());
    let method = match (overrides.method.clone(), named) {
        (Some(method), _) => Some(method),
        (None, Some(slug)) => Some(located(file, slug, Method::find(&slug.value))?),
        (None, None) if !m.params.0.is_empty() => {
            let why = "params belong to a technique: name it with technique = \"…\"";
            return Err(Error::input(format!("{}: material '{}': {why}", file.file, m.name)));
        }
        (None, None) => None,
    };
    // Images of the material that a technique reads, by their places in the list.
    let mut read = Vec::new();
    let mut params = m.params.clone();
    if let Some(Method::Technique(t)) = &method {
        for (k, (name, at)) in m.textures.iter().enumerate() {
            if t.planes().iter().any(|p| p.name == *name) {
                params.0.entry(name.clone()).or_insert_with(|| Value::File(at.value.as_str().into()));
                read.push(k);
            }
        }
    }
    let local = match (&overrides.local, m.local.as_ref().or(file.output.local.as_ref())) {
        (Some(local), _) => local.clone(),
        (None, Some(spec)) => {
            let parsed = if Local::is_file(&spec.value) {
                below(folder, &spec.value).and_then(|p| Local::parse(&p.to_string_lossy()))
            } else {
                Local::parse(&spec.value)
            };
            let mut parsed = located(file, spec, parsed)?;
            if let Some(local) = &mut parsed {
                let all = m.textures.iter().enumerate();
                read.extend(all.filter(|(_, (name, at))| local.name_file(name, &at.value)).map(|(k, _)| k));
            }
            let opened = parsed.map(|local| session.open_local(&local, Some(folder))).transpose();
            located(file, spec, opened)?
        }
        (None, None) => None,
    };
    // A technique that the caller names instead of the file's may read other images.
    if overrides.method.is_none() && overrides.local.is_none() {
        let unread = (0..m.textures.len()).find(|k| !read.contains(k)).map(|k| &m.textures[k]);
        if let Some((name, at)) = unread {
            let why = format!("material '{}': no technique of it reads a texture '{name}'", m.name);
            return Err(file.error(at, why).into());
        }
    }
    let texture = m.base_colour.as_ref().map(|t| {
        let loaded = below(folder, &t.value).and_then(|p| session.texture(&p));
        located(file, t, loaded)
    });
    let image = |name: &At<String>,
                 make: &dyn Fn(&Path, &mut Session) -> Result<SurfaceMaps, Error>,
                 session: &mut Session| {
        let loaded = below(folder, &name.value).and_then(|p| make(&p, session));
        located(file, name, loaded)
    };
    let mut maps = SurfaceMaps { filtering: file.output.normal_filtering, ..SurfaceMaps::default() };
    if let Some(name) = &m.normal {
        let scale = m.normal_scale;
        maps.normal = image(name, &|p, c| c.normal_map(p, scale), session)?.normal;
    }
    if let Some(name) = &m.roughness {
        maps.alpha2 = image(name, &|p, c| c.roughness_map(p), session)?.alpha2;
    }
    let base_colour = texture.transpose()?;
    let material = Material { method, params, local, base_colour, maps, ..Material::new(m.brdf.clone()) };
    session.open_material(material, Some(folder))
}

fn lights(
    file: &SceneFile,
    folder: &Path,
    o: &SceneOverrides,
    session: &mut Session,
) -> Result<Lights, Error> {
    let l = &file.light;
    let adjust = Adjust {
        rotate: l.rotation.to_degrees() + o.adjust.rotate,
        light_exposure: l.exposure + o.adjust.light_exposure,
        ..o.adjust
    };
    let mut lights = match (&o.environment, &l.environment) {
        (Some(spec), _) => session.light(spec, &adjust)?,
        (None, Some(spec)) => {
            let loaded = if inputs::is_sky(&spec.value) {
                session.light(&spec.value, &adjust)
            } else {
                environment(folder, &spec.value)
                    .and_then(|files| session.light_of(&files, &spec.value, &adjust))
            };
            located(file, spec, loaded)?
        }
        (None, None) => Lights::default(),
    };
    if let Some(name) = &l.sun_lights {
        let joined = below(folder, &name.value).and_then(|p| session.join_lights(&p, &mut lights, &adjust));
        located(file, name, joined)?;
    }
    lights.disks.extend(&l.disks);
    lights.directionals.extend(&l.directionals);
    lights.points.extend(&l.points);
    Ok(lights)
}

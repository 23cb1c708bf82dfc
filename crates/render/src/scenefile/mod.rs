//! The scene file: camera, meshes, materials, lights and output in TOML.
//!
//! [`SceneFile::parse`] checks everything that the text alone decides, and every fault names file, line,
//! column and key. Files that it refers to are loaded by whoever asks for a picture (those of measured
//! reflectance at once); their names stay below the scene file's own folder.
//!
//! ```toml
//! [camera]
//! from = [0.0, 1.2, 4.0]    # metres; at = [0, 0, 0], up = +Y
//! fov = 35                  # degrees, vertical; or height = 2.0 for parallel rays
//!
//! [[mesh]]
//! shape = "teapot"          # or file = "bunny.obj"
//! material = "clay"
//! rotate = [0, 30, 0]       # degrees about x, then y, then z
//!
//! [material.clay]
//! brdf = "lambert:albedo=0.6/0.5/0.4" # also base_color_texture, normal_texture, normal_scale, roughness_texture, textures
//!
//! [ground]                  # a plane under the meshes, as far as the horizon
//! material = "clay"
//!
//! [light]
//! environment = "sky:elevation=35" # or a file
//! rotation = 90             # degrees about +Y
//!
//! [[light.point]]           # also [[light.disk]] and [[light.directional]]
//! position = [1.0, 2.0, 0.5]
//! intensity = [10, 9, 8]    # W/sr
//!
//! [output]
//! width = 640
//! height = 480
//! tone_mapper = "neutral"
//! technique = "sh_irradiance"
//! local = "vertex_analytic:rate=pixel" # directional and point lights; exact where it is absent; materials have both too
//! ```

mod check;
mod error;
mod schema;

pub use error::SceneError;

use crate::{NormalFiltering, ToneMapper};
use glam::{Mat4, Vec3};
use std::path::PathBuf;
use steradian_base::ParamValues;
use steradian_brdf::{Files, SharedBrdf};
use steradian_light::{DirectionalLight, DiskLight, PointLight};
use steradian_scene::Camera;

/// A value and where it was written, for errors that come up when it is used.
#[derive(Debug, Clone, PartialEq)]
pub struct At<T> {
    /// The value.
    pub value: T,
    /// Byte position in the text.
    pub at: usize,
}

/// Source of a mesh.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MeshSource {
    /// A file, relative to the scene file's folder.
    File(String),
    /// A built-in shape.
    Shape(String),
}

/// One mesh.
#[derive(Debug, Clone)]
pub struct SceneMesh {
    /// File or shape.
    pub source: At<MeshSource>,
    /// Index of its material in [`SceneFile::materials`].
    pub material: usize,
    /// Object → world.
    pub transform: Mat4,
    /// Direction of brushing in the object, projected to the tangent plane.
    pub brushing: Option<Vec3>,
}

/// One material.
#[derive(Debug, Clone)]
pub struct SceneMaterial {
    /// Its name.
    pub name: String,
    /// The reflectance.
    pub brdf: SharedBrdf,
    /// Files that were read for it.
    pub opened: Vec<PathBuf>,
    /// File of a texture that multiplies the net reflectance, relative to the scene file's folder.
    pub base_colour: Option<At<String>>,
    /// File of a tangent-space normal map, relative to the scene file's folder.
    pub normal: Option<At<String>>,
    /// Factor of the normal map's x and y.
    pub normal_scale: f32,
    /// File of a map of perceptual roughness, relative to the scene file's folder.
    pub roughness: Option<At<String>>,
    /// Slug of its technique; `None` takes the picture's.
    pub technique: Option<At<String>>,
    /// Technique for its directional and point lights, with its parameters; `None` takes the picture's.
    pub local: Option<At<String>>,
    /// Parameters of the technique.
    pub params: ParamValues,
    /// Images, relative to the scene file's folder, by the names of the parameters that both kinds of
    /// technique read them for: heights, tangent angles, numbers of reflectances.
    pub textures: Vec<(String, At<String>)>,
}

/// Distant and near light.
#[derive(Debug, Clone, Default)]
pub struct SceneLight {
    /// File (relative to the scene file's folder) or sky spec.
    pub environment: Option<At<String>>,
    /// Rotation about +Y, radians.
    pub rotation: f64,
    /// Exposure value of the environment.
    pub exposure: f64,
    /// File of lights that `--extract-sun` took out of the environment; they turn and scale with it.
    pub sun_lights: Option<At<String>>,
    /// File of a light field in place of all other light, relative to the scene file's folder.
    pub probes: Option<At<String>>,
    /// Disks.
    pub disks: Vec<DiskLight>,
    /// Directional lights.
    pub directionals: Vec<DirectionalLight>,
    /// Point lights.
    pub points: Vec<PointLight>,
}

/// Background where no surface is visible.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SceneBackground {
    /// The environment, blurred by this angle in radians.
    Environment(f64),
    /// A colour.
    Colour([f32; 3]),
}

/// The picture.
#[derive(Debug, Clone)]
pub struct SceneOutput {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Exposure value; `None` is automatic.
    pub exposure: Option<f32>,
    /// The tone mapper.
    pub tone_mapper: ToneMapper,
    /// Slug of the technique of materials that name none.
    pub technique: Option<At<String>>,
    /// Technique for directional and point lights of materials that name none; `None` is exact shading.
    pub local: Option<At<String>>,
    /// Filtering of normal maps.
    pub normal_filtering: NormalFiltering,
    /// Background.
    pub background: SceneBackground,
    /// Samples per pixel and axis on edges.
    pub samples: usize,
}

/// A checked scene file.
#[derive(Debug, Clone)]
pub struct SceneFile {
    /// The file's name, for errors.
    pub file: String,
    text: String,
    /// The camera; `None` frames the meshes.
    pub camera: Option<Camera>,
    /// The meshes, at least one.
    pub meshes: Vec<SceneMesh>,
    /// Index of the material of a plane under the meshes, as far as the horizon.
    pub ground: Option<usize>,
    /// The materials by name.
    pub materials: Vec<SceneMaterial>,
    /// The lights.
    pub light: SceneLight,
    /// The picture.
    pub output: SceneOutput,
}

impl SceneFile {
    /// Parses and checks `text`; `file` is the name that errors show, `files` says which files its
    /// reflectances may open.
    pub fn parse(file: &str, text: &str, files: Files<'_>) -> Result<Self, SceneError> {
        let source = error::Source { file, text };
        let parsed: schema::SceneText = toml::from_str(text).map_err(|e| source.parse_error(&e))?;
        check::check(source, parsed, files)
    }

    /// Exposure and tone mapper of `text`; `None` where it is no scene. Opens no file.
    pub fn developed_by(text: &str) -> Option<(Option<f32>, ToneMapper)> {
        let parsed: schema::SceneText = toml::from_str(text).ok()?;
        let name = parsed.output.tone_mapper.as_ref().map(|name| name.get_ref().as_str());
        let exposure = parsed.output.exposure.filter(|ev| ev.is_finite());
        Some((exposure, name.and_then(ToneMapper::from_name).unwrap_or_default()))
    }

    /// An error at a value of this file.
    pub fn error<T>(&self, at: &At<T>, why: impl std::fmt::Display) -> SceneError {
        error::Source { file: &self.file, text: &self.text }.error(at.at, why.to_string())
    }
}

#[cfg(test)]
mod tests;

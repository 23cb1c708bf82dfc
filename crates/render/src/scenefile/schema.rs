//! Syntax of a scene file: nothing is resolved or loaded here.

use serde::Deserialize;
use std::collections::BTreeMap;
use steradian_base::Value;
use toml::Spanned;

/// A scene file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneText {
    /// The camera; framed automatically where absent.
    pub camera: Option<Spanned<CameraText>>,
    /// `[[mesh]]`: the geometry.
    #[serde(default)]
    pub mesh: Vec<Spanned<MeshText>>,
    /// `[material.NAME]`.
    #[serde(default)]
    pub material: BTreeMap<String, Spanned<MaterialText>>,
    /// `[ground]`.
    pub ground: Option<GroundText>,
    /// `[light]`.
    #[serde(default)]
    pub light: LightText,
    /// `[output]`.
    #[serde(default)]
    pub output: OutputText,
}

/// `[camera]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraText {
    /// Position, metres.
    pub from: [f32; 3],
    /// Target, metres.
    #[serde(default)]
    pub at: [f32; 3],
    /// Up; +Y.
    #[serde(default = "up")]
    pub up: [f32; 3],
    /// Vertical field of view, degrees; 35 where neither it nor `height` is given.
    pub fov: Option<Spanned<f32>>,
    /// Height of the picture in metres: parallel rays.
    pub height: Option<Spanned<f32>>,
}

fn up() -> [f32; 3] {
    [0.0, 1.0, 0.0]
}

/// `[[mesh]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeshText {
    /// A file below the scene file's folder.
    pub file: Option<Spanned<String>>,
    /// A built-in shape.
    pub shape: Option<Spanned<String>>,
    /// Name of a material.
    pub material: Spanned<String>,
    /// Metres, after rotation.
    #[serde(default)]
    pub translate: [f32; 3],
    /// Degrees about x, then y, then z.
    #[serde(default)]
    pub rotate: [f32; 3],
    /// One factor or three.
    pub scale: Option<Spanned<ScaleText>>,
    /// Direction of brushing, projected to the tangent plane.
    pub brushing: Option<[f32; 3]>,
}

/// One factor or three.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(untagged)]
pub enum ScaleText {
    /// One factor for all axes.
    One(f32),
    /// x, y and z.
    Three([f32; 3]),
}

/// `[ground]`: a plane under the meshes, as far as the horizon.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroundText {
    /// Name of a material.
    pub material: Spanned<String>,
}

/// `[material.NAME]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialText {
    /// A BRDF spec.
    pub brdf: Spanned<String>,
    /// An image below the scene file's folder; it multiplies the net reflectance.
    pub base_color_texture: Option<Spanned<String>>,
    /// A tangent-space normal map below the scene file's folder, green up (as in glTF).
    pub normal_texture: Option<Spanned<String>>,
    /// Scales the normal map's x and y; 1.
    pub normal_scale: Option<Spanned<f32>>,
    /// An image of perceptual roughness (green channel) below the scene file's folder, in place of the
    /// brdf's.
    pub roughness_texture: Option<Spanned<String>>,
    /// A technique's slug, or `reference`; that of `[output]` where absent.
    pub technique: Option<Spanned<String>>,
    /// A technique for directional and point lights, as `SLUG` or `SLUG:name=value,…`, or `exact`; that of
    /// `[output]` where absent.
    pub local: Option<Spanned<String>>,
    /// Parameters of the technique.
    #[serde(default)]
    pub params: BTreeMap<String, ParamText>,
    /// Images below the scene file's folder, by the names of the parameters that techniques read them for.
    #[serde(default)]
    pub textures: BTreeMap<String, Spanned<String>>,
}

/// The value of a parameter.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
pub enum ParamText {
    Switch(bool),
    Number(f64),
    Word(String),
}

impl From<&ParamText> for Value {
    fn from(text: &ParamText) -> Self {
        match text {
            ParamText::Switch(on) => (*on).into(),
            ParamText::Number(x) => (*x).into(),
            ParamText::Word(word) => word.as_str().into(),
        }
    }
}

/// `[light]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightText {
    /// An image below the scene file's folder, or a sky spec.
    pub environment: Option<Spanned<String>>,
    /// Degrees about +Y.
    pub rotation: Option<Spanned<f64>>,
    /// Exposure values by which the environment is scaled, −64 … 64.
    pub exposure: Option<Spanned<f64>>,
    /// A file of lights below the scene file's folder, as `--extract-sun` writes it.
    pub sun_lights: Option<Spanned<String>>,
    /// A light field below the scene file's folder, as `probes` writes it, in place of all other light.
    pub probes: Option<Spanned<String>>,
    /// `[[light.disk]]`.
    #[serde(default)]
    pub disk: Vec<Spanned<DiskText>>,
    /// `[[light.directional]]`.
    #[serde(default)]
    pub directional: Vec<Spanned<DirectionalText>>,
    /// `[[light.point]]`.
    #[serde(default)]
    pub point: Vec<Spanned<PointText>>,
}

/// `[[light.disk]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiskText {
    /// Towards its centre.
    pub direction: [f64; 3],
    /// Angular radius, degrees; the sun's is 0.2666.
    pub angular_radius: f64,
    /// Radiance, W sr⁻¹ m⁻².
    pub radiance: Option<[f64; 3]>,
    /// Instead: irradiance on a surface that faces it, W m⁻².
    pub irradiance: Option<[f64; 3]>,
}

/// `[[light.directional]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DirectionalText {
    /// Towards the light.
    pub direction: [f64; 3],
    /// Irradiance on a surface that faces it, W m⁻².
    pub irradiance: [f64; 3],
}

/// `[[light.point]]`.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PointText {
    /// Position, metres.
    pub position: [f32; 3],
    /// Radiant intensity, W sr⁻¹.
    pub intensity: [f32; 3],
}

/// `[output]`.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OutputText {
    /// Pixels per row; 512.
    pub width: Option<Spanned<usize>>,
    /// Rows; 512.
    pub height: Option<Spanned<usize>>,
    /// Exposure value, or absent for automatic.
    pub exposure: Option<f32>,
    /// A tone mapper's name.
    pub tone_mapper: Option<Spanned<String>>,
    /// A technique's slug, or `reference`.
    pub technique: Option<Spanned<String>>,
    /// A technique for directional and point lights, or `exact`.
    pub local: Option<Spanned<String>>,
    /// Filtering of normal maps: `covariance`, `isotropic` or `none`.
    pub normal_filtering: Option<Spanned<String>>,
    /// `environment`, `none` or a colour.
    pub background: Option<Spanned<BackgroundText>>,
    /// Blur of the background, degrees.
    pub blur: Option<Spanned<f64>>,
    /// Samples per pixel and axis on edges; 4.
    pub samples: Option<Spanned<usize>>,
}

/// `background`.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
pub enum BackgroundText {
    /// `environment` or `none`.
    Word(String),
    /// Linear radiance.
    Colour([f32; 3]),
}

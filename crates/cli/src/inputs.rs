//! Inputs that several commands take: light, reflectance, geometry, technique.

use crate::context::{Context, Negative};
use crate::failure::Failure;
use clap::Args;
use glam::DMat3;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_base::ParamValues;
use steradian_light::{Environment, Lights};
use steradian_prefilter::source::add_beams;
use steradian_prefilter::{Beam, Cosine, Zonal};
use steradian_render::Texture;
use steradian_scene::Mesh;
use steradian_sphere::sh::{self, ShRgb};
use steradian_sphere::{Layout, SphereImage};

/// A light with its name for labels.
pub struct Light {
    pub name: String,
    pub lights: Lights,
}

/// How an environment is turned and scaled.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct Adjust {
    /// Rotation of the light about +Y, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    pub rotate: f64,
    /// Exposure value by which the light is scaled
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    pub light_exposure: f64,
}

/// A finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err(format!("'{text}' is not a finite number")),
    }
}

/// A positive finite number.
pub fn positive(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v > 0.0 { Ok(v) } else { Err(format!("'{text}' is not positive")) })
}

/// `x,y,z`.
pub fn vector(text: &str) -> Result<[f64; 3], String> {
    let parts: Result<Vec<f64>, String> = text.split(',').map(|p| finite(p.trim())).collect();
    parts?.try_into().map_err(|_| format!("'{text}' is not x,y,z"))
}

/// `name=value`.
pub fn parameter(text: &str) -> Result<(String, f64), String> {
    let (name, value) = text.split_once('=').ok_or_else(|| format!("'{text}' is not NAME=VALUE"))?;
    Ok((name.trim().into(), finite(value.trim())?))
}

/// Parameters of a technique.
pub fn parameters(given: &[(String, f64)]) -> ParamValues {
    ParamValues(given.iter().cloned().collect())
}

/// A technique of the registry, or the judge.
#[derive(Clone, Copy)]
pub enum Method {
    /// The judge.
    Reference,
    /// A room.
    Technique(&'static dyn steradian_techniques::AnyTechnique),
}

impl Method {
    /// The technique called `slug`; `-` and `_` are the same.
    pub fn find(slug: &str) -> Result<Self, Failure> {
        if slug == "reference" {
            return Ok(Self::Reference);
        }
        steradian_techniques::find(slug).map(Self::Technique).ok_or_else(|| {
            let slugs = Self::slugs();
            Failure::usage(steradian_render::scenefile::unknown("technique", slug, &slugs))
        })
    }

    /// Every slug, the reference first.
    pub fn slugs() -> Vec<&'static str> {
        std::iter::once("reference").chain(steradian_techniques::registry().iter().map(|t| t.card().slug)).collect()
    }

    /// Its slug.
    pub fn slug(&self) -> &'static str {
        match self {
            Self::Reference => "reference",
            Self::Technique(t) => t.card().slug,
        }
    }
}

/// A reflectance from its spec; a file that it names is noted for the provenance.
pub fn brdf(spec: &str, context: &mut Context) -> Result<steradian_brdf::SharedBrdf, Failure> {
    let brdf = steradian_brdf::parse(spec)?;
    for part in spec.split([':', ',', '=']).skip(1) {
        if Path::new(part).is_file() {
            context.note_input(Path::new(part));
        }
    }
    Ok(brdf)
}

/// Loads a light: an image or a sky spec.
pub fn light(spec: &str, adjust: &Adjust, context: &mut Context) -> Result<Light, Failure> {
    let path = Path::new(spec);
    context.note_input(path);
    let raster = steradian_formats::read_image(path, &context.limits())?;
    let (w, h) = (raster.width, raster.height);
    let planes = raster.into_rgb().ok_or_else(|| Failure::input(format!("{spec}: has no colour")))?;
    let mut image = SphereImage { layout: Layout::LatLong, width: w, height: h, planes };
    if adjust.rotate != 0.0 {
        image = image.rotate(DMat3::from_rotation_y(adjust.rotate.to_radians()));
    }
    let _ = (Negative::Keep, adjust.light_exposure, PathBuf::new());
    let lights = Lights { environment: Some(Arc::new(Environment { image })), ..Lights::default() };
    Ok(Light { name: spec.into(), lights })
}

/// SH coefficients of everything distant up to `order`: texel sums of the image, disks and directional lights in
/// closed form.
pub fn coefficients(lights: &Lights, order: usize) -> ShRgb {
    let mut sh = match &lights.environment {
        Some(e) => sh::project(&e.image, order),
        None => ShRgb::zero(order),
    };
    let beams: Vec<Beam> =
        lights.disks.iter().map(Beam::from).chain(lights.directionals.iter().map(Beam::from)).collect();
    add_beams(&mut sh, &beams);
    sh
}

/// Zonal coefficients of the clamped cosine for `bands` bands: π, 2π/3, π/4, 0, −π/24, …
pub fn cosine(bands: usize) -> Vec<f64> {
    Cosine.coefficients(bands.saturating_sub(1))
}

/// Loads a mesh: a built-in shape, or a file.
pub fn mesh(spec: &str, context: &mut Context) -> Result<Mesh, Failure> {
    if is_shape(spec) { shape(spec) } else { mesh_file(Path::new(spec), context) }
}

fn is_shape(spec: &str) -> bool {
    spec == "sphere"
}

/// A built-in shape.
pub fn shape(name: &str) -> Result<Mesh, Failure> {
    let _ = name;
    Ok(steradian_scene::shapes::sphere(256))
}

/// Loads a mesh file.
pub fn mesh_file(path: &Path, context: &mut Context) -> Result<Mesh, Failure> {
    context.note_input(path);
    let data = steradian_formats::read_mesh(path, &context.limits())?;
    let p = &data.parts[0];
    Ok(Mesh {
        positions: p.positions.iter().map(|v| (*v).into()).collect(),
        normals: p.normals.iter().map(|v| (*v).into()).collect(),
        triangles: p.triangles.clone(),
        ..Mesh::default()
    })
}

/// Is this a sky spec rather than a file?
pub fn is_sky(spec: &str) -> bool {
    spec.starts_with("sky:")
}

/// The light of commands that are given none.
pub const DEFAULT_SKY: &str = "sky:clear";

/// Loads a texture.
pub fn texture(path: &Path, context: &mut Context) -> Result<Arc<Texture>, Failure> {
    context.note_input(path);
    let raster = steradian_formats::read_image(path, &context.limits())?;
    let (w, h) = (raster.width, raster.height);
    let planes = raster.into_rgb();
    let texture = planes.and_then(|p| Texture::new(w, h, &p)).map(Arc::new);
    texture.ok_or_else(|| Failure::input(format!("{}: has no colour", path.display())))
}

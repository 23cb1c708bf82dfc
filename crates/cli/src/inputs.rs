//! Inputs that several commands take: light, reflectance, geometry, technique.

use crate::context::{Context, Negative};
use crate::failure::Failure;
use crate::model::complete;
use clap::Args;
use glam::{DMat3, DVec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_base::{ParamValues, brief, unknown};
use steradian_brdf::{Files, SharedBrdf, parse_with};
use steradian_formats::{Container, Raster, ReadOptions, TextureLevels, read_image, read_image_with};
use steradian_light::load::{Arrangement, FileLayout, LoadOptions, Loaded, Profile, load_files};
use steradian_light::{Lights, adjust as placed};
use steradian_prefilter::source::add_beams;
use steradian_prefilter::{Beam, Cosine, Zonal};
use steradian_render::{MIN_ALPHA, Maps, NormalMap, Texture};
use steradian_scene::{Mesh, shapes};
use steradian_sphere::sh::{self, ShRgb};
use steradian_techniques::{AnyTechnique, SavedBake};

/// The light of commands that are given none.
pub const DEFAULT_SKY: &str = "sky";

/// How the file of a light is read, turned and scaled.
#[derive(Debug, Clone, Default, Args)]
pub struct Adjust {
    /// Arrangement of the file: latlong, angular, sphere-map, octahedral, cross, strip, paraboloid, … [default:
    /// what the file records, else by its shape]
    #[arg(long, value_name = "NAME", value_parser = FileLayout::parse)]
    pub layout: Option<FileLayout>,
    /// Convention of the file: openexr, usd, cmgen, three, bevy, … [default: steradian, or what the file says]
    #[arg(long, value_name = "NAME", value_parser = Profile::parse)]
    pub profile: Option<&'static Profile>,
    /// Rotation of the light about +Y, degrees
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true, value_parser = finite)]
    pub rotate: f64,
    /// Exposure value by which the light is scaled
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true, value_parser = exposure)]
    pub light_exposure: f64,
}

impl Adjust {
    /// The rotation.
    pub fn rotation(&self) -> DMat3 {
        placed::about_y(self.rotate)
    }

    /// The factor on radiance.
    pub fn gain(&self) -> f64 {
        self.light_exposure.exp2()
    }
}

/// The size of a face of an output, as `--size` says.
pub fn side(size: (usize, usize), arrangement: Arrangement) -> Result<(usize, usize), Failure> {
    arrangement.side(size).map_err(|e| Failure::usage(format!("--size: {e}")))
}

/// A finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err(format!("'{text}' is not a finite number")),
    }
}

/// An exposure value by which light may be scaled: its power of two stays in range.
pub fn exposure(text: &str) -> Result<f64, String> {
    finite(text).and_then(|v| if v.abs() <= 64.0 { Ok(v) } else { Err(format!("'{text}' is not -64 … 64")) })
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

/// Parameters of a technique, each given once.
pub fn parameters(given: &[(String, f64)]) -> Result<ParamValues, Failure> {
    let mut out = ParamValues::default();
    for (name, value) in given {
        if out.0.insert(name.clone(), *value).is_some() {
            return Err(Failure::usage(format!("--param {name} is given twice; give it once")));
        }
    }
    Ok(out)
}

/// Is this the spec of an environment by formula rather than a file?
pub fn is_sky(spec: &str) -> bool {
    steradian_light::sky::is_name(spec)
}

/// The lights of a sky spec.
fn sky(spec: &str) -> Result<Lights, Failure> {
    Lights::of_sky(spec, SKY_SIZE).map_err(Failure::usage)
}

/// Size of the images of skies.
const SKY_SIZE: (usize, usize) = (1024, 512);

/// Loads an image on the sphere in the layout of its file: an image, `front,back` or six files separated by commas, a
/// pattern with `{}`, or a level of a texture (KTX2, KTX1, DDS).
pub fn map(spec: &str, adjust: &Adjust, level: usize, context: &mut Context) -> Result<Loaded, Failure> {
    let files = light_files(Path::new(spec), |part| Ok(part.into()), spec)?;
    map_of(&files, spec, adjust, level, context)
}

/// The files of a spec of [`map`]: `whole` where that exists or cannot be anything else, else its parts, each of which
/// `part` makes a path.
pub fn light_files(
    whole: &Path,
    part: impl Fn(&str) -> Result<PathBuf, Failure>,
    spec: &str,
) -> Result<Vec<PathBuf>, Failure> {
    if whole.exists() {
        return Ok(vec![whole.into()]);
    }
    if spec.contains(',') {
        return spec.split(',').map(part).collect();
    }
    Ok(steradian_light::load::parts(whole)?)
}

/// [`map`] of files; `spec` is what messages call them.
fn map_of(
    files: &[PathBuf],
    spec: &str,
    adjust: &Adjust,
    level: usize,
    context: &mut Context,
) -> Result<Loaded, Failure> {
    let options = LoadOptions {
        layout: adjust.layout,
        profile: adjust.profile,
        negative: match context.common.negative {
            Negative::Keep => steradian_light::load::Negative::Keep,
            Negative::Zero => steradian_light::load::Negative::Zero,
        },
        limits: context.limits(),
    };
    if let [path] = files
        && let Some(container) = Container::of_file(path)
    {
        let texture = container.read(path, &context.limits())?;
        context.note_input(path);
        return texture_map(path, &texture, level, &options);
    }
    if level > 0 {
        return Err(Failure::usage(format!(
            "{spec}: has one level only; --level is for textures (.ktx2, .ktx, .dds)"
        )));
    }
    let loaded = load_files(files, &options)?;
    files.iter().for_each(|p| context.note_input(p));
    loaded.report.warnings.iter().for_each(|w| context.warn(format_args!("{spec}: {w}")));
    Ok(loaded)
}

/// One level of a texture as an image on the sphere. Where the file records its profile, that is undone.
pub fn texture_map(
    path: &Path,
    t: &TextureLevels,
    level: usize,
    options: &LoadOptions,
) -> Result<Loaded, Failure> {
    let name = path.display();
    if level >= t.levels.len() {
        return Err(Failure::usage(format!(
            "{name}: has no level {level}; there are 0 to {}",
            t.levels.len() - 1
        )));
    }
    let (w, h) = t.size(level);
    let layout = if t.faces == 6 { Some(FileLayout::VerticalStrip) } else { options.layout };
    let recorded = t.get("steradian.profile").and_then(Profile::find);
    let options = LoadOptions { layout, profile: options.profile.or(recorded), ..*options };
    let mut raster = Raster::rgb(w, h * t.faces, t.planes(level));
    raster.metadata = t.metadata.clone();
    Ok(steradian_light::load::from_raster(&name.to_string(), raster, &options)?)
}

/// Loads a light: a file as [`map`] takes it, or a sky spec.
pub fn light(spec: &str, adjust: &Adjust, context: &mut Context) -> Result<Lights, Failure> {
    let mut lights =
        if is_sky(spec) { sky(spec)? } else { map(spec, adjust, 0, context)?.into_environment().into() };
    lights.adjust(adjust.rotate, adjust.gain());
    // What a file holds was checked when it was read; exposure may make more of it.
    lights.check().map_err(|e| Failure::input(format!("{}: {e}", brief(spec))))?;
    Ok(lights)
}

/// Loads the light that `files` are; `spec` is what messages call it.
pub fn light_of(
    files: &[PathBuf],
    spec: &str,
    adjust: &Adjust,
    context: &mut Context,
) -> Result<Lights, Failure> {
    let mut lights: Lights = map_of(files, spec, adjust, 0, context)?.into_environment().into();
    lights.adjust(adjust.rotate, adjust.gain());
    Ok(lights)
}

/// SH coefficients of everything distant in `lights` up to `order`: texel sums of the image, disks and directional
/// lights in closed form.
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

/// SH coefficients up to `order` of a light as [`light`] takes it. A file is projected in its own layout, and turned
/// in the space of coefficients.
pub fn light_coefficients(
    spec: &str,
    adjust: &Adjust,
    order: usize,
    context: &mut Context,
) -> Result<ShRgb, Failure> {
    let mut sh = if is_sky(spec) {
        coefficients(&sky(spec)?, order)
    } else {
        sh::project(&map(spec, adjust, 0, context)?.image, order)
    };
    if adjust.rotate != 0.0 {
        sh = sh::Rotation::new(order, adjust.rotation()).apply_rgb(&sh);
    }
    sh.c.iter_mut().flatten().for_each(|v| *v *= adjust.gain());
    Ok(sh)
}

/// Zonal coefficients of the clamped cosine for `bands` bands: π, 2π/3, π/4, 0, −π/24, …
pub fn cosine(bands: usize) -> Vec<f64> {
    Cosine.coefficients(bands.saturating_sub(1))
}

/// A technique of the registry, a saved bake of one, or the judge.
#[derive(Clone)]
pub enum Method {
    /// The judge.
    Reference,
    /// A room.
    Technique(&'static dyn AnyTechnique),
    /// A room's saved bake: light and reflectance are what it was made of.
    File(Arc<SavedBake>),
}

impl Method {
    /// The technique called `slug`; `-` and `_` are the same.
    pub fn find(slug: &str) -> Result<Self, Failure> {
        if slug == "reference" {
            return Ok(Self::Reference);
        }
        let found = steradian_techniques::find(slug).map(Self::Technique);
        found.ok_or_else(|| Failure::usage(unknown("technique", slug, &Self::slugs())))
    }

    /// Every slug, the reference first.
    pub fn slugs() -> Vec<&'static str> {
        let rooms = steradian_techniques::registry().iter().map(|t| t.card().slug);
        std::iter::once("reference").chain(rooms).collect()
    }

    /// Its slug.
    pub fn slug(&self) -> &'static str {
        match self {
            Self::Reference => "reference",
            Self::Technique(t) => t.card().slug,
            Self::File(f) => f.technique.card().slug,
        }
    }

    /// Its slug, with the file of a saved bake.
    pub fn label(&self) -> String {
        match self {
            Self::File(f) => format!("{} {}", self.slug(), f.name()),
            _ => self.slug().into(),
        }
    }
}

/// A reflectance from the spec of a command line, which may name any file; they are noted for the provenance.
pub fn brdf(spec: &str, context: &mut Context) -> Result<SharedBrdf, Failure> {
    let brdf = parse_with(spec, Files::Any)?;
    for part in spec.split([':', ',', '=']).skip(1) {
        if Path::new(part).is_file() {
            context.note_input(Path::new(part));
        }
    }
    Ok(brdf)
}

/// Is this the name of a built-in shape rather than a file (`./teapot` is a file)?
pub fn is_shape(spec: &str) -> bool {
    let name = spec.split(':').next().unwrap_or(spec);
    shapes::SHAPES.iter().any(|s| s.name == name)
}

/// Loads a mesh: a built-in shape such as `teapot` or `torus:segments=64`, or a file.
pub fn mesh(spec: &str, context: &mut Context) -> Result<Mesh, Failure> {
    if is_shape(spec) { shape(spec) } else { mesh_file(Path::new(spec), context) }
}

/// A built-in shape.
pub fn shape(spec: &str) -> Result<Mesh, Failure> {
    shapes::by_name(spec).map_err(Failure::usage)
}

/// Loads a mesh file with all that it says; what was mended is warned about.
pub fn load_mesh(path: &Path, context: &mut Context) -> Result<steradian_scene::Loaded, Failure> {
    let loaded = steradian_scene::load(path, &context.limits())?;
    context.note_input(path);
    loaded.notes.iter().for_each(|n| context.warn(format_args!("{}: {n}", path.display())));
    Ok(loaded)
}

/// Loads the geometry of a mesh file.
pub fn mesh_file(path: &Path, context: &mut Context) -> Result<Mesh, Failure> {
    let mut loaded = load_mesh(path, context)?;
    complete(&mut loaded.meshes);
    let mut mesh = loaded.merged();
    mesh.materials.clear();
    Ok(mesh)
}

/// Loads a texture.
pub fn texture(path: &Path, context: &mut Context) -> Result<Arc<Texture>, Failure> {
    let raster = all_finite(path, read_image(path, &context.limits())?)?;
    context.note_input(path);
    let (w, h) = (raster.width, raster.height);
    let texture = raster.into_rgb().and_then(|p| Texture::new(w, h, &p)).map(Arc::new);
    texture.ok_or_else(|| Failure::input(format!("{}: has no colour", path.display())))
}

/// Refuses a picture with pixels that are no numbers: they would spread over everything that it covers.
fn all_finite(path: &Path, raster: Raster) -> Result<Raster, Failure> {
    match raster.first_non_finite() {
        None => Ok(raster),
        Some((x, y, channel)) => {
            let why = format!("pixel ({x}, {y}) of channel {channel} is not finite");
            Err(Failure::input(format!("{}: {why}", path.display())))
        }
    }
}

/// The planes of an image that holds numbers, not colours.
fn data(path: &Path, context: &mut Context) -> Result<(usize, usize, [Vec<f32>; 3]), Failure> {
    let options = ReadOptions { limits: context.limits(), data: true, ..ReadOptions::default() };
    let raster = all_finite(path, read_image_with(path, &options)?)?;
    context.note_input(path);
    let (w, h) = (raster.width, raster.height);
    let planes = raster.into_rgb().filter(|p| !p[0].is_empty());
    planes
        .map(|p| (w, h, p))
        .ok_or_else(|| Failure::input(format!("{}: has no red, green and blue", path.display())))
}

/// Loads a tangent-space normal map (glTF's: green up).
pub fn normal_map(path: &Path, scale: f32, context: &mut Context) -> Result<Maps, Failure> {
    let (w, h, planes) = data(path, context)?;
    Ok(Maps { normal: NormalMap::new(w, h, &planes, scale).map(Arc::new), ..Maps::default() })
}

/// Loads a map of perceptual roughness: the green channel (as in glTF's), or the only one.
pub fn roughness_map(path: &Path, context: &mut Context) -> Result<Maps, Failure> {
    let (w, h, planes) = data(path, context)?;
    let alpha2 = steradian_render::maps::alpha2(w, h, &planes[1], 1.0, MIN_ALPHA);
    Ok(Maps { alpha2: alpha2.map(Arc::new), ..Maps::default() })
}

/// Luminance-weighted mean direction of a light: its first band.
pub fn dominant(sh: &ShRgb) -> Option<DVec3> {
    if sh.order < 1 {
        return None;
    }
    let y = |i: usize| 0.2126 * sh.c[0][i] + 0.7152 * sh.c[1][i] + 0.0722 * sh.c[2][i];
    DVec3::new(y(3), y(1), y(2)).try_normalize()
}

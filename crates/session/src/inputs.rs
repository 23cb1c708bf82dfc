//! Inputs by name: light, reflectance, geometry, textures, technique. A name from the caller may be any file;
//! a name in a scene file must lie below its folder; a name in a saved bake is never opened.

use crate::scene::complete;
use crate::{Error, Session};
use glam::{DMat3, DVec3};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use steradian_base::{brief, unknown};
use steradian_brdf::{Files, SharedBrdf, parse_noting};
use steradian_formats::{Container, Raster, ReadOptions, TextureLevels, read_image, read_image_with};
use steradian_light::load::{FileLayout, LoadOptions, Loaded, Profile, load_files};
use steradian_light::{Lamp, Lights, adjust as placed};
use steradian_prefilter::source::add_small_lights;
use steradian_prefilter::{Cosine, Sampled, SmallLight, Zonal, filter_image};
use steradian_relight::polynomial::Basis;
use steradian_render::{MIN_ALPHA, NormalMap, SurfaceMaps, Texture};
use steradian_scene::{Mesh, shapes};
use steradian_sphere::sh::{self, ShRgb};
use steradian_sphere::{Layout, SphereImage};
use steradian_techniques::local::Content;
use steradian_techniques::{AnyTechnique, SavedBake};

/// Largest relative RMS error of a map of irradiance.
const IRRADIANCE: f64 = 1e-4;

/// The light where none is given.
pub const DEFAULT_SKY: &str = "sky";

/// How the file of a light is read, rotated and scaled.
#[derive(Debug, Clone, Default)]
pub struct Adjust {
    /// Arrangement of the file; `None`: as the file records it, else by its shape.
    pub layout: Option<FileLayout>,
    /// Convention of the file; `None`: as the file records it, else that of this library.
    pub profile: Option<&'static Profile>,
    /// Rotation of the light about +Y, degrees.
    pub rotate: f64,
    /// Exposure value by which it is scaled: stops.
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

/// Is this the spec of an environment by formula rather than a file?
pub fn is_sky(spec: &str) -> bool {
    steradian_light::sky::is_name(spec)
}

/// The file and the number of a probe that a light's name says, as in `room.safetensors#3`.
pub fn probe_of(spec: &str) -> Option<(&Path, usize)> {
    let (path, k) = spec.rsplit_once('#')?;
    let path = Path::new(path);
    let is_field = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("safetensors"));
    Some((path, k.parse().ok()?)).filter(|_| is_field)
}

/// Extensions of images in a folder of lights.
const LIGHTS: [&str; 4] = ["hdr", "exr", "pfm", "pic"];

/// The lights that a name expands to, sorted: those in a folder, those of a pattern with `*` in the file's
/// name, or the single one that it names.
pub fn expand_lights(spec: &str) -> Result<Vec<String>, Error> {
    let path = Path::new(spec);
    let pattern = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let folder = path.is_dir();
    if !folder && (path.exists() || !pattern.contains('*')) {
        return Ok(vec![spec.into()]);
    }
    let above = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let dir = if folder { path } else { above };
    let image = |name: &str| {
        let extension = Path::new(name).extension();
        extension.is_some_and(|e| LIGHTS.iter().any(|l| e.eq_ignore_ascii_case(l)))
    };
    let files = files_of(dir, |name| if folder { image(name) } else { matches(&pattern, name) })?;
    let out: Vec<String> = files.iter().map(|f| f.display().to_string()).collect();
    if out.is_empty() { Err(Error::input(format!("{spec}: holds no images of lights"))) } else { Ok(out) }
}

/// The files of a folder whose names are `wanted`, sorted.
pub(crate) fn files_of(dir: &Path, wanted: impl Fn(&str) -> bool) -> Result<Vec<PathBuf>, Error> {
    let unreadable = |e: std::io::Error| Error::input(format!("{}: cannot read: {e}", dir.display()));
    let mut out = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(unreadable)? {
        let file = entry.map_err(unreadable)?.path();
        let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if file.is_file() && wanted(&name) {
            out.push(file);
        }
    }
    out.sort_by_key(|f| f.display().to_string());
    Ok(out)
}

/// Does `name` match a pattern in which `*` matches any characters?
pub(crate) fn matches(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let Some(mut rest) = parts.next().and_then(|first| name.strip_prefix(first)) else { return false };
    let mut parts: Vec<&str> = parts.collect();
    let Some(last) = parts.pop() else { return rest.is_empty() };
    for part in parts {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

/// The lights of a sky spec.
fn sky(spec: &str) -> Result<Lights, Error> {
    Lights::of_sky(spec, SKY_SIZE).map_err(Error::usage)
}

/// Size of the images of skies.
const SKY_SIZE: (usize, usize) = (1024, 512);

/// The files of a spec of [`Session::map`]: `whole` where that exists or cannot be anything else, else its
/// parts, each made into a path by `part`.
pub(crate) fn light_files(
    whole: &Path,
    part: impl Fn(&str) -> Result<PathBuf, Error>,
    spec: &str,
) -> Result<Vec<PathBuf>, Error> {
    if whole.exists() {
        return Ok(vec![whole.into()]);
    }
    if spec.contains(',') {
        return spec.split(',').map(part).collect();
    }
    Ok(steradian_light::load::parts(whole)?)
}

/// One level of a texture as an image on the sphere. Where the file records its profile, that is undone.
pub(crate) fn texture_map(
    path: &Path,
    t: &TextureLevels,
    level: usize,
    options: &LoadOptions,
) -> Result<Loaded, Error> {
    let name = path.display();
    if level >= t.levels.len() {
        return Err(Error::usage(format!(
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

/// SH coefficients of everything distant in `lights` up to `order`: texel sums of the image, disks and
/// directional lights in closed form.
pub fn coefficients(lights: &Lights, order: usize) -> ShRgb {
    let mut sh = match &lights.environment {
        Some(e) => sh::project(&e.image, order),
        None => ShRgb::zero(order),
    };
    let small_lights: Vec<SmallLight> = lights
        .disks
        .iter()
        .map(SmallLight::from)
        .chain(lights.directionals.iter().map(SmallLight::from))
        .collect();
    add_small_lights(&mut sh, &small_lights);
    sh
}

/// Zonal coefficients of the clamped cosine for `bands` bands: π, 2π/3, π/4, 0, −π/24, …
pub fn cosine(bands: usize) -> Vec<f64> {
    Cosine.coefficients(bands.saturating_sub(1))
}

/// A technique of the registry, a saved bake of one, or the reference.
#[derive(Clone)]
pub enum Method {
    /// The reference: the integral without shadows, by quadrature.
    Reference,
    /// The reference with shadows and light from surface to surface, by paths ([`crate::Session::paths`]).
    Path,
    /// A technique.
    Technique(&'static dyn AnyTechnique),
    /// A technique's saved bake, with its own light and reflectance.
    File(Arc<SavedBake>),
}

impl Method {
    /// The technique called `slug`, in which `-` and `_` are equivalent.
    pub fn find(slug: &str) -> Result<Self, Error> {
        if slug == "reference" {
            return Ok(Self::Reference);
        }
        if slug == "path" {
            return Ok(Self::Path);
        }
        if let Some(t) = steradian_techniques::find(slug) {
            return Ok(Self::Technique(t));
        }
        // Other options take a technique with its parameters.
        if let Some((name, params)) = slug.split_once(':')
            && steradian_techniques::find(name).is_some()
        {
            let each = params.split(',').map(|p| format!(" `param` {}", brief(p)));
            let each: String = each.take(8).collect();
            return Err(Error::usage(format!("parameters of {name} are given apart: {name}{each}")));
        }
        Err(Error::usage(unknown("technique", slug, &Self::slugs())))
    }

    /// Every slug, the references first.
    pub fn slugs() -> Vec<&'static str> {
        let all = steradian_techniques::registry().iter().map(|t| t.card().slug);
        ["reference", "path"].into_iter().chain(all).collect()
    }

    /// Its slug.
    pub fn slug(&self) -> &'static str {
        match self {
            Self::Reference => "reference",
            Self::Path => "path",
            Self::Technique(t) => t.card().slug,
            Self::File(f) => f.technique.card().slug,
        }
    }

    /// Slug, with the file of a saved bake.
    pub fn label(&self) -> String {
        match self {
            Self::File(f) => format!("{} {}", self.slug(), f.name()),
            _ => self.slug().into(),
        }
    }
}

/// Is this the name of a built-in shape rather than a file (`./teapot` is a file)?
pub fn is_shape(spec: &str) -> bool {
    let name = spec.split(':').next().unwrap_or(spec);
    shapes::SHAPES.iter().any(|s| s.name == name)
}

/// Is a name that of a file? A name without dots and slashes that no file has is a name of something else:
/// where that is unknown too, the request is wrong, not an input.
pub(crate) fn names_a_file(spec: &str) -> bool {
    Path::new(spec).exists() || spec.contains(['.', '/', '\\', '{', ','])
}

/// Refuses a name that is neither a shape nor could be a file.
pub(crate) fn check_shape(spec: &str) -> Result<(), Error> {
    let names: Vec<&str> = shapes::SHAPES.iter().map(|s| s.name).collect();
    let name = spec.split(':').next().unwrap_or(spec);
    if is_shape(spec) || names_a_file(spec) {
        return Ok(());
    }
    Err(Error::usage(format!("{}: no such file; {}", brief(spec), unknown("shape", name, &names))))
}

/// Refuses a name that is neither a sky nor could be a file.
fn check_light(spec: &str) -> Result<(), Error> {
    let name = spec.split(':').next().unwrap_or(spec);
    if is_sky(spec) || names_a_file(spec) {
        return Ok(());
    }
    let known = unknown("sky", name, &steradian_light::sky::NAMES);
    Err(Error::usage(format!("{}: no such file; {known}", brief(spec))))
}

/// Refuses a name that is neither a sky nor a shape nor could be a file.
pub(crate) fn check_any(spec: &str) -> Result<(), Error> {
    let name = spec.split(':').next().unwrap_or(spec);
    if is_sky(spec) || is_shape(spec) || names_a_file(spec) {
        return Ok(());
    }
    let shapes = shapes::SHAPES.iter().map(|s| s.name);
    let names: Vec<&str> = steradian_light::sky::NAMES.into_iter().chain(shapes).collect();
    let known = unknown("sky or shape", name, &names);
    Err(Error::usage(format!("{}: no such file; {known}; a reflectance is brdf:SPEC", brief(spec))))
}

/// A built-in shape.
pub(crate) fn shape(spec: &str) -> Result<Mesh, Error> {
    shapes::by_name(spec).map_err(Error::usage)
}

/// Refuses a picture with pixels that are no numbers: they would spread over everything that it covers.
pub(crate) fn all_finite(path: &Path, raster: Raster) -> Result<Raster, Error> {
    match raster.first_non_finite() {
        None => Ok(raster),
        Some((x, y, channel)) => {
            let why =
                format!("pixel ({x}, {y}) of channel {channel} is not finite: mend it in an image editor");
            Err(Error::input(format!("{}: {why}", path.display())))
        }
    }
}

/// Luminance-weighted mean direction of a light: its first band.
pub fn dominant(sh: &ShRgb) -> Option<DVec3> {
    if sh.order < 1 {
        return None;
    }
    let y = |i: usize| 0.2126 * sh.c[0][i] + 0.7152 * sh.c[1][i] + 0.0722 * sh.c[2][i];
    DVec3::new(y(3), y(1), y(2)).try_normalize()
}

impl Session {
    /// Loads an image on the sphere in the layout of its file: an image, `front,back` or six files separated
    /// by commas, a pattern with `{}`, or a level of a texture (KTX2, KTX1, DDS).
    pub fn map(&mut self, spec: &str, adjust: &Adjust, level: usize) -> Result<Loaded, Error> {
        if let Some((path, k)) = probe_of(spec) {
            return self.probe_map(path, k, adjust, level);
        }
        check_light(spec)?;
        let files = light_files(Path::new(spec), |part| Ok(part.into()), spec)?;
        self.map_of(&files, spec, adjust, level)
    }

    /// The image of a probe of a light field.
    fn probe_map(&mut self, path: &Path, k: usize, adjust: &Adjust, level: usize) -> Result<Loaded, Error> {
        let name = format!("{}#{k}", path.display());
        if level > 0 || adjust.layout.is_some() || adjust.profile.is_some() {
            return Err(Error::usage(format!("{name}: a probe has no levels, and its own layout")));
        }
        let field = self.probes(path)?;
        let count = field.light.len();
        let probe = match field.light.get(k) {
            None => Err(Error::input(format!("{name}: there are {count} probes, from 0"))),
            Some(None) => Err(Error::input(format!("{name}: lies inside a solid, and sees nothing"))),
            Some(Some(probe)) => Ok(probe),
        }?;
        // As it was captured: what `Probe::environment` adds for its harmonics may be negative in places.
        let Some(image) = &probe.image else {
            let why = "has harmonics alone: probes captured with `image` have images beside them";
            return Err(Error::input(format!("{name}: {why}")));
        };
        let raster = Raster::rgb(image.width, image.height, image.planes.clone());
        let options = LoadOptions {
            layout: Some(FileLayout::LatLong),
            profile: None,
            negative: self.negative,
            limits: self.limits(),
        };
        Ok(steradian_light::load::from_raster(&name, raster, &options)?)
    }

    /// The lights that a name expands to: as [`expand_lights`], and the probes of a light field that lie
    /// outside solids.
    pub fn lights_of(&mut self, spec: &str) -> Result<Vec<String>, Error> {
        let path = Path::new(spec);
        let tensors = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("safetensors"));
        if !tensors || !path.is_file() {
            return expand_lights(spec);
        }
        let field = self.probes(path)?;
        let open = field.light.iter().enumerate().filter(|(_, p)| p.is_some());
        let all: Vec<String> = open.map(|(k, _)| format!("{spec}#{k}")).collect();
        if all.is_empty() {
            Err(Error::input(format!("{spec}: all its probes lie inside solids")))
        } else {
            Ok(all)
        }
    }

    /// [`Session::map`] of files; messages name them `spec`.
    fn map_of(
        &mut self,
        files: &[PathBuf],
        spec: &str,
        adjust: &Adjust,
        level: usize,
    ) -> Result<Loaded, Error> {
        let options = LoadOptions {
            layout: adjust.layout,
            profile: adjust.profile,
            negative: self.negative,
            limits: self.limits(),
        };
        if let [path] = files
            && let Some(container) = Container::of_file(path)
        {
            let texture = container.read(path, &self.limits())?;
            self.note_input(path);
            return texture_map(path, &texture, level, &options);
        }
        if level > 0 {
            return Err(Error::usage(format!(
                "{spec}: has one level only; `level` is for textures (.ktx2, .ktx, .dds)"
            )));
        }
        let loaded = load_files(files, &options)?;
        files.iter().for_each(|p| self.note_input(p));
        loaded.report.warnings.iter().for_each(|w| self.warn(spec, w));
        Ok(loaded)
    }

    /// Loads a light: a file as [`Session::map`] takes it, or a sky spec.
    pub fn light(&mut self, spec: &str, adjust: &Adjust) -> Result<Lights, Error> {
        let mut lights =
            if is_sky(spec) { sky(spec)? } else { self.map(spec, adjust, 0)?.into_environment().into() };
        lights.adjust(adjust.rotate, adjust.gain());
        // File contents were checked when read; exposure may make them infinite.
        lights.check().map_err(|e| Error::input(format!("{}: {e}", brief(spec))))?;
        Ok(lights)
    }

    /// Loads a light from `files`; messages name it `spec`.
    pub(crate) fn light_of(
        &mut self,
        files: &[PathBuf],
        spec: &str,
        adjust: &Adjust,
    ) -> Result<Lights, Error> {
        let mut lights: Lights = self.map_of(files, spec, adjust, 0)?.into_environment().into();
        lights.adjust(adjust.rotate, adjust.gain());
        Ok(lights)
    }

    /// Adds the lights of a file to `lights`, distant ones turned and scaled as `adjust` says.
    pub fn join_lights(&mut self, path: &Path, lights: &mut Lights, adjust: &Adjust) -> Result<(), Error> {
        let all = Lamp::read(path)?;
        self.note_input(path);
        all.into_iter().for_each(|l| l.adjusted(adjust.rotation(), adjust.gain()).join(lights));
        Ok(())
    }

    /// SH coefficients up to `order` of a light as [`Session::light`] takes it. A file is projected in its
    /// own layout, and turned in the space of coefficients.
    pub fn light_coefficients(&mut self, spec: &str, adjust: &Adjust, order: usize) -> Result<ShRgb, Error> {
        let mut sh = if is_sky(spec) {
            coefficients(&sky(spec)?, order)
        } else {
            sh::project(&self.map(spec, adjust, 0)?.image, order)
        };
        if adjust.rotate != 0.0 {
            sh = sh::Rotation::new(order, adjust.rotation()).apply_rgb(&sh);
        }
        sh.c.iter_mut().flatten().for_each(|v| *v *= adjust.gain());
        Ok(sh)
    }

    /// E(n) = ∫ L ⟨n·w⟩ dw in W m⁻² (no 1/π) at every texel centre of a map of this layout, width and height,
    /// to a relative RMS error of 1e-4, disks included. A sum of few harmonics rings where a sun sets; this
    /// does not.
    pub fn irradiance_map(
        &mut self,
        spec: &str,
        adjust: &Adjust,
        shape: (Layout, usize, usize),
    ) -> Result<SphereImage, Error> {
        let lights = self.light(spec, adjust)?;
        let light = Sampled::of(lights, &[&Cosine], IRRADIANCE, &self.task)?;
        let map = filter_image(&light, &Cosine, shape, IRRADIANCE, &self.task)?;
        self.check()?;
        Ok(map.image)
    }

    /// A reflectance from the spec of a command line, which may name any file; they are noted for the
    /// provenance.
    pub fn brdf(&mut self, spec: &str) -> Result<SharedBrdf, Error> {
        let mut read = Vec::new();
        let brdf = parse_noting(spec, Files::Any, &mut read);
        read.iter().for_each(|path| self.note_input(path));
        Ok(brdf?)
    }

    /// Loads a mesh: a built-in shape such as `teapot` or `torus:segments=64`, or a file.
    pub fn mesh(&mut self, spec: &str) -> Result<Mesh, Error> {
        check_shape(spec)?;
        if is_shape(spec) { shape(spec) } else { self.mesh_file(Path::new(spec)) }
    }

    /// Loads a mesh file with its materials; repairs are reported as warnings.
    pub(crate) fn load_mesh(&mut self, path: &Path) -> Result<steradian_scene::Loaded, Error> {
        let loaded = steradian_scene::load(path, &self.limits())?;
        self.note_input(path);
        loaded.files.iter().for_each(|file| self.reads(file));
        loaded.notes.iter().for_each(|n| self.warn(path.display(), n));
        Ok(loaded)
    }

    /// Loads the geometry of a mesh file.
    pub(crate) fn mesh_file(&mut self, path: &Path) -> Result<Mesh, Error> {
        let mut loaded = self.load_mesh(path)?;
        complete(&mut loaded.meshes);
        let mut mesh = loaded.merged();
        mesh.materials.clear();
        Ok(mesh)
    }

    /// Loads a texture.
    pub fn texture(&mut self, path: &Path) -> Result<Arc<Texture>, Error> {
        let raster = all_finite(path, read_image(path, &self.limits())?)?;
        self.note_input(path);
        let (w, h) = (raster.width, raster.height);
        let texture = raster.into_rgb().and_then(|p| Texture::new(w, h, &p)).map(Arc::new);
        texture.ok_or_else(|| Error::input(format!("{}: has no colour", path.display())))
    }

    /// The planes of an image that holds numbers, not colours.
    fn data(&mut self, path: &Path) -> Result<(usize, usize, [Vec<f32>; 3]), Error> {
        let options = ReadOptions { limits: self.limits(), data: true, ..ReadOptions::default() };
        let raster = all_finite(path, read_image_with(path, &options)?)?;
        self.note_input(path);
        let (w, h) = (raster.width, raster.height);
        let planes = raster.into_rgb().filter(|p| !p[0].is_empty());
        planes
            .map(|p| (w, h, p))
            .ok_or_else(|| Error::input(format!("{}: has no red, green and blue", path.display())))
    }

    /// Contents of a file of a technique for local light: planes, and the suffixes of their names.
    pub(crate) fn plane(
        &mut self,
        path: &Path,
        content: Content,
        basis: Basis,
    ) -> Result<Vec<(String, Arc<Texture>)>, Error> {
        let one = |t: Arc<Texture>| vec![(String::new(), t)];
        let empty = || Error::input(format!("{}: is empty", path.display()));
        Ok(match content {
            Content::Heights => {
                let (w, h, z) = self.heights(path)?;
                one(Texture::new(w, h, &[z.clone(), z.clone(), z]).map(Arc::new).ok_or_else(empty)?)
            }
            Content::Normals => {
                let map = self.normal_map(path, 1.0)?.normal.ok_or_else(empty)?;
                one(Arc::new(map.mean().clone()))
            }
            Content::Colours => one(self.texture(path)?),
            Content::Numbers => {
                let (w, h, planes) = self.data(path)?;
                one(Texture::new(w, h, &planes).map(Arc::new).ok_or_else(empty)?)
            }
            Content::Polynomials => self.polynomial_planes(path, basis)?,
            // No texture: [`Session::open_local`] reads it.
            Content::Bidirectional => Vec::new(),
        })
    }

    /// Loads a tangent-space normal map (glTF's: green up).
    pub fn normal_map(&mut self, path: &Path, scale: f32) -> Result<SurfaceMaps, Error> {
        let (w, h, planes) = self.data(path)?;
        Ok(SurfaceMaps {
            normal: NormalMap::new(w, h, &planes, scale).map(Arc::new),
            ..SurfaceMaps::default()
        })
    }

    /// Loads a map of perceptual roughness: the green channel (as in glTF's), or the only one.
    pub fn roughness_map(&mut self, path: &Path) -> Result<SurfaceMaps, Error> {
        let (w, h, planes) = self.data(path)?;
        let alpha2 = steradian_scene::surface::alpha2(w, h, &planes[1], 1.0, MIN_ALPHA);
        Ok(SurfaceMaps { alpha2: alpha2.map(Arc::new), ..SurfaceMaps::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_and_patterns_stand_for_their_images() {
        let dir = tempfile::tempdir().expect("a folder");
        for name in ["b.hdr", "a.exr", "ab.hdr", "notes.txt"] {
            std::fs::write(dir.path().join(name), "").expect("a file");
        }
        let names = |spec: &str| -> Vec<String> {
            let all = expand_lights(&dir.path().join(spec).display().to_string()).unwrap_or_default();
            let name = |p: String| Path::new(&p).file_name().map(|n| n.to_string_lossy().into_owned());
            all.into_iter().filter_map(name).collect()
        };
        assert_eq!(names(""), ["a.exr", "ab.hdr", "b.hdr"]);
        assert_eq!(names("*.hdr"), ["ab.hdr", "b.hdr"]);
        assert_eq!(names("a*b*"), ["ab.hdr"]);
        assert_eq!(names("none*.hdr"), Vec::<String>::new());
        assert_eq!(expand_lights("sky:elevation=3").ok(), Some(vec!["sky:elevation=3".to_string()]));
    }

    #[test]
    fn unknown_names_list_the_known() {
        let e = check_shape("teapott").expect_err("unknown").to_string();
        assert!(e.contains("did you mean 'teapot'") && e.contains("torus"), "{e}");
        assert!(check_light("skyy").is_err_and(|e| e.to_string().contains("did you mean 'sky'")));
        let kinds = [check_shape("teapott"), check_light("skyy"), check_any("shpere")];
        assert!(kinds.into_iter().all(|r| r.is_err_and(|e| e.kind() == crate::Kind::Usage)));
        assert!(check_shape("none.obj").is_ok() && check_light("front,back").is_ok());
        let why = |slug| Method::find(slug).err().map(|e| e.to_string()).unwrap_or_default();
        assert!(why("split:taps=4").starts_with("unknown technique"));
        let apart =
            "parameters of split-sum are given apart: split-sum `param` taps=4 `param` multiscatter=on";
        assert_eq!(why("split-sum:taps=4,multiscatter=on"), apart);
    }
}

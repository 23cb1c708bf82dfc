//! Prefiltered files of any tool: their levels in this library's axes, and the kernels that they were really
//! filtered with.

mod report;
mod words;

use crate::{Adjust, Error, Kind, Outcome, Session, inputs};
use serde_json::Value;
use std::path::{Component, Path, PathBuf};
use steradian_formats::{Container, Raster, ReadOptions, read_image_with, read_text};
use steradian_light::load::{self, FileLayout, LoadOptions, Profile};
use steradian_sphere::SphereImage;
use steradian_verify::laws::Consumer;
use steradian_verify::{Coefficients, Family, Fault, Input, Kernel, Report, check};

/// Largest size, bytes, of a text file next to images.
const TEXT: u64 = 4 << 20;

/// Contents of a file.
struct Held {
    /// Level by level, as the profile places them.
    pub levels: Vec<SphereImage>,
    /// Keys and values.
    pub metadata: Vec<(String, String)>,
    /// Nine irradiance coefficients, as they are in the file.
    pub sh: Option<Vec<[f64; 3]>>,
    /// Step of values that are stored divided by their largest channel; 0 elsewhere.
    pub step: f64,
}

/// Options for reading the file.
struct Reading {
    /// Convention of the file.
    pub profile: &'static Profile,
    /// Arrangement of the file; `None`: by its shape.
    pub layout: Option<FileLayout>,
}

impl Reading {
    fn options(&self, session: &Session) -> LoadOptions {
        let (negative, limits) = (session.negative, session.limits());
        LoadOptions { layout: self.layout, profile: Some(self.profile), negative, limits }
    }
}

/// A file, and its expected contents.
#[derive(Debug, Clone)]
pub struct Request {
    /// Texture, image, pattern with {}, glTF file with a light, or folder of levels.
    pub file: String,
    /// Engine or tool that will read the file.
    pub consumer: Consumer,
    /// The light that it was made from: image or sky spec.
    pub environment: String,
    /// How that light is read, rotated and scaled.
    pub adjust: Adjust,
    /// The kernel; `None`: as the file or its name records it, else the consumer's.
    pub kernel: Option<Family>,
    /// Perceptual roughness of a file of one level; `None`: as the file records it, else 0.
    pub perceptual_roughness: Option<f64>,
    /// Arrangement of the file; `None`: by its shape.
    pub layout: Option<FileLayout>,
    /// Largest relative RMS error of a level against what the consumer expects.
    pub tolerance: Option<f64>,
}

/// Result of a verification.
pub struct Verified {
    /// File name without folders.
    pub file: Option<String>,
    /// Whose file it should be.
    pub profile: &'static str,
    /// Largest relative RMS error that the request allows.
    pub tolerance: Option<f64>,
    /// Level by level, with faults.
    pub report: Report,
    /// Check of the irradiance coefficients, if the file has any.
    pub irradiance: Option<Coefficients>,
}

/// Irradiance coefficients are reported where their relative RMS error exceeds this, …
const COEFFICIENTS: f64 = 0.02;
/// … and as scaled where their factor differs from 1 by more than this.
const FACTOR: f64 = 0.01;

/// One thing that is wrong with a file.
#[derive(Debug, Clone, PartialEq)]
pub enum Finding {
    /// A fault of its levels.
    Levels(Fault),
    /// A factor lies on its irradiance coefficients.
    IrradianceScale(f64),
    /// Relative RMS error of its irradiance coefficients.
    Irradiance(f64),
}

impl Verified {
    /// Faults of the file; empty where all is as expected.
    pub fn findings(&self) -> Vec<Finding> {
        let mut out: Vec<Finding> = self.report.faults.iter().cloned().map(Finding::Levels).collect();
        if let Some(sh) = self.irradiance {
            if (sh.scale - 1.0).abs() >= FACTOR {
                out.push(Finding::IrradianceScale(sh.scale));
            } else if sh.fitted_rms > COEFFICIENTS {
                out.push(Finding::Irradiance(sh.fitted_rms));
            }
        }
        out
    }
}

impl Session {
    /// Compares the levels of a prefiltered file with the light that it was made from.
    pub fn verify(&mut self, r: &Request) -> Result<Outcome<Verified>, Error> {
        let reading = Reading { profile: r.consumer.profile, layout: r.layout };
        let held = decode(&r.file, &reading, self)?;
        let lights = self.light(&r.environment, &r.adjust)?;
        let expected = expected(r, &held);
        let input = Input {
            levels: &held.levels,
            expected: &expected,
            law: r.consumer.law,
            lights: &lights,
            read: r.adjust.profile.unwrap_or_else(Profile::own),
            step: held.step,
        };
        let report = check(&input, &self.task)?;
        let irradiance = held.sh.as_deref().map(|sh| {
            let light = inputs::coefficients(&lights, 2);
            Coefficients::compare(sh, &r.consumer.coefficients.of(&light))
        });
        let file = Path::new(&r.file).file_name().map(|n| n.to_string_lossy().into_owned());
        let (profile, tolerance) = (r.consumer.name, r.tolerance);
        let verified = Verified { file, profile, tolerance, report, irradiance };
        let worst = verified.report.worst();
        Ok(Outcome::new(verified, r.tolerance, worst))
    }
}

/// The kernel that each level should hold.
fn expected(r: &Request, held: &Held) -> Vec<Kernel> {
    let get = |key: &str| held.metadata.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str());
    let name = Path::new(&r.file).file_name().map(|n| n.to_string_lossy().to_lowercase());
    let name = name.unwrap_or_default();
    let says = |words: &[&str]| words.iter().any(|w| name.contains(w));
    let family =
        r.kernel.or_else(|| get("steradian.kernel").and_then(Family::from_name)).or_else(|| match () {
            () if says(&["diffuse", "irradiance", "lambert"]) => Some(Family::Lambert),
            () if says(&["sheen", "charlie"]) => Some(Family::Charlie),
            () => None,
        });
    let last = held.levels.len() - 1;
    // This library's files of one kernel record its roughness, so the engine's law is not used.
    let recorded: Vec<f64> = get("steradian.perceptual_roughness")
        .map(|t| t.split_whitespace().filter_map(|v| v.parse().ok()).collect())
        .unwrap_or_default();
    let alone = r
        .perceptual_roughness
        .or_else(|| (last == 0 && r.consumer.is_own()).then(|| recorded.first().copied()).flatten());
    (0..=last)
        .map(|m| {
            let law = r.consumer.kernel(m, last);
            match (family, law.roughness()) {
                (Some(Family::Lambert), _) => Kernel { family: Family::Lambert, width: 0.0 },
                (f, Some(r)) => {
                    Kernel::at(f.unwrap_or(Family::Ggx), if last == 0 { alone.unwrap_or(r) } else { r })
                }
                _ => law,
            }
        })
        .collect()
}

/// Reads a texture, an image, a pattern with {}, a glTF file with a light, or a folder of levels.
fn decode(spec: &str, reading: &Reading, session: &mut Session) -> Result<Held, Error> {
    let path = Path::new(spec);
    if path.is_dir() {
        return folder(path, reading, session);
    }
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf")) {
        session.note_input(path);
        return gltf(path, reading, session);
    }
    let options = reading.options(session);
    if let Some(container) = Container::of_file(path) {
        session.note_input(path);
        let texture = container.read(path, &session.limits())?;
        let levels = (0..texture.levels.len())
            .map(|m| Ok(inputs::texture_map(path, &texture, m, &options)?.image))
            .collect::<Result<_, Error>>()?;
        let sh = texture.get("sh").and_then(coefficients);
        return Ok(Held { levels, metadata: texture.metadata, sh, step: 0.0 });
    }
    session.note_input(path);
    let loaded = load::load(path, &options).map_err(|e| match Error::from(e) {
        // The kind of an image is told by its first bytes, not by its name.
        e if e.kind() == Kind::Input && path.is_file() && Container::of_name(path).is_some() => {
            Error::input(format!(
                "{spec}: is no texture (.ktx2, .ktx, .dds) by its first bytes, and no image that is read here"
            ))
        }
        e => e,
    })?;
    loaded.report.warnings.iter().for_each(|w| session.warn(spec, w));
    Ok(Held { levels: vec![loaded.image], metadata: loaded.report.metadata, sh: None, step: 0.0 })
}

/// Nine lines of three numbers.
pub(crate) fn coefficients(text: &str) -> Option<Vec<[f64; 3]>> {
    let numbers: Vec<f64> = text.split_whitespace().map(|v| v.parse().ok()).collect::<Option<_>>()?;
    let rows: Vec<[f64; 3]> = numbers.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    (rows.len() == 9).then_some(rows)
}

/// Levels in files of their own: `m0_px.exr` … as cmgen writes them, or `NAME_level0.exr` …
fn folder(dir: &Path, reading: &Reading, session: &mut Session) -> Result<Held, Error> {
    let unreadable = |e: std::io::Error| Error::input(format!("{}: cannot read: {e}", dir.display()));
    let mut names = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(unreadable)? {
        names.push(entry.map_err(unreadable)?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    let options = reading.options(session);
    let mut held = Held { levels: Vec::new(), metadata: Vec::new(), sh: None, step: 0.0 };
    for m in 0..16 {
        let faces = format!("m{m}_px.");
        let whole = format!("_level{m}.");
        let loaded = if let Some(n) = names.iter().find(|n| n.starts_with(&faces)) {
            session.note_input(&dir.join(n));
            if Container::of_file(&dir.join(n)).is_some() {
                faces_of_textures(dir, n, &options, session)?
            } else {
                load::load(&dir.join(n.replacen("px", "{}", 1)), &options)?
            }
        } else if let Some(n) = names.iter().find(|n| n.contains(&whole)) {
            session.note_input(&dir.join(n));
            load::load(&dir.join(n), &options)?
        } else {
            break;
        };
        held.metadata = loaded.report.metadata;
        held.levels.push(loaded.image);
    }
    if held.levels.is_empty() {
        return Err(Error::input(format!(
            "{}: holds neither m0_px.* … nor *_level0.* …; name the file itself",
            dir.display()
        )));
    }
    held.sh = read_text(&dir.join("sh.txt"), TEXT, "coefficients").ok().as_deref().and_then(coefficients);
    Ok(held)
}

/// Six textures of one face each, as cmgen writes DDS; `first` is the name of +X.
fn faces_of_textures(
    dir: &Path,
    first: &str,
    options: &LoadOptions,
    session: &Session,
) -> Result<load::Loaded, Error> {
    let (mut strip, mut size) = (<[Vec<f32>; 3]>::default(), None);
    for part in ["px", "nx", "py", "ny", "pz", "nz"] {
        let path = dir.join(first.replacen("px", part, 1));
        let bad = |why: &str| Error::input(format!("{}: {why}", path.display()));
        let container = Container::of_file(&path).ok_or_else(|| bad("is missing or no texture"))?;
        let t = container.read(&path, &session.limits())?;
        if t.faces != 1 || t.width != t.height || *size.get_or_insert(t.width) != t.width {
            return Err(bad("is not one square face of the size of the others"));
        }
        let planes = t.planes(0);
        strip.iter_mut().zip(planes).for_each(|(all, face)| all.extend(face));
    }
    let n = size.unwrap_or(0);
    let options = LoadOptions { layout: Some(FileLayout::VerticalStrip), ..*options };
    let raster = Raster::rgb(n, 6 * n, strip);
    Ok(load::from_raster(&dir.join(first).display().to_string(), raster, &options)?)
}

/// The light of `EXT_lights_image_based`: RGBD images and irradiance coefficients.
fn gltf(path: &Path, reading: &Reading, session: &mut Session) -> Result<Held, Error> {
    let bad = |why: &str| Error::input(format!("{}: {why}", path.display()));
    let text = read_text(path, TEXT, "a glTF document beside its images")?;
    let document: Value = serde_json::from_str(&text).map_err(|e| bad(&format!("is no JSON: {e}")))?;
    let light = &document["extensions"]["EXT_lights_image_based"]["lights"][0];
    let levels =
        light["specularImages"].as_array().ok_or_else(|| bad("holds no light of EXT_lights_image_based"))?;
    let options = reading.options(session);
    let mut held = Held { levels: Vec::new(), metadata: Vec::new(), sh: None, step: 1.0 / 255.0 };
    for (m, faces) in levels.iter().enumerate() {
        let faces = faces.as_array().filter(|f| f.len() == 6);
        let faces = faces.ok_or_else(|| bad(&format!("level {m} has not six images")))?;
        let mut planes: [Vec<f32>; 3] = Default::default();
        let mut size = None;
        for face in faces {
            let uri = face.as_u64().and_then(|i| document["images"][i as usize]["uri"].as_str());
            let uri = uri.ok_or_else(|| bad(&format!("level {m}: an image has no uri")))?;
            let file =
                beside(path, uri).ok_or_else(|| bad(&format!("'{uri}' leads out of the file's folder")))?;
            let raster = rgbd(&file, session)?;
            if *size.get_or_insert(raster.width) != raster.width || raster.width != raster.height {
                return Err(bad(&format!("level {m}: its faces are not square and of one size")));
            }
            for (plane, name) in planes.iter_mut().zip(["R", "G", "B"]) {
                plane.extend_from_slice(raster.channel(name).unwrap_or_default());
            }
        }
        let n = size.unwrap_or(0);
        let raster = Raster::rgb(n, 6 * n, planes);
        let options = LoadOptions { layout: Some(FileLayout::VerticalStrip), ..options };
        held.levels.push(load::from_raster(&path.display().to_string(), raster, &options)?.image);
    }
    let rows = light["irradianceCoefficients"].as_array();
    let row = |r: &Value| -> Option<[f64; 3]> { Some([r[0].as_f64()?, r[1].as_f64()?, r[2].as_f64()?]) };
    held.sh = rows.and_then(|r| r.iter().map(row).collect::<Option<Vec<_>>>()).filter(|r| r.len() == 9);
    if held.levels.is_empty() { Err(bad("its light has no levels")) } else { Ok(held) }
}

/// What the light of a glTF file holds.
pub(crate) struct LightOfGltf {
    /// Level by level, over world directions.
    pub levels: Vec<SphereImage>,
    /// Nine coefficients of irradiance.
    pub sh: Option<Vec<[f64; 3]>>,
}

impl Session {
    /// The light of a glTF file that has one and no geometry; `None` for other files.
    pub(crate) fn light_of_gltf(
        &mut self,
        path: &Path,
        profile: &'static Profile,
        layout: Option<FileLayout>,
    ) -> Result<Option<LightOfGltf>, Error> {
        // A mesh's document may be larger than that of a light, and may be what is no text.
        let text = read_text(path, TEXT, "a glTF document beside its images").unwrap_or_default();
        let document: Value = serde_json::from_str(&text).unwrap_or_default();
        let lights = &document["extensions"]["EXT_lights_image_based"]["lights"];
        if !lights.is_array() || document["meshes"].as_array().is_some_and(|m| !m.is_empty()) {
            return Ok(None);
        }
        let held = gltf(path, &Reading { profile, layout }, self)?;
        Ok(Some(LightOfGltf { levels: held.levels, sh: held.sh }))
    }
}

/// A file below the folder of `path`.
fn beside(path: &Path, uri: &str) -> Option<PathBuf> {
    let relative = Path::new(uri);
    let plain = relative.components().all(|c| matches!(c, Component::Normal(_)));
    (plain && !uri.contains(':')).then(|| path.with_file_name("").join(relative))
}

/// Texels rgb/a; a file without alpha is as it is.
fn rgbd(path: &Path, session: &Session) -> Result<Raster, Error> {
    let options =
        ReadOptions { limits: session.limits(), data: true, all_channels: true, ..ReadOptions::default() };
    let mut raster = read_image_with(path, &options)?;
    let alpha: Option<Vec<f32>> = raster.channel("A").map(<[f32]>::to_vec);
    if let Some(alpha) = alpha {
        for channel in raster.channels.iter_mut().filter(|c| c.name != "A") {
            channel.data.iter_mut().zip(&alpha).for_each(|(v, a)| *v /= a.max(1.0 / 255.0));
        }
    }
    raster.low_range = false;
    Ok(raster)
}

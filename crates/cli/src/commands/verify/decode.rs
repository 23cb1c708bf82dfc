//! The levels of a file of any tool, over our world as a profile has it.

use crate::context::{Context, Negative};
use crate::failure::Failure;
use crate::inputs;
use serde_json::Value;
use std::path::{Component, Path, PathBuf};
use steradian_formats::{Container, Raster, ReadOptions, read_image_with, read_text};
use steradian_light::load::{self, FileLayout, LoadOptions, Profile};
use steradian_sphere::SphereImage;

/// Bytes that a text beside images may have.
const TEXT: u64 = 4 << 20;

/// What a file holds.
pub struct Held {
    /// Level by level, as the profile places them.
    pub levels: Vec<SphereImage>,
    /// Keys and values.
    pub metadata: Vec<(String, String)>,
    /// Nine irradiance coefficients, as they are in the file.
    pub sh: Option<Vec<[f64; 3]>>,
    /// Step of values that are stored divided by their largest channel; 0 elsewhere.
    pub step: f64,
}

/// How the file is read.
pub struct Reading {
    pub profile: &'static Profile,
    pub layout: Option<FileLayout>,
}

impl Reading {
    fn options(&self, context: &Context) -> LoadOptions {
        let negative = match context.common.negative {
            Negative::Keep => load::Negative::Keep,
            Negative::Zero => load::Negative::Zero,
        };
        LoadOptions { layout: self.layout, profile: Some(self.profile), negative, limits: context.limits() }
    }
}

/// Reads a texture, an image, a pattern with {}, a glTF file with a light, or a folder of levels.
pub fn decode(spec: &str, reading: &Reading, context: &mut Context) -> Result<Held, Failure> {
    let path = Path::new(spec);
    if path.is_dir() {
        return folder(path, reading, context);
    }
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("gltf")) {
        context.note_input(path);
        return gltf(path, reading, context);
    }
    let options = reading.options(context);
    if let Some(container) = Container::of_file(path) {
        context.note_input(path);
        let texture = container.read(path, &context.limits())?;
        let levels = (0..texture.levels.len())
            .map(|m| Ok(inputs::texture_map(path, &texture, m, &options)?.image))
            .collect::<Result<_, Failure>>()?;
        let sh = texture.get("sh").and_then(coefficients);
        return Ok(Held { levels, metadata: texture.metadata, sh, step: 0.0 });
    }
    context.note_input(path);
    let loaded = load::load(path, &options).map_err(|e| match Failure::from(e) {
        // Every image is told by its first bytes, whatever its name.
        f if f.code == 3 && path.is_file() && Container::of_name(path).is_some() => Failure::input(format!(
            "{spec}: is no texture (.ktx2, .ktx, .dds) by its first bytes, and no image that is read here"
        )),
        f => f,
    })?;
    loaded.report.warnings.iter().for_each(|w| context.warn(format_args!("{spec}: {w}")));
    Ok(Held { levels: vec![loaded.image], metadata: loaded.report.metadata, sh: None, step: 0.0 })
}

/// Nine lines of three numbers.
fn coefficients(text: &str) -> Option<Vec<[f64; 3]>> {
    let numbers: Vec<f64> = text.split_whitespace().map(|v| v.parse().ok()).collect::<Option<_>>()?;
    let rows: Vec<[f64; 3]> = numbers.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
    (rows.len() == 9).then_some(rows)
}

/// Levels in files of their own: `m0_px.exr` … as cmgen writes them, or `NAME_level0.exr` …
fn folder(dir: &Path, reading: &Reading, context: &mut Context) -> Result<Held, Failure> {
    let unreadable = |e: std::io::Error| Failure::input(format!("{}: cannot read: {e}", dir.display()));
    let mut names = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(unreadable)? {
        names.push(entry.map_err(unreadable)?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    let options = reading.options(context);
    let mut held = Held { levels: Vec::new(), metadata: Vec::new(), sh: None, step: 0.0 };
    for m in 0..16 {
        let faces = format!("m{m}_px.");
        let whole = format!("_level{m}.");
        let loaded = if let Some(n) = names.iter().find(|n| n.starts_with(&faces)) {
            context.note_input(&dir.join(n));
            if Container::of_file(&dir.join(n)).is_some() {
                faces_of_textures(dir, n, &options, context)?
            } else {
                load::load(&dir.join(n.replacen("px", "{}", 1)), &options)?
            }
        } else if let Some(n) = names.iter().find(|n| n.contains(&whole)) {
            context.note_input(&dir.join(n));
            load::load(&dir.join(n), &options)?
        } else {
            break;
        };
        held.metadata = loaded.report.metadata;
        held.levels.push(loaded.image);
    }
    if held.levels.is_empty() {
        return Err(Failure::input(format!(
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
    context: &Context,
) -> Result<load::Loaded, Failure> {
    let (mut strip, mut size) = (<[Vec<f32>; 3]>::default(), None);
    for part in ["px", "nx", "py", "ny", "pz", "nz"] {
        let path = dir.join(first.replacen("px", part, 1));
        let bad = |why: &str| Failure::input(format!("{}: {why}", path.display()));
        let container = Container::of_file(&path).ok_or_else(|| bad("is missing or no texture"))?;
        let t = container.read(&path, &context.limits())?;
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
fn gltf(path: &Path, reading: &Reading, context: &mut Context) -> Result<Held, Failure> {
    let bad = |why: &str| Failure::input(format!("{}: {why}", path.display()));
    let text = read_text(path, TEXT, "a glTF document beside its images")?;
    let document: Value = serde_json::from_str(&text).map_err(|e| bad(&format!("is no JSON: {e}")))?;
    let light = &document["extensions"]["EXT_lights_image_based"]["lights"][0];
    let levels =
        light["specularImages"].as_array().ok_or_else(|| bad("holds no light of EXT_lights_image_based"))?;
    let options = reading.options(context);
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
            let raster = rgbd(&file, context)?;
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

/// A file below the folder of `path`.
fn beside(path: &Path, uri: &str) -> Option<PathBuf> {
    let relative = Path::new(uri);
    let plain = relative.components().all(|c| matches!(c, Component::Normal(_)));
    (plain && !uri.contains(':')).then(|| path.with_file_name("").join(relative))
}

/// Texels rgb/a; a file without alpha is as it is.
fn rgbd(path: &Path, context: &Context) -> Result<Raster, Failure> {
    let options =
        ReadOptions { limits: context.limits(), data: true, all_channels: true, ..ReadOptions::default() };
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

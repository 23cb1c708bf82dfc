//! From files to environments: which layout, whose convention, what was wrong with the pixels.

pub mod arrangement;
mod assemble;
mod error;
mod profile;
mod repair;
#[cfg(test)]
mod tests;
mod warp;

pub use arrangement::Arrangement;
pub use error::LightError;
pub use profile::{PROFILES, Profile};

use crate::Environment;
use crate::lights::sound;
use assemble::Pixels;
use std::path::{Path, PathBuf};
use steradian_formats::{Limits, Raster, read_image};
use steradian_sphere::{Layout, SphereImage};

/// How a file arranges an environment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileLayout {
    /// 2 : 1, or any size when named.
    LatLong,
    /// Debevec's probe; what a square is unless another layout is named.
    AngularMap,
    /// Mirror ball.
    SphereMap,
    /// Octahedral.
    Octahedral,
    /// 4 : 3, +Y above +Z, the row −X +Z +X −Z, −Y below +Z.
    HorizontalCross,
    /// 3 : 4, as the horizontal cross with −Z upside down at the foot.
    VerticalCross,
    /// 6 : 1, +X −X +Y −Y +Z −Z.
    HorizontalStrip,
    /// 1 : 6, +X −X +Y −Y +Z −Z.
    VerticalStrip,
    /// 2 : 1 or 1 : 2, front and back paraboloid in one file.
    ParaboloidPair,
    /// Six square files.
    Faces,
    /// Two square files, front and back paraboloid.
    ParaboloidFiles,
}

impl FileLayout {
    /// Layouts that one file may have, with their names.
    const NAMED: [(Self, &'static str, &'static str); 11] = [
        (Self::LatLong, "latlong", "2:1"),
        (Self::AngularMap, "angular", "1:1"),
        (Self::SphereMap, "sphere-map", "1:1"),
        (Self::Octahedral, "octahedral", "1:1"),
        (Self::HorizontalCross, "cross", "4:3"),
        (Self::VerticalCross, "vertical-cross", "3:4"),
        (Self::HorizontalStrip, "strip", "6:1"),
        (Self::VerticalStrip, "vertical-strip", "1:6"),
        (Self::ParaboloidPair, "paraboloid", "2:1 or 1:2"),
        (Self::Faces, "faces", "six square files"),
        (Self::ParaboloidFiles, "paraboloid-files", "two square files"),
    ];

    /// The name that commands take.
    pub fn name(self) -> &'static str {
        Self::NAMED.iter().find(|(l, ..)| *l == self).map_or("", |(_, name, _)| name)
    }

    fn aspect(self) -> &'static str {
        Self::NAMED.iter().find(|(l, ..)| *l == self).map_or("", |(.., aspect)| aspect)
    }

    /// Can one file of this size have the layout?
    fn fits(self, w: usize, h: usize) -> bool {
        match self {
            Self::LatLong => true,
            Self::AngularMap | Self::SphereMap | Self::Octahedral => w == h,
            Self::HorizontalCross => 3 * w == 4 * h,
            Self::VerticalCross => 4 * w == 3 * h,
            Self::HorizontalStrip => w == 6 * h,
            Self::VerticalStrip => 6 * w == h,
            Self::ParaboloidPair => w == 2 * h || h == 2 * w,
            Self::Faces | Self::ParaboloidFiles => false,
        }
    }

    /// The layout of a name.
    pub fn from_name(name: &str) -> Option<Self> {
        let name = name.to_ascii_lowercase().replace('_', "-");
        let alias = match name.as_str() {
            "angular-map" | "probe" => "angular",
            "mirror-ball" | "spheremap" => "sphere-map",
            "lat-long" | "equirect" | "equirectangular" => "latlong",
            "horizontal-cross" => "cross",
            "horizontal-strip" => "strip",
            "dual-paraboloid" => "paraboloid",
            // As `convert` writes a cube that is given no arrangement.
            "cube" => "vertical-strip",
            other => other,
        };
        Self::NAMED.iter().find(|(_, n, _)| *n == alias).map(|(l, ..)| *l)
    }

    /// The layout of a name; the error lists the known ones.
    pub fn parse(name: &str) -> Result<Self, String> {
        let known = Self::NAMED.map(|(_, name, _)| name);
        Self::from_name(name).ok_or_else(|| steradian_base::unknown("layout", name, &known))
    }
}

/// What happens to finite negative texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Negative {
    /// They are data (resampled originals have them).
    #[default]
    Keep,
    /// They become 0.
    Zero,
}

/// How to load.
#[derive(Debug, Clone, Copy, Default)]
pub struct LoadOptions {
    /// The arrangement. Where `None`: what the file records (`steradian.layout`, OpenEXR's `envmap`), else by
    /// aspect ratio.
    pub layout: Option<FileLayout>,
    /// Whose convention. Where `None`: ours, but OpenEXR's for an EXR with an `envmap` attribute and
    /// Debevec's for an angular map; files that Steradian wrote say so in their metadata, with the profile
    /// that they were written for.
    pub profile: Option<&'static Profile>,
    /// Negative texels.
    pub negative: Negative,
    /// What decoding may allocate.
    pub limits: Limits,
}

/// What was found while loading.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Pixels of one file.
    pub width: usize,
    /// Pixels of one file.
    pub height: usize,
    /// The arrangement in the file.
    pub file_layout: FileLayout,
    /// Whether the arrangement was named (or told by the file) rather than taken from the aspect ratio.
    pub layout_stated: bool,
    /// Name of the profile.
    pub profile: &'static str,
    /// Display-referred data (PNG, JPEG): bright light is clipped.
    pub low_range: bool,
    /// Negative samples.
    pub negative_count: u64,
    /// The most negative sample, or 0.
    pub most_negative: f32,
    /// Whether they were set to 0.
    pub negative_zeroed: bool,
    /// The file's own samples (after [`LoadOptions::negative`]), where the profile's convention made the
    /// image by interpolating them; `None` where the image holds the samples themselves.
    pub samples: Option<Samples>,
    /// Warnings, one line each.
    pub warnings: Vec<String>,
    /// Metadata of the (first) file.
    pub metadata: Vec<(String, String)>,
}

/// Ranges of a file's samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Samples {
    /// The smallest of each channel.
    pub min: [f32; 3],
    /// The largest of each channel.
    pub max: [f32; 3],
    /// How many samples are negative.
    pub negative: u64,
}

impl Samples {
    fn of(image: &SphereImage) -> Self {
        let range = |f: fn(f32, f32) -> f32, start: f32| {
            std::array::from_fn(|c| image.planes[c].iter().copied().fold(start, f))
        };
        Self {
            min: range(f32::min, f32::INFINITY),
            max: range(f32::max, f32::NEG_INFINITY),
            negative: image.planes.iter().flatten().filter(|v| **v < 0.0).count() as u64,
        }
    }
}

/// A loaded environment in the layout of its file, over our world.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// The image.
    pub image: SphereImage,
    /// What was found.
    pub report: Report,
}

impl Loaded {
    /// The environment as lat-long: the image itself where it is one, else resampled at [`latlong_size`].
    pub fn into_environment(self) -> Environment {
        Environment::from_image(self.image)
    }
}

/// Size of the lat-long image that keeps what an image in another layout resolves.
pub fn latlong_size(layout: Layout, width: usize, height: usize) -> (usize, usize) {
    let n = width.max(height).max(1);
    match layout {
        Layout::LatLong => (width, height),
        Layout::Cube | Layout::DualParaboloid => (4 * n, 2 * n),
        Layout::SphereMap | Layout::Octahedral => (2 * n, n),
        Layout::AngularMap | Layout::AngularLattice => (2 * n.div_ceil(2), n.div_ceil(2)),
    }
}

/// Loads an environment. `path` names a file, or holds `{}` in its file name for the parts:
/// `px nx py ny pz nz`, `posx negx …`, `right left top bottom front back` (all +X −X +Y −Y +Z −Z), or
/// `front back` for a pair of paraboloids.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Loaded, LightError> {
    load_files(&parts(path)?, options)
}

/// Loads one file, six faces (+X −X +Y −Y +Z −Z), or a front and a back paraboloid.
pub fn load_files(paths: &[PathBuf], options: &LoadOptions) -> Result<Loaded, LightError> {
    if let [path] = paths {
        return from_raster(&path.display().to_string(), read_image(path, &options.limits)?, options);
    }
    let mut report: Option<Report> = None;
    let mut files = Vec::with_capacity(paths.len());
    for path in paths {
        let name = path.display().to_string();
        let (mut pixels, found) = check(&name, read_image(path, &options.limits)?, options)?;
        apply_negative(&mut pixels, options);
        report = Some(match report {
            None => found,
            Some(first) => first.with(&found),
        });
        files.push(pixels);
    }
    let image = assemble::several(files)?;
    let Some(mut report) = report else { return Err(LightError::invalid("environment", "no files")) };
    let two = image.layout == Layout::DualParaboloid;
    report.file_layout = if two { FileLayout::ParaboloidFiles } else { FileLayout::Faces };
    report.layout_stated = true;
    Ok(finish(image, report, options.profile.unwrap_or(Profile::own())))
}

/// The same for pixels that are decoded already.
pub fn from_raster(name: &str, raster: Raster, options: &LoadOptions) -> Result<Loaded, LightError> {
    let (mut pixels, mut report) = check(name, raster, options)?;
    apply_negative(&mut pixels, options);
    let attribute = envmap(&report.metadata);
    let own = is_own(&report.metadata);
    let layout = options
        .layout
        .or_else(|| recorded(&report.metadata, pixels.width, pixels.height))
        .or_else(|| attribute.and_then(|a| a.layout(pixels.width, pixels.height)));
    report.layout_stated = layout.is_some();
    let Some(layout) = layout.or_else(|| assemble::guess(pixels.width, pixels.height)) else {
        let why = format!(
            "{} x {} pixels: no layout has this shape (lat-long 2:1, probe 1:1, cross 4:3 or 3:4, strip 6:1 or 1:6); name it with `layout`",
            pixels.width, pixels.height
        );
        return Err(LightError::invalid(name, why));
    };
    report.file_layout = layout;
    let profile = match (options.profile, attribute, layout) {
        (Some(p), ..) => p,
        // What we wrote ourselves is in our convention, unless it says whose.
        _ if own => recorded_profile(&report.metadata),
        (None, Some(_), _) => Profile::openexr(),
        (None, None, FileLayout::AngularMap) => Profile::debevec(),
        _ => Profile::own(),
    };
    if !report.layout_stated && layout == FileLayout::AngularMap {
        report.warnings.push(
            "a square image is read as an angular map (light probe); name another layout if it is one".into(),
        );
    }
    let image = assemble::one(pixels, layout)?;
    Ok(finish(image, report, profile))
}

fn finish(image: SphereImage, mut report: Report, profile: &'static Profile) -> Loaded {
    report.profile = profile.name;
    report.samples = profile.interpolates(image.layout).then(|| Samples::of(&image));
    let mut image = profile.import(image);
    // What we wrote holds, in a texel that the rim cuts, the mean over the part inside: that is light.
    if !is_own(&report.metadata) {
        repair::fill_outside(&mut image);
    }
    Loaded { image, report }
}

/// Did Steradian write this file?
fn is_own(metadata: &[(String, String)]) -> bool {
    metadata.iter().any(|(k, _)| k.starts_with("steradian."))
}

/// The layout that a file of ours records, where its pixels have the shape.
fn recorded(metadata: &[(String, String)], w: usize, h: usize) -> Option<FileLayout> {
    let (_, name) = metadata.iter().find(|(k, _)| k == "steradian.layout")?;
    FileLayout::from_name(name).filter(|l| l.fits(w, h))
}

/// The profile that a file of ours records, or our own.
fn recorded_profile(metadata: &[(String, String)]) -> &'static Profile {
    let found = metadata.iter().find(|(k, _)| k == "steradian.profile").and_then(|(_, v)| Profile::find(v));
    found.unwrap_or(Profile::own())
}

/// What an EXR says of itself.
#[derive(Clone, Copy)]
enum Attribute {
    LatLong,
    Cube,
}

impl Attribute {
    fn layout(self, w: usize, h: usize) -> Option<FileLayout> {
        match self {
            Self::LatLong => Some(FileLayout::LatLong),
            Self::Cube => (6 * w == h).then_some(FileLayout::VerticalStrip),
        }
    }
}

fn envmap(metadata: &[(String, String)]) -> Option<Attribute> {
    let (_, value) = metadata.iter().find(|(k, _)| k == "envmap")?;
    match value.as_str() {
        "latlong" => Some(Attribute::LatLong),
        "cube" => Some(Attribute::Cube),
        _ => None,
    }
}

/// Finite, coloured pixels within [`crate::LARGEST`], and what was found in them.
fn check(name: &str, mut raster: Raster, options: &LoadOptions) -> Result<(Pixels, Report), LightError> {
    let (width, height) = (raster.width, raster.height);
    if width == 0 || height == 0 {
        return Err(LightError::invalid(name, "the image is empty"));
    }
    raster.channels.retain(|c| matches!(c.name.as_str(), "R" | "G" | "B" | "Y"));
    if let Some((x, y, channel)) = raster.first_non_finite() {
        let at = raster.channel(channel).map_or(f32::NAN, |c| c[y * width + x]);
        let value = if at.is_nan() { "NaN" } else { "infinite" };
        return Err(LightError::NotFinite { name: name.into(), x, y, channel: channel.into(), value });
    }
    let (low_range, metadata) = (raster.low_range, std::mem::take(&mut raster.metadata));
    let Some(planes) = raster.into_rgb() else {
        return Err(LightError::invalid(name, "has neither the channels R, G, B nor Y"));
    };
    for plane in &planes {
        if let Some(k) = plane.iter().position(|v| !sound(f64::from(*v))) {
            let (x, y, value) = (k % width, k / width, plane[k]);
            return Err(LightError::TooLarge { name: name.into(), x, y, value });
        }
    }
    let mut report = Report {
        width,
        height,
        file_layout: FileLayout::LatLong,
        layout_stated: false,
        profile: Profile::own().name,
        low_range,
        negative_count: 0,
        most_negative: 0.0,
        negative_zeroed: options.negative == Negative::Zero,
        samples: None,
        warnings: Vec::new(),
        metadata,
    };
    for &v in planes.iter().flatten().filter(|v| **v < 0.0) {
        report.negative_count += 1;
        report.most_negative = report.most_negative.min(v);
    }
    if low_range {
        report
            .warnings
            .push("low-range file: bright lights are clipped, so that lighting comes out too dark".into());
    }
    if report.negative_count > 0 {
        let fate = if report.negative_zeroed { "set to 0" } else { "kept" };
        report.warnings.push(format!(
            "{} negative samples (down to {:e}) are {fate}",
            report.negative_count, report.most_negative
        ));
    }
    Ok((Pixels { name: name.into(), width, height, planes }, report))
}

fn apply_negative(pixels: &mut Pixels, options: &LoadOptions) {
    if options.negative == Negative::Zero {
        pixels.planes.iter_mut().flatten().for_each(|v| *v = v.max(0.0));
    }
}

impl Report {
    /// The report of several files.
    fn with(mut self, other: &Self) -> Self {
        self.low_range |= other.low_range;
        self.negative_count += other.negative_count;
        self.most_negative = self.most_negative.min(other.most_negative);
        self.warnings.extend(
            other.warnings.iter().filter(|w| !self.warnings.contains(w)).cloned().collect::<Vec<_>>(),
        );
        self
    }
}

/// The files that `path` means to [`load`]: itself, or where its name holds `{}` and no file has that name,
/// the first set of parts of which every file exists.
pub fn parts(path: &Path) -> Result<Vec<PathBuf>, LightError> {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    if !name.contains("{}") || path.exists() {
        return Ok(vec![path.into()]);
    }
    const SETS: [&[&str]; 7] = [
        &["px", "nx", "py", "ny", "pz", "nz"],
        &["posx", "negx", "posy", "negy", "posz", "negz"],
        &["right", "left", "top", "bottom", "front", "back"],
        &["+x", "-x", "+y", "-y", "+z", "-z"],
        &["0", "1", "2", "3", "4", "5"],
        &["front", "back"],
        &["Front", "Back"],
    ];
    for set in SETS {
        let files: Vec<PathBuf> =
            set.iter().map(|part| path.with_file_name(name.replacen("{}", part, 1))).collect();
        if files.iter().all(|f| f.is_file()) {
            return Ok(files);
        }
    }
    let why = "no complete set of parts: {} stands for px nx py ny pz nz, posx negx ..., right left top bottom front back, or front back";
    Err(LightError::invalid(path.display().to_string(), why))
}

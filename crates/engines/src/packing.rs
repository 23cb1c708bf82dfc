//! Levels as they lie in files, and what the format of their texels changes.

use crate::request::BRDF;
use crate::{Companions, Engine, Files, Level, Plan, Request};
use std::path::Path;
use steradian_formats::packed::{decode_rgbd, encode_rgbd, round_trip_rgbe};
use steradian_formats::{FormatError, StoredTexture, TexelFormat, TextureLevels, WriteReport};
use steradian_sphere::{Layout, SphereImage};

/// The textures of the output, encoded once. Lat-long images and PNG faces are not among them: these are no
/// textures.
#[derive(Default)]
pub(crate) struct Packed {
    pub specular: Option<StoredTexture>,
    pub diffuse: Option<StoredTexture>,
    pub sheen: Option<StoredTexture>,
}

impl Packed {
    /// Arranges all maps for their consumer, and tells each what the format of its texels changes.
    pub fn new(
        o: &Request,
        plan: &Plan,
        levels: &mut [Level],
        companions: &mut Companions,
    ) -> Result<Self, FormatError> {
        let engine = plan.with_format(o);
        let stored = |levels: &mut [Level], kernel: &str| match levels {
            [] => Ok(None),
            levels => texture(&engine, &o.output, levels, kernel).map(Some),
        };
        if engine.files == Files::Gltf && o.engine.is_some() {
            let rgbd = |c| decode_rgbd(encode_rgbd(c, &mut WriteReport::default()));
            levels.iter_mut().for_each(|l| l.format_error = of_colours(&l.filtered.image, rgbd));
            return Ok(Self::default());
        }
        let mut packed = Self::default();
        if plan.layout == Layout::Cube {
            packed.specular = stored(levels, &label(&o.kernel))?;
        } else {
            levels.iter_mut().for_each(|l| l.format_error = of_image(&engine, o, &l.filtered.image));
        }
        packed.diffuse = stored(companions.diffuse.as_mut_slice(), "lambert")?;
        packed.sheen = stored(companions.sheen.as_mut_slice(), "charlie")?;
        if let Some(l) = &mut companions.panorama {
            l.format_error = of_image(&engine, o, &l.filtered.image);
        }
        Ok(packed)
    }

    /// The textures with `metadata` before what they say of themselves.
    pub fn signed(mut self, metadata: &[(String, String)]) -> Self {
        for t in [&mut self.specular, &mut self.diffuse, &mut self.sheen].into_iter().flatten() {
            t.metadata.splice(0..0, metadata.iter().cloned());
        }
        self
    }
}

/// Levels in the arrangement of `engine`, each told what the format changes.
fn texture(
    engine: &Engine,
    path: &Path,
    levels: &mut [Level],
    kernel: &str,
) -> Result<StoredTexture, FormatError> {
    let side = levels.first().map_or(0, |l| l.filtered.image.width);
    let mut metadata = vec![
        ("steradian.profile".to_string(), engine.recorded().to_string()),
        ("steradian.kernel".into(), kernel.into()),
    ];
    let roughness: Vec<String> =
        levels.iter().filter_map(|l| l.filter.roughness).map(|r| r.to_string()).collect();
    if !roughness.is_empty() {
        metadata.push(("steradian.perceptual_roughness".into(), roughness.join(" ")));
    }
    let given: Vec<_> = levels.iter().map(|l| rgba(&engine.arrange(&l.filtered.image))).collect();
    let given = TextureLevels { width: side, height: side, faces: 6, levels: given, metadata };
    let stored = StoredTexture::new(path, &given, engine.format)?;
    if engine.format != TexelFormat::Rgba32f {
        for (m, l) in levels.iter_mut().enumerate() {
            l.format_error = stored.level(m).map_or(0.0, |back| change(&given.levels[m], &back));
        }
    }
    Ok(stored)
}

/// What the file of a lat-long image changes, by its samples.
fn of_image(engine: &Engine, o: &Request, image: &SphereImage) -> f64 {
    let name = match engine.files {
        Files::LatLong { image, .. } => Path::new(image),
        _ => &o.output,
    };
    let half = matches!(engine.files, Files::LatLong { half: true, .. });
    if name.extension().is_some_and(|e| e.eq_ignore_ascii_case("hdr")) {
        of_colours(image, round_trip_rgbe)
    } else if half && o.format != Some(TexelFormat::Rgba32f) {
        let texels = rgba(image);
        change(&texels, &TexelFormat::Rgba16f.round_trip(&texels, (image.width, image.height)))
    } else {
        0.0
    }
}

/// What a code of single colours changes.
fn of_colours(image: &SphereImage, round_trip: impl Fn([f32; 3]) -> [f32; 3]) -> f64 {
    let texels = rgba(image);
    let back = |t: &[f32; 4]| {
        let [r, g, b] = round_trip([t[0], t[1], t[2]]);
        [r, g, b, t[3]]
    };
    change(&texels, texels.as_chunks::<4>().0.iter().map(back).collect::<Vec<_>>().as_flattened())
}

/// Texels as R G B 1.
fn rgba(image: &SphereImage) -> Vec<f32> {
    let [r, g, b] = &image.planes;
    let mut texels = vec![1.0; 4 * r.len()];
    let to = texels.as_chunks_mut::<4>().0;
    for i in 0..r.len() {
        to[i] = [r[i], g[i], b[i], 1.0];
    }
    texels
}

/// RMS(after − before)/RMS(before) of the colours of texels that lie as R G B A.
fn change(before: &[f32], after: &[f32]) -> f64 {
    let (mut error, mut whole) = ([0.0; 3], [0.0; 3]);
    let (before, after) = (before.as_chunks::<4>().0, after.as_chunks::<4>().0);
    for i in 0..before.len() {
        for c in 0..3 {
            let v = f64::from(before[i][c]);
            let e = f64::from(after[i][c]) - v;
            error[c] += e * e;
            whole[c] += v * v;
        }
    }
    let [error, whole]: [f64; 2] = [error, whole].map(|s| s.iter().sum());
    if whole == 0.0 { 0.0 } else { (error / whole).sqrt() }
}

/// The kernel's name in files, which hold no folders' names.
fn label(kernel: &str) -> String {
    let Some(spec) = kernel.strip_prefix(BRDF) else { return kernel.into() };
    let parts = spec.split_inclusive([':', ',', '=']).map(|part| {
        let (path, end) = part.split_at(part.trim_end_matches([':', ',', '=']).len());
        let path = Path::new(path);
        let name = path.file_name().filter(|_| path.is_file());
        name.map_or_else(|| part.to_string(), |n| n.to_string_lossy().into_owned() + end)
    });
    parts.fold(String::from(BRDF), |all, part| all + &part)
}

//! Facts of a texture: its container and format, its levels, and its metadata.

use crate::inputs::{Adjust, texture_map};
use crate::{Error, Session};
use std::path::Path;
use steradian_formats::{Container, TexelStorage};
use steradian_light::load::{LoadOptions, Profile};
use steradian_verify::laws::Consumer;

/// Facts of a texture file.
#[derive(Debug, Clone, PartialEq)]
pub struct TextureFacts {
    /// Its container.
    pub container: Container,
    /// How its texels are stored.
    pub texels: TexelStorage,
    /// 6 of a cube, else 1.
    pub faces: usize,
    /// Level by level.
    pub levels: Vec<LevelFacts>,
    /// Name of the profile whose layout the file has, where the file says so.
    pub profile: Option<String>,
    /// The profile that the caller names for a file that records none: `perceptual_roughness` and `kernel`
    /// follow from that.
    pub taken_for: Option<&'static str>,
    /// What its levels are convolved with, where the file or its profile says so.
    pub kernel: Option<String>,
    /// The file's metadata: keys and values.
    pub metadata: Vec<(String, String)>,
}

/// A level of a texture.
#[derive(Debug, Clone, PartialEq)]
pub struct LevelFacts {
    /// Width of a face.
    pub width: usize,
    /// Height of a face.
    pub height: usize,
    /// Perceptual roughness of its kernel, where the file or its profile says so.
    pub perceptual_roughness: Option<f64>,
    /// Mean over the sphere; a filter that loses no light leaves it as it is.
    pub mean: [f64; 3],
    /// Largest value of each channel.
    pub largest: [f32; 3],
}

impl Session {
    /// Facts of a texture; `None` for other files.
    pub(super) fn inspect_texture(&self, spec: &str, adjust: &Adjust) -> Result<Option<TextureFacts>, Error> {
        let path = Path::new(spec);
        let Some(container) = Container::of_file(path) else { return Ok(None) };
        let texels = container.texels(path)?;
        let t = container.read(path, &self.limits())?;
        let options = LoadOptions {
            layout: adjust.layout,
            profile: adjust.profile,
            negative: self.negative,
            limits: self.limits(),
        };
        let said = |key: &str| t.get(key).map(String::from);
        let profile = said("steradian.profile");
        let given = adjust.profile.filter(|_| profile.is_none());
        // Chains alone go over the roughness, and one's own name says nothing of a file of unknown origin.
        let consumer = given.filter(|p| p.name != Profile::own().name).and_then(|p| Consumer::find(p.name));
        let last = t.levels.len().saturating_sub(1);
        let law = |m: usize| consumer.filter(|_| last > 0).map(|c| c.kernel(m, last));
        let roughness: Vec<f64> = said("steradian.perceptual_roughness")
            .map(|r| r.split_whitespace().filter_map(|v| v.parse().ok()).collect())
            .unwrap_or_default();
        let roughness = |m: usize| roughness.get(m).copied().or_else(|| law(m)?.roughness());
        let kernel = said("steradian.kernel").or_else(|| Some(law(last)?.family.name().into()));
        let level = |m: usize| {
            let image = texture_map(path, &t, m, &options)?.image;
            let (width, height) = t.size(m);
            Ok(LevelFacts {
                width,
                height,
                perceptual_roughness: roughness(m),
                mean: image.integral().map(|v| v / (4.0 * std::f64::consts::PI)),
                largest: std::array::from_fn(|c| image.planes[c].iter().copied().fold(f32::MIN, f32::max)),
            })
        };
        let levels = (0..t.levels.len()).map(level).collect::<Result<_, Error>>()?;
        Ok(Some(TextureFacts {
            container,
            texels,
            faces: t.faces,
            levels,
            profile,
            taken_for: given.map(|p| p.name),
            kernel,
            metadata: t.metadata,
        }))
    }
}

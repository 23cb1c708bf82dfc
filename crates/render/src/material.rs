//! What a mesh file says of a material, as one reflectance and a base colour.
//!
//! Files describe a diffuse part, a specular part and textures of each; one BRDF with one texture is what the
//! techniques take. What is assumed and what is left out is said in words, never silently.

use crate::maps::{self, Maps, NormalFiltering};
use crate::{NormalMap, Texture};
use std::sync::Arc;
use steradian_brdf::{SharedBrdf, SpecError, parse};
use steradian_formats::mesh::{MaterialData, TextureRef, TextureSource};
use steradian_formats::{FormatError, Limits, Raster};

/// A material of a mesh file.
#[derive(Clone)]
pub struct FileMaterial {
    /// The file's name for it; may be empty.
    pub name: String,
    /// The spec of the reflectance that it is taken as; the base colour multiplies it.
    pub spec: String,
    /// What was left out, in words; empty where nothing was.
    pub left_out: Vec<&'static str>,
    /// Multiplies the net reflectance; `None` where the file's is white.
    pub base_colour: Option<Arc<Texture>>,
    /// Normals.
    pub normal: Option<Arc<NormalMap>>,
    /// alpha² of metals whose roughness varies.
    pub alpha2: Option<Arc<Texture>>,
}

/// Smallest alpha of metals: files say 0 for a polish that no light is sharp enough for.
pub const MIN_ALPHA: f32 = 0.02;

impl FileMaterial {
    /// Reads a material's textures. Metals (mean metalness above ½) become `ggx` of the mean alpha whose f0 is the
    /// base colour, everything else `lambert` whose albedo is the base colour.
    pub fn read(m: &MaterialData, textures: &[TextureSource], limits: &Limits) -> Result<Self, FormatError> {
        let roughness = image(m.metallic_roughness_texture.as_ref(), textures, true, limits)?;
        let (metallic, alpha) = metallic_and_alpha(m, roughness.as_ref());
        let metal = metallic > 0.5;
        let elsewhere = |r: &Option<TextureRef>| {
            let first = m.base_color_texture.or(m.normal_texture).or(m.metallic_roughness_texture);
            let place = |r: TextureRef| (r.offset, r.rotation, r.scale);
            r.is_some_and(|r| first.is_some_and(|f| place(f) != place(r)))
        };
        let spec = if metal { format!("ggx:alpha={alpha:.3}") } else { "lambert".into() };
        let mixed = m.metallic_roughness_texture.is_some();
        let left_out = [
            (metal && mixed && metallic < 0.95, "what is not metal"),
            (!metal && (metallic > 0.05 || mixed || m.phong.is_some_and(|p| p.0 != [0.0; 3])), "highlights"),
            (elsewhere(&m.normal_texture), "the placement of its normal map"),
            (metal && elsewhere(&m.metallic_roughness_texture), "the placement of its roughness map"),
            (m.occlusion_texture.is_some(), "occlusion"),
            (m.emissive != [0.0; 3], "emission"),
            (m.base_color[3] < 1.0 || m.alpha_cutoff.is_some(), "transparency"),
        ];
        Ok(Self {
            name: m.name.clone(),
            spec,
            left_out: left_out.into_iter().filter(|l| l.0).map(|l| l.1).collect(),
            base_colour: base_colour(m, textures, limits)?.map(Arc::new),
            normal: normal(m, textures, limits)?.map(Arc::new),
            alpha2: roughness.filter(|_| metal).and_then(|r| alpha2(m, &r)).map(Arc::new),
        })
    }

    /// The maps, those of roughness only where `roughness` (another reflectance has its own).
    pub fn maps(&self, roughness: bool) -> Maps {
        Maps {
            normal: self.normal.clone(),
            alpha2: self.alpha2.clone().filter(|_| roughness),
            filtering: NormalFiltering::default(),
        }
    }

    /// The reflectance that [`FileMaterial::spec`] says.
    pub fn brdf(&self) -> Result<SharedBrdf, SpecError> {
        parse(&self.spec)
    }

    /// What was assumed, in one line.
    pub fn assumed(&self) -> String {
        let times = if self.base_colour.is_some() { " times its base colour" } else { "" };
        let with = match (self.normal.is_some(), self.alpha2.is_some()) {
            (true, true) => ", with its normal and roughness maps",
            (true, false) => ", with its normal map",
            (false, true) => ", with its roughness map",
            (false, false) => "",
        };
        let without = match self.left_out.as_slice() {
            [] => String::new(),
            some => format!(", without {}", some.join(", ")),
        };
        format!("material '{}' taken as {}{times}{with}{without}", self.name, self.spec)
    }
}

/// The image of a reference; `None` where the file was missing, which its reader has noted.
fn image(
    r: Option<&TextureRef>,
    textures: &[TextureSource],
    data: bool,
    limits: &Limits,
) -> Result<Option<Raster>, FormatError> {
    let source = r.and_then(|r| textures.get(r.texture)).filter(|t| !t.bytes.is_empty());
    source.map(|s| s.decode(data, limits)).transpose()
}

/// Mean metalness, and mean alpha = perceptual roughness²; glTF 2.0, 3.9.2: factor times blue, factor times green.
fn metallic_and_alpha(m: &MaterialData, raster: Option<&Raster>) -> (f64, f64) {
    let mean = |name: &str, f: &dyn Fn(f64) -> f64| -> f64 {
        let plane = raster.and_then(|r| r.channel(name).or_else(|| r.channel("Y")));
        match plane {
            Some(p) if !p.is_empty() => p.iter().map(|v| f(f64::from(*v))).sum::<f64>() / p.len() as f64,
            _ => f(1.0),
        }
    };
    let metallic = mean("B", &|b| b * f64::from(m.metallic));
    let alpha = mean("G", &|g| (g * f64::from(m.perceptual_roughness)).powi(2));
    (metallic.clamp(0.0, 1.0), alpha.clamp(f64::from(MIN_ALPHA), 1.0))
}

/// The map of alpha² where roughness varies.
fn alpha2(m: &MaterialData, raster: &Raster) -> Option<Texture> {
    let plane = raster.channel("G").or_else(|| raster.channel("Y"))?;
    if plane.iter().all(|v| v == &plane[0]) {
        return None;
    }
    let texture = maps::alpha2(raster.width, raster.height, plane, m.perceptual_roughness, MIN_ALPHA)?;
    let wrap = m.metallic_roughness_texture.as_ref()?.wrap;
    Some(texture.with_wrap(wrap))
}

/// The normal map.
fn normal(
    m: &MaterialData,
    textures: &[TextureSource],
    limits: &Limits,
) -> Result<Option<NormalMap>, FormatError> {
    let Some(r) = &m.normal_texture else { return Ok(None) };
    let Some(raster) = image(Some(r), textures, true, limits)? else { return Ok(None) };
    let (width, height) = (raster.width, raster.height);
    let map = raster.into_rgb().and_then(|p| NormalMap::new(width, height, &p, m.normal_scale));
    Ok(map.map(|t| t.with_wrap(r.wrap)))
}

/// Factor times texture, linear; `None` where that is white everywhere.
fn base_colour(
    m: &MaterialData,
    textures: &[TextureSource],
    limits: &Limits,
) -> Result<Option<Texture>, FormatError> {
    let factor = [m.base_color[0], m.base_color[1], m.base_color[2]];
    let Some(r) = &m.base_color_texture else { return Ok(Texture::plain(factor)) };
    let Some(raster) = image(Some(r), textures, false, limits)? else { return Ok(Texture::plain(factor)) };
    let (width, height) = (raster.width, raster.height);
    let Some(mut planes) = raster.into_rgb() else { return Ok(Texture::plain(factor)) };
    for (plane, f) in planes.iter_mut().zip(factor) {
        plane.iter_mut().for_each(|v| *v *= f);
    }
    Ok(Texture::new(width, height, &planes).map(|t| t.with_wrap(r.wrap)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(m: MaterialData) -> FileMaterial {
        FileMaterial::read(&m, &[], &Limits::default()).expect("nothing to decode")
    }

    #[test]
    fn metals_reflect_their_base_colour_and_the_rest_scatters_it() {
        let gold = MaterialData {
            base_color: [1.0, 0.8, 0.3, 1.0],
            perceptual_roughness: 0.5,
            ..MaterialData::default()
        };
        let m = read(gold);
        assert_eq!(m.spec, "ggx:alpha=0.250");
        assert_eq!(m.base_colour.as_ref().map(|t| t.sample(0.3, 0.7, 0.0)), Some([1.0, 0.8, 0.3]));
        assert!(m.brdf().is_ok() && m.left_out.is_empty());
        let m = read(MaterialData { metallic: 0.0, emissive: [1.0; 3], ..MaterialData::default() });
        assert_eq!((m.spec.as_str(), m.base_colour.is_none()), ("lambert", true));
        assert_eq!(m.assumed(), "material '' taken as lambert, without emission");
    }

    #[test]
    fn polish_has_a_floor_and_missing_images_leave_the_factor() {
        let m = MaterialData {
            perceptual_roughness: 0.0,
            base_color: [0.5, 0.5, 0.5, 1.0],
            base_color_texture: Some(TextureRef::new(0)),
            ..MaterialData::default()
        };
        let m = read(m);
        assert_eq!(m.spec, "ggx:alpha=0.020");
        assert_eq!(m.base_colour.map(|t| t.size()), Some((1, 1)));
    }
}

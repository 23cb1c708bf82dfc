//! What a mesh file says of a material, as one reflectance and a base colour.
//!
//! Files describe a diffuse part, a specular part and textures of each; one BRDF with one texture is what the
//! techniques take. What is assumed and what is left out is said in words, never silently.

use crate::Texture;
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
}

/// Smallest alpha of metals: files say 0 for a polish that no light is sharp enough for.
const MIN_ALPHA: f64 = 0.02;

impl FileMaterial {
    /// Reads a material's textures. Metals (mean metalness above ½) become `ggx` of the mean alpha whose f0 is the
    /// base colour, everything else `lambert` whose albedo is the base colour.
    pub fn read(m: &MaterialData, textures: &[TextureSource], limits: &Limits) -> Result<Self, FormatError> {
        let (metallic, alpha) = metallic_and_alpha(m, textures, limits)?;
        let metal = metallic > 0.5;
        let spec = if metal { format!("ggx:alpha={alpha:.3}") } else { "lambert".into() };
        let mixed = m.metallic_roughness_texture.is_some();
        let left_out = [
            (metal && mixed, "what is not metal, and the variation of roughness"),
            (!metal && (metallic > 0.05 || mixed || m.phong.is_some_and(|p| p.0 != [0.0; 3])), "highlights"),
            (m.normal_texture.is_some(), "the normal map"),
            (m.occlusion_texture.is_some(), "occlusion"),
            (m.emissive != [0.0; 3], "emission"),
            (m.base_color[3] < 1.0 || m.alpha_cutoff.is_some(), "transparency"),
        ];
        Ok(Self {
            name: m.name.clone(),
            spec,
            left_out: left_out.into_iter().filter(|l| l.0).map(|l| l.1).collect(),
            base_colour: base_colour(m, textures, limits)?.map(Arc::new),
        })
    }

    /// The reflectance that [`FileMaterial::spec`] says.
    pub fn brdf(&self) -> Result<SharedBrdf, SpecError> {
        parse(&self.spec)
    }

    /// What was assumed, in one line.
    pub fn assumed(&self) -> String {
        let times = if self.base_colour.is_some() { " times its base colour" } else { "" };
        let without = match self.left_out.as_slice() {
            [] => String::new(),
            some => format!(", without {}", some.join(", ")),
        };
        format!("material '{}' taken as {}{times}{without}", self.name, self.spec)
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
fn metallic_and_alpha(
    m: &MaterialData,
    textures: &[TextureSource],
    limits: &Limits,
) -> Result<(f64, f64), FormatError> {
    let raster = image(m.metallic_roughness_texture.as_ref(), textures, true, limits)?;
    let mean = |name: &str, f: &dyn Fn(f64) -> f64| -> f64 {
        let plane = raster.as_ref().and_then(|r| r.channel(name).or_else(|| r.channel("Y")));
        match plane {
            Some(p) if !p.is_empty() => p.iter().map(|v| f(f64::from(*v))).sum::<f64>() / p.len() as f64,
            _ => f(1.0),
        }
    };
    let metallic = mean("B", &|b| b * f64::from(m.metallic));
    let alpha = mean("G", &|g| (g * f64::from(m.perceptual_roughness)).powi(2));
    Ok((metallic.clamp(0.0, 1.0), alpha.clamp(MIN_ALPHA, 1.0)))
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

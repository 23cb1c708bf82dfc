//! A mesh file's material as one reflectance and the textures that vary it.
//!
//! glTF's metallic-roughness becomes `dielectric`: a GGX layer over a diffuse base, whose albedo, f0 and
//! alpha vary by texel ([`Colours::metallic`]), and whose f0 is that of KHR_materials_ior and _specular; a
//! material that is metal everywhere becomes `ggx`, with two widths where KHR_materials_anisotropy says so,
//! and one of OBJ `lambert`, times its base colour. Sheen (KHR_materials_sheen) is a layer, and no
//! reflectance of ours is one over another: over a black base that reflects nothing it is `charlie`. What is
//! left out is said in words, never silently.

use std::sync::Arc;
use steradian_brdf::{SharedBrdf, SpecError, parse};
use steradian_formats::mesh::{Anisotropy, MaterialData, Sheen, TextureRef, TextureSource};
use steradian_formats::{FormatError, Limits, Raster};
use steradian_scene::surface::{self, Colours, NormalMap, SurfaceMaps, Texture};

/// A material of a mesh file.
#[derive(Clone)]
pub struct FileMaterial {
    /// Name in the file; may be empty.
    pub name: String,
    /// Spec of the reflectance that represents it, with the means of all textures.
    pub spec: String,
    /// What was left out, in words; empty where nothing was.
    pub left_out: Vec<String>,
    /// Base colour; `None` where the file's is white.
    pub base_colour: Option<Arc<Texture>>,
    /// Normals.
    pub normal: Option<Arc<NormalMap>>,
    /// alpha² where roughness varies.
    pub alpha2: Option<Arc<Texture>>,
    /// Albedo and f0 of a `dielectric`, where base colour or metalness vary.
    pub colours: Option<Colours>,
    /// Share of the surroundings that each point sees.
    pub occlusion: Option<Arc<Texture>>,
    /// Emitted radiance.
    pub emission: Option<Arc<Texture>>,
}

/// Least alpha of metals and layers: files have 0 for a perfect polish, for which the light's resolution does
/// not suffice.
pub const MIN_ALPHA: f32 = 0.02;
/// Smallest perceptual roughness of sheen: that of the least alpha of `charlie`.
const MIN_SHEEN: f32 = 0.1;
/// Rotations of an anisotropic highlight off the tangent or the bitangent by less than this count as none,
/// radians.
const ALONG: f32 = 0.01;

impl FileMaterial {
    /// Reads a material's textures.
    pub fn read(m: &MaterialData, textures: &[TextureSource], limits: &Limits) -> Result<Self, FormatError> {
        let roughness = image(m.metallic_roughness_texture.as_ref(), textures, true, limits)?;
        let alpha = mean_alpha(m, roughness.as_ref());
        let metallic = metallic(m, roughness.as_ref());
        let base = base_colour(m, textures, limits)?;
        let colours = match (&metallic, m.phong) {
            (Some(metallic), None) => Some(Colours::metallic(&base, metallic, m.dielectric_f0)),
            _ => None,
        };
        let alpha2 = roughness.filter(|_| m.phong.is_none()).and_then(|r| alpha2(m, &r));
        // Nothing but the sheen reflects.
        let black = match &colours {
            Some(c) => c.albedo.mean() == [0.0; 3] && c.f0.mean() == [0.0; 3],
            None => base.mean() == [0.0; 3],
        };
        let sheen = m.sheen.filter(|_| black && m.phong.is_none());
        let widths = m.anisotropy.filter(|_| colours.is_none() && alpha2.is_none() && sheen.is_none());
        let widths = widths.and_then(|a| widths_of(a, alpha));
        let spec = match (&colours, m.phong, sheen, widths) {
            (_, Some(_), ..) => "lambert".into(),
            (_, _, Some(Sheen { color, perceptual_roughness: r }), _) => {
                format!("charlie:alpha={:.3},color={}", r.max(MIN_SHEEN).powi(2), triple(color))
            }
            (Some(c), ..) => {
                let [f0, albedo] = [&c.f0, &c.albedo].map(|t| triple(t.mean()));
                format!("dielectric:alpha={alpha:.3},f0={f0},albedo={albedo}")
            }
            (.., Some([ax, ay])) => format!("ggx:ax={ax:.3},ay={ay:.3}"),
            (None, ..) => format!("ggx:alpha={alpha:.3}"),
        };
        let colours = colours.filter(|c| c.albedo.size() != (1, 1) || c.f0.size() != (1, 1));
        let colours = colours.filter(|_| sheen.is_none());
        let alpha2 = alpha2.filter(|_| sheen.is_none());
        let mut left_out = left_out(m);
        let extensions = [
            (m.anisotropy.is_some() && widths.is_none(), "KHR_materials_anisotropy"),
            (m.sheen.is_some() && sheen.is_none(), "KHR_materials_sheen"),
        ];
        left_out.extend(extensions.into_iter().filter(|e| e.0).map(|e| e.1.to_string()));
        left_out.extend(m.unread.iter().cloned());
        Ok(Self {
            name: m.name.clone(),
            spec,
            left_out,
            base_colour: (!base.is_white()).then(|| Arc::new(base)),
            normal: normal(m, textures, limits)?.map(Arc::new),
            alpha2: alpha2.map(Arc::new),
            colours,
            occlusion: occlusion(m, textures, limits)?.map(Arc::new),
            emission: emission(m, textures, limits)?.map(Arc::new),
        })
    }

    /// The maps; those of roughness and colours only with the material's `own` reflectance.
    pub fn maps(&self, own: bool) -> SurfaceMaps {
        SurfaceMaps {
            normal: self.normal.clone(),
            alpha2: self.alpha2.clone().filter(|_| own),
            colours: self.colours.clone().filter(|_| own),
            emission: self.emission.clone(),
            ..SurfaceMaps::default()
        }
    }

    /// Texture that multiplies the reflected radiance: occlusion, and the base colour unless the material's
    /// `own` reflectance has it in its layers.
    pub fn tint(&self, own: bool) -> Option<Arc<Texture>> {
        let layered = own && self.is_coloured();
        match (self.base_colour.as_ref().filter(|_| !layered), &self.occlusion) {
            (Some(base), Some(occlusion)) => {
                Some(Arc::new(base.joined(occlusion, |a, b| std::array::from_fn(|k| a[k] * b[k]))))
            }
            (one, other) => one.or(other.as_ref()).cloned(),
        }
    }

    /// Does the reflectance itself hold the base colour, so that it is no factor?
    fn is_coloured(&self) -> bool {
        ["dielectric:", "charlie:"].iter().any(|name| self.spec.starts_with(name))
    }

    /// The reflectance that [`FileMaterial::spec`] says.
    pub fn brdf(&self) -> Result<SharedBrdf, SpecError> {
        parse(&self.spec)
    }

    /// Assumptions about the material, in one line.
    pub fn assumed(&self) -> String {
        let times =
            if self.base_colour.is_some() && !self.is_coloured() { " times its base colour" } else { "" };
        let maps = [
            (self.colours.is_some(), "base colour and metalness"),
            (self.normal.is_some(), "normal"),
            (self.alpha2.is_some(), "roughness"),
            (self.occlusion.is_some(), "occlusion"),
            (self.emission.is_some(), "emission"),
        ];
        let maps: Vec<&str> = maps.into_iter().filter(|m| m.0).map(|m| m.1).collect();
        let with = if maps.is_empty() { String::new() } else { format!(", with its {}", listed(&maps)) };
        let without = match self.left_out.as_slice() {
            [] => String::new(),
            all => format!(", without {}", listed(&all.iter().map(String::as_str).collect::<Vec<_>>())),
        };
        format!("material '{}' taken as {}{times}{with}{without}", self.name, self.spec)
    }
}

/// Words as a list.
fn listed(words: &[&str]) -> String {
    match words {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// What the material says that is not shown.
fn left_out(m: &MaterialData) -> Vec<String> {
    let first = m.base_color_texture.or(m.normal_texture).or(m.metallic_roughness_texture);
    let place = |r: TextureRef| (r.offset, r.rotation, r.scale);
    let elsewhere = |r: &Option<TextureRef>| r.is_some_and(|r| first.is_some_and(|f| place(f) != place(r)));
    let all = [
        (m.phong.is_some_and(|p| p.0 != [0.0; 3]), "highlights"),
        (elsewhere(&m.normal_texture), "the placement of its normal map"),
        (elsewhere(&m.metallic_roughness_texture), "the placement of its roughness map"),
        (elsewhere(&m.occlusion_texture), "the placement of its occlusion map"),
        (elsewhere(&m.emissive_texture), "the placement of its emission map"),
        (m.base_color[3] < 1.0 || m.alpha_cutoff.is_some(), "transparency"),
    ];
    all.into_iter().filter(|l| l.0).map(|l| l.1.into()).collect()
}

/// Widths along tangent and bitangent (KHR_materials_anisotropy): along its direction alpha becomes alpha +
/// s² (1 − alpha). `None` where the direction is neither of both.
fn widths_of(a: Anisotropy, alpha: f64) -> Option<[f64; 2]> {
    let along = alpha + f64::from(a.strength).powi(2) * (1.0 - alpha);
    let (sin, cos) = a.rotation.sin_cos();
    match (sin.abs() < ALONG, cos.abs() < ALONG) {
        (true, _) => Some([along, alpha]),
        (_, true) => Some([alpha, along]),
        _ => None,
    }
}

/// r/g/b with four digits.
fn triple([r, g, b]: [f32; 3]) -> String {
    format!("{r:.4}/{g:.4}/{b:.4}")
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

/// Mean alpha = perceptual roughness²; glTF 2.0, 3.9.2: factor times green.
fn mean_alpha(m: &MaterialData, raster: Option<&Raster>) -> f64 {
    let factor = f64::from(m.perceptual_roughness);
    let plane = raster.and_then(|r| r.channel("G").or_else(|| r.channel("Y"))).filter(|p| !p.is_empty());
    let alpha = plane.map_or(factor * factor, |p| {
        p.iter().map(|g| (f64::from(*g) * factor).powi(2)).sum::<f64>() / p.len() as f64
    });
    alpha.clamp(f64::from(MIN_ALPHA), 1.0)
}

/// Metalness; glTF 2.0, 3.9.2: factor times blue. `None` where all is metal.
fn metallic(m: &MaterialData, raster: Option<&Raster>) -> Option<Texture> {
    let plane = raster.and_then(|r| Some((r, r.channel("B").or_else(|| r.channel("Y"))?)));
    let texture = match plane {
        Some((r, plane)) => {
            let scaled: Vec<f32> = plane.iter().map(|b| b * m.metallic).collect();
            let wrap = m.metallic_roughness_texture.as_ref()?.wrap;
            Texture::new(r.width, r.height, &[scaled.clone(), scaled.clone(), scaled])?.with_wrap(wrap)
        }
        None => Texture::constant([m.metallic; 3]),
    };
    let whole = texture.levels().next().is_some_and(|(_, _, texels)| texels.iter().all(|t| t[0] >= 1.0));
    (!whole).then_some(texture)
}

/// The map of alpha² where roughness varies.
fn alpha2(m: &MaterialData, raster: &Raster) -> Option<Texture> {
    let plane = raster.channel("G").or_else(|| raster.channel("Y"))?;
    if plane.iter().all(|v| v == &plane[0]) {
        return None;
    }
    let texture = surface::alpha2(raster.width, raster.height, plane, m.perceptual_roughness, MIN_ALPHA)?;
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

/// Factor times texture, linear.
fn base_colour(
    m: &MaterialData,
    textures: &[TextureSource],
    limits: &Limits,
) -> Result<Texture, FormatError> {
    let factor = [m.base_color[0], m.base_color[1], m.base_color[2]];
    let t = coloured(m.base_color_texture.as_ref(), factor, textures, limits)?;
    Ok(t.unwrap_or_else(|| Texture::constant(factor)))
}

/// An sRGB texture times a factor; `None` where there is none.
fn coloured(
    r: Option<&TextureRef>,
    factor: [f32; 3],
    textures: &[TextureSource],
    limits: &Limits,
) -> Result<Option<Texture>, FormatError> {
    let (Some(r), Some(raster)) = (r, image(r, textures, false, limits)?) else { return Ok(None) };
    let (width, height) = (raster.width, raster.height);
    let Some(mut planes) = raster.into_rgb() else { return Ok(None) };
    for (plane, f) in planes.iter_mut().zip(factor) {
        plane.iter_mut().for_each(|v| *v *= f);
    }
    Ok(Texture::new(width, height, &planes).map(|t| t.with_wrap(r.wrap)))
}

/// Emitted radiance: factor times texture (glTF 2.0, 3.9.3); `None` where it is black.
fn emission(
    m: &MaterialData,
    textures: &[TextureSource],
    limits: &Limits,
) -> Result<Option<Texture>, FormatError> {
    if m.emissive == [0.0; 3] {
        return Ok(None);
    }
    let t = coloured(m.emissive_texture.as_ref(), m.emissive, textures, limits)?;
    Ok(Some(t.unwrap_or_else(|| Texture::constant(m.emissive))))
}

/// 1 + strength (red − 1) (glTF 2.0, 3.9.3).
fn occlusion(
    m: &MaterialData,
    textures: &[TextureSource],
    limits: &Limits,
) -> Result<Option<Texture>, FormatError> {
    let r = m.occlusion_texture.as_ref();
    let (Some(r), Some(raster)) = (r, image(r, textures, true, limits)?) else { return Ok(None) };
    let Some(plane) = raster.channel("R").or_else(|| raster.channel("Y")) else { return Ok(None) };
    let open: Vec<f32> = plane.iter().map(|o| 1.0 + m.occlusion_strength * (o - 1.0)).collect();
    let t = Texture::new(raster.width, raster.height, &[open.clone(), open.clone(), open]);
    Ok(t.map(|t| t.with_wrap(r.wrap)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use steradian_formats::mesh::DIELECTRIC_F0;

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
        assert_eq!(m.spec, "dielectric:alpha=1.000,f0=0.0400/0.0400/0.0400,albedo=1.0000/1.0000/1.0000");
        assert!(m.brdf().is_ok() && m.base_colour.is_none() && m.colours.is_none() && m.tint(true).is_none());
        assert_eq!(m.maps(true).emission.map(|t| t.mean()), Some([1.0; 3]));
        assert_eq!(m.assumed(), format!("material '' taken as {}, with its emission", m.spec));
    }

    /// Half metal, half not: (1 − m) c and 0.04 (1 − m) + m c of each half, and their means afar.
    #[test]
    fn metalness_splits_the_base_colour_by_texel() {
        let plane = |a: f32, b: f32| vec![a, b];
        let metallic =
            Texture::new(2, 1, &[plane(0.0, 1.0), plane(0.0, 1.0), plane(0.0, 1.0)]).expect("two texels");
        let c = Colours::metallic(&Texture::constant([0.8, 0.5, 0.2]), &metallic, [DIELECTRIC_F0; 3]);
        assert_eq!(c.albedo.sample(0.25, 0.5, 0.0), [0.8, 0.5, 0.2]);
        assert_eq!(c.albedo.sample(0.75, 0.5, 0.0), [0.0; 3]);
        assert_eq!(c.f0.sample(0.25, 0.5, 0.0), [DIELECTRIC_F0; 3]);
        assert_eq!(c.f0.sample(0.75, 0.5, 0.0), [0.8, 0.5, 0.2]);
        let mean = c.f0.mean();
        assert!((mean[1] - 0.27).abs() < 1e-6, "{mean:?}");
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

    #[test]
    fn highlights_of_metals_have_two_widths() {
        let metal = |strength, rotation| MaterialData {
            perceptual_roughness: 0.5,
            anisotropy: Some(Anisotropy { strength, rotation }),
            ..MaterialData::default()
        };
        // 0.25 + 0.36 (1 − 0.25)
        let m = read(metal(0.6, 0.0));
        assert_eq!((m.spec.as_str(), m.left_out.len()), ("ggx:ax=0.520,ay=0.250", 0));
        assert!(m.brdf().is_ok());
        assert_eq!(read(metal(0.6, std::f32::consts::FRAC_PI_2)).spec, "ggx:ax=0.250,ay=0.520");
        assert_eq!(read(metal(0.6, std::f32::consts::PI)).spec, "ggx:ax=0.520,ay=0.250");
        // No width of ours lies between tangent and bitangent, and no layer has two.
        let m = read(metal(0.6, 0.7));
        assert_eq!(
            (m.spec.as_str(), m.left_out),
            ("ggx:alpha=0.250", vec!["KHR_materials_anisotropy".into()])
        );
        let m = read(MaterialData { metallic: 0.0, ..metal(0.6, 0.0) });
        assert!(
            m.spec.starts_with("dielectric:") && m.left_out == ["KHR_materials_anisotropy"],
            "{}",
            m.spec
        );
    }

    #[test]
    fn layers_reflect_as_their_index_says() {
        let m =
            read(MaterialData { metallic: 0.0, dielectric_f0: [0.1, 0.2, 0.3], ..MaterialData::default() });
        assert!(m.spec.contains("f0=0.1000/0.2000/0.3000"), "{}", m.spec);
    }

    #[test]
    fn sheen_alone_is_charlie_and_over_something_is_left_out() {
        let cloth = MaterialData {
            base_color: [0.0, 0.0, 0.0, 1.0],
            metallic: 0.0,
            dielectric_f0: [0.0; 3],
            sheen: Some(Sheen { color: [0.9, 0.5, 0.1], perceptual_roughness: 0.5 }),
            unread: vec!["KHR_materials_clearcoat".into()],
            ..MaterialData::default()
        };
        let m = read(cloth.clone());
        assert_eq!(m.spec, "charlie:alpha=0.250,color=0.9000/0.5000/0.1000");
        assert!(m.brdf().is_ok() && m.tint(true).is_none() && m.left_out == ["KHR_materials_clearcoat"]);
        let m = read(MaterialData { base_color: [0.5, 0.5, 0.5, 1.0], ..cloth });
        assert!(m.spec.starts_with("dielectric:"), "{}", m.spec);
        assert!(m.assumed().ends_with("without KHR_materials_sheen and KHR_materials_clearcoat"));
    }
}

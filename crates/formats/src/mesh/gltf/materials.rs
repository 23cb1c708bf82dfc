//! glTF materials, textures and images.

use super::buffers::{Buffers, read_uri};
use super::json::{Material, Root, TextureInfo};
use crate::FormatError;
use crate::mesh::source::Source;
use crate::mesh::{Anisotropy, DIELECTRIC_F0, MaterialData, Sheen, TextureRef, TextureSource, Wrap};
use serde_json::Value;

/// The images of the file, not decoded. A missing file is noted, a forbidden one is an error.
pub fn images(
    root: &Root,
    buffers: &Buffers,
    source: &mut Source,
) -> Result<Vec<TextureSource>, FormatError> {
    let mut out = Vec::with_capacity(root.images.len());
    for (i, image) in root.images.iter().enumerate() {
        let mut name = image.name.clone();
        let bytes = match (&image.uri, image.bufferView) {
            (Some(uri), _) => {
                if name.is_empty() && !uri.starts_with("data:") {
                    name.clone_from(uri);
                }
                match read_uri(uri, source) {
                    Err(FormatError::Unreadable { path, why }) => {
                        source.note(format!("texture {} cannot be read: {why}", path.display()));
                        Vec::new()
                    }
                    other => other?,
                }
            }
            (None, Some(view)) => {
                let bytes =
                    buffers.view(view).map_err(|why| source.fault(format_args!("image {i}: {why}")))?.0;
                source.spend(bytes.len() as u64, 1)?;
                bytes.to_vec()
            }
            (None, None) => Vec::new(),
        };
        if name.is_empty() {
            name = format!("image {i}");
        }
        out.push(TextureSource { name, bytes });
    }
    Ok(out)
}

/// One material and the set of texture coordinates that it uses.
pub fn material(root: &Root, m: &Material, source: &mut Source) -> Result<(MaterialData, u32), String> {
    let pbr = &m.pbrMetallicRoughness;
    let infos = [
        &pbr.baseColorTexture,
        &m.normalTexture,
        &pbr.metallicRoughnessTexture,
        &m.occlusionTexture,
        &m.emissiveTexture,
    ];
    let set = infos.into_iter().flatten().next().map_or(0, tex_coord);
    if infos.into_iter().flatten().any(|i| tex_coord(i) != set) {
        source.note(format!("material {:?}: all its textures use TEXCOORD_{set}", m.name));
    }
    let texture = |info: &Option<TextureInfo>| info.as_ref().map(|i| texture(root, i)).transpose();
    let strength =
        m.extensions["KHR_materials_emissive_strength"]["emissiveStrength"].as_f64().unwrap_or(1.0);
    let data = MaterialData {
        name: m.name.clone(),
        base_color: pbr.baseColorFactor.unwrap_or([1.0; 4]),
        base_color_texture: texture(&pbr.baseColorTexture)?,
        metallic: pbr.metallicFactor.unwrap_or(1.0),
        perceptual_roughness: pbr.roughnessFactor.unwrap_or(1.0),
        metallic_roughness_texture: texture(&pbr.metallicRoughnessTexture)?,
        normal_texture: texture(&m.normalTexture)?,
        normal_scale: m.normalTexture.as_ref().and_then(|t| t.scale).unwrap_or(1.0),
        occlusion_texture: texture(&m.occlusionTexture)?,
        occlusion_strength: m.occlusionTexture.as_ref().and_then(|t| t.strength).unwrap_or(1.0),
        emissive: m.emissiveFactor.unwrap_or_default().map(|e| e * strength as f32),
        emissive_texture: texture(&m.emissiveTexture)?,
        alpha_cutoff: (m.alphaMode.as_deref() == Some("MASK")).then(|| m.alphaCutoff.unwrap_or(0.5)),
        double_sided: m.doubleSided,
        dielectric_f0: dielectric_f0(m),
        anisotropy: anisotropy(m),
        sheen: sheen(m),
        unread: unread(m),
        phong: None,
    };
    let numbers = [data.metallic, data.perceptual_roughness, data.normal_scale, data.occlusion_strength];
    if !numbers.iter().chain(&data.base_color).chain(&data.emissive).all(|v| v.is_finite()) {
        return Err("has a number that is not finite".into());
    }
    Ok((data, set))
}

/// Extensions of materials that are read.
const READ: [&str; 5] = [
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_anisotropy",
    "KHR_materials_sheen",
];

/// A number of an extension within a range.
fn number(v: &Value, or: f32, range: [f32; 2]) -> f32 {
    let number = v.as_f64().map_or(or, |v| v as f32);
    if number.is_finite() { number.clamp(range[0], range[1]) } else { or }
}

/// Reflectance at normal incidence by index and specular colour (KHR_materials_ior, KHR_materials_specular):
/// f0 = min(colour ((n − 1)/(n + 1))², 1) factor, where an index of 0 stands for a mirror.
fn dielectric_f0(m: &Material) -> [f32; 3] {
    let index = &m.extensions["KHR_materials_ior"]["ior"];
    let of_index = if index.is_number() {
        let n = number(index, 1.5, [0.0, f32::MAX]);
        ((n - 1.0) / (n + 1.0)).powi(2)
    } else {
        DIELECTRIC_F0
    };
    let specular = &m.extensions["KHR_materials_specular"];
    let factor = number(&specular["specularFactor"], 1.0, [0.0, 1.0]);
    [0, 1, 2].map(|c| {
        let colour = number(&specular["specularColorFactor"][c], 1.0, [0.0, f32::MAX]);
        (of_index * colour).min(1.0) * factor
    })
}

fn anisotropy(m: &Material) -> Option<Anisotropy> {
    let given = &m.extensions["KHR_materials_anisotropy"];
    let strength = number(&given["anisotropyStrength"], 0.0, [0.0, 1.0]);
    let rotation = number(&given["anisotropyRotation"], 0.0, [f32::MIN, f32::MAX]);
    (strength > 0.0).then_some(Anisotropy { strength, rotation })
}

fn sheen(m: &Material) -> Option<Sheen> {
    let given = &m.extensions["KHR_materials_sheen"];
    let color = [0, 1, 2].map(|c| number(&given["sheenColorFactor"][c], 0.0, [0.0, 1.0]));
    let perceptual_roughness = number(&given["sheenRoughnessFactor"], 0.0, [0.0, 1.0]);
    (color != [0.0; 3]).then_some(Sheen { color, perceptual_roughness })
}

/// Extensions that are not read, and what is not read of the others.
fn unread(m: &Material) -> Vec<String> {
    let Some(all) = m.extensions.as_object() else { return Vec::new() };
    let mut out: Vec<String> = all.keys().filter(|k| !READ.contains(&k.as_str())).cloned().collect();
    for name in READ {
        let has_texture = |(key, v): (&String, &Value)| key.ends_with("Texture") && v.is_object();
        if all.get(name).and_then(Value::as_object).is_some_and(|e| e.iter().any(has_texture)) {
            out.push(format!("the textures of {name}"));
        }
    }
    if number(&m.extensions["KHR_materials_specular"]["specularFactor"], 1.0, [0.0, 1.0]) < 1.0 {
        out.push("KHR_materials_specular at grazing angles".into());
    }
    out
}

fn tex_coord(info: &TextureInfo) -> u32 {
    let own = info.extensions["KHR_texture_transform"]["texCoord"].as_u64();
    own.and_then(|t| u32::try_from(t).ok()).unwrap_or(info.texCoord)
}

fn texture(root: &Root, info: &TextureInfo) -> Result<TextureRef, String> {
    let texture =
        root.textures.get(info.index).ok_or_else(|| format!("there is no texture {}", info.index))?;
    let image =
        texture.source.ok_or_else(|| format!("texture {} has no image that can be read", info.index))?;
    if image >= root.images.len() {
        return Err(format!("there is no image {image}"));
    }
    let mut out = TextureRef::new(image);
    if let Some(i) = texture.sampler {
        let sampler = root.samplers.get(i).ok_or_else(|| format!("there is no sampler {i}"))?;
        out.wrap = [wrap(sampler.wrapS)?, wrap(sampler.wrapT)?];
        out.nearest = sampler.magFilter == Some(9728);
    }
    let transform = &info.extensions["KHR_texture_transform"];
    let number = |v: &Value, or: f64| v.as_f64().unwrap_or(or) as f32;
    out.offset = [0, 1].map(|i| number(&transform["offset"][i], 0.0));
    out.scale = [0, 1].map(|i| number(&transform["scale"][i], 1.0));
    out.rotation = number(&transform["rotation"], 0.0);
    Ok(out)
}

fn wrap(mode: Option<u32>) -> Result<Wrap, String> {
    match mode {
        None | Some(10497) => Ok(Wrap::Repeat),
        Some(33648) => Ok(Wrap::Mirror),
        Some(33071) => Ok(Wrap::Clamp),
        Some(other) => Err(format!("unknown wrap mode {other}")),
    }
}

//! MTL material libraries, with the physically based keys (Pr, Pm, norm) that exporters add.

use super::super::{MaterialData, MeshData, TextureRef, TextureSource, Wrap, source::Source};
use crate::FormatError;
use std::collections::HashMap;

/// Adds the materials of a library; a name that was there already is described anew.
pub fn read(
    library: &str,
    bytes: &[u8],
    data: &mut MeshData,
    names: &mut HashMap<String, u32>,
    images: &mut HashMap<String, usize>,
    source: &mut Source,
) -> Result<(), FormatError> {
    let text = String::from_utf8_lossy(bytes);
    let mut current: Option<usize> = None;
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        let (key, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        if key == "newmtl" {
            current = Some(declare(rest.trim(), data, names, source)?);
        } else if let Some(m) = current {
            let rest = rest.trim();
            if let Some(slot) = texture_slot(key) {
                let texture = texture(rest, data, images, source)?;
                slot(&mut data.materials[m], texture);
            } else if !set(&mut data.materials[m], key, rest) {
                let (line, why) = (i + 1, "is not a finite number");
                return Err(source.fault(format_args!("{library}: line {line}: {key} {rest:?} {why}")));
            }
        }
    }
    Ok(())
}

/// A material of OBJ: Phong's, until it has one of the physically based keys (Pr, Pm, map_ORM).
pub fn plain() -> MaterialData {
    MaterialData { metallic: 0.0, phong: Some(([0.0; 3], 0.0)), ..MaterialData::default() }
}

/// The number of the material `name`, new or described anew.
pub fn declare(
    name: &str,
    data: &mut MeshData,
    names: &mut HashMap<String, u32>,
    source: &mut Source,
) -> Result<usize, FormatError> {
    source.spend(1, 2 * size_of::<MaterialData>())?;
    let material = MaterialData { name: name.into(), ..plain() };
    let next = data.materials.len();
    let at = *names.entry(name.into()).or_insert(next as u32) as usize;
    if at == next {
        data.materials.push(material);
    } else {
        data.materials[at] = material;
    }
    Ok(at)
}

/// Sets a number of a material; false where it is none.
fn set(material: &mut MaterialData, key: &str, rest: &str) -> bool {
    if !matches!(key, "Kd" | "Ks" | "Ke" | "Ns" | "Pr" | "Pm" | "d" | "Tr") {
        return true;
    }
    let Some(rgb) = color(rest) else { return false };
    match key {
        "Kd" => material.base_color[..3].copy_from_slice(&rgb),
        "Ke" => material.emissive = rgb,
        "Ks" => material.phong = material.phong.map(|(_, exponent)| (rgb, exponent)),
        "Ns" => {
            material.phong = material.phong.map(|(specular, _)| (specular, rgb[0]));
            // The Beckmann slope of the same highlight is √(2/(n+2)) (Walter et al. 2007, section 5.2).
            material.perceptual_roughness = (2.0 / (rgb[0].max(0.0) + 2.0)).sqrt().sqrt();
        }
        "Pr" => (material.perceptual_roughness, material.phong) = (rgb[0], None),
        "Pm" => (material.metallic, material.phong) = (rgb[0], None),
        "d" => material.base_color[3] = rgb[0],
        _ => material.base_color[3] = 1.0 - rgb[0],
    }
    true
}

/// One number or three.
fn color(rest: &str) -> Option<[f32; 3]> {
    let values: Vec<f32> = rest
        .split_whitespace()
        .take(3)
        .map(|w| w.parse().ok().filter(|v: &f32| v.is_finite()))
        .collect::<Option<_>>()?;
    match *values.as_slice() {
        [a] => Some([a; 3]),
        [a, b, c] => Some([a, b, c]),
        _ => None,
    }
}

type Slot = fn(&mut MaterialData, TextureRef);

fn texture_slot(key: &str) -> Option<Slot> {
    Some(match key {
        "map_Kd" => |m, t| m.base_color_texture = Some(t),
        "map_Ke" => |m, t| m.emissive_texture = Some(t),
        "norm" | "map_norm" | "map_Norm" => |m, t| m.normal_texture = Some(t),
        "map_ao" | "map_Pao" => |m, t| m.occlusion_texture = Some(t),
        "map_ORM" => |m, t| (m.metallic_roughness_texture, m.phong) = (Some(t), None),
        _ => return None,
    })
}

/// Options of a map statement and how many words follow each at most.
const OPTIONS: [(&str, usize); 12] = [
    ("-blendu", 1),
    ("-blendv", 1),
    ("-boost", 1),
    ("-mm", 2),
    ("-o", 3),
    ("-s", 3),
    ("-t", 3),
    ("-texres", 1),
    ("-clamp", 1),
    ("-bm", 1),
    ("-imfchan", 1),
    ("-type", 1),
];

/// `[options] file name`; an image that is missing is noted and stays empty.
fn texture(
    rest: &str,
    data: &mut MeshData,
    images: &mut HashMap<String, usize>,
    source: &mut Source,
) -> Result<TextureRef, FormatError> {
    let mut texture = TextureRef::new(0);
    let mut name = rest;
    while let Some((option, most)) = OPTIONS.iter().find(|(o, _)| name.split_whitespace().next() == Some(o)) {
        name = name[option.len()..].trim_start();
        let mut values = Vec::new();
        while values.len() < *most {
            let (word, tail) = name.split_once(char::is_whitespace).unwrap_or((name, ""));
            // -o, -s and -t take one to three numbers, the others exactly their words.
            if *most == 3 && !values.is_empty() && word.parse::<f32>().is_err() {
                break;
            }
            values.push(word);
            name = tail.trim_start();
            if name.is_empty() {
                break;
            }
        }
        let number = |i: usize, or: f32| {
            values.get(i).and_then(|v| v.parse().ok()).filter(|v: &f32| v.is_finite()).unwrap_or(or)
        };
        match *option {
            "-clamp" if values == ["on"] => texture.wrap = [Wrap::Clamp; 2],
            // v is turned over: an offset upwards is one downwards, and scaling keeps v = 1 in place.
            "-o" => texture.offset = [number(0, 0.0), -number(1, 0.0)],
            "-s" => texture.scale = [number(0, 1.0), number(1, 1.0)],
            _ => {}
        }
    }
    texture.offset[1] += 1.0 - texture.scale[1];
    texture.texture = image(name, data, images, source)?;
    Ok(texture)
}

fn image(
    name: &str,
    data: &mut MeshData,
    images: &mut HashMap<String, usize>,
    source: &mut Source,
) -> Result<usize, FormatError> {
    if let Some(i) = images.get(name) {
        return Ok(*i);
    }
    let bytes = match source.read_reference(name) {
        Ok(bytes) => bytes,
        Err(FormatError::Unreadable { .. }) => {
            source.note(format!("texture {name:?} cannot be read"));
            Vec::new()
        }
        Err(e) => return Err(e),
    };
    source.spend(1, 2 * size_of::<TextureSource>() + name.len())?;
    let next = data.textures.len();
    data.textures.push(TextureSource { name: name.into(), bytes });
    images.insert(name.into(), next);
    Ok(next)
}

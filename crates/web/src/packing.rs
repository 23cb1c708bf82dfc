//! What shaders read, as textures and uniforms of a page: half precision where it holds the numbers.

use crate::WebError;
use crate::data::Data;
use half::f16;
use serde_json::{Map, Value, json};
use std::collections::HashMap;
use steradian_gpu::packed::{self, Counts, stack, textures};
use steradian_gpu::scene::{Backdrop, Level, Object, Triangles};
use steradian_technique::GpuTechnique;
use steradian_technique::gpu::{Buffer, Format, Numbers, ROW, Table, cells};

/// Texels a side of the textures that every WebGL2 has.
const SIDE: usize = 2048;
/// Layers of the array textures that every WebGL2 has.
const LAYERS: usize = 256;
/// Textures that a stage may read.
pub const UNITS: usize = 16;
/// Largest finite half.
const LARGEST: f32 = 65504.0;
/// Arrays whose largest number is smaller lose bits in half precision.
const SMALLEST: f32 = 0.015_625;
/// Numbers from which on a buffer is worth halving; small ones hold counts and offsets.
const LONG: usize = 1 << 14;

/// Bits that the halves of long arrays lose: prefiltered maps and coefficients stay right to 0.8 %, 0.3 % in
/// the RMS, which packs into two thirds of the bytes.
const COARSE: u32 = 4;

/// Bits that the halves of so many numbers lose.
fn lost(numbers: usize) -> u32 {
    if numbers >= LONG { COARSE } else { 0 }
}

/// A texture of floats, `channels` a texel.
fn texture(
    data: &mut Data,
    what: &str,
    size: [usize; 3],
    channels: usize,
    floats: &[f32],
) -> Result<Value, WebError> {
    texture_to(data, what, size, channels, floats, lost(floats.len()))
}

/// Bits that halves lose which are looked at and not computed with: they stay right to 0.4 %, less than a
/// step of 8 bits.
const UNSEEN: u32 = 3;

/// [`texture`] whose halves are rounded to multiples of 2^`bits` of their last place.
fn texture_to(
    data: &mut Data,
    what: &str,
    size: [usize; 3],
    channels: usize,
    floats: &[f32],
    bits: u32,
) -> Result<Value, WebError> {
    check_size(what, size)?;
    let largest = floats.iter().fold(0.0f32, |m, x| m.max(x.abs()));
    let halves = channels == 4 && (SMALLEST..=LARGEST).contains(&largest);
    let (format, place) = if halves {
        let half = |t: &[f32; 4]| t.map(|x| coarse(f16::from_f32(x), bits));
        let texels: Vec<[u16; 4]> = floats.as_chunks::<4>().0.iter().map(half).collect();
        ("rgba16float", data.push_halves(&texels))
    } else {
        let name = match channels {
            1 => "r32float",
            2 => "rg32float",
            _ => "rgba32float",
        };
        (name, data.push(&packed::bytes(floats), 4 * channels))
    };
    Ok(json!({"format": format, "size": size, "data": place.json()}))
}

/// Refuses textures that some devices lack room for.
fn check_size(what: &str, [width, height, layers]: [usize; 3]) -> Result<(), WebError> {
    if width.max(height) > SIDE.max(8192) || layers > LAYERS {
        return Err(WebError::TooLarge(format!("{what}, which has {width} x {height} x {layers} texels")));
    }
    Ok(())
}

/// The bits of `x`, rounded to a multiple of 2^`bits` of its last place, and finite.
fn coarse(x: f16, bits: u32) -> u16 {
    let rounded = (x.to_bits() & 0x7fff) + ((1u16 << bits) >> 1);
    let most = f16::MAX.to_bits();
    (x.to_bits() & 0x8000) | ((rounded.min(most) >> bits) << bits)
}

/// Words in rows of [`ROW`] texels; the viewer fills the last row up.
fn words(data: &mut Data, what: &str, bytes: Vec<u8>) -> Result<Value, WebError> {
    let rows = bytes.len().div_ceil(4 * ROW).max(1);
    if rows > SIDE {
        return Err(WebError::TooLarge(format!("{what}, which has {} numbers", rows * ROW)));
    }
    let place = data.push(&bytes, 4);
    Ok(json!({"format": "r32uint", "size": [ROW, rows, 1], "data": place.json()}))
}

fn uniform(data: &mut Data, bytes: &[u8]) -> Value {
    json!({"uniform": data.push(bytes, 4).json()})
}

/// `x` to the nearest multiple of `step`, which leaves the low bits of floats empty.
fn rounded(x: f32, step: f32) -> f32 {
    if step > 0.0 { (x / step).round() * step } else { x }
}

/// A mesh; positions to 2^-18 of its extent, normals and tangents to 2^-13.
pub fn mesh(data: &mut Data, t: &Triangles) -> Result<Value, WebError> {
    let what = format!("a mesh of {} triangles", t.indices.len());
    let (low, high) = t.bounds().unwrap_or_default();
    let step = f32::exp2(((high - low).max_element().max(1e-30).log2() - 18.0).floor());
    let mut rows: Vec<f32> = Vec::with_capacity(12 * t.vertices.len());
    for v in &t.vertices {
        rows.extend([0, 1, 2].map(|k| rounded(v[k], step)));
        rows.push(v[3]);
        rows.extend([4, 5, 6].map(|k| rounded(v[k], f32::exp2(-13.0))));
        rows.push(v[7]);
        rows.extend([8, 9, 10, 11].map(|k| rounded(v[k], f32::exp2(-13.0))));
    }
    let height = (3 * t.vertices.len()).div_ceil(ROW).max(1);
    if height > SIDE {
        return Err(WebError::TooLarge(what));
    }
    // A vertex is three texels.
    let place = data.push(&packed::bytes(&rows), 48);
    let vertices = json!({"format": "rgba32float", "size": [ROW, height, 1], "data": place.json()});
    let indices = t.indices.as_flattened().iter().chain(&t.sites).flat_map(|i| i.to_le_bytes()).collect();
    let colours = t.colors.as_flattened();
    let rows = colours.len().div_ceil(ROW).max(1);
    Ok(json!({
        "vertices": 3 * t.indices.len(),
        "bounds": [low.to_array(), high.to_array()],
        "resources": {
            "gpu_vertices": vertices,
            "gpu_indices": words(data, &what, indices)?,
            "gpu_colours": texture(data, &what, [ROW, rows, 1], 1, colours)?,
        },
    }))
}

/// The technique as pages have it: long buffers of singles become halves where they hold the numbers.
pub fn halved(technique: &GpuTechnique) -> GpuTechnique {
    let mut out = technique.clone();
    for b in &mut out.buffers {
        if let Numbers::F32(v) = &b.data
            && v.len() >= LONG
            && (SMALLEST..=LARGEST).contains(&v.iter().fold(0.0f32, |m, x| m.max(x.abs())))
        {
            let half = |x: &f32| f16::from_bits(coarse(f16::from_f32(*x), COARSE));
            b.data = Numbers::F16(v.iter().map(half).collect());
        }
    }
    out
}

/// Uniforms, tables and buffers of a technique, by the names of their variables.
pub fn technique(data: &mut Data, technique: &GpuTechnique) -> Result<Map<String, Value>, WebError> {
    let mut out = Map::new();
    out.insert("technique".into(), uniform(data, &technique.uniform_bytes()));
    for t in &technique.tables {
        out.insert(format!("table_{}", t.name), table(data, technique.slug, t)?);
    }
    for b in &technique.buffers {
        out.insert(format!("buffer_{}", b.name), buffer(data, technique.slug, b)?);
    }
    Ok(out)
}

fn table(data: &mut Data, slug: &str, t: &Table) -> Result<Value, WebError> {
    let what = format!("the table '{}' of {slug}", t.name);
    table_to(data, &what, t, lost(t.level.bytes.len() / 4))
}

fn table_to(data: &mut Data, what: &str, t: &Table, bits: u32) -> Result<Value, WebError> {
    let size = [t.level.width, t.level.height, t.level.layers];
    if t.format == Format::Rgba8Unorm {
        check_size(what, size)?;
        let place = data.push(&t.level.bytes, 4);
        return Ok(json!({"format": "rgba8unorm", "size": size, "data": place.json()}));
    }
    texture_to(data, what, size, t.channels(), &t.numbers(), bits)
}

fn buffer(data: &mut Data, slug: &str, b: &Buffer) -> Result<Value, WebError> {
    words(data, &format!("the buffer '{}' of {slug}", b.name), b.data.to_bytes())
}

/// The maps that several objects share, by their addresses.
pub type Shared = HashMap<usize, Value>;

/// What belongs to an object: uniforms, the reflectance of direct lights, maps.
pub fn object(data: &mut Data, o: &Object, shared: &mut Shared) -> Result<Map<String, Value>, WebError> {
    const NAMES: [&str; packed::TEXTURES] = [
        "gpu_tint",
        "gpu_mean_normals",
        "gpu_normal_spread",
        "gpu_alpha2",
        "gpu_albedo",
        "gpu_f0",
        "gpu_emission",
    ];
    let mut out = Map::new();
    out.insert("gpu_object".into(), uniform(data, &Counts::of(o, 0).uniforms(&o.transform)));
    let parameters = o.brdf.as_ref().map_or(&[0.0; 4][..], |b| b.uniforms().as_flattened());
    out.insert("brdf".into(), uniform(data, &packed::bytes(parameters)));
    if let Some(numbers) = o.brdf.as_ref().and_then(|b| b.cells()) {
        let what = "the measured reflectance";
        out.insert("brdf_cells".into(), table_to(data, what, &cells("brdf", numbers), 0)?);
    }
    for (name, texture) in NAMES.into_iter().zip(textures(o)) {
        let key = texture.map_or(0, |t| std::ptr::from_ref(t) as usize);
        let value = match shared.get(&key) {
            Some(v) => v.clone(),
            None => level(data, "a texture", &stack(texture), 0)?,
        };
        shared.insert(key, value.clone());
        out.insert(name.into(), value);
    }
    Ok(out)
}

fn level(data: &mut Data, what: &str, l: &Level, bits: u32) -> Result<Value, WebError> {
    let floats: Vec<f32> = l.texels.iter().flat_map(|t| [t[0], t[1], t[2], 1.0]).collect();
    texture_to(data, what, [l.width, l.height, 1], 4, &floats, bits)
}

/// The backdrop, its image at most `width` texels wide.
pub fn backdrop(data: &mut Data, b: &Backdrop) -> Result<Map<String, Value>, WebError> {
    let mut out = Map::new();
    out.insert("gpu_backdrop".into(), uniform(data, &packed::backdrop_uniforms(b)));
    let none = Level { width: 1, height: 1, texels: vec![[0.0; 3]] };
    let image = packed::bordered(b.image.as_ref().unwrap_or(&none));
    out.insert("gpu_sky".into(), level(data, "the backdrop", &image, UNSEEN)?);
    let disks = packed::disks(b);
    let size = [disks.len(), 1, 1];
    out.insert("gpu_disks".into(), texture(data, "the suns", size, 4, disks.as_flattened())?);
    Ok(out)
}

/// The reference's picture, exposed by `gain`.
pub fn reference(
    data: &mut Data,
    texels: &[[f32; 4]],
    [width, height]: [usize; 2],
    gain: f32,
) -> Result<Value, WebError> {
    let shown = |c: f32| (c * gain).clamp(0.0, LARGEST);
    let floats: Vec<f32> =
        texels.iter().flat_map(|t| [shown(t[0]), shown(t[1]), shown(t[2]), t[3]]).collect();
    texture_to(data, "the reference's picture", [width, height, 1], 4, &floats, UNSEEN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounded_halves_stay_finite_and_right_to_half_a_percent() {
        for k in 0..f16::MAX.to_bits() {
            let x = f16::from_bits(k);
            let y = f16::from_bits(coarse(x, UNSEEN));
            assert!(y.is_finite());
            if x > f16::MIN_POSITIVE {
                assert!((y.to_f32() / x.to_f32() - 1.0).abs() <= 0.005, "{x} {y}");
            }
            assert_eq!(coarse(x, 0), k);
            assert_eq!(coarse(-x, UNSEEN), coarse(x, UNSEEN) | 0x8000);
        }
    }
}

//! KTX2 to textures.

use super::{HEADER_BYTES, IDENTIFIER, LEVEL_BYTES, TextureLevels};
use crate::image::{not_empty, read_bytes};
use crate::texel::TexelFormat;
use crate::{FormatError, Limits, TexelStorage};
use half::f16;
use std::borrow::Cow;
use std::io::Read;
use std::path::Path;

/// Reads the texture `path`.
pub fn read_ktx2(path: &Path, limits: &Limits) -> Result<TextureLevels, FormatError> {
    decode_ktx2(path, &read_bytes(path, limits)?, limits)
}

/// Decodes a texture that lies in memory; `name` is for messages. Components that the format lacks become 0,
/// alpha 1.
pub fn decode_ktx2(name: &Path, bytes: &[u8], limits: &Limits) -> Result<TextureLevels, FormatError> {
    let (texture, layers) = decode_layers(name, bytes, limits)?;
    if layers > 1 {
        let why = format!("an array of {layers} images; one image or a cube is read here");
        return Err(FormatError::invalid(name, why));
    }
    Ok(texture)
}

/// The texture and its layers, which lie where faces do; 0 where it is no array.
pub(super) fn decode_layers(
    name: &Path,
    bytes: &[u8],
    limits: &Limits,
) -> Result<(TextureLevels, usize), FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    not_empty(name, bytes)?;
    let header = Header::parse(bytes).map_err(invalid)?;
    let mut texture = TextureLevels {
        width: header.width,
        height: header.height,
        faces: header.faces,
        ..TextureLevels::default()
    };
    limits.texture(name, &texture, header.levels, bytes.len() as u64)?;
    let (start, length) = header.key_values;
    let pairs = start.checked_add(length).and_then(|end| bytes.get(start..end));
    texture.metadata = pairs.and_then(key_values).ok_or_else(|| invalid(DAMAGED.into()))?;
    for level in 0..header.levels {
        let (size, faces) = (texture.size(level), texture.faces);
        let expected = header.format.image_bytes(size) * faces;
        let data = header.level(bytes, level, expected).map_err(invalid)?;
        texture.levels.push(header.format.expand(&data, size));
    }
    Ok((texture, header.layers))
}

struct Header {
    format: Format,
    width: usize,
    height: usize,
    /// Images of a level: faces, or layers.
    faces: usize,
    /// 0 where it is no array.
    layers: usize,
    levels: usize,
    key_values: (usize, usize),
    scheme: u32,
}

#[derive(Clone, Copy)]
enum Format {
    Floats { components: usize, half: bool },
    Packed(TexelFormat),
}

impl Format {
    /// Of the numbers in `vulkan_core.h`.
    fn of(vk: u32) -> Result<Self, String> {
        let (components, half) = match vk {
            76 => (1, true),
            83 => (2, true),
            90 => (3, true),
            97 => (4, true),
            100 => (1, false),
            103 => (2, false),
            106 => (3, false),
            109 => (4, false),
            122 => return Ok(Self::Packed(TexelFormat::R11g11b10)),
            123 => return Ok(Self::Packed(TexelFormat::Rgb9e5)),
            143 => return Ok(Self::Packed(TexelFormat::Bc6h)),
            144 => return Ok(Self::Packed(TexelFormat::Bc6hSigned)),
            _ => {
                let why = "16- and 32-bit floats, B10G11R11, E5B9G9R9 and BC6H are";
                return Err(format!("VkFormat {vk} is not read; {why}"));
            }
        };
        Ok(Self::Floats { components, half })
    }

    fn texel(self) -> usize {
        match self {
            Self::Floats { components, half } => components * if half { 2 } else { 4 },
            Self::Packed(f) => f.bytes(),
        }
    }

    fn image_bytes(self, (width, height): (usize, usize)) -> usize {
        match self {
            Self::Floats { .. } => width * height * self.texel(),
            Self::Packed(f) => f.image_bytes(width, height),
        }
    }

    fn expand(self, data: &[u8], size: (usize, usize)) -> Vec<f32> {
        let (components, half) = match self {
            Self::Floats { components, half } => (components, half),
            Self::Packed(f) => return f.decode(data, size),
        };
        let mut out = Vec::with_capacity(data.len() / self.texel() * 4);
        for texel in data.chunks_exact(self.texel()) {
            let mut rgba = [0.0, 0.0, 0.0, 1.0];
            for (i, v) in rgba.iter_mut().take(components).enumerate() {
                *v = if half {
                    f16::from_le_bytes([texel[2 * i], texel[2 * i + 1]]).to_f32()
                } else {
                    f32::from_le_bytes([texel[4 * i], texel[4 * i + 1], texel[4 * i + 2], texel[4 * i + 3]])
                };
            }
            out.extend(rgba);
        }
        out
    }
}

/// How the texels of a file that begins with `head` are stored.
pub(crate) fn texels(head: &[u8]) -> Result<TexelStorage, String> {
    let h = Header::parse(head)?;
    let format = match h.format {
        Format::Packed(f) => f.name().into(),
        Format::Floats { components, half } => {
            format!("{}{}", &"rgba"[..components], if half { "16f" } else { "32f" })
        }
    };
    let compression = match h.scheme {
        2 => Some("Zstandard"),
        3 => Some("ZLIB"),
        _ => None,
    };
    Ok(TexelStorage { format, compression })
}

impl Header {
    fn parse(bytes: &[u8]) -> Result<Self, String> {
        if !bytes.starts_with(&IDENTIFIER) {
            return Err("not a KTX2 file: its first bytes are others".into());
        }
        let field = |i: usize| {
            bytes.get(12 + 4 * i..16 + 4 * i).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        };
        if bytes.len() < HEADER_BYTES {
            return Err("truncated in the header".into());
        }
        let f: Vec<u32> = (0..17).filter_map(field).collect();
        if f[4] > 1 || (f[5] > 1 && f[6] > 1) {
            return Err("volumes and arrays of cubes are not read".into());
        }
        if !matches!(f[8], 0 | 2 | 3) {
            let name = if f[8] == 1 { "BasisLZ" } else { "unknown" };
            return Err(format!("{name} supercompression is not read; write the file without it"));
        }
        if !matches!(f[6], 1 | 6) || (f[6] == 6 && f[2] != f[3]) {
            return Err(format!(
                "{} faces of {} x {} texels make neither an image nor a cube",
                f[6], f[2], f[3]
            ));
        }
        Ok(Self {
            format: Format::of(f[0])?,
            width: f[2] as usize,
            height: f[3] as usize,
            faces: (f[6].max(f[5])) as usize,
            layers: f[5] as usize,
            // 0 asks the reader to make the levels itself; the first one is there.
            levels: f[7].max(1) as usize,
            key_values: (f[11] as usize, f[12] as usize),
            scheme: f[8],
        })
    }

    /// The bytes of a level.
    fn level<'a>(&self, bytes: &'a [u8], level: usize, expected: usize) -> Result<Cow<'a, [u8]>, String> {
        let truncated = || format!("truncated: mip level {level} is incomplete");
        let entry = HEADER_BYTES + LEVEL_BYTES * level;
        let number = |i: usize| {
            let b = bytes.get(entry + i..entry + i + 8).and_then(|b| b.try_into().ok())?;
            usize::try_from(u64::from_le_bytes(b)).ok()
        };
        let (start, length) = number(0).zip(number(8)).ok_or_else(truncated)?;
        let wrong = |n: usize| format!("mip level {level} has {n} bytes instead of {expected}");
        if self.scheme == 0 && length != expected {
            return Err(wrong(length));
        }
        let end = start.checked_add(length).ok_or_else(truncated)?;
        let data = bytes.get(start..end).ok_or_else(truncated)?;
        if self.scheme == 0 {
            return Ok(Cow::Borrowed(data));
        }
        let raw = inflate(data, self.scheme, expected)
            .map_err(|e| format!("mip level {level} is damaged: {}", e.replace('\n', " ")))?;
        if raw.len() != expected { Err(wrong(raw.len())) } else { Ok(Cow::Owned(raw)) }
    }
}

/// Decompresses at most one byte more than `expected`.
fn inflate(data: &[u8], scheme: u32, expected: usize) -> Result<Vec<u8>, String> {
    let mut raw = Vec::new();
    let limit = expected as u64 + 1;
    let n = if scheme == 2 {
        let r = ruzstd::decoding::StreamingDecoder::new(data).map_err(|e| e.to_string())?;
        r.take(limit).read_to_end(&mut raw)
    } else {
        flate2::read::ZlibDecoder::new(data).take(limit).read_to_end(&mut raw)
    };
    n.map_err(|e| e.to_string())?;
    Ok(raw)
}

/// What is wrong where [`key_values`] gives nothing.
pub(crate) const DAMAGED: &str = "the key and value data is damaged";

/// Keys and values, as KTX1 and KTX2 have them; those whose value is not text are left out.
pub(crate) fn key_values(mut rest: &[u8]) -> Option<Vec<(String, String)>> {
    let mut pairs = Vec::new();
    while let Some((n, entry)) = rest.split_first_chunk() {
        let n = u32::from_le_bytes(*n) as usize;
        let entry = entry.get(..n)?;
        let key = entry.iter().position(|&b| b == 0)?;
        let value = entry[key + 1..].strip_suffix(&[0]).unwrap_or(&entry[key + 1..]);
        if let (Ok(k), Ok(v)) = (std::str::from_utf8(&entry[..key]), std::str::from_utf8(value)) {
            pairs.push((k.to_string(), v.to_string()));
        }
        rest = rest.get((4 + n).next_multiple_of(4)..).unwrap_or(&[]);
    }
    Some(pairs)
}

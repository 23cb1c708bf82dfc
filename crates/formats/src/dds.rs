//! DDS textures with the DX10 header (Microsoft, *DDS file layout*): images and cubes with mip levels.
//!
//! Faces +X −X +Y −Y +Z −Z, each with all its levels. Refused: arrays, volumes, block compression, files without the
//! DX10 header.

use crate::atomic::write_atomic;
use crate::image::{not_empty, read_bytes};
use crate::ktx2::check;
use crate::texel::TexelFormat;
use crate::{FormatError, Limits, TextureLevels, WriteReport};
use std::io::{self, Write};
use std::path::Path;

const HEADER_BYTES: usize = 148;
/// DDSCAPS2_CUBEMAP and all six faces.
const CUBE: u32 = 0xfe00;

fn dxgi(format: TexelFormat) -> u32 {
    match format {
        TexelFormat::Rgba32f => 2,
        TexelFormat::Rgba16f => 10,
        TexelFormat::R11g11b10 => 26,
        TexelFormat::Rgb9e5 => 67,
    }
}

/// Writes `texture` to `path` in `format`, whole or not at all. Metadata are left out: the format has no room. What
/// does not fit is counted.
pub fn write_dds(
    path: &Path,
    texture: &TextureLevels,
    format: TexelFormat,
) -> Result<WriteReport, FormatError> {
    check(texture).map_err(|why| FormatError::Unwritable { path: path.into(), why })?;
    let mut report = WriteReport::default();
    write_atomic(path, |w| {
        report = encode(w, texture, format)?;
        Ok(())
    })?;
    Ok(report)
}

fn encode(w: &mut dyn Write, t: &TextureLevels, format: TexelFormat) -> io::Result<WriteReport> {
    let cube = t.faces == 6;
    let mut head = [0u32; HEADER_BYTES / 4];
    head[0] = u32::from_le_bytes(*b"DDS ");
    head[1] = 124;
    // CAPS, HEIGHT, WIDTH, PITCH, PIXELFORMAT, MIPMAPCOUNT
    head[2] = 0x1 | 0x2 | 0x4 | 0x8 | 0x1000 | 0x2_0000;
    (head[3], head[4], head[5]) = (t.height as u32, t.width as u32, (t.width * format.bytes()) as u32);
    head[7] = t.levels.len() as u32;
    // Pixel format: 32 bytes, a four-character code, DX10.
    (head[19], head[20], head[21]) = (32, 4, u32::from_le_bytes(*b"DX10"));
    // TEXTURE; with levels or faces COMPLEX, with levels MIPMAP
    head[27] = 0x1000;
    if t.levels.len() > 1 {
        head[27] |= 0x40_0000 | 0x8;
    }
    if cube {
        head[27] |= 0x8;
        head[28] = CUBE;
    }
    // DX10: format, 2D texture, TEXTURECUBE, one element, alpha unknown
    (head[32], head[33], head[34], head[35]) = (dxgi(format), 3, if cube { 4 } else { 0 }, 1);
    head.iter().try_for_each(|v| w.write_all(&v.to_le_bytes()))?;
    let mut report = WriteReport::default();
    let mut raw = Vec::new();
    for face in 0..t.faces {
        for level in &t.levels {
            let n = level.len() / t.faces;
            raw.clear();
            format.encode(&level[face * n..(face + 1) * n], &mut raw, &mut report);
            w.write_all(&raw)?;
        }
    }
    Ok(report)
}

/// Reads the texture `path`.
pub fn read_dds(path: &Path, limits: &Limits) -> Result<TextureLevels, FormatError> {
    decode_dds(path, &read_bytes(path, limits)?, limits)
}

/// Decodes a texture that lies in memory; `name` is for messages.
pub fn decode_dds(name: &Path, bytes: &[u8], limits: &Limits) -> Result<TextureLevels, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    not_empty(name, bytes)?;
    let (format, mut texture, levels) = header(bytes).map_err(invalid)?;
    let (w, h) = (texture.width as u64, texture.height as u64);
    limits.image(name, w, h, 4, bytes.len() as u64)?;
    let floats = u128::from(w) * u128::from(h) * texture.faces as u128 * 8;
    limits.memory(name, floats * 4, bytes.len() as u64)?;
    if levels > TextureLevels::full_chain(texture.width, texture.height) {
        return Err(invalid(format!("{levels} mip levels are too many for its size")));
    }
    texture.levels = vec![Vec::new(); levels];
    let mut at = HEADER_BYTES;
    for _ in 0..texture.faces {
        for level in 0..levels {
            let (w, h) = texture.size(level);
            let end = at + w * h * format.bytes();
            let data = bytes.get(at..end);
            let data = data.ok_or_else(|| invalid(format!("truncated: mip level {level} is incomplete")))?;
            texture.levels[level].extend(format.decode(data));
            at = end;
        }
    }
    Ok(texture)
}

fn header(bytes: &[u8]) -> Result<(TexelFormat, TextureLevels, usize), String> {
    if !bytes.starts_with(b"DDS ") {
        return Err("not a DDS file: its first bytes are others".into());
    }
    if bytes.len() < HEADER_BYTES {
        return Err("truncated in the header".into());
    }
    let f: Vec<u32> =
        bytes[..HEADER_BYTES].chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    if f[21] != u32::from_le_bytes(*b"DX10") {
        return Err("DDS files without the DX10 header are not read".into());
    }
    let found = TexelFormat::ALL.into_iter().find(|t| dxgi(*t) == f[32]);
    let format = found.ok_or_else(|| format!("DXGI format {} is not read", f[32]))?;
    let cube = f[34] & 4 != 0;
    if f[33] != 3 || f[35] > 1 || (cube && (f[3] != f[4] || f[28] & CUBE != CUBE)) {
        return Err("neither an image nor a cube of six square faces".into());
    }
    let texture = TextureLevels {
        width: f[4] as usize,
        height: f[3] as usize,
        faces: if cube { 6 } else { 1 },
        ..TextureLevels::default()
    };
    Ok((format, texture, f[7].max(1) as usize))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_format_comes_back() {
        for faces in [1, 6] {
            let mut t = TextureLevels { width: 4, height: 4, faces, ..TextureLevels::default() };
            for level in 0..3 {
                let texel = |i: usize| [0.5, 2.0f32.powi(i as i32 % 3), [0.25, 6.0][i % 2], 1.0];
                t.levels.push((0..t.level_len(level) / 4).flat_map(texel).collect());
            }
            for format in TexelFormat::ALL {
                let mut bytes = Vec::new();
                assert_eq!(encode(&mut bytes, &t, format).unwrap(), WriteReport::default());
                let back = |b: &[u8]| decode_dds(Path::new("t.dds"), b, &Limits::default());
                assert_eq!(back(&bytes).unwrap(), t, "{format:?}");
                for cut in 0..bytes.len() {
                    assert!(back(&bytes[..cut]).is_err(), "{cut}");
                }
            }
        }
    }
}

//! DDS textures with the DX10 header (Microsoft, *DDS file layout*): images and cubes with mip levels.
//!
//! Faces +X −X +Y −Y +Z −Z, each with all its levels. Refused: arrays, volumes, block compression
//! other than BC6H, and files without the DX10 header but RGBA floats by their D3DFORMAT, as cmft writes.

use crate::atomic::write_atomic;
use crate::image::{not_empty, read_bytes};
use crate::texel::TexelFormat;
use crate::{FormatError, Limits, StoredTexture, TexelStorage, TextureLevels, WriteReport};
use std::io::{self, Write};
use std::path::Path;

const HEADER_BYTES: usize = 148;
/// Of files without the DX10 header.
const LEGACY_BYTES: usize = 128;
/// The four-character code of the DX10 header.
const DX10: u32 = u32::from_le_bytes(*b"DX10");
/// DDSCAPS2_CUBEMAP and all six faces.
const CUBE: u32 = 0xfe00;

fn dxgi(format: TexelFormat) -> u32 {
    match format {
        TexelFormat::Rgba32f => 2,
        TexelFormat::Rgba16f => 10,
        TexelFormat::R11g11b10 => 26,
        TexelFormat::Rgb9e5 => 67,
        TexelFormat::Bc6h => 95,
        TexelFormat::Bc6hSigned => 96,
    }
}

/// Writes `texture` to `path` in `format`, whole or not at all. Metadata are left out: the format has no
/// room. What does not fit is counted.
pub fn write_dds(
    path: &Path,
    texture: &TextureLevels,
    format: TexelFormat,
) -> Result<WriteReport, FormatError> {
    StoredTexture::new(path, texture, format)?.write_dds(path)
}

impl StoredTexture {
    /// Writes a DDS file, as [`write_dds`].
    pub fn write_dds(&self, path: &Path) -> Result<WriteReport, FormatError> {
        write_atomic(path, |w| encode(w, self))?;
        Ok(self.report())
    }
}

fn encode(w: &mut dyn Write, t: &StoredTexture) -> io::Result<()> {
    let format = t.format;
    let cube = t.faces == 6;
    let mut head = [0u32; HEADER_BYTES / 4];
    head[0] = u32::from_le_bytes(*b"DDS ");
    head[1] = 124;
    // CAPS, HEIGHT, WIDTH, PIXELFORMAT, MIPMAPCOUNT; PITCH of a row, or of blocks LINEARSIZE of the image
    head[2] = 0x1 | 0x2 | 0x4 | 0x1000 | 0x2_0000 | if format.is_plain() { 0x8 } else { 0x8_0000 };
    let pitch = format.image_bytes(t.width, if format.is_plain() { 1 } else { t.height });
    (head[3], head[4], head[5]) = (t.height as u32, t.width as u32, pitch as u32);
    head[7] = t.levels.len() as u32;
    // Pixel format: 32 bytes, a four-character code, DX10.
    (head[19], head[20], head[21]) = (32, 4, DX10);
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
    for face in 0..t.faces {
        for level in &t.levels {
            let n = level.len() / t.faces;
            w.write_all(&level[face * n..(face + 1) * n])?;
        }
    }
    Ok(())
}

/// Reads the texture `path`.
pub fn read_dds(path: &Path, limits: &Limits) -> Result<TextureLevels, FormatError> {
    decode_dds(path, &read_bytes(path, limits)?, limits)
}

/// Decodes a texture that lies in memory; `name` is for messages.
pub fn decode_dds(name: &Path, bytes: &[u8], limits: &Limits) -> Result<TextureLevels, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    not_empty(name, bytes)?;
    let (format, mut texture, levels, start) = header(bytes).map_err(invalid)?;
    limits.texture(name, &texture, levels, bytes.len() as u64)?;
    texture.levels = vec![Vec::new(); levels];
    let mut at = start;
    for _ in 0..texture.faces {
        for level in 0..levels {
            let (w, h) = texture.size(level);
            let end = at + format.image_bytes(w, h);
            let data = bytes.get(at..end);
            let data = data.ok_or_else(|| invalid(format!("truncated: mip level {level} is incomplete")))?;
            texture.levels[level].extend(format.decode(data, (w, h)));
            at = end;
        }
    }
    Ok(texture)
}

/// Format, shape, number of levels, and where the texels begin.
fn header(bytes: &[u8]) -> Result<(TexelFormat, TextureLevels, usize, usize), String> {
    if !bytes.starts_with(b"DDS ") {
        return Err("not a DDS file: its first bytes are others".into());
    }
    if bytes.len() < LEGACY_BYTES {
        return Err("truncated in the header".into());
    }
    let words = bytes[..bytes.len().min(HEADER_BYTES)].chunks_exact(4);
    let f: Vec<u32> = words.map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let cube_caps = f[28] & CUBE == CUBE;
    let (format, cube, start) = match f[21] {
        DX10 if f.len() < HEADER_BYTES / 4 => return Err("truncated in the header".into()),
        DX10 => {
            let found = TexelFormat::ALL.into_iter().find(|t| dxgi(*t) == f[32]);
            let cube = f[34] & 4 != 0;
            if f[33] != 3 || f[35] > 1 || (cube && !cube_caps) {
                return Err("neither an image nor a cube of six square faces".into());
            }
            (found.ok_or_else(|| format!("DXGI format {} is not read", f[32]))?, cube, HEADER_BYTES)
        }
        // D3DFMT_A16B16G16R16F and D3DFMT_A32B32G32R32F stand in place of a four-character code.
        113 if f[20] & 4 != 0 => (TexelFormat::Rgba16f, cube_caps, LEGACY_BYTES),
        116 if f[20] & 4 != 0 => (TexelFormat::Rgba32f, cube_caps, LEGACY_BYTES),
        _ => return Err("DDS files without the DX10 header are read where they hold RGBA floats only".into()),
    };
    if (cube && f[3] != f[4]) || (!cube && f[28] != 0) {
        return Err("neither an image nor a cube of six square faces".into());
    }
    let texture = TextureLevels {
        width: f[4] as usize,
        height: f[3] as usize,
        faces: if cube { 6 } else { 1 },
        ..TextureLevels::default()
    };
    Ok((format, texture, f[7].max(1) as usize, start))
}

/// How the texels of a file that begins with `head` are stored.
pub(crate) fn texels(head: &[u8]) -> Result<TexelStorage, String> {
    Ok(TexelStorage { format: header(head)?.0.name().into(), compression: None })
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
                // Blocks keep what one line holds.
                let mut t = t.clone();
                if !format.is_plain() {
                    let values = t.levels.iter_mut().flatten().enumerate();
                    values.for_each(|(i, v)| *v = [0.5, 2.0, 0.25, 1.0][i % 4]);
                }
                let mut bytes = Vec::new();
                let stored = StoredTexture::encode(&t, format);
                assert_eq!(stored.report(), WriteReport::default());
                encode(&mut bytes, &stored).unwrap();
                let back = |b: &[u8]| decode_dds(Path::new("t.dds"), b, &Limits::default());
                assert_eq!(back(&bytes).unwrap(), t, "{format:?}");
                for cut in 0..bytes.len() {
                    assert!(back(&bytes[..cut]).is_err(), "{cut}");
                }
            }
        }
    }

    #[test]
    fn float_formats_are_read_without_the_dx10_header() {
        let mut t = TextureLevels { width: 2, height: 2, faces: 6, ..TextureLevels::default() };
        t.levels = vec![(0..96).map(|i| i as f32 * 0.25).collect(), vec![2.0; 24]];
        for (format, code) in [(TexelFormat::Rgba16f, 113u8), (TexelFormat::Rgba32f, 116)] {
            let mut bytes = Vec::new();
            encode(&mut bytes, &StoredTexture::encode(&t, format)).unwrap();
            bytes.drain(LEGACY_BYTES..HEADER_BYTES);
            bytes[84..88].copy_from_slice(&[code, 0, 0, 0]);
            let back = |b: &[u8]| decode_dds(Path::new("t.dds"), b, &Limits::default());
            assert_eq!(back(&bytes).unwrap(), t);
            for cut in 0..bytes.len() {
                assert!(back(&bytes[..cut]).is_err(), "{cut}");
            }
        }
    }
}

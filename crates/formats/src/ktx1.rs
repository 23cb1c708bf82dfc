//! KTX1 textures (Khronos KTX File Format Specification, version 1): what Filament reads.
//!
//! Little endian, float and packed formats, one image or six faces, mip levels. Refused: arrays, volumes,
//! compressed formats other than BC6H, big-endian files.

use crate::atomic::write_atomic;
use crate::image::{not_empty, read_bytes};
use crate::ktx2::{DAMAGED, key_values};
use crate::texel::TexelFormat;
use crate::{FormatError, Limits, StoredTexture, TexelStorage, TextureLevels, WriteReport};
use std::io::{self, Write};
use std::path::Path;

const IDENTIFIER: [u8; 12] = *b"\xabKTX 11\xbb\r\n\x1a\n";
const HEADER_BYTES: usize = 64;

/// GL_R11F_G11F_B10F: the type of cmgen's files, and the only one for this format that Filament's reader
/// knows (`Ktx1Reader`).
const PACKED: u32 = 0x8c3a;
/// GL_UNSIGNED_INT_10F_11F_11F_REV: the type that the specification has.
const PACKED_REV: u32 = 0x8c3b;

/// glType, glTypeSize, glFormat, glInternalFormat.
fn numbers(format: TexelFormat) -> [u32; 4] {
    const RGB: u32 = 0x1907;
    const RGBA: u32 = 0x1908;
    match format {
        TexelFormat::Rgba16f => [0x140b, 2, RGBA, 0x881a],
        TexelFormat::Rgba32f => [0x1406, 4, RGBA, 0x8814],
        TexelFormat::Rgb9e5 => [0x8c3e, 4, RGB, 0x8c3d],
        TexelFormat::R11g11b10 => [PACKED, 4, RGB, PACKED],
        // Blocks have neither type nor format.
        TexelFormat::Bc6h => [0, 1, 0, 0x8e8f],
        TexelFormat::Bc6hSigned => [0, 1, 0, 0x8e8e],
    }
}

/// Writes `texture` to `path` in `format`, whole or not at all. What does not fit the format is counted.
pub fn write_ktx1(
    path: &Path,
    texture: &TextureLevels,
    format: TexelFormat,
) -> Result<WriteReport, FormatError> {
    StoredTexture::new(path, texture, format)?.write_ktx1(path)
}

impl StoredTexture {
    /// Writes a KTX1 file, as [`write_ktx1`].
    pub fn write_ktx1(&self, path: &Path) -> Result<WriteReport, FormatError> {
        write_atomic(path, |w| encode(w, self))?;
        Ok(self.report())
    }
}

fn encode(w: &mut dyn Write, t: &StoredTexture) -> io::Result<()> {
    let format = t.format;
    let mut kvd = Vec::new();
    for (k, v) in t.metadata.iter().filter(|(k, _)| !k.is_empty() && !k.contains('\0')) {
        kvd.extend(((k.len() + v.len() + 2) as u32).to_le_bytes());
        kvd.extend(k.bytes().chain([0]).chain(v.bytes()).chain([0]));
        kvd.resize(kvd.len().next_multiple_of(4), 0);
    }
    let [gl_type, type_size, gl_format, internal] = numbers(format);
    let base = if format.is_plain() { gl_format } else { 0x1907 };
    let size = [t.width as u32, t.height as u32, 0, 0, t.faces as u32, t.levels.len() as u32];
    let mut head = IDENTIFIER.to_vec();
    let fields = [0x0403_0201, gl_type, type_size, gl_format, internal, base];
    fields.iter().chain(&size).chain(&[kvd.len() as u32]).for_each(|v| head.extend(v.to_le_bytes()));
    w.write_all(&head)?;
    w.write_all(&kvd)?;
    for level in &t.levels {
        // Of a cube the size of one face; texels are multiples of four bytes, so nothing is padded.
        w.write_all(&((level.len() / t.faces) as u32).to_le_bytes())?;
        w.write_all(level)?;
    }
    Ok(())
}

/// Reads the texture `path`.
pub fn read_ktx1(path: &Path, limits: &Limits) -> Result<TextureLevels, FormatError> {
    decode_ktx1(path, &read_bytes(path, limits)?, limits)
}

/// Decodes a texture that lies in memory; `name` is for messages.
pub fn decode_ktx1(name: &Path, bytes: &[u8], limits: &Limits) -> Result<TextureLevels, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    not_empty(name, bytes)?;
    let (format, mut texture, levels) = header(bytes).map_err(invalid)?;
    limits.texture(name, &texture, levels, bytes.len() as u64)?;
    let start = HEADER_BYTES + word(bytes, 60).unwrap_or(0) as usize;
    let pairs = bytes.get(HEADER_BYTES..start).ok_or_else(|| invalid("truncated in the metadata".into()))?;
    texture.metadata = key_values(pairs).ok_or_else(|| invalid(DAMAGED.into()))?;
    let mut at = start;
    for level in 0..levels {
        let (w, h) = texture.size(level);
        let size = format.image_bytes(w, h) * texture.faces;
        let stated = word(bytes, at).map(|n| n as usize * texture.faces);
        let data = at.checked_add(4 + size).and_then(|end| bytes.get(at + 4..end));
        match (stated, data) {
            (Some(n), _) if n != size => {
                return Err(invalid(format!("mip level {level} has {n} bytes instead of {size}")));
            }
            (Some(_), Some(data)) => texture.levels.push(format.decode(data, (w, h))),
            _ => return Err(invalid(format!("truncated: mip level {level} is incomplete"))),
        }
        at += 4 + size;
    }
    Ok(texture)
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at.checked_add(4)?).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
}

fn header(bytes: &[u8]) -> Result<(TexelFormat, TextureLevels, usize), String> {
    if !bytes.starts_with(&IDENTIFIER) {
        return Err("not a KTX1 file: its first bytes are others".into());
    }
    let f: Vec<u32> = (0..13).filter_map(|i| word(bytes, 12 + 4 * i)).collect();
    if f.len() < 13 {
        return Err("truncated in the header".into());
    }
    if f[0] != 0x0403_0201 {
        return Err("big-endian KTX1 files are not read".into());
    }
    // cmgen before Filament 1.8.1 wrote the sized format as glFormat too.
    let (kind, order) = if f[4] == PACKED && matches!(f[1], PACKED | PACKED_REV) && f[3] == PACKED {
        (PACKED, 0x1907)
    } else {
        (if f[1] == PACKED_REV { PACKED } else { f[1] }, f[3])
    };
    let same = |t: &TexelFormat| {
        let n = numbers(*t);
        n[0] == kind && n[2] == order && (t.is_plain() || n[3] == f[4])
    };
    let found = TexelFormat::ALL.into_iter().find(same);
    let format = found.ok_or_else(|| format!("glType {:#x} with glFormat {:#x} is not read", f[1], f[3]))?;
    if f[8] > 1 || f[9] > 0 || !matches!(f[10], 1 | 6) || (f[10] == 6 && f[6] != f[7]) {
        return Err("neither an image nor a cube of square faces".into());
    }
    let texture = TextureLevels {
        width: f[6] as usize,
        height: f[7] as usize,
        faces: f[10] as usize,
        ..TextureLevels::default()
    };
    Ok((format, texture, f[11].max(1) as usize))
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
        let mut t = TextureLevels { width: 4, height: 4, faces: 6, ..TextureLevels::default() };
        for level in 0..2 {
            let texel = |i: usize| [0.5, 2.0, [0.25, 96.0][i % 2], 1.0];
            t.levels.push((0..t.level_len(level) / 4).flat_map(texel).collect());
        }
        t.metadata = vec![("sh".into(), "1 2 3\n4 5 6\n".into())];
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
            let back = |b: &[u8]| decode_ktx1(Path::new("t.ktx"), b, &Limits::default());
            assert_eq!(back(&bytes).unwrap(), t, "{format:?}");
            for cut in 0..bytes.len() {
                assert!(back(&bytes[..cut]).is_err(), "{cut}");
            }
        }
    }

    #[test]
    fn the_header_is_what_filament_reads() {
        let t =
            TextureLevels { width: 1, height: 1, faces: 6, levels: vec![vec![1.0; 24]], metadata: vec![] };
        let mut bytes = Vec::new();
        encode(&mut bytes, &StoredTexture::encode(&t, TexelFormat::R11g11b10)).unwrap();
        let words: Vec<u32> = (0..14).map(|i| word(&bytes, 12 + 4 * i).unwrap()).collect();
        assert_eq!(words, [0x4030201, 0x8c3a, 4, 0x1907, 0x8c3a, 0x1907, 1, 1, 0, 0, 6, 1, 0, 4]);
        assert_eq!(bytes.len(), 64 + 4 + 6 * 4);
        // The specification's type, and what cmgen wrote before Filament 1.8.1.
        for (kind, format) in [(0x3b, [0x07, 0x19]), (0x3a, [0x3a, 0x8c])] {
            bytes[16] = kind;
            bytes[24..26].copy_from_slice(&format);
            assert_eq!(decode_ktx1(Path::new("t.ktx"), &bytes, &Limits::default()).unwrap().levels, t.levels);
        }
    }
}

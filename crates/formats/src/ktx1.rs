//! KTX1 textures (Khronos KTX File Format Specification, version 1): what Filament reads.
//!
//! Little endian, float and packed formats, one image or six faces, mip levels. Refused: arrays, volumes, compressed
//! formats other than BC6H, big-endian files.

use crate::atomic::write_atomic;
use crate::image::{not_empty, read_bytes};
use crate::ktx2::check;
use crate::texel::TexelFormat;
use crate::{FormatError, Limits, TextureLevels, WriteReport};
use std::io::{self, Write};
use std::path::Path;

const IDENTIFIER: [u8; 12] = *b"\xabKTX 11\xbb\r\n\x1a\n";
const HEADER_BYTES: usize = 64;

/// glType, glTypeSize, glFormat, glInternalFormat.
fn numbers(format: TexelFormat) -> [u32; 4] {
    const RGB: u32 = 0x1907;
    const RGBA: u32 = 0x1908;
    match format {
        TexelFormat::Rgba16f => [0x140b, 2, RGBA, 0x881a],
        TexelFormat::Rgba32f => [0x1406, 4, RGBA, 0x8814],
        TexelFormat::Rgb9e5 => [0x8c3e, 4, RGB, 0x8c3d],
        TexelFormat::R11g11b10 => [0x8c3b, 4, RGB, 0x8c3a],
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
    check(texture).map_err(|why| FormatError::Unwritable { path: path.into(), why })?;
    let mut report = WriteReport::default();
    write_atomic(path, |w| {
        report = encode(w, texture, format)?;
        Ok(())
    })?;
    Ok(report)
}

fn encode(w: &mut dyn Write, t: &TextureLevels, format: TexelFormat) -> io::Result<WriteReport> {
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
    let mut report = WriteReport::default();
    for (i, level) in t.levels.iter().enumerate() {
        let mut raw = Vec::new();
        format.encode(level, t.size(i), &mut raw, &mut report);
        // Of a cube the size of one face; texels are multiples of four bytes, so nothing is padded.
        w.write_all(&((raw.len() / t.faces) as u32).to_le_bytes())?;
        w.write_all(&raw)?;
    }
    Ok(report)
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
    let (w, h) = (texture.width as u64, texture.height as u64);
    limits.image(name, w, h, 4, bytes.len() as u64)?;
    let floats = u128::from(w) * u128::from(h) * texture.faces as u128 * 8;
    limits.memory(name, floats * 4, bytes.len() as u64)?;
    if levels > TextureLevels::full_chain(texture.width, texture.height) {
        return Err(invalid(format!("{levels} mip levels are too many for its size")));
    }
    let start = HEADER_BYTES + word(bytes, 60).unwrap_or(0) as usize;
    let pairs = bytes.get(HEADER_BYTES..start).ok_or_else(|| invalid("truncated in the metadata".into()))?;
    texture.metadata = key_values(pairs).map_err(invalid)?;
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
    let same = |t: &TexelFormat| {
        let n = numbers(*t);
        n[0] == f[1] && n[2] == f[3] && (t.is_plain() || n[3] == f[4])
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

fn key_values(mut rest: &[u8]) -> Result<Vec<(String, String)>, String> {
    let fault = || "the key and value data is damaged".to_string();
    let mut pairs = Vec::new();
    while let Some(n) = word(rest, 0) {
        let entry = (n as usize).checked_add(4).and_then(|end| rest.get(4..end)).ok_or_else(fault)?;
        let key = entry.iter().position(|&b| b == 0).ok_or_else(fault)?;
        let value = entry[key + 1..].strip_suffix(&[0]).unwrap_or(&entry[key + 1..]);
        if let (Ok(k), Ok(v)) = (std::str::from_utf8(&entry[..key]), std::str::from_utf8(value)) {
            pairs.push((k.to_string(), v.to_string()));
        }
        rest = rest.get((4 + n as usize).next_multiple_of(4)..).unwrap_or(&[]);
    }
    Ok(pairs)
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
            assert_eq!(encode(&mut bytes, &t, format).unwrap(), WriteReport::default());
            let back = |b: &[u8]| decode_ktx1(Path::new("t.ktx"), b, &Limits::default());
            assert_eq!(back(&bytes).unwrap(), t, "{format:?}");
            for cut in 0..bytes.len() {
                assert!(back(&bytes[..cut]).is_err(), "{cut}");
            }
        }
    }

    #[test]
    fn the_header_is_the_specification_s() {
        let t =
            TextureLevels { width: 1, height: 1, faces: 6, levels: vec![vec![1.0; 24]], metadata: vec![] };
        let mut bytes = Vec::new();
        encode(&mut bytes, &t, TexelFormat::R11g11b10).unwrap();
        let words: Vec<u32> = (0..14).map(|i| word(&bytes, 12 + 4 * i).unwrap()).collect();
        assert_eq!(words, [0x4030201, 0x8c3b, 4, 0x1907, 0x8c3a, 0x1907, 1, 1, 0, 0, 6, 1, 0, 4]);
        assert_eq!(bytes.len(), 64 + 4 + 6 * 4);
    }
}

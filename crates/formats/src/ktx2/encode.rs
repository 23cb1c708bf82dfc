//! Textures to KTX2.

use super::{HEADER_BYTES, IDENTIFIER, LEVEL_BYTES, TextureLevels};
use crate::FormatError;
use crate::atomic::write_atomic;
use crate::image::WriteReport;
use half::f16;
use std::io::{self, Write};
use std::path::Path;

/// Writes `texture` to `path` with 16- or 32-bit floats, whole or not at all. `texture.metadata` becomes key and
/// value data. Values that are not finite are refused; halves beyond 65504 clip and are counted.
pub fn write_ktx2(path: &Path, texture: &TextureLevels, half: bool) -> Result<WriteReport, FormatError> {
    check(texture).map_err(|why| FormatError::Unwritable { path: path.into(), why })?;
    let mut report = WriteReport::default();
    write_atomic(path, |w| {
        report = encode(w, texture, half)?;
        Ok(())
    })?;
    Ok(report)
}

fn check(t: &TextureLevels) -> Result<(), String> {
    if t.width == 0 || t.height == 0 || t.levels.is_empty() {
        return Err("the texture is empty".into());
    }
    if !(t.faces == 1 || (t.faces == 6 && t.width == t.height)) {
        return Err("a texture has one face, or six square ones".into());
    }
    if t.levels.len() > TextureLevels::full_chain(t.width, t.height)
        || u32::try_from(t.width.max(t.height)).is_err()
    {
        return Err(format!("{} levels are too many for {} x {} texels", t.levels.len(), t.width, t.height));
    }
    for (i, level) in t.levels.iter().enumerate() {
        if level.len() != t.level_len(i) {
            return Err(format!("level {i} has {} numbers instead of {}", level.len(), t.level_len(i)));
        }
        if let Some(at) = level.iter().position(|v| !v.is_finite()) {
            let (w, h) = t.size(i);
            let texel = at / 4;
            let (x, y, face) = (texel % w, texel / w % h, texel / (w * h));
            return Err(format!("level {i}, face {face}, texel ({x}, {y}) is not finite"));
        }
    }
    Ok(())
}

fn encode(w: &mut dyn Write, t: &TextureLevels, half: bool) -> io::Result<WriteReport> {
    let texel = if half { 8 } else { 16 };
    let dfd = descriptor(half);
    let kvd = key_values(&t.metadata);
    let dfd_at = HEADER_BYTES + LEVEL_BYTES * t.levels.len();
    let kvd_at = dfd_at + dfd.len();
    let mut head = IDENTIFIER.to_vec();
    // VK_FORMAT_R16G16B16A16_SFLOAT, VK_FORMAT_R32G32B32A32_SFLOAT.
    let (format, type_size) = if half { (97, 2) } else { (109, 4) };
    let fields = [format, type_size, t.width, t.height, 0, 0, t.faces, t.levels.len(), 0];
    let index = [dfd_at, dfd.len(), kvd_at, kvd.len()];
    fields.iter().chain(&index).for_each(|v| head.extend((*v as u32).to_le_bytes()));
    // No supercompression data.
    head.extend([0; 16]);
    // The smallest level comes first in the file; the index is in order of levels.
    let bytes = |level: usize| t.level_len(level) / 4 * texel;
    let mut at = (kvd_at + kvd.len()).next_multiple_of(texel);
    let padding = at - (kvd_at + kvd.len());
    let mut offsets = vec![0; t.levels.len()];
    for level in (0..t.levels.len()).rev() {
        offsets[level] = at;
        at += bytes(level);
    }
    for (level, offset) in offsets.iter().enumerate() {
        [*offset, bytes(level), bytes(level)].iter().for_each(|v| head.extend((*v as u64).to_le_bytes()));
    }
    w.write_all(&head)?;
    w.write_all(&dfd)?;
    w.write_all(&kvd)?;
    w.write_all(&vec![0; padding])?;
    let mut report = WriteReport::default();
    for level in t.levels.iter().rev() {
        write_level(w, level, half, &mut report)?;
    }
    Ok(report)
}

fn write_level(w: &mut dyn Write, level: &[f32], half: bool, report: &mut WriteReport) -> io::Result<()> {
    if !half {
        return level.iter().try_for_each(|v| w.write_all(&v.to_le_bytes()));
    }
    level.iter().try_for_each(|&v| {
        let mut h = f16::from_f32(v);
        if h.is_infinite() {
            h = f16::MAX.copysign(h);
            report.clip(v.into(), h.into());
        }
        w.write_all(&h.to_le_bytes())
    })
}

/// The basic descriptor block (Khronos Data Format Specification 1.3, table 5.1): four signed float samples of
/// linear Rec. 709, range −1 … 1.
fn descriptor(half: bool) -> Vec<u8> {
    let bits: u16 = if half { 16 } else { 32 };
    let block: u16 = 24 + 4 * 16;
    let mut d = u32::from(block + 4).to_le_bytes().to_vec();
    d.extend([0; 4]); // vendor Khronos, basic format
    d.extend(2u16.to_le_bytes()); // version 1.3
    d.extend(block.to_le_bytes());
    d.extend([1, 1, 1, 0]); // RGBSDA, BT.709, linear, straight alpha
    d.extend([0; 4]); // texel blocks of 1 × 1 × 1 × 1
    d.extend([(bits / 2) as u8, 0, 0, 0, 0, 0, 0, 0]); // bytes of plane 0
    for (i, channel) in [0u8, 1, 2, 15].into_iter().enumerate() {
        d.extend((i as u16 * bits).to_le_bytes());
        d.push((bits - 1) as u8);
        d.push(channel | 0x80 | 0x40); // float, signed
        d.extend([0; 4]);
        d.extend((-1f32).to_le_bytes());
        d.extend(1f32.to_le_bytes());
    }
    d
}

/// Entries sorted by key, each padded to four bytes.
fn key_values(metadata: &[(String, String)]) -> Vec<u8> {
    let mut pairs: Vec<(&str, &str)> =
        vec![("KTXorientation", "rd"), ("KTXwriter", concat!("Steradian ", env!("CARGO_PKG_VERSION")))];
    for (k, v) in metadata {
        if !k.is_empty() && !k.contains('\0') && !pairs.iter().any(|(known, _)| known == k) {
            pairs.push((k, v));
        }
    }
    pairs.sort();
    let mut out = Vec::new();
    for (k, v) in pairs {
        let length = k.len() + v.len() + 2;
        out.extend((length as u32).to_le_bytes());
        out.extend(k.bytes().chain([0]).chain(v.bytes()).chain([0]));
        out.resize(out.len().next_multiple_of(4), 0);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Limits, decode_ktx2};

    fn texture(faces: usize) -> TextureLevels {
        let mut t = TextureLevels { width: 5, height: 5, faces, ..TextureLevels::default() };
        for level in 0..3 {
            t.levels.push((0..t.level_len(level)).map(|i| i as f32 * 0.25 - 3.0 * level as f32).collect());
        }
        t.metadata.push(("steradian.version".into(), "ε".into()));
        t
    }

    fn bytes(t: &TextureLevels, half: bool) -> (Vec<u8>, WriteReport) {
        let mut b = Vec::new();
        let report = encode(&mut b, t, half).unwrap();
        (b, report)
    }

    #[test]
    fn textures_come_back() {
        for faces in [1, 6] {
            for half in [false, true] {
                let t = texture(faces);
                let (b, report) = bytes(&t, half);
                let back = decode_ktx2(Path::new("t.ktx2"), &b, &Limits::default()).unwrap();
                assert_eq!(back.levels, t.levels);
                assert_eq!((back.width, back.height, back.faces), (5, 5, faces));
                assert_eq!(back.get("steradian.version"), Some("ε"));
                assert_eq!(back.get("KTXorientation"), Some("rd"));
                assert_eq!(report.clipped, 0);
            }
        }
    }

    #[test]
    fn the_layout_is_the_specification_s() {
        let (b, _) = bytes(&texture(1), false);
        let u32_at = |i: usize| u32::from_le_bytes(b[i..i + 4].try_into().unwrap());
        let u64_at = |i: usize| u64::from_le_bytes(b[i..i + 8].try_into().unwrap());
        assert_eq!((u32_at(12), u32_at(16), u32_at(20), u32_at(36), u32_at(40)), (109, 4, 5, 1, 3));
        assert_eq!((u32_at(48) as usize, u32_at(52)), (80 + 3 * 24, 92));
        // Levels are aligned to their texels and the smallest comes first.
        let offsets: Vec<u64> = (0..3).map(|l| u64_at(80 + 24 * l)).collect();
        assert!(offsets.iter().all(|o| o % 16 == 0));
        assert!(offsets[2] < offsets[1] && offsets[1] < offsets[0]);
        assert_eq!(offsets[0] + u64_at(88), b.len() as u64);
        assert_eq!(u32_at(56) % 4, 0);
    }

    #[test]
    fn halves_clip_and_bad_textures_are_refused() {
        let mut t = texture(1);
        t.levels[0][0] = -1e6;
        assert_eq!(bytes(&t, true).1, WriteReport { clipped: 1, lost: 1e6 - 65504.0 });
        t.levels[1][5] = f32::NAN;
        assert_eq!(check(&t).unwrap_err(), "level 1, face 0, texel (1, 0) is not finite");
        t.levels[1].pop();
        assert!(check(&t).unwrap_err().contains("level 1 has 15 numbers instead of 16"));
        t.faces = 2;
        assert!(check(&t).is_err());
    }
}

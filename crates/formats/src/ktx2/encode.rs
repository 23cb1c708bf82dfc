//! Textures to KTX2.

use super::{HEADER_BYTES, IDENTIFIER, LEVEL_BYTES, TextureLevels};
use crate::atomic::write_atomic;
use crate::image::WriteReport;
use crate::texel::TexelFormat;
use crate::{FormatError, StoredTexture};
use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

/// Lossless compression of a whole level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Supercompression {
    /// None.
    #[default]
    None,
    /// Zstandard, level 1: quick, and read by every loader that reads supercompressed files.
    Zstd,
    /// ZLIB, level 6.
    Zlib,
}

impl Supercompression {
    fn scheme(self) -> usize {
        match self {
            Self::None => 0,
            Self::Zstd => 2,
            Self::Zlib => 3,
        }
    }

    fn apply(self, raw: &[u8]) -> io::Result<Cow<'_, [u8]>> {
        Ok(match self {
            Self::None => Cow::Borrowed(raw),
            Self::Zstd => {
                ruzstd::encoding::compress_to_vec(raw, ruzstd::encoding::CompressionLevel::Fastest).into()
            }
            Self::Zlib => {
                let mut w = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::new(6));
                w.write_all(raw)?;
                w.finish()?.into()
            }
        })
    }
}

/// Writes `texture` to `path` with 16- or 32-bit floats, whole or not at all. `texture.metadata` becomes key
/// and value data. Values that are not finite are refused; halves beyond 65504 clip and are counted.
pub fn write_ktx2(path: &Path, texture: &TextureLevels, half: bool) -> Result<WriteReport, FormatError> {
    let format = if half { TexelFormat::Rgba16f } else { TexelFormat::Rgba32f };
    write_ktx2_as(path, texture, format, Supercompression::None)
}

/// [`write_ktx2`] in any texel format, compressed or not. What does not fit the format is counted.
pub fn write_ktx2_as(
    path: &Path,
    texture: &TextureLevels,
    format: TexelFormat,
    compression: Supercompression,
) -> Result<WriteReport, FormatError> {
    StoredTexture::new(path, texture, format)?.write_ktx2(path, compression)
}

impl StoredTexture {
    /// Writes a KTX2 file, as [`write_ktx2_as`].
    pub fn write_ktx2(&self, path: &Path, compression: Supercompression) -> Result<WriteReport, FormatError> {
        self.write_layers(path, 0, compression)
    }

    /// Writes an array of `layers` images, which lie where faces do, unless there are 0.
    pub(super) fn write_layers(
        &self,
        path: &Path,
        layers: usize,
        compression: Supercompression,
    ) -> Result<WriteReport, FormatError> {
        write_atomic(path, |w| encode(w, self, layers, compression))?;
        Ok(self.report())
    }
}

/// Is the texture whole and finite?
pub(crate) fn check(t: &TextureLevels) -> Result<(), String> {
    if !(t.faces == 1 || (t.faces == 6 && t.width == t.height)) {
        return Err("a texture has one face, or six square ones".into());
    }
    check_levels(t)
}

/// [`check`] for any number of faces.
pub(crate) fn check_levels(t: &TextureLevels) -> Result<(), String> {
    if t.width == 0 || t.height == 0 || t.faces == 0 || t.levels.is_empty() {
        return Err("the texture is empty".into());
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

fn encode(
    w: &mut dyn Write,
    t: &StoredTexture,
    layers: usize,
    compression: Supercompression,
) -> io::Result<()> {
    let format = t.format;
    let levels: Vec<Cow<'_, [u8]>> =
        t.levels.iter().map(|raw| compression.apply(raw)).collect::<io::Result<_>>()?;
    let dfd = descriptor(format);
    let kvd = key_values(&t.metadata);
    let dfd_at = HEADER_BYTES + LEVEL_BYTES * t.levels.len();
    let kvd_at = dfd_at + dfd.len();
    let mut head = IDENTIFIER.to_vec();
    let (vk, type_size) = numbers(format);
    let faces = if layers > 0 { 1 } else { t.faces };
    let fields = [vk, type_size, t.width, t.height, 0, layers, faces, t.levels.len(), compression.scheme()];
    let index = [dfd_at, dfd.len(), kvd_at, kvd.len()];
    fields.iter().chain(&index).for_each(|v| head.extend((*v as u32).to_le_bytes()));
    // No supercompression data.
    head.extend([0; 16]);
    // The smallest level comes first in the file; the index is in order of levels. Compressed levels need no
    // alignment.
    let align = if compression == Supercompression::None { format.bytes() } else { 1 };
    let mut at = (kvd_at + kvd.len()).next_multiple_of(align);
    let padding = at - (kvd_at + kvd.len());
    let mut offsets = vec![0; levels.len()];
    for (level, bytes) in levels.iter().enumerate().rev() {
        offsets[level] = at;
        at += bytes.len();
    }
    for (level, offset) in offsets.iter().enumerate() {
        [*offset, levels[level].len(), t.levels[level].len()]
            .iter()
            .for_each(|v| head.extend((*v as u64).to_le_bytes()));
    }
    w.write_all(&head)?;
    w.write_all(&dfd)?;
    w.write_all(&kvd)?;
    w.write_all(&vec![0; padding])?;
    levels.iter().rev().try_for_each(|level| w.write_all(level))
}

/// The VkFormat and the size of its type.
fn numbers(format: TexelFormat) -> (usize, usize) {
    match format {
        TexelFormat::Rgba16f => (97, 2),
        TexelFormat::Rgba32f => (109, 4),
        TexelFormat::R11g11b10 => (122, 4),
        TexelFormat::Rgb9e5 => (123, 4),
        TexelFormat::Bc6h => (143, 1),
        TexelFormat::Bc6hSigned => (144, 1),
    }
}

/// One sample of a descriptor: first bit, bits, channel with qualifiers, lower and upper.
type Bits = (u16, u16, u8, u32, u32);

/// The basic descriptor block (Khronos Data Format Specification 1.3, table 5.1 and the examples of sections
/// 5.20 and 10): linear Rec. 709.
fn descriptor(format: TexelFormat) -> Vec<u8> {
    const FLOAT: u8 = 0x80;
    const SIGNED: u8 = 0x40;
    const EXPONENT: u8 = 0x20;
    let (one, minus) = (1f32.to_bits(), (-1f32).to_bits());
    let wide = |bits: u16| -> Vec<Bits> {
        let sample = |(i, c): (u16, u8)| (i * bits, bits, c | FLOAT | SIGNED, minus, one);
        (0..4).zip([0, 1, 2, 15]).map(sample).collect()
    };
    let samples: Vec<Bits> = match format {
        TexelFormat::Rgba16f => wide(16),
        TexelFormat::Rgba32f => wide(32),
        TexelFormat::R11g11b10 => {
            vec![(0, 11, FLOAT, 0, one), (11, 11, 1 | FLOAT, 0, one), (22, 10, 2 | FLOAT, 0, one)]
        }
        // Mantissa and exponent of each channel; 8448 is the mantissa of 1.0 as the specification counts.
        TexelFormat::Rgb9e5 => (0..3u8)
            .flat_map(|c| [(9 * u16::from(c), 9, c, 0, 8448), (27, 5, c | EXPONENT, 15, 31)])
            .collect(),
        TexelFormat::Bc6h => vec![(0, 128, FLOAT, 0, one)],
        TexelFormat::Bc6hSigned => vec![(0, 128, FLOAT | SIGNED, minus, one)],
    };
    // RGBSDA or BC6H, and texels of a block less one per axis.
    let (model, side) = if format.is_plain() { (1, 0) } else { (133, 3) };
    let block = 24 + 16 * samples.len() as u16;
    let mut d = u32::from(block + 4).to_le_bytes().to_vec();
    d.extend([0; 4]); // vendor Khronos, basic format
    d.extend(2u16.to_le_bytes()); // version 1.3
    d.extend(block.to_le_bytes());
    d.extend([model, 1, 1, 0]); // BT.709, linear, straight alpha
    d.extend([side, side, 0, 0]);
    d.extend([format.bytes() as u8, 0, 0, 0, 0, 0, 0, 0]); // bytes of plane 0
    for (first, bits, channel, lower, upper) in samples {
        d.extend(first.to_le_bytes());
        d.extend([(bits - 1) as u8, channel]);
        d.extend([0; 4]);
        d.extend(lower.to_le_bytes());
        d.extend(upper.to_le_bytes());
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
        let format = if half { TexelFormat::Rgba16f } else { TexelFormat::Rgba32f };
        written(t, format, Supercompression::None)
    }

    fn written(t: &TextureLevels, format: TexelFormat, c: Supercompression) -> (Vec<u8>, WriteReport) {
        let mut b = Vec::new();
        let stored = StoredTexture::encode(t, format);
        encode(&mut b, &stored, 0, c).unwrap();
        (b, stored.report())
    }

    #[test]
    fn every_format_and_compression_comes_back() {
        let mut t = texture(6);
        // Values that every format holds.
        t.levels.iter_mut().flatten().enumerate().for_each(|(i, v)| {
            *v = if i % 4 == 3 { 1.0 } else { [0.5, 1.0, 0.75, 256.0][i / 4 % 4] };
        });
        for format in TexelFormat::ALL {
            // Blocks keep what one line holds.
            let mut t = t.clone();
            if !format.is_plain() {
                t.levels
                    .iter_mut()
                    .flatten()
                    .enumerate()
                    .for_each(|(i, v)| *v = if i % 4 == 3 { 1.0 } else { 0.5 });
            }
            for c in [Supercompression::None, Supercompression::Zstd, Supercompression::Zlib] {
                let (b, report) = written(&t, format, c);
                let back = decode_ktx2(Path::new("t.ktx2"), &b, &Limits::default()).unwrap();
                assert_eq!(back.levels, t.levels, "{format:?} {c:?}");
                assert_eq!(report, WriteReport::default());
                for cut in [b.len() - 1, 100, 200, b.len() / 2] {
                    assert!(decode_ktx2(Path::new("t.ktx2"), &b[..cut], &Limits::default()).is_err());
                }
            }
        }
    }

    #[test]
    fn blocks_are_described_as_the_specification_has_them() {
        for (format, vk, channel, lower) in
            [(TexelFormat::Bc6h, 143, 0x80, 0.0f32), (TexelFormat::Bc6hSigned, 144, 0xc0, -1.0)]
        {
            let (b, _) = written(&texture(6), format, Supercompression::None);
            let u32_at = |i: usize| u32::from_le_bytes(b[i..i + 4].try_into().unwrap());
            assert_eq!((u32_at(12), u32_at(16)), (vk, 1));
            let d = u32_at(48) as usize;
            assert_eq!(u32_at(d), 44);
            assert_eq!(b[d + 12..d + 24], [133, 1, 1, 0, 3, 3, 0, 0, 16, 0, 0, 0]);
            assert_eq!(b[d + 28..d + 32], [0, 0, 127, channel]);
            assert_eq!((u32_at(d + 36), u32_at(d + 40)), (lower.to_bits(), 1f32.to_bits()));
            // 5 × 5, 2 × 2 and 1 × 1 texels are 4, 1 and 1 blocks a face.
            let lengths: Vec<u32> = (0..3).map(|l| u32_at(88 + 24 * l)).collect();
            assert_eq!(lengths, [6 * 64, 6 * 16, 6 * 16]);
            assert!((0..3).all(|l| u32_at(80 + 24 * l) % 16 == 0));
        }
    }

    #[test]
    fn damaged_compressed_levels_are_refused_without_a_panic() {
        for c in [Supercompression::Zstd, Supercompression::Zlib] {
            let (b, _) = written(&texture(6), TexelFormat::Rgba16f, c);
            for at in (0..b.len()).step_by(3) {
                let mut bad = b.clone();
                bad[at] ^= 0x5a;
                let _ = decode_ktx2(Path::new("t.ktx2"), &bad, &Limits::default());
            }
        }
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
        assert_eq!(
            bytes(&t, true).1,
            WriteReport { clipped: 1, lost: 1e6 - 65504.0, ..WriteReport::default() }
        );
        t.levels[1][5] = f32::NAN;
        assert_eq!(check(&t).unwrap_err(), "level 1, face 0, texel (1, 0) is not finite");
        t.levels[1].pop();
        assert!(check(&t).unwrap_err().contains("level 1 has 15 numbers instead of 16"));
        t.faces = 2;
        assert!(check(&t).unwrap_err().contains("six square ones"));
    }
}

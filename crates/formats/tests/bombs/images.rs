//! Pictures and textures.

use crate::{Bomb, harmless, refused};
use std::io::Write;
use steradian_formats::*;

/// One after another, so that only one lies in memory.
pub fn bombs() -> Vec<fn() -> Bomb> {
    vec![
        || png("profile.png", b"iCCP", b"icc\0\0"),
        || png("text.png", b"zTXt", b"Comment\0\0"),
        || png("international.png", b"iTXt", b"Comment\0\x01\0\0\0"),
        hdr_lines,
        exr_channels,
        exr_attributes,
        exr_parts,
        ktx2_level,
    ]
}

/// 256 MiB of zeros, deflated.
pub fn zeros() -> Vec<u8> {
    let mut out = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::new(1));
    let piece = vec![0; 1 << 20];
    (0..256).for_each(|_| out.write_all(&piece).expect("memory"));
    out.finish().expect("memory")
}

/// A picture of one pixel with a chunk that unfolds to 256 MiB.
fn png(name: &'static str, kind: &[u8; 4], head: &[u8]) -> Bomb {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("one.png");
    let one = Raster::rgb(1, 1, [vec![0.5], vec![0.5], vec![0.5]]);
    write_image(&path, &one, &WriteOptions::default()).expect("written");
    let mut bytes = std::fs::read(&path).expect("readable");
    let body = [kind.as_slice(), head, &zeros()].concat();
    let mut sum = flate2::Crc::new();
    sum.update(&body);
    let length = (body.len() - 4) as u32;
    let chunk = [&length.to_be_bytes()[..], &body, &sum.sum().to_be_bytes()].concat();
    // Behind the magic and the first chunk, which has 13 bytes.
    bytes.splice(33..33, chunk);
    harmless(name, bytes)
}

fn hdr_lines() -> Bomb {
    let text = ["#?RADIANCE\n", &"#\n".repeat(2_000_000), "\n-Y 1 +X 1\nabcd"].concat();
    refused("lines.hdr", text.into_bytes(), "more than 4096 lines")
}

/// The begin of an OpenEXR file of one part.
fn exr(attributes: &[(&str, &str, Vec<u8>)]) -> Vec<u8> {
    let mut out = vec![0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
    for (name, kind, value) in attributes {
        for text in [name, kind] {
            out.extend(text.bytes().chain([0]));
        }
        out.extend((value.len() as u32).to_le_bytes());
        out.extend(value);
    }
    out.push(0);
    out
}

/// Each of a layer of its own: names are compared with names.
fn exr_channels() -> Bomb {
    let mut list = Vec::new();
    for i in 0..60_000 {
        list.extend(format!("layer{i:05}.R\0").bytes());
        list.extend([1, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
    }
    list.push(0);
    refused("channels.exr", exr(&[("channels", "chlist", list)]), "more channels than the limit of 4096")
}

fn exr_attributes() -> Bomb {
    let value = vec![0; 17 << 20];
    refused("attribute.exr", exr(&[("a", "string", value)]), "more than the limit of 16 MiB")
}

fn exr_parts() -> Bomb {
    let part = &exr(&[("a", "int", vec![0; 4])])[8..];
    let head = [0x76, 0x2f, 0x31, 0x01, 2, 0x10, 0, 0];
    let bytes = head.into_iter().chain(part.iter().copied().cycle().take(part.len() * 20_000)).collect();
    refused("parts.exr", bytes, "more parts than the limit of 1000")
}

/// A level of a few texels that unfolds to 256 MiB.
fn ktx2_level() -> Bomb {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("one.ktx2");
    let t =
        TextureLevels { width: 2, height: 2, faces: 1, levels: vec![vec![1.0; 16]], metadata: Vec::new() };
    write_ktx2(&path, &t, false).expect("written");
    let mut bytes = std::fs::read(&path).expect("readable");
    let level = zeros();
    // The scheme is zlib; the first level lies at the end.
    bytes[44..48].copy_from_slice(&3u32.to_le_bytes());
    let (start, length) = (bytes.len() as u64, level.len() as u64);
    bytes[80..88].copy_from_slice(&start.to_le_bytes());
    bytes[88..96].copy_from_slice(&length.to_le_bytes());
    bytes.extend(level);
    refused("level.ktx2", bytes, "bytes instead of")
}

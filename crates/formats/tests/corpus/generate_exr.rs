//! OpenEXR files: what this project writes, and what only others write (tiles, levels, parts, unsigned
//! integers).

use crate::generate::{Entry, entry, picture, written};
use exr::image::write::WritableImage;
use exr::image::{AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples, Image, Layer, Levels};
use exr::math::{RoundingMode, Vec2};
use exr::meta::attribute::{Compression, LineOrder, Text};
use exr::meta::header::{ImageAttributes, LayerAttributes};
use half::f16;
use std::io::Cursor;
use steradian_formats::*;

/// Every generated file.
pub fn exr() -> Vec<Entry> {
    let ours = |exr_samples, exr_compression| {
        let options = WriteOptions { exr_samples, exr_compression, ..WriteOptions::default() };
        written("exr", |p| {
            write_image(p, &picture(9, 18), &options).expect("a written image");
        })
    };
    let good = ours(ExrSamples::Half, ExrCompression::Zip);
    let mut out = vec![
        entry("valid/half_none.exr", ours(ExrSamples::Half, ExrCompression::None)),
        entry("valid/half_rle.exr", ours(ExrSamples::Half, ExrCompression::Rle)),
        entry("valid/half_zip.exr", &good),
        entry("valid/half_piz.exr", ours(ExrSamples::Half, ExrCompression::Piz)),
        entry("valid/float_zip.exr", ours(ExrSamples::Float, ExrCompression::Zip)),
        entry("invalid/empty.exr", ""),
        entry("invalid/wrong_magic.exr", &good[1..]),
        entry("invalid/truncated.exr", &good[..good.len() - 1]),
        entry("invalid/header_only.exr", &good[..330]),
        entry("invalid/huge.exr", window(&good, [0, 0, i32::MAX - 1, i32::MAX - 1])),
        entry("invalid/zero_size.exr", window(&good, [0, 0, -1, -1])),
        entry("invalid/reversed.exr", window(&good, [5, 5, i32::MIN, 2])),
        entry("invalid/far_away.exr", window(&good, [i32::MAX - 9, 0, i32::MAX - 1, 17])),
        entry("invalid/subsampled.exr", subsampled(&good)),
        entry("invalid/deep.exr", flag(&good, 0x800)),
    ];
    for (name, compression) in [
        ("zips", Compression::ZIP1),
        ("pxr24", Compression::PXR24),
        ("b44", Compression::B44),
        ("dwaa", Compression::DWAA(None)),
    ] {
        out.push(entry(&format!("valid/tiled_{name}.exr"), theirs(&[layer(None, compression, true)])));
    }
    out.push(entry("valid/mip.exr", theirs(&[mip()])));
    let [a, b] = ["first", "second"].map(|n| layer(Some(n), Compression::ZIP16, false));
    out.push(entry("valid/two_parts.exr", theirs(&[a, b])));
    out
}

type Theirs = Layer<AnyChannels<Levels<FlatSamples>>>;

fn theirs(layers: &[Theirs]) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let image = Image::from_layers(ImageAttributes::with_size(layers[0].size), layers.to_vec());
    image.write().non_parallel().to_buffered(&mut bytes).expect("a written file");
    bytes.into_inner()
}

/// A mip map of one channel: 8, 4, 2 and 1 pixels a side.
fn mip() -> Theirs {
    let level = |n: usize| FlatSamples::F16((0..n * n).map(|i| f16::from_f32(i as f32)).collect());
    let samples =
        Levels::Mip { rounding_mode: RoundingMode::Down, level_data: [8, 4, 2, 1].map(level).to_vec() };
    let channels = AnyChannels::sort([AnyChannel::new("Y", samples)].into_iter().collect());
    let encoding = Encoding {
        compression: Compression::ZIP1,
        blocks: Blocks::Tiles(Vec2(4, 4)),
        line_order: LineOrder::Increasing,
    };
    Layer::new(Vec2(8, 8), LayerAttributes::default(), encoding, channels)
}

/// Half, float and unsigned channels; in tiles of 4 × 4 where asked.
fn layer(name: Option<&str>, compression: Compression, tiles: bool) -> Theirs {
    let size = Vec2(7, 5);
    let n = size.0 * size.1;
    let channel = |name: &str, samples| AnyChannel::new(name, Levels::Singular(samples));
    let half = |s: f32| FlatSamples::F16((0..n).map(|i| f16::from_f32(i as f32 * s)).collect());
    let channels = vec![
        channel("R", half(0.25)),
        channel("G", half(0.5)),
        channel("B", FlatSamples::F32((0..n).map(|i| i as f32).collect())),
        channel("id", FlatSamples::U32((0..n as u32).collect())),
    ];
    let blocks = if tiles { Blocks::Tiles(Vec2(4, 4)) } else { Blocks::ScanLines };
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let attributes = name.map_or_else(LayerAttributes::default, |n| LayerAttributes::named(Text::from(n)));
    Layer::new(size, attributes, encoding, AnyChannels::sort(channels.into_iter().collect()))
}

/// The place after `pattern`.
fn after(bytes: &[u8], pattern: &[u8]) -> usize {
    bytes.windows(pattern.len()).position(|w| w == pattern).expect("the header has it") + pattern.len()
}

/// The file with another data window.
fn window(bytes: &[u8], corners: [i32; 4]) -> Vec<u8> {
    let mut out = bytes.to_vec();
    let at = after(bytes, b"dataWindow\0box2i\0\x10\0\0\0");
    out[at..at + 16].copy_from_slice(&corners.map(i32::to_le_bytes).concat());
    out
}

/// The file with its first channel sampled at every second pixel.
fn subsampled(bytes: &[u8]) -> Vec<u8> {
    let mut out = bytes.to_vec();
    let at = after(bytes, b"B\0") + 8;
    out[at] = 2;
    out
}

/// The file with a bit of the version set.
fn flag(bytes: &[u8], bit: u32) -> Vec<u8> {
    let mut out = bytes.to_vec();
    out[4..8].copy_from_slice(&(2 | bit).to_le_bytes());
    out
}

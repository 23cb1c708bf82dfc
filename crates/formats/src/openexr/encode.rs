//! Planes to OpenEXR. Header and chunks are written here, in a fixed order (the crate keeps attributes in a
//! hash table, so its files differ from run to run); the crate compresses the blocks, side by side.

use super::{MAGIC, guarded};
use crate::atomic::WriteSeek;
use crate::image::{ExrCompression, ExrSamples, WriteOptions, WriteReport};
use crate::{Channel, Raster};
use exr::block::chunk::CompressedBlock;
use exr::block::{BlockIndex, UncompressedBlock};
use exr::math::Vec2;
use exr::meta::BlockDescription;
use exr::meta::attribute::{ChannelDescription, Compression, LineOrder, SampleType, Text};
use exr::meta::header::Header;
use half::f16;
use std::io::{self, SeekFrom, Write};
use steradian_parallel::prelude::*;

/// Blocks that are compressed at once.
const BATCH: usize = 64;

/// Largest finite half.
const HALF_MAX: f32 = 65504.0;

/// Writes every channel of `raster`, which is checked already.
pub(crate) fn encode(
    w: &mut dyn WriteSeek,
    raster: &Raster,
    options: &WriteOptions,
) -> io::Result<WriteReport> {
    let mut channels: Vec<&Channel> = raster.channels.iter().collect();
    // The format asks for this order.
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    check_names(&channels)?;
    let header = codec_header(raster, &channels, options)?;
    let rows = header.compression.scan_lines_per_block();
    let blocks = raster.height.div_ceil(rows);
    write_header(w, raster, &channels, options)?;
    let table_at = w.stream_position()?;
    w.write_all(&vec![0; 8 * blocks])?;
    let mut offsets = Vec::with_capacity(8 * blocks);
    let mut report = WriteReport::default();
    for first in (0..blocks).step_by(BATCH) {
        let batch: Vec<io::Result<(Vec<u8>, WriteReport)>> = (first..blocks.min(first + BATCH))
            .into_par_iter()
            .map(|b| compress(b * rows, rows, raster, &channels, &header, options.exr_samples))
            .collect();
        for (i, done) in batch.into_iter().enumerate() {
            let (bytes, clipped) = done?;
            report.merge(clipped);
            offsets.extend(w.stream_position()?.to_le_bytes());
            w.write_all(&(((first + i) * rows) as i32).to_le_bytes())?;
            w.write_all(&(bytes.len() as i32).to_le_bytes())?;
            w.write_all(&bytes)?;
        }
    }
    w.seek(SeekFrom::Start(table_at))?;
    w.write_all(&offsets)?;
    w.seek(SeekFrom::End(0))?;
    Ok(report)
}

fn check_names(channels: &[&Channel]) -> io::Result<()> {
    if channels.is_empty() {
        return Err(io::Error::other("the image has no channels"));
    }
    for (i, c) in channels.iter().enumerate() {
        let fine = !c.name.is_empty() && c.name.len() < 256 && !c.name.contains('\0');
        let twice = i > 0 && channels[i - 1].name == c.name;
        if !fine || twice {
            return Err(io::Error::other(format!("'{}' cannot name a channel, or names two", c.name)));
        }
    }
    Ok(())
}

/// What the crate's codecs need to know.
fn codec_header(raster: &Raster, channels: &[&Channel], options: &WriteOptions) -> io::Result<Header> {
    let kind = match options.exr_samples {
        ExrSamples::Half => SampleType::F16,
        ExrSamples::Float => SampleType::F32,
    };
    let compression = match options.exr_compression {
        ExrCompression::None => Compression::Uncompressed,
        ExrCompression::Rle => Compression::RLE,
        ExrCompression::Zip => Compression::ZIP16,
        ExrCompression::Piz => Compression::PIZ,
    };
    let size = |n: usize| i32::try_from(n).map_err(|_| io::Error::other("the image is too large"));
    size(raster.width)?;
    size(raster.height)?;
    let describe = |c: &&Channel| {
        let name = Text::from_slice_unchecked(c.name.as_bytes());
        ChannelDescription { name, sample_type: kind, quantize_linearly: false, sampling: Vec2(1, 1) }
    };
    let list = channels.iter().map(describe).collect();
    Ok(Header::new(Text::from_slice_unchecked(b""), (raster.width, raster.height), list).with_encoding(
        compression,
        BlockDescription::ScanLines,
        LineOrder::Increasing,
    ))
}

/// The compressed rows from `y` on, and what clipped.
fn compress(
    y: usize,
    rows: usize,
    raster: &Raster,
    channels: &[&Channel],
    header: &Header,
    samples: ExrSamples,
) -> io::Result<(Vec<u8>, WriteReport)> {
    let height = rows.min(raster.height - y);
    let mut report = WriteReport::default();
    let mut data = Vec::new();
    for row in y..y + height {
        for c in channels {
            let line = &c.data[row * raster.width..(row + 1) * raster.width];
            match samples {
                ExrSamples::Float => line.iter().for_each(|v| data.extend(v.to_ne_bytes())),
                ExrSamples::Half => {
                    line.iter().for_each(|&v| data.extend(half(v, &mut report).to_ne_bytes()))
                }
            }
        }
    }
    let index = BlockIndex {
        layer: 0,
        pixel_position: Vec2(0, y),
        pixel_size: Vec2(raster.width, height),
        level: Vec2(0, 0),
    };
    let block = UncompressedBlock { index, data };
    let chunk =
        guarded(|| block.compress_to_chunk(std::slice::from_ref(header))).map_err(io::Error::other)?;
    match chunk.compressed_block {
        CompressedBlock::ScanLine(line) => Ok((line.compressed_pixels_le, report)),
        _ => Err(io::Error::other("a scan line became something else")),
    }
}

/// The nearest half. Beyond the largest one the value clips, below half the smallest it becomes 0; both are
/// counted.
fn half(v: f32, report: &mut WriteReport) -> f16 {
    let h = f16::from_f32(v);
    if v > 0.0 && h == f16::ZERO {
        report.vanish(v.into());
    }
    if h.is_finite() {
        return h;
    }
    let clipped = HALF_MAX.copysign(v);
    report.clip(v.into(), clipped.into());
    f16::from_f32(clipped)
}

/// Magic, version and attributes, as *OpenEXR File Layout* (Academy Software Foundation) lists them.
fn write_header(
    w: &mut dyn Write,
    raster: &Raster,
    channels: &[&Channel],
    options: &WriteOptions,
) -> io::Result<()> {
    let metadata = attributes(&options.metadata);
    let long =
        metadata.iter().map(|(n, _)| n.len()).chain(channels.iter().map(|c| c.name.len())).any(|n| n > 31);
    w.write_all(&MAGIC)?;
    w.write_all(&(2 | if long { 0x400 } else { 0u32 }).to_le_bytes())?;
    attribute(w, "channels", "chlist", &channel_list(channels, options.exr_samples))?;
    let compression = match options.exr_compression {
        ExrCompression::None => 0,
        ExrCompression::Rle => 1,
        ExrCompression::Zip => 3,
        ExrCompression::Piz => 4,
    };
    attribute(w, "compression", "compression", &[compression])?;
    let corner = [0, 0, raster.width as i32 - 1, raster.height as i32 - 1];
    let window: Vec<u8> = corner.iter().flat_map(|v| v.to_le_bytes()).collect();
    attribute(w, "dataWindow", "box2i", &window)?;
    attribute(w, "displayWindow", "box2i", &window)?;
    attribute(w, "lineOrder", "lineOrder", &[0])?;
    attribute(w, "pixelAspectRatio", "float", &1f32.to_le_bytes())?;
    attribute(w, "screenWindowCenter", "v2f", &[0; 8])?;
    attribute(w, "screenWindowWidth", "float", &1f32.to_le_bytes())?;
    for (name, value) in &metadata {
        match (name.as_str(), value.as_str()) {
            ("envmap", "latlong") => attribute(w, name, "envmap", &[0])?,
            ("envmap", "cube") => attribute(w, name, "envmap", &[1])?,
            _ => attribute(w, name, "string", value.as_bytes())?,
        }
    }
    w.write_all(&[0])
}

/// Names that the header uses itself.
const TAKEN: [&str; 8] = [
    "channels",
    "compression",
    "dataWindow",
    "displayWindow",
    "lineOrder",
    "pixelAspectRatio",
    "screenWindowCenter",
    "screenWindowWidth",
];

/// Pairs with usable names, each once.
fn attributes(metadata: &[(String, String)]) -> Vec<(String, String)> {
    let mut out: Vec<(String, String)> = Vec::new();
    for (name, value) in metadata {
        let name: String = name.chars().filter(|c| *c != '\0').take(63).collect();
        let known = TAKEN.contains(&name.as_str()) || out.iter().any(|(n, _)| *n == name);
        if !name.is_empty() && !known {
            out.push((name, value.clone()));
        }
    }
    out
}

fn channel_list(channels: &[&Channel], samples: ExrSamples) -> Vec<u8> {
    let kind: i32 = match samples {
        ExrSamples::Half => 1,
        ExrSamples::Float => 2,
    };
    let mut list = Vec::new();
    for c in channels {
        list.extend(c.name.bytes());
        list.push(0);
        list.extend(kind.to_le_bytes());
        list.extend([0; 4]);
        list.extend(1i32.to_le_bytes());
        list.extend(1i32.to_le_bytes());
    }
    list.push(0);
    list
}

fn attribute(w: &mut dyn Write, name: &str, kind: &str, value: &[u8]) -> io::Result<()> {
    for text in [name, kind] {
        w.write_all(text.as_bytes())?;
        w.write_all(&[0])?;
    }
    let size = i32::try_from(value.len()).map_err(|_| io::Error::other("an attribute is too long"))?;
    w.write_all(&size.to_le_bytes())?;
    w.write_all(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::{ReadOptions, decode_image_with};
    use std::io::Cursor;
    use std::path::Path;

    fn raster() -> Raster {
        let (w, h) = (37, 41);
        let plane = |s: f32| (0..w * h).map(|i| s + (i * 7 % 97) as f32 / 8.0).collect();
        let mut r = Raster::rgb(w, h, [plane(0.0), plane(1.0), plane(-20.0)]);
        r.channels.push(Channel { name: "depth.Z".into(), data: plane(100.0) });
        r
    }

    fn round_trip(options: &WriteOptions, all: bool) -> (Raster, WriteReport) {
        let mut w = Cursor::new(Vec::new());
        let report = encode(&mut w, &raster(), options).unwrap();
        let read = ReadOptions { all_channels: all, ..ReadOptions::default() };
        (decode_image_with(Path::new("t.exr"), w.get_ref(), &read).unwrap(), report)
    }

    #[test]
    fn every_kind_comes_back() {
        for exr_samples in [ExrSamples::Half, ExrSamples::Float] {
            for exr_compression in
                [ExrCompression::None, ExrCompression::Rle, ExrCompression::Zip, ExrCompression::Piz]
            {
                let options = WriteOptions { exr_samples, exr_compression, ..WriteOptions::default() };
                let (back, report) = round_trip(&options, true);
                // Multiples of 1/8 are exact in both.
                assert_eq!(back.channels, raster().channels, "{options:?}");
                assert_eq!(report, WriteReport::default());
                let (back, _) = round_trip(&options, false);
                assert_eq!(back.channels.len(), 3);
            }
        }
    }

    #[test]
    fn metadata_comes_back_and_files_are_the_same_each_time() {
        let pair = |a: &str, b: &str| (a.to_string(), b.to_string());
        let long = "steradian.input.a-name-that-is-longer-than-thirty-one-bytes";
        let metadata = vec![pair("envmap", "latlong"), pair("steradian.version", "1"), pair(long, "x–y")];
        let options = WriteOptions { metadata, ..WriteOptions::default() };
        let bytes = || {
            let mut w = Cursor::new(Vec::new());
            encode(&mut w, &raster(), &options).unwrap();
            w.into_inner()
        };
        assert_eq!(bytes(), bytes());
        let (back, _) = round_trip(&options, false);
        let get = |n: &str| back.metadata.iter().find(|(a, _)| a == n).map(|(_, b)| b.as_str());
        assert_eq!(get("envmap"), Some("latlong"));
        assert_eq!(get("steradian.version"), Some("1"));
        assert_eq!(get("channels"), Some("B float, G float, R float, depth.Z float"));
        assert_eq!(get(long), Some("x–y"));
    }

    #[test]
    fn halves_clip_and_are_counted() {
        let r = Raster::rgb(1, 1, [vec![1e5], vec![65519.0], vec![-7e4]]);
        let mut w = Cursor::new(Vec::new());
        let options = WriteOptions { exr_samples: ExrSamples::Half, ..WriteOptions::default() };
        let report = encode(&mut w, &r, &options).unwrap();
        assert_eq!(report, WriteReport { clipped: 2, lost: (1e5 - 65504.0) + (7e4 - 65504.0), vanished: 0 });
    }
}

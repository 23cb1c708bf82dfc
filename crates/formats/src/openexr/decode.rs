//! OpenEXR to planes.

use super::attributes::{metadata, primaries};
use super::scan::scan;
use super::select::{Selection, select};
use super::{describe, guarded};
use crate::color::{self, REC709};
use crate::image::ReadOptions;
use crate::{Channel, FormatError, Raster};
use exr::block::UncompressedBlock;
use exr::block::chunk::{
    Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock, TileCoordinates,
};
use exr::math::Vec2;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use half::f16;
use std::collections::HashSet;
use std::io::{Read, Seek};
use std::path::Path;
use steradian_parallel::prelude::*;

/// Decoded bytes that are in flight at once.
const BATCH_BYTES: usize = 32 << 20;

/// Decodes the file that `reader` is at the start of; `length` is its size, `name` is for messages.
pub(crate) fn decode<R: Read + Seek>(
    name: &Path,
    mut reader: R,
    length: u64,
    options: &ReadOptions,
) -> Result<Raster, FormatError> {
    let invalid = |why: String| FormatError::invalid(name, why);
    scan(name, &mut reader, length, options)?;
    let meta = guarded(|| MetaData::read_from_buffered(&mut reader, false)).map_err(invalid)?;
    if meta.requirements.has_deep_data {
        return Err(invalid("deep data is not read; flatten it first".into()));
    }
    let mut chunks = 0u64;
    for header in &meta.headers {
        check_part(name, header, length, options)?;
        chunks = chunks.saturating_add(header.chunk_count as u64);
    }
    guarded(|| MetaData::validate(&meta.headers, false)).map_err(invalid)?;
    let selection = select(&meta.headers, options.layer.as_deref(), options.all_channels).map_err(invalid)?;
    let header = &meta.headers[selection.part];
    let (mut raster, window) = empty(name, header, &selection, length, options)?;
    let mut walk = Walk { reader, meta: &meta, part: selection.part, chunks_left: chunks, length };
    walk.skip_offset_tables(chunks).map_err(invalid)?;
    fill(&mut walk, &selection, window, &mut raster).map_err(invalid)?;
    finish(&mut raster, header, &selection).map_err(invalid)?;
    Ok(raster)
}

/// Sizes within the limits, samples of the kinds that are read.
fn check_part(name: &Path, header: &Header, length: u64, options: &ReadOptions) -> Result<(), FormatError> {
    let invalid = |why: &str| Err(FormatError::invalid(name, why));
    if header.deep {
        return invalid("deep data is not read; flatten it first");
    }
    if header.channels.list.is_empty() {
        return invalid("a part has no channels");
    }
    if header.channels.list.iter().any(|c| c.sampling != Vec2(1, 1)) {
        return invalid("subsampled (luminance/chroma) channels are not read; save it as RGB first");
    }
    let size = header.layer_size;
    options.limits.image(name, size.0 as u64, size.1 as u64, 1, length)?;
    let position = header.own_attributes.layer_position;
    if [position.0, position.1].iter().any(|p| p.unsigned_abs() > 1 << 24) {
        return invalid("the data window lies too far from the origin");
    }
    let (width, rows) = match header.blocks {
        BlockDescription::ScanLines => (size.0, header.compression.scan_lines_per_block()),
        BlockDescription::Tiles(t) => (t.tile_size.0, t.tile_size.1),
    };
    if width == 0 || rows == 0 {
        return invalid("the tiles are empty");
    }
    let samples = width as u128 * rows as u128 * header.channels.list.len() as u128;
    // The tiles of a small image may be larger than the image; only the largest file has any right to huge
    // ones.
    options.limits.memory(name, samples.saturating_mul(4), length.max(1 << 20))
}

/// The data window's place in the display window.
#[derive(Clone, Copy)]
struct Window {
    x: i64,
    y: i64,
}

/// The raster of the display window, zero, and where the data window lies in it.
fn empty(
    name: &Path,
    header: &Header,
    selection: &Selection,
    length: u64,
    options: &ReadOptions,
) -> Result<(Raster, Window), FormatError> {
    let display = header.shared_attributes.display_window;
    let (width, height) = (display.size.0, display.size.1);
    let n =
        options.limits.image(name, width as u64, height as u64, selection.channels.len() as u64, length)?;
    let channels = selection
        .channels
        .iter()
        .map(|(_, name)| Channel { name: name.clone(), data: vec![0.0; n] })
        .collect();
    let at = header.own_attributes.layer_position;
    let window = Window {
        x: i64::from(at.0) - i64::from(display.position.0),
        y: i64::from(at.1) - i64::from(display.position.1),
    };
    let (w, h) = (header.layer_size.0 as i64, header.layer_size.1 as i64);
    if window.x >= width as i64 || window.y >= height as i64 || window.x + w <= 0 || window.y + h <= 0 {
        return Err(FormatError::invalid(name, "the data window lies outside the display window"));
    }
    let raster = Raster { width, height, channels, low_range: false, metadata: metadata(header) };
    Ok((raster, window))
}

/// What a compressed block may have beyond its pixels: the tables of its codec.
const SPARE_BYTES: u64 = 1 << 20;

/// The chunks of a file in its order.
struct Walk<'a, R> {
    reader: R,
    meta: &'a MetaData,
    part: usize,
    chunks_left: u64,
    length: u64,
}

impl<R: Read + Seek> Walk<'_, R> {
    fn skip_offset_tables(&mut self, chunks: u64) -> Result<(), String> {
        let bytes =
            chunks.checked_mul(8).filter(|b| *b <= self.length).ok_or("truncated in the offset table")?;
        self.skip(bytes)
    }

    fn skip(&mut self, bytes: u64) -> Result<(), String> {
        // Checked against the file's length, so it fits.
        let by = i64::try_from(bytes).map_err(|_| "damaged: a chunk's size is too large")?;
        self.reader.seek_relative(by).map_err(|e| describe(&e.into()))
    }

    fn i32(&mut self) -> Result<i32, String> {
        let mut b = [0; 4];
        self.reader.read_exact(&mut b).map_err(|e| describe(&e.into()))?;
        Ok(i32::from_le_bytes(b))
    }

    /// The next chunk of the wanted part at full resolution; `None` after the last one.
    fn next(&mut self) -> Result<Option<Chunk>, String> {
        while self.chunks_left > 0 {
            self.chunks_left -= 1;
            let part = if self.meta.requirements.has_multiple_layers { self.i32()? } else { 0 };
            let part = usize::try_from(part).ok().filter(|p| *p < self.meta.headers.len());
            let part = part.ok_or("damaged: a chunk names a part that does not exist")?;
            let tiles = matches!(self.meta.headers[part].blocks, BlockDescription::Tiles(_));
            let coordinates = if tiles { self.tile()? } else { [self.i32()?, 0, 0, 0] };
            let size = u64::try_from(self.i32()?).map_err(|_| "damaged: a chunk's size is negative")?;
            if size > self.length {
                return Err("truncated".into());
            }
            if part != self.part || coordinates[2..] != [0, 0] {
                self.skip(size)?;
                continue;
            }
            // Writers keep what compression would enlarge as it is.
            if size > 2 * block_bytes(&self.meta.headers[part]) as u64 + SPARE_BYTES {
                return Err("damaged: a block of pixels is larger than its pixels".into());
            }
            return self.chunk(tiles, coordinates, size as usize).map(Some);
        }
        Ok(None)
    }

    fn tile(&mut self) -> Result<[i32; 4], String> {
        Ok([self.i32()?, self.i32()?, self.i32()?, self.i32()?])
    }

    fn chunk(&mut self, tiles: bool, at: [i32; 4], size: usize) -> Result<Chunk, String> {
        let mut compressed_pixels_le = vec![0; size];
        self.reader.read_exact(&mut compressed_pixels_le).map_err(|e| describe(&e.into()))?;
        let compressed_block = if tiles {
            let index = |v: i32| usize::try_from(v).map_err(|_| "damaged: a tile's place is negative");
            let tile_index = Vec2(index(at[0])?, index(at[1])?);
            let coordinates = TileCoordinates { tile_index, level_index: Vec2(0, 0) };
            CompressedBlock::Tile(CompressedTileBlock { coordinates, compressed_pixels_le })
        } else {
            CompressedBlock::ScanLine(CompressedScanLineBlock { y_coordinate: at[0], compressed_pixels_le })
        };
        Ok(Chunk { layer_index: self.part, compressed_block })
    }
}

/// A decoded block: one run of `width`·`height` values per selected channel.
struct Block {
    x: usize,
    y: usize,
    width: usize,
    height: usize,
    values: Vec<f32>,
}

/// Decodes batches of chunks side by side and puts them in place.
fn fill<R: Read + Seek>(
    walk: &mut Walk<'_, R>,
    selection: &Selection,
    window: Window,
    raster: &mut Raster,
) -> Result<(), String> {
    let meta = walk.meta;
    let header = &meta.headers[selection.part];
    let mut missing = blocks_at_full_resolution(header);
    let per_batch = (BATCH_BYTES / block_bytes(header).max(1)).clamp(1, 1024);
    let mut seen = HashSet::new();
    while missing > 0 {
        let mut batch = Vec::new();
        while batch.len() < per_batch.min(missing) {
            let Some(chunk) = walk.next()? else {
                return Err(format!("truncated: {missing} blocks of pixels are missing"));
            };
            batch.push(chunk);
        }
        missing -= batch.len();
        let blocks: Vec<Result<Block, String>> =
            batch.into_par_iter().map(|c| decode_block(c, meta, header, selection)).collect();
        for block in blocks {
            let block = block?;
            if !seen.insert((block.x, block.y)) {
                return Err("damaged: a block of pixels occurs twice".into());
            }
            place(&block, window, raster);
        }
    }
    Ok(())
}

/// Blocks of the full resolution; the sizes have been checked.
fn blocks_at_full_resolution(header: &Header) -> usize {
    let (w, h) = (header.layer_size.0, header.layer_size.1);
    match header.blocks {
        BlockDescription::ScanLines => h.div_ceil(header.compression.scan_lines_per_block()),
        BlockDescription::Tiles(t) => w.div_ceil(t.tile_size.0) * h.div_ceil(t.tile_size.1),
    }
}

/// Bytes of one decoded block.
fn block_bytes(header: &Header) -> usize {
    let pixels = match header.blocks {
        BlockDescription::ScanLines => header.layer_size.0 * header.compression.scan_lines_per_block(),
        BlockDescription::Tiles(t) => t.tile_size.0 * t.tile_size.1,
    };
    pixels.saturating_mul(header.channels.list.len() * 4)
}

fn decode_block(
    chunk: Chunk,
    meta: &MetaData,
    header: &Header,
    selection: &Selection,
) -> Result<Block, String> {
    let block = guarded(|| UncompressedBlock::decompress_chunk(chunk, meta, false))?;
    let (width, height) = (block.index.pixel_size.0, block.index.pixel_size.1);
    let sizes: Vec<usize> =
        header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample() * width).collect();
    let line_bytes: usize = sizes.iter().sum();
    if block.data.len() != line_bytes * height {
        return Err("damaged: a block of pixels has the wrong size".into());
    }
    let mut values = Vec::with_capacity(selection.channels.len() * width * height);
    let mut starts = vec![0; sizes.len()];
    (1..sizes.len()).for_each(|c| starts[c] = starts[c - 1] + sizes[c - 1]);
    for &(c, _) in &selection.channels {
        let start = starts[c];
        let kind = header.channels.list[c].sample_type;
        for line in block.data.chunks_exact(line_bytes.max(1)) {
            convert(&line[start..start + sizes[c]], kind, &mut values);
        }
    }
    let at = block.index.pixel_position;
    Ok(Block { x: at.0, y: at.1, width, height, values })
}

/// Samples in the machine's byte order to f32.
fn convert(line: &[u8], kind: SampleType, out: &mut Vec<f32>) {
    match kind {
        SampleType::F16 => {
            out.extend(line.chunks_exact(2).map(|b| f16::from_ne_bytes([b[0], b[1]]).to_f32()))
        }
        SampleType::F32 => {
            out.extend(line.chunks_exact(4).map(|b| f32::from_ne_bytes([b[0], b[1], b[2], b[3]])))
        }
        SampleType::U32 => {
            out.extend(line.chunks_exact(4).map(|b| u32::from_ne_bytes([b[0], b[1], b[2], b[3]]) as f32));
        }
    }
}

/// Copies what lies inside the display window.
fn place(block: &Block, window: Window, raster: &mut Raster) {
    let left = block.x as i64 + window.x;
    let from = (-left).clamp(0, block.width as i64) as usize;
    let to = (raster.width as i64 - left).clamp(from as i64, block.width as i64) as usize;
    if from == to {
        return;
    }
    let n = block.width * block.height;
    for (plane, values) in raster.channels.iter_mut().zip(block.values.chunks_exact(n)) {
        for (row, line) in values.chunks_exact(block.width).enumerate() {
            let y = (block.y + row) as i64 + window.y;
            if (0..raster.height as i64).contains(&y) {
                let start = y as usize * raster.width + (left + from as i64) as usize;
                plane.data[start..start + to - from].copy_from_slice(&line[from..to]);
            }
        }
    }
}

/// The layer's name and the colour space.
fn finish(raster: &mut Raster, header: &Header, selection: &Selection) -> Result<(), String> {
    raster.metadata.extend(selection.layer.clone().map(|l| ("layer".into(), l)));
    if let Some(p) = primaries(header).filter(|p| !p.close(&REC709)) {
        let matrix = p.to_rec709().ok_or("the chromaticities span no colour space")?;
        color::transform(raster, &matrix);
        let from: Vec<String> = p.0.iter().flatten().map(ToString::to_string).collect();
        raster.metadata.push(("converted".into(), format!("to linear Rec. 709 from {}", from.join(" "))));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Limits, WriteOptions, decode_image, write_image};
    use exr::image::write::WritableImage;
    use exr::image::{Image, SpecificChannels};
    use exr::meta::attribute::Chromaticities;

    /// A picture whose display window is another one.
    fn windowed(display: [i32; 4]) -> Result<Raster, FormatError> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.exr");
        let plane = |s: f32| (0..6).map(|i| s + i as f32).collect();
        write_image(
            &path,
            &Raster::rgb(3, 2, [plane(1.0), plane(11.0), plane(21.0)]),
            &WriteOptions::default(),
        )?;
        let mut bytes = std::fs::read(&path).unwrap();
        let name = b"displayWindow\0box2i\0\x10\0\0\0";
        let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len();
        bytes[at..at + 16].copy_from_slice(&display.map(i32::to_le_bytes).concat());
        decode_image(Path::new("a.exr"), &bytes, &Limits::default())
    }

    #[test]
    fn the_image_is_the_display_window() {
        let larger = windowed([-1, -1, 3, 1]).unwrap();
        assert_eq!((larger.width, larger.height), (5, 3));
        let want = [0., 0., 0., 0., 0., 0., 1., 2., 3., 0., 0., 4., 5., 6., 0.];
        assert_eq!(larger.channel("R").unwrap(), want);
        let smaller = windowed([1, 1, 2, 1]).unwrap();
        assert_eq!(smaller.channel("G").unwrap(), [15., 16.]);
        assert!(windowed([3, 0, 5, 1]).unwrap_err().to_string().contains("outside the display window"));
    }

    #[test]
    fn other_primaries_become_rec709() {
        let mut image = Image::from_channels((1, 1), SpecificChannels::rgb(|_| (1.0f32, 0.0f32, 0.0f32)));
        image.attributes.chromaticities = Some(Chromaticities {
            red: Vec2(0.713, 0.293),
            green: Vec2(0.165, 0.83),
            blue: Vec2(0.128, 0.044),
            white: Vec2(0.32168, 0.33767),
        });
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).unwrap();
        let raster = decode_image(Path::new("a.exr"), bytes.get_ref(), &Limits::default()).unwrap();
        assert!(raster.metadata.iter().any(|(k, v)| k == "converted" && v.starts_with("to linear Rec. 709")));
        for (got, want) in raster.into_rgb().unwrap().iter().zip([1.705, -0.130, -0.024]) {
            assert!((got[0] - want).abs() < 2e-3, "{got:?}");
        }
    }
}

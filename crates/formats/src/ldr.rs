//! Low-range images: PNG and JPEG, through the crates `png` and `zune-jpeg`.

use crate::image::{Planes, ReadOptions, WriteOptions, WriteReport};
use crate::srgb::{linear_to_srgb, srgb_to_linear};
use crate::{Channel, FormatError, Raster};
use std::io::{self, Cursor, Write};
use std::path::Path;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::errors::DecodeErrors;

const PNG_MAGIC: &[u8] = b"\x89PNG\r\n\x1a\n";

/// The low-range formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LowRange {
    Png,
    Jpeg,
}

/// Decoded samples, pixel by pixel.
#[derive(Debug)]
pub(crate) struct Samples {
    pub width: usize,
    pub height: usize,
    channels: usize,
    codes: Codes,
}

/// What the file holds: bytes stay bytes, which matters for photographs of many megapixels.
#[derive(Debug)]
enum Codes {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
}

/// PNG or JPEG by their first bytes.
pub(crate) fn format(bytes: &[u8]) -> Option<LowRange> {
    if bytes.starts_with(PNG_MAGIC) {
        Some(LowRange::Png)
    } else if bytes.starts_with(b"\xff\xd8\xff") {
        Some(LowRange::Jpeg)
    } else {
        None
    }
}

impl Samples {
    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        match &self.codes {
            Codes::Eight(all) => all.len(),
            Codes::Sixteen(all) => 2 * all.len(),
        }
    }

    /// Linear red, green and blue of the sRGB codes of as many pixels as `out` takes, from pixel `from` on.
    pub fn linear(&self, curve: &Curve, from: usize, out: [&mut [f32]; 3]) {
        match &self.codes {
            Codes::Eight(all) => {
                // Every byte has a value: no look into the table is checked.
                let Some(table) = curve.0.first_chunk::<256>() else { return };
                runs(all, self.channels, |v| table[usize::from(v)], from, out);
            }
            Codes::Sixteen(all) => runs(all, self.channels, |v| curve.get(v), from, out),
        }
    }

    /// The curve of its codes.
    pub fn curve(&self) -> Curve {
        Curve::of(if matches!(self.codes, Codes::Eight(_)) { 8 } else { 16 }, false)
    }
}

/// Runs of pixels of so many channels.
fn runs<T: Copy>(all: &[T], channels: usize, of: impl Fn(T) -> f32, from: usize, out: [&mut [f32]; 3]) {
    match channels {
        1 => grey::<T, 1>(all, of, from, out),
        2 => grey::<T, 2>(all, of, from, out),
        3 => colours::<T, 3>(all, of, from, out),
        _ => colours::<T, 4>(all, of, from, out),
    }
}

fn grey<T: Copy, const K: usize>(all: &[T], of: impl Fn(T) -> f32, from: usize, [r, g, b]: [&mut [f32]; 3]) {
    for (pixel, r) in all.as_chunks::<K>().0[from..].iter().zip(&mut *r) {
        *r = of(pixel[0]);
    }
    g.copy_from_slice(r);
    b.copy_from_slice(r);
}

fn colours<T: Copy, const K: usize>(
    all: &[T],
    of: impl Fn(T) -> f32,
    from: usize,
    [r, g, b]: [&mut [f32]; 3],
) {
    for (((pixel, r), g), b) in all.as_chunks::<K>().0[from..].iter().zip(r).zip(g).zip(b) {
        *r = of(pixel[0]);
        *g = of(pixel[1]);
        *b = of(pixel[2]);
    }
}

/// Decodes the image in `bytes`; `name` is for messages.
pub(crate) fn decode(
    name: &Path,
    bytes: &[u8],
    format: LowRange,
    options: &ReadOptions,
) -> Result<Raster, FormatError> {
    let samples = samples(name, bytes, format, options)?;
    let channels = split(&samples, options.data);
    let Samples { width, height, .. } = samples;
    Ok(Raster { width, height, channels, low_range: true, metadata: Vec::new() })
}

/// Decodes the image in `bytes` as far as its samples.
pub(crate) fn samples(
    name: &Path,
    bytes: &[u8],
    format: LowRange,
    options: &ReadOptions,
) -> Result<Samples, FormatError> {
    if let Some((width, height)) = png_size(bytes) {
        options.limits.image(name, width, height, 1, bytes.len() as u64)?;
    }
    if !has_end(bytes, format) {
        return Err(FormatError::invalid(name, "truncated: the end marker is missing"));
    }
    match format {
        LowRange::Png => decode_png(name, bytes, options),
        LowRange::Jpeg => decode_jpeg(name, bytes, options),
    }
}

fn decode_png(name: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Samples, FormatError> {
    let invalid = |e: png::DecodingError| FormatError::invalid(name, describe_png(&e));
    let limits = png::Limits { bytes: usize::try_from(options.limits.max_memory).unwrap_or(usize::MAX) };
    let mut decoder = png::Decoder::new_with_limits(Cursor::new(bytes), limits);
    // Palettes become RGB, 1 to 4 bits become 8, a transparent colour becomes alpha.
    decoder.set_transformations(png::Transformations::EXPAND);
    // Compressed texts and profiles may unfold to a thousand times their size, and nothing here asks for
    // them.
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(invalid)?;
    let (width, height) = reader.info().size();
    let (color, depth) = reader.output_color_type();
    let channels = color.samples();
    options.limits.image(name, width.into(), height.into(), channels as u64, bytes.len() as u64)?;
    let size = reader.output_buffer_size().ok_or_else(|| FormatError::invalid(name, "absurd size"))?;
    let mut raw = vec![0; size];
    reader.next_frame(&mut raw).map_err(invalid)?;
    let wide = depth == png::BitDepth::Sixteen;
    let codes = if wide {
        Codes::Sixteen(raw.as_chunks::<2>().0.iter().map(|b| u16::from_be_bytes(*b)).collect())
    } else {
        Codes::Eight(raw)
    };
    Ok(Samples { width: width as usize, height: height as usize, channels, codes })
}

fn decode_jpeg(name: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Samples, FormatError> {
    let invalid = |e: DecodeErrors| FormatError::invalid(name, describe_jpeg(&e));
    let side = options.limits.max_side as usize;
    let settings = DecoderOptions::default().set_strict_mode(true).set_max_width(side).set_max_height(side);
    let mut decoder = zune_jpeg::JpegDecoder::new_with_options(Cursor::new(bytes), settings);
    decoder.decode_headers().map_err(invalid)?;
    let grey = decoder.input_colorspace() == Some(ColorSpace::Luma);
    let (space, channels) = if grey { (ColorSpace::Luma, 1) } else { (ColorSpace::RGB, 3) };
    decoder.set_options(settings.jpeg_set_out_colorspace(space));
    let info = decoder.info().ok_or_else(|| FormatError::invalid(name, "no frame header"))?;
    let (width, height) = (info.width.into(), info.height.into());
    options.limits.image(name, width as u64, height as u64, channels as u64, bytes.len() as u64)?;
    let values = decoder.decode().map_err(invalid)?;
    if values.len() != width * height * channels {
        return Err(FormatError::invalid(name, "damaged JPEG: the pixels do not fill the frame"));
    }
    Ok(Samples { width, height, channels, codes: Codes::Eight(values) })
}

/// The size that a PNG's first chunk gives, before anything else is believed.
fn png_size(bytes: &[u8]) -> Option<(u64, u64)> {
    let ihdr = bytes.strip_prefix(PNG_MAGIC)?.get(..16)?;
    let number = |i: usize| u64::from(u32::from_be_bytes([ihdr[i], ihdr[i + 1], ihdr[i + 2], ihdr[i + 3]]));
    (&ihdr[4..8] == b"IHDR").then(|| (number(8), number(12)))
}

/// Decoders fill up what is missing; a complete file ends with IEND or EOI, whatever may follow.
fn has_end(bytes: &[u8], format: LowRange) -> bool {
    let marker: &[u8] = if format == LowRange::Png { b"IEND" } else { b"\xff\xd9" };
    bytes.windows(marker.len()).rev().any(|w| w == marker)
}

/// The library's message on one line.
fn describe_png(e: &png::DecodingError) -> String {
    match e {
        png::DecodingError::IoError(io) if io.kind() == io::ErrorKind::UnexpectedEof => "truncated".into(),
        other => format!("damaged PNG: {}", one_line(&other.to_string())),
    }
}

/// The library's message on one line.
fn describe_jpeg(e: &DecodeErrors) -> String {
    match e {
        DecodeErrors::ExhaustedData | DecodeErrors::IoErrors(_) => "truncated".into(),
        other => format!("damaged JPEG: {}", one_line(&format!("{other:?}"))),
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn split(samples: &Samples, data: bool) -> Vec<Channel> {
    let k = samples.channels;
    let names: &[&str] = match k {
        1 => &["Y"],
        2 => &["Y", "A"],
        3 => &["R", "G", "B"],
        _ => &["R", "G", "B", "A"],
    };
    let bits = if matches!(samples.codes, Codes::Eight(_)) { 8 } else { 16 };
    let (color, straight) = (Curve::of(bits, data), Curve::of(bits, true));
    let plane = |(c, name): (usize, &&str)| {
        let curve = if *name == "A" { &straight } else { &color };
        let data = match &samples.codes {
            Codes::Eight(all) => all.iter().skip(c).step_by(k).map(|&v| curve.get(v.into())).collect(),
            Codes::Sixteen(all) => all.iter().skip(c).step_by(k).map(|&v| curve.get(v)).collect(),
        };
        Channel { name: (*name).into(), data }
    };
    names.iter().enumerate().map(plane).collect()
}

/// Code values to linear values.
#[derive(Debug)]
pub(crate) struct Curve(Vec<f32>);

impl Curve {
    /// For samples of `bits` bits; `data` leaves the sRGB curve out.
    pub fn of(bits: u8, data: bool) -> Self {
        let max = (1u32 << bits) - 1;
        let value = |i: u32| (f64::from(i) / f64::from(max)) as f32;
        Self((0..=max).map(|i| if data { value(i) } else { srgb_to_linear(value(i)) }).collect())
    }

    /// The value of code `i`.
    pub fn get(&self, i: u16) -> f32 {
        self.0.get(usize::from(i)).copied().unwrap_or(1.0)
    }
}

/// Writes a PNG of 8 or 16 bits, grey or RGB, with alpha where there is one.
pub(crate) fn encode_png(
    w: &mut dyn Write,
    planes: &Planes<'_>,
    options: &WriteOptions,
) -> io::Result<WriteReport> {
    let rgb = planes.rgb();
    let mut channels: Vec<(&[f32], bool)> =
        rgb[..if planes.grey { 1 } else { 3 }].iter().map(|&p| (p, options.already_encoded)).collect();
    channels.extend(planes.alpha.map(|a| (a, true)));
    let wide = options.png_bits > 8;
    let color = match channels.len() {
        1 => png::ColorType::Grayscale,
        2 => png::ColorType::GrayscaleAlpha,
        3 => png::ColorType::Rgb,
        _ => png::ColorType::Rgba,
    };
    let depth = if wide { png::BitDepth::Sixteen } else { png::BitDepth::Eight };
    let mut report = WriteReport::default();
    let n = planes.width * planes.height;
    let mut raw = Vec::with_capacity(n * channels.len() * if wide { 2 } else { 1 });
    for i in 0..n {
        for &(plane, straight) in &channels {
            let v = clip(plane[i], &mut report);
            let v = f64::from(if straight { v } else { linear_to_srgb(v) });
            if wide {
                raw.extend(((v * 65535.0).round() as u16).to_be_bytes());
            } else {
                raw.push((v * 255.0).round() as u8);
            }
        }
    }
    write_with_text(w, &raw, planes, (color, depth), &options.metadata)?;
    Ok(report)
}

fn clip(v: f32, report: &mut WriteReport) -> f32 {
    let c = v.clamp(0.0, 1.0);
    if c != v {
        report.clip(v.into(), c.into());
    }
    c
}

/// The encoder takes no text; it goes between header and pixels afterwards.
fn write_with_text(
    w: &mut dyn Write,
    raw: &[u8],
    planes: &Planes<'_>,
    (color, depth): (png::ColorType, png::BitDepth),
    metadata: &[(String, String)],
) -> io::Result<()> {
    let (width, height) = (planes.width as u32, planes.height as u32);
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::Balanced);
    let mut writer = encoder.write_header().map_err(io::Error::other)?;
    writer.write_image_data(raw).map_err(io::Error::other)?;
    writer.finish().map_err(io::Error::other)?;
    // Signature (8 bytes) and IHDR (25 bytes) come first in every PNG.
    let (head, tail) = file.split_at(33);
    w.write_all(head)?;
    for (name, value) in metadata {
        w.write_all(&text_chunk(name, value))?;
    }
    w.write_all(tail)
}

/// An iTXt chunk (PNG specification, third edition, 11.3.3.4): uncompressed UTF-8.
fn text_chunk(name: &str, value: &str) -> Vec<u8> {
    let keyword: String = name.chars().filter(|c| (' '..='~').contains(c)).take(79).collect();
    let mut body = b"iTXt".to_vec();
    body.extend(if keyword.trim().is_empty() { "Comment" } else { keyword.trim() }.bytes());
    // End of keyword, no compression, its method, no language, no translation.
    body.extend([0; 5]);
    body.extend(value.bytes().filter(|&b| b != 0));
    let mut crc = flate2::Crc::new();
    crc.update(&body);
    let mut chunk = ((body.len() - 4) as u32).to_be_bytes().to_vec();
    chunk.extend(&body);
    chunk.extend(crc.sum().to_be_bytes());
    chunk
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{decode_image, decode_image_with, write_image};

    fn round_trip(raster: &Raster, options: &WriteOptions, data: bool) -> Raster {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        write_image(&path, raster, options).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        decode_image_with(&path, &bytes, &ReadOptions { data, ..ReadOptions::default() }).unwrap()
    }

    /// All codes of `max` as linear values, in both directions.
    fn ramp(max: u32) -> Raster {
        let plane: Vec<f32> = (0..=max).map(|i| srgb_to_linear(i as f32 / max as f32)).collect();
        Raster::rgb(plane.len(), 1, [plane.clone(), plane.iter().rev().copied().collect(), plane])
    }

    #[test]
    fn every_code_comes_back() {
        for (bits, max) in [(8, 255u32), (16, 65535)] {
            let options = WriteOptions { png_bits: bits, ..WriteOptions::default() };
            let back = round_trip(&ramp(max), &options, true);
            assert!(back.low_range);
            let codes = back.channel("G").unwrap().iter().map(|v| (v * max as f32).round() as u32);
            assert!(codes.eq((0..=max).rev()), "{bits} bits");
        }
    }

    #[test]
    fn alpha_is_straight_and_clipping_is_counted() {
        let mut raster = Raster::rgb(2, 1, [vec![0.5, 2.0], vec![-1.0, 0.0], vec![1.0, 0.0]]);
        raster.channels.push(Channel { name: "A".into(), data: vec![0.5, 1.0] });
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.png");
        let report = write_image(&path, &raster, &WriteOptions::default()).unwrap();
        assert_eq!(report, WriteReport { clipped: 2, lost: 2.0, vanished: 0 });
        let back = decode_image(&path, &std::fs::read(&path).unwrap(), &crate::Limits::default()).unwrap();
        assert!((back.channel("A").unwrap()[0] - 0.5).abs() < 1.0 / 255.0);
        assert!((back.channel("R").unwrap()[0] - 0.5).abs() < 0.005);
    }

    #[test]
    fn encoded_values_are_taken_as_they_are() {
        let raster = Raster::rgb(1, 1, [vec![0.2], vec![0.4], vec![0.6]]);
        let back =
            round_trip(&raster, &WriteOptions { already_encoded: true, ..WriteOptions::default() }, true);
        assert_eq!(back.into_rgb().unwrap().map(|p| (p[0] * 255.0).round()), [51.0, 102.0, 153.0]);
    }

    #[test]
    fn text_is_a_chunk_with_its_checksum() {
        let chunk = text_chunk("steradian.version", "0.1 ε");
        assert_eq!(&chunk[4..8], b"iTXt");
        let mut crc = flate2::Crc::new();
        crc.update(&chunk[4..chunk.len() - 4]);
        assert_eq!(chunk[chunk.len() - 4..], crc.sum().to_be_bytes());
    }
}

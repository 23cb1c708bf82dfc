//! Images of every format: reading by content, writing by extension.

use crate::atomic::{plain, write_atomic, write_atomic_seek};
use crate::photograph::Photograph;
use crate::{FormatError, Limits, Raster, hdr, ldr, openexr, pfm, tga};
use std::fs::File;
use std::io::{self, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// How to read an image.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions {
    /// What may be allocated.
    pub limits: Limits,
    /// The layer of an EXR to read; the first one with colour where `None`. A layer is a part's name, or what
    /// stands before the last dot of a channel's name.
    pub layer: Option<String>,
    /// Read every channel of an EXR, not only the chosen layer's colour.
    pub all_channels: bool,
    /// Low-range files hold data (normals, roughness), not colour: values are m/255 without the sRGB curve.
    pub data: bool,
}

/// Reads the image `path`, whose format its first bytes tell: Radiance `.hdr`, OpenEXR, PFM, PNG, JPEG, TGA.
///
/// Values are linear; 8- and 16-bit files are decoded from sRGB and flagged `low_range`. Pixels that are not
/// finite pass: [`Raster::first_non_finite`] finds them.
pub fn read_image(path: &Path, limits: &Limits) -> Result<Raster, FormatError> {
    read_image_with(path, &ReadOptions { limits: *limits, ..ReadOptions::default() })
}

/// [`read_image`] with options.
pub fn read_image_with(path: &Path, options: &ReadOptions) -> Result<Raster, FormatError> {
    match encoded(path, options)? {
        Encoded::Raster(raster) => Ok(raster),
        Encoded::Bytes(bytes) => decode_image_with(path, &bytes, options),
    }
}

/// Reads the image `path` as [`read_image`] does, its samples left as small as the file has them.
pub fn read_photograph(path: &Path, limits: &Limits) -> Result<Photograph, FormatError> {
    let options = ReadOptions { limits: *limits, ..ReadOptions::default() };
    let raster = match encoded(path, &options)? {
        Encoded::Raster(raster) => raster,
        Encoded::Bytes(bytes) => match ldr::format(&bytes) {
            Some(format) => {
                let samples = ldr::samples(path, &bytes, format, &options)?;
                return Ok(Photograph::coded(samples));
            }
            None => decode_image_with(path, &bytes, &options)?,
        },
    };
    Photograph::of(raster).ok_or_else(|| FormatError::invalid(path, "has no colour"))
}

/// A file as far as it is decoded while it is read.
enum Encoded {
    Raster(Raster),
    Bytes(Vec<u8>),
}

fn encoded(path: &Path, options: &ReadOptions) -> Result<Encoded, FormatError> {
    let unreadable = |e: io::Error| FormatError::Unreadable { path: path.into(), why: plain(&e) };
    let (mut file, length) = open(path)?;
    let mut head = [0u8; HEAD];
    let n = read_up_to(&mut file, &mut head).map_err(unreadable)?;
    not_empty(path, &head[..n])?;
    // Before the rest is read: a device may have no end.
    let format = Format::of(path, &head[..n]).ok_or_else(|| unknown(path))?;
    if matches!(format, Format::Exr) && file.seek(SeekFrom::Start(0)).is_ok() {
        // Straight from the disk: the compressed bytes never lie in memory as a whole.
        let file = BufReader::with_capacity(1 << 18, file);
        return openexr::decode(path, file, length, options).map(Encoded::Raster);
    }
    options.limits.memory(path, u128::from(length), length)?;
    let mut bytes = Vec::new();
    bytes.extend_from_slice(&head[..n]);
    file.take(options.limits.max_memory).read_to_end(&mut bytes).map_err(unreadable)?;
    Ok(Encoded::Bytes(bytes))
}

/// Decodes an image that lies in memory (embedded in a mesh, or made by a test); `name` is for messages and
/// tells formats without a magic number apart.
pub fn decode_image(name: &Path, bytes: &[u8], limits: &Limits) -> Result<Raster, FormatError> {
    decode_image_with(name, bytes, &ReadOptions { limits: *limits, ..ReadOptions::default() })
}

/// [`decode_image`] with options.
pub fn decode_image_with(name: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Raster, FormatError> {
    not_empty(name, bytes)?;
    match Format::of(name, bytes) {
        Some(Format::Exr) => openexr::decode(name, io::Cursor::new(bytes), bytes.len() as u64, options),
        Some(Format::Hdr) => hdr::decode(name, bytes, &options.limits),
        Some(Format::Pfm) => pfm::decode(name, bytes, &options.limits),
        Some(Format::Ldr(format)) => ldr::decode(name, bytes, format, options),
        Some(Format::Tga) => tga::decode(name, bytes, options),
        None => Err(unknown(name)),
    }
}

/// The formats that are read.
enum Format {
    Exr,
    Hdr,
    Pfm,
    Ldr(ldr::LowRange),
    Tga,
}

impl Format {
    /// By the first bytes, of which [`HEAD`] suffice; a Targa by its name.
    fn of(name: &Path, head: &[u8]) -> Option<Self> {
        if openexr::is_exr(head) {
            Some(Self::Exr)
        } else if hdr::is_hdr(head) {
            Some(Self::Hdr)
        } else if pfm::is_pfm(head) {
            Some(Self::Pfm)
        } else if let Some(format) = ldr::format(head) {
            Some(Self::Ldr(format))
        } else {
            tga::is_tga(name).then_some(Self::Tga)
        }
    }
}

/// Bytes that tell the formats apart.
const HEAD: usize = 8;

fn unknown(name: &Path) -> FormatError {
    FormatError::invalid(name, format_args!("{NO_IMAGE} (Radiance .hdr, .exr, .pfm, .png, .jpg, .tga)"))
}

/// What is said of a file that is none of the images.
pub const NO_IMAGE: &str = "its first bytes are those of no image that is read here";

/// Is a file an image by its first bytes, whatever its name?
pub fn is_image(path: &Path) -> bool {
    let mut head = Vec::with_capacity(HEAD);
    let read = open(path).ok().and_then(|(f, _)| f.take(HEAD as u64).read_to_end(&mut head).ok());
    read.is_some() && Format::of(Path::new(""), &head).is_some()
}

/// Refuses a file without bytes.
pub(crate) fn not_empty(name: &Path, bytes: &[u8]) -> Result<(), FormatError> {
    if bytes.is_empty() { Err(FormatError::invalid(name, "the file is empty")) } else { Ok(()) }
}

/// Opens a regular file to read; whatever else has the name, or nothing, is [`FormatError::Unreadable`].
fn open(path: &Path) -> Result<(File, u64), FormatError> {
    steradian_base::open_file(path).map_err(|e| FormatError::Unreadable { path: path.into(), why: plain(&e) })
}

/// All bytes of `path`, refused where they would go beyond the memory limit.
pub(crate) fn read_bytes(path: &Path, limits: &Limits) -> Result<Vec<u8>, FormatError> {
    let (file, length) = open(path)?;
    limits.memory(path, u128::from(length), length)?;
    read_all(path, file, limits.max_memory)
}

/// All bytes of the regular file `path`, which is `what` ("a scene file"): more than `most` are none.
pub fn read_file(path: &Path, most: u64, what: &str) -> Result<Vec<u8>, FormatError> {
    let (file, length) = open(path)?;
    // Some files of the system's say that they are empty.
    let bytes = if length > most { None } else { Some(read_all(path, file, most + 1)?) };
    bytes.filter(|b| b.len() as u64 <= most).ok_or_else(|| {
        let size = if most >> 20 > 0 { format!("{} MiB", most >> 20) } else { format!("{} KiB", most >> 10) };
        FormatError::invalid(path, format!("longer than {size}, the limit of {what}"))
    })
}

/// [`read_file`] of a text.
pub fn read_text(path: &Path, most: u64, what: &str) -> Result<String, FormatError> {
    String::from_utf8(read_file(path, most, what)?).map_err(|_| FormatError::invalid(path, "not UTF-8 text"))
}

fn read_all(path: &Path, file: File, most: u64) -> Result<Vec<u8>, FormatError> {
    let mut bytes = Vec::new();
    let read = file.take(most).read_to_end(&mut bytes);
    read.map_err(|e| FormatError::Unreadable { path: path.into(), why: plain(&e) })?;
    Ok(bytes)
}

fn read_up_to(file: &mut File, buffer: &mut [u8]) -> io::Result<usize> {
    let mut n = 0;
    while n < buffer.len() {
        match file.read(&mut buffer[n..])? {
            0 => break,
            k => n += k,
        }
    }
    Ok(n)
}

/// Sample type of an EXR's channels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ExrSamples {
    /// 16-bit floats: values beyond 65504 clip and are counted.
    Half,
    /// 32-bit floats.
    #[default]
    Float,
}

/// Compression of an EXR.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ExrCompression {
    /// None.
    None,
    /// Run lengths.
    Rle,
    /// Deflate, blocks of 16 rows.
    #[default]
    Zip,
    /// Wavelet; the smallest for noisy images.
    Piz,
}

/// How to write an image.
#[derive(Debug, Clone, PartialEq)]
pub struct WriteOptions {
    /// Provenance and other pairs for the file's metadata. In an EXR the pair `envmap` = `latlong` or `cube`
    /// becomes the standard attribute. A PFM holds no metadata.
    pub metadata: Vec<(String, String)>,
    /// Sample type of an EXR.
    pub exr_samples: ExrSamples,
    /// Compression of an EXR.
    pub exr_compression: ExrCompression,
    /// Bits per sample of a PNG: 8 or 16.
    pub png_bits: u8,
    /// The values are display-referred already: a PNG takes them as they are, 0 … 1. Otherwise they are
    /// linear and the PNG writer applies the sRGB curve (IEC 61966-2-1).
    pub already_encoded: bool,
}

impl Default for WriteOptions {
    fn default() -> Self {
        Self {
            metadata: Vec::new(),
            exr_samples: ExrSamples::default(),
            exr_compression: ExrCompression::default(),
            png_bits: 8,
            already_encoded: false,
        }
    }
}

/// What a written file could not hold.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WriteReport {
    /// Samples that lie outside the format's range and were clipped.
    pub clipped: u64,
    /// Positive samples below the format's range, which became 0.
    pub vanished: u64,
    /// Sum of |given − written| over both kinds.
    pub lost: f64,
}

impl WriteReport {
    pub(crate) fn clip(&mut self, given: f64, written: f64) {
        self.clipped += 1;
        self.lost += (given - written).abs();
    }

    pub(crate) fn vanish(&mut self, given: f64) {
        self.vanished += 1;
        self.lost += given;
    }

    /// Both reports together.
    pub fn merge(&mut self, other: Self) {
        self.clipped += other.clipped;
        self.vanished += other.vanished;
        self.lost += other.lost;
    }
}

/// Writes `raster` in the format that the extension names: `.exr`, `.hdr`, `.pfm`, `.png`. The file appears
/// whole or not at all. Pixels that are not finite are refused.
pub fn write_image(path: &Path, raster: &Raster, options: &WriteOptions) -> Result<WriteReport, FormatError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let refuse = |why: String| FormatError::Unwritable { path: path.into(), why };
    let planes = Planes::of(raster).map_err(refuse)?;
    let mut report = WriteReport::default();
    match extension.as_str() {
        "exr" => write_atomic_seek(path, |w| {
            report = openexr::encode(w, raster, options)?;
            Ok(())
        }),
        "hdr" | "pic" => write_atomic(path, |w| {
            report = hdr::encode(w, planes.colored()?, &options.metadata)?;
            Ok(())
        }),
        "pfm" => write_atomic(path, |w| pfm::encode(w, planes.colored()?)),
        "png" => write_atomic(path, |w| {
            report = ldr::encode_png(w, planes.colored()?, options)?;
            Ok(())
        }),
        _ => Err(refuse(format!(
            "no image format is called '.{extension}'; there are .exr, .hdr, .pfm and .png"
        ))),
    }?;
    Ok(report)
}

/// A raster's planes, checked: none is short, all values are finite.
pub(crate) struct Planes<'a> {
    pub width: usize,
    pub height: usize,
    color: Option<[&'a [f32]; 3]>,
    /// A single plane served as all three.
    pub grey: bool,
    pub alpha: Option<&'a [f32]>,
}

impl<'a> Planes<'a> {
    fn of(raster: &'a Raster) -> Result<Self, String> {
        let (width, height) = (raster.width, raster.height);
        let n = width.checked_mul(height).filter(|&n| n > 0).ok_or("the image is empty")?;
        if let Some(c) = raster.channels.iter().find(|c| c.data.len() != n) {
            return Err(format!(
                "channel {} has {} values for {width} x {height} pixels",
                c.name,
                c.data.len()
            ));
        }
        if let Some((x, y, channel)) = raster.first_non_finite() {
            return Err(format!("pixel ({x}, {y}) of channel {channel} is not finite"));
        }
        let (r, g, b) = (raster.channel("R"), raster.channel("G"), raster.channel("B"));
        let y = raster.channel("Y");
        let (color, grey) = match (r, g, b, y) {
            (Some(r), Some(g), Some(b), _) => (Some([r, g, b]), false),
            (_, _, _, Some(y)) => (Some([y, y, y]), true),
            _ => (None, false),
        };
        Ok(Self { width, height, color, grey, alpha: raster.channel("A") })
    }

    /// Itself, where there is colour.
    fn colored(&self) -> io::Result<&Self> {
        let why = "the format needs the channels R, G and B, or Y; .exr takes any";
        self.color.map(|_| self).ok_or_else(|| io::Error::other(why))
    }

    /// The colour planes; [`Self::colored`] was asked before.
    pub fn rgb(&self) -> [&'a [f32]; 3] {
        self.color.unwrap_or([&[]; 3])
    }
}

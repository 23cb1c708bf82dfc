//! A first look at the header, before the library sees it: sizes within the limits, attributes within the
//! file.

use crate::image::ReadOptions;
use crate::{FormatError, atomic};
use std::io::{self, Read, Seek};
use std::path::Path;

/// Longest name of an attribute.
const MAX_NAME: usize = 255;

/// Attributes of a file; more belong to no picture.
const MAX_ATTRIBUTES: usize = 100_000;

/// Bytes of all attributes; the largest are small preview images.
const MAX_ATTRIBUTE_BYTES: u64 = 16 << 20;

/// Channels of a file; a renderer that writes every layer apart comes to hundreds. The library and the choice
/// of a layer compare them with each other.
const MAX_CHANNELS: usize = 4096;

/// Parts of a file.
const MAX_PARTS: usize = 1000;

/// Bytes of a channel's description behind its name.
const CHANNEL_BYTES: usize = 16;

/// Bit of the version that says that the file has several parts.
const MULTI_PART: u32 = 0x1000;

/// Walks the attributes of every part and checks the windows. `reader` begins and ends at the file's start.
pub(super) fn scan<R: Read + Seek>(
    name: &Path,
    reader: &mut R,
    length: u64,
    options: &ReadOptions,
) -> Result<(), FormatError> {
    let mut scan = Scan { name, reader, length, options, attribute_bytes: 0, channels: 0 };
    let result = scan.parts();
    let rewound = reader.rewind().map_err(|e| FormatError::invalid(name, atomic::plain(&e)));
    result.and(rewound)
}

struct Scan<'a, R> {
    name: &'a Path,
    reader: &'a mut R,
    length: u64,
    options: &'a ReadOptions,
    attribute_bytes: u64,
    channels: usize,
}

impl<R: Read + Seek> Scan<'_, R> {
    fn parts(&mut self) -> Result<(), FormatError> {
        let [_magic, version] = [self.u32()?, self.u32()?];
        let mut left = MAX_ATTRIBUTES;
        for _ in 0..=MAX_PARTS {
            let mut attributes = 0;
            while self.attribute()? {
                attributes += 1;
                left = left.checked_sub(1).ok_or_else(|| self.fault("damaged: too many attributes"))?;
            }
            // A file of several parts ends its headers with an empty one.
            if version & MULTI_PART == 0 || attributes == 0 {
                return Ok(());
            }
        }
        Err(self.fault(&format!("more parts than the limit of {MAX_PARTS}")))
    }

    /// One attribute; `false` at the end of a header.
    fn attribute(&mut self) -> Result<bool, FormatError> {
        let attribute = self.text()?;
        if attribute.is_empty() {
            return Ok(false);
        }
        let _kind = self.text()?;
        let size = self.u32()?;
        if u64::from(size) > self.length {
            return Err(self.fault("truncated in the header"));
        }
        self.attribute_bytes += u64::from(size);
        if self.attribute_bytes > MAX_ATTRIBUTE_BYTES {
            let mib = MAX_ATTRIBUTE_BYTES >> 20;
            return Err(self.fault(&format!("its attributes have more than the limit of {mib} MiB")));
        }
        let is_window = matches!(attribute.as_slice(), b"dataWindow" | b"displayWindow");
        if is_window && size == 16 {
            self.window(&String::from_utf8_lossy(&attribute))?;
        } else if attribute == b"channels" {
            self.channel_list(size as usize)?;
        } else {
            self.reader.seek_relative(size.into()).map_err(|e| self.io(&e))?;
        }
        Ok(true)
    }

    /// Counts the channels: each is a name, a zero, and numbers.
    fn channel_list(&mut self, size: usize) -> Result<(), FormatError> {
        let mut bytes = vec![0; size];
        self.reader.read_exact(&mut bytes).map_err(|e| self.io(&e))?;
        let mut rest = bytes.as_slice();
        while let Some(end) = rest.iter().position(|&b| b == 0).filter(|&end| end > 0) {
            self.channels += 1;
            if self.channels > MAX_CHANNELS {
                return Err(self.fault(&format!("more channels than the limit of {MAX_CHANNELS}")));
            }
            rest = rest.get(end + 1 + CHANNEL_BYTES..).unwrap_or_default();
        }
        Ok(())
    }

    fn window(&mut self, which: &str) -> Result<(), FormatError> {
        let [x0, y0, x1, y1] =
            [self.u32()?, self.u32()?, self.u32()?, self.u32()?].map(|v| i64::from(v as i32));
        let (width, height) = (x1 - x0 + 1, y1 - y0 + 1);
        if width <= 0 || height <= 0 {
            return Err(self.fault(&format!("the image is empty: its {which} is {width} x {height} pixels")));
        }
        self.options.limits.image(self.name, width as u64, height as u64, 1, self.length).map(|_| ())
    }

    fn u32(&mut self) -> Result<u32, FormatError> {
        let mut b = [0; 4];
        self.reader.read_exact(&mut b).map_err(|e| self.io(&e))?;
        Ok(u32::from_le_bytes(b))
    }

    /// Bytes up to a zero.
    fn text(&mut self) -> Result<Vec<u8>, FormatError> {
        let mut text = Vec::new();
        loop {
            let mut b = [0];
            self.reader.read_exact(&mut b).map_err(|e| self.io(&e))?;
            match b[0] {
                0 => return Ok(text),
                _ if text.len() == MAX_NAME => {
                    return Err(self.fault("damaged: a name in the header is too long"));
                }
                c => text.push(c),
            }
        }
    }

    fn io(&self, e: &io::Error) -> FormatError {
        if e.kind() == io::ErrorKind::UnexpectedEof {
            self.fault("truncated in the header")
        } else {
            self.fault(&atomic::plain(e))
        }
    }

    fn fault(&self, why: &str) -> FormatError {
        FormatError::invalid(self.name, why)
    }
}

//! Files of numbers that a page loads as scripts, and where in them each array lies.

use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::{Value, json};
use std::io::Write;

/// A file on its way: arrays one after the other.
pub struct Data {
    name: String,
    bytes: Vec<u8>,
}

/// Where an array lies.
#[derive(Debug, Clone, PartialEq)]
pub struct Place {
    file: String,
    at: usize,
    bytes: usize,
    element: usize,
}

impl Place {
    /// As JSON, for the viewer.
    pub fn json(&self) -> Value {
        json!([self.file, self.at, self.bytes, self.element])
    }
}

impl Data {
    /// An empty file called `name`.
    pub fn new(name: &str) -> Self {
        Self { name: name.into(), bytes: Vec::new() }
    }

    /// Appends an array of elements of `element` bytes. First all first bytes are stored, then all second ones, and so on,
    /// which gzip packs better: neighbours have like exponents.
    pub fn push(&mut self, array: &[u8], element: usize) -> Place {
        let element = if element > 0 && array.len().is_multiple_of(element) { element } else { 1 };
        let place = Place { file: self.name.clone(), at: self.bytes.len(), bytes: array.len(), element };
        (0..element).for_each(|k| self.bytes.extend(array.iter().skip(k).step_by(element)));
        place
    }

    /// The script that hands the bytes to the viewer.
    pub fn finish(self) -> (String, Vec<u8>) {
        let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
        // A vector takes any number of bytes.
        let packed = gzip.write_all(&self.bytes).and_then(|()| gzip.finish()).unwrap_or_default();
        let text = format!("steradian.file(\"{}\", \"{}\");\n", self.name, base64(&packed));
        (format!("{}.js", self.name), text.into_bytes())
    }
}

/// RFC 4648 section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let word = group.iter().enumerate().fold(0u32, |w, (i, b)| w | u32::from(*b) << (16 - 8 * i));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= group.len() { char::from(digit) } else { '=' });
        }
    }
    out
}

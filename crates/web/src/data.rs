//! Files of numbers that a page loads as scripts, and where in them each array lies.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
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
    differences: bool,
}

impl Place {
    /// As JSON, for the viewer.
    pub fn json(&self) -> Value {
        json!([self.file, self.at, self.bytes, self.element, u8::from(self.differences)])
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
        let (file, at, bytes) = (self.name.clone(), self.bytes.len(), array.len());
        let place = Place { file, at, bytes, element, differences: false };
        (0..element).for_each(|k| self.bytes.extend(array.iter().skip(k).step_by(element)));
        place
    }

    /// Appends texels of four halves. Of all but the first the differences of their bits from the texel before are stored:
    /// in smooth pictures they are small.
    pub fn push_halves(&mut self, texels: &[[u16; 4]]) -> Place {
        let mut before = [0u16; 4];
        let mut bytes = Vec::with_capacity(8 * texels.len());
        for t in texels {
            bytes.extend([0, 1, 2, 3].into_iter().flat_map(|k| t[k].wrapping_sub(before[k]).to_le_bytes()));
            before = *t;
        }
        Place { differences: true, ..self.push(&bytes, 8) }
    }

    /// The script that hands the bytes to the viewer.
    pub fn finish(self) -> (String, Vec<u8>) {
        let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
        // A vector takes any number of bytes.
        let packed = gzip.write_all(&self.bytes).and_then(|()| gzip.finish()).unwrap_or_default();
        let text = format!("steradian.file(\"{}\", \"{}\");\n", self.name, STANDARD.encode(&packed));
        (format!("{}.js", self.name), text.into_bytes())
    }
}

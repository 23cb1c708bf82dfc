//! Files of numbers that a page loads as scripts, and where in them each array lies.

use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::{Value, json};
use std::io::Write;

/// A file on its way: arrays one after the other, each once.
pub struct Data {
    name: String,
    bytes: Vec<u8>,
    places: Vec<Place>,
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
        Self { name: name.into(), bytes: Vec::new(), places: Vec::new() }
    }

    /// Appends an array of elements of `element` bytes. First all first bytes are stored, then all second
    /// ones, and so on, which gzip packs better: neighbours have like exponents.
    pub fn push(&mut self, array: &[u8], element: usize) -> Place {
        let element = if element > 0 && array.len().is_multiple_of(element) { element } else { 1 };
        let sorted: Vec<u8> =
            (0..element).flat_map(|k| array.iter().skip(k).step_by(element)).copied().collect();
        let same = |p: &&Place| {
            (p.bytes, p.element) == (sorted.len(), element) && self.bytes[p.at..p.at + p.bytes] == sorted
        };
        // Objects under one light have tables in common.
        if let Some(known) = self.places.iter().find(same) {
            return known.clone();
        }
        let (file, at, bytes) = (self.name.clone(), self.bytes.len(), sorted.len());
        let place = Place { file, at, bytes, element, differences: false };
        self.bytes.extend(sorted);
        self.places.push(place.clone());
        place
    }

    /// Appends texels of four halves. Of all but the first the differences of their bits from the texel
    /// before are stored: in smooth pictures they are small.
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
        let text = format!("steradian.file(\"{}\", \"{}\");\n", self.name, characters(&packed));
        (format!("{}.js", self.name), text.into_bytes())
    }
}

/// Bytes as characters of a script: seven bits each, a seventh more than the bytes (base64 takes a third).
/// What may not stand in a string stands 128 higher, in two bytes of UTF-8; readers look at seven bits alone.
fn characters(bytes: &[u8]) -> String {
    let mut out = String::with_capacity(bytes.len() / 4 * 5);
    let (mut bits, mut have) = (0u32, 0);
    let mut put = |seven: u32| {
        let own = (seven & 127) as u8;
        out.push(char::from(if matches!(own, 0 | b'\n' | b'\r' | b'"' | b'\\') { own + 128 } else { own }));
    };
    for b in bytes {
        bits = bits << 8 | u32::from(*b);
        have += 8;
        while have >= 7 {
            have -= 7;
            put(bits >> have);
        }
    }
    if have > 0 {
        put(bits << (7 - have));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the viewer does.
    fn bytes(text: &str) -> Vec<u8> {
        let (mut bits, mut have, mut out) = (0u32, 0, Vec::new());
        for c in text.chars() {
            bits = bits << 7 | (c as u32 & 127);
            have += 7;
            if have >= 8 {
                have -= 8;
                out.push((bits >> have) as u8);
            }
        }
        out
    }

    #[test]
    fn equal_arrays_are_stored_once() {
        let mut data = Data::new("data");
        let (a, b, c) =
            (data.push(&[1, 2, 3, 4], 2), data.push(&[1, 2, 3, 5], 2), data.push(&[1, 2, 3, 4], 2));
        assert!(a == c && a != b && data.bytes == [1, 3, 2, 4, 1, 3, 2, 5]);
        assert_ne!(data.push(&[1, 2, 3, 4], 1), a);
    }

    #[test]
    fn characters_hold_all_bytes_and_nothing_that_ends_a_string() {
        for len in [0, 1, 2, 6, 7, 8, 600] {
            let all: Vec<u8> = (0..len).map(|k: u32| (k * k + 13 * k) as u8).collect();
            let text = characters(&all);
            assert_eq!(bytes(&text), all);
            assert!(!text.contains(['\0', '\n', '\r', '"', '\\']), "{len}");
        }
    }
}

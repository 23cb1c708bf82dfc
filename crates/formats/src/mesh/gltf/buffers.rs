//! Buffers, buffer views and the images in them.

use super::json::{Root, View};
use crate::FormatError;
use crate::mesh::source::Source;

/// The bytes of all buffers. The first may be the binary chunk of a GLB.
pub struct Buffers<'a> {
    views: &'a [View],
    data: Vec<Bytes<'a>>,
}

enum Bytes<'a> {
    Chunk(&'a [u8]),
    Owned(Vec<u8>),
}

impl Bytes<'_> {
    fn get(&self) -> &[u8] {
        match self {
            Self::Chunk(b) => b,
            Self::Owned(b) => b,
        }
    }
}

impl<'a> Buffers<'a> {
    /// Reads every buffer.
    pub fn read(root: &'a Root, chunk: Option<&'a [u8]>, source: &mut Source) -> Result<Self, FormatError> {
        let mut data = Vec::with_capacity(root.buffers.len());
        for (i, buffer) in root.buffers.iter().enumerate() {
            let bytes = match (&buffer.uri, chunk) {
                (Some(uri), _) => Bytes::Owned(read_uri(uri, source)?),
                (None, Some(chunk)) if i == 0 => Bytes::Chunk(chunk),
                _ => return Err(source.fault(format_args!("buffer {i} has no data"))),
            };
            let (have, need) = (bytes.get().len() as u64, buffer.byteLength);
            if have < need {
                return Err(
                    source.fault(format_args!("buffer {i} has {have} of its {need} bytes (truncated?)"))
                );
            }
            data.push(bytes);
        }
        Ok(Self { views: &root.bufferViews, data })
    }

    /// The bytes of a buffer view and its stride (0: tight).
    pub fn view(&self, index: usize) -> Result<(&[u8], u64), String> {
        let view = self.views.get(index).ok_or_else(|| format!("there is no buffer view {index}"))?;
        let buffer =
            self.data.get(view.buffer).ok_or_else(|| format!("there is no buffer {}", view.buffer))?;
        let start = usize::try_from(view.byteOffset).ok();
        let end = view.byteOffset.checked_add(view.byteLength).and_then(|e| usize::try_from(e).ok());
        let bytes = start.zip(end).and_then(|(s, e)| buffer.get().get(s..e));
        let bytes = bytes.ok_or_else(|| format!("buffer view {index} reaches beyond its buffer"))?;
        Ok((bytes, view.byteStride.unwrap_or(0)))
    }
}

/// The content of a `data:` URI or of a file below the folder.
pub fn read_uri(uri: &str, source: &mut Source) -> Result<Vec<u8>, FormatError> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (kind, text) = data.split_once(',').ok_or_else(|| source.fault("a data URI without a comma"))?;
        if !kind.ends_with(";base64") {
            return Err(source.fault("a data URI that is not base64"));
        }
        source.spend(text.len() as u64 / 4 * 3, 1)?;
        return base64(text.as_bytes()).ok_or_else(|| source.fault("a data URI with bad base64"));
    }
    let name = percent_decode(uri).ok_or_else(|| source.fault(format_args!("bad URI {uri:?}")))?;
    source.read_reference(&name)
}

/// RFC 4648, section 4; padding may be missing, blanks may not.
fn base64(text: &[u8]) -> Option<Vec<u8>> {
    let text = text.strip_suffix(b"==").or(text.strip_suffix(b"=")).unwrap_or(text);
    let mut out = Vec::with_capacity(text.len() / 4 * 3 + 2);
    for group in text.chunks(4) {
        let mut word = 0u32;
        for &c in group {
            let digit = match c {
                b'A'..=b'Z' => c - b'A',
                b'a'..=b'z' => c - b'a' + 26,
                b'0'..=b'9' => c - b'0' + 52,
                b'+' | b'-' => 62,
                b'/' | b'_' => 63,
                _ => return None,
            };
            word = word << 6 | u32::from(digit);
        }
        let bytes = match group.len() {
            4 => 3,
            3 => 2,
            2 => 1,
            _ => return None,
        };
        word <<= 6 * (4 - group.len());
        out.extend_from_slice(&word.to_be_bytes()[1..1 + bytes]);
    }
    Some(out)
}

/// RFC 3986, section 2.1.
fn percent_decode(uri: &str) -> Option<String> {
    let mut out = Vec::with_capacity(uri.len());
    let mut bytes = uri.bytes();
    while let Some(b) = bytes.next() {
        if b != b'%' {
            out.push(b);
            continue;
        }
        let digit = |b: Option<u8>| char::from(b?).to_digit(16);
        out.push((digit(bytes.next())? * 16 + digit(bytes.next())?) as u8);
    }
    String::from_utf8(out).ok().filter(|s| !s.contains('\0'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_follows_the_test_vectors_of_rfc_4648() {
        for (text, want) in [
            ("", ""),
            ("Zg==", "f"),
            ("Zm8=", "fo"),
            ("Zm9v", "foo"),
            ("Zm9vYg==", "foob"),
            ("Zm9vYmE", "fooba"),
        ] {
            assert_eq!(base64(text.as_bytes()), Some(want.as_bytes().to_vec()));
        }
        assert!(base64(b"Z").is_none() && base64(b"Zm 9").is_none());
    }

    #[test]
    fn uris_are_percent_decoded() {
        assert_eq!(percent_decode("a%20b.bin").as_deref(), Some("a b.bin"));
        assert!(
            percent_decode("a%2").is_none()
                && percent_decode("%00").is_none()
                && percent_decode("%ff").is_none()
        );
    }
}

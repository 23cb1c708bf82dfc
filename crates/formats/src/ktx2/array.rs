//! Arrays of images.

use super::{Supercompression, TextureLevels, decode};
use crate::image::{WriteReport, read_bytes};
use crate::texel::TexelFormat;
use crate::{FormatError, Limits, StoredTexture};
use std::path::Path;

/// Images of one size in layers, and their mip levels.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TextureArray {
    /// Width of level 0 in texels.
    pub width: usize,
    /// Height of level 0 in texels.
    pub height: usize,
    /// Images of a level.
    pub layers: usize,
    /// Level by level from the largest: `layers` images of rows from the top, R G B A interleaved.
    pub levels: Vec<Vec<f32>>,
    /// Keys and values.
    pub metadata: Vec<(String, String)>,
}

impl TextureArray {
    /// The value of `key`.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.metadata.iter().find(|(k, _)| k == key).map(|(_, v)| v.as_str())
    }
}

/// Writes `array` to `path` as a two-dimensional array texture, whole or not at all. What does not fit the
/// format is counted; values that are not finite are refused.
pub fn write_ktx2_array(
    path: &Path,
    array: TextureArray,
    format: TexelFormat,
    compression: Supercompression,
) -> Result<WriteReport, FormatError> {
    let TextureArray { width, height, layers, levels, metadata } = array;
    let images = TextureLevels { width, height, faces: layers, levels, metadata };
    StoredTexture::of_layers(path, &images, format)?.write_layers(path, layers, compression)
}

/// Reads the array texture `path`; one image is an array of one.
pub fn read_ktx2_array(path: &Path, limits: &Limits) -> Result<TextureArray, FormatError> {
    decode_ktx2_array(path, &read_bytes(path, limits)?, limits)
}

/// Decodes an array texture that lies in memory, as [`read_ktx2_array`]; `name` is for messages.
pub fn decode_ktx2_array(name: &Path, bytes: &[u8], limits: &Limits) -> Result<TextureArray, FormatError> {
    let (t, layers) = decode::decode_layers(name, bytes, limits)?;
    if layers == 0 && t.faces == 6 {
        return Err(FormatError::invalid(name, "a cube; an array of images is read here".to_string()));
    }
    let TextureLevels { width, height, faces, levels, metadata } = t;
    Ok(TextureArray { width, height, layers: faces, levels, metadata })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decode_ktx2;

    fn array(layers: usize) -> TextureArray {
        let texels = |side: usize| (0..side * side * layers * 4).map(|i| i as f32 * 0.5 - 7.0).collect();
        TextureArray {
            width: 4,
            height: 4,
            layers,
            levels: vec![texels(4), texels(2)],
            metadata: vec![("a".into(), "b".into())],
        }
    }

    #[test]
    fn arrays_come_back_and_are_no_images() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.ktx2");
        for layers in [1, 2, 6, 25] {
            for (format, c) in [
                (TexelFormat::Rgba16f, Supercompression::None),
                (TexelFormat::Rgba32f, Supercompression::Zstd),
            ] {
                write_ktx2_array(&path, array(layers), format, c).unwrap();
                let back = read_ktx2_array(&path, &Limits::default()).unwrap();
                assert_eq!((back.layers, &back.levels), (layers, &array(layers).levels));
                assert_eq!(back.get("a"), Some("b"));
                let bytes = std::fs::read(&path).unwrap();
                // layerCount and faceCount of the header.
                assert_eq!((bytes[32], bytes[36]), (layers as u8, 1));
                assert_eq!(decode_ktx2(&path, &bytes, &Limits::default()).is_ok(), layers == 1);
                for cut in [bytes.len() - 1, 100, 40] {
                    assert!(decode_ktx2_array(&path, &bytes[..cut], &Limits::default()).is_err());
                }
            }
        }
    }

    #[test]
    fn damaged_arrays_do_not_panic_or_allocate() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.ktx2");
        write_ktx2_array(&path, array(3), TexelFormat::Rgba16f, Supercompression::None).unwrap();
        let good = std::fs::read(&path).unwrap();
        for at in 0..good.len().min(200) {
            let mut bad = good.clone();
            bad[at] ^= 0xff;
            let _ = decode_ktx2_array(&path, &bad, &Limits::default());
        }
        let mut none = array(1);
        none.layers = 0;
        assert!(write_ktx2_array(&path, none, TexelFormat::Rgba16f, Supercompression::None).is_err());
    }
}

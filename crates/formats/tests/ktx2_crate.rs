//! Our KTX2 files in the eyes of an independent parser, the crate `ktx2`.

use ktx2::{ColorPrimaries, Format, Reader, SupercompressionScheme, TransferFunction};
use std::io::Read;
use steradian_formats::packed::{decode_r11g11b10, decode_rgb9e5};
use steradian_formats::{Supercompression, TexelFormat, TextureLevels, write_ktx2_as};

/// A cube of 8 texels a side with three levels: level m holds m + 1 in red, the face in green, 0.5 in blue.
fn texture() -> TextureLevels {
    let mut t = TextureLevels { width: 8, height: 8, faces: 6, ..TextureLevels::default() };
    for m in 0..3 {
        let (w, h) = t.size(m);
        let texel = |k: usize| [(m + 1) as f32, (k / (w * h)) as f32, 0.5, 1.0];
        t.levels.push((0..6 * w * h).flat_map(texel).collect());
    }
    t.metadata = vec![("steradian.profile".into(), "bevy".into())];
    t
}

fn inflated(data: &[u8], compression: Supercompression) -> Vec<u8> {
    let mut out = Vec::new();
    match compression {
        Supercompression::None => out.extend(data),
        Supercompression::Zstd => {
            ruzstd::decoding::StreamingDecoder::new(data)
                .expect("a frame")
                .read_to_end(&mut out)
                .expect("whole data");
        }
        Supercompression::Zlib => {
            flate2::read::ZlibDecoder::new(data).read_to_end(&mut out).expect("whole data");
        }
    }
    out
}

#[test]
fn an_independent_parser_finds_what_was_written() {
    let t = texture();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.ktx2");
    let half = |b: &[u8]| f32::from(half::f16::from_le_bytes([b[0], b[1]]));
    let word = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let single = |b: &[u8]| f32::from_bits(word(b));
    for (format, want, size, type_size) in [
        (TexelFormat::Rgba16f, Format::R16G16B16A16_SFLOAT, 8, 2),
        (TexelFormat::Rgba32f, Format::R32G32B32A32_SFLOAT, 16, 4),
        (TexelFormat::Rgb9e5, Format::E5B9G9R9_UFLOAT_PACK32, 4, 4),
        (TexelFormat::R11g11b10, Format::B10G11R11_UFLOAT_PACK32, 4, 4),
    ] {
        for (compression, scheme) in [
            (Supercompression::None, None),
            (Supercompression::Zstd, Some(SupercompressionScheme::Zstandard)),
            (Supercompression::Zlib, Some(SupercompressionScheme::ZLIB)),
        ] {
            write_ktx2_as(&path, &t, format, compression).unwrap();
            let bytes = std::fs::read(&path).unwrap();
            let reader = Reader::new(&bytes).unwrap_or_else(|e| panic!("{format:?}: {e:?}"));
            let h = reader.header();
            assert_eq!((h.format, h.type_size, h.supercompression_scheme), (Some(want), type_size, scheme));
            assert_eq!((h.pixel_width, h.pixel_height, h.pixel_depth), (8, 8, 0));
            assert_eq!((h.face_count, h.layer_count, h.level_count), (6, 0, 3));
            assert_eq!(reader.color_primaries(), Some(ColorPrimaries::BT709));
            assert_eq!(reader.transfer_function(), Some(TransferFunction::Linear));
            let known: Vec<(String, Vec<u8>)> =
                reader.key_value_data().map(|(k, v)| (k.to_string(), v.to_vec())).collect();
            let value = |key: &str| known.iter().find(|(k, _)| k == key).map(|(_, v)| v.clone());
            assert_eq!(value("steradian.profile"), Some(b"bevy\0".to_vec()));
            assert_eq!(value("KTXorientation"), Some(b"rd\0".to_vec()));
            for (m, level) in reader.levels().enumerate() {
                let data = inflated(level.data, compression);
                let n = 8 >> m;
                assert_eq!(data.len(), 6 * n * n * size);
                assert_eq!(level.uncompressed_byte_length, data.len() as u64);
                for (k, b) in data.chunks_exact(size).enumerate() {
                    let rgb = match format {
                        TexelFormat::Rgba16f => [half(b), half(&b[2..]), half(&b[4..])],
                        TexelFormat::Rgba32f => [single(b), single(&b[4..]), single(&b[8..])],
                        TexelFormat::Rgb9e5 => decode_rgb9e5(word(b)),
                        _ => decode_r11g11b10(word(b)),
                    };
                    assert_eq!(rgb, [(m + 1) as f32, (k / (n * n)) as f32, 0.5], "{format:?} level {m}");
                }
            }
        }
    }
}

//! Valid files, damaged: cut at every byte, and with single bytes changed.

use crate::{FORMATS, decode, files, name};

/// Formats whose every strict prefix is an error; of the others a prefix may be a smaller valid file.
const STRICT: [&str; 10] = ["hdr", "exr", "pfm", "png", "jpg", "tga", "ktx2", "ktx", "dds", "safetensors"];

/// Changed files per format; `STERADIAN_FULL=1` makes a hundred times as many.
const MUTATIONS: usize = 4000;

#[test]
fn truncated_anywhere() {
    for format in FORMATS {
        // The checksum behind a PNG's end marker may be missing.
        let spare = if format == "png" { 4 } else { 0 };
        for (path, bytes) in files(format, "valid") {
            for n in 0..bytes.len() - spare {
                let result = decode(format, name(&path), &bytes[..n]);
                // What lies behind the part and the level that are read may be missing.
                let may_be_whole = !STRICT.contains(&format)
                    || ["mip", "two_parts"].iter().any(|n| path.to_string_lossy().contains(n));
                assert!(may_be_whole || result.is_err(), "{} cut at {n} is read", path.display());
                if let Err(e) = result {
                    assert_eq!(e.lines().count(), 1, "{e}");
                }
            }
        }
    }
}

#[test]
fn one_byte_changed() {
    let mut random = 1u64;
    let mut next = move |n: usize| {
        // Knuth's MMIX generator; its upper bits are good.
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (random >> 33) as usize % n
    };
    for format in FORMATS {
        let files = files(format, "valid");
        for i in 0..if steradian_testkit::full() { 100 * MUTATIONS } else { MUTATIONS } {
            let (path, bytes) = &files[i % files.len()];
            let mut bytes = bytes.clone();
            let at = next(bytes.len());
            bytes[at] = match next(4) {
                0 => 0,
                1 => 255,
                2 => bytes[at] ^ (1 << next(8)),
                _ => next(256) as u8,
            };
            if let Err(e) = decode(format, name(path), &bytes) {
                assert_eq!(e.lines().count(), 1, "{e}");
            }
        }
    }
}

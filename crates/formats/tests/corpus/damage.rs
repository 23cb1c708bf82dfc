//! Valid files, damaged: cut at every byte, and in ways drawn from a fixed seed.

use crate::{FORMATS, decode, files, name};
use std::time::{Duration, Instant};
use steradian_testkit::Mutator;

/// Formats whose every strict prefix is an error; of the others a prefix may be a smaller valid file.
const STRICT: [&str; 11] =
    ["hdr", "exr", "pfm", "png", "jpg", "tga", "ktx2", "ktx", "dds", "safetensors", "ptm"];

/// Damaged files per format, of a few kilobytes each; `STERADIAN_FULL=1` makes a hundred times as many.
const MUTATIONS: usize = 15_000;

/// What any of them may take.
const MOST_TIME: Duration = Duration::from_secs(2);

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

/// No panic, a message of one line, and no more time than a second file of the kind would take.
#[test]
fn damaged_files_are_read_or_refused() {
    let mut damage = Mutator::new(1);
    for format in FORMATS {
        let files = [files(format, "valid"), files(format, "fuzzed")].concat();
        for i in 0..if steradian_testkit::full() { 100 * MUTATIONS } else { MUTATIONS } {
            let (path, bytes) = &files[i % files.len()];
            let other = &files[damage.below(files.len())].1;
            let bytes = damage.damage(bytes, other);
            let start = Instant::now();
            if let Err(e) = decode(format, name(path), &bytes) {
                assert_eq!(e.lines().count(), 1, "{e}");
            }
            let time = start.elapsed();
            assert!(time < MOST_TIME, "{format}: {i} took {time:?}: {bytes:?}");
        }
    }
}

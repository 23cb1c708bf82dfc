//! The corpus of small files, by format and verdict: `valid` decodes, `invalid` gives an error, `fuzzed`
//! (what fuzzers found, and generated damage) gives either; nothing panics or takes more memory than the
//! limits allow.
//!
//! Files that the generator makes must be what it makes:
//! `STERADIAN_BLESS=1 cargo test -p steradian-formats --test corpus` writes them. Files that it does not know
//! (found by a fuzzer) are replayed as well.

mod damage;
mod generate;
mod generate_exr;
mod generate_measured;

use std::path::{Path, PathBuf};
use steradian_formats::*;

/// Every format, by folder. Meshes have a test of their own.
const FORMATS: [&str; 19] = [
    "hdr",
    "exr",
    "pfm",
    "png",
    "jpg",
    "tga",
    "ktx2",
    "ktx",
    "dds",
    "safetensors",
    "csv",
    "ptm",
    "lp",
    "bsdf",
    "cornell",
    "astm",
    "alta",
    "brdflab",
    "merl_anisotropic",
];

/// Limits that a few kilobytes can never need.
fn limits() -> Limits {
    Limits { max_side: 4096, max_memory: 64 << 20, max_ratio: 20_000 }
}

/// Decodes by format; the error is its text.
fn decode(format: &str, name: &Path, bytes: &[u8]) -> Result<(), String> {
    let limits = limits();
    let result = match format {
        "ktx2" => decode_ktx2(name, bytes, &limits).map(|_| ()),
        "ktx" => decode_ktx1(name, bytes, &limits).map(|_| ()),
        "dds" => decode_dds(name, bytes, &limits).map(|_| ()),
        "safetensors" => decode_tensors(name, bytes, &limits).map(|_| ()),
        "csv" => decode_csv(name, bytes, &limits).and_then(|t| t.vectors(["x", "y", "z"]).map(|_| ())),
        "ptm" => decode_ptm(name, bytes, &limits).map(|_| ()),
        "bsdf" => decode_bsdf(name, bytes, &limits).map(|_| ()),
        "cornell" => decode_cornell(name, bytes, &limits).map(|_| ()),
        "astm" => decode_astm(name, bytes, &limits).map(|_| ()),
        "alta" => decode_alta(name, bytes, &limits).map(|_| ()),
        "brdflab" => decode_brdflab(name, bytes, &limits).map(|_| ()),
        "merl_anisotropic" => decode_merl_anisotropic(name, bytes, &limits).map(|_| ()),
        "lp" => decode_lp(name, bytes, &limits).map(|_| ()),
        "exr" => {
            let all = ReadOptions { limits, all_channels: true, ..ReadOptions::default() };
            decode_image_with(name, bytes, &all).map(|_| ())
        }
        _ => decode_image(name, bytes, &limits).map(|_| ()),
    };
    result.map_err(|e| e.to_string())
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus")
}

/// The files of a folder, in order.
fn files(format: &str, verdict: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let Ok(dir) = std::fs::read_dir(root().join(format).join(verdict)) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = dir.map(|e| e.expect("an entry").path()).collect();
    paths.sort();
    paths.into_iter().map(|p| (p.clone(), std::fs::read(p).expect("a readable file"))).collect()
}

/// File name only, as messages show it.
fn name(path: &Path) -> &Path {
    path.file_name().map_or(path, Path::new)
}

#[test]
fn the_corpus_is_what_the_generator_makes() {
    let bless = std::env::var_os("STERADIAN_BLESS").is_some();
    for (relative, bytes) in generate::all() {
        let path = root().join(&relative);
        assert!(bytes.len() <= 4096, "{relative} has {} bytes", bytes.len());
        if bless {
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("a new folder");
            std::fs::write(&path, &bytes).expect("a new file");
        }
        let found = std::fs::read(&path).unwrap_or_default();
        assert!(found == bytes, "{relative} is stale: STERADIAN_BLESS=1 writes it anew");
    }
}

#[test]
fn verdicts_hold() {
    for format in FORMATS {
        let valid = files(format, "valid");
        assert!(!valid.is_empty(), "no valid {format}");
        for (path, bytes) in valid {
            decode(format, name(&path), &bytes)
                .unwrap_or_else(|e| panic!("{} is valid: {e}", path.display()));
        }
        let invalid = files(format, "invalid");
        assert!(!invalid.is_empty(), "no invalid {format}");
        for (path, bytes) in invalid {
            let error = decode(format, name(&path), &bytes).err();
            let error = error.unwrap_or_else(|| panic!("{} is invalid", path.display()));
            let file = name(&path).to_string_lossy().into_owned();
            assert!(
                error.starts_with(&file) && error.lines().count() == 1,
                "not one line that names it: {error}"
            );
        }
        for (path, bytes) in files(format, "fuzzed") {
            let _ = decode(format, name(&path), &bytes);
        }
    }
}

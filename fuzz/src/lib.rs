//! What the fuzz targets share.

use glam::DVec3;
use std::path::{Path, PathBuf};
use steradian_brdf::{Files, parse_with};
use steradian_formats::Limits;

/// Limits small enough that a fuzzer's memory bound never trips on an honest allocation.
pub fn limits() -> Limits {
    Limits { max_side: 4096, max_memory: 256 << 20, max_ratio: 20_000 }
}

/// Writes the files of a reflectance that is read by path into a folder of this process, and reads `model`:FIRST`rest`, FIRST
/// the path of the first: it is refused in one line, or finite wherever it is looked at.
pub fn reflectance(model: &str, files: &[(&str, &[u8])], rest: &str) {
    let folder = std::env::temp_dir().join(format!("steradian-fuzz-{model}-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder for temporary files");
    let write = |(name, bytes): &(&str, &[u8])| -> PathBuf {
        let path = Path::new(&folder).join(name);
        std::fs::write(&path, bytes).expect("a temporary file");
        path
    };
    let paths: Vec<PathBuf> = files.iter().map(write).collect();
    match parse_with(&format!("{model}:{}{rest}", paths[0].display()), Files::Any) {
        Ok(brdf) => {
            for (i, o) in [(0.1, 0.2), (0.7, -0.7), (1.5, 1.2), (0.3, -1.56)] {
                let at = |t: f64| DVec3::new(t.sin(), 0.0, t.cos());
                assert!(brdf.eval(at(i), at(o)).iter().all(|v| v.is_finite()));
            }
        }
        Err(e) => assert_eq!(e.to_string().lines().count(), 1, "{e}"),
    }
}

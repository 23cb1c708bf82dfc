//! Files made to cost more than they weigh: each is read or refused in bounded time and memory.
//!
//! One test, so that the peak of the process's memory is that of one file.

mod images;
mod meshes;
mod tables;

use std::path::Path;
use std::time::{Duration, Instant};
use steradian_formats::*;

/// What a file may take to be read or refused. Each takes a tenth of it on an idle machine.
const MOST_TIME: Duration = Duration::from_secs(2);

/// The limit that the readers get.
const MEMORY: u64 = 64 << 20;

/// A hostile file.
pub struct Bomb {
    name: &'static str,
    bytes: Vec<u8>,
    /// A part of the message; `None` where it is read.
    fault: Option<&'static str>,
}

/// A bomb that is read in spite of all.
pub fn harmless(name: &'static str, bytes: Vec<u8>) -> Bomb {
    Bomb { name, bytes, fault: None }
}

/// A bomb that is refused.
pub fn refused(name: &'static str, bytes: Vec<u8>, fault: &'static str) -> Bomb {
    Bomb { name, bytes, fault: Some(fault) }
}

fn limits() -> Limits {
    Limits { max_memory: MEMORY, ..Limits::default() }
}

/// Reads a file by the extension of its name.
fn read(path: &Path) -> Result<(), FormatError> {
    let limits = limits();
    match path.extension().and_then(|e| e.to_str()).unwrap_or_default() {
        "ktx2" => read_ktx2(path, &limits).map(|_| ()),
        "safetensors" => read_tensors(path, &limits).map(|_| ()),
        "csv" => read_csv(path, &limits).map(|_| ()),
        "ptm" => read_ptm(path, &limits).map(|_| ()),
        "lp" => read_lp(path, &limits).map(|_| ()),
        "obj" | "gz" | "ply" | "gltf" => read_mesh(path, &limits).map(|_| ()),
        _ => read_image(path, &limits).map(|_| ()),
    }
}

/// Most memory that this process has used since the last call, in bytes.
fn peak_since(last: bool) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    // Says where the kernel begins to measure anew.
    if last {
        let _ = std::fs::write("/proc/self/clear_refs", "5");
    }
    let line = status.lines().find(|l| l.starts_with("VmHWM")).unwrap_or("VmHWM: 0 kB");
    line.split_ascii_whitespace().nth(1).and_then(|n| n.parse::<u64>().ok()).unwrap_or(0) << 10
}

#[test]
fn bombs_are_bounded_in_time_and_memory() {
    let dir = tempfile::tempdir().expect("a folder");
    meshes::beside(dir.path());
    let makers = images::bombs().into_iter().chain(meshes::bombs()).chain(tables::bombs());
    let mut wrong = Vec::new();
    for make in makers {
        let Bomb { name, bytes, fault } = make();
        let path = dir.path().join(name);
        std::fs::write(&path, &bytes).expect("written");
        let size = bytes.len() as u64;
        drop(bytes);
        peak_since(true);
        let before = peak_since(true);
        let start = Instant::now();
        let result = read(&path);
        let (time, peak) = (start.elapsed(), peak_since(true));
        let taken = peak.saturating_sub(before);
        // The file itself and what it is decoded to.
        let within = taken <= 2 * MEMORY && time < MOST_TIME;
        let expected = match (fault, &result) {
            (None, Ok(())) => true,
            (Some(part), Err(e)) => {
                let e = e.to_string();
                e.contains(part) && e.contains(name) && e.lines().count() == 1 && e.chars().count() < 600
            }
            _ => false,
        };
        if !within || !expected {
            wrong.push(format!("{name}: {size} bytes took {time:?} and {} MiB: {result:?}", taken >> 20));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

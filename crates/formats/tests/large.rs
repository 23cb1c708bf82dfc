//! Images of 16384 × 8192 pixels: decoding takes little more memory than the planes. With `STERADIAN_FULL=1`.

use std::io::{BufWriter, Write};
use std::path::Path;
use steradian_formats::*;

const WIDTH: usize = 16384;
const HEIGHT: usize = 8192;

/// Most memory that this process has used, in bytes.
fn peak() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let line = status.lines().find(|l| l.starts_with("VmHWM")).expect("a peak");
    let kib: usize = line.split_ascii_whitespace().nth(1).expect("a number").parse().expect("a number");
    kib << 10
}

/// One row of an image as the writer makes it, and the same row again until there are `HEIGHT`.
fn tall(path: &Path, row: &Raster) {
    let small = path.with_file_name(format!("row.{}", path.extension().expect("one").to_string_lossy()));
    let options = WriteOptions { exr_compression: ExrCompression::None, ..WriteOptions::default() };
    write_image(&small, row, &options).expect("written");
    let mut bytes = std::fs::read(&small).expect("readable");
    let mut out = BufWriter::new(std::fs::File::create(path).expect("a file"));
    if bytes.starts_with(b"#?") {
        let text = b"-Y 1 +X 16384\n";
        let at = bytes.windows(text.len()).position(|w| w == text).expect("a resolution line");
        out.write_all(&bytes[..at]).expect("written");
        out.write_all(b"-Y 8192 +X 16384\n").expect("written");
        (0..HEIGHT).for_each(|_| out.write_all(&bytes[at + text.len()..]).expect("written"));
        return;
    }
    // Header, a table of one offset, the chunk: y, size, samples.
    let chunk = bytes.len() - (8 + WIDTH * 12);
    for window in [&b"dataWindow\0box2i\0\x10\0\0\0"[..], b"displayWindow\0box2i\0\x10\0\0\0"] {
        let at = bytes.windows(window.len()).position(|w| w == window).expect("a window") + window.len();
        bytes[at + 12..at + 16].copy_from_slice(&(HEIGHT as i32 - 1).to_le_bytes());
    }
    out.write_all(&bytes[..chunk - 8]).expect("written");
    out.write_all(&vec![0; 8 * HEIGHT]).expect("written");
    for y in 0..HEIGHT as i32 {
        bytes[chunk..chunk + 4].copy_from_slice(&y.to_le_bytes());
        out.write_all(&bytes[chunk..]).expect("written");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn sixteen_thousand_wide() {
    if !steradian_testkit::full() {
        return;
    }
    let dir = tempfile::tempdir().expect("a folder");
    let plane: Vec<f32> = (0..WIDTH).map(|i| 0.5 + i as f32 / 7.0).collect();
    let row = Raster::rgb(WIDTH, 1, [plane.clone(), plane.clone(), plane]);
    for (name, bound) in [("a.exr", 1.2), ("a.hdr", 1.5)] {
        let path = dir.path().join(name);
        tall(&path, &row);
        let start = std::time::Instant::now();
        let image = read_image(&path, &Limits::default()).expect("an image");
        let ratio = peak() as f64 / (WIDTH * HEIGHT * 12) as f64;
        println!("{name}: {:.2} s, peak {ratio:.2} of the planes", start.elapsed().as_secs_f64());
        assert_eq!((image.width, image.height), (WIDTH, HEIGHT));
        assert!(ratio < bound, "{name}: peak {ratio} of the planes");
        drop(image);
        std::fs::remove_file(path).expect("removed");
    }
}

//! What the file system may do to readers and writers.

use std::fs;
use steradian_formats::*;

fn limits() -> Limits {
    Limits::default()
}

#[test]
fn unreadable_files_are_named() {
    let dir = tempfile::tempdir().expect("a folder");
    let why = |name: &str| {
        let e = read_image(&dir.path().join(name), &limits()).expect_err("not an image");
        assert_eq!(e.exit_code(), 3);
        let text = e.to_string();
        assert!(text.contains(name) && text.lines().count() == 1, "{text}");
        text
    };
    fs::write(dir.path().join("empty.hdr"), "").expect("written");
    fs::write(dir.path().join("text.exr"), "some text").expect("written");
    fs::create_dir(dir.path().join("folder.hdr")).expect("made");
    assert!(why("missing.hdr").ends_with("no such file or folder"));
    assert!(why("folder.hdr").ends_with("is a folder, not a file"));
    assert!(why("empty.hdr").ends_with("the file is empty"));
    let text = why("text.exr");
    assert!(text.contains("its first bytes are"), "{text}");
    let table = read_csv(&dir.path().join("missing.csv"), &limits()).expect_err("nothing there");
    assert_eq!(table.exit_code(), 3);
}

#[test]
fn content_decides_and_not_the_name() {
    let dir = tempfile::tempdir().expect("a folder");
    let (a, b) = (dir.path().join("a.hdr"), dir.path().join("b.exr"));
    let image = Raster::rgb(2, 1, [vec![0.5, 1.0], vec![2.0, 4.0], vec![8.0, 16.0]]);
    write_image(&a, &image, &WriteOptions::default()).expect("written");
    fs::rename(&a, &b).expect("renamed");
    let back = read_image(&b, &limits()).expect("a Radiance picture");
    // RGBE keeps eight bits of the largest component.
    assert!((back.channel("B").expect("blue")[1] - 16.0).abs() <= 16.0 / 256.0);
}

#[test]
fn what_cannot_be_written_is_named_and_leaves_nothing() {
    let dir = tempfile::tempdir().expect("a folder");
    let nan = Raster::rgb(2, 1, [vec![0.0, 1.0], vec![0.0, f32::NAN], vec![0.0; 2]]);
    let why = |name: &str, image: &Raster| {
        let e = write_image(&dir.path().join(name), image, &WriteOptions::default()).expect_err("refused");
        assert_eq!(e.exit_code(), 1);
        e.to_string()
    };
    for name in ["a.exr", "a.hdr", "a.pfm", "a.png"] {
        assert!(why(name, &nan).ends_with("pixel (1, 0) of channel G is not finite"));
    }
    let depth = Raster {
        width: 1,
        height: 1,
        channels: vec![Channel { name: "Z".into(), data: vec![1.0] }],
        ..Raster::default()
    };
    assert!(why("a.png", &depth).contains("needs the channels R, G and B"));
    assert!(why("a.gif", &depth).contains("no image format is called '.gif'"));
    assert_eq!(fs::read_dir(dir.path()).expect("readable").count(), 0);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_of_every_writer() {
    let dir = tempfile::tempdir().expect("a folder");
    let image = Raster::rgb(64, 64, [vec![0.5; 4096], vec![0.25; 4096], vec![1.0; 4096]]);
    for extension in ["exr", "hdr", "pfm", "png"] {
        let link = dir.path().join(format!("full.{extension}"));
        std::os::unix::fs::symlink("/dev/full", &link).expect("a link");
        let e = write_image(&link, &image, &WriteOptions::default()).expect_err("no space");
        assert_eq!(e.exit_code(), 1);
        assert!(e.to_string().contains("cannot write: no space left on the disk: free some"), "{e}");
    }
    let texture =
        TextureLevels { width: 1, height: 1, faces: 1, levels: vec![vec![1.0; 4]], metadata: Vec::new() };
    let full = std::path::Path::new("/dev/full");
    assert_eq!(write_ktx2(full, &texture, false).expect_err("no space").exit_code(), 1);
    assert_eq!(write_tensors(full, &TensorFile::default()).expect_err("no space").exit_code(), 1);
    let table = CsvTable { header: vec!["x".into()], ..CsvTable::default() };
    assert_eq!(write_csv(full, &table).expect_err("no space").exit_code(), 1);
}

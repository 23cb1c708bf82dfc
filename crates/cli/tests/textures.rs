//! Textures through the command: KTX2, KTX1 and DDS in and out, and what their formats could not hold.

use std::path::Path;
use std::process::{Command, Output};

fn run(dir: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_steradian")).current_dir(dir).args(arguments).output().expect("runs")
}

fn json(dir: &Path, arguments: &[&str]) -> serde_json::Value {
    let o = run(dir, arguments);
    let e = String::from_utf8_lossy(&o.stderr).into_owned();
    assert_eq!(o.status.code(), Some(0), "{arguments:?}: {e}");
    serde_json::from_slice(&o.stdout).unwrap_or_else(|x| panic!("{x}: {e}"))
}

#[test]
fn every_container_is_written_and_read() {
    let d = tempfile::tempdir().unwrap();
    let dir = d.path();
    std::fs::write(dir.join("d.csv"), "x,y,z\n1,0,0\n0,1,0\n0,0,1\n-1,-1,0.5\n").unwrap();
    run(dir, &["convert", "sky:elevation=30", "-o", "a.ktx2", "--size", "32"]);
    let values = |file: &str| {
        let v = json(dir, &["sample", file, "-d", "d.csv", "--json"]);
        v["rgb"].as_array().unwrap().iter().flat_map(|t| t.as_array().unwrap().clone()).collect::<Vec<_>>()
    };
    let exact = values("a.ktx2");
    for (file, format, step) in [
        ("b.ktx", "rgba32f", 0.0),
        ("b.dds", "rgba32f", 0.0),
        ("c.dds", "rgba16f", 1e-3),
        ("c.ktx", "r11g11b10", 2e-2),
        ("d.ktx2", "rgb9e5", 1e-2),
    ] {
        let report = json(dir, &["convert", "a.ktx2", "-o", file, "--format", format, "--json"]);
        assert!(report["clipped"].is_u64() && report["vanished"].is_u64(), "{report}");
        for (a, b) in values(file).iter().zip(&exact) {
            let (a, b) = (a.as_f64().unwrap(), b.as_f64().unwrap());
            assert!((a - b).abs() <= step * b.abs(), "{file}: {a} {b}");
        }
    }
    // A level of a chain, of a DDS too.
    run(dir, &["prefilter", "sky", "-o", "chain.dds", "--levels", "3", "--size", "16", "--check", "0"]);
    assert_eq!(run(dir, &["sample", "chain.dds", "--level", "2", "-d", "d.csv"]).status.code(), Some(0));
    assert_eq!(run(dir, &["sample", "chain.dds", "--level", "3", "-d", "d.csv"]).status.code(), Some(2));
    let o = run(dir, &["convert", "a.ktx2", "-o", "x.exr", "--format", "rgb9e5"]);
    assert_eq!(o.status.code(), Some(2));
}

#[test]
fn what_clips_or_vanishes_is_counted() {
    let d = tempfile::tempdir().unwrap();
    let dir = d.path();
    run(dir, &["convert", "furnace", "-o", "a.ktx2", "--size", "4"]);
    // 2^20 is beyond every 16-bit format; 2^-40 is below.
    for (ev, clipped, vanished) in [("20", true, false), ("-40", false, true)] {
        for (file, format) in
            [("b.ktx2", "rgba16f"), ("b.ktx2", "rgb9e5"), ("b.dds", "r11g11b10"), ("b.ktx", "rgba16f")]
        {
            let a =
                ["convert", "a.ktx2", "-o", file, "--format", format, "--light-exposure", ev, "--json", "-q"];
            let r = json(dir, &a);
            let all = 6 * 16 * 3;
            assert_eq!(r["clipped"], if clipped { all } else { 0 }, "{file} {format} {ev}");
            assert_eq!(r["vanished"], if vanished { all } else { 0 }, "{file} {format} {ev}");
            assert!(r["lost"].as_f64().unwrap() > 0.0);
        }
    }
    let a = ["convert", "a.ktx2", "-o", "b.exr", "--half", "--light-exposure", "-40", "--json", "-q"];
    assert_eq!(json(dir, &a)["vanished"], 6 * 16 * 3);
}

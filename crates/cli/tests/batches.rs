//! Several inputs and consumers at once, several pictures of one scene, and tables for papers.

use std::path::Path;
use std::process::{Command, Output};

fn run(dir: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_steradian")).current_dir(dir).args(arguments).output().expect("runs")
}

fn well(dir: &Path, arguments: &[&str]) -> String {
    let o = run(dir, arguments);
    assert!(o.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&o.stderr));
    String::from_utf8_lossy(&o.stdout).into_owned()
}

fn refused(dir: &Path, code: i32, want: &str, arguments: &[&str]) {
    let o = run(dir, arguments);
    let said = String::from_utf8_lossy(&o.stderr).into_owned();
    assert_eq!(o.status.code(), Some(code), "{arguments:?}: {said}");
    assert!(said.contains(want), "{arguments:?}: {said}");
}

fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(dir.path().join("lights")).expect("a folder");
    for (sky, name) in [("overcast", "grey"), ("studio", "boxes")] {
        well(dir.path(), &["convert", sky, "--size", "32x16", "-o", &format!("lights/{name}.exr")]);
    }
    dir
}

#[test]
fn every_input_has_its_files_for_every_consumer() {
    let dir = &folder();
    let dir = dir.path();
    let small = ["--size", "16", "--levels", "2", "--check", "4"];
    let outputs = |more: &[&str]| {
        let text = well(dir, &[&["prefilter", "--json"], more, &small].concat());
        let document: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        document["outputs"].as_array().map_or(0, Vec::len)
    };
    assert_eq!(outputs(&["lights", "--profile", "khronos,bevy", "-o", "out"]), 4);
    for file in [
        "khronos/grey/specular.ktx2",
        "khronos/boxes/specular.ktx2",
        "bevy/grey_specular_rgb9e5_zstd.ktx2",
        "bevy/boxes_diffuse_rgb9e5_zstd.ktx2",
    ] {
        assert!(dir.join("out").join(file).is_file(), "{file}");
    }
    assert_eq!(outputs(&["lights/*.exr", "-o", "rough-{}.ktx2"]), 2);
    assert!(dir.join("rough-grey.ktx2").is_file() && dir.join("rough-boxes.ktx2").is_file());
    let one = ["prefilter", "studio", "--profile", "khronos", "--name", "mine", "-o", "named"];
    well(dir, &[&one[..], &small].concat());
    assert!(dir.join("named/mine/sheen.ktx2").is_file());
    refused(dir, 2, "rough-{}.ktx2", &["prefilter", "lights", "--kernel", "lambert", "-o", "a.ktx2"]);
    let twice = ["prefilter", "studio", "studio", "--profile", "raw", "-o", "twice"];
    refused(dir, 2, "replace one another", &twice);
    refused(dir, 3, "holds no images", &["prefilter", "lights/*.hdr", "--profile", "raw", "-o", "none"]);
}

#[test]
fn a_turntable_has_one_exposure() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    let scene = ["render", "torus", "-e", "studio", "-b", "lambert", "-t", "sh_irradiance", "--size", "24"];
    let text = well(dir, &[&scene[..], &["--orbit", "3", "--json", "-o", "turn-{}.png"]].concat());
    assert!(text.contains("exposure"), "{text}");
    let exposure = |k: usize| {
        let bytes = std::fs::read(dir.join(format!("turn-{k:04}.png"))).expect("a frame");
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let at = text.find("steradian.exposure").expect("its exposure");
        text[at..at + 32].to_string()
    };
    assert_eq!(exposure(0), exposure(1));
    assert_eq!(exposure(0), exposure(2));
    refused(dir, 2, "turn-{}.png", &[&scene[..], &["--orbit", "3", "-o", "turn.png"]].concat());
    refused(dir, 2, "--up must not be zero", &[&scene[..], &["--up", "0,0,0", "-o", "a.png"]].concat());
}

#[test]
fn outputs_and_names_are_checked_before_the_work() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    refused(dir, 1, "does not exist", &["render", "sphere", "-o", "missing/x.png"]);
    refused(dir, 1, "does not exist", &["compare", "sphere", "-o", "missing/x.png"]);
    refused(dir, 3, "did you mean 'teapot'", &["render", "teapott", "-o", "x.png"]);
    refused(dir, 3, "did you mean 'studio'", &["inspect", "studioo"]);
    assert!(well(dir, &["inspect", "brdf:"]).contains("curet"));
}

#[test]
fn common_options_are_described_once_and_taken_everywhere() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    assert!(well(dir, &["--help"]).contains("--max-memory"));
    let help = well(dir, &["irradiance", "--help"]);
    assert!(!help.contains("--max-memory") && help.contains("steradian --help"), "{help}");
    let document = |arguments: &[&str]| well(dir, arguments).trim_start().starts_with('{');
    assert!(document(&["irradiance", "studio", "--json", "--threads", "1"]));
    assert!(document(&["--json", "irradiance", "studio"]));
}

#[test]
fn comparisons_are_tables_for_papers() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    let compare =
        ["compare", "sphere", "-e", "studio", "-b", "lambert", "-t", "sh_irradiance", "--size", "16"];
    well(dir, &[&compare[..], &["--table", "t.csv"]].concat());
    well(dir, &[&compare[..], &["--table", "t.tex"]].concat());
    let csv = std::fs::read_to_string(dir.join("t.csv")).expect("a table");
    let rows: Vec<&str> = csv.lines().collect();
    assert!(rows.len() == 3 && rows[2].starts_with("\"studio\",\"lambert\",\"sh_irradiance\",0."), "{csv}");
    let tex = std::fs::read_to_string(dir.join("t.tex")).expect("a table");
    assert!(tex.contains("sh\\_irradiance") && tex.contains("\\toprule"), "{tex}");
}

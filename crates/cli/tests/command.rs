//! The command as a user meets it: exit codes, one line per error, keys of JSON documents, no partial files.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn run(dir: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_steradian")).current_dir(dir).args(arguments).output().expect("runs")
}

fn stderr(o: &Output) -> String {
    String::from_utf8_lossy(&o.stderr).into_owned()
}

fn json(o: &Output) -> serde_json::Value {
    serde_json::from_slice(&o.stdout).unwrap_or_else(|e| panic!("{e}: {}", stderr(o)))
}

/// Exits with `code` and says one line that contains `want`.
fn fails(dir: &Path, code: i32, want: &str, arguments: &[&str]) {
    let o = run(dir, arguments);
    let e = stderr(&o);
    assert_eq!(o.status.code(), Some(code), "{arguments:?}: {e}");
    assert_eq!(e.trim_end().lines().count(), 1, "{arguments:?}: {e}");
    assert!(e.contains(want), "{arguments:?}: {e}");
}

const POINTS: &str = "id,nx,ny,nz,vx,vy,vz\na,0,2,0,0,1,0\nb,1,0,0,1,1,0\n";

fn folder() -> tempfile::TempDir {
    let d = tempfile::tempdir().expect("a folder");
    fs::write(d.path().join("p.csv"), POINTS).expect("written");
    d
}

#[test]
fn eval_of_the_white_furnace_is_the_albedo_for_every_method() {
    let d = folder();
    for technique in ["reference", "sh_irradiance", "sh-irradiance"] {
        let arguments =
            ["eval", "-e", "furnace", "-b", "lambert:albedo=0.5/0.25/1", "-p", "p.csv", "-t", technique];
        let o = run(d.path(), &arguments);
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
        let text = String::from_utf8(o.stdout).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0], "id,nx,ny,nz,vx,vy,vz,r,g,b,err");
        let fields: Vec<&str> = lines[2].split(',').collect();
        assert_eq!((fields[0], fields[1]), ("b", "1"));
        for (field, want) in fields[7..10].iter().zip([0.5, 0.25, 1.0]) {
            let got: f64 = field.parse().unwrap();
            assert!((got - want).abs() < 2e-4, "{technique}: {got} against {want}");
        }
    }
}

#[test]
fn bad_input_is_one_line_and_exit_3() {
    let d = folder();
    let dir = d.path();
    let eval = |points: &'static str| ["eval", "-e", "furnace", "-b", "lambert", "-p", points];
    fs::write(dir.join("zero.csv"), "nx,ny,nz,vx,vy,vz\n0,1,0,0,1,0\n0,0,0,0,1,0\n").unwrap();
    fs::write(dir.join("nan.csv"), "nx,ny,nz,vx,vy,vz\n0,nan,0,0,1,0\n").unwrap();
    fs::write(dir.join("text.csv"), "nx,ny,nz,vx,vy,vz\n0,up,0,0,1,0\n").unwrap();
    fs::write(dir.join("short.csv"), "nx,ny,nz,vx,vy,vz\n0,1,0\n").unwrap();
    fs::write(dir.join("columns.csv"), "nx,ny,nz\n0,1,0\n").unwrap();
    fails(dir, 3, "zero.csv: line 3", &eval("zero.csv"));
    fails(dir, 3, "nan.csv: line 2", &eval("nan.csv"));
    fails(dir, 3, "text.csv: line 2", &eval("text.csv"));
    fails(dir, 3, "short.csv: line 2", &eval("short.csv"));
    fails(dir, 3, "columns.csv: line 1", &eval("columns.csv"));
    fails(dir, 3, "none.csv", &eval("none.csv"));
    fs::write(dir.join("cut.hdr"), "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 64 +X 128\n\x02\x02").unwrap();
    fs::write(dir.join("empty.exr"), "").unwrap();
    fails(dir, 3, "cut.hdr", &["inspect", "cut.hdr"]);
    fails(dir, 3, "empty.exr", &["inspect", "empty.exr"]);
    fails(dir, 3, "none.hdr", &["irradiance", "none.hdr"]);
    fails(dir, 3, "folder", &["irradiance", "."]);
    fails(dir, 3, "none.obj", &["render", "none.obj", "-o", "x.png"]);
    fs::write(dir.join("s.toml"), "[[mesh]]\nshape = \"sphere\"\nmaterial = \"x\"\n").unwrap();
    fails(dir, 3, "s.toml:3:12: unknown material 'x'", &["render", "s.toml", "-o", "x.png"]);
    assert!(!dir.join("x.png").exists());
}

#[test]
fn wrong_usage_is_exit_2() {
    let d = folder();
    let dir = d.path();
    let eval = |brdf: &'static str, technique: &'static str| {
        ["eval", "-e", "furnace", "-b", brdf, "-p", "p.csv", "-t", technique]
    };
    fails(dir, 2, "did you mean 'lambert'", &eval("lamberd", "reference"));
    fails(dir, 2, "albedo", &eval("lambert:albedo=red", "reference"));
    fails(dir, 2, "did you mean 'sh_irradiance'", &eval("lambert", "sh_irradianse"));
    fails(dir, 2, "sky", &["irradiance", "sky:elevation=500"]);
    for unknown in
        [&["bake"][..], &["irradiance"], &["--nothing"], &["irradiance", "furnace", "--bands", "0"]]
    {
        assert_eq!(run(dir, unknown).status.code(), Some(2), "{unknown:?}");
    }
    assert_eq!(run(dir, &["--help"]).status.code(), Some(0));
    assert_eq!(run(dir, &["--version"]).status.code(), Some(0));
}

#[test]
fn the_gpu_back_end_names_its_feature() {
    let d = folder();
    fails(d.path(), 1, "--features gpu", &["irradiance", "furnace", "--backend", "gpu"]);
}

#[test]
fn a_missed_tolerance_writes_the_output_and_exits_4() {
    let d = folder();
    let arguments = [
        "eval",
        "-e",
        "sky",
        "-b",
        "lambert",
        "-p",
        "p.csv",
        "-t",
        "sh_irradiance",
        "--tolerance",
        "1e-9",
        "-o",
        "o.csv",
    ];
    fails(d.path(), 4, "tolerance", &arguments);
    let text = fs::read_to_string(d.path().join("o.csv")).unwrap();
    assert!(text.lines().next().unwrap().ends_with("r,g,b,err"));
}

#[test]
fn unwritable_outputs_are_exit_1_and_leave_the_old_file() {
    let d = folder();
    let dir = d.path();
    let render = |out: &'static str| {
        ["render", "sphere", "-e", "furnace", "-t", "sh_irradiance", "--size", "16x16", "-o", out]
    };
    fails(dir, 1, "none/x.png", &render("none/x.png"));
    if Path::new("/dev/full").exists() {
        fails(
            dir,
            1,
            "/dev/full",
            &["eval", "-e", "furnace", "-b", "lambert", "-p", "p.csv", "-o", "/dev/full"],
        );
    }
    fs::create_dir(dir.join("d.png")).unwrap();
    fails(dir, 1, "d.png", &render("d.png"));
    let files = fs::read_dir(dir).unwrap().count();
    assert_eq!(files, 2, "p.csv and d.png only");
}

#[test]
fn irradiance_of_a_constant_light() {
    let d = folder();
    let o = run(d.path(), &["sh", "furnace:radiance=2", "--bands", "3", "--json"]);
    let v = json(&o);
    let at = |key: &str, i: usize| v[key][i][1].as_f64().unwrap();
    assert_eq!(v["radiance"].as_array().unwrap().len(), 9);
    // L_00 = 2 √(4π); E_00 = π L_00.
    let l00 = 2.0 * (4.0 * std::f64::consts::PI).sqrt();
    assert!((at("radiance", 0) - l00).abs() < 1e-5);
    assert!((at("irradiance", 0) - std::f64::consts::PI * l00).abs() < 1e-4);
    // Texel centres stand for their cells: an error of the grid's second order in band 2.
    assert!((1..9).all(|i| at("irradiance", i).abs() < 1e-4));
    assert!(v["provenance"]["version"].is_string());
}

#[test]
fn convert_there_and_back_and_sample() {
    let d = folder();
    let dir = d.path();
    let ok = |arguments: &[&str]| {
        let o = run(dir, arguments);
        assert_eq!(o.status.code(), Some(0), "{arguments:?}: {}", stderr(&o));
        o
    };
    ok(&["convert", "overcast", "--size", "128x64", "-o", "a.exr"]);
    ok(&["convert", "a.exr", "--to", "cross", "--size", "64", "-o", "cross.exr"]);
    ok(&["convert", "cross.exr", "-o", "face-{}.pfm"]);
    ok(&["convert", "face-{}.pfm", "-o", "cube.ktx2"]);
    ok(&["convert", "a.exr", "--tone-mapper", "aces", "-o", "a.png"]);
    fs::write(dir.join("d.csv"), "x,y,z,tag\n0,1,0,up\n1,1,1,corner\n0,-2,0,down\n").unwrap();
    let sample = |map: &str| -> Vec<f64> {
        let o = ok(&["sample", map, "--directions", "d.csv"]);
        let text = String::from_utf8(o.stdout).unwrap();
        assert!(text.starts_with("x,y,z,tag,r,g,b\n"), "{text}");
        text.lines().skip(1).map(|l| l.split(',').nth(4).unwrap().parse().unwrap()).collect()
    };
    let (a, cube) = (sample("a.exr"), sample("cube.ktx2"));
    for (x, y) in a.iter().zip(&cube) {
        assert!((x - y).abs() < 0.02 * x.abs().max(0.1), "{a:?} {cube:?}");
    }
    let v = json(&ok(&["inspect", "a.exr", "--json"]));
    for key in [
        "kind",
        "layout",
        "width",
        "mean",
        "brightest",
        "energy_in_brightest",
        "sh_energy",
        "peak_memory_bytes",
    ] {
        assert!(!v[key].is_null(), "{key}");
    }
}

#[test]
fn inspect_describes_reflectances_and_meshes() {
    let d = folder();
    let dir = d.path();
    let v = json(&run(dir, &["inspect", "brdf:lambert:albedo=0.5", "--json"]));
    assert_eq!(v["kind"], "brdf");
    assert!((v["hemispherical_albedo"][0].as_f64().unwrap() - 0.5).abs() < 1e-3);
    assert_eq!(run(dir, &["inspect", "brdf:ggx:alpha=0.3", "--plot", "p.svg"]).status.code(), Some(0));
    assert!(fs::read_to_string(dir.join("p.svg")).unwrap().starts_with("<svg"));
    let v = json(&run(dir, &["inspect", "torus", "--json"]));
    assert_eq!((v["kind"].as_str(), v["open_edges"].as_u64()), (Some("mesh"), Some(0)));
    fails(dir, 2, "no BRDF model", &["inspect", "brdf:none"]);
}

#[test]
fn a_scene_file_renders() {
    let d = folder();
    let scene = r#"
[camera]
from = [0, 1, 4]
[[mesh]]
shape = "sphere"
material = "clay"
[[mesh]]
shape = "plane:size=6,y=-1"
material = "floor"
[material.clay]
brdf = "lambert:albedo=0.6/0.3/0.2"
[material.floor]
brdf = "lambert:albedo=0.3"
[light]
environment = "overcast"
rotation = 45
[output]
width = 48
height = 32
technique = "sh_irradiance"
tone_mapper = "agx"
"#;
    fs::write(d.path().join("s.toml"), scene).unwrap();
    let o = run(d.path(), &["render", "s.toml", "-o", "s.png", "--json"]);
    let v = json(&o);
    assert_eq!((v["width"].as_u64(), v["height"].as_u64()), (Some(48), Some(32)));
    assert_eq!(v["materials"].as_array().unwrap().len(), 2);
    assert!(fs::metadata(d.path().join("s.png")).unwrap().len() > 500);
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_ends_it_quietly() {
    use std::process::Stdio;
    let mut child = Command::new(env!("CARGO_BIN_EXE_steradian"))
        .args(["irradiance", "furnace", "--bands", "100"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("runs");
    drop(child.stdout.take());
    let o = child.wait_with_output().expect("ends");
    assert_eq!((o.status.code(), stderr(&o).as_str()), (Some(0), ""));
}

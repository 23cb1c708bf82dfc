//! What may be opened, and how much of it is read: no device, pipe or folder in place of a file, no file
//! outside the folder of the scene that names it, and none at all for a saved bake.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use steradian_base::Input;
use steradian_formats::{Limits, TensorFile, read_tensors, write_tensors};

/// What a refusal may take.
const MOST_TIME: Duration = Duration::from_secs(2);

/// Exit code, standard output and standard error; a command that goes on for longer than a minute is ended.
fn run(dir: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_steradian"))
        .current_dir(dir)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("runs");
    let start = Instant::now();
    while child.try_wait().expect("waits").is_none() {
        if start.elapsed() > Duration::from_secs(60) {
            child.kill().expect("ends");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let o = child.wait_with_output().expect("ended");
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (o.status.code(), text(o.stdout), text(o.stderr))
}

fn well(dir: &Path, arguments: &[&str]) -> String {
    let (code, out, err) = run(dir, arguments);
    assert_eq!(code, Some(0), "{arguments:?}: {err}");
    out
}

/// Exits with 3 in one line that contains `want`, at once.
fn refused(dir: &Path, want: &str, arguments: &[&str]) {
    let start = Instant::now();
    let (code, _, err) = run(dir, arguments);
    let time = start.elapsed();
    assert_eq!(code, Some(3), "{arguments:?}: {err}");
    assert_eq!(err.trim_end().lines().count(), 1, "{arguments:?}: {err}");
    assert!(err.contains(want), "{arguments:?}: {err}");
    assert!(time < MOST_TIME, "{arguments:?} took {time:?}");
}

const POINTS: &str = "nx,ny,nz,vx,vy,vz\n0,1,0,0.3,1,0\n1,0,0,1,0.2,0.4\n0,0.6,0.8,0,1,0.1\n";
const LOBES: &str = "diffuse,*,0.2\nlobe,*,-1,-1,0.9,20\n";

fn folder() -> tempfile::TempDir {
    let d = tempfile::tempdir().expect("a folder");
    fs::write(d.path().join("p.csv"), POINTS).expect("written");
    fs::write(d.path().join("l.csv"), LOBES).expect("written");
    d
}

#[test]
fn devices_pipes_and_folders_are_no_files() {
    let d = folder();
    let dir = d.path();
    let made = Command::new("mkfifo").arg(dir.join("pipe")).status().expect("mkfifo runs");
    assert!(made.success());
    fs::create_dir(dir.join("sub")).expect("made");
    symlink("/dev/zero", dir.join("zero")).expect("a link");
    for name in ["pipe", "zero", "sub"] {
        // Some readers tell what a file is by its extension.
        for extension in ["hdr", "toml", "obj", "safetensors", "csv"] {
            symlink(name, dir.join(format!("{name}.{extension}"))).expect("a link");
        }
        let why = if name == "sub" {
            "is a folder, not a file"
        } else {
            "is a device, a pipe or a socket, not a file"
        };
        let file = |extension: &str| format!("{name}.{extension}");
        let (hdr, toml, obj, csv) = (file("hdr"), file("toml"), file("obj"), file("csv"));
        let eval = ["eval", "-e", "furnace", "-p", "p.csv", "-b"];
        let render = ["render", "plane", "-o", "x.png", "--size", "8x8", "-b", "lambert"];
        let with = |head: &[&'static str], more: &[&str]| {
            let all: Vec<String> = head.iter().chain(more).map(|a| (*a).to_string()).collect();
            let all: Vec<&str> = all.iter().map(String::as_str).collect();
            refused(dir, why, &all);
        };
        with(&["inspect"], &[&hdr]);
        with(&["irradiance"], &[&hdr]);
        with(&["eval", "-b", "lambert", "-p", "p.csv", "-e"], &[&hdr]);
        with(&["eval", "-e", "furnace", "-b", "lambert", "-p"], &[&csv]);
        with(&eval, &["lambert", "--sun-lights", name]);
        with(&eval, &[&format!("lafortune:lobes={name}")]);
        with(&eval, &[&format!("curet:{name},sample=1,angles={name}")]);
        with(&["render", "-o", "x.png"], &[&toml]);
        with(&["render", "-o", "x.png"], &[&obj]);
        for map in ["--normal-map", "--roughness-map", "--base-color-texture"] {
            with(&render, &[map, &hdr]);
        }
        if name != "sub" {
            with(&["eval", "-p", "p.csv", "--bake"], &[&file("safetensors")]);
        }
    }
}

/// A file of `bytes` bytes, of which the disk holds only the first.
fn long(dir: &Path, name: &str, begin: &str, bytes: u64) {
    fs::write(dir.join(name), begin).expect("written");
    fs::OpenOptions::new().write(true).open(dir.join(name)).expect("opens").set_len(bytes).expect("grows");
}

#[test]
fn files_have_limits_that_the_message_names() {
    let d = folder();
    let dir = d.path();
    long(dir, "s.toml", "[camera]\n", 5 << 20);
    long(dir, "suns.json", "{", 1 << 40);
    long(dir, "l2.csv", "lobe", 1 << 40);
    long(dir, "light.hdr", "#?RADIANCE\n", 1 << 40);
    long(dir, "n.pfm", "PF\n", 1 << 40);
    long(dir, "p2.csv", "nx", 1 << 40);
    refused(
        dir,
        "s.toml: longer than 4 MiB, the limit of a scene file",
        &["render", "s.toml", "-o", "x.png"],
    );
    let eval = ["eval", "-e", "furnace", "-b", "lambert", "-p", "p.csv"];
    refused(
        dir,
        "longer than 4 MiB, the limit of a file of lights",
        &[&eval[..], &["--sun-lights", "suns.json"]].concat(),
    );
    let why = "l2.csv: longer than 1 MiB, the limit of a file of Lafortune lobes";
    refused(dir, why, &["eval", "-e", "furnace", "-b", "lafortune:lobes=l2.csv", "-p", "p.csv"]);
    refused(
        dir,
        "light.hdr: decoding needs 1048576 MiB, beyond the limit of 8192 MiB",
        &["irradiance", "light.hdr"],
    );
    refused(dir, "n.pfm: decoding needs", &["render", "plane", "-o", "x.png", "--normal-map", "n.pfm"]);
    refused(dir, "p2.csv: decoding needs", &["eval", "-e", "furnace", "-b", "lambert", "-p", "p2.csv"]);
}

#[test]
fn maps_of_numbers_hold_numbers() {
    let d = folder();
    let nan: Vec<u8> = [0.5f32, f32::NAN, 1.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    fs::write(d.path().join("n.pfm"), [b"PF\n1 1\n-1\n".as_slice(), &nan].concat()).expect("written");
    for map in ["--normal-map", "--roughness-map", "--base-color-texture"] {
        let why = "n.pfm: pixel (0, 0) of channel G is not finite";
        refused(
            d.path(),
            why,
            &["render", "plane", "-o", "x.png", "--size", "8x8", "-b", "lambert", map, "n.pfm"],
        );
    }
}

/// A scene with this reflectance and this environment.
fn scene(brdf: &str, environment: &str) -> String {
    format!(
        "[[mesh]]\nshape = \"sphere\"\nmaterial = \"m\"\n[material.m]\nbrdf = \"{brdf}\"\n\
         [light]\nenvironment = \"{environment}\"\n[output]\nwidth = 4\nheight = 4\nsamples = 1\n"
    )
}

#[test]
fn scenes_open_nothing_outside_their_folder() {
    let d = folder();
    let dir = d.path();
    let inner = dir.join("scene");
    fs::create_dir(&inner).expect("made");
    fs::write(inner.join("own,lobes.csv"), LOBES).expect("written");
    fs::write(inner.join("own.csv"), LOBES).expect("written");
    symlink("../l.csv", inner.join("link.csv")).expect("a link");
    for side in ["px", "nx", "py", "ny", "pz", "nz"] {
        symlink("../p.csv", inner.join(format!("cube_{side}.hdr"))).expect("a link");
    }
    let outside = dir.join("l.csv").display().to_string();
    let render = ["render", "scene/s.toml", "-o", "x.png"];
    let write = |brdf: &str, environment: &str| {
        fs::write(inner.join("s.toml"), scene(brdf, environment)).expect("written");
    };
    write("lafortune:lobes=own.csv", "furnace");
    well(dir, &render);
    // The picture says what it was made of, the files of reflectances too.
    let picture = fs::read(dir.join("x.png")).expect("a picture");
    let says = |name: &str| picture.windows(name.len()).any(|w| w == name.as_bytes());
    assert!(says("steradian.input.s.toml") && says("steradian.input.own.csv"));
    let below = "must be a file below the folder of the file that names it";
    for brdf in [
        format!("lafortune:lobes={outside}"),
        "lafortune:lobes=../l.csv".into(),
        "lafortune:lobes=link.csv".into(),
        "lafortune:lobes=own.csv/../../l.csv,scale=0.5".into(),
        format!("curet:{outside},sample=1"),
        format!("curet:own.csv,sample=1,angles={outside}"),
        "curet:../l.csv,sample=1".into(),
    ] {
        write(&brdf, "furnace");
        refused(dir, below, &render);
    }
    let p = dir.join("p.csv").display().to_string();
    for environment in [p.clone(), format!("own.csv,{p}"), "own.csv,../p.csv".into(), "../p.csv".into()] {
        write("lambert", &environment);
        refused(dir, below, &render);
    }
    for environment in ["link.csv", "cube_{}.hdr", "cube_px.hdr,cube_nx.hdr"] {
        write("lambert", environment);
        refused(dir, "is a link that leads out of the folder", &render);
    }
}

/// The digest that a bake carries, anew.
fn seal(t: &mut TensorFile) {
    t.metadata.remove("steradian.digest");
    let mut bytes = Vec::new();
    t.encode(&mut bytes).expect("memory");
    let digest = format!("sha256:{}", Input::of(Path::new(""), &bytes).sha256);
    t.metadata.insert("steradian.digest".into(), digest);
}

/// What shading reads of a bake does not depend on the files of its reflectance, and no edit makes it open
/// another.
#[test]
fn bakes_keep_what_their_reflectance_needs_and_open_no_file() {
    let d = folder();
    let dir = d.path();
    let made = Command::new("mkfifo").arg(dir.join("pipe")).status().expect("mkfifo runs");
    assert!(made.success());
    let spec = format!("lafortune:lobes={}", dir.join("l.csv").display());
    for technique in ["lafortune_env", "lobe_maps", "shrm"] {
        let bake = ["bake", "overcast", "--brdf", &spec, "--technique", technique, "-o", "b.safetensors"];
        let small: &[&str] = match technique {
            "lafortune_env" => &["--param", "size=16"],
            "lobe_maps" => &["--param", "size=16", "--param", "lobes=1", "--param", "elevations=4"],
            _ => &["--tolerance", "0.3"],
        };
        well(dir, &[&bake[..], small].concat());
        let eval = ["eval", "--bake", "b.safetensors", "-p", "p.csv"];
        let before = well(dir, &eval);
        fs::rename(dir.join("l.csv"), dir.join("moved.csv")).expect("moved");
        assert_eq!(well(dir, &eval), before);
        let shown = well(dir, &["inspect", "b.safetensors"]);
        assert!(shown.contains("lafortune:lobes=l.csv"), "{shown}");
        well(dir, &["render", "plane", "--bake", "b.safetensors", "-o", "x.png", "--size", "4x4"]);
        let good = read_tensors(&dir.join("b.safetensors"), &Limits::default()).expect("a bake");
        let folders = dir.display().to_string();
        assert!(good.metadata.values().all(|v| !v.contains(&folders)), "{:?}", good.metadata);
        // Without what it keeps, every spec names a pipe.
        let mut edited = good.clone();
        edited.tensors.retain(|name, _| !name.ends_with(".brdf"));
        for value in edited.metadata.values_mut().filter(|v| v.contains("lafortune:")) {
            *value = format!("lafortune:lobes={}", dir.join("pipe").display());
        }
        seal(&mut edited);
        write_tensors(&dir.join("e.safetensors"), &edited).expect("written");
        for arguments in [
            &["inspect", "e.safetensors"][..],
            &["eval", "--bake", "e.safetensors", "-p", "p.csv"],
            &["compare", "sphere", "--bake", "e.safetensors", "-o", "x.png", "--size", "4x4"],
        ] {
            let start = Instant::now();
            let (code, _, err) = run(dir, arguments);
            assert!(start.elapsed() < Duration::from_secs(20), "{arguments:?}");
            assert!([Some(0), Some(2), Some(3)].contains(&code), "{technique} {arguments:?}: {code:?} {err}");
            assert!(err.trim_end().lines().count() <= 2, "{err}");
        }
        fs::rename(dir.join("moved.csv"), dir.join("l.csv")).expect("moved");
    }
}

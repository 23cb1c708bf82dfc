//! `steradian probes`, and what is shaded under the light fields that it writes.

use super::common::{ends, json, well};
use glam::{DVec3, UVec3};
use std::fs;
use steradian_formats::{Limits, TensorData, read_tensors, write_tensors};
use steradian_light::{Places, Probe, Probes};
use steradian_sphere::sh::ShRgb;
use steradian_sphere::{Layout, SphereImage};

/// A field on a grid whose coefficients are linear in position, and radiance at points by `eval`.
#[test]
fn a_linear_light_field_is_reproduced() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    // L = a + b·p, the same from all sides: a Lambertian surface of albedo 1 sends just this.
    let level = |p: DVec3| 2.0 + 0.5 * p.x - 0.25 * p.y + 0.125 * p.z;
    let places = Places::Grid { bounds: [DVec3::splat(-1.0), DVec3::splat(1.0)], size: UVec3::new(3, 2, 4) };
    let probe = |p: DVec3| {
        let mut sh = ShRgb::zero(2);
        sh.c.iter_mut().for_each(|c| c[0] = level(p) * (4.0 * std::f64::consts::PI).sqrt());
        Some(Probe { sh, image: None })
    };
    let field = Probes { light: places.positions().into_iter().map(probe).collect(), places };
    write_tensors(&dir.join("f.safetensors"), &field.tensors()).expect("written");
    let mut table = "px,py,pz,nx,ny,nz,vx,vy,vz\n".to_owned();
    let part = |k: usize, a: f64| 2.0 * (0.5 + k as f64 * a).fract() - 1.0;
    let points: Vec<DVec3> =
        (0..12).map(|k| DVec3::new(part(k, 0.819), part(k, 0.671), part(k, 0.549))).collect();
    points.iter().for_each(|p| table += &format!("{},{},{},0,1,0,0.3,1,0\n", p.x, p.y, p.z));
    fs::write(dir.join("p.csv"), table).expect("written");
    for technique in ["sh_irradiance", "reference"] {
        let out = well(
            dir,
            &["eval", "--probes", "f.safetensors", "-b", "lambert:albedo=1", "-p", "p.csv", "-t", technique],
        );
        for (line, p) in out.lines().skip(1).zip(&points) {
            let r: f64 = line.split(',').nth(9).and_then(|x| x.parse().ok()).expect("radiance");
            let bound = if technique == "reference" { 2e-4 } else { 1e-5 };
            assert!((r - level(*p)).abs() < bound * level(*p), "{technique} {line} {}", level(*p));
        }
    }
    ends(
        dir,
        2,
        "--probes out",
        &[
            "eval",
            "--probes",
            "f.safetensors",
            "-b",
            "lambert",
            "-p",
            "p.csv",
            "-t",
            "path",
            "--mesh",
            "sphere",
        ],
    );
    // The object moves by a small step: its picture changes by as little.
    let mean = |x: &str| -> f64 {
        let moved = ["render", "sphere:segments=16", "-b", "lambert:albedo=1", "--probes", "f.safetensors"];
        let size = ["--size", "16x16", "-t", "sh_irradiance", "-o", "x.pfm", "--translate", x];
        well(dir, &[&moved[..], &size].concat());
        let bytes = fs::read(dir.join("x.pfm")).expect("a picture");
        let floats = bytes[bytes.len() - 16 * 16 * 12..].as_chunks::<4>().0;
        floats.iter().map(|b| f64::from(f32::from_le_bytes(*b))).sum::<f64>()
    };
    let [a, b, c] = ["-0.001,0,0", "0.001,0,0", "0.501,0,0"].map(mean);
    assert!((b - a).abs() < 2e-3 * a && c > 1.05 * b, "{a} {b} {c}");
}

/// A scene file's light field is that of the option; techniques are compared under it, and where one light is
/// needed it is refused.
#[test]
fn scene_files_name_a_light_field() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let capture = ["probes", "icosphere", "-e", "studio", "--grid", "2,2,1", "--bounds", "-2,-2,2,2,2,2"];
    well(dir, &[&capture[..], &["--bands", "3", "--noise", "0.1", "-o", "f.safetensors"]].concat());
    let scene = |light: &str| {
        let text = format!(
            "[[mesh]]\nshape = \"sphere:segments=12\"\nmaterial = \"m\"\n\
             [material.m]\nbrdf = \"lambert:albedo=0.8\"\n[light]\n{light}\n\
             [output]\nwidth = 8\nheight = 8\nsamples = 1\n"
        );
        fs::write(dir.join("s.toml"), text).expect("written");
    };
    let render = |more: &[&str], out: &str| {
        well(dir, &[&["render", "s.toml", "-t", "sh_irradiance", "-o", out], more].concat());
        fs::read(dir.join(out)).expect("a picture")
    };
    scene("environment = \"furnace\"");
    let plain = render(&[], "plain.pfm");
    let option = render(&["--probes", "f.safetensors"], "option.pfm");
    scene("environment = \"furnace\"\nprobes = \"f.safetensors\"");
    assert!(render(&[], "file.pfm") == option && option != plain);
    let compare = ["compare", "s.toml", "-t", "sh_irradiance", "--reference-tolerance", "0.02", "--json"];
    let found = json(dir, &compare);
    let error = |found: &serde_json::Value| found["comparisons"][0]["techniques"][1]["relative_rms"].as_f64();
    assert!(error(&found).is_some_and(|e| e < 0.02), "{found}");
    let given =
        ["compare", "sphere:segments=12", "-e", "furnace", "-b", "lambert:albedo=0.8", "--size", "8x8"];
    let how = ["-t", "sh_irradiance", "--reference-tolerance", "0.02", "--probes", "f.safetensors", "--json"];
    let found = json(dir, &[&given[..], &how].concat());
    assert!(error(&found).is_some_and(|e| e > 1e-6 && e < 0.02), "{found}");
    ends(dir, 2, "has its own light", &["compare", "s.toml", "-t", "sh_irradiance", "--path"]);
    ends(dir, 2, "alone: leave probes out", &["probes", "s.toml", "--grid", "1,1,1", "-o", "x.safetensors"]);
    scene("probes = \"none.safetensors\"");
    ends(dir, 3, "s.toml:7", &["render", "s.toml", "-t", "sh_irradiance", "-o", "x.pfm"]);
}

/// What is captured comes back, the same whatever the number of threads; probes inside the ball are left out.
#[test]
fn captured_fields_come_back() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let capture = |threads: &str, out: &str| {
        let what = ["probes", "icosphere", "-e", "furnace", "-b", "lambert:albedo=0.5", "--grid", "3,1,1"];
        let how = [
            "--bounds",
            "-2,0,0,2,0,0",
            "--bands",
            "3",
            "--noise",
            "0.05",
            "--image",
            "8",
            "--texel-paths",
            "4",
        ];
        well(dir, &[&what[..], &how, &["--threads", threads, "-o", out, "--json"]].concat())
    };
    let said = capture("1", "a.safetensors");
    assert!(said.contains("\"inside\": 1") && said.contains("\"probes\": 3"), "{said}");
    capture("3", "b.safetensors");
    let read = |name: &str| {
        let file = read_tensors(&dir.join(name), &Limits::default()).expect("tensors");
        assert!(file.metadata.contains_key("steradian.version"), "{:?}", file.metadata.keys());
        Probes::read(&file).expect("a field")
    };
    let field = read("a.safetensors");
    assert_eq!(field, read("b.safetensors"));
    let seen = |k: usize| field.light[k].as_ref().map(|p| p.sh.c[0][0] / (4.0 * std::f64::consts::PI).sqrt());
    // White all around, less half of what the ball, 30 degrees in radius, covers.
    let want = 1.0 - 0.25 * (1.0 - 0.75f64.sqrt());
    assert!(seen(1).is_none() && seen(0).is_some_and(|l| (l - want).abs() < 0.03), "{:?}", seen(0));
    let said = well(dir, &["inspect", "a.safetensors"]);
    assert!(said.contains("grid of 3 x 1 x 1") && said.contains("16 x 8 each"), "{said}");
    fs::write(dir.join("p.csv"), "px,py,pz\n0,3,0\n3,0,0\n").expect("written");
    let at =
        ["probes", "icosphere", "-e", "furnace", "--at", "p.csv", "--noise", "0.1", "-o", "at.safetensors"];
    well(dir, &at);
    assert!(well(dir, &["inspect", "at.safetensors"]).contains("2 given points"));
    let glossy = ["render", "sphere:segments=8", "-b", "ggx:alpha=0.3", "-t", "split_sum", "--size", "8x8"];
    well(dir, &[&glossy[..], &["--probes", "a.safetensors", "-o", "x.png"]].concat());
}

#[test]
fn faults_are_said_in_one_line() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let with = |more: &[&'static str]| -> Vec<&'static str> {
        let base = ["probes", "icosphere", "-e", "furnace", "--noise", "0.1", "-o", "f.safetensors"];
        base.iter().chain(more).copied().collect()
    };
    ends(dir, 2, "1 to 65536 probes", &with(&["--grid", "100000,100000,100000"]));
    ends(dir, 2, "1 to 64 bands", &with(&["--grid", "1,1,1", "--bands", "65"]));
    ends(dir, 2, "rows", &with(&["--grid", "1,1,1", "--image", "5000"]));
    ends(dir, 3, "inside solids", &with(&["--grid", "1,1,1"]));
    ends(dir, 2, "no extent along y", &with(&["--grid", "2,2,1", "--bounds", "-2,0,0,2,0,0"]));
    assert!(!dir.join("f.safetensors").exists());
    well(dir, &with(&["--grid", "2,1,1", "--bounds", "-2,0,0,2,0,0", "--bands", "2"]));
    let render = |name: &str, want: &str| {
        let how =
            ["render", "sphere", "-t", "sh_irradiance", "--size", "8x8", "-o", "x.png", "--probes", name];
        ends(dir, 3, want, &how);
        assert!(!dir.join("x.png").exists());
    };
    let bytes = fs::read(dir.join("f.safetensors")).expect("read");
    fs::write(dir.join("cut.safetensors"), &bytes[..bytes.len() - 9]).expect("written");
    render("cut.safetensors", "cut.safetensors");
    let good = read_tensors(&dir.join("f.safetensors"), &Limits::default()).expect("tensors");
    let mut bad = good.clone();
    let mut values = bad.tensors["sh"].data.to_f64().to_vec();
    values[3] = f64::NAN;
    bad.tensors.get_mut("sh").expect("there").data = TensorData::F64(values);
    write_tensors(&dir.join("nan.safetensors"), &bad).expect("written");
    render("nan.safetensors", "probe 0 holds NaN");
    let mut bad = good.clone();
    bad.metadata.insert("steradian.probes.bands".into(), "5".into());
    write_tensors(&dir.join("bands.safetensors"), &bad).expect("written");
    render("bands.safetensors", "says 5 bands and holds 2");
    let mut bad = good;
    bad.tensors.get_mut("size").expect("there").data = TensorData::U32(vec![u32::MAX; 3]);
    write_tensors(&dir.join("size.safetensors"), &bad).expect("written");
    render("size.safetensors", "beyond number");
}

/// A probe is a light by name, and a file of them becomes a filtered chain of each.
#[test]
fn probes_become_filtered_chains() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let of = |level: f32| {
        let mut image = SphereImage::new(Layout::LatLong, 64, 32);
        image.planes.iter_mut().for_each(|p| p.fill(level));
        let mut sh = ShRgb::zero(2);
        sh.c.iter_mut().for_each(|c| c[0] = f64::from(level) * (4.0 * std::f64::consts::PI).sqrt());
        Some(Probe { sh, image: Some(image) })
    };
    let places = Places::Points(vec![DVec3::ZERO, DVec3::X, DVec3::Y]);
    let field = Probes { light: vec![of(1.0), None, of(3.0)], places };
    write_tensors(&dir.join("room.safetensors"), &field.tensors()).expect("written");
    let chain = ["prefilter", "room.safetensors", "--profile", "khronos", "--size", "16x16", "-o", "chains"];
    fs::create_dir(dir.join("chains")).expect("a folder");
    well(dir, &chain);
    let made = |probe: &str| dir.join("chains").join(probe).is_dir();
    assert!(made("room-0") && made("room-2") && !made("room-1"));
    for (probe, level) in [("room.safetensors#0", 1.0), ("room.safetensors#2", 3.0)] {
        let facts = json(dir, &["inspect", probe, "--json"]);
        let mean = facts["mean"][0].as_f64();
        assert!(mean.is_some_and(|m| (m - level).abs() < 1e-4), "{facts}");
    }
    ends(dir, 3, "lies inside a solid", &["inspect", "room.safetensors#1"]);
    ends(dir, 3, "there are 3 probes, from 0", &["inspect", "room.safetensors#7"]);
}

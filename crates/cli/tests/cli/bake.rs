//! `steradian bake` and `--bake`: what is written is what shades, and what is damaged or foreign is said in
//! one line.

use super::common::{fails, json, run, stderr, well};
use std::fs;
use steradian_formats::{Limits, TensorData, read_ktx2_array, read_tensors, write_tensors};

const POINTS: &str = "nx,ny,nz,vx,vy,vz\n0,1,0,0.3,1,0\n1,0,0,1,0.2,0.4\n0,0.6,0.8,0,1,0.1\n";
const LIGHT: &str = "light.pfm";
/// A quick chain.
const SMALL: [&str; 4] = ["--param", "levels=3", "--param", "size=16"];
/// A light that needs no file.
const SKY: &str = "overcast";
const BRDF: &str = "ggx:alpha=0.4";

fn folder() -> tempfile::TempDir {
    let d = tempfile::tempdir().expect("a folder");
    fs::write(d.path().join("p.csv"), POINTS).expect("written");
    fs::write(d.path().join(LIGHT), light()).expect("written");
    d
}

/// A small image with a lamp, as PFM.
fn light() -> Vec<u8> {
    let (w, h) = (64, 32);
    let mut out = format!("PF\n{w} {h}\n-1.0\n").into_bytes();
    for k in 0..w * h {
        let (x, y) = (k % w, h - 1 - k / w);
        let lamp = if (20..24).contains(&x) && (8..12).contains(&y) { 20.0 } else { 0.0 };
        let sky = 1.0 - 0.8 * y as f32 / h as f32;
        [sky + lamp, 0.8 * sky + lamp, 0.5 + lamp].iter().for_each(|v| out.extend(v.to_le_bytes()));
    }
    out
}

/// Red, green, blue of the rows.
fn colours(csv: &str) -> Vec<[f64; 3]> {
    let row = |l: &str| {
        let f: Vec<f64> = l.split(',').rev().skip(1).take(3).map(|x| x.parse().expect("a number")).collect();
        [f[2], f[1], f[0]]
    };
    csv.lines().skip(1).map(row).collect()
}

fn apart(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let pairs = || a.iter().flatten().zip(b.iter().flatten());
    (pairs().map(|(x, y)| (x - y) * (x - y)).sum::<f64>() / pairs().map(|(_, y)| y * y).sum::<f64>()).sqrt()
}

#[test]
fn what_is_saved_shades_the_same() {
    let d = folder();
    let dir = d.path();
    // That every technique comes back from its tensors is a check of the conformance suite.
    for slug in ["sh_irradiance", "shrm", "shrm_global"] {
        let Some(t) = steradian_techniques::find(slug) else { panic!("no {slug}") };
        let spec = t.card().specimens[0];
        let bake = ["bake", LIGHT, "--brdf", spec, "--technique", slug, "-o", "b.safetensors", "--json"];
        let report = json(dir, &bake);
        assert_eq!(report["technique"], slug);
        assert!(report["bytes"].as_u64().unwrap() > 0 && report["error"].as_f64().is_some(), "{report}");
        let file = dir.join("b.safetensors");
        assert_eq!(report["files"][0]["bytes"].as_u64().unwrap(), fs::metadata(&file).unwrap().len());
        let fresh = ["eval", "-e", LIGHT, "-b", spec, "-t", slug, "-p", "p.csv", "--suns", "fold"];
        let saved = ["eval", "--bake", "b.safetensors", "-p", "p.csv"];
        assert_eq!(well(dir, &fresh), well(dir, &saved), "{slug}");
    }
}

#[test]
fn halves_are_half_the_bytes_and_their_error_is_in_the_certificate() {
    let d = folder();
    let dir = d.path();
    let bake = |out: &'static str, more: &[&'static str]| {
        let all = ["bake", LIGHT, "-b", BRDF, "-t", "split-sum", "-o", out, "--json"];
        json(dir, &[&all[..], &SMALL, more].concat())
    };
    let whole = bake("whole.safetensors", &[]);
    let half = bake("half.safetensors", &["--half"]);
    let bytes = |r: &serde_json::Value| r["files"][0]["bytes"].as_u64().unwrap() as f64;
    assert!(bytes(&half) < 0.6 * bytes(&whole), "{half}");
    let added = half["details"]["half"].as_f64().unwrap();
    assert!(added > 0.0 && added < 1e-3, "{half}");
    let sum = whole["error"].as_f64().unwrap() + added;
    assert!((half["error"].as_f64().unwrap() - sum).abs() < 1e-9);
    let said = json(dir, &["inspect", "half.safetensors", "--json"]);
    assert_eq!((said["technique"].as_str(), &said["error"]), (Some("split_sum"), &half["error"]));
    assert!(well(dir, &["inspect", "half.safetensors"]).contains("ggx:alpha=0.4"));
    let tensors = read_tensors(&dir.join("half.safetensors"), &Limits::default()).unwrap();
    assert!(tensors.tensors.values().any(|t| matches!(t.data, TensorData::F16(_))));
    let kept: f64 = tensors.metadata["steradian.certificate.error"].parse().unwrap();
    assert!((kept - half["error"].as_f64().unwrap()).abs() < 1e-12);
    let eval = |file: &'static str| colours(&well(dir, &["eval", "--bake", file, "-p", "p.csv"]));
    let e = apart(&eval("half.safetensors"), &eval("whole.safetensors"));
    assert!(e > 0.0 && e < 2e-3, "{e}");
}

#[test]
fn a_missed_tolerance_marks_the_output_and_exits_4() {
    let d = folder();
    let dir = d.path();
    let bake = ["bake", LIGHT, "-b", "lambert", "-t", "sh-irradiance", "-o", "b.safetensors", "-q"];
    fails(dir, 4, "tolerance 0.000000001 missed", &[&bake[..], &["--tolerance", "1e-9"]].concat());
    let metadata = |name: &str| read_tensors(&dir.join(name), &Limits::default()).unwrap().metadata;
    let m = metadata("b.safetensors");
    assert_eq!(m["steradian.tolerance.outcome"], "missed");
    assert_eq!((m["steradian.brdf"].as_str(), m["steradian.environment"].as_str()), ("lambert", LIGHT));
    assert!(m["steradian.arguments"].contains("--tolerance") && m.contains_key("steradian.digest"));
    // The energy is the square.
    well(dir, &[&bake[..], &["--energy-epsilon", "0.25"]].concat());
    let m = metadata("b.safetensors");
    assert_eq!(
        (m["steradian.tolerance"].as_str(), m["steradian.tolerance.outcome"].as_str()),
        ("0.5", "met")
    );
}

#[test]
fn maps_are_array_textures_and_a_folder_holds_all() {
    let d = folder();
    let dir = d.path();
    let o = json(dir, &["bake", LIGHT, "-b", BRDF, "-t", "shrm", "-o", "out", "--json"]);
    let names: Vec<&str> =
        o["files"].as_array().unwrap().iter().map(|f| f["name"].as_str().unwrap()).collect();
    assert!(names.contains(&"bake.safetensors") && names.contains(&"shade.wgsl"), "{names:?}");
    let technique: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(dir.join("out/technique.json")).unwrap()).unwrap();
    for t in technique["tables"].as_array().unwrap() {
        let texture = read_ktx2_array(&dir.join("out").join(t["file"].as_str().unwrap()), &Limits::default());
        let texture = texture.unwrap();
        assert_eq!(texture.layers as u64, t["layers"].as_u64().unwrap());
        assert_eq!(texture.get("steradian.technique"), Some("shrm"));
        assert!(texture.get("steradian.certificate.error").is_some());
        assert!(texture.get("steradian.table.rounding").unwrap().parse::<f64>().unwrap() < 5e-4);
    }
    let shaded = well(dir, &["eval", "--bake", "out", "-p", "p.csv"]);
    assert_eq!(colours(&shaded).len(), 3);
    // One table goes to one file, several need a folder.
    let one = ["bake", LIGHT, "-b", "lambert", "-t", "diffuse-map", "-o", "d.ktx2"];
    well(dir, &one);
    assert!(read_ktx2_array(&dir.join("d.ktx2"), &Limits::default()).unwrap().layers >= 1);
    fails(dir, 2, "give a folder", &["bake", LIGHT, "-b", BRDF, "-t", "shrm", "-o", "s.ktx2"]);
    // One table beside data that are none is not the bake.
    fails(dir, 2, "give a folder", &["bake", LIGHT, "-b", "lambert", "-t", "shrm-slices", "-o", "s.ktx2"]);
    assert!(!dir.join("s.ktx2").exists());
    // All of these can be looked at.
    assert_eq!(json(dir, &["inspect", "out", "--json"])["technique"], "shrm");
    let table = json(dir, &["inspect", "d.ktx2", "--json"]);
    assert_eq!((&table["technique"], &table["layers"]), (&"diffuse_map".into(), &6.into()));
    assert!(well(dir, &["inspect", "d.ktx2"]).contains("lambert"));
    fails(dir, 3, "is a folder", &["inspect", "."]);
}

#[test]
fn damaged_and_foreign_files_are_exit_3() {
    let d = folder();
    let dir = d.path();
    well(dir, &["bake", LIGHT, "-b", "lambert", "-t", "sh-irradiance", "-o", "b.safetensors", "-q"]);
    let good = fs::read(dir.join("b.safetensors")).unwrap();
    let eval = |name: &'static str| ["eval", "--bake", name, "-p", "p.csv"];
    let mut bad = good.clone();
    let last = bad.len() - 3;
    bad[last] ^= 1;
    fs::write(dir.join("bit.safetensors"), &bad).unwrap();
    fails(dir, 3, "bit.safetensors: damaged", &eval("bit.safetensors"));
    fs::write(dir.join("cut.safetensors"), &good[..good.len() - 5]).unwrap();
    fails(dir, 3, "cut.safetensors", &eval("cut.safetensors"));
    fs::write(dir.join("text.safetensors"), "not tensors at all").unwrap();
    fails(dir, 3, "text.safetensors", &eval("text.safetensors"));
    fails(dir, 3, "none.safetensors", &eval("none.safetensors"));
    let mut t = read_tensors(&dir.join("b.safetensors"), &Limits::default()).unwrap();
    t.metadata.insert("steradian.technique".into(), "of_the_future".into());
    write_tensors(&dir.join("new.safetensors"), &t).unwrap();
    fails(dir, 3, "'of_the_future', which this version does not know", &eval("new.safetensors"));
    t.metadata.insert("steradian.technique".into(), "split_sum".into());
    write_tensors(&dir.join("other.safetensors"), &t).unwrap();
    fails(dir, 3, "other.safetensors: damaged", &eval("other.safetensors"));
    t.metadata.remove("steradian.digest");
    write_tensors(&dir.join("open.safetensors"), &t).unwrap();
    fails(dir, 3, "open.safetensors: damaged", &eval("open.safetensors"));
    fails(dir, 3, "is no bake: --bake takes a .safetensors file", &eval(LIGHT));
    t.metadata.clear();
    write_tensors(&dir.join("bare.safetensors"), &t).unwrap();
    fails(dir, 3, "holds tensors but no bake", &eval("bare.safetensors"));
    fs::create_dir(dir.join("empty")).unwrap();
    fails(dir, 3, "empty", &eval("empty"));
}

#[test]
fn wrong_usage_is_exit_2_before_any_work() {
    let d = folder();
    let dir = d.path();
    let bake = |brdf: &'static str, technique: &'static str, out: &'static str| {
        ["bake", LIGHT, "-b", brdf, "-t", technique, "-o", out]
    };
    fails(dir, 2, "the reference bakes nothing", &bake(BRDF, "reference", "b.safetensors"));
    fails(dir, 2, "cannot write '.exr'", &bake(BRDF, "split-sum", "b.exr"));
    fails(dir, 2, "lambert", &bake("lambert", "split-sum", "b.safetensors"));
    fails(
        dir,
        2,
        "no parameter 'x'",
        &[&bake(BRDF, "split-sum", "b.safetensors")[..], &["--param", "x=1"]].concat(),
    );
    fails(
        dir,
        2,
        "leave --mesh out",
        &[&bake(BRDF, "split-sum", "b.safetensors")[..], &["--mesh", "sphere"]].concat(),
    );
    let twice = ["--param", "levels=3", "--param", "levels=4"];
    fails(dir, 2, "levels is given twice", &[&bake(BRDF, "split-sum", "b.safetensors")[..], &twice].concat());
    for (option, value, why) in [
        ("--tolerance", "-1", "'-1' is not positive"),
        ("--energy-epsilon", "-0.03", "'-0.03' is not positive"),
    ] {
        let o = run(dir, &[&bake(BRDF, "split-sum", "b.safetensors")[..], &[option, value]].concat());
        assert_eq!(o.status.code(), Some(2));
        assert!(stderr(&o).contains(why), "{}", stderr(&o));
    }
    fails(dir, 1, "none", &bake(BRDF, "split-sum", "none/b.safetensors"));
    let both = ["--tolerance", "0.1", "--energy-epsilon", "0.1"];
    assert_eq!(
        run(dir, &[&bake(BRDF, "split-sum", "b.safetensors")[..], &both].concat()).status.code(),
        Some(2)
    );
    let with_bake = ["eval", "--bake", "b.safetensors", "-b", BRDF, "-p", "p.csv"];
    assert_eq!(run(dir, &with_bake).status.code(), Some(2));
    assert_eq!(fs::read_dir(dir).unwrap().count(), 2, "p.csv and the light only");
}

#[test]
fn pictures_and_comparisons_take_saved_bakes() {
    let d = folder();
    let dir = d.path();
    well(dir, &["bake", SKY, "-b", BRDF, "-t", "split-sum", "-o", "b.safetensors", "-q"]);
    let picture = |name: &'static str, of: &[&'static str]| {
        let all = ["render", "sphere", "--size", "32x32", "-o", name];
        well(dir, &[&all[..], of].concat());
        steradian_formats::read_image(&dir.join(name), &Limits::default()).unwrap()
    };
    let fresh = picture(
        "a.pfm",
        &["-e", SKY, "-b", BRDF, "-t", "split-sum", "--suns", "fold", "--background", "none"],
    );
    let saved = picture("b.pfm", &["--bake", "b.safetensors", "--background", "none"]);
    assert_eq!(fresh.channels, saved.channels);
    // The background is the sky that the file names; turning turns the light with it.
    let turned = picture("c.pfm", &["--bake", "b.safetensors", "--rotate", "90"]);
    let fresh = ["-e", SKY, "--rotate", "90", "-b", BRDF, "-t", "split-sum", "--suns", "fold"];
    let expected = picture("d.pfm", &fresh);
    let planes = |r: steradian_formats::Raster| r.into_rgb().unwrap();
    let (a, b) = (planes(turned), planes(expected));
    let worst = a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max);
    assert!(worst < 0.02, "{worst}");
    let v = json(dir, &["compare", "--bake", "b.safetensors", "--size", "24x24", "--json"]);
    let row = &v["comparisons"][0];
    assert_eq!((row["environment"].as_str(), row["brdf"].as_str()), (Some(SKY), Some(BRDF)));
    assert_eq!(row["techniques"][1]["technique"], "split_sum b.safetensors");
    let error = row["techniques"][1]["relative_rms"].as_f64().unwrap();
    assert!(error > 0.0 && error < 0.2, "{error}");
    fails(
        dir,
        2,
        "bake again",
        &["render", "sphere", "--bake", "b.safetensors", "--light-exposure", "1", "-o", "x.png"],
    );
    let foreign = run(dir, &["compare", "--bake", "b.safetensors", "-e", "sky", "--size", "16x16"]);
    assert!(stderr(&foreign).contains("was baked from another light, overcast"), "{}", stderr(&foreign));
    // Each of several is looked at.
    well(dir, &["bake", "sky", "-b", "lambert", "-t", "sh-irradiance", "-o", "l.safetensors", "-q"]);
    let two = ["compare", "--bake", "b.safetensors", "--bake", "l.safetensors", "--size", "16x16"];
    let said = stderr(&run(dir, &two));
    assert!(said.contains("overcast: l.safetensors was baked from another light, sky"), "{said}");
    assert!(said.contains("l.safetensors was baked of another reflectance, lambert"), "{said}");
    assert!(!said.contains("b.safetensors was"), "{said}");
}

#[test]
fn parameters_are_taken_alike_everywhere() {
    let d = folder();
    let dir = d.path();
    let p = ["--param", "p=1"];
    let report = json(
        dir,
        &[&["bake", LIGHT, "-b", BRDF, "-t", "shrm", "-o", "b.safetensors", "--json"], &p[..]].concat(),
    );
    assert_eq!(report["parameters"]["p"], 1.0);
    let eval = ["eval", "-e", LIGHT, "-b", BRDF, "-t", "shrm", "-p", "p.csv", "--suns", "fold"];
    let with = well(dir, &[&eval[..], &p].concat());
    assert_eq!(with, well(dir, &["eval", "--bake", "b.safetensors", "-p", "p.csv"]));
    assert_ne!(with, well(dir, &eval));
    let compare = ["compare", "-e", LIGHT, "-b", BRDF, "--size", "16x16", "-t", "shrm", "-t", "mirror-map"];
    well(dir, &[&compare[..], &p].concat());
    fails(
        dir,
        2,
        "no technique that is compared has it",
        &[&compare[..], &["--param", "nothing=1"]].concat(),
    );
}

/// Data for the vertices of a mesh shade that mesh, as baking at once does, with a ground behind it or none,
/// and no other.
#[test]
fn data_of_a_mesh_shade_that_mesh_alone() {
    let d = folder();
    let dir = d.path();
    let of =
        ["-b", "lambert:albedo=0.7", "-t", "prt_diffuse", "--param", "bands=3", "--param", "precision=0.1"];
    well(dir, &[&["bake", SKY, "--mesh", "torus", "-o", "t.safetensors"], &of[..]].concat());
    let size = ["--size", "24", "--quiet", "-o"];
    well(dir, &[&["render", "torus", "-e", SKY], &of[..], &size, &["once.pfm"]].concat());
    let saved = ["--bake", "t.safetensors"];
    well(dir, &[&["render", "torus"], &saved[..], &size, &["saved.pfm"]].concat());
    let bytes = |name: &str| fs::read(dir.join(name)).expect("a picture");
    assert!(bytes("once.pfm") == bytes("saved.pfm"));
    well(dir, &[&["render", "torus", "--ground=lambert"], &saved[..], &size, &["ground.pfm"]].concat());
    well(dir, &[&["compare", "torus", "-b", "lambert:albedo=0.7"], &saved[..], &size, &["c.png"]].concat());
    for moved in [&["knot"][..], &["torus", "--translate", "0,1,0"]] {
        let render = [&["render"], moved, &saved, &size, &["x.png"]].concat();
        fails(dir, 3, "t.safetensors: baked on another mesh: its digest is", &render);
    }
    fails(
        dir,
        2,
        "holds data for the vertices of one mesh",
        &[&["eval", "-p", "p.csv"], &saved[..]].concat(),
    );
    assert!(!dir.join("x.png").exists());
}

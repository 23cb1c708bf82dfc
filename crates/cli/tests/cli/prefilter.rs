//! `prefilter`: what its report says of every file, and what it refuses.

use super::common::{run, stderr};
use serde_json::Value;
use std::path::Path;

fn report(dir: &Path, arguments: &[&str]) -> Value {
    let o = run(dir, &[&["prefilter", "--json"], arguments].concat());
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    serde_json::from_slice(&o.stdout).expect("JSON")
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or(f64::NAN)
}

/// The maps beside the specular levels have errors of their own, and the largest of all is what is stated.
#[test]
fn every_map_of_a_profile_has_its_error() {
    let d = tempfile::tempdir().expect("a folder");
    let light = ["convert", "studio", "--to", "latlong", "--size", "128x64", "-o", "light.exr"];
    assert_eq!(run(d.path(), &light).status.code(), Some(0));
    for (profile, size, maps) in [
        ("khronos", "32", ["diffuse", "sheen", "sheen"].as_slice()),
        ("bevy", "16", ["diffuse"].as_slice()),
        ("unreal", "16", ["panorama"].as_slice()),
        ("filament", "32", [].as_slice()),
    ] {
        let r = report(d.path(), &["light.exr", "--profile", profile, "--size", size, "-o", profile]);
        let none = Vec::new();
        let beside = r["beside"].as_array().unwrap_or(&none);
        let names: Vec<&str> = beside.iter().filter_map(|m| m["map"].as_str()).collect();
        assert_eq!(names, maps, "{profile}");
        let levels = r["levels"].as_array().expect("levels");
        let mut largest = 0.0_f64;
        for m in levels.iter().chain(beside) {
            let (error, format) = (number(&m["error"]), number(&m["format_error"]));
            assert!(error >= format && error < 1e-2, "{profile}: {m}");
            assert!(format > 0.0, "{profile}: every one of these formats rounds: {m}");
            largest = largest.max(error);
        }
        let stated = r["provenance"]["error"].as_str().expect("an error is stated");
        assert!(stated.starts_with(&format!("relative RMS error {largest:.2e}")), "{stated} {largest:e}");
    }
}

#[test]
fn the_times_add_up() {
    let d = tempfile::tempdir().expect("a folder");
    let r =
        report(d.path(), &["studio", "--levels", "3", "--size", "16", "-o", "a.ktx2", "--dump-levels", "d"]);
    let seconds = r["seconds"].as_object().expect("seconds");
    let parts: f64 = seconds.iter().filter(|(k, _)| *k != "all").map(|(_, v)| number(v)).sum();
    assert!((parts - number(&seconds["all"])).abs() < 1e-6, "{seconds:?}");
    for part in ["reading", "analysis", "filtering", "packing", "writing", "dumping"] {
        assert!(seconds.contains_key(part), "{part}: {seconds:?}");
    }
    let levels: f64 = r["levels"].as_array().expect("levels").iter().map(|l| number(&l["seconds"])).sum();
    assert!(levels <= number(&seconds["filtering"]) + 1e-6, "{levels} {seconds:?}");
}

#[test]
fn names_that_name_nothing_are_refused() {
    let d = tempfile::tempdir().expect("a folder");
    let o = run(d.path(), &["prefilter", "studio", "--kernel", "lambert", "--name", "x", "-o", "a.ktx2"]);
    assert_eq!(o.status.code(), Some(2));
    assert!(stderr(&o).contains("--name names the files of --profile"), "{}", stderr(&o));
    assert!(!d.path().join("a.ktx2").exists());
}

/// Sheen and dumped levels count.
#[test]
fn all_maps_are_held_against_the_limit_of_memory() {
    let d = tempfile::tempdir().expect("a folder");
    let base = ["prefilter", "studio", "--size", "512", "--max-memory", "64M", "--check", "0", "-o"];
    let o = run(d.path(), &[base.as_slice(), &["k", "--profile", "khronos"]].concat());
    assert_eq!(o.status.code(), Some(1), "{}", stderr(&o));
    assert!(stderr(&o).contains("the levels need 112 MiB"), "{}", stderr(&o));
    assert!(!d.path().join("k").exists());
    let dump = ["a.ktx2", "--kernel", "lambert", "--dump-levels", "d"];
    let o = run(d.path(), &[base.as_slice(), &dump].concat());
    assert_eq!(o.status.code(), Some(1), "{}", stderr(&o));
    assert!(stderr(&o).contains("the levels need 90 MiB"), "{}", stderr(&o));
}

/// A sun beyond halves: kept where the engine reads floats, else a light of its own, in a file and in the
/// snippet; said on standard error and in the report.
#[test]
fn suns_that_files_cannot_hold_are_kept_or_become_lights() {
    let d = tempfile::tempdir().expect("a folder");
    let sky = ["convert", "sky:elevation=37", "--size", "256x128", "-o", "sky.exr"];
    assert_eq!(run(d.path(), &sky).status.code(), Some(0));
    for (profile, remedy, file) in [
        ("blender", "floats", "sky.exr"),
        ("godot", "suns-taken-out", "sky.exr"),
        ("unity", "suns-taken-out", "sky.exr"),
        ("playcanvas", "suns-taken-out", "sky.hdr"),
    ] {
        let arguments = ["prefilter", "--json", "sky.exr", "--profile", profile, "-o", profile];
        let o = run(d.path(), &arguments);
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
        let r: Value = serde_json::from_slice(&o.stdout).expect("JSON");
        let beyond = &r["beyond_range"];
        assert_eq!(beyond["remedy"], remedy, "{profile}: {r}");
        assert!(number(&beyond["lost_without_remedy"]) > 0.05, "{profile}: {beyond}");
        let warned = stderr(&o);
        assert!(warned.contains("warning") && warned.contains("% of the light"), "{profile}: {warned}");
        let snippet = r["snippet"].as_str().expect("a snippet").to_lowercase();
        let suns = d.path().join(profile).join("sky_suns.json");
        assert_eq!(suns.is_file(), remedy == "suns-taken-out", "{profile}");
        assert_eq!(snippet.contains("directional"), suns.is_file(), "{profile}: {snippet}");
        // Nothing is lost in the files themselves.
        assert!(r["files"].as_array().expect("files").iter().all(|f| f["clipped"] == 0), "{profile}: {r}");
        // Map and suns hold the light: as much irradiance on a surface that faces the sun as before.
        let path = format!("{profile}/{file}");
        let map = ["prefilter", "--json", &path, "--kernel", "lambert", "--size", "32x16", "-o", "e.exr"];
        let energy = |arguments: &[&str]| {
            let o = run(d.path(), arguments);
            assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
            let r: Value = serde_json::from_slice(&o.stdout).expect("JSON");
            number(&r["levels"][0]["energy_in"][0])
        };
        let (mut got, want) = (energy(&map), energy(&[&map[..2], &["sky.exr"], &map[3..]].concat()));
        if suns.is_file() {
            let text = std::fs::read_to_string(&suns).expect("suns");
            let lights: Value = serde_json::from_str(&text).expect("JSON");
            let all = lights["lights"].as_array().expect("lights");
            // Energy of Lambert's kernel: radiance times solid angle.
            got += all.iter().map(|l| number(&l["radiance"][0]) * number(&l["solid_angle"])).sum::<f64>();
        }
        assert!((got / want - 1.0).abs() < 5e-3, "{profile}: {got} {want}");
    }
    let o = run(
        d.path(),
        &["prefilter", "sky.exr", "--profile", "bevy", "--size", "16", "--extract-sun", "s.json", "-o", "b"],
    );
    assert!(String::from_utf8_lossy(&o.stdout).contains("DirectionalLight"), "{}", stderr(&o));
}

/// Chains too; and what is lost is a part of the light.
#[test]
fn chains_keep_their_sun_or_give_it_up_to_a_light() {
    let d = tempfile::tempdir().expect("a folder");
    let sky = ["convert", "sky:elevation=37", "--size", "256x128", "-o", "sky.exr"];
    assert_eq!(run(d.path(), &sky).status.code(), Some(0));
    for (profile, remedy) in [("khronos", "floats"), ("babylon", "floats"), ("bevy", "suns-taken-out")] {
        let arguments = [
            "prefilter",
            "--json",
            "sky.exr",
            "--profile",
            profile,
            "--size",
            "128",
            "--check",
            "0",
            "-o",
            profile,
        ];
        let o = run(d.path(), &arguments);
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
        let r: Value = serde_json::from_slice(&o.stdout).expect("JSON");
        assert_eq!(r["beyond_range"]["remedy"], remedy, "{profile}: {}", r["beyond_range"]);
        assert!(r["files"].as_array().expect("files").iter().all(|f| f["clipped"] == 0), "{profile}: {r}");
        let taken = remedy == "suns-taken-out";
        assert_eq!(d.path().join(profile).join("sky_suns.json").is_file(), taken, "{profile}");
        assert_eq!(stderr(&o).contains("in sky_suns.json"), taken, "{profile}: {}", stderr(&o));
    }
    // Made so small that nothing clips, the map keeps its sun.
    let r = report(d.path(), &["sky.exr", "--profile", "godot", "--size", "16x8", "-o", "small"]);
    assert_eq!(r["beyond_range"], Value::Null, "{r}");
    let o = run(d.path(), &["convert", "sky.exr", "--half", "-o", "half.exr"]);
    let said = stderr(&o);
    assert!(said.contains("% of the light is lost") && !said.contains("in sum"), "{said}");
}

/// A whole chain, as Babylon.js's lookup needs it.
#[test]
fn babylon_s_cube_is_a_whole_chain() {
    let d = tempfile::tempdir().expect("a folder");
    let r = report(d.path(), &["studio", "--profile", "babylon", "--size", "32", "-o", "b"]);
    let levels = r["levels"].as_array().expect("levels");
    assert_eq!((levels.len(), number(&levels[5]["width"])), (6, 1.0));
    // 0.8 log2(32 alpha) = 3
    let alpha = number(&levels[3]["alpha"]);
    assert!((0.8 * (32.0 * alpha).log2() - 3.0).abs() < 1e-9, "{alpha}");
    assert!(d.path().join("b/studio.dds").is_file());
}

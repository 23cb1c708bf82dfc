//! Textures through the command: KTX2, KTX1 and DDS in and out, and what their formats could not hold.

use super::common::{json, run};
use std::process::Command;

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

/// The stated error is that of the file: what the texels' format changes is part of it, and of the verdict.
#[test]
fn the_certificate_counts_the_texel_format() {
    let d = tempfile::tempdir().unwrap();
    let base = ["prefilter", "studio", "--perceptual-roughness", "0.3", "--size", "16", "--check", "2"];
    let with = |more: &[&'static str]| [base.as_slice(), more].concat();
    let level = |format| {
        let report = json(d.path(), &with(&["--format", format, "-o", "a.ktx2", "--json"]));
        report["levels"][0].clone()
    };
    let number = |v: &serde_json::Value| v.as_f64().unwrap();
    assert_eq!(number(&level("rgba32f")["format_error"]), 0.0);
    let half = level("rgba16f");
    assert!((5e-5..5e-4).contains(&number(&half["format_error"])), "{half}");
    let both = number(&half["measured_error"]["rms"]).hypot(number(&half["format_error"]));
    assert!((number(&half["error"]) - both).abs() < 1e-12);
    let o = run(d.path(), &with(&["--format", "bc6h", "--tolerance", "1e-5", "-o", "b.ktx2"]));
    assert_eq!(o.status.code(), Some(4));
}

#[test]
fn destinations_are_checked_before_the_work() {
    let d = tempfile::tempdir().unwrap();
    let base = ["prefilter", "studio", "--perceptual-roughness", "0.3", "--size", "16", "-o", "a.ktx2"];
    for (more, code) in [
        (["--extract-sun", "a.ktx2"], 2),
        (["--extract-sun", "none/s.json"], 1),
        (["--dump-levels", "a.ktx2"], 2),
        (["--name", "../b"], 2),
        (["--levels", "3"], 2),
        (["--tolerance", "-1"], 2),
    ] {
        let o = run(d.path(), &[base.as_slice(), &more].concat());
        assert_eq!(o.status.code(), Some(code), "{more:?}: {}", String::from_utf8_lossy(&o.stderr));
        assert_eq!(std::fs::read_dir(d.path()).unwrap().count(), 0, "{more:?}");
    }
}

/// Container, format, levels, kernel and profile; of files that say nothing of themselves what their header
/// says.
#[test]
fn inspect_says_what_a_texture_is() {
    let d = tempfile::tempdir().expect("a folder");
    let run = |arguments: &[&str]| {
        let o = Command::new(env!("CARGO_BIN_EXE_steradian")).current_dir(d.path()).args(arguments).output();
        let o = o.expect("runs");
        assert!(o.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&o.stderr));
        String::from_utf8_lossy(&o.stdout).into_owned()
    };
    let small = ["--size", "32", "--check", "0", "-o"];
    run(&[&["prefilter", "studio", "--profile", "bevy"], &small[..], &["bevy"]].concat());
    run(&[&["prefilter", "studio", "--profile", "filament"], &small[..], &["filament"]].concat());
    run(&[&["prefilter", "studio", "--profile", "babylon"], &small[..], &["babylon"]].concat());
    for (file, container, format, compression, levels, profile) in [
        ("bevy/studio_specular_rgb9e5_zstd.ktx2", "KTX2", "rgb9e5", Some("Zstandard"), 3, Some("bevy")),
        ("filament/studio/studio_ibl.ktx", "KTX1", "r11g11b10", None, 2, Some("filament")),
        ("babylon/studio.dds", "DDS", "rgba16f", None, 6, None),
    ] {
        let text = run(&["inspect", file, "--json"]);
        let t = serde_json::from_str::<serde_json::Value>(&text).expect("JSON")["texture"].clone();
        assert_eq!((&t["container"], &t["format"]), (&container.into(), &format.into()), "{t}");
        assert_eq!((&t["compression"], &t["profile"]), (&compression.into(), &profile.into()), "{t}");
        let all = t["levels"].as_array().expect("levels");
        assert_eq!((all.len(), &t["faces"]), (levels, &6.into()), "{t}");
        // DDS has no room for what made it.
        let kernel = profile.map(|_| "ggx");
        assert_eq!(t["kernel"].as_str(), kernel, "{t}");
        let last = all.last().and_then(|l| l["perceptual_roughness"].as_f64());
        assert_eq!(last, profile.map(|_| 1.0), "{t}");
        // Filters keep the mean.
        let mean = |m: usize| all[m]["mean"][1].as_f64().expect("a number");
        assert!((mean(1) / mean(0) - 1.0).abs() < 0.1, "{t}");
        let words = run(&["inspect", file]);
        assert!(words.contains(container) && words.contains(format), "{words}");
    }
}

#[test]
fn irradiance_is_shader_text() {
    let d = tempfile::tempdir().expect("a folder");
    let run = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_steradian"))
            .current_dir(d.path())
            .args(arguments)
            .output()
            .expect("runs")
    };
    for (file, head) in [
        ("e.wgsl", "fn irradiance(n: vec3<f32>)"),
        ("e.glsl", "vec3 irradiance(vec3 n)"),
        ("e.hlsl", "float3 irradiance(float3 n)"),
    ] {
        for (bands, last) in [("3", "c8"), ("5", "c24"), ("16", "c224")] {
            assert!(
                run(&["irradiance", "studio", "--dering", "--bands", bands, "-o", file]).status.success()
            );
            let text = std::fs::read_to_string(d.path().join(file)).expect("a text");
            assert!(text.contains(head) && text.contains(&format!(" {last} =")), "{text}");
        }
    }
    assert_eq!(run(&["irradiance", "studio", "--bands", "17", "-o", "e.wgsl"]).status.code(), Some(2));
}

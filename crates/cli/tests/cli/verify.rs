//! `steradian verify`: our own files hold what their profiles expect, and a file that does not ends with
//! code 4. Faults of every kind are planted in the tests of the crate `steradian-verify`.

use super::common::{done, run};
use serde_json::Value;
use std::path::Path;
use steradian_formats::{
    Limits, Supercompression, TexelFormat, TextureLevels, read_image, read_ktx2, write_image, write_ktx2_as,
};

/// Windows and lamps, not symmetric in anything.
fn light(dir: &Path) {
    done(dir, &["convert", "studio", "-o", "studio.exr", "--to", "latlong", "--size", "64"]);
}

fn prefilter(dir: &Path, profile: &str, size: &str, out: &str) {
    let a =
        ["prefilter", "studio.exr", "--profile", profile, "--size", size, "-o", out, "--check", "0", "-q"];
    done(dir, &a);
}

/// The exit code and the document.
fn verify(dir: &Path, file: &str, profile: &str) -> (Option<i32>, Value) {
    let o = run(dir, &["verify", file, "--profile", profile, "--environment", "studio.exr", "--json", "-q"]);
    (o.status.code(), serde_json::from_slice(&o.stdout).expect("JSON"))
}

#[test]
fn files_of_every_profile_hold_what_they_should() {
    let d = tempfile::tempdir().unwrap();
    let dir = d.path();
    light(dir);
    for (profile, file, size, error) in [
        ("bevy", "studio_specular_rgb9e5_zstd.ktx2", "32", 4e-3),
        ("bevy", "studio_diffuse_rgb9e5_zstd.ktx2", "32", 4e-3),
        ("three", "studio_pmrem.ktx2", "256", 2e-3),
        ("filament", "studio/studio_ibl.ktx", "32", 1.5e-2),
        ("gltf", "studio.gltf", "32", 1e-1),
        ("khronos", "specular.ktx2", "32", 2e-3),
        ("khronos", "diffuse.ktx2", "32", 2e-3),
        ("khronos", "sheen.ktx2", "32", 1e-2),
        ("godot", "studio.exr", "64x32", 2e-3),
        ("unreal", "studio.hdr", "32", 1e-2),
        ("unreal", "studio.dds", "32", 2e-3),
        ("blender", "studio.exr", "64x32", 2e-3),
        ("babylon", "studio.dds", "32", 2e-3),
        ("playcanvas", "studio.hdr", "64x32", 1e-2),
        ("unity", "studio.exr", "64x32", 2e-3),
        ("raw", "studio_specular.ktx2", "32", 2e-3),
    ] {
        let out = format!("{profile}-files");
        if !dir.join(&out).exists() {
            prefilter(dir, profile, size, &out);
        }
        let (code, v) = verify(dir, &format!("{out}/{file}"), profile);
        assert_eq!(code, Some(0), "{profile} {file}: {:#}", v["faults"]);
        for l in v["levels"].as_array().expect("an array") {
            assert!(l["kernel_as_expected"].as_bool().expect("a verdict"), "{l:#}");
            assert_eq!(l["orientation"]["name"], "identity", "{l:#}");
            assert!((l["scale"].as_f64().expect("a number") - 1.0).abs() < 2e-2, "{profile} {file}: {l:#}");
            assert!(l["error"]["rms"].as_f64().expect("a number") < error, "{profile} {file}: {l:#}");
        }
    }
    // A tolerance that is kept, and one that is missed.
    let verify = |t: &str| {
        let a = [
            "verify",
            "bevy-files/studio_specular_rgb9e5_zstd.ktx2",
            "-p",
            "bevy",
            "-e",
            "studio.exr",
            "--tolerance",
            t,
        ];
        run(dir, &a).status.code()
    };
    assert_eq!((verify("0.01"), verify("1e-9")), (Some(0), Some(4)));
}

fn sentences(v: &Value) -> String {
    let text = |f: &Value| f.as_str().unwrap_or_default().to_string();
    v["faults"].as_array().expect("faults").iter().map(text).collect::<Vec<_>>().join("; ")
}

#[test]
fn files_that_are_wrong_end_with_code_4() {
    let d = tempfile::tempdir().unwrap();
    let dir = d.path();
    light(dir);
    prefilter(dir, "raw", "32", "good");
    let good = read_ktx2(&dir.join("good/studio_specular.ktx2"), &Limits::default()).expect("our own file");
    let mut bad = TextureLevels { metadata: Vec::new(), ..good };
    bad.levels.iter_mut().flatten().for_each(|v| *v *= std::f32::consts::PI);
    write_ktx2_as(&dir.join("bad.ktx2"), &bad, TexelFormat::Rgba32f, Supercompression::None).unwrap();
    let (code, v) = verify(dir, "bad.ktx2", "raw");
    assert_eq!((code, &v["kinds"]), (Some(4), &serde_json::json!(["scale"])), "{v:#}");
    assert!(sentences(&v).starts_with("every level: factor pi"), "{v:#}");
    // Read for another engine.
    let (code, v) = verify(dir, "good/studio_specular.ktx2", "bevy");
    assert_eq!((code, &v["kinds"]), (Some(4), &serde_json::json!(["turned"])), "{v:#}");
    assert!(sentences(&v).starts_with("every level: mirrored in z"), "{v:#}");
    // Another light: that alone is said, and on standard error only how much is wrong.
    done(dir, &["convert", "sky", "-o", "sky.exr", "--to", "latlong", "--size", "64"]);
    let other = ["verify", "good/studio_specular.ktx2", "-p", "raw", "-e", "sky.exr"];
    let (code, out, said) = super::common::said(dir, &other);
    assert_eq!(code, Some(4), "{said}");
    assert_eq!(out.matches("fault: ").count(), 1, "{out}");
    assert!(out.contains("fault: not made from this light") && !out.contains("0 texels"), "{out}");
    assert_eq!(said.lines().last(), Some("steradian: studio_specular.ktx2: 1 fault"), "{said}");
    // Lat-long: upside down.
    let mut image = read_image(&dir.join("studio.exr"), &Limits::default()).unwrap();
    image.metadata.clear();
    for c in &mut image.channels {
        let rows: Vec<Vec<f32>> = c.data.chunks_exact(64).rev().map(<[f32]>::to_vec).collect();
        c.data = rows.concat();
    }
    write_image(&dir.join("down.exr"), &image, &Default::default()).unwrap();
    let (code, v) = verify(dir, "down.exr", "raw");
    assert_eq!((code, &v["kinds"]), (Some(4), &serde_json::json!(["turned"])), "{v:#}");
    assert!(sentences(&v).starts_with("every level: mirrored in y"), "{v:#}");
}

//! `steradian verify`: our own files hold what their profiles expect; files that are wrong are told apart.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};
use steradian_formats::{
    Limits, Supercompression, TexelFormat, TextureLevels, read_ktx1, read_ktx2, write_ktx2_as,
};

/// Windows and a sun, not symmetric in anything.
const LIGHT: &str = "studio";

fn run(dir: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_steradian")).current_dir(dir).args(arguments).output().expect("runs")
}

fn done(dir: &Path, arguments: &[&str]) -> Output {
    let o = run(dir, arguments);
    assert_eq!(o.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&o.stderr));
    o
}

/// A light with a sun and one with windows, as files.
fn light(dir: &Path) {
    done(dir, &["convert", "sky:elevation=35", "-o", "sky.exr", "--to", "latlong", "--size", "256"]);
    done(dir, &["convert", LIGHT, "-o", "studio.exr", "--to", "latlong", "--size", "128"]);
}

fn verify(dir: &Path, file: &str, profile: &str, light: &str, more: &[&str]) -> Value {
    let mut arguments = vec!["verify", file, "--profile", profile, "--environment", light, "--json", "-q"];
    arguments.extend(more);
    let o = done(dir, &arguments);
    serde_json::from_slice(&o.stdout).expect("JSON")
}

fn faults(v: &Value) -> String {
    v["faults"]
        .as_array()
        .expect("faults")
        .iter()
        .map(|f| f.as_str().unwrap_or_default())
        .collect::<Vec<_>>()
        .join("; ")
}

/// Nominal roughness, identity, scale 1, small errors.
fn is_right(v: &Value, error: f64) {
    assert_eq!(faults(v), "", "{v:#}");
    for l in v["levels"].as_array().expect("an array") {
        assert!(l["kernel_as_expected"].as_bool().expect("a verdict"), "{l:#}");
        assert_eq!(l["orientation"]["name"], "identity", "{l:#}");
        assert!((l["scale"].as_f64().expect("a number") - 1.0).abs() < 5e-3, "{l:#}");
        assert!(l["error"]["rms"].as_f64().expect("a number") < error, "{l:#}");
        let (found, want) = (&l["found"]["perceptual_roughness"], &l["expected"]["perceptual_roughness"]);
        if let (Some(a), Some(b)) = (found.as_f64(), want.as_f64()) {
            assert!((a - b).abs() < 0.04, "{l:#}");
        }
    }
}

#[test]
fn files_of_every_profile_hold_what_they_should() {
    let d = tempfile::tempdir().unwrap();
    let dir = d.path();
    light(dir);
    for (profile, file, size, error) in [
        ("bevy", "studio_specular_rgb9e5_zstd.ktx2", "64", 4e-3),
        ("bevy", "studio_diffuse_rgb9e5_zstd.ktx2", "64", 4e-3),
        ("three", "studio_pmrem.ktx2", "256", 2e-3),
        ("filament", "studio/studio_ibl.ktx", "64", 1.5e-2),
        ("gltf", "studio.gltf", "64", 1e-1),
        ("khronos", "specular.ktx2", "64", 2e-3),
        ("khronos", "diffuse.ktx2", "64", 2e-3),
        ("khronos", "sheen.ktx2", "64", 1e-2),
        ("godot", "studio.exr", "128x64", 2e-3),
        ("unreal", "studio.hdr", "64", 1e-2),
        ("unreal", "studio.dds", "64", 2e-3),
        ("blender", "studio.exr", "128x64", 2e-3),
        ("raw", "studio_specular.ktx2", "64", 2e-3),
    ] {
        let out = format!("{profile}-files");
        if !dir.join(&out).exists() {
            let a = [
                "prefilter",
                "studio.exr",
                "--profile",
                profile,
                "--size",
                size,
                "-o",
                &out,
                "--check",
                "0",
                "-q",
            ];
            done(dir, &a);
        }
        let v = verify(dir, &format!("{out}/{file}"), profile, "studio.exr", &[]);
        is_right(&v, error);
    }
    // A tolerance that is kept, and one that is missed.
    let verify = |t: &str| {
        let a =
            ["verify", "raw-files/studio_specular.ktx2", "-p", "raw", "-e", "studio.exr", "--tolerance", t];
        run(dir, &a).status.code()
    };
    assert_eq!((verify("0.01"), verify("1e-9")), (Some(0), Some(4)));
}

/// A chain of ours under a light with a sun, to be spoilt.
fn chain(dir: &Path) -> TextureLevels {
    light(dir);
    let a = [
        "prefilter",
        "sky.exr",
        "--profile",
        "raw",
        "--size",
        "64",
        "--levels",
        "5",
        "-o",
        "good",
        "--check",
        "0",
        "-q",
    ];
    done(dir, &a);
    read_ktx2(&dir.join("good/sky_specular.ktx2"), &Limits::default()).expect("our own file")
}

fn spoilt(dir: &Path, t: &TextureLevels) -> String {
    let plain = TextureLevels { metadata: Vec::new(), ..t.clone() };
    write_ktx2_as(&dir.join("bad.ktx2"), &plain, TexelFormat::Rgba32f, Supercompression::None)
        .expect("the folder is writable");
    faults(&verify(dir, "bad.ktx2", "raw", "sky.exr", &[]))
}

fn colours(t: &mut TextureLevels, mut f: impl FnMut(usize, &mut [f32])) {
    for (m, level) in t.levels.iter_mut().enumerate() {
        level.chunks_exact_mut(4).for_each(|texel| f(m, &mut texel[..3]));
    }
}

#[test]
fn wrong_files_are_named() {
    let d = tempfile::tempdir().unwrap();
    let dir = d.path();
    let good = chain(dir);
    is_right(&verify(dir, "good/sky_specular.ktx2", "raw", "sky.exr", &[]), 2e-3);

    // Scales: E for E/π, two stops too bright, F0 of gold.
    let mut t = good.clone();
    colours(&mut t, |_, c| c.iter_mut().for_each(|v| *v *= std::f32::consts::PI));
    assert!(spoilt(dir, &t).contains("every level: factor pi"), "{}", spoilt(dir, &t));
    let mut t = good.clone();
    colours(&mut t, |_, c| c.iter_mut().for_each(|v| *v *= 4.0));
    assert!(spoilt(dir, &t).contains("exposure of +2 EV"), "{}", spoilt(dir, &t));
    let mut t = good.clone();
    colours(&mut t, |_, c| c.iter_mut().zip([1.0, 0.78, 0.34]).for_each(|(v, f)| *v *= f));
    assert!(spoilt(dir, &t).contains("coloured factor 1.000/0.780/0.340"), "{}", spoilt(dir, &t));

    // The BRDF's reflectance at normal incidence.
    let mut t = good.clone();
    colours(&mut t, |m, c| {
        let alpha = (m as f64 / 4.0).powi(2).max(1e-4);
        let g = steradian_brdf::dfg::ggx(1.0, alpha);
        c.iter_mut().for_each(|v| *v *= (0.9 * g.scale + g.bias) as f32);
    });
    assert!(spoilt(dir, &t).contains("F0 = 0.9"), "{}", spoilt(dir, &t));

    // Levels that follow another curve.
    let a = [
        "prefilter",
        "sky.exr",
        "--profile",
        "filament",
        "--size",
        "64",
        "--levels",
        "5",
        "-o",
        "other",
        "--check",
        "0",
        "-q",
    ];
    done(dir, &a);
    let other = read_ktx1(&dir.join("other/sky/sky_ibl.ktx"), &Limits::default()).unwrap();
    let text = spoilt(dir, &other);
    assert!(text.contains("sqrt (r = 1 - sqrt(1 - m/L)"), "{text}");

    // Box mips, and alpha for roughness.
    let mut t = good.clone();
    for m in 1..t.levels.len() {
        let n = t.size(m).0;
        let finer = t.levels[m - 1].clone();
        t.levels[m] = (0..6 * n * n * 4)
            .map(|k| {
                let (c, texel) = (k % 4, k / 4);
                let (f, j, i) = (texel / (n * n), texel / n % n, texel % n);
                let at = |a: usize, b: usize| finer[((f * 2 * n + 2 * j + b) * 2 * n + 2 * i + a) * 4 + c];
                0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))
            })
            .collect();
    }
    assert!(spoilt(dir, &t).contains("box instead of ggx"), "{}", spoilt(dir, &t));
    let mut t = good.clone();
    for m in 1..4 {
        let (r, n) = ((f64::from(m) / 4.0).sqrt().to_string(), (64 >> m).to_string());
        let a = [
            "prefilter",
            "sky.exr",
            "--perceptual-roughness",
            &r,
            "--size",
            &n,
            "-o",
            "x.ktx2",
            "--check",
            "0",
            "-q",
        ];
        done(dir, &a);
        t.levels[m as usize] =
            read_ktx2(&dir.join("x.ktx2"), &Limits::default()).unwrap().levels.swap_remove(0);
    }
    assert!(spoilt(dir, &t).contains("taken for alpha"), "{}", spoilt(dir, &t));

    // A clamped sun.
    let mut image = steradian_formats::read_image(&dir.join("sky.exr"), &Limits::default()).unwrap();
    image.channels.iter_mut().for_each(|c| c.data.iter_mut().for_each(|v| *v = v.min(1.0)));
    steradian_formats::write_image(&dir.join("low.exr"), &image, &Default::default()).unwrap();
    let a = [
        "prefilter",
        "low.exr",
        "--profile",
        "raw",
        "--size",
        "64",
        "--levels",
        "5",
        "-o",
        "low",
        "--check",
        "0",
        "-q",
    ];
    done(dir, &a);
    let low = read_ktx2(&dir.join("low/low_specular.ktx2"), &Limits::default()).unwrap();
    assert!(spoilt(dir, &low).contains("the sun is clamped"), "{}", spoilt(dir, &low));
}

#[test]
fn turned_files_are_named() {
    let d = tempfile::tempdir().unwrap();
    let dir = d.path();
    let good = chain(dir);
    for degrees in ["90", "180", "-90"] {
        let a = [
            "prefilter",
            "sky.exr",
            "--rotate",
            degrees,
            "--profile",
            "raw",
            "--size",
            "64",
            "--levels",
            "5",
            "-o",
            "turned",
            "--check",
            "0",
            "-q",
        ];
        done(dir, &a);
        let t = read_ktx2(&dir.join("turned/sky_specular.ktx2"), &Limits::default()).unwrap();
        let text = spoilt(dir, &t);
        // Some turns are what other tools mean by a lat-long image; then that is said.
        let text = text.split(" (as of a lat-long light").next().unwrap_or_default();
        assert_eq!(text, format!("every level: turned by {degrees}° about +Y"), "{degrees}");
    }
    // Faces left to right, as a mirror in the file.
    let mut t = good.clone();
    for m in 0..t.levels.len() {
        let n = t.size(m).0;
        for row in t.levels[m].chunks_exact_mut(4 * n) {
            let texels: Vec<[f32; 4]> = row.chunks_exact(4).map(|t| [t[0], t[1], t[2], t[3]]).rev().collect();
            row.copy_from_slice(&texels.concat());
        }
    }
    assert_eq!(spoilt(dir, &t), "every level: every face mirrored left to right");
    // Read for another engine.
    let v = verify(dir, "good/sky_specular.ktx2", "bevy", "sky.exr", &[]);
    assert_eq!(faults(&v), "every level: mirrored in z", "{v:#}");
    // Lat-long: upside down.
    let mut image = steradian_formats::read_image(&dir.join("sky.exr"), &Limits::default()).unwrap();
    image.metadata.clear();
    for c in &mut image.channels {
        let rows: Vec<Vec<f32>> = c.data.chunks_exact(256).rev().map(<[f32]>::to_vec).collect();
        c.data = rows.concat();
    }
    steradian_formats::write_image(&dir.join("down.exr"), &image, &Default::default()).unwrap();
    let v = verify(dir, "down.exr", "raw", "sky.exr", &[]);
    assert_eq!(faults(&v), "mirrored in y", "{v:#}");
}

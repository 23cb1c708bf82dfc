//! `inspect` of what `prefilter` writes for engines, and of materials in mesh files.

use super::common::{done, fails, json, run, stderr, well};
use std::path::Path;

fn files(dir: &Path, profile: &str, size: &str) {
    let small = ["--size", size, "--check", "0", "-q"];
    done(dir, &[&["prefilter", "studio", "--profile", profile, "-o", profile], &small[..]].concat());
}

#[test]
fn files_of_engines_say_what_they_are() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    for (profile, size) in [("babylon", "16"), ("gltf", "16"), ("khronos", "16"), ("filament", "16")] {
        files(dir, profile, size);
    }
    // DDS has no place for what a file says of itself.
    let v = json(dir, &["inspect", "babylon/studio.dds", "--json"]);
    assert_eq!((&v["texture"]["profile"], &v["texture"]["taken_for"]), (&().into(), &().into()));
    assert!(well(dir, &["inspect", "babylon/studio.dds"]).contains("--profile NAME"));
    let v = json(dir, &["inspect", "babylon/studio.dds", "--profile", "babylon", "--json"]);
    let t = &v["texture"];
    assert_eq!((t["taken_for"].as_str(), t["kernel"].as_str()), (Some("babylon"), Some("ggx")), "{t}");
    // 0.8 log2(16 alpha) = 1, and r = sqrt(alpha)
    let r = t["levels"][1]["perceptual_roughness"].as_f64().expect("a number");
    assert!((0.8 * (16.0 * r * r).log2() - 1.0).abs() < 1e-9, "{r}");
    // Charlie's narrowest lobe.
    let v = json(dir, &["inspect", "khronos/sheen.ktx2", "--json"]);
    let r = v["texture"]["levels"][0]["perceptual_roughness"].as_f64().expect("a number");
    assert!((r * r - 0.02).abs() < 1e-9, "{r}");
    let v = json(dir, &["inspect", "khronos/outputLUT.png", "--json"]);
    assert_eq!((v["kind"].as_str(), v["size"].as_u64()), (Some("split-sum-table"), Some(128)), "{v}");
    let v = json(dir, &["inspect", "gltf/studio.gltf", "--json"]);
    assert_eq!(v["kind"], "environment", "{v}");
    let light = &v["gltf_light"];
    assert_eq!(light["irradiance_coefficients"].as_array().map(Vec::len), Some(9), "{light}");
    assert!(light["levels"].as_array().is_some_and(|l| l[0]["width"] == 16), "{light}");
    // The same irradiance by coefficients as by the image.
    let v = json(dir, &["inspect", "filament/studio/sh.txt", "--json"]);
    let up = v["irradiance"]["+Y"][1].as_f64().expect("a number");
    let want = json(dir, &["inspect", "studio", "--json"])["irradiance_up"][1].as_f64().expect("a number");
    assert!((up / want - 1.0).abs() < 0.05, "{up} {want}");
    std::fs::write(dir.join("words.txt"), "no numbers").expect("a file");
    fails(dir, 3, "nine coefficients", &["inspect", "words.txt"]);
}

#[test]
fn files_of_lights_say_what_they_hold() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let taken =
        ["convert", "sky:elevation=37", "--size", "64x32", "--extract-sun", "suns.json", "-o", "a.exr"];
    done(dir, &taken);
    let v = json(dir, &["inspect", "suns.json", "--json"]);
    assert_eq!((v["kind"].as_str(), v["lights"][0]["kind"].as_str()), (Some("lights"), Some("disk")), "{v}");
    assert!(well(dir, &["inspect", "suns.json"]).contains("elevation 37.0°"));
}

/// One triangle of each of two materials.
#[test]
fn meshes_list_their_materials() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let text = r#"{"asset":{"version":"2.0"},"nodes":[{"mesh":0}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0},
        {"attributes":{"POSITION":0},"material":1}]}],
        "materials":[{"name":"glass","pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":0.5},
        "extensions":{"KHR_materials_ior":{"ior":2},"KHR_materials_transmission":{"transmissionFactor":1}}},
        {"name":"steel","pbrMetallicRoughness":{"roughnessFactor":0.5},
        "extensions":{"KHR_materials_anisotropy":{"anisotropyStrength":0.5}}}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA","byteLength":36}]}"#;
    std::fs::write(dir.join("a.gltf"), text).expect("a file");
    let v = json(dir, &["inspect", "a.gltf", "--json"]);
    let all = v["materials"].as_array().expect("materials");
    assert_eq!(
        (all.len(), all[0]["name"].as_str(), all[1]["name"].as_str()),
        (2, Some("glass"), Some("steel"))
    );
    assert!(all[0]["brdf"].as_str().is_some_and(|b| b.contains("f0=0.1111/")), "{}", all[0]);
    assert_eq!(all[0]["left_out"], serde_json::json!(["KHR_materials_transmission"]));
    // 0.25 + 0.25 (1 − 0.25)
    assert_eq!(all[1]["brdf"], "ggx:ax=0.438,ay=0.250");
    let said = well(dir, &["inspect", "a.gltf"]);
    assert!(
        said.contains("'glass' taken as dielectric:") && said.contains("without KHR_materials_transmission")
    );
}

#[test]
fn skies_are_sampled_and_folders_are_no_fits() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    std::fs::write(dir.join("d.csv"), "x,y,z\n0,1,0\n").expect("a file");
    let rgb = json(dir, &["sample", "overcast", "--directions", "d.csv", "--json"]);
    assert!(rgb["rgb"][0][1].as_f64().is_some_and(|v| v > 0.0), "{rgb}");
    let o = run(dir, &["fit", "brdf:lambert", "-o", "fits/"]);
    assert!(o.status.code() == Some(2) && stderr(&o).contains("{}.safetensors"), "{}", stderr(&o));
}

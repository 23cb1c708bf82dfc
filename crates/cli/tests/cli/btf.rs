//! Surfaces are photographed, and their pictures become bidirectional texture functions.

use super::common::{done, fails, json, run, stderr, well};
use std::fs;
use std::path::Path;
use std::time::SystemTime;
use steradian_formats::{
    Limits, Raster, WriteOptions, read_btf, read_image, read_lp, read_ptm, write_btf, write_image,
};

/// A small capture: eight texels a side, five views, seven lights.
const SMALL: [&str; 12] = [
    "capture",
    "weave",
    "--size",
    "8",
    "--lights",
    "7",
    "--views",
    "5",
    "--brdf",
    "lambert:albedo=0.8/0.5/0.2",
    "-o",
    "out",
];

fn planes(path: &Path) -> [Vec<f32>; 3] {
    read_image(path, &Limits::default()).expect("an image").into_rgb().expect("colour")
}

/// Pictures of all formats: complete, marked as computed, and those of a plane what the reflectance says.
#[test]
fn captures_are_complete_and_say_that_they_are_synthetic() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    done(dir, &[&SMALL[..], &["--relief", "0", "--seed", "3"]].concat());
    let list = read_btf(&dir.join("out/btf.csv"), &Limits::default()).expect("a list");
    assert_eq!((list.pictures.len(), list.source.as_deref(), list.seed), (35, Some("synthetic"), Some(3)));
    for p in &list.pictures {
        assert_eq!(p.variance, Some(0.0));
        let [r, g, b] = planes(&dir.join("out").join(&p.file));
        let z = p.light[0].to_radians().cos() as f32;
        for (plane, albedo) in [(r, 0.8), (g, 0.5), (b, 0.2)] {
            assert!(plane.len() == 64 && plane.iter().all(|x| (x - albedo * z).abs() < 1e-3), "{p:?}");
        }
    }
    let bytes = fs::read(dir.join("out/view_000/light_000.exr")).expect("a picture");
    assert!(bytes.windows(9).any(|w| w == b"synthetic"));
    // The view along the normal, under all lights.
    let lights = read_lp(&dir.join("out/rti.lp"), &Limits::default()).expect("lights");
    assert_eq!((lights.len(), lights[0].file.as_str()), (7, "view_000/light_000.exr"));
    let map = read_ptm(&dir.join("out/rti.ptm"), &Limits::default()).expect("a map");
    assert_eq!((map.width, map.height), (8, 8));
    let v = json(dir, &["inspect", "out/btf.csv", "--json"]);
    let of = |k: &str| v[k].as_u64().expect("a number");
    assert_eq!(["pictures", "views", "lights", "width", "height"].map(of), [35, 5, 7, 8, 8]);
    assert_eq!(
        (v["source"].as_str(), v["seed"].as_u64(), v["variance"].as_f64()),
        (Some("synthetic"), Some(3), Some(0.0))
    );
    assert!((v["largest_view_angle"].as_f64().expect("degrees") - 75.0).abs() < 1e-6);
    let text = well(dir, &["inspect", "out/btf.csv"]);
    assert!(text.contains("synthetic") && text.contains("5 views under 7 lights"), "{text}");
}

/// Lists that lack a view or a light altogether: of a capture by its record, of others where the light has
/// directions that no view has.
#[test]
fn lists_without_a_view_are_refused() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let made = ["capture", "weave", "--size", "4", "--lights", "9", "--quiet", "-o", "out"];
    done(dir, &[&made[..], &["--views", "9"]].concat());
    let path = dir.join("out/btf.csv");
    let whole = fs::read_to_string(&path).expect("a list");
    let without = |part: &str| {
        let rows: Vec<&str> = whole.lines().filter(|row| !row.contains(part)).collect();
        fs::write(&path, rows.join("\n") + "\n").expect("written");
    };
    let refused = |why: &str| {
        fails(dir, 3, why, &["inspect", "out/btf.csv"]);
        fails(dir, 3, why, &["convert", "out/btf.csv", "--lobes", "1", "-o", "lobes"]);
        let local = "btf_pca:map=out/btf.csv";
        fails(dir, 3, why, &["bake", "-b", "lambert", "--local", local, "-o", "x.safetensors"]);
    };
    without("view_008/");
    let view = "lacks 1 of the 9 views that were captured, the view at theta 75.00, phi 20.06 the first: 9 of 81 rows are missing";
    refused(view);
    without("light_008.");
    refused("lacks 1 of the 9 lights that were captured");
    fs::remove_file(dir.join("out/capture.json")).expect("removed");
    without("view_008/");
    let view = "lacks 1 of the views: light comes from 9 directions, of which all but these have a view, the one at theta 75.00, phi 20.06 \
                the first: 9 rows are missing";
    refused(view);
    // One light less than views says nothing: it may have been so.
    without("light_008.");
    well(dir, &["inspect", "out/btf.csv"]);
    assert!(!dir.join("lobes").exists() && !dir.join("x.safetensors").exists());
    // Few views under many lights are meant to be few.
    done(dir, &["capture", "weave", "--size", "4", "--lights", "9", "--views", "2", "--quiet", "-o", "few"]);
    well(dir, &["inspect", "few/btf.csv"]);
}

/// What is known of computed pictures is said of every file that is made of them, as far as it has a place.
#[test]
fn what_is_made_of_a_capture_says_that_it_is_synthetic() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let random = ["--seed", "3", "--bounces", "2", "--samples", "2", "--quiet"];
    done(dir, &[&SMALL[..], &random].concat());
    let variance = json(dir, &["inspect", "out/btf.csv", "--json"])["variance"].as_f64().expect("a number");
    assert!(variance > 0.0);
    for name in ["out/rti.lp", "out/rti.ptm"] {
        let v = json(dir, &["inspect", name, "--json"]);
        let got = (v["source"].as_str(), v["seed"].as_u64(), v["variance"].as_f64().expect("a number"));
        assert_eq!((got.0, got.1), (Some("synthetic"), Some(3)));
        assert!((got.2 / variance - 1.0).abs() < 1e-9, "{v}");
        let text = well(dir, &["inspect", name]);
        assert!(text.contains("synthetic") && text.contains("seed") && text.contains("variance"), "{text}");
    }
    done(dir, &["convert", "out/btf.csv", "--lobes", "1", "-o", "lobes", "--quiet"]);
    done(dir, &["convert", "out/rti.ptm", "--map", "normal", "-o", "normals.png", "--quiet"]);
    done(dir, &["convert", "out/rti.lp", "--map", "albedo", "-o", "albedo.png", "--quiet"]);
    let local = "btf_pca:map=out/btf.csv,method=view,components=1";
    done(dir, &["bake", "-b", "lambert", "--local", local, "-o", "small.safetensors", "--quiet"]);
    for name in ["lobes/rho_d.exr", "lobes/c_1.exr", "normals.png", "albedo.png", "small.safetensors"] {
        let bytes = fs::read(dir.join(name)).expect("a file");
        for part in [&b"synthetic"[..], b"steradian.seed", b"steradian.variance"] {
            assert!(bytes.windows(part.len()).any(|w| w == part), "{name}");
        }
    }
    let v = json(dir, &["inspect", "small.safetensors", "--json"]);
    assert_eq!((v["kind"].as_str(), v["technique"].as_str()), (Some("local bake"), Some("btf_pca")));
    assert_eq!((v["source"].as_str(), v["seed"].as_u64()), (Some("synthetic"), Some(3)));
    assert_eq!((v["brdf"].as_str(), v["parameters"]["components"].as_f64()), (Some("lambert"), Some(1.0)));
    assert!(v["bytes"].as_u64().is_some_and(|b| b > 0) && v["error"].as_f64().is_some(), "{v}");
    let text = well(dir, &["inspect", "small.safetensors"]);
    for part in ["btf_pca", "reflectance", "method view", "shading reads", "error", "synthetic, seed 3"] {
        assert!(text.contains(part), "{part}: {text}");
    }
    fs::write(dir.join("cut.safetensors"), b"nothing").expect("written");
    fails(dir, 3, "cut.safetensors", &["inspect", "cut.safetensors"]);
    // Files elsewhere are as they were.
    fs::copy(dir.join("out/rti.ptm"), dir.join("other.ptm")).expect("copied");
    assert!(json(dir, &["inspect", "other.ptm", "--json"])["source"].is_null());
}

fn times(dir: &Path) -> Vec<SystemTime> {
    let of = |k: usize| fs::metadata(dir.join(format!("out/view_00{k}/light_003.exr")));
    (0..5).map(|k| of(k).and_then(|m| m.modified()).expect("a picture")).collect()
}

/// What is there is kept, what is missing comes back with the same numbers, another capture is refused;
/// reflections, which are random, have the same bits whatever the number of threads, and a variance.
#[test]
fn captures_go_on_where_they_stopped() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let all = [&SMALL[..], &["--bounces", "2", "--samples", "4"]].concat();
    done(dir, &[&all[..], &["--threads", "1"]].concat());
    let picture = dir.join("out/view_002/light_003.exr");
    let (before, whole) = (times(dir), planes(&picture));
    let list = fs::read_to_string(dir.join("out/btf.csv")).expect("a list");
    fs::remove_file(&picture).expect("removed");
    fs::remove_file(dir.join("out/btf.csv")).expect("removed");
    let v = json(dir, &[&all[..], &["--json", "--threads", "2"]].concat());
    assert_eq!((v["views"].as_u64(), v["views_kept"].as_u64()), (Some(5), Some(4)));
    assert!(v["variance"].as_f64().is_some_and(|x| x > 0.0) && v["source"] == "synthetic");
    assert_eq!(planes(&picture), whole);
    assert_eq!(fs::read_to_string(dir.join("out/btf.csv")).expect("a list"), list);
    let after = times(dir);
    assert!((0..5).all(|k| (after[k] == before[k]) == (k != 2)), "{before:?} {after:?}");
    fails(dir, 2, "another capture (relief", &[&all[..], &["--relief", "0.2"]].concat());
    fs::write(dir.join("out/capture.json"), "{}").expect("written");
    fails(dir, 3, "no record of a capture", &all);
    let loose: Vec<_> = fs::read_dir(dir.join("out/view_002")).expect("a folder").collect();
    assert_eq!(loose.len(), 7, "nothing half-written");
}

#[test]
fn what_cannot_be_captured_is_refused() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let with = |more: &[&'static str]| [&["capture", "grooves", "-o", "out"][..], more].concat();
    fails(dir, 2, "--views 0", &with(&["--views", "0", "--size", "4"]));
    fails(dir, 2, "--lights 5000", &with(&["--lights", "5000", "--size", "4"]));
    fails(dir, 2, "needs --samples 2", &with(&["--bounces", "2", "--samples", "1"]));
    fails(dir, 2, "--relief", &with(&["--relief", "-1"]));
    fails(dir, 2, "--relief", &with(&["--relief", "inf"]));
    fails(dir, 2, "'tga' is not", &with(&["--format", "tga"]));
    fails(dir, 2, "nothing", &with(&["--brdf", "nothing"]));
    fails(dir, 3, "none.png", &["capture", "none.png", "-o", "out"]);
    fails(dir, 3, "none.png", &with(&["--base-color-texture", "none.png", "--size", "4"]));
    fails(dir, 2, "--size", &["capture", "none.png", "--size", "8", "-o", "out"]);
    fails(dir, 1, "does not exist", &["capture", "weave", "--size", "4", "-o", "none/out"]);
    assert!(!dir.join("out").exists());
}

/// An image of heights that repeats, and a base colour: seen from above under a light from above the colour
/// times the reflectance of its slopes.
#[test]
fn images_are_heights_and_base_colours() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let image = |name: &str, f: &dyn Fn(usize) -> [f32; 3]| {
        let planes = [0, 1, 2].map(|c| (0..64).map(|k| f(k)[c]).collect());
        write_image(&dir.join(name), &Raster::rgb(8, 8, planes), &WriteOptions::default()).expect("written");
    };
    // A ridge along the columns: up over four texels, down over four.
    image("ridge.pfm", &|k| [(4.0 - (k % 8) as f32).abs() / 8.0; 3]);
    image("colour.pfm", &|k| if k < 32 { [1.0, 0.5, 0.25] } else { [0.5; 3] });
    let made = [
        "capture",
        "ridge.pfm",
        "--relief",
        "1",
        "--base-color-texture",
        "colour.pfm",
        "--brdf",
        "lambert:albedo=0.8",
    ];
    done(dir, &[&made[..], &["--lights", "6", "--views", "1", "-o", "out"]].concat());
    let [r, g, _] = planes(&dir.join("out/view_000/light_000.exr"));
    for k in 0..64 {
        let level = k % 8 == 0 || k % 8 == 4;
        let z = if level { 1.0 } else { std::f32::consts::FRAC_1_SQRT_2 };
        let colour = if k < 32 { [1.0, 0.5] } else { [0.5; 2] };
        // A thousandth of a texel beside the middle, where normals are between two texels'.
        assert!(
            (r[k] - 0.8 * colour[0] * z).abs() < 4e-3 && (g[k] - 0.8 * colour[1] * z).abs() < 4e-3,
            "{k}: {}",
            r[k]
        );
    }
}

/// Lobes are fitted to pictures of a plane whose lobes are known, and drive the technique that has them by
/// texel.
#[test]
fn lobes_are_fitted_to_pictures() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let spec = "lafortune:cx=-1,cy=-0.9,cz=0.95,n=12,ks=0.5,kd=0.3";
    let flat = ["capture", "hemispheres", "--size", "2", "--relief", "0", "--brdf", spec, "--quiet"];
    done(dir, &[&flat[..], &["--lights", "15", "--views", "15", "-o", "out"]].concat());
    let text = well(dir, &["convert", "out/btf.csv", "--lobes", "1", "-o", "svbrdf", "--json"]);
    let v: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert!(v["error"].as_f64().expect("a number") < 2e-3, "{v}");
    let near = |name: &str, want: [f32; 3], within: f32| {
        let p = planes(&dir.join("svbrdf").join(name));
        for (p, w) in p.iter().zip(want) {
            assert!(p.iter().all(|x| (x - w).abs() < within), "{name}: {p:?}");
        }
    };
    // Of half precision, as the pictures are.
    near("rho_d.exr", [0.3; 3], 2e-3);
    near("c_1.exr", [-1.0, -0.9, 0.95], 2e-3);
    near("n_1.exr", [12.0; 3], 0.1);
    near("rho_1.exr", [0.5; 3], 5e-3);
    let points =
        "u,v,nx,ny,nz,tx,ty,tz,vx,vy,vz\n0.25,0.25,0,0,1,1,0,0,-0.6,0,0.8\n0.7,0.6,0,0,1,1,0,0,0,0.6,0.8\n";
    fs::write(dir.join("points.csv"), points).expect("written");
    let black = vec![0.0; 8 * 4];
    let dark = Raster::rgb(8, 4, [black.clone(), black.clone(), black]);
    write_image(&dir.join("dark.pfm"), &dark, &WriteOptions::default()).expect("written");
    let light = "directional:direction=0.6/0/0.8,irradiance=1/1/1";
    let eval = |brdf: &str, local: &str| -> Vec<f64> {
        let made = ["eval", "-p", "points.csv", "-e", "dark.pfm", "--light", light, "--quiet", "-b", brdf];
        let text = well(dir, &[&made[..], &["-t", "sh-irradiance", "--local", local]].concat());
        text.lines().skip(1).flat_map(|row| row.split(',').nth(11).and_then(|x| x.parse().ok())).collect()
    };
    let maps = "rho_d=svbrdf/rho_d.exr,rho_1=svbrdf/rho_1.exr,c_1=svbrdf/c_1.exr,n_1=svbrdf/n_1.exr";
    let fitted = eval("lambert", &format!("lafortune_svbrdf:{maps}"));
    // The light's share of the reflectance itself, as the model has it.
    let brdf = steradian_brdf::parse(spec).expect("a spec");
    for (got, wo) in fitted.iter().zip([[-0.6, 0.0, 0.8], [0.0, 0.6, 0.8]]) {
        let want = brdf.f_cos(glam::DVec3::new(0.6, 0.0, 0.8), glam::DVec3::from(wo))[0];
        assert!((got - want).abs() < 3e-3 * want.max(0.1), "{got} {want}");
    }
    fails(dir, 2, "--lobes", &["convert", "dark.pfm", "--lobes", "1", "-o", "x"]);
    fails(dir, 2, "3", &["convert", "out/btf.csv", "--lobes", "3", "-o", "x"]);
    fails(dir, 3, "none.csv", &["convert", "none.csv", "--lobes", "1", "-o", "x"]);
    assert!(!dir.join("x").exists());
}

/// A function that was made small is saved, and shades from its file alone as it did; other reflectances,
/// damaged files and those of other kinds are refused in one line. A measured reflectance stays in the file.
#[test]
fn small_functions_are_saved() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    done(dir, &[&SMALL[..], &["--relief", "0.1"]].concat());
    let local = "btf_pca:map=out/btf.csv,method=chained,components=2";
    let v = json(dir, &["bake", "-b", "lambert", "--local", local, "-o", "small.safetensors", "--json"]);
    assert_eq!(v["technique"].as_str(), Some("btf_pca"));
    assert!(v["error"].as_f64().is_some_and(|e| e < 1.0), "{v}");
    let points =
        "u,v,nx,ny,nz,tx,ty,tz,vx,vy,vz\n0.25,0.25,0,0,1,1,0,0,0,0,1\n0.7,0.6,0,0,1,1,0,0,0,0.6,0.8\n";
    fs::write(dir.join("points.csv"), points).expect("written");
    let light = ["--light", "directional:direction=0.6/0/0.8,irradiance=1/1/1", "-e", "overcast"];
    let eval = |brdf: &str, local: &str| {
        let made =
            ["eval", "-p", "points.csv", "--quiet", "-b", brdf, "-t", "sh-irradiance", "--local", local];
        run(dir, &[&made[..], &light].concat())
    };
    let first = eval("lambert", local);
    assert!(first.status.success(), "{}", stderr(&first));
    fs::rename(dir.join("out"), dir.join("elsewhere")).expect("moved");
    let again = eval("lambert", "small.safetensors");
    assert!(again.status.success(), "{}", stderr(&again));
    assert_eq!(first.stdout, again.stdout);
    let said = |o: &std::process::Output, code: i32, why: &str| {
        let text = stderr(o);
        assert!(o.status.code() == Some(code) && text.contains(why) && text.lines().count() == 1, "{text}");
    };
    said(&eval("lambert:albedo=0.2", "small.safetensors"), 2, "was baked of lambert");
    let whole = fs::read(dir.join("small.safetensors")).expect("a bake");
    fs::write(dir.join("cut.safetensors"), &whole[..whole.len() - 7]).expect("written");
    said(&eval("lambert", "cut.safetensors"), 3, "cut.safetensors");
    let mut bent = whole.clone();
    let middle = whole.len() / 2;
    bent[middle] ^= 1;
    fs::write(dir.join("bent.safetensors"), bent).expect("written");
    said(&eval("lambert", "bent.safetensors"), 3, "bent.safetensors");
    said(&eval("lambert", "none.safetensors"), 3, "none.safetensors");
    let other = ["render", "plane", "--bake", "small.safetensors", "-o", "x.pfm"];
    fails(dir, 3, "--local takes it", &other);
    let mesh = ["bake", "-b", "lambert", "--local", "precomputed_visibility", "-o", "x.safetensors"];
    fails(dir, 2, "data of a mesh", &mesh);
    fails(dir, 2, "safetensors", &["bake", "-b", "lambert", "--local", "btf_pca", "-o", "x.ktx2"]);
    fails(dir, 2, "--technique", &["bake", "overcast", "-b", "lambert", "-o", "x.safetensors"]);
    fails(
        dir,
        4,
        "tolerance",
        &[
            "bake",
            "-b",
            "ggx:alpha=0.3",
            "--local",
            "btf_pca",
            "--tolerance",
            "1e-5",
            "--quiet",
            "-o",
            "y.safetensors",
        ],
    );
    assert!(!dir.join("x.safetensors").exists() && dir.join("y.safetensors").exists());
}

/// A picture that claims to be far larger than its bytes is refused before it takes memory.
#[test]
fn pictures_that_claim_much_are_refused() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    done(dir, &[&SMALL[..], &["--relief", "0", "--format", "png"]].concat());
    let path = dir.join("out/view_000/light_000.png");
    let mut bytes = fs::read(&path).expect("a picture");
    // The width and height of a PNG's header, with its checksum.
    bytes[16..20].copy_from_slice(&60_000u32.to_be_bytes());
    bytes[20..24].copy_from_slice(&60_000u32.to_be_bytes());
    let crc = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    fs::write(&path, bytes).expect("written");
    let started = std::time::Instant::now();
    let local =
        ["--local", "btf_pca:map=out/btf.csv", "--light", "directional:direction=0/0/1,irradiance=1/1/1"];
    let render = ["render", "plane", "-b", "lambert", "-o", "x.pfm", "-t", "sh-irradiance"];
    fails(dir, 3, "light_000.png", &[&render[..], &local].concat());
    fails(dir, 3, "light_000.png", &["convert", "out/btf.csv", "--lobes", "1", "-o", "lobes"]);
    assert!(started.elapsed().as_secs() < 20 && !dir.join("x.pfm").exists() && !dir.join("lobes").exists());
}

fn crc32(bytes: &[u8]) -> u32 {
    let byte = |crc: u32, b: &u8| {
        (0..8).fold(crc ^ u32::from(*b), |c, _| if c & 1 == 1 { (c >> 1) ^ 0xEDB8_8320 } else { c >> 1 })
    };
    !bytes.iter().fold(!0, byte)
}

/// Pictures that are shaded with, by every method, and those that are refused: in one line, by name, with
/// exit code 3.
#[test]
fn pictures_are_shaded_or_refused() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    done(dir, &[&SMALL[..], &["--relief", "0", "--format", "png"]].concat());
    let black = vec![0.0; 8 * 4];
    let dark = Raster::rgb(8, 4, [black.clone(), black.clone(), black]);
    write_image(&dir.join("dark.pfm"), &dark, &WriteOptions::default()).expect("written");
    let rows =
        "u,v,nx,ny,nz,tx,ty,tz,vx,vy,vz\n0.25,0.25,0,0,1,1,0,0,0,0,1\n0.75,0.75,0,0,1,1,0,0,0.6,0,0.8\n";
    fs::write(dir.join("points.csv"), rows).expect("written");
    let light = "directional:direction=0.6/0/0.8,irradiance=1/1/1";
    let made = [
        "eval",
        "-p",
        "points.csv",
        "-e",
        "dark.pfm",
        "--light",
        light,
        "--quiet",
        "-b",
        "lambert",
        "-t",
        "sh-irradiance",
    ];
    for method in ["local,clusters=2", "view", "chained"] {
        let local = format!("btf_pca:map=out/btf.csv,method={method}");
        let text = well(dir, &[&made[..], &["--local", &local]].concat());
        for row in text.lines().skip(1) {
            let all: Vec<f64> = row.split(',').filter_map(|x| x.parse().ok()).collect();
            for (got, albedo) in all[11..14].iter().zip([0.8, 0.5, 0.2]) {
                // Steps of 8 bits over the cosine of 75°.
                let want = albedo * 0.8 / std::f64::consts::PI;
                assert!((got - want).abs() < 4e-3, "{method}: {row}: {got} {want}");
            }
        }
    }
    let refused = |why: &str| {
        let local = ["--local", "btf_pca:map=out/btf.csv"];
        fails(
            dir,
            3,
            why,
            &[
                &["render", "plane", "-b", "lambert", "-o", "x.pfm", "-t", "sh-irradiance", "--light", light],
                &local[..],
            ]
            .concat(),
        );
        assert!(!dir.join("x.pfm").exists());
    };
    let path = dir.join("out/btf.csv");
    let text = fs::read_to_string(&path).expect("a list");
    let put = |text: &str| fs::write(&path, text).expect("written");
    // A view lacks a light.
    let last = text.trim_end().rfind('\n').expect("lines");
    put(&text[..=last]);
    refused("each view must have each light (1 of 35");
    fails(dir, 3, "each view must have each light", &["inspect", "out/btf.csv"]);
    put(&text.replacen("75,", "95,", 1));
    refused("the light must be above the surface");
    put(&format!("{text}{}\n", text.lines().nth(1).expect("a row")));
    refused("are of the same view and light");
    put(&text.replace("view_002/light_003.png", "../outside.png"));
    refused("../outside.png");
    put("theta_i,phi_i,theta_o,phi_o\n0,0,0,0\n");
    refused("there is no column 'file'");
    put("\n");
    refused("such as theta_i,phi_i,theta_o,phi_o,file");
    put(&text);
    let picture = dir.join("out/view_002/light_003.png");
    let whole = fs::read(&picture).expect("a picture");
    let small = Raster::rgb(1, 1, [vec![0.5], vec![0.5], vec![0.5]]);
    write_image(&picture, &small, &WriteOptions::default()).expect("written");
    refused("light_003.png: is 1 x 1 where view_000/light_000.png is 8 x 8");
    fs::remove_file(&picture).expect("removed");
    refused("light_003.png");
    fails(dir, 3, "light_003.png", &["inspect", "out/btf.csv"]);
    fs::write(&picture, whole).expect("written");
    // A number that is not finite.
    let mut list = read_btf(&path, &Limits::default()).expect("a list");
    list.pictures[9].file = "nan.pfm".into();
    write_btf(&path, &list).expect("written");
    write_image(
        &dir.join("out/nan.pfm"),
        &Raster::rgb(8, 8, [0, 1, 2].map(|_| vec![0.5; 64])),
        &WriteOptions::default(),
    )
    .expect("written");
    let mut bytes = fs::read(dir.join("out/nan.pfm")).expect("a picture");
    let end = bytes.len() - 4;
    bytes[end..].copy_from_slice(&f32::NAN.to_le_bytes());
    fs::write(dir.join("out/nan.pfm"), bytes).expect("written");
    refused("nan.pfm: pixel");
    // A file of another kind.
    fs::write(&path, b"\xff\xfe").expect("written");
    refused("btf.csv");
    let o = run(dir, &["inspect", "none.csv"]);
    assert_eq!((o.status.code(), stderr(&o).lines().count()), (Some(3), 1));
}

//! The command as a user meets it: exit codes, one line per error, keys of JSON documents, no partial files.

use super::common::{fails, run, stderr};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn json(o: &Output) -> serde_json::Value {
    serde_json::from_slice(&o.stdout).unwrap_or_else(|e| panic!("{e}: {}", stderr(o)))
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
    for unknown in [
        &["bake"][..],
        &["irradiance"],
        &["--nothing"],
        &["irradiance", "furnace", "--bands", "0"],
        &["irradiance", "furnace", "--light-exposure", "1e9"],
    ] {
        assert_eq!(run(dir, unknown).status.code(), Some(2), "{unknown:?}");
    }
    let cpu = ["irradiance", "furnace", "--backend", "cpu", "--gpu-path", "raster"];
    fails(dir, 2, "leave it out with --backend cpu", &cpu);
    for (option, value, why) in [
        ("--tolerance", "-1", "'-1' is not positive"),
        ("--fov", "-30", "'-30' is not positive"),
        ("--blur", "-5", "'-5' is not 0 to 90 degrees"),
        ("--samples", "-4", "-4 is not in 1..=32"),
    ] {
        let o = run(dir, &["render", "sphere", "-o", "x.png", option, value]);
        assert_eq!(o.status.code(), Some(2));
        assert!(stderr(&o).contains(why), "{}", stderr(&o));
    }
    assert_eq!(run(dir, &["--help"]).status.code(), Some(0));
    assert_eq!(run(dir, &["--version"]).status.code(), Some(0));
}

#[cfg(not(feature = "gpu"))]
#[test]
fn the_gpu_back_end_names_its_feature() {
    let d = folder();
    fails(d.path(), 1, "--features gpu", &["irradiance", "furnace", "--backend", "gpu"]);
    fails(d.path(), 1, "--features gpu", &["irradiance", "furnace", "--gpu-path", "compute"]);
}

#[cfg(all(feature = "gpu", target_os = "linux"))]
#[test]
fn without_an_adapter_the_gpu_back_end_names_the_package_and_auto_takes_the_cpu() {
    let d = folder();
    let picture = |backend: &str| {
        let arguments =
            ["render", "sphere", "-t", "sh-irradiance", "-e", "furnace", "--size", "16", "-o", "a.exr"];
        let mut command = Command::new(env!("CARGO_BIN_EXE_steradian"));
        // The loader looks for drivers here, and finds none.
        command.env("VK_DRIVER_FILES", "none.json").env("VK_ICD_FILENAMES", "none.json");
        command.current_dir(d.path()).args(arguments).args(["--backend", backend]).output().expect("runs")
    };
    let o = picture("gpu");
    assert_eq!((o.status.code(), stderr(&o).trim_end().lines().count()), (Some(1), 1), "{}", stderr(&o));
    assert!(stderr(&o).contains("mesa-vulkan-drivers"));
    assert!(!d.path().join("a.exr").exists());
    let o = picture("auto");
    assert_eq!(o.status.code(), Some(0));
    assert!(stderr(&o).contains("rendering on the CPU"), "{}", stderr(&o));
    fails(d.path(), 2, "computes on the CPU", &["irradiance", "furnace", "--backend", "gpu"]);
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
fn inspect_describes_polynomial_texture_maps_and_light_positions() {
    let d = folder();
    let dir = d.path();
    let head = "PTM_1.2\nPTM_FORMAT_LRGB\n2\n1\n2 1 1 1 1 1\n10 0 0 0 0 0\n";
    let map = [head.as_bytes(), &(0..18).collect::<Vec<u8>>()].concat();
    fs::write(dir.join("a.ptm"), &map).unwrap();
    let v = json(&run(dir, &["inspect", "a.ptm", "--json"]));
    assert_eq!((v["kind"].as_str(), v["format"].as_str()), (Some("ptm"), Some("PTM_FORMAT_LRGB")));
    assert_eq!((v["width"].as_u64(), v["height"].as_u64()), (Some(2), Some(1)));
    let luminance = &v["polynomials"][0];
    assert_eq!(luminance["smallest"], serde_json::json!([-20.0, 1.0, 2.0, 3.0, 4.0, 5.0]));
    assert_eq!(luminance["largest"], serde_json::json!([-8.0, 7.0, 8.0, 9.0, 10.0, 11.0]));
    assert_eq!(v["color"], serde_json::json!({"smallest": [12, 13, 14], "largest": [15, 16, 17]}));
    let o = run(dir, &["inspect", "a.ptm"]);
    let text = String::from_utf8(o.stdout).unwrap();
    assert!(
        text.contains("PTM_FORMAT_LRGB, 2 x 1 texels") && text.contains("u² -20.0000 … -8.0000"),
        "{text}"
    );
    for n in 0..map.len() {
        fs::write(dir.join("cut.ptm"), &map[..n]).unwrap();
        fails(dir, 3, "cut.ptm: ", &["inspect", "cut.ptm"]);
    }
    fs::write(dir.join("jpeg.ptm"), head.replace("LRGB", "JPEG_LRGB")).unwrap();
    fails(dir, 3, "jpeg.ptm: is a PTM_FORMAT_JPEG_LRGB", &["inspect", "jpeg.ptm"]);

    fs::write(dir.join("a.lp"), "2\na 1.jpg 0 0.6 0.8\nb.jpg 3 0 4\n").unwrap();
    let v = json(&run(dir, &["inspect", "a.lp", "--json"]));
    assert_eq!((v["kind"].as_str(), v["lights"].as_u64()), (Some("light positions"), Some(2)));
    assert_eq!(v["distances"], serde_json::json!([1.0, 5.0]));
    let o = run(dir, &["inspect", "a.lp"]);
    let text = String::from_utf8(o.stdout).unwrap();
    assert!(text.contains("x 0.0000 … 3.0000"), "{text}");
    fs::write(dir.join("cut.lp"), "2\na 1.jpg 0 0.6 0.8\nb.jpg 3").unwrap();
    fails(dir, 3, "cut.lp: line 3", &["inspect", "cut.lp"]);
    fails(dir, 3, "none.lp", &["inspect", "none.lp"]);
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

#[test]
fn a_ground_has_a_technique_of_its_own() {
    let d = folder();
    let picture = |technique: &str, name: &str| {
        let spec = format!("--ground-technique={technique}");
        let args = ["render", "sphere", "-e", "sky:elevation=30", "-t", "sh_irradiance", "-b", "lambert"];
        let size = ["--size", "32x24", "--ground", &spec, "-o", name, "--json"];
        let v = json(&run(d.path(), &[&args[..], &size[..]].concat()));
        let used: Vec<_> =
            v["materials"].as_array().unwrap().iter().map(|m| m["technique"].clone()).collect();
        (used, fs::read(d.path().join(name)).unwrap())
    };
    let (open, bright) = picture("sh_irradiance", "open.pfm");
    let (shadowed, dark) = picture("prt_diffuse:precision=0.1", "shadowed.pfm");
    assert_eq!(open, ["sh_irradiance", "sh_irradiance"]);
    assert_eq!(shadowed, ["sh_irradiance", "prt_diffuse"]);
    // The sphere's shadow is on the ground, and none of its pixels is brighter.
    let sum = |pfm: &[u8]| -> f32 {
        let data = &pfm[pfm.len() - 32 * 24 * 12..];
        data.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).sum()
    };
    assert!(sum(&dark) < 0.98 * sum(&bright), "{} {}", sum(&dark), sum(&bright));
    let ground = |technique: &str, says: &str| {
        let spec = format!("--ground-technique={technique}");
        fails(d.path(), 2, says, &["render", "sphere", "-e", "studio", "--ground", &spec, "-o", "x.png"]);
    };
    ground("path", "technique of the ground: path shades all of a scene");
    ground("prt_diffuse:bands=0", "technique of the ground: ");
    ground("no_such", "no_such");
    let alone = ["render", "sphere", "-e", "studio", "--ground-technique=ambient", "-o", "x.png"];
    fails(d.path(), 2, "--ground", &alone);
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

/// Renders to `name` and reads the picture: width and planes.
fn picture(dir: &Path, name: &str, arguments: &[&str]) -> (usize, [Vec<f32>; 3], String) {
    let o = run(dir, &[&["render", "-o", name], arguments].concat());
    assert_eq!(o.status.code(), Some(0), "{arguments:?}: {}", stderr(&o));
    let raster =
        steradian_formats::read_image(&dir.join(name), &steradian_formats::Limits::default()).expect("reads");
    (raster.width, raster.into_rgb().expect("has colour"), stderr(&o))
}

/// RMS difference relative to the RMS of `b`, all channels.
fn rms(a: &[Vec<f32>; 3], b: &[Vec<f32>; 3]) -> f64 {
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| f(f64::from(*a), f64::from(*b))).sum()
    };
    (sum(&|a, b| (a - b).powi(2)) / sum(&|_, b| b * b)).sqrt()
}

#[test]
fn turning_light_and_camera_together_changes_nothing() {
    let d = folder();
    let view = |name: &str, rotate: &str, from: &str| {
        let fixed = ["sphere", "-e", "sky:elevation=35,azimuth=40", "-t", "diffuse_map", "--at", "0,0,0"];
        let own = ["--size", "64x48", "--fov", "60", "--rotate", rotate, "--from", from];
        picture(d.path(), name, &[fixed.as_slice(), &own].concat()).1
    };
    let still = view("a.exr", "0", "0,1,4");
    // By 90° about +Y, +Z becomes +X; 30° is no whole number of texels.
    assert!(rms(&view("b.exr", "90", "4,1,0"), &still) < 5e-3);
    assert!(rms(&view("c.exr", "30", "2,1,3.4641016"), &still) < 2e-2);
    assert!(rms(&view("d.exr", "90", "0,1,4"), &still) > 0.05);
}

#[test]
fn two_suns_add_up() {
    let d = folder();
    let suns = [
        "[[light.disk]]\ndirection = [1, 1, 1]\nangular_radius = 0.5\nradiance = [9000, 0, 100]\n",
        "[[light.disk]]\ndirection = [-1, 1, 1]\nangular_radius = 2\nradiance = [0, 900, 100]\n",
    ];
    let scene = |suns: &str| {
        format!(
            "[[mesh]]\nshape = \"sphere\"\nmaterial = \"a\"\n[material.a]\nbrdf = \"lambert:albedo=0.5\"\n\
             {suns}[output]\nwidth = 24\nheight = 24\nbackground = \"none\"\ntechnique = \"reference\"\n"
        )
    };
    let [a, b, both] = [suns[0].to_string(), suns[1].to_string(), suns.concat()].map(|s| {
        fs::write(d.path().join("s.toml"), scene(&s)).unwrap();
        picture(d.path(), "s.exr", &["s.toml"]).1
    });
    let sum: [Vec<f32>; 3] = std::array::from_fn(|c| a[c].iter().zip(&b[c]).map(|(a, b)| a + b).collect());
    assert!(rms(&both, &sum) < 2e-3);
    assert!(a[0].iter().any(|v| *v > 0.1) && b[1].iter().any(|v| *v > 0.1));
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let d = folder();
    for technique in ["split_sum", "reference"] {
        let with = |n: &str| {
            let fixed = ["sphere", "-e", "studio", "-b", "ggx:alpha=0.3", "--size", "20", "-t", technique];
            picture(d.path(), "t.exr", &[fixed.as_slice(), &["--threads", n]].concat()).1
        };
        assert!(with("1") == with("3"), "{technique}");
    }
}

#[test]
fn materials_of_mesh_files_are_used_and_textures_stand_upright() {
    let d = folder();
    let dir = d.path();
    fs::write(
        dir.join("q.obj"),
        "mtllib q.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
         usemtl a\nf 1/1 2/2 3/3 4/4\n",
    )
    .unwrap();
    fs::write(dir.join("q.mtl"), "newmtl a\nKd 0.25 0.5 0.75\n").unwrap();
    let fixed = ["q.obj", "-e", "furnace", "--size", "32", "--from", "0,0,4", "--at", "0,0,0"];
    let centre = |name: &str, more: &[&str]| {
        let (w, rgb, said) = picture(dir, name, &[fixed.as_slice(), more].concat());
        ([0, 1, 2].map(|c: usize| rgb[c][(w / 2) * w + w / 2]), said)
    };
    let close = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 4e-3);
    let (seen, said) = centre("a.exr", &[]);
    assert!(close(seen, [0.25, 0.5, 0.75]), "{seen:?}");
    assert!(said.contains("taken as lambert") && said.contains("technique "), "{said}");
    let (seen, said) = centre("b.exr", &["-b", "lambert:albedo=0.5"]);
    assert!(close(seen, [0.125, 0.25, 0.375]) && said.contains("multiply"), "{seen:?} {said}");
    assert!(close(centre("c.exr", &["-b", "lambert:albedo=0.5", "--plain"]).0, [0.5; 3]));
    // Red above, blue below.
    let halves = |top: f32, bottom: f32| vec![top, top, bottom, bottom];
    let planes = [halves(1.0, 0.0), halves(0.0, 0.0), halves(0.0, 1.0)];
    let raster = steradian_formats::Raster::rgb(2, 2, planes);
    steradian_formats::write_image(&dir.join("t.png"), &raster, &Default::default()).unwrap();
    let (w, rgb, _) = picture(dir, "d.exr", &[fixed.as_slice(), &["--base-color", "t.png"]].concat());
    let at = |y: usize| [rgb[0][y * w + w / 2], rgb[2][y * w + w / 2]];
    assert!(
        at(w / 4)[0] > 0.8 && at(w / 4)[1] < 0.1 && at(3 * w / 4)[1] > 0.8,
        "{:?} {:?}",
        at(w / 4),
        at(3 * w / 4)
    );
    fs::write(dir.join("n.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    fails(dir, 2, "texture coordinates", &["render", "n.obj", "--base-color", "t.png", "-o", "e.png"]);
}

#[test]
fn the_map_of_irradiance_is_pi_times_the_radiance_of_white_paint() {
    let d = folder();
    let dir = d.path();
    let o = run(dir, &["irradiance", "sky:elevation=20", "-o", "e.exr", "--size", "64x32", "--json"]);
    assert_eq!(json(&o)["radiance"].as_array().map(Vec::len), Some(9), "{}", stderr(&o));
    let map =
        steradian_formats::read_image(&dir.join("e.exr"), &steradian_formats::Limits::default()).unwrap();
    assert!(map.metadata.iter().any(|(k, v)| k == "steradian.quantity" && v.contains("W m^-2")));
    let rgb = map.into_rgb().unwrap();
    let texels = [(0usize, 5usize), (17, 12), (40, 20), (63, 31)];
    let mut csv = String::from("nx,ny,nz,vx,vy,vz\n");
    for (i, j) in texels {
        let (phi, theta) = (
            ((i as f64 + 0.5) / 64.0 - 0.5) * std::f64::consts::TAU,
            (j as f64 + 0.5) / 32.0 * std::f64::consts::PI,
        );
        let n = [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()];
        csv.push_str(&format!("{0},{1},{2},{0},{1},{2}\n", n[0], n[1], n[2]));
    }
    fs::write(dir.join("n.csv"), csv).unwrap();
    let o = run(dir, &["eval", "-e", "sky:elevation=20", "-b", "lambert", "-p", "n.csv", "--json"]);
    for (k, (i, j)) in texels.into_iter().enumerate() {
        let want = json(&o)["points"][k]["rgb"][1].as_f64().unwrap() * std::f64::consts::PI;
        let got = f64::from(rgb[1][j * 64 + i]);
        assert!((got - want).abs() < 2e-3 * want, "({i}, {j}): {got} against {want}");
    }
    let o = run(dir, &["irradiance", "furnace:radiance=2", "-o", "c.ktx2", "-q"]);
    assert!(String::from_utf8_lossy(&o.stdout).starts_with("l,m,"));
    fs::write(dir.join("d.csv"), "x,y,z\n1,2,3\n").unwrap();
    let o = run(dir, &["sample", "c.ktx2", "-d", "d.csv", "--json"]);
    assert!((json(&o)["rgb"][0][0].as_f64().unwrap() - std::f64::consts::TAU).abs() < 1e-3);
    fails(dir, 2, "belong to a map", &["irradiance", "furnace", "--size", "8"]);
}

#[test]
fn outputs_of_unknown_formats_are_wrong_usage() {
    let d = folder();
    let o = run(d.path(), &["irradiance", "furnace", "-o", "coefficients"]);
    assert!(o.status.success() && fs::remove_file(d.path().join("coefficients")).is_ok());
    let scene = "[[mesh]]\nshape = \"sphere\"\nmaterial = \"a\"\n[material.a]\nbrdf = \"lambert\"\nparams = { size = 8 }\n\
        [light]\nenvironment = \"furnace\"\n";
    fs::write(d.path().join("s.toml"), scene).unwrap();
    fails(
        d.path(),
        3,
        "s.toml: material 'a': params belong to a technique",
        &["render", "s.toml", "-o", "x.png"],
    );
    fs::remove_file(d.path().join("s.toml")).unwrap();
    for arguments in [
        &["render", "sphere", "-o", "x.tif"][..],
        &["render", "sphere", "-o", "x"],
        &["convert", "furnace", "-o", "x.foo"],
        &["irradiance", "furnace", "-o", "x.foo"],
        &["compare", "-o", "x.exr"],
        &["compare", "--html", "x.png"],
    ] {
        fails(d.path(), 2, "use one of", arguments);
    }
    assert_eq!(fs::read_dir(d.path()).unwrap().count(), 1);
}

#[test]
fn a_scene_is_compared_and_its_report_holds_everything() {
    let d = folder();
    let scene = "[[mesh]]\nshape = \"sphere\"\nmaterial = \"a\"\n[[mesh]]\nshape = \"sphere\"\nmaterial = \"b\"\n\
        translate = [2.2, 0, 0]\n[material.a]\nbrdf = \"lambert:albedo=0.5\"\n[material.b]\nbrdf = \"phong:n=20\"\n\
        [light]\nenvironment = \"overcast\"\n";
    fs::write(d.path().join("<b>&.toml"), scene).unwrap();
    let arguments =
        ["compare", "<b>&.toml", "-t", "sh_irradiance", "-t", "mirror_map", "--size", "24", "--json"];
    let o = run(d.path(), &[arguments.as_slice(), &["--html", "r.html", "-o", "r.png"]].concat());
    let v = json(&o);
    let answers = &v["comparisons"][0]["techniques"];
    assert!(answers[1]["relative_rms"].as_f64().unwrap() < 0.05, "{answers}");
    assert!(answers[1]["bytes"].as_u64().unwrap() > 0 && answers[1]["flip"].is_number());
    assert!(answers[2]["refused"].is_string());
    let page = fs::read_to_string(d.path().join("r.html")).unwrap();
    assert!(page.contains("&lt;b&gt;&amp;.toml") && !page.contains("<b>"));
    assert_eq!(page.matches("src=\"data:image/png;base64,").count(), page.matches("<img").count());
}

/// An image that reads as light.
fn light(path: &Path) {
    let mut bytes = b"PF\n8 4\n-1.0\n".to_vec();
    (0..96).for_each(|k| bytes.extend((0.5 + k as f32 / 96.0).to_le_bytes()));
    fs::write(path, bytes).expect("written");
}

#[test]
fn no_output_replaces_an_input() {
    let d = folder();
    let dir = d.path();
    light(&dir.join("in.pfm"));
    light(&dir.join("in.exr"));
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl a\nf 1/1 2/2 3/3\n";
    fs::write(dir.join("m.obj"), obj).expect("written");
    fs::write(dir.join("m.mtl"), "newmtl a\nmap_Kd skin.png\n").expect("written");
    let picture = ["render", "sphere", "--size", "8", "-b", "lambert", "-t", "sh_irradiance"];
    assert!(run(dir, &[&picture[..], &["-o", "skin.png"]].concat()).status.success());
    let scene = "[light]\nenvironment = \"in.pfm\"\n[material.a]\nbrdf = \"lambert\"\n[[mesh]]\nshape = \"sphere\"\nmaterial = \"a\"";
    fs::write(dir.join("s.toml"), scene).expect("written");
    fs::create_dir(dir.join("below")).expect("made");
    light(&dir.join("below/a_level0.exr"));
    light(&dir.join("below/light.exr"));
    let before = |name: &str| fs::read(dir.join(name)).expect("there");
    for (file, arguments) in [
        ("in.pfm", &["render", "sphere", "-e", "in.pfm", "-b", "lambert", "-o", "in.pfm"][..]),
        ("in.pfm", &["render", "sphere", "-e", "in.pfm", "-b", "lambert", "-o", "./below/../in.pfm"]),
        ("in.pfm", &["render", "s.toml", "-o", "in.pfm"]),
        ("skin.png", &["render", "m.obj", "-o", "skin.png"]),
        ("skin.png", &["render", "sphere", "--base-color-texture", "skin.png", "-o", "skin.png"]),
        ("skin.png", &["compare", "m.obj", "-t", "sh_irradiance", "-o", "skin.png"]),
        ("in.pfm", &["convert", "in.pfm", "-o", "in.pfm"]),
        ("in.exr", &["convert", "in.exr", "--to", "octahedral", "-o", "in.exr"]),
        ("in.pfm", &["prefilter", "in.pfm", "--kernel", "lambert", "-o", "in.pfm"]),
        ("in.pfm", &["prefilter", "*.pfm", "--kernel", "lambert", "-o", "{}.pfm"]),
        ("below/light.exr", &["prefilter", "below/light.exr", "--profile", "godot", "-o", "below"]),
        (
            "below/a_level0.exr",
            &[
                "prefilter",
                "below/a_level0.exr",
                "--name",
                "a",
                "--levels",
                "2",
                "--dump-levels",
                "below",
                "-o",
                "x.ktx2",
            ],
        ),
        ("in.pfm", &["irradiance", "in.pfm", "-o", "in.pfm"]),
        ("p.csv", &["eval", "-e", "furnace", "-b", "lambert", "-p", "p.csv", "-o", "p.csv"]),
        ("p.csv", &["sample", "furnace", "-d", "p.csv", "-o", "p.csv"]),
        ("p.csv", &["transfer", "sphere", "-p", "p.csv", "-o", "p.csv"]),
        ("in.pfm", &["convert", "in.pfm", "--extract-sun", "in.pfm", "-o", "x.exr"]),
    ] {
        let was = before(file);
        let (code, said, error) = super::common::said(dir, arguments);
        assert_eq!((code, said.as_str()), (Some(2), ""), "{arguments:?}: {error}");
        assert!(error.trim_end().lines().last().is_some_and(|l| l.contains("is an input")), "{error}");
        assert_eq!(before(file), was, "{arguments:?}");
    }
    fails(dir, 2, "in.pfm: is an input, and would be replaced", &["convert", "in.pfm", "-o", "in.pfm"]);
}

#[test]
fn unknown_names_are_wrong_usage_and_missing_files_bad_input() {
    let d = folder();
    let dir = d.path();
    for (near, arguments) in [
        ("'sphere'", &["render", "shpere", "-o", "x.png"][..]),
        ("'sky'", &["render", "sphere", "-e", "skyy", "-o", "x.png"]),
        ("'lambert'", &["render", "sphere", "-b", "lamber", "-o", "x.png"]),
        ("'split_sum'", &["render", "sphere", "-b", "ggx:alpha=0.2", "-t", "split-summ", "-o", "x.png"]),
        ("'ggx'", &["prefilter", "sky", "--kernel", "gx", "-o", "x.ktx2"]),
        ("'gold-paint'", &["render", "sphere", "-b", "sgd:goldpaint", "-o", "x.png"]),
        ("'sphere'", &["inspect", "shpere"]),
        ("'sky'", &["convert", "skyy", "-o", "x.exr"]),
        ("'torus'", &["transfer", "tourus", "-o", "x.safetensors"]),
        ("'grooves'", &["capture", "groves", "-o", "pictures"]),
    ] {
        fails(dir, 2, &format!("did you mean {near}?"), arguments);
    }
    for arguments in [
        &["render", "./sphere", "-o", "x.png"][..],
        &["render", "none.obj", "-o", "x.png"],
        &["render", "sphere", "-e", "none.hdr", "-o", "x.png"],
        &["capture", "none.png", "-o", "pictures"],
    ] {
        fails(dir, 3, "no such file", arguments);
    }
    assert!(!dir.join("x.png").exists() && !dir.join("pictures").exists());
}

#[test]
fn errors_say_what_to_do() {
    let d = folder();
    let dir = d.path();
    fs::write(dir.join("cut.hdr"), "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 64 +X 128\n\x02\x02").unwrap();
    fails(dir, 3, "copy or download it again", &["inspect", "cut.hdr"]);
    let (_, _, said) = super::common::said(dir, &["inspect", "brdf:sgd:goldpaint"]);
    assert!(said.contains("inspect 'brdf:sgd:*' lists all 100") && said.len() < 300, "{said}");
    let listed = super::common::well(dir, &["inspect", "brdf:sgd:*"]);
    assert!(listed.lines().count() == 100 && listed.contains("sgd:gold-paint"), "{listed}");
    fails(dir, 2, "these have: sgd:*", &["inspect", "brdf:ggx:*"]);
    fails(dir, 2, "`steradian techniques` lists", &["bake", "sky", "-b", "lambert", "-o", "x.safetensors"]);
    #[cfg(target_os = "linux")]
    for arguments in [
        &["render", "sphere", "-o", "/proc/x.png"][..],
        &["bake", "sky", "-b", "lambert", "-t", "sh_irradiance", "-o", "/proc/x.safetensors"],
        &["bake", "sky", "-b", "lambert", "-t", "sh_irradiance", "-o", "/proc/folder"],
        &["eval", "-e", "sky", "-b", "lambert", "-p", "p.csv", "-o", "/proc/x.csv"],
        &["prefilter", "sky", "--kernel", "ggx", "--levels", "5", "-o", "/proc/x.ktx2"],
        &["prefilter", "sky", "--profile", "unity", "-o", "/proc/folder"],
        &["prefilter", "sky", "--profile", "unity,godot", "-o", "/proc/folder"],
        &["compare", "-e", "sky", "-o", "/proc/x.png"],
        &["capture", "grooves", "-o", "/proc/folder"],
        &["demo", "-o", "/proc/x.png"],
    ] {
        let start = std::time::Instant::now();
        fails(dir, 1, "takes no files", arguments);
        assert!(start.elapsed().as_secs_f64() < 5.0, "{arguments:?}");
    }
}

#[test]
fn inspect_reads_what_render_reads() {
    let d = folder();
    let dir = d.path();
    let mut hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 128 +X 256\n".to_vec();
    hdr.extend([128u8, 128, 128, 129].repeat(128 * 256));
    fs::write(dir.join("light.txt"), hdr).expect("written");
    assert!(super::common::well(dir, &["inspect", "light.txt"]).contains("256 x 128"));
    super::common::done(dir, &["convert", "brdf:lambert:albedo=0.5", "-o", "grey.binary"]);
    assert!(super::common::well(dir, &["inspect", "grey.binary"]).contains("merl"));
    fs::write(dir.join("npf.bin"), [1; 64]).expect("written");
    fails(dir, 3, "brdf:npf:FILE,MATERIAL", &["inspect", "npf.bin"]);
}

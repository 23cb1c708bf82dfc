//! Faults point at line, column and key.

use super::*;

const GOOD: &str = r#"
[camera]
from = [0.0, 1.0, 3.0]
fov = 30

[[mesh]]
shape = "sphere"
material = "clay"
rotate = [0, 90, 0]
translate = [1, 2, 3]
scale = 2

[material.clay]
brdf = "lambert:albedo=0.5"

[light]
environment = "sky:elevation=35"
rotation = 90
[[light.disk]]
direction = [0, 2, 0]
angular_radius = 0.5
radiance = [1, 1, 1]

[output]
width = 64
tone_mapper = "aces"
background = [0.1, 0.1, 0.1]
"#;

fn parse(text: &str) -> Result<SceneFile, SceneError> {
    SceneFile::parse("s.toml", text, Files::None)
}

fn fault(from: &str, to: &str) -> String {
    assert!(GOOD.contains(from), "{from}");
    parse(&GOOD.replacen(from, to, 1)).unwrap_err().to_string()
}

#[test]
fn a_good_file_says_what_it_says() {
    let s = parse(GOOD).unwrap();
    // Rotating +Z by 90° about +Y gives +X; then scale and translation.
    let p = s.meshes[0].transform.transform_point3(Vec3::Z);
    assert!((p - Vec3::new(3.0, 2.0, 3.0)).length() < 1e-5, "{p}");
    assert_eq!((s.output.width, s.output.height, s.output.samples), (64, 512, 4));
    assert_eq!(s.light.disks[0].direction, glam::DVec3::Y);
    assert_eq!(s.materials[0].name, "clay");
}

#[test]
fn unknown_keys_get_a_suggestion() {
    let e = fault("fov = 30", "fow = 30");
    assert!(e.starts_with("s.toml:4:1: unknown key 'fow' (did you mean 'fov'?); there are: from"), "{e}");
    assert!(fault("width = 64", "wide = 64").contains("s.toml:25:1: unknown key 'wide'"));
}

#[test]
fn values_are_checked_where_they_stand() {
    for (from, to, want) in [
        ("fov = 30", "fov = 200", "s.toml:4:7: key 'fov': 200"),
        ("rotation = 90", "rotation = nan", ": key 'rotation': must be finite degrees"),
        ("rotation = 90", "exposure = 1e9", ": key 'exposure': must be -64 … 64"),
        (
            "[output]",
            "[[light.point]]\nposition = [0, 0, 0]\nintensity = [1, -1, 0]\n[output]",
            "key 'intensity': must be finite and not negative",
        ),
        ("width = 64", "blur = -5.0", "s.toml:25:8: key 'blur': must be 0 … 90 degrees"),
        ("fov = 30", "fov = \"wide\"", "s.toml:4:7: key 'fov': invalid type"),
        (
            "material = \"clay\"",
            "material = \"cley\"",
            "s.toml:8:12: unknown material 'cley' (did you mean 'clay'?)",
        ),
        (
            "shape = \"sphere\"",
            "file = \"../x.obj\"",
            "s.toml:7:8: key 'file': '../x.obj' must be a file below",
        ),
        ("shape = \"sphere\"", "file = \"/etc/x.obj\"", "s.toml:7:8: key 'file'"),
        ("shape = \"sphere\"", "file = \"https://a/x.obj\"", "s.toml:7:8: key 'file'"),
        ("shape = \"sphere\"", "", "[[mesh]]: needs 'file' or 'shape'"),
        ("lambert:albedo=0.5", "lamberd", "s.toml:14:8: material 'clay', key 'brdf': no BRDF model"),
        ("scale = 2", "scale = 0", "s.toml:11:9: key 'scale'"),
        ("angular_radius = 0.5", "angular_radius = 0", "key 'angular_radius'"),
        ("direction = [0, 2, 0]", "direction = [0, 0, 0]", "key 'direction'"),
        ("radiance = [1, 1, 1]", "radiance = [1, -1, 1]", "key 'radiance': must be finite and not negative"),
        ("radiance = [1, 1, 1]", "irradiance = [1, 1, 1]\nradiance = [1, 1, 1]", "give either 'radiance' or"),
        (
            "rotation = 90",
            "sun_lights = \"../suns.json\"",
            "key 'sun_lights': '../suns.json' must be a file below",
        ),
        ("\"aces\"", "\"acse\"", "s.toml:26:15: unknown tone_mapper 'acse' (did you mean 'aces'?)"),
        ("width = 64", "width = 0", "s.toml:25:9: key 'width': must be 1"),
        ("from = [0.0, 1.0, 3.0]", "from = [0.0, 0.0, 0.0]", "same point"),
        ("[camera]", "[camera", "s.toml:2:"),
    ] {
        let e = fault(from, to);
        assert!(e.contains(want), "{from} → {to}: {e}");
        assert_eq!(e.lines().count(), 1, "{e}");
    }
}

#[test]
fn no_mesh_and_no_light_are_faults() {
    assert!(parse("").unwrap_err().why.contains("no [[mesh]]"));
    let dark = "[[mesh]]\nshape='sphere'\nmaterial='a'\n[material.a]\nbrdf='lambert'\n";
    assert!(parse(dark).unwrap_err().why.contains("no light"));
}

/// Any text gives a scene of finite numbers or an error of one line, and quickly.
#[test]
fn damaged_files_end_well() {
    let mut damage = steradian_testkit::Mutator::new(1);
    let other = b"material = { brdf = \"ggx:alpha=0.1\", params = { a = 1 } }\n[[light.point]]\nposition = [1, 2, 3]\n";
    for _ in 0..if steradian_testkit::full() { 1_000_000 } else { 10_000 } {
        let text = damage.damage(GOOD.as_bytes(), other);
        let text = String::from_utf8_lossy(&text);
        let start = std::time::Instant::now();
        match parse(&text) {
            Ok(s) => {
                assert!(s.meshes.iter().all(|m| m.transform.is_finite()), "{text}");
                let disks = s.light.disks.iter().all(|d| d.radiance.iter().all(|v| v.is_finite()));
                assert!(disks && s.light.rotation.is_finite(), "{text}");
            }
            Err(e) => assert_eq!(e.to_string().lines().count(), 1, "{e}"),
        }
        assert!(start.elapsed().as_secs() < 2, "{text}");
    }
}

/// Texts that are deep, long, or make every message long.
#[test]
fn hostile_files_end_soon() {
    let many = |n: usize, one: &dyn Fn(usize) -> String| (0..n).map(one).collect::<String>();
    let meshes = many(20_000, &|i| format!("[[mesh]]\nshape=\"sphere\"\nmaterial=\"m{i}\"\n"));
    let materials = many(20_000, &|i| format!("[material.m{i}]\nbrdf=\"lambert\"\n"));
    let light = "[light]\nenvironment=\"sky\"\n";
    for (text, good) in [
        (format!("a = {}", "[".repeat(1 << 20)), false),
        (format!("a = {}", "{a=".repeat(1 << 20)), false),
        (format!("{}a = 1", "a.".repeat(1 << 20)), false),
        (many(100_000, &|i| format!("[a{i}]\n")), false),
        (format!("{meshes}{materials}{light}"), true),
        (format!("{meshes}{light}").replace("m19999", "other") + &materials, false),
    ] {
        let start = std::time::Instant::now();
        let read = parse(&text);
        assert!(start.elapsed().as_secs() < 2, "{} bytes took {:?}", text.len(), start.elapsed());
        assert_eq!(read.is_ok(), good, "{:?}", read.err());
        assert!(read.err().is_none_or(|e| e.to_string().len() < 2000));
    }
}

/// The page for users: its example is a scene, and it names every key.
#[test]
fn the_page_on_scene_files_is_true() {
    let page = include_str!("../../../../docs/scenes.md");
    let example = page.split("```toml").nth(1).and_then(|rest| rest.split("```").next()).expect("an example");
    let scene = SceneFile::parse("still-life.toml", example, Files::None).expect("it is a scene");
    assert_eq!((scene.meshes.len(), scene.materials.len(), scene.light.points.len()), (2, 3, 1));
    // Fields of the schema are keys; tables have sections of their own.
    let fields = include_str!("schema.rs").lines().filter_map(|l| l.trim().strip_prefix("pub "));
    let keys: Vec<&str> = fields.filter_map(|f| f.split_once(": ")).map(|f| f.0).collect();
    assert!(keys.len() > 40, "{keys:?}");
    for key in keys {
        let forms = ["`KEY`", "[KEY]", "[[KEY]]", ".KEY]]", "[KEY."].map(|f| f.replace("KEY", key));
        assert!(forms.iter().any(|f| page.contains(f)), "{key} is not on the page");
    }
}

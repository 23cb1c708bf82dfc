//! Several inputs and consumers at once, several pictures of one scene, and tables for papers.

use super::common::{fails, run, well};

fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(dir.path().join("lights")).expect("a folder");
    for (sky, name) in [("overcast", "grey"), ("studio", "boxes")] {
        well(dir.path(), &["convert", sky, "--size", "32x16", "-o", &format!("lights/{name}.exr")]);
    }
    dir
}

#[test]
fn every_input_has_its_files_for_every_consumer() {
    let dir = &folder();
    let dir = dir.path();
    let small = ["--size", "16", "--levels", "2", "--check", "4"];
    let outputs = |more: &[&str]| {
        let text = well(dir, &[&["prefilter", "--json"], more, &small].concat());
        let document: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        document["outputs"].as_array().map_or(0, Vec::len)
    };
    assert_eq!(outputs(&["lights", "--profile", "khronos,bevy", "-o", "out"]), 4);
    for file in [
        "khronos/grey/specular.ktx2",
        "khronos/boxes/specular.ktx2",
        "bevy/grey_specular_rgb9e5_zstd.ktx2",
        "bevy/boxes_diffuse_rgb9e5_zstd.ktx2",
    ] {
        assert!(dir.join("out").join(file).is_file(), "{file}");
    }
    assert_eq!(outputs(&["lights/*.exr", "-o", "rough-{}.ktx2"]), 2);
    assert!(dir.join("rough-grey.ktx2").is_file() && dir.join("rough-boxes.ktx2").is_file());
    let one = ["prefilter", "studio", "--profile", "khronos", "--name", "mine", "-o", "named"];
    well(dir, &[&one[..], &small].concat());
    assert!(dir.join("named/mine/sheen.ktx2").is_file());
    // Fixed names: another light would replace what is there, the same one makes it again.
    let again = |run: &dyn Fn(&[&str]), light: &str| {
        run(&[&["prefilter", light, "--profile", "khronos", "-o", "fixed"], &small[..]].concat());
    };
    let made = |a: &[&str]| drop(well(dir, a));
    again(&made, "lights/grey.exr");
    let before = std::fs::read(dir.join("fixed/specular.ktx2")).expect("a file");
    let why = "was made from grey.exr, and would be replaced: give --name";
    again(&|a| fails(dir, 2, why, a), "lights/boxes.exr");
    assert_eq!(std::fs::read(dir.join("fixed/specular.ktx2")).expect("a file"), before);
    again(&made, "lights/grey.exr");
    fails(dir, 2, "rough-{}.ktx2", &["prefilter", "lights", "--kernel", "lambert", "-o", "a.ktx2"]);
    let twice = ["prefilter", "studio", "studio", "--profile", "raw", "-o", "twice"];
    fails(dir, 2, "replace one another", &twice);
    fails(dir, 3, "holds no images", &["prefilter", "lights/*.hdr", "--profile", "raw", "-o", "none"]);
}

/// A damaged file leaves the others as they are; the first failure's code is the command's.
#[test]
fn one_damaged_input_does_not_end_the_batch() {
    let dir = &folder();
    let dir = dir.path();
    well(dir, &["convert", "overcast", "--size", "32x16", "-o", "a.hdr"]);
    well(dir, &["convert", "studio", "--size", "32x16", "-o", "c.hdr"]);
    let whole = std::fs::read(dir.join("a.hdr")).expect("a file");
    std::fs::write(dir.join("b.hdr"), &whole[..whole.len() / 2]).expect("a file");
    let batch =
        ["prefilter", "a.hdr", "b.hdr", "c.hdr", "--kernel", "lambert", "--size", "16", "-o", "{}.ktx2"];
    let (code, _, said) = super::common::said(dir, &batch);
    assert_eq!(code, Some(3), "{said}");
    let last = said.lines().last().unwrap_or_default();
    assert!(last.contains("1 of 3 outputs failed") && last.contains("b.hdr"), "{said}");
    assert!(dir.join("a.ktx2").is_file() && dir.join("c.ktx2").is_file() && !dir.join("b.ktx2").exists());
    // The document has a place for every output.
    let (code, out, _) = super::common::said(dir, &[&batch[..], &["--json", "-q"]].concat());
    let document: serde_json::Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((code, document["outputs"].as_array().map(Vec::len)), (Some(3), Some(3)));
    assert!(document["outputs"][1]["failed"].as_str().is_some_and(|w| w.contains("b.hdr")), "{document}");
    // One input alone says why, and nothing else.
    fails(dir, 3, "b.hdr", &["prefilter", "b.hdr", "--kernel", "lambert", "-o", "b.ktx2"]);
}

#[test]
fn a_turntable_has_one_exposure() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    let scene = ["render", "torus", "-e", "studio", "-b", "lambert", "-t", "sh_irradiance", "--size", "24"];
    let text = well(dir, &[&scene[..], &["--orbit", "3", "--json", "-o", "turn-{}.png"]].concat());
    assert!(text.contains("exposure"), "{text}");
    let exposure = |k: usize| {
        let bytes = std::fs::read(dir.join(format!("turn-{k:04}.png"))).expect("a frame");
        let text = String::from_utf8_lossy(&bytes).into_owned();
        let at = text.find("steradian.exposure").expect("its exposure");
        text[at..at + 32].to_string()
    };
    assert_eq!(exposure(0), exposure(1));
    assert_eq!(exposure(0), exposure(2));
    let text = well(dir, &[&scene[..], &["--orbit", "3", "--json", "-o", "turn.apng"]].concat());
    assert!(text.contains("exposure"), "{text}");
    let bytes = std::fs::read(dir.join("turn.apng")).expect("an animation");
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().expect("a PNG");
    let control = reader.info().animation_control.expect("an animation");
    assert_eq!((control.num_frames, control.num_plays), (3, 0));
    let mut pictures = Vec::new();
    for k in 0..3 {
        let mut picture = vec![0; reader.output_buffer_size().expect("small")];
        reader.next_frame(&mut picture).expect("a frame");
        let frame = std::fs::File::open(dir.join(format!("turn-{k:04}.png"))).expect("a frame");
        let mut still = png::Decoder::new(std::io::BufReader::new(frame)).read_info().expect("a PNG");
        let mut same = vec![0; still.output_buffer_size().expect("small")];
        still.next_frame(&mut same).expect("pixels");
        assert!(picture == same, "frame {k}");
        pictures.push(picture);
    }
    assert!(pictures[0] != pictures[1]);
    fails(dir, 2, "turn-{}.png", &[&scene[..], &["--orbit", "3", "-o", "turn.png"]].concat());
    fails(dir, 2, "upward direction is zero", &[&scene[..], &["--up", "0,0,0", "-o", "a.png"]].concat());
}

/// The ground meets the object, fills the picture up to the horizon, and the object stands where it stood.
#[test]
fn a_ground_reaches_from_the_object_to_the_horizon() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    let scene =
        ["render", "teapot", "-e", "overcast", "-b", "lambert", "-t", "sh_irradiance", "--size", "64"];
    well(dir, &[&scene[..], &["-o", "bare.exr"]].concat());
    let said =
        well(dir, &[&scene[..], &["--ground=lambert:albedo=0.9", "--json", "-o", "ground.exr"]].concat());
    assert!(said.contains("lambert:albedo=0.9"), "{said}");
    let alpha = |name: &str| {
        let raster = steradian_formats::read_image(&dir.join(name), &steradian_formats::Limits::default())
            .expect("a picture");
        raster.channel("A").expect("coverage").to_vec()
    };
    let (bare, ground) = (alpha("bare.exr"), alpha("ground.exr"));
    let row = |a: &[f32], j: usize| a[64 * j..64 * (j + 1)].iter().sum::<f32>() / 64.0;
    // The camera looks down by nine degrees: the horizon lies above the middle.
    assert!(row(&bare, 63) < 0.1 && (32..64).all(|j| row(&ground, j) > 0.999), "{ground:?}");
    assert!(row(&ground, 1) < 0.1);
    assert!(bare.iter().zip(&ground).all(|(b, g)| g + 1e-3 >= *b));
    std::fs::write(
        dir.join("scene.toml"),
        "[[mesh]]\nshape = \"sphere\"\nmaterial = \"clay\"\n[material.clay]\nbrdf = \"lambert\"\n\
         [ground]\nmaterial = \"clay\"\n[light]\nenvironment = \"overcast\"\n",
    )
    .expect("a scene");
    well(dir, &["render", "scene.toml", "-t", "sh_irradiance", "--size", "64", "-o", "scene.exr"]);
    assert!((40..64).all(|j| row(&alpha("scene.exr"), j) > 0.999));
}

#[test]
fn outputs_and_names_are_checked_before_the_work() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    fails(dir, 1, "does not exist", &["render", "sphere", "-o", "missing/x.png"]);
    fails(dir, 1, "does not exist", &["compare", "sphere", "-o", "missing/x.png"]);
    fails(dir, 2, "did you mean 'teapot'", &["render", "teapott", "-o", "x.png"]);
    fails(dir, 2, "did you mean 'studio'", &["inspect", "studioo"]);
    assert!(well(dir, &["inspect", "brdf:"]).contains("curet"));
}

#[test]
fn common_options_are_described_once_and_taken_everywhere() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    assert!(well(dir, &["--help"]).contains("--max-memory"));
    let help = well(dir, &["irradiance", "--help"]);
    assert!(!help.contains("--max-memory") && help.contains("steradian --help"), "{help}");
    let document = |arguments: &[&str]| well(dir, arguments).trim_start().starts_with('{');
    assert!(document(&["irradiance", "studio", "--json", "--threads", "1"]));
    assert!(document(&["--json", "irradiance", "studio"]));
}

#[test]
fn comparisons_are_tables_for_papers() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    let compare =
        ["compare", "sphere", "-e", "studio", "-b", "lambert", "-t", "sh_irradiance", "--size", "16"];
    well(dir, &[&compare[..], &["--table", "t.csv"]].concat());
    well(dir, &[&compare[..], &["--table", "t.tex"]].concat());
    let csv = std::fs::read_to_string(dir.join("t.csv")).expect("a table");
    let rows: Vec<&str> = csv.lines().collect();
    assert!(rows.len() == 3 && rows[2].starts_with("\"studio\",\"lambert\",\"sh_irradiance\",0."), "{csv}");
    let tex = std::fs::read_to_string(dir.join("t.tex")).expect("a table");
    assert!(tex.contains("sh\\_irradiance") && tex.contains("\\toprule"), "{tex}");
}

/// A sweep has a row per value and technique, a chart in both formats, and continues where it was left.
#[test]
fn sweeps_are_rows_and_charts_and_go_on() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    let sweep = |n: &str| format!("brdf:alpha=0.2..0.6:{n}");
    let run = |n: &str, more: &[&str]| {
        let sweep = sweep(n);
        let scene = ["compare", "sphere", "-e", "overcast", "-b", "ggx", "-t", "split_sum"];
        let size = if more.contains(&"--size") { &[][..] } else { &["--size", "12"][..] };
        let all = [&scene[..], size, &["--sweep", &sweep, "--resume", "kept.json"], more].concat();
        let o = run(dir, &all);
        let said = String::from_utf8_lossy(&o.stderr).into_owned();
        assert!(o.status.success(), "{said}");
        (String::from_utf8_lossy(&o.stdout).into_owned(), said)
    };
    run("2", &["--table", "first.csv"]);
    let kept = std::fs::read_to_string(dir.join("kept.json")).expect("results");
    let (_, said) = run("3", &["--table", "second.csv", "--plot", "chart.svg"]);
    assert!(said.contains("2 of 3 rows are those of kept.json"), "{said}");
    let rows = |name: &str| {
        let text = std::fs::read_to_string(dir.join(name)).expect("a table");
        text.lines().map(String::from).collect::<Vec<_>>()
    };
    let (first, second) = (rows("first.csv"), rows("second.csv"));
    assert!(first[0].starts_with("environment,brdf,technique,value,flip"), "{first:?}");
    // The reference and the technique at each value; the old rows with the seconds that they took then.
    assert_eq!((first.len(), second.len()), (5, 7));
    let named = |row: &String| {
        let cells: Vec<&str> = row.split(',').collect();
        [&cells[..4], &cells[9..]].concat().join(",")
    };
    let again: Vec<String> = second.iter().map(named).collect();
    assert!(first[1..].iter().all(|row| again.contains(&named(row))), "{first:?} {second:?}");
    // All of it again, and nothing is computed: the file stays as it is.
    let whole = std::fs::read_to_string(dir.join("kept.json")).expect("results");
    assert!(whole.len() > kept.len());
    let (_, said) = run("3", &["--plot", "chart.png"]);
    assert!(said.contains("3 of 3 rows"), "{said}");
    assert_eq!(std::fs::read_to_string(dir.join("kept.json")).expect("results"), whole);
    let svg = std::fs::read_to_string(dir.join("chart.svg")).expect("a chart");
    assert!(
        svg.contains("split sum") && svg.contains("relative RMS error") && svg.contains(">alpha<"),
        "{svg}"
    );
    // Three values in three panels.
    assert_eq!(svg.matches("<circle").count(), 9, "{svg}");
    assert!(dir.join("chart.png").metadata().expect("a chart").len() > 1000);
    // Rows without their pictures are computed again where these are asked for, and then their pictures are
    // kept too.
    let (_, said) = run("2", &["-o", "sheet.png", "--html", "report.html"]);
    assert!(!said.contains("rows are those"), "{said}");
    let sheet = std::fs::read(dir.join("sheet.png")).expect("a sheet");
    let report = std::fs::read_to_string(dir.join("report.html")).expect("a report");
    let (_, said) = run("2", &["-o", "sheet.png", "--html", "report.html"]);
    assert!(said.contains("2 of 2 rows are those of kept.json"), "{said}");
    assert_eq!(std::fs::read(dir.join("sheet.png")).expect("a sheet"), sheet);
    assert_eq!(std::fs::read_to_string(dir.join("report.html")).expect("a report"), report);
    // Another size is another result.
    let (_, said) = run("2", &["--size", "10"]);
    assert!(!said.contains("rows are those"), "{said}");
    let wrong = ["compare", "sphere", "-b", "ggx", "--sweep", "brdf:alpha=1..2", "--plot", "a.svg"];
    fails(dir, 2, "brdf:KEY=A..B:N", &wrong);
    fails(dir, 2, "--brdf", &["compare", "sphere", "--sweep", "brdf:alpha=0.1..0.2:2"]);
    std::fs::write(dir.join("other.json"), "{}").expect("a file");
    fails(dir, 3, "no results", &["compare", "sphere", "-b", "lambert", "--resume", "other.json"]);
}

/// The reference shades widths and colours that vary, and says of the rest alone that it leaves it out.
#[test]
fn the_reference_shades_maps_of_roughness() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    well(dir, &["convert", "studio", "--size", "16x8", "-o", "map.png"]);
    let scene = [
        "render",
        "sphere",
        "-e",
        "overcast",
        "--roughness-map",
        "map.png",
        "-t",
        "reference",
        "--size",
        "6",
    ];
    let said = |brdf: &str| {
        let o = run(dir, &[&scene[..], &["-b", brdf, "-o", "a.exr"]].concat());
        assert!(o.status.success());
        String::from_utf8_lossy(&o.stderr).into_owned()
    };
    assert!(!said("ggx:alpha=0.3").contains("variation of roughness"));
    // A reflectance without a width to vary.
    assert!(said("oren-nayar:sigma=0.3").contains("reference leaves out the variation of roughness"));
}

#[test]
fn techniques_name_their_sources() {
    let dir = tempfile::tempdir().expect("a folder");
    let dir = dir.path();
    assert!(well(dir, &["techniques"]).contains("split_sum"));
    let text = well(dir, &["techniques", "--bibtex"]);
    assert!(text.starts_with("@software{steradian,") && text.contains("@misc{karis2013real,"), "{text}");
    assert!(well(dir, &["techniques", "--json"]).contains("\"citation\""));
}

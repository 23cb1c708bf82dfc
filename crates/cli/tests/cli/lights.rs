//! Suns, disks and points beside an environment, as a user meets them.

use super::common::{fails, run, stderr};
use std::f64::consts::PI;
use std::fs;
use std::process::Output;

/// The columns r, g, b of every line.
fn rgb(o: &Output) -> Vec<[f64; 3]> {
    assert_eq!(o.status.code(), Some(0), "{}", stderr(o));
    let text = String::from_utf8_lossy(&o.stdout).into_owned();
    let number = |t: &str| t.parse::<f64>().expect("a number");
    let line = |l: &str| {
        let f: Vec<&str> = l.split(',').collect();
        [f.len() - 4, f.len() - 3, f.len() - 2].map(|i| number(f[i]))
    };
    text.lines().skip(1).map(line).collect()
}

fn folder() -> tempfile::TempDir {
    let d = tempfile::tempdir().expect("a folder");
    fs::write(
        d.path().join("at.csv"),
        "nx,ny,nz,vx,vy,vz,px,py,pz\n0,1,0,0.6,0.8,0,0,0,0\n0,1,0,0,1,0,3,0,0\n",
    )
    .expect("written");
    fs::write(d.path().join("p.csv"), "nx,ny,nz,vx,vy,vz\n0,1,0,0,1,0\n").expect("written");
    d
}

#[test]
fn every_technique_takes_point_lights() {
    let d = folder();
    let lamp = "point:position=0/2/0,intensity=8/4/2";
    for technique in ["reference", "sh_irradiance", "diffuse_map", "phong_diffuse_maps"] {
        let o = run(
            d.path(),
            &[
                "eval",
                "-e",
                "furnace",
                "--light",
                lamp,
                "-b",
                "lambert:albedo=0.5",
                "-p",
                "at.csv",
                "-t",
                technique,
            ],
        );
        let got = rgb(&o);
        // Under the lamp I/r² = 2, 1, 0.5; three metres aside I cos/r² = 8 · 2/13^1.5 of red.
        for (line, red) in got.iter().zip([2.0, 16.0 / 13f64.powf(1.5)]) {
            for (c, part) in [1.0, 0.5, 0.25].into_iter().enumerate() {
                let want = 0.5 + 0.5 / PI * red * part;
                assert!((line[c] / want - 1.0).abs() < 1e-3, "{technique}: {line:?} {want}");
            }
        }
    }
    let o =
        run(d.path(), &["eval", "--light", lamp, "-b", "ggx:alpha=0.3", "-p", "at.csv", "-t", "split-sum"]);
    let own = run(d.path(), &["eval", "--light", lamp, "-b", "ggx:alpha=0.3", "-p", "at.csv"]);
    for (a, b) in rgb(&o).iter().zip(rgb(&own)) {
        (0..3).for_each(|c| assert!((a[c] / b[c] - 1.0).abs() < 1e-5, "{a:?} {b:?}"));
    }
    fails(
        d.path(),
        3,
        "p.csv: point lights need the columns px,py,pz",
        &["eval", "--light", lamp, "-b", "lambert", "-p", "p.csv"],
    );
}

#[test]
fn suns_are_shaded_exactly_or_folded() {
    let d = folder();
    let sun = "disk:direction=0.3/1/0.2,angular-radius=0.5,irradiance=10";
    let eval = |more: &[&'static str]| {
        let base = ["eval", "-e", "furnace", "--light", sun, "-b", "ggx:alpha=0.1", "-p", "at.csv"];
        rgb(&run(d.path(), &[&base[..], more].concat()))
    };
    let truth = eval(&["-t", "reference"]);
    let exact = eval(&["-t", "split_sum"]);
    let folded = eval(&["-t", "split_sum", "--suns", "fold"]);
    for (e, t) in exact.iter().zip(&truth) {
        assert!((e[0] / t[0] - 1.0).abs() < 5e-3, "{e:?} {t:?}");
    }
    assert!(folded.iter().zip(&exact).any(|(f, e)| (f[0] / e[0] - 1.0).abs() > 1e-2), "{folded:?} {exact:?}");
}

#[test]
fn bad_lights_are_one_line() {
    let d = folder();
    let eval =
        |more: [&'static str; 2]| ["eval", "-e", "furnace", "-b", "lambert", "-p", "p.csv", more[0], more[1]];
    let file = |text: &str| fs::write(d.path().join("l.json"), text).expect("written");
    fails(d.path(), 2, "unknown light 'lamp'", &eval(["--light", "lamp:position=1/1/1"]));
    fails(d.path(), 3, "none.json: no such file or folder", &eval(["--sun-lights", "none.json"]));
    let twice = "directional:direction=0/1/0,direction=1/0/0,irradiance=1";
    fails(d.path(), 2, "'direction' is given twice", &eval(["--light", twice]));
    for (text, why) in [
        ("{", "not JSON"),
        ("{}", "no list 'lights'"),
        ("{\"lights\": [1]}", "lights[0] is not an object"),
        (
            "{\"lights\": [{\"direction\": [0, 1, 0], \"irradiance\": 1}]}",
            "lights[0]: needs 'angular-radius='",
        ),
        (
            "{\"lights\": [{\"kind\": \"point\", \"position\": [0, 1], \"intensity\": 1}]}",
            "lights[0]: position = '0/1' is not three numbers",
        ),
        (
            "{\"lights\": [{\"kind\": \"directional\", \"direction\": [0, 1, 0], \"irradiance\": [1, -1, 1]}]}",
            "lights[0]: irradiance = '1/-1/1' is not a finite number of at least 0",
        ),
    ] {
        file(text);
        fails(d.path(), 3, why, &eval(["--sun-lights", "l.json"]));
    }
    fails(d.path(), 2, "--environment", &["eval", "-b", "lambert", "-p", "p.csv"]);
}

#[test]
fn a_sun_is_taken_out_and_put_beside() {
    let d = folder();
    let Some(hdr) = steradian_testkit::data("environments/latlong/spiaggia_di_mondello_1k.hdr") else {
        return;
    };
    let hdr = hdr.to_string_lossy().into_owned();
    let o = run(d.path(), &["convert", &hdr, "-o", "sunless.exr", "--extract-sun", "suns.json"]);
    assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    assert!(stderr(&o).contains("% of the flux"), "{}", stderr(&o));
    let suns: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(d.path().join("suns.json")).expect("written"))
            .expect("JSON");
    assert_eq!(suns["lights"].as_array().map(Vec::len), Some(1));
    let eval = |light: &[&str]| {
        let base = ["eval", "-b", "ggx:alpha=0.2", "-p", "p.csv", "-t", "reference", "--tolerance", "1e-3"];
        rgb(&run(d.path(), &[&base[..], light].concat()))
    };
    let (whole, split) = (eval(&["-e", &hdr]), eval(&["-e", "sunless.exr", "--sun-lights", "suns.json"]));
    for (a, b) in whole.iter().zip(&split) {
        (0..3).for_each(|c| assert!((a[c] / b[c] - 1.0).abs() < 5e-3, "{a:?} {b:?}"));
    }
    let o = run(d.path(), &["inspect", "sunless.exr", "--json"]);
    let report: serde_json::Value = serde_json::from_slice(&o.stdout).expect("JSON");
    assert_eq!(report["suns_in_the_image"].as_array().map(Vec::len), Some(0));
    let o =
        run(d.path(), &["convert", "overcast", "-o", "o.exr", "--size", "64", "--extract-sun", "none.json"]);
    assert!(stderr(&o).contains("no sun found"), "{}", stderr(&o));
}

#[test]
fn scenes_may_hold_any_light() {
    let d = folder();
    let scene = "[[mesh]]\nshape = \"sphere\"\nmaterial = \"a\"\n[material.a]\nbrdf = \"ggx:alpha=0.2\"\n[light]\n\
                 environment = \"overcast\"\n[[light.point]]\nposition = [2, 2, 2]\nintensity = [9, 8, 7]\n\
                 [[light.directional]]\ndirection = [1, 1, 0]\nirradiance = [1, 1, 1]\n[[light.disk]]\n\
                 direction = [0, 1, 1]\nangular_radius = 1\nirradiance = [3, 3, 3]\n[output]\nwidth = 32\nheight = 32\n";
    fs::write(d.path().join("s.toml"), scene).expect("written");
    for technique in ["split_sum", "mirror_map"] {
        let o = run(d.path(), &["render", "s.toml", "-t", technique, "-o", "s.exr"]);
        assert_eq!(o.status.code(), Some(0), "{}", stderr(&o));
    }
}

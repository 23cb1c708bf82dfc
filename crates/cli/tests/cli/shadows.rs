//! `render --shadows`: what a mesh blocks of its own light.

use super::common::{fails, well};
use std::fs;
use std::path::Path;

/// Rows of the picture.
const ROWS: usize = 40;
/// Half the length that it sees.
const HALF: f64 = 1.0;
/// Height of the wall.
const WALL: f64 = 9.0;

/// The wall's x: vertices of both in one place would have one normal.
const AT: f64 = -0.01;

/// A floor from x = 0 on and a wall beside it, both along z.
fn corner(dir: &Path) {
    let text = "v 0 0 -9\nv 0 0 9\nv 9 0 9\nv 9 0 -9\nv -.01 0 -9\nv -.01 0 9\nv -.01 9 -9\nv -.01 9 9\nf 1 2 3\nf 1 3 4\nf 5 7 8\nf 5 8 6\n";
    fs::write(dir.join("corner.obj"), text).expect("written");
}

/// Radiance of the floor in a column of pixels that looks down on x = 0 … 2: x and radiance of each.
fn floor(dir: &Path, light: &[&str], technique: &str, more: &[&str]) -> Vec<(f64, f64)> {
    let fov = format!("{}", 2.0 * (HALF / 60.0).atan().to_degrees());
    let size = format!("8x{ROWS}");
    let scene = ["render", "corner.obj", "-b", "lambert:albedo=0.5", "-t", technique, "--backend", "cpu"];
    let view = ["--from", "1,60,0", "--at", "1,0,0", "--up", "1,0,0", "--fov", &fov, "--size", &size];
    let out = ["--background", "none", "-o", "x.pfm", "--json"];
    well(dir, &[&scene[..], &view, &out, light, more].concat());
    let bytes = fs::read(dir.join("x.pfm")).expect("a picture");
    let floats = bytes[bytes.len() - 8 * ROWS * 12..].as_chunks::<4>().0;
    // Rows of a .pfm begin at the bottom, where x is least.
    let at = |row: usize| f64::from(f32::from_le_bytes(floats[3 * (8 * row + 4)]));
    (0..ROWS).map(|row| (2.0 * HALF * (row as f64 + 0.5) / ROWS as f64, at(row))).collect()
}

#[test]
fn rays_over_the_lobe_shadow_the_environment() {
    let d = tempfile::tempdir().expect("a folder");
    corner(d.path());
    for technique in ["sh_irradiance", "reference"] {
        let furnace = ["-e", "furnace"];
        let open = floor(d.path(), &furnace, technique, &[]);
        let behind = floor(d.path(), &furnace, technique, &["--shadows", "lobe"]);
        for ((x, open), (_, got)) in open.into_iter().zip(behind).skip(1) {
            assert!((open - 0.5).abs() < 2e-3, "{technique} {x}: {open} without shadows");
            // The wall hides (1 − x/√(x² + h²))/2 of the floor's cosine-weighted hemisphere (crossed
            // strings).
            let away = x - AT;
            let want = 0.25 * (1.0 + away / away.hypot(WALL));
            // Of the radiance without shadows.
            assert!((got - want).abs() < 0.06 * open, "{technique} {x}: {got}, {want}");
        }
    }
}

#[test]
fn suns_in_a_technique_s_data_are_shadowed_as_suns_beside_them() {
    let d = tempfile::tempdir().expect("a folder");
    corner(d.path());
    // Over the wall's top it reaches the floor beyond x = 1.
    let sun = ["--light", "directional:direction=-1/9/0,irradiance=3.14159265/3.14159265/3.14159265"];
    let bright = 0.5 * WALL / WALL.hypot(1.0);
    for (technique, suns, error) in
        [("sh_irradiance", "exact", 1e-3), ("sh_irradiance", "fold", 0.1), ("reference", "exact", 1e-3)]
    {
        let lit = floor(d.path(), &sun, technique, &["--suns", suns, "--shadows", "lobe"]);
        for (x, got) in lit.into_iter().skip(1).filter(|(x, _)| (x - 1.0).abs() > 0.1) {
            let (want, error) = if x < 1.0 { (0.0, 1e-6) } else { (bright, error) };
            assert!((got - want).abs() <= error, "{technique} {suns} {x}: {got}, {want}");
        }
    }
}

/// The wall's shadow under a sun and under a lamp, by rays, maps and volumes, below a technique for the
/// environment and one for the lights.
#[test]
fn maps_and_volumes_shadow_what_rays_do() {
    let d = tempfile::tempdir().expect("a folder");
    corner(d.path());
    let sun = ["-e", "furnace:radiance=0.001", "--light", "directional:direction=-1/9/0,irradiance=2/2/2"];
    let lamp =
        ["-e", "furnace:radiance=0.001", "--light", "point:position=-0.5/12/0.2,intensity=400/400/400"];
    for (light, local) in [(sun, &[][..]), (lamp, &["--local", "vertex-analytic"])] {
        let lit =
            |how: &str| floor(d.path(), &light, "sh_irradiance", &[&["--shadows", how], local].concat());
        let (rays, none) = (lit("ray"), lit("none"));
        let dark = rays.iter().zip(&none).filter(|(a, b)| a.1 < 0.5 * b.1).count();
        assert!((8..32).contains(&dark), "{dark} of {ROWS} in the shadow");
        // A texel of the first map is 0.9 cm, of the second 1.8 and filtered over three; a pixel is 5 cm.
        for (how, off) in [("volume", 0), ("map:size=2048,taps=1", 1), ("map", 3)] {
            let wrong =
                lit(how).iter().zip(&rays).filter(|(a, b)| (a.1 - b.1).abs() > 0.02 * none[20].1).count();
            assert!(wrong <= off, "{light:?} {local:?} {how}: {wrong} pixels of {ROWS} differ");
        }
    }
}

#[test]
fn what_knows_shadows_itself_refuses_others() {
    let d = tempfile::tempdir().expect("a folder");
    let base = ["render", "torus", "-e", "furnace", "-b", "lambert:albedo=0.5", "-o", "x.png", "--shadows"];
    fails(d.path(), 2, "knows shadows itself", &[&base[..], &["lobe", "-t", "prt_diffuse"]].concat());
    fails(
        d.path(),
        2,
        "auto, none, ray, map, volume, lobe",
        &[&base[..], &["soft", "-t", "sh_irradiance"]].concat(),
    );
    fails(d.path(), 2, "taps = 4 is even", &[&base[..], &["map:taps=4", "-t", "sh_irradiance"]].concat());
    fails(d.path(), 2, "in 16 … 16384", &[&base[..], &["map:size=1", "-t", "sh_irradiance"]].concat());
    let few = [
        "map:size=16384",
        "-t",
        "sh_irradiance",
        "--light",
        "directional:direction=0/1/0,irradiance=1/1/1",
        "--max-memory",
        "256M",
    ];
    fails(d.path(), 1, "shadow maps of 1 lights", &[&base[..], &few].concat());
}

/// The same shadows in a comparison with paths, and at points.
#[test]
fn comparisons_and_points_are_shadowed_as_pictures_are() {
    let d = tempfile::tempdir().expect("a folder");
    corner(d.path());
    let sun = ["--light", "directional:direction=-1/9/0,irradiance=2/2/2", "-b", "lambert:albedo=0.5"];
    let one = [
        "compare",
        "corner.obj",
        "-t",
        "sh_irradiance",
        "--path",
        "--bounces",
        "1",
        "--size",
        "48",
        "--json",
    ];
    let error = |how: &str| {
        let text = well(d.path(), &[&one[..], &sun, &["--shadows", how]].concat());
        let all: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        all["comparisons"][0]["techniques"][1]["relative_rms"].as_f64().expect("an error")
    };
    let [none, rays, volume, map] = ["none", "ray", "volume", "map:size=2048,taps=1"].map(error);
    // Paths look at more points of the pixels at the shadow's edge.
    assert!(none > 0.2 && rays < 0.03, "{none} {rays}");
    assert!((volume - rays).abs() < 5e-3 && (map - rays).abs() < 1e-2, "{rays} {volume} {map}");

    fs::write(d.path().join("p.csv"), "nx,ny,nz,vx,vy,vz,px,py,pz\n0,1,0,0,1,0,0.5,0,0\n0,1,0,0,1,0,3,0,0\n")
        .expect("written");
    let at = ["eval", "-p", "p.csv", "-t", "sh_irradiance", "--mesh", "corner.obj"];
    let red = |how: &str| -> Vec<f64> {
        let text = well(d.path(), &[&at[..], &sun, &["--shadows", how]].concat());
        let column = text.lines().next().expect("a head").split(',').position(|c| c == "r").expect("red");
        text.lines()
            .skip(1)
            .map(|l| l.split(',').nth(column).expect("red").parse().expect("a number"))
            .collect()
    };
    for how in ["ray", "map", "volume"] {
        let (open, got) = (red("none"), red(how));
        assert!(open[0] > 0.1 && got[0] == 0.0 && (got[1] - open[1]).abs() < 1e-6, "{how}: {open:?} {got:?}");
    }

    let fails = |code, why: &str, args: &[&str]| fails(d.path(), code, why, &[args, &sun].concat());
    fails(2, "add --path", &["compare", "corner.obj", "-t", "sh_irradiance", "--shadows", "ray"]);
    fails(2, "give --mesh", &["eval", "-p", "p.csv", "-t", "sh_irradiance", "--shadows", "ray"]);
    fails(
        2,
        "the reference has no shadows",
        &["eval", "-p", "p.csv", "--mesh", "corner.obj", "--shadows", "map"],
    );
}

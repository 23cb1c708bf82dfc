//! Photographs under known lights become a polynomial texture map, and such a map a surface, its normals and
//! its albedo.

use super::common::{fails, json, run, well};
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Output;
use steradian_formats::{
    Limits, PtmTexels, Raster, ReadOptions, WriteOptions, read_image_with, read_ptm, write_image,
};

const LIST: &str = "set.lp";

fn convert(dir: &Path) -> Output {
    run(dir, &["convert", LIST, "-o", "out.ptm"])
}

/// The list is refused with exit code 3, and nothing is written.
fn refused(dir: &Path, why: &str) {
    fails(dir, 3, why, &["convert", LIST, "-o", "out.ptm"]);
    assert!(!dir.join("out.ptm").exists());
}

/// Photographs of a Lambertian ground of two colours under `n` lights, their sines of elevation from `low` to
/// `high`.
fn photographs(dir: &Path, n: usize, [low, high]: [f64; 2]) {
    let mut list = format!("{n}\n");
    for k in 0..n {
        let z = low + (high - low) * (k as f64 + 0.5) / n as f64;
        let (s, phi) = ((1.0 - z * z).sqrt(), 2.4 * k as f64);
        let name = format!("{k}.pfm");
        writeln!(list, "{name} {} {} {}", 2.0 * s * phi.cos(), 2.0 * s * phi.sin(), 2.0 * z)
            .expect("a string");
        let plane = |top: f64, bottom: f64| [top, top, bottom, bottom].map(|c| (c * z) as f32).to_vec();
        let raster = Raster::rgb(2, 2, [plane(0.8, 0.1), plane(0.4, 0.1), plane(0.2, 0.4)]);
        write_image(&dir.join(name), &raster, &WriteOptions::default()).expect("written");
    }
    fs::write(dir.join(LIST), list).expect("written");
}

#[test]
fn photographs_become_a_polynomial_texture_map() {
    let d = tempfile::tempdir().expect("a folder");
    photographs(d.path(), 400, [0.0, 1.0]);
    let o = convert(d.path());
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    let map = read_ptm(&d.path().join("out.ptm"), &Limits::default()).expect("a map");
    let PtmTexels::Lrgb { luminance, color } = map.texels else { panic!("luminance and colour") };
    assert_eq!((map.width, map.height), (2, 2));
    assert_eq!([color[0], color[3]], [[255, 128, 64], [64, 64, 255]]);
    // Lambert seen from above (the polynomial scales the largest channel), within steps of a 255th of the
    // range.
    for (texel, albedo) in [(0, 0.8), (3, 0.4)] {
        for (found, want) in luminance[texel].iter().zip([-0.9375, -0.9375, 0.0, 0.0, 0.0, 1.125]) {
            assert!((found / 255.0 - albedo * want).abs() < 4e-3, "{:?}", luminance[texel]);
        }
    }
}

#[test]
fn lights_and_photographs_that_do_not_fit_are_refused() {
    let d = tempfile::tempdir().expect("a folder");
    photographs(d.path(), 5, [0.2, 1.0]);
    refused(d.path(), "needs six at least");
    let inspected = |why: &str| {
        let text = well(d.path(), &["inspect", LIST]);
        assert!(text.contains("warning") && text.contains(why), "{text}");
        let v = json(d.path(), &["inspect", LIST, "--json"]);
        assert!(v["warning"].as_str().is_some_and(|w| w.contains(why)) && v["condition"].is_null(), "{v}");
    };
    inspected("5 lights: a polynomial of six coefficients needs six");
    photographs(d.path(), 12, [0.7, 0.7]);
    refused(d.path(), "one conic, or nearly so (singular)");
    inspected("one conic");
    photographs(d.path(), 12, [-0.5, 1.0]);
    let why = "set.lp: line 2: 0.pfm: its light has the direction (1.798, 0, -0.875): it must be finite and above the surface";
    refused(d.path(), why);
    inspected(why);
    photographs(d.path(), 12, [0.1, 1.0]);
    let v = json(d.path(), &["inspect", LIST, "--json"]);
    assert!(v["warning"].is_null() && v["condition"].as_f64().is_some_and(|c| c > 1.0), "{v}");
    // Nine harmonics of eight lights, and of two rings.
    let nine = ["convert", LIST, "--map", "normal", "--basis", "sh9", "-o", "out.png"];
    photographs(d.path(), 8, [0.1, 1.0]);
    fails(d.path(), 3, "8 lights: 9 spherical harmonics need 9 at least", &nine);
    photographs(d.path(), 12, [0.4, 0.4]);
    let list = fs::read_to_string(d.path().join(LIST)).expect("a list");
    let rings = |(k, line): (usize, &str)| match line.rsplit_once(' ') {
        Some((rest, _)) if k.is_multiple_of(2) => format!("{rest} 3"),
        _ => line.to_string(),
    };
    let rings: Vec<String> = list.lines().enumerate().map(rings).collect();
    fs::write(d.path().join(LIST), rings.join("\n")).expect("written");
    let why = "do not determine 9 spherical harmonics (singular): add some at other elevations, of which rings of lights need three";
    fails(d.path(), 3, why, &nine);
    photographs(d.path(), 12, [0.1, 1.0]);
    let small = Raster::rgb(1, 1, [vec![0.5], vec![0.5], vec![0.5]]);
    write_image(&d.path().join("7.pfm"), &small, &WriteOptions::default()).expect("written");
    refused(d.path(), "7.pfm: is 1 x 1 where the first photograph is 2 x 2");
    refused(d.path(), "set.lp: line 9: ");
    fs::remove_file(d.path().join("7.pfm")).expect("removed");
    // The list, its line, and the photograph.
    refused(d.path(), "set.lp: line 9: ");
    refused(d.path(), "7.pfm");
    let outside = fs::read_to_string(d.path().join(LIST)).expect("a list").replace("7.pfm", "../7.pfm");
    fs::write(d.path().join(LIST), outside).expect("written");
    refused(d.path(), "../7.pfm");
}

/// A map under a lamp: by `eval`, the polynomial of each texel over π; of its list of photographs, the same
/// up to the bytes of the file. As images, the direction of the brightest light, and what is reflected of it.
#[test]
fn maps_are_shaded_and_become_normals_and_albedo() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    photographs(dir, 400, [0.0, 1.0]);
    assert!(convert(dir).status.success());
    let black = vec![0.0; 8 * 4];
    let dark = Raster::rgb(8, 4, [black.clone(), black.clone(), black]);
    write_image(&dir.join("dark.pfm"), &dark, &WriteOptions::default()).expect("written");
    let rows =
        "u,v,nx,ny,nz,tx,ty,tz,vx,vy,vz\n0.25,0.25,0,0,1,1,0,0,0,0,1\n0.75,0.75,0,0,1,1,0,0,0.6,0,0.8\n";
    fs::write(dir.join("points.csv"), rows).expect("written");
    for (map, within) in [("out.ptm", 4e-3), (LIST, 1e-3)] {
        let local = format!("polynomial_texture_map:map={map}");
        let light = "directional:direction=0.6/0/0.8,irradiance=1/1/1";
        let made = ["eval", "-p", "points.csv", "-e", "dark.pfm", "--light", light, "--quiet"];
        let o = run(dir, &[&made[..], &["-b", "lambert", "-t", "sh-irradiance", "--local", &local]].concat());
        assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
        let text = String::from_utf8_lossy(&o.stdout).into_owned();
        for (row, albedo) in text.lines().skip(1).zip([[0.8, 0.4, 0.2], [0.1, 0.1, 0.4]]) {
            let all: Vec<f64> = row.split(',').filter_map(|x| x.parse().ok()).collect();
            for (got, a) in all[11..14].iter().zip(albedo) {
                let want = a * (1.125 - 0.9375 * 0.36) / std::f64::consts::PI;
                assert!((got - want).abs() < within, "{map}: {row}: {got} {want}");
            }
        }
    }
    let image = |part: &str| {
        let o = run(dir, &["convert", "out.ptm", "--map", part, "-o", "x.pfm"]);
        assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
        let options = ReadOptions { data: true, limits: Limits::default(), ..ReadOptions::default() };
        let raster = read_image_with(&dir.join("x.pfm"), &options).expect("reads");
        raster.into_rgb().expect("three channels").map(|p| [p[0], p[3]])
    };
    let near = |[a, b]: [f32; 2], want: [f32; 2]| (a - want[0]).abs() < 0.02 && (b - want[1]).abs() < 0.02;
    let [x, y, z] = image("normal");
    assert!(near(x, [0.5; 2]) && near(y, [0.5; 2]) && near(z, [1.0; 2]), "{x:?} {y:?} {z:?}");
    let [r, g, b] = image("albedo");
    assert!(near(r, [0.9, 0.1125]) && near(g, [0.45, 0.1125]) && near(b, [0.225, 0.45]), "{r:?} {g:?} {b:?}");
}

/// A facet tilted by 30°, photographed under 400 lights: its normal is 11° off by the parabola, half a degree
/// by nine harmonics; shaded by these it is nearer too. A file of parabolas has no harmonics.
#[test]
fn harmonics_are_fitted_to_photographs() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let (s, c) = 30f64.to_radians().sin_cos();
    let mut list = "400\n".to_string();
    for k in 0..400 {
        let z = (f64::from(k) + 0.5) / 400.0;
        let (r, phi) = ((1.0 - z * z).sqrt(), 2.4 * f64::from(k));
        let (x, y) = (r * phi.cos(), r * phi.sin());
        let name = format!("{k}.pfm");
        writeln!(list, "{name} {x} {y} {z}").expect("a string");
        let plane = |a: f64| vec![(a * (s * x + c * z).max(0.0)) as f32; 4];
        let raster = Raster::rgb(2, 2, [plane(0.8), plane(0.4), plane(0.2)]);
        write_image(&dir.join(name), &raster, &WriteOptions::default()).expect("written");
    }
    fs::write(dir.join(LIST), list).expect("written");
    let tilt = |basis: &str| {
        let o = run(dir, &["convert", LIST, "--map", "normal", "--basis", basis, "-o", "n.pfm"]);
        assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
        let options = ReadOptions { data: true, limits: Limits::default(), ..ReadOptions::default() };
        let p =
            read_image_with(&dir.join("n.pfm"), &options).expect("reads").into_rgb().expect("three channels");
        let [x, _, z] = p.map(|p| f64::from(2.0 * p[1] - 1.0));
        x.atan2(z).to_degrees()
    };
    for (basis, want) in [("biquadratic", 30.0 - 11.0), ("sh9", 29.5), ("sh16", 29.7)] {
        let got = tilt(basis);
        assert!((got - want).abs() < 0.3, "{basis}: {got}");
    }
    let black = vec![0.0; 8 * 4];
    let dark = Raster::rgb(8, 4, [black.clone(), black.clone(), black]);
    write_image(&dir.join("dark.pfm"), &dark, &WriteOptions::default()).expect("written");
    let row = "u,v,nx,ny,nz,tx,ty,tz,vx,vy,vz\n0.25,0.25,0,0,1,1,0,0,0,0,1\n";
    fs::write(dir.join("points.csv"), row).expect("written");
    let off = |basis: &str| {
        let local = format!("polynomial_texture_map:map={LIST},basis={basis}");
        let light = "directional:direction=-0.6/0/0.8,irradiance=1/1/1";
        let made = ["eval", "-p", "points.csv", "-e", "dark.pfm", "--light", light, "--quiet"];
        let o = run(dir, &[&made[..], &["-b", "lambert", "-t", "sh-irradiance", "--local", &local]].concat());
        assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
        let text = String::from_utf8_lossy(&o.stdout).into_owned();
        let got: f64 =
            text.lines().nth(1).and_then(|r| r.split(',').nth(11)?.parse().ok()).expect("a number");
        (got - 0.8 / std::f64::consts::PI * (0.8 * c - 0.6 * s)).abs()
    };
    let [six, nine, sixteen] = ["biquadratic", "sh9", "sh16"].map(off);
    assert!(sixteen < 0.008 && nine < six, "{six} {nine} {sixteen}");
    assert!(convert(dir).status.success());
    let why = "sh9";
    fails(dir, 2, why, &["convert", "out.ptm", "--map", "normal", "--basis", "sh9", "-o", "x.pfm"]);
    let local = "polynomial_texture_map:map=out.ptm,basis=sh9";
    let made = ["render", "plane", "-b", "lambert", "--local", local, "-o", "x.pfm", "-t", "sh-irradiance"];
    fails(dir, 2, why, &[&made[..], &["--light", "directional:direction=0/0/1,irradiance=1/1/1"]].concat());
    fails(dir, 2, "sh4", &["convert", LIST, "--map", "normal", "--basis", "sh4", "-o", "x.pfm"]);
    assert!(!dir.join("x.pfm").exists());
}

/// Maps that are cut anywhere, of another kind or without numbers, and photographs that are not finite.
#[test]
fn broken_maps_are_refused_by_name() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    photographs(dir, 12, [0.1, 1.0]);
    assert!(convert(dir).status.success());
    let map = fs::read(dir.join("out.ptm")).expect("a map");
    fs::write(dir.join("cut.ptm"), &map[..map.len() - 1]).expect("written");
    fs::write(dir.join("other.ptm"), [b"PTM_3.0".as_slice(), &map[7..]].concat()).expect("written");
    let head = "PTM_1.2\nPTM_FORMAT_LRGB\n1\n1\nnan 1 1 1 1 1\n0 0 0 0 0 0\n";
    fs::write(dir.join("nan.ptm"), [head.as_bytes(), &[0; 9]].concat()).expect("written");
    let mut photograph = fs::read(dir.join("3.pfm")).expect("a photograph");
    let last = photograph.len() - 4;
    photograph[last..].copy_from_slice(&f32::NAN.to_le_bytes());
    fs::write(dir.join("3.pfm"), photograph).expect("written");
    for (map, why) in [
        ("cut.ptm", "cut.ptm"),
        ("other.ptm", "other.ptm"),
        ("nan.ptm", "nan.ptm"),
        (LIST, "3.pfm"),
        ("no.ptm", "no.ptm"),
    ] {
        let local = format!("polynomial_texture_map:map={map}");
        let light = ["--light", "directional:direction=0/0/1,irradiance=1/1/1", "-t", "sh-irradiance"];
        let made = ["render", "plane", "-b", "lambert", "--local", &local, "-o", "x.pfm"];
        fails(dir, 3, why, &[&made[..], &light].concat());
        if map != LIST {
            fails(dir, 3, why, &["convert", map, "--map", "albedo", "-o", "x.pfm"]);
        }
    }
    fails(dir, 2, "--map", &["convert", "0.pfm", "--map", "albedo", "-o", "x.pfm"]);
    let o = run(dir, &["convert", "out.ptm", "--map", "heights", "-o", "x.pfm"]);
    assert_eq!(o.status.code(), Some(2));
    fails(dir, 2, "x.csv", &["convert", "out.ptm", "-o", "x.csv"]);
    assert!(!dir.join("x.pfm").exists());
}

/// Photographs that are polynomials of their lights, other ones in red, green and blue: one colour a texel
/// loses them, which is told; three polynomials keep them, in a file and from the list.
#[test]
fn colours_that_change_with_the_light_take_three_polynomials() {
    let d = tempfile::tempdir().expect("a folder");
    let dir = d.path();
    let mut list = String::from("40\n");
    for k in 0..40 {
        let z = 0.2 + 0.75 * (f64::from(k) + 0.5) / 40.0;
        let (s, phi) = ((1.0 - z * z).sqrt(), 2.4 * f64::from(k));
        let (u, v) = (s * phi.cos(), s * phi.sin());
        writeln!(list, "{k}.pfm {u} {v} {z}").expect("a string");
        let plane = |x: f64| vec![x as f32; 4];
        let raster = Raster::rgb(2, 2, [plane(0.5 + 0.4 * u), plane(0.5 + 0.4 * v), plane(0.5 - 0.4 * u)]);
        write_image(&dir.join(format!("{k}.pfm")), &raster, &WriteOptions::default()).expect("written");
    }
    fs::write(dir.join(LIST), list).expect("written");
    let o = convert(dir);
    let told = String::from_utf8_lossy(&o.stderr).into_owned();
    assert!(o.status.success() && told.contains("colours change with the light"), "{told}");
    let o = run(dir, &["convert", LIST, "--ptm", "rgb", "-o", "rgb.ptm"]);
    let told = String::from_utf8_lossy(&o.stderr).into_owned();
    assert!(o.status.success() && !told.contains("colours change"), "{told}");
    let map = read_ptm(&dir.join("rgb.ptm"), &Limits::default()).expect("a map");
    let PtmTexels::Rgb([red, green, blue]) = map.texels else { panic!("three polynomials") };
    for (all, at, want) in [(&red, 3, 0.4), (&green, 4, 0.4), (&blue, 3, -0.4)] {
        assert!(
            (all[0][at] / 255.0 - want).abs() < 4e-3 && (all[0][5] / 255.0 - 0.5).abs() < 4e-3,
            "{all:?}"
        );
    }
    let points = "nx,ny,nz,vx,vy,vz,tx,ty,tz,u,v\n0,0,1,0,0,1,1,0,0,0.5,0.5\n";
    fs::write(dir.join("points.csv"), points).expect("written");
    for map in [LIST, "rgb.ptm"] {
        let local = format!("polynomial_texture_map:map={map}");
        let light = "directional:direction=0.8/0/0.6,irradiance=1/1/1";
        let eval = [
            "eval",
            "-p",
            "points.csv",
            "--light",
            light,
            "-b",
            "lambert",
            "-t",
            "sh-irradiance",
            "--quiet",
            "--local",
        ];
        let o = run(dir, &[&eval[..], &[&local]].concat());
        let out = String::from_utf8_lossy(&o.stdout).into_owned();
        let row: Vec<f64> =
            out.lines().nth(1).expect("a row").split(',').filter_map(|x| x.parse().ok()).collect();
        for (got, want) in row[row.len() - 4..].iter().zip([0.82, 0.5, 0.18]) {
            assert!((std::f64::consts::PI * got - want).abs() < 0.01, "{map}: {out}");
        }
    }
}

//! Photographs under known lights become a polynomial texture map.

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use steradian_formats::{Limits, PtmTexels, Raster, WriteOptions, read_ptm, write_image};

const LIST: &str = "set.lp";

fn convert(dir: &Path) -> Output {
    let arguments = ["convert", LIST, "-o", "out.ptm"];
    Command::new(env!("CARGO_BIN_EXE_steradian")).current_dir(dir).args(arguments).output().expect("runs")
}

/// Exit code 3 in one line that says this, and nothing is written.
fn refused(dir: &Path, why: &str) {
    let o = convert(dir);
    let text = String::from_utf8_lossy(&o.stderr);
    assert_eq!(o.status.code(), Some(3), "{text}");
    assert!(text.contains(why) && text.trim_end().lines().count() == 1, "{text}");
    assert!(!dir.join("out.ptm").exists());
}

/// Photographs of a Lambertian ground of two colours under `n` lights, their sines of elevation from `low` to `high`.
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
    // Lambert seen from above (the polynomial scales the largest channel), within steps of a 255th of the range.
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
    photographs(d.path(), 12, [0.7, 0.7]);
    refused(d.path(), "condition number");
    photographs(d.path(), 12, [-0.5, 1.0]);
    refused(d.path(), "above the surface");
    photographs(d.path(), 12, [0.1, 1.0]);
    let small = Raster::rgb(1, 1, [vec![0.5], vec![0.5], vec![0.5]]);
    write_image(&d.path().join("7.pfm"), &small, &WriteOptions::default()).expect("written");
    refused(d.path(), "7.pfm: is 1 x 1");
    fs::remove_file(d.path().join("7.pfm")).expect("removed");
    refused(d.path(), "7.pfm");
    let outside = fs::read_to_string(d.path().join(LIST)).expect("a list").replace("7.pfm", "../7.pfm");
    fs::write(d.path().join(LIST), outside).expect("written");
    refused(d.path(), "../7.pfm");
}

//! Real environments: published coefficients, pairs of files that show the same light, conventions.

use steradian_light::load::{self, FileLayout, LoadOptions, Loaded, Profile};
use steradian_sphere::glam::{DMat3, DVec3};
use steradian_sphere::sh::{ShRgb, project};
use steradian_testkit::{data, data_dir};

fn load(name: &str, profile: Option<&'static str>) -> Option<Loaded> {
    let path = data(&format!("environments/{name}"))?;
    let profile = profile.map(|p| Profile::find(p).expect("a profile"));
    Some(load::load(&path, &LoadOptions { profile, ..LoadOptions::default() }).expect("loads"))
}

fn pair(name: &str) -> Option<Loaded> {
    let dir = data_dir()?.join("environments/paraboloid");
    let files = ["front", "back"].map(|f| dir.join(format!("{name}-{f}.hdr")));
    if !files.iter().all(|f| f.exists()) {
        return None;
    }
    let options = LoadOptions { profile: Profile::find("debevec-paraboloid"), ..LoadOptions::default() };
    Some(load::load(&dir.join(format!("{name}-{{}}.hdr")), &options).expect("loads"))
}

/// The nine published rows of a probe: `### … (name)` and the table below it.
fn published(name: &str) -> Option<[[f64; 3]; 9]> {
    let path = data("environments/published_sh_coefficients.md")?;
    let text = std::fs::read_to_string(path).expect("is text");
    let (_, section) = text.split_once(&format!("(`{name}`)"))?;
    let mut rows = section.lines().filter(|l| l.starts_with("| L")).map(|l| {
        l.split('|').skip(2).take(3).map(|v| v.trim().parse().expect("a number")).collect::<Vec<f64>>()
    });
    Some(std::array::from_fn(|_| {
        let r = rows.next().expect("nine rows");
        [r[0], r[1], r[2]]
    }))
}

/// Ours seen in the published frame: z negated, which turns the sign of (1,0), (2,−1) and (2,1).
fn mirrored(sh: &ShRgb) -> [[f64; 3]; 9] {
    std::array::from_fn(|i| {
        let sign = if matches!(i, 2 | 5 | 7) { -1.0 } else { 1.0 };
        std::array::from_fn(|c| sign * sh.c[c][i])
    })
}

/// Fits b ≈ s·a over all 27 numbers; returns s and the largest residual over the largest |b₀₀|.
fn fit(a: &[[f64; 3]; 9], b: &[[f64; 3]; 9]) -> (f64, f64) {
    let pairs = || a.iter().flatten().zip(b.iter().flatten());
    let s = pairs().map(|(x, y)| x * y).sum::<f64>() / pairs().map(|(x, _)| x * x).sum::<f64>();
    let worst = pairs().map(|(x, y)| (s * x - y).abs()).fold(0.0, f64::max);
    (s, worst / b[0].iter().fold(0.0, |m: f64, v| m.max(v.abs())))
}

#[test]
fn published_coefficients_of_the_angular_probes() {
    for (name, scale, tolerance) in [
        ("rnl", 0.1, 1e-3),
        ("galileo", 0.2, 1e-3),
        ("kitchen", 0.1, 1e-3),
        ("building", 0.1, 1e-3),
        ("campus", 0.1, 1e-3),
        ("beach", 0.4, 1e-3),
        ("grace", 10.0 / 32.0, 3e-3),
    ] {
        let Some(probe) = load(&format!("angular/{name}_probe.hdr"), None) else { return };
        assert_eq!(probe.report.file_layout, FileLayout::AngularMap);
        let Some(table) = published(name) else { return };
        let (s, residual) = fit(&mirrored(&project(&probe.image, 2)), &table);
        assert!(residual < tolerance, "{name}: scale {s}, residual {residual:e}");
        assert!((s / scale - 1.0).abs() < 2e-3, "{name}: scale {s}");
    }
}

#[test]
fn published_coefficients_of_the_paraboloid_pairs() {
    for name in ["stpeters", "uffizi"] {
        let Some(image) = pair(name) else { return };
        let Some(table) = published(name) else { return };
        let (s, residual) = fit(&mirrored(&project(&image.image, 2)), &table);
        assert!(residual < 3.2e-3, "{name}: scale {s}, residual {residual:e}");
    }
    let (Some(pair), Some(probe)) = (pair("grace"), load("angular/grace_probe.hdr", None)) else { return };
    let (a, b) = (mirrored(&project(&pair.image, 2)), mirrored(&project(&probe.image, 2)));
    let (s, residual) = fit(&a, &b);
    assert!(residual < 3e-3 && (s - 1.0).abs() < 5e-3, "grace: scale {s}, residual {residual:e}");
}

#[test]
fn the_lat_long_file_of_grace_is_its_probe_upside_down() {
    let (Some(lat_long), Some(probe)) =
        (load("latlong/grace_latlong.exr", None), load("angular/grace_probe.hdr", None))
    else {
        return;
    };
    // World of the lat-long file → world of the probe: (x, y, z) → (z, −y, −x).
    let m =
        DMat3::from_cols(DVec3::new(0.0, 0.0, -1.0), DVec3::new(0.0, -1.0, 0.0), DVec3::new(1.0, 0.0, 0.0));
    let turned = lat_long.image.rotate(m);
    let (a, b) = (mirrored(&project(&turned, 2)), mirrored(&project(&probe.image, 2)));
    let (s, residual) = fit(&a, &b);
    assert!(residual < 6e-3 && (s / 32.0 - 1.0).abs() < 1e-2, "scale {s}, residual {residual:e}");
}

#[test]
fn openexr_lat_long_and_cube_show_the_same_world() {
    let (Some(a), Some(b)) =
        (load("orientation/OrientationLatLong.exr", None), load("orientation/OrientationCube.exr", None))
    else {
        return;
    };
    assert_eq!((a.report.profile, b.report.profile), ("openexr", "openexr"));
    let (mut sum, mut n) = (0.0, 0.0);
    for k in 0..20_000 {
        let z = 1.0 - f64::from(2 * k + 1) / 20_000.0;
        let (sin, cos) = (f64::from(k) * 2.399963229728653).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let d = DVec3::new(r * cos, z, r * sin);
        let (x, y) = (a.image.bilinear(d), b.image.bilinear(d));
        sum += (0..3).map(|c| f64::from((x[c] - y[c]).abs())).sum::<f64>() / 3.0;
        n += 1.0;
    }
    // Text and lines on white: any wrong face or flip is far above this.
    assert!(sum / n < 0.02, "mean difference {}", sum / n);
}

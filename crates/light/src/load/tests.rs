//! Assembly, conventions and faults on small images made here.

use super::*;
use steradian_sphere::glam::DVec3;

fn colour(d: DVec3) -> [f32; 3] {
    [d.x, d.y, d.z].map(|v| (2.0 + v) as f32)
}

fn raster(w: usize, h: usize, f: impl Fn(usize, usize) -> [f32; 3]) -> Raster {
    let plane = |c: usize| (0..w * h).map(|k| f(k % w, k / w)[c]).collect();
    Raster::rgb(w, h, [plane(0), plane(1), plane(2)])
}

/// The world that a loaded image shows against [`colour`].
fn worst(loaded: &Loaded) -> f32 {
    [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z, DVec3::new(0.6, 0.48, 0.64)]
        .into_iter()
        .flat_map(|d| {
            let (a, b) = (loaded.image.bicubic(d), colour(d));
            (0..3).map(move |c| (a[c] - b[c]).abs())
        })
        .fold(0.0, f32::max)
}

fn open(raster: Raster, options: &LoadOptions) -> Loaded {
    from_raster("test", raster, options).expect("loads")
}

#[test]
fn crosses_and_strips_are_assembled() {
    let n = 16;
    let cube = SphereImage::from_fn(Layout::Cube, n, n, colour);
    let at = |face: usize, i: usize, j: usize| cube.texel(face, i % n, j % n);
    let horizontal = raster(4 * n, 3 * n, |i, j| match (i / n, j / n) {
        (1, 0) => at(2, i, j),
        (0, 1) => at(1, i, j),
        (1, 1) => at(4, i, j),
        (2, 1) => at(0, i, j),
        (3, 1) => at(5, i, j),
        (1, 2) => at(3, i, j),
        _ => [0.0; 3],
    });
    let vertical = raster(3 * n, 4 * n, |i, j| match (i / n, j / n) {
        (1, 0) => at(2, i, j),
        (0, 1) => at(1, i, j),
        (1, 1) => at(4, i, j),
        (2, 1) => at(0, i, j),
        (1, 2) => at(3, i, j),
        (1, 3) => at(5, n - 1 - i % n, n - 1 - j % n),
        _ => [0.0; 3],
    });
    let strip = raster(6 * n, n, |i, j| at(i / n, i, j));
    let column = raster(n, 6 * n, |i, j| at(j / n, i, j));
    for r in [horizontal, vertical, strip, column] {
        assert_eq!(open(r, &LoadOptions::default()).image, cube);
    }
}

#[test]
fn profiles_undo_what_their_tools_do() {
    let n = 32;
    let with = |name: &str| LoadOptions { profile: Profile::find(name), ..LoadOptions::default() };
    // Bevy finds world (x, y, z) at (x, y, −z), three.js at (−x, y, z).
    for (name, flip) in [("bevy", DVec3::new(1.0, 1.0, -1.0)), ("three", DVec3::new(-1.0, 1.0, 1.0))] {
        let cube = SphereImage::from_fn(Layout::Cube, n, n, |d| colour(d * flip));
        let column = raster(n, 6 * n, |i, j| cube.texel(j / n, i, j % n));
        assert!(worst(&open(column, &with(name))) < 1e-3, "{name}");
    }
    // glTF: every face flipped left to right.
    let cube = SphereImage::from_fn(Layout::Cube, n, n, colour);
    let column = raster(n, 6 * n, |i, j| cube.texel(j / n, n - 1 - i, j % n));
    assert!(worst(&open(column, &with("gltf"))) < 1e-3);
    // USD: longitude 0 at +Z, π/2 at +X, π at the left edge.
    let (w, h) = (64, 32);
    let usd = raster(w, h, |i, j| {
        let lon = std::f64::consts::PI * (1.0 - 2.0 * (i as f64 + 0.5) / w as f64);
        let lat = std::f64::consts::PI * (0.5 - (j as f64 + 0.5) / h as f64);
        colour(DVec3::new(lon.sin() * lat.cos(), lat.sin(), lon.cos() * lat.cos()))
    });
    assert!(worst(&open(usd, &with("usd"))) < 1e-3);
}

#[test]
fn faults_are_named() {
    let bad = raster(8, 4, |i, j| if (i, j) == (5, 2) { [1.0, f32::NAN, 1.0] } else { [1.0; 3] });
    let e = from_raster("a.hdr", bad, &LoadOptions::default()).expect_err("NaN");
    assert_eq!(
        e.to_string(),
        "a.hdr: pixel (5, 2) is NaN in channel G; radiance must be finite: mend it in an image editor, or write the file again"
    );
    assert_eq!(e.exit_code(), 3);
    assert!(from_raster("a", raster(7, 5, |_, _| [1.0; 3]), &LoadOptions::default()).is_err());
    assert!(from_raster("a", raster(0, 0, |_, _| [1.0; 3]), &LoadOptions::default()).is_err());
    let missing = load(Path::new("no_such_{}.hdr"), &LoadOptions::default()).expect_err("no files");
    assert_eq!(missing.exit_code(), 3);
}

#[test]
fn negatives_are_counted_and_kept_or_not() {
    let r = || raster(8, 4, |i, _| if i == 0 { [-1.0, 0.0, 2.0] } else { [1.0; 3] });
    let kept = open(r(), &LoadOptions::default());
    assert_eq!((kept.report.negative_count, kept.report.most_negative), (4, -1.0));
    assert_eq!(kept.image.texel(0, 0, 0), [-1.0, 0.0, 2.0]);
    let zeroed = open(r(), &LoadOptions { negative: Negative::Zero, ..LoadOptions::default() });
    assert_eq!((zeroed.report.negative_count, zeroed.image.texel(0, 0, 0)), (4, [0.0, 0.0, 2.0]));
}

#[test]
fn our_own_probes_are_not_foreign() {
    let probe = SphereImage::from_fn(Layout::AngularMap, 16, 16, colour);
    let r = || raster(16, 16, |i, j| probe.texel(0, i, j));
    assert_eq!(open(r(), &LoadOptions::default()).image.layout, Layout::AngularLattice);
    let mut own = r();
    own.metadata.push(("steradian.version".into(), "0.1.0".into()));
    assert_eq!(open(own, &LoadOptions::default()).image.layout, Layout::AngularMap);
}

/// A file as `convert` writes it.
fn written(image: SphereImage, layout: &str) -> Raster {
    let (w, h) = (image.width, image.height * image.layout.faces());
    let mut raster = Raster::rgb(w, h, image.planes);
    raster.metadata.push(("steradian.layout".into(), layout.into()));
    raster
}

#[test]
fn recorded_layouts_are_read() {
    let n = 8;
    for (layout, name) in [
        (Layout::Octahedral, "octahedral"),
        (Layout::SphereMap, "sphere-map"),
        (Layout::AngularMap, "angular"),
        (Layout::Cube, "vertical-strip"),
    ] {
        let image = SphereImage::from_fn(layout, n, n, colour);
        let loaded = open(written(image.clone(), name), &LoadOptions::default());
        assert_eq!(loaded.image, image, "{name}");
        assert!(loaded.report.layout_stated && loaded.report.warnings.is_empty(), "{name}");
    }
    let pair = SphereImage::from_fn(Layout::DualParaboloid, n, n, colour);
    let mut beside = raster(2 * n, n, |i, j| pair.texel(i / n, i % n, j));
    beside.metadata.push(("steradian.layout".into(), "paraboloid".into()));
    assert_eq!(open(beside, &LoadOptions::default()).image, pair);
    // Who names a layout is heard first; a record that the pixels contradict is not heard.
    let octahedral = SphereImage::from_fn(Layout::Octahedral, n, n, colour);
    let named = LoadOptions { layout: Some(FileLayout::SphereMap), ..LoadOptions::default() };
    assert_eq!(open(written(octahedral.clone(), "octahedral"), &named).image.layout, Layout::SphereMap);
    let odd = open(written(octahedral, "cross"), &LoadOptions::default());
    assert!(!odd.report.layout_stated);
    // The short name under which cubes are written.
    assert_eq!(FileLayout::from_name("cube"), Some(FileLayout::VerticalStrip));
}

/// A window whose lower edge lies on −Z, the direction of a sphere map's rim.
#[test]
fn light_at_the_rim_of_our_own_maps_is_kept() {
    let mut sky = SphereImage::new(Layout::LatLong, 100, 50);
    for plane in &mut sky.planes {
        for k in 0..100 {
            plane[(15 + k / 10) * 100 + 20 + k % 10] = 1.0;
        }
    }
    let before = sky.integral()[0];
    for (layout, name) in [
        (Layout::SphereMap, "sphere-map"),
        (Layout::AngularMap, "angular"),
        (Layout::Octahedral, "octahedral"),
    ] {
        for n in [16, 64] {
            let loaded = open(written(sky.resample(layout, n, n), name), &LoadOptions::default());
            let after = loaded.image.integral()[0];
            assert!((after / before - 1.0).abs() < 1e-3, "{name} {n}: {}", after / before - 1.0);
        }
    }
}

#[test]
fn re_centring_makes_no_negative_light() {
    let (w, h) = (66, 34);
    // A sun and an edge on black.
    let r = || {
        let mut r = raster(w, h, |i, j| match (i, j) {
            (20, 12) => [1e4; 3],
            _ if i > 40 => [1.0; 3],
            _ => [0.0; 3],
        });
        r.metadata.push(("envmap".into(), "latlong".into()));
        r
    };
    let loaded = open(r(), &LoadOptions::default());
    assert_eq!(loaded.report.profile, "openexr");
    assert!(loaded.image.planes.iter().flatten().all(|v| *v >= 0.0));
    let samples = loaded.report.samples.expect("interpolated");
    assert_eq!((samples.min, samples.max, samples.negative), ([0.0; 3], [1e4; 3], 0));
    // The pitch is 2π/(w − 1) by π/(h − 1), and the latitude of row 12.
    let sun: f64 = {
        use std::f64::consts::PI;
        1e4 * 2.0 * PI / 65.0 * PI / 33.0 * (PI * 12.0 / 33.0).sin()
    };
    let rest = {
        let mut dark = r();
        dark.channels.iter_mut().for_each(|c| c.data[12 * w + 20] = 0.0);
        open(dark, &LoadOptions::default()).image.integral()[0]
    };
    let gap = (loaded.image.integral()[0] - rest) / sun - 1.0;
    assert!(gap.abs() < 2.0 / 34.0 + 2.0 / 66.0, "{gap}");
}

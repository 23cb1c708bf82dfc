//! Suns by formula, and those of the data.

use super::*;
use std::f64::consts::PI;

fn sky(d: DVec3) -> [f64; 3] {
    [0.4 + 0.1 * d.y, 0.5 + 0.1 * d.y, 0.8 + 0.2 * d.y]
}

/// A sky with disks, each texel by 8 × 8 points.
fn image(w: usize, disks: &[DiskLight]) -> SphereImage {
    let grid = Grid::new(w, w / 2);
    let step = PI / (w / 2) as f64;
    SphereImage::from_fn(Layout::LatLong, w, w / 2, |d| {
        let mut l = sky(d);
        for s in disks.iter().filter(|s| s.direction.angle_between(d) < s.angular_radius + 2.0 * step) {
            let theta = d.y.acos();
            let phi = d.z.atan2(d.x);
            let inside = (0..64).filter(|k| {
                let t = theta + ((k % 8) as f64 / 8.0 - 7.0 / 16.0) * step;
                let p = phi + ((k / 8) as f64 / 8.0 - 7.0 / 16.0) * 2.0 * PI / grid.width as f64;
                DVec3::new(t.sin() * p.cos(), t.cos(), t.sin() * p.sin()).dot(s.direction)
                    > s.angular_radius.cos()
            });
            let part = inside.count() as f64 / 64.0;
            (0..3).for_each(|c| l[c] += part * s.radiance[c]);
        }
        l.map(|v| v as f32)
    })
}

fn sun(direction: DVec3, degrees: f64, radiance: [f64; 3]) -> DiskLight {
    DiskLight { direction: direction.normalize(), angular_radius: degrees.to_radians(), radiance }
}

/// Moments of image and disks against those of the original.
fn checked(image: &SphereImage, e: &Extraction) {
    let grid = Grid::new(image.width, image.height);
    let (before, after) = (grid.moments(image), grid.moments(&e.sunless));
    for c in 0..3 {
        let mut sum = after[c];
        for d in &e.suns {
            let m = Moments::of_disk(d, c);
            sum = Moments { flux: sum.flux + m.flux, vector: sum.vector + m.vector };
        }
        let off = sum.apart(&before[c], &before[c]);
        assert!(off < 1e-7, "channel {c}: {off:e}");
    }
    assert!(e.deviation < 1e-7 && e.change <= MOST_CHANGE, "{} {}", e.deviation, e.change);
}

#[test]
fn texels_integrate_to_the_sphere() {
    let grid = Grid::new(32, 16);
    let one = SphereImage::from_fn(Layout::LatLong, 32, 16, |_| [1.0; 3]);
    let m = grid.moments(&one)[0];
    assert!((m.flux - 4.0 * PI).abs() < 1e-12 && m.vector.length() < 1e-12);
    let k = 5 * 32 + 7;
    // The texel's vector is about Ω times its direction.
    assert!((grid.vector(k) / grid.omega(k) - grid.direction(k)).length() < 0.01);
    assert_eq!(grid.around(0)[2], 16);
    assert_eq!(grid.around(33), [32, 34, 1, 65, 0, 2, 64, 66]);
}

#[test]
fn a_sun_comes_back_as_the_disk_that_it_was() {
    for direction in [DVec3::new(0.3, 0.6, -0.7), DVec3::new(0.02, 1.0, 0.01), DVec3::new(-1.0, 0.2, 1e-3)] {
        let s = sun(direction, 0.6, [20_000.0, 18_000.0, 15_000.0]);
        let original = image(1024, &[s]);
        let e = extract(&original, &SunOptions::default());
        assert_eq!(e.suns.len(), 1, "{direction}");
        let found = e.suns[0];
        assert!(found.direction.angle_between(s.direction) < 1e-3, "{direction}");
        // As wide as the disk and a texel together.
        let texel = PI / 512.0;
        let expected = (s.angular_radius.powi(2) + texel.powi(2) / 3.0).sqrt();
        assert!((found.angular_radius / expected - 1.0).abs() < 0.1, "{} {expected}", found.angular_radius);
        for c in 0..3 {
            let ratio = found.radiance[c] * found.solid_angle() / (s.radiance[c] * s.solid_angle());
            assert!((ratio - 1.0).abs() < 0.01, "{direction} {ratio}");
        }
        // The sky is whole where the sun was.
        let left = e.sunless.nearest(s.direction);
        let right = sky(s.direction);
        (0..3)
            .for_each(|c| assert!((f64::from(left[c]) / right[c] - 1.0).abs() < 0.05, "{left:?} {right:?}"));
        assert!(e.change < 2e-3, "{}", e.change);
        checked(&original, &e);
    }
}

#[test]
fn several_lamps_and_no_windows() {
    let lamps = [
        sun(DVec3::new(1.0, 0.5, 0.2), 0.8, [3000.0, 2500.0, 1800.0]),
        sun(DVec3::new(-0.4, 0.9, 0.3), 0.5, [900.0, 1000.0, 5000.0]),
    ];
    let window = sun(DVec3::new(0.0, 0.3, -1.0), 9.0, [200.0; 3]);
    let original = image(512, &[lamps[0], lamps[1], window]);
    let e = extract(&original, &SunOptions { share: 0.003, ..SunOptions::default() });
    assert_eq!(e.suns.len(), 2, "{:?}", e.suns);
    for (l, s) in lamps.iter().zip(&e.suns) {
        assert!(l.direction.angle_between(s.direction) < 5e-3);
    }
    assert!(e.shares[0] > e.shares[1] && e.shares[1] > 0.003);
    checked(&original, &e);
}

#[test]
fn in_the_dark_channels_get_their_own_disks() {
    let mut original = SphereImage::new(Layout::LatLong, 64, 32);
    original.planes[0][10 * 64 + 20] = 1000.0;
    original.planes[1][10 * 64 + 21] = 1000.0;
    let e = extract(&original, &SunOptions::default());
    assert_eq!(e.suns.len(), 2);
    checked(&original, &e);
    assert!(e.sunless.planes.iter().flatten().all(|v| *v == 0.0));
}

#[test]
fn where_there_is_no_sun_nothing_changes() {
    for l in
        [image(128, &[]), SphereImage::new(Layout::LatLong, 8, 4), SphereImage::new(Layout::LatLong, 1, 1)]
    {
        let e = extract(&l, &SunOptions::default());
        assert!(e.suns.is_empty() && e.sunless == l);
    }
}

#[test]
fn the_suns_of_the_data() {
    for (name, count, share) in [
        ("rooitou_park_1k", 1, 0.6),
        ("spiaggia_di_mondello_1k", 1, 0.45),
        ("immenstadter_horn_1k", 1, 0.2),
        ("potsdamer_platz_1k", 0, 0.0),
        ("lebombo_1k", 0, 0.0),
    ] {
        let Some(path) = steradian_testkit::data(&format!("environments/latlong/{name}.hdr")) else { return };
        let original =
            crate::load::load(&path, &Default::default()).expect("readable").into_environment().image;
        let e = extract(&original, &SunOptions::default());
        assert_eq!(e.suns.len(), count, "{name}: {:?}", e.suns);
        assert!(e.shares.iter().sum::<f64>() >= share, "{name}: {:?}", e.shares);
        checked(&original, &e);
    }
}

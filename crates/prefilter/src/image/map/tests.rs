use super::*;
use crate::Lobe;
use crate::deviation;
use steradian_light::{DiskLight, Environment, Lights};

/// Smooth light, a window and a spark.
fn lights() -> Lights {
    let mut image = SphereImage::from_fn(Layout::LatLong, 128, 64, |d| {
        let window = if d.z > 0.8 && d.y.abs() < 0.3 { 6.0 } else { 0.0 };
        [1.0 + 0.8 * d.x as f32, 0.3 + window, 0.1 + (d.y as f32).max(0.0)]
    });
    let k = image.index(0, 90, 20);
    (0..3).for_each(|c| image.planes[c][k] = 20_000.0);
    Lights::from(Environment { image })
}

#[test]
fn every_kernel_and_width_is_the_integral_over_texels() {
    let lights = lights();
    for w in [0.01_f64, 0.02, 0.05, 0.15, 0.5, 1.0] {
        let compact = w;
        let n = 2.0 / (compact * compact);
        for kernel in [
            Lobe::ggx(w),
            Lobe::beckmann(compact),
            Lobe::charlie(w.max(0.15)),
            Lobe::blinn_phong(n),
            Lobe::phong(n),
            Lobe::gaussian(compact),
        ] {
            let light = Sampled::new(&lights, &[&kernel], 2e-3, &Task::quiet()).unwrap();
            for (layout, a, b) in [(Layout::Cube, 12, 12), (Layout::LatLong, 30, 15)] {
                let got = filter_image(&light, &kernel, (layout, a, b), 2e-3, &Task::quiet()).unwrap();
                assert!(got.image.planes.iter().flatten().all(|v| v.is_finite() && *v >= 0.0));
                let e = deviation(&light, &kernel, &got.image, 40);
                assert!(e.rms < 1e-3 && e.bias.abs() < 1e-3, "{kernel:?}: {e:?} {:?}", got.way);
                assert!(e.worst < 2e-2, "{kernel:?}: {e:?} {:?}", got.way);
            }
        }
    }
}

#[test]
fn a_constant_stays_and_a_sun_is_its_lobe() {
    let constant = SphereImage::from_fn(Layout::LatLong, 32, 16, |_| [2.0, 1.0, 0.0]);
    let mut lights = Lights::from(Environment { image: constant });
    let kernel = Lobe::ggx(0.2);
    let run = |lights: &Lights| {
        let light = Sampled::new(lights, &[&kernel], 1e-3, &Task::quiet()).unwrap();
        filter_image(&light, &kernel, (Layout::Cube, 8, 8), 1e-3, &Task::quiet()).unwrap()
    };
    let got = run(&lights);
    assert!(got.image.planes[0].iter().all(|v| (v - 2.0).abs() < 1e-4));
    assert!((got.energy_out[0] / got.energy_in[0] - 1.0).abs() < 1e-4);
    lights.disks.push(DiskLight { direction: DVec3::Y, angular_radius: 0.005, radiance: [1e4; 3] });
    let with = run(&lights);
    let flux = lights.disks[0].solid_angle() * 1e4;
    for (face, i, j) in [(2, 4, 4), (0, 3, 0)] {
        let d = Layout::Cube.texel_direction(8, 8, face, i, j).unwrap();
        let more = f64::from(with.image.texel(face, i, j)[0] - got.image.texel(face, i, j)[0]);
        let expected = flux * kernel.value(d.y);
        assert!((more - expected).abs() < 1e-3 * expected, "{more} {expected}");
    }
}

#[test]
fn mirrors_keep_the_flux() {
    let mut lights = lights();
    lights.disks.push(DiskLight { direction: DVec3::X, angular_radius: 0.05, radiance: [100.0; 3] });
    let light = Sampled::new(&lights, &[], 1e-3, &Task::quiet()).unwrap();
    let m = mirror_image(&light, (Layout::Cube, 16, 16));
    for c in 0..3 {
        let ratio = m.energy_out[c] / m.energy_in[c];
        assert!((ratio - 1.0).abs() < 1e-4, "{ratio}");
    }
}

#[test]
fn enlarged_mirrors_are_not_negative_and_keep_the_flux() {
    let light = Sampled::new(&lights(), &[], 1e-3, &Task::quiet()).unwrap();
    for (layout, w, h) in [(Layout::Cube, 96, 96), (Layout::Cube, 200, 200), (Layout::LatLong, 400, 200)] {
        let m = mirror_image(&light, (layout, w, h));
        assert!(m.image.planes.iter().flatten().all(|v| *v >= 0.0));
        for c in 0..3 {
            let ratio = m.energy_out[c] / m.energy_in[c];
            assert!((ratio - 1.0).abs() < 2e-3, "{layout:?} {w}: {ratio}");
        }
    }
}

/// The integral of a kernel is preserved, whichever method filters it.
#[test]
fn coarse_constants_stay() {
    let image = SphereImage::from_fn(Layout::LatLong, 64, 32, |_| [2.0, 1.0, 0.5]);
    let lights = Lights::from(Environment { image });
    for kernel in [
        Lobe::lambert(),
        Lobe::ggx(0.03),
        Lobe::ggx(0.05),
        Lobe::ggx(0.3),
        Lobe::charlie(0.5),
        Lobe::phong(40.0),
        Lobe::gaussian(0.1),
    ] {
        for tolerance in [2e-3, 1e-4, 1e-5] {
            let light = Sampled::new(&lights, &[&kernel], tolerance, &Task::quiet()).unwrap();
            for (layout, w, h) in
                [(Layout::Cube, 24, 24), (Layout::LatLong, 64, 32), (Layout::Octahedral, 32, 32)]
            {
                let got = filter_image(&light, &kernel, (layout, w, h), tolerance, &Task::quiet()).unwrap();
                for (plane, l) in got.image.planes.iter().zip([2.0_f32, 1.0, 0.5]) {
                    let worst = plane.iter().map(|v| (v / l - 1.0).abs()).fold(0.0, f32::max);
                    assert!(worst < 3e-5, "{kernel:?} {tolerance} {layout:?}: {worst:e} {:?}", got.way);
                }
            }
        }
    }
}

#[test]
fn turning_the_light_turns_the_map() {
    let kernel = Lobe::ggx(0.1);
    let run = |image: SphereImage| {
        let lights = Lights::from(Environment { image });
        let light = Sampled::new(&lights, &[&kernel], 1e-3, &Task::quiet()).unwrap();
        filter_image(&light, &kernel, (Layout::LatLong, 32, 16), 1e-3, &Task::quiet()).unwrap().image
    };
    let image = lights().environment.unwrap().image.clone();
    let mut turned = image.clone();
    // 32 columns of 128 are 8 of 32.
    turned.planes.iter_mut().for_each(|p| p.chunks_exact_mut(128).for_each(|r| r.rotate_left(32)));
    let (mut a, b) = (run(image), run(turned));
    a.planes.iter_mut().for_each(|p| p.chunks_exact_mut(32).for_each(|r| r.rotate_left(8)));
    for (x, y) in a.planes.iter().flatten().zip(b.planes.iter().flatten()) {
        assert!((x - y).abs() < 1e-4 * x.max(1.0), "{x} {y}");
    }
}

/// A kernel far narrower than the texels sees the texel there, in the filter as in the sum that checks it.
#[test]
fn a_needle_sees_the_nearest_texel() {
    let lights = lights();
    for kernel in [Lobe::phong(1e9), Lobe::gaussian(3e-5)] {
        let light = Sampled::new(&lights, &[&kernel], 2e-3, &Task::quiet()).unwrap();
        let got = filter_image(&light, &kernel, (Layout::Cube, 6, 6), 2e-3, &Task::quiet()).unwrap();
        let e = deviation(&light, &kernel, &got.image, 60);
        assert!(e.rms < 1e-3 && e.worst < 1e-2, "{kernel:?}: {e:?} {:?}", got.way);
        let d = DVec3::new(0.3, 0.2, 0.4).normalize();
        let (exact, nearest) = (light.brute_force(&kernel, d), light.image.nearest(d));
        assert!((0..3).all(|c| (exact[c] - f64::from(nearest[c])).abs() < 1e-4), "{exact:?} {nearest:?}");
    }
}

/// An image of more rows than the analysis uses keeps the cell of a sun of one texel: a sharp lobe near it
/// sees that cell, not the larger one of the reduced image.
#[test]
fn the_brightest_texels_of_large_images_keep_their_cells() {
    let (width, height) = (4160, 2080);
    let mut image = SphereImage::from_fn(Layout::LatLong, width, height, |_| [0.5; 3]);
    let (i, j, bright) = (1885, 845, 1e6_f32);
    let k = image.index(0, i, j);
    image.planes.iter_mut().for_each(|p| p[k] = bright);
    let kernel = Lobe::phong(1e6);
    let light = Sampled::of(Lights::from(Environment { image }), &[&kernel], 2e-3, &Task::quiet()).unwrap();
    let shape = (Layout::LatLong, width / 130, height / 130);
    let got = filter_image(&light, &kernel, shape, 2e-3, &Task::quiet()).unwrap().image;
    // The texel's first corner is the centre of the map's texel (14, 6).
    let d = Layout::LatLong.texel_direction(shape.1, shape.2, 0, i / 130, j / 130).unwrap();
    let (cell, mut sun) = (crate::Cell::texel(i, j, width, height), 0.0);
    cell.nodes(64, &mut |wi, w| sun += w * kernel.value(wi.dot(d)));
    let omega = Layout::LatLong.solid_angle(width, height, 0, i, j);
    let expected = 0.5 * kernel.coefficients(4)[0] + (f64::from(bright) - 0.5) * omega * sun;
    let value = f64::from(got.texel(0, i / 130, j / 130)[0]);
    assert!((value / expected - 1.0).abs() < 2e-3, "{value} {expected}");
}

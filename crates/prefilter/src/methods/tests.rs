use super::*;
use crate::{Lobe, deviation};
use glam::DVec3;
use steradian_light::{DiskLight, Environment, Lights};
use steradian_sphere::{Layout, SphereImage};

const CUBE: Shape = (Layout::Cube, 12, 12);

/// Smooth light, a window and a bright texel.
fn lights() -> Lights {
    let mut image = SphereImage::from_fn(Layout::LatLong, 64, 32, |d| {
        let window = if d.z > 0.8 && d.y.abs() < 0.3 { 6.0 } else { 0.0 };
        [1.0 + 0.8 * d.x as f32, 0.3 + window, 0.1 + (d.y as f32).max(0.0)]
    });
    let k = image.index(0, 45, 10);
    (0..3).for_each(|c| image.planes[c][k] = 300.0);
    Lights::from(Environment { image })
}

fn smooth() -> Lights {
    let image = SphereImage::from_fn(Layout::LatLong, 256, 128, |d| {
        [1.0 + 0.8 * d.x as f32, 1.0 + 0.5 * (d.y * d.z) as f32, 1.0 + 0.7 * (3.0 * d.y).sin() as f32]
    });
    Lights::from(Environment { image })
}

fn sampled(lights: &Lights) -> Sampled {
    Sampled::new(lights, &[&Lobe::phong(400.0)], 1e-4, &Task::quiet()).unwrap()
}

fn error(light: &Sampled, kernel: &Lobe, made: &Made) -> f64 {
    deviation(light, kernel, &made.image, 60).rms
}

/// As their parameter is refined, errors fall to that of sampling texels at their centres, or as theory
/// predicts.
#[test]
fn exact_ways_tend_to_brute_force() {
    let light = sampled(&lights()).divided(&Lobe::phong(12.0));
    let task = Task::quiet();
    for kernel in [Lobe::phong(3.0), Lobe::phong(30.0), Lobe::ggx(0.3)] {
        for (layout, a, b) in [CUBE, (Layout::LatLong, 22, 11)] {
            let shape = (layout, a, b);
            let cut =
                |e| error(&light, &kernel, &truncated_angular(&light, &kernel, shape, e, &task).unwrap());
            let (coarse, fine, all) = (cut(0.05), cut(1e-3), cut(0.0));
            assert!(fine < 0.3 * coarse && all < 2e-3, "truncated {kernel:?}: {coarse} {fine} {all}");
            let opened = |o| error(&light, &kernel, &hierarchical(&light, &kernel, shape, o, &task).unwrap());
            let (coarse, fine, all) = (opened(0.6), opened(0.15), opened(0.0));
            assert!(fine < 0.3 * coarse && all < 2e-3, "hierarchical {kernel:?}: {coarse} {fine} {all}");
            let rows =
                |e| error(&light, &kernel, &lat_long_angular(&light, &kernel, shape, e, &task).unwrap());
            let (coarse, fine) = (rows(0.05), rows(1e-5));
            assert!(fine < 0.3 * coarse && fine < 2e-3, "by rows {kernel:?}: {coarse} {fine}");
            if layout == Layout::LatLong && kernel.width() < 0.2 {
                assert!(fine < 1e-3, "by rows {kernel:?}: {fine}");
            }
        }
        let light = sampled(&lights());
        let all = error(&light, &kernel, &brute(&light, &kernel, CUBE, &task).unwrap());
        assert!(all < 2e-5, "{all}");
    }
}

/// Every way meets its tolerance, or the bound recorded for it.
#[test]
fn every_way_is_as_good_as_it_says() {
    let light = sampled(&lights());
    let kernel = Lobe::phong(60.0);
    for method in Method::ALL {
        let made = method.filter(&light, &kernel, CUBE, 1e-3, &Task::quiet()).unwrap();
        let e = error(&light, &kernel, &made);
        let bound = match method {
            Method::PerFace => 0.3,
            Method::BoxMip => 0.8,
            Method::DualParaboloid => 0.1,
            // The error of sampling texels at their centres counts as well.
            _ => 2e-3,
        };
        assert!(e < bound, "{}: {e}", method.name());
        assert!(method.converges() == (bound < 0.01));
    }
}

#[test]
fn a_constant_light_stays() {
    let image = SphereImage::from_fn(Layout::LatLong, 64, 32, |_| [2.0, 1.0, 0.0]);
    let light = sampled(&Lights::from(Environment { image }));
    for kernel in [Lobe::lambert(), Lobe::phong(100.0), Lobe::ggx(0.2)] {
        for method in Method::ALL {
            let made = method.filter(&light, &kernel, CUBE, 1e-3, &Task::quiet()).unwrap();
            for (plane, expected) in made.image.planes.iter().zip([2.0, 1.0, 0.0]) {
                for v in plane {
                    assert!((v - expected).abs() <= 3e-3 * expected, "{}: {v}", method.name());
                }
            }
        }
    }
}

/// A kernel that is not normalised scales the result of every method, suns included.
#[test]
fn integrals_of_kernels_scale_maps() {
    let mut lights = smooth();
    lights.disks.push(DiskLight { direction: DVec3::Z, angular_radius: 0.05, radiance: [40.0; 3] });
    let light = sampled(&lights);
    for method in Method::ALL.into_iter().filter(|&m| m != Method::BoxMip) {
        let run = |k: &dyn Zonal| method.filter(&light, k, (Layout::Cube, 4, 4), 1e-3, &Task::quiet());
        let (a, b) = (run(&Lobe::phong(30.0)).unwrap(), run(&crate::Power { n: 30.0 }).unwrap());
        for (a, b) in a.image.planes.iter().flatten().zip(b.image.planes.iter().flatten()) {
            let expected = a * (2.0 * std::f32::consts::PI / 31.0);
            assert!((b - expected).abs() < 1e-3 * expected, "{}: {b} {expected}", method.name());
        }
        // The sun stands in the middle of +Z.
        let at = a.image.index(4, 2, 2);
        let flux = lights.disks[0].solid_angle() * 40.0;
        assert!(f64::from(a.image.planes[0][at]) > 0.7 * flux * 31.0 / 6.3, "{}", method.name());
    }
}

/// The hardware's ways meet the sum over all texels only as the lobe narrows, and more radii help.
#[test]
fn approximations_tend_to_brute_force_as_lobes_narrow() {
    let light = sampled(&smooth());
    for method in [Method::PerFace, Method::BoxMip, Method::DualParaboloid] {
        let at = |s: f64| {
            let kernel = Lobe::phong(s);
            error(&light, &kernel, &method.filter(&light, &kernel, CUBE, 1e-3, &Task::quiet()).unwrap())
        };
        let (wide, narrow) = (at(20.0), at(320.0));
        assert!(narrow < 0.3 * wide, "{}: {wide} {narrow}", method.name());
    }
    let kernel = Lobe::phong(100.0);
    let blended = |radii| {
        error(&light, &kernel, &dual_paraboloid(&light, &kernel, CUBE, (16, radii), &Task::quiet()).unwrap())
    };
    let (two, five) = (blended(2), blended(5));
    assert!(five < two, "{two} {five}");
}

/// Frequency space and both angular ways agree on either side of the crossover.
#[test]
fn ways_agree_across_the_crossover() {
    let light = sampled(&lights());
    for s in [8.0, 64.0, 512.0, 4096.0] {
        let kernel = Lobe::phong(s);
        let run = |m: Method| m.filter(&light, &kernel, CUBE, 1e-3, &Task::quiet()).unwrap().image;
        let reference = run(Method::Frequency);
        // On a cube the way by rows is looked up: no match for lobes much narrower than the light's texels.
        let rows = (s < 4000.0).then_some(Method::LatLongAngular);
        for method in rows.into_iter().chain([Method::TruncatedAngular, Method::Hierarchical]) {
            let (mut error, mut energy) = (0.0, 0.0);
            for (a, b) in run(method).planes.iter().flatten().zip(reference.planes.iter().flatten()) {
                error += f64::from(a - b).powi(2);
                energy += f64::from(*b).powi(2);
            }
            let rms = (error / energy).sqrt();
            assert!(rms < 2e-3, "{} at {s}: {rms}", method.name());
        }
    }
}

#[test]
fn the_model_prefers_frequencies_for_broad_lobes_and_angles_for_sharp_ones() {
    let choose =
        |s: f64| Model::default().choose(&Problem::new(512, (Layout::Cube, 128, 128), &Lobe::phong(s), 1e-3));
    assert_eq!(choose(8.0), Method::Frequency);
    assert_eq!(choose(1e6), Method::TruncatedAngular);
    assert_eq!(
        Model::default().predict(Method::BoxMip, &Problem::new(64, CUBE, &Lobe::lambert(), 1e-3)),
        None
    );
}

#[test]
fn the_reach_holds_all_but_epsilon() {
    // Ramamoorthi & Hanrahan 2002, 5.30: cos θ* = ε^{1/(s+1)}.
    for s in [1.0, 32.0, 512.0] {
        let expected = 0.05_f64.powf(1.0 / (s + 1.0)).acos();
        assert!((reach(&Lobe::phong(s), 0.05) - expected).abs() < 1e-6);
    }
    assert_eq!(reach(&Lobe::phong(1.0), 0.0), std::f64::consts::FRAC_PI_2);
}

#[test]
fn widths_match() {
    // cos^s has the variance 1/s along each axis for large s.
    assert!((effective_sigma(&Lobe::phong(225.0)) * 15.0 - 1.0).abs() < 5e-3);
    assert!((effective_sigma(&Lobe::gaussian(0.02)) / 0.02 - 1.0).abs() < 1e-3);
}

#[test]
fn names_are_unique_and_found() {
    for method in Method::ALL {
        assert_eq!(Method::from_name(method.name()), Some(method));
    }
    assert_eq!(Method::from_name("nothing"), None);
}

#[test]
fn cancelled_tasks_stop() {
    let light = sampled(&lights());
    let flag = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(true));
    let task = Task::quiet().with_cancel(flag);
    for method in Method::ALL {
        assert!(method.filter(&light, &Lobe::phong(9.0), CUBE, 1e-3, &task).is_err(), "{}", method.name());
    }
}

//! Does the stated error bound the true one?

use crate::support::{Noise, SPECS, difference, image, judge, stormy, view};
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use steradian_base::Task;
use steradian_light::{DiskLight, Environment, Lights};
use steradian_reference::{Judge, Lookup};

/// The worst true/stated error over a grid of models, angles and frames, at several tolerances.
#[test]
fn stated_errors_bound_the_true_ones() {
    let verbose = std::env::var_os("STERADIAN_VERBOSE").is_some();
    let sky = judge(stormy(128, 64, 3), Lookup::Constant);
    let mut worst: f64 = 0.0;
    for spec in SPECS {
        let Ok(brdf) = steradian_brdf::parse(spec) else {
            if verbose {
                eprintln!("no {spec}");
            }
            continue;
        };
        for angle in [0.0, 30.0, 60.0, 75.0, 85.0, 89.0] {
            for k in 0..4 {
                let a = f64::from(k) * 2.1 + angle;
                let (frame, wo) =
                    view(DVec3::new(a.cos(), 0.8 - 0.5 * f64::from(k), a.sin()), angle, a * 1.7);
                let truth = sky.radiance(brdf.as_ref(), &frame, wo, None, 1e-7);
                for tolerance in [1e-1, 1e-2, 1e-3, 1e-4] {
                    let e = sky.radiance(brdf.as_ref(), &frame, wo, None, tolerance);
                    let ratio = difference(e.rgb, truth.rgb) / (e.error + truth.error);
                    if verbose && (ratio > 0.3 || truth.error > 1.1e-7) {
                        eprintln!(
                            "{spec} {angle} {k} {tolerance}: {ratio:.3} stated {:.1e} n {} truth {:.1e} n {}",
                            e.error, e.evaluations, truth.error, truth.evaluations
                        );
                    }
                    worst = worst.max(ratio);
                }
            }
        }
    }
    if verbose {
        eprintln!("worst {worst}");
    }
    assert!(worst <= 1.0, "true error is {worst:.2} times the stated one");
}

/// Light from one texel or one small disk only, where no average hides an error.
#[test]
fn stated_errors_bound_the_true_ones_for_single_lights() {
    let verbose = std::env::var_os("STERADIAN_VERBOSE").is_some();
    let (w, h) = (256, 128);
    let mut noise = Noise(17);
    let mut worst: f64 = 0.0;
    for spec in SPECS {
        let Ok(brdf) = steradian_brdf::parse(spec) else {
            if verbose {
                eprintln!("no {spec}");
            }
            continue;
        };
        for angle in [0.0, 30.0, 60.0, 75.0, 85.0, 89.0] {
            for k in 0..12 {
                let n = DVec3::new(noise.next() - 0.5, noise.next() - 0.5, noise.next() - 0.5);
                let (frame, wo) = view(n, angle, noise.next() * 6.0);
                let l = frame.to_local(wo);
                let local = if k < 6 {
                    DVec3::new(-l.x, -l.y, l.z)
                        + 0.2 * DVec3::new(noise.next() - 0.5, noise.next() - 0.5, noise.next() - 0.5)
                } else {
                    DVec3::new(noise.next() - 0.5, noise.next() - 0.5, 0.02 * (noise.next() - 0.5))
                };
                let d = frame.to_world(local.normalize());
                let mut lights = Lights::default();
                if k % 2 == 0 {
                    let (i, j) = ((0.5 + d.z.atan2(d.x) / TAU) * w as f64, d.y.acos() / PI * h as f64);
                    let mut sky = image(w, h, |_, _| [0.01; 3]);
                    for (c, v) in [5e4, 4e4, 3e4].into_iter().enumerate() {
                        sky.planes[c][j as usize * w + i as usize % w] = v;
                    }
                    lights = Lights::from(Environment { image: sky });
                } else {
                    lights.disks.push(DiskLight {
                        direction: d,
                        angular_radius: 0.00465,
                        radiance: [1e4; 3],
                    });
                }
                let judge = Judge::new(&lights, Lookup::Constant, &Task::quiet()).expect("sound light");
                let truth = judge.radiance(brdf.as_ref(), &frame, wo, None, 1e-7);
                for tolerance in [1e-1, 1e-2, 1e-3, 1e-4] {
                    let e = judge.radiance(brdf.as_ref(), &frame, wo, None, tolerance);
                    let ratio = difference(e.rgb, truth.rgb) / (e.error + truth.error);
                    if verbose && (ratio > 0.3 || truth.error > 1.1e-7) {
                        eprintln!(
                            "{spec} {angle} {k} {tolerance}: {ratio:.3} stated {:.1e} n {} truth {:.1e} n {}",
                            e.error, e.evaluations, truth.error, truth.evaluations
                        );
                    }
                    worst = worst.max(ratio);
                }
            }
        }
    }
    if verbose {
        eprintln!("worst single {worst}");
    }
    assert!(worst <= 1.0, "true error is {worst:.2} times the stated one");
}

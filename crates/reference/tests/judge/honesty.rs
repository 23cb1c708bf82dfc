//! Does the stated error bound the true one?
//!
//! The truth is the reference's own answer at a far smaller tolerance; `brute` checks that by other code.
//! `STERADIAN_FULL=1` runs every case and reports those that come near the bound.

use crate::support::{Noise, SPECS, difference, image, reference, stormy, view};
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use steradian_base::Task;
use steradian_brdf::Brdf;
use steradian_light::{DiskLight, Environment, Lights};
use steradian_reference::{Lookup, Reference};
use steradian_sphere::Frame;

/// Largest true/stated error over tolerances.
fn worst_ratio(reference: &Reference, brdf: &dyn Brdf, frame: &Frame, wo: DVec3, label: &str) -> f64 {
    let full = steradian_testkit::full();
    let truth = reference.radiance(brdf, frame, wo, None, if full { 1e-8 } else { 1e-6 });
    let mut worst: f64 = 0.0;
    for tolerance in [1e-1, 1e-2, 1e-3, 1e-4] {
        let e = reference.radiance(brdf, frame, wo, None, tolerance);
        let ratio = difference(e.rgb, truth.rgb) / (e.error + truth.error);
        if full && (ratio > 0.3 || truth.error > 1.1e-8) {
            eprintln!(
                "{label} tolerance {tolerance}: {ratio:.3}; stated {:.1e}, {} evaluations; truth to {:.1e}, {}",
                e.error, e.evaluations, truth.error, truth.evaluations
            );
        }
        worst = worst.max(ratio);
    }
    worst
}

/// Every case with `STERADIAN_FULL=1`, else each seventh or so.
fn chosen(count: &mut usize, stride: usize) -> bool {
    *count += 1;
    steradian_testkit::full() || count.is_multiple_of(stride)
}

#[test]
fn stated_errors_bound_the_true_ones() {
    let sky = reference(stormy(128, 64, 3), Lookup::Constant);
    let (mut worst, mut count) = (0.0_f64, 0);
    for spec in SPECS {
        let brdf = steradian_brdf::parse(spec).expect("a known model");
        for angle in [0.0, 30.0, 60.0, 75.0, 85.0, 89.0] {
            for k in 0..4 {
                let a = f64::from(k) * 2.1 + angle;
                let (frame, wo) =
                    view(DVec3::new(a.cos(), 0.8 - 0.5 * f64::from(k), a.sin()), angle, a * 1.7);
                if chosen(&mut count, 23) {
                    worst = worst.max(worst_ratio(
                        &sky,
                        brdf.as_ref(),
                        &frame,
                        wo,
                        &format!("{spec} {angle} {k}"),
                    ));
                }
            }
        }
    }
    assert!(worst <= 1.0, "true error is {worst:.2} times the stated one");
    if steradian_testkit::full() {
        eprintln!("noise: true error at most {worst:.3} of the stated one");
    }
}

/// A direction near the mirror's, or near the horizon.
fn aimed(noise: &mut Noise, wo: DVec3, at_horizon: bool) -> DVec3 {
    let mut r = || noise.next() - 0.5;
    let offset = DVec3::new(r(), r(), r());
    let d = if at_horizon {
        offset * DVec3::new(1.0, 1.0, 0.02)
    } else {
        DVec3::new(-wo.x, -wo.y, wo.z) + 0.2 * offset
    };
    d.normalize()
}

fn one_texel(d: DVec3) -> Lights {
    let (w, h) = (256, 128);
    let (i, j) = ((0.5 + d.z.atan2(d.x) / TAU) * w as f64, d.y.acos() / PI * h as f64);
    let mut sky = image(w, h, |_, _| [0.01; 3]);
    for (c, v) in [5e4, 4e4, 3e4].into_iter().enumerate() {
        sky.planes[c][j as usize * w + i as usize % w] = v;
    }
    Lights::from(Environment { image: sky })
}

fn one_disk(d: DVec3, angular_radius: f64) -> Lights {
    let mut lights = Lights::default();
    lights.disks.push(DiskLight { direction: d, angular_radius, radiance: [1e4; 3] });
    lights
}

/// Light from one texel or one disk, where no average hides an error.
#[test]
fn stated_errors_bound_the_true_ones_for_single_lights() {
    let mut noise = Noise(17);
    let (mut worst, mut count) = (0.0_f64, 0);
    for spec in SPECS {
        let brdf = steradian_brdf::parse(spec).expect("a known model");
        for angle in [0.0, 30.0, 60.0, 75.0, 85.0, 89.0] {
            for k in 0..12 {
                let n = DVec3::new(noise.next() - 0.5, noise.next() - 0.5, noise.next() - 0.5);
                let (frame, wo) = view(n, angle, noise.next() * 6.0);
                let d = frame.to_world(aimed(&mut noise, frame.to_local(wo), k >= 6));
                if !chosen(&mut count, 31) {
                    continue;
                }
                let lights =
                    if k % 2 == 0 { one_texel(d) } else { one_disk(d, [0.00465, 0.2, 1e-3][k / 2 % 3]) };
                let reference =
                    Reference::new(&lights, Lookup::Constant, &Task::quiet()).expect("sound light");
                worst = worst.max(worst_ratio(
                    &reference,
                    brdf.as_ref(),
                    &frame,
                    wo,
                    &format!("{spec} {angle} {k}"),
                ));
            }
        }
    }
    assert!(worst <= 1.0, "true error is {worst:.2} times the stated one");
    if steradian_testkit::full() {
        eprintln!("single lights: true error at most {worst:.3} of the stated one");
    }
}

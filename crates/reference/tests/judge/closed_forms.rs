//! Closed forms.

use crate::support::{centre, difference, image, made, reference, stormy, view};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_brdf::Domain;
use steradian_light::{DirectionalLight, DiskLight, Environment, Lights, PointLight, Unsound};
use steradian_reference::{Estimate, Lookup, Reference, ReferenceError, ReferencePoint};
use steradian_sphere::{Frame, Layout, SphereImage};

const NORMALS: [DVec3; 6] =
    [DVec3::Y, DVec3::NEG_Y, DVec3::X, DVec3::Z, DVec3::new(1.0, 1.0, 1.0), DVec3::new(-1.0, -0.02, 1e-9)];

fn mirror(wo: DVec3) -> DVec3 {
    DVec3::new(-wo.x, -wo.y, wo.z)
}

#[test]
fn white_furnace() {
    let lambert = made(Domain::Hemisphere, |wi, _| wi.z / PI);
    // ∫ max(0, r·wi)^n dω = 2π/(n + 1) over the sphere.
    let lobe = made(Domain::Sphere, |wi, wo| mirror(wo).dot(wi).max(0.0).powi(40));
    for (w, h) in [(64, 32), (1024, 512), (7, 3), (1, 1)] {
        for lookup in [Lookup::Constant, Lookup::Bilinear] {
            let white = reference(image(w, h, |_, _| [1.0, 0.5, 2.0]), lookup);
            for (k, n) in NORMALS.into_iter().enumerate() {
                let (frame, wo) = view(n, 15.0 * k as f64, 1.0);
                let e = white.radiance(&lambert, &frame, wo, None, 1e-6);
                assert!(difference(e.rgb, [1.0, 0.5, 2.0]) < 1e-6, "{w} {n} {e:?}");
                assert!(e.error <= 1e-6);
                let e = white.radiance(&lobe, &frame, wo, None, 1e-6);
                let truth = [1.0, 0.5, 2.0].map(|v| v * 2.0 * PI / 41.0);
                assert!(difference(e.rgb, truth) < 1e-6, "{w} {n} {e:?}");
            }
        }
    }
}

/// f_cos = 1 above the horizon jumps there: 2π, and half of it where half the sky is dark.
#[test]
fn a_jump_at_the_horizon_is_met_exactly() {
    let step = made(Domain::Hemisphere, |_, _| 1.0);
    let white = reference(image(128, 64, |_, _| [1.0; 3]), Lookup::Constant);
    let upper = reference(image(128, 64, |_, j| [f32::from(u8::from(j < 32)); 3]), Lookup::Constant);
    for n in NORMALS {
        let (frame, wo) = view(n, 30.0, 0.0);
        let e = white.radiance(&step, &frame, wo, None, 1e-6);
        assert!(difference(e.rgb, [2.0 * PI; 3]) < 1e-6, "{n} {e:?}");
        // The part of the upper half-space above the plane of n: a lune of angle π − γ, γ between n and +Y.
        let lune = 2.0 * (PI - n.normalize().dot(DVec3::Y).clamp(-1.0, 1.0).acos());
        let e = upper.radiance(&step, &frame, wo, None, 1e-6);
        assert!((e.rgb[0] - lune).abs() < 1e-5, "{n} {e:?} {lune}");
    }
}

#[test]
fn one_texel_anywhere() {
    // ∫ over a texel of constant f: its solid angle; (n·wi)²: against many points.
    let (w, h) = (64, 32);
    let square = made(Domain::Sphere, |wi, _| wi.z * wi.z);
    for (i, j) in [(0, 0), (63, 0), (31, 31), (0, 16), (63, 15), (20, 7)] {
        let one =
            reference(image(w, h, |a, b| [if (a, b) == (i, j) { 5e4 } else { 0.0 }; 3]), Lookup::Constant);
        for n in NORMALS {
            let (frame, wo) = view(n, 50.0, 0.4);
            let mut sum = 0.0;
            let s = 60;
            for a in 0..s {
                for b in 0..s {
                    let d = centre(w * s, h * s, i * s + a, j * s + b);
                    let t =
                        [(j * s + b) as f64, (j * s + b + 1) as f64].map(|k| (k / (h * s) as f64 * PI).cos());
                    sum += 5e4 * d.dot(frame.n).powi(2) * (t[0] - t[1]) * 2.0 * PI / (w * s) as f64;
                }
            }
            let e = one.radiance(&square, &frame, wo, None, 1e-6);
            assert!((e.rgb[0] - sum).abs() < 1e-3 * sum.max(1e-3), "{n} {i} {j} {e:?} {sum}");
            assert!(e.error <= 1e-6);
        }
    }
}

#[test]
fn disks_point_and_directional_lights() {
    let lambert = made(Domain::Hemisphere, |wi, _| wi.z / PI);
    let (frame, wo) = view(DVec3::new(0.2, 0.9, 0.1), 20.0, 0.0);
    // A disk above the horizon: E = π sin²ρ cos θ · L.
    for (degrees, rho) in [(0.0, 0.00465), (70.0, 0.00465), (30.0, 0.9), (0.0, PI / 2.0)] {
        let t = f64::to_radians(degrees);
        let direction = frame.to_world(DVec3::new(t.sin(), 0.0, t.cos()));
        let mut lights = Lights::default();
        lights.disks.push(DiskLight { direction, angular_radius: rho, radiance: [3.0, 1.0, 0.0] });
        let reference = Reference::new(&lights, Lookup::Constant, &Task::quiet()).expect("sound");
        let e = reference.radiance(&lambert, &frame, wo, None, 1e-7);
        let truth = rho.sin().powi(2) * t.cos();
        assert!(difference(e.rgb, [3.0 * truth, truth, 0.0]) < 1e-7, "{degrees} {rho} {e:?}");
    }
    // Half below: by symmetry E = L·(2/3) sin³ρ … for a disk centred on the horizon E = L (ρ − sin ρ cos ρ).
    let rho: f64 = 0.3;
    let mut lights = Lights::default();
    lights.disks.push(DiskLight { direction: frame.t, angular_radius: rho, radiance: [1.0; 3] });
    let half = Reference::new(&lights, Lookup::Constant, &Task::quiet()).expect("sound");
    let e = half.radiance(&lambert, &frame, wo, None, 1e-7);
    assert!((e.rgb[0] * PI / (rho - rho.sin() * rho.cos()) - 1.0).abs() < 1e-6, "{e:?}");

    let mut lights = Lights::default();
    lights.directionals.push(DirectionalLight { direction: frame.n, irradiance: [2.0; 3] });
    lights.points.push(PointLight { position: (frame.n * 2.0).as_vec3(), intensity: [8.0, 0.0, 0.0] });
    let both = Reference::new(&lights, Lookup::Constant, &Task::quiet()).expect("sound");
    let e = both.radiance(&lambert, &frame, wo, Some(DVec3::ZERO), 1e-4);
    assert!(difference(e.rgb, [4.0 / PI, 2.0 / PI, 2.0 / PI]) < 1e-6, "{e:?}");
    assert_eq!(e.error, 0.0);
    assert_eq!(both.radiance(&lambert, &frame, wo, None, 1e-4).error, f64::INFINITY);
}

#[test]
fn nothing_gives_exactly_nothing() {
    let lambert = made(Domain::Hemisphere, |wi, _| wi.z / PI);
    let dark = reference(image(16, 8, |_, _| [0.0; 3]), Lookup::Constant);
    let (frame, wo) = view(DVec3::Y, 20.0, 0.0);
    assert_eq!(dark.radiance(&lambert, &frame, wo, None, 1e-4), Estimate::ZERO);
    let white = reference(image(16, 8, |_, _| [1.0; 3]), Lookup::Constant);
    assert_eq!(white.radiance(&lambert, &frame, -wo, None, 1e-4), Estimate::ZERO);
    assert_eq!(white.radiance(&lambert, &frame, frame.t, None, 1e-4), Estimate::ZERO);
    let broken = made(Domain::Hemisphere, |wi, _| if wi.x > 0.9 { f64::NAN } else { 1.0 });
    let e = white.radiance(&broken, &frame, wo, None, 1e-4);
    assert!(e.error.is_infinite() && e.rgb.iter().all(|v| v.is_finite()));
}

#[test]
fn bad_lights_are_refused() {
    let new = |image: SphereImage| {
        Reference::new(&Lights::from(Environment { image }), Lookup::Constant, &Task::quiet())
    };
    assert!(matches!(new(SphereImage::new(Layout::Cube, 4, 4)), Err(ReferenceError::Layout(Layout::Cube))));
    assert!(matches!(new(SphereImage::new(Layout::LatLong, 0, 4)), Err(ReferenceError::Size { .. })));
    let mut nan = SphereImage::new(Layout::LatLong, 8, 4);
    nan.planes[1][8 + 3] = f32::NAN;
    assert!(matches!(new(nan), Err(ReferenceError::Unsound(Unsound::Texel { i: 3, j: 1, .. }))));
    let mut lights = Lights::default();
    lights.directionals.push(DirectionalLight { direction: DVec3::ZERO, irradiance: [1.0; 3] });
    let refused = Reference::new(&lights, Lookup::Constant, &Task::quiet());
    assert!(matches!(refused, Err(ReferenceError::Unsound(Unsound::Light("directional")))));
}

#[test]
fn batches_and_threads_change_nothing() {
    let sky = reference(stormy(64, 32, 9), Lookup::Bilinear);
    let lobe = made(Domain::Sphere, |wi, wo| mirror(wo).dot(wi).max(0.0).powi(200));
    let points: Vec<_> = (0..6)
        .map(|k| {
            let (frame, wo) = view(NORMALS[k], 12.0 * k as f64, 0.3);
            ReferencePoint { frame, wo, position: None }
        })
        .collect();
    let batch = sky.radiance_batch(&lobe, &points, 1e-4, &Task::quiet()).expect("nobody cancels");
    for (p, e) in points.iter().zip(batch) {
        assert_eq!(e, sky.radiance(&lobe, &p.frame, p.wo, None, 1e-4));
    }
    let stopped = Task::quiet().with_cancel(std::sync::Arc::new(true.into()));
    assert!(sky.radiance_batch(&lobe, &points, 1e-4, &stopped).is_err());
}

/// Rotating light by whole texels about +Y, together with the frame, changes nothing.
#[test]
fn the_seam_is_nowhere() {
    let sky = stormy(32, 16, 4);
    let turned = image(32, 16, |i, j| sky.texel(0, (i + 27) % 32, j));
    let lobe = made(Domain::Hemisphere, |wi, wo| mirror(wo).dot(wi).max(0.0).powi(20));
    let angle = 5.0 / 32.0 * 2.0 * PI;
    let turn = |v: DVec3| {
        let (s, c) = angle.sin_cos();
        DVec3::new(c * v.x - s * v.z, v.y, s * v.x + c * v.z)
    };
    for lookup in [Lookup::Constant, Lookup::Bilinear] {
        let (a, b) = (reference(sky.clone(), lookup), reference(turned.clone(), lookup));
        let (frame, wo) = view(DVec3::new(-1.0, 0.3, 0.01), 60.0, 2.0);
        let frame2 = Frame { t: turn(frame.t), b: turn(frame.b), n: turn(frame.n) };
        let e = a.radiance(&lobe, &frame, wo, None, 1e-6);
        let e2 = b.radiance(&lobe, &frame2, turn(wo), None, 1e-6);
        assert!(difference(e.rgb, e2.rgb) < 1e-6, "{e:?} {e2:?}");
    }
}

//! Incident light at points, by paths, against closed forms.

use glam::{Affine3A, DVec3, Vec3};
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_light::{DirectionalLight, Environment, Lights, PointLight};
use steradian_reference::path::{
    PathOptions, PathScene, ProbeEstimate, ProbeImage, trace_environments, trace_probes,
};
use steradian_scene::{Bvh, Mesh, shapes};
use steradian_sphere::sh::{self, ShRgb};
use steradian_sphere::{Layout, SphereImage};

fn sky(f: impl Fn(usize, usize) -> f32) -> Lights {
    let mut image = SphereImage::new(Layout::LatLong, 32, 16);
    for (c, plane) in image.planes.iter_mut().enumerate() {
        for (k, v) in plane.iter_mut().enumerate() {
            *v = f(k % 32, k / 32) * (1.0 + c as f32);
        }
    }
    Lights::from(Environment { image })
}

fn at(mesh: &Mesh, lights: &Lights, points: &[DVec3], options: PathOptions) -> Vec<ProbeEstimate> {
    with(mesh, lights, |scene| {
        trace_probes(scene, points, 4, options, &(), &Task::quiet()).expect("nobody cancels")
    })
}

fn image(mesh: &Mesh, lights: &Lights, point: DVec3, height: usize, options: PathOptions) -> ProbeImage {
    with(mesh, lights, |scene| {
        let all = trace_environments(scene, &[point], height, options, &(), &Task::quiet());
        all.expect("nobody cancels").remove(0)
    })
}

fn with<R>(mesh: &Mesh, lights: &Lights, f: impl FnOnce(&PathScene<'_>) -> R) -> R {
    let bvh = Bvh::build(mesh);
    let materials = [steradian_brdf::parse("lambert:albedo=0.5").expect("a known model")];
    let scene =
        PathScene { mesh, bvh: &bvh, materials: &materials, tint: None, lights, offset: PathScene::OFFSET };
    f(&scene)
}

/// Every coefficient within 4.5 standard deviations, or of rounding.
fn agrees(e: &ProbeEstimate, truth: &ShRgb) {
    for c in 0..3 {
        for i in 0..16 {
            let off = (e.light.c[c][i] - truth.c[c][i]).abs();
            assert!(
                off <= 4.5 * e.variance.c[c][i].sqrt() + 1e-6,
                "{c} {i}: {} {}",
                e.light.c[c][i],
                truth.c[c][i]
            );
        }
    }
}

/// A ball far below, which hides less than the noise.
fn nothing() -> Mesh {
    shapes::icosphere(1).transformed(&Affine3A::from_translation(Vec3::new(0.0, -5000.0, 0.0)))
}

#[test]
fn in_the_open_it_is_the_light_itself() {
    // A small sun among dim texels.
    let mut lights = sky(|i, j| if (i, j) == (20, 5) { 400.0 } else { 0.2 + ((i * 7 + j * 3) % 11) as f32 });
    let mut truth = sh::project(&lights.environment.as_ref().unwrap().image, 3);
    let directional =
        DirectionalLight { direction: DVec3::new(-1.0, 1.0, 0.5).normalize(), irradiance: [1.0, 2.0, 3.0] };
    let point = PointLight { position: Vec3::new(0.0, 3.0, 0.0), intensity: [9.0, 1.0, 0.0] };
    let mut y = [0.0; 16];
    for (d, e) in [(directional.direction, [1.0, 2.0, 3.0]), (DVec3::Y, [1.0, 1.0 / 9.0, 0.0])] {
        sh::eval(3, d, &mut y);
        for c in 0..3 {
            (0..16).for_each(|i| truth.c[c][i] += e[c] * y[i]);
        }
    }
    lights.directionals.push(directional);
    lights.points.push(point);
    let options = PathOptions { samples: 8192, ..PathOptions::default() };
    let e = &at(&nothing(), &lights, &[DVec3::ZERO], options)[0];
    agrees(e, &truth);
    assert!(e.error() < 0.02 * truth.c[2][0] && !e.inside(), "{}", e.error());
}

/// Over a large plate of albedo ½ under a white sky the lower half shines with half the sky's radiance.
#[test]
fn what_surfaces_reflect_arrives() {
    let mut plate = shapes::plane(1e4, 0.0, 1);
    plate.materials.clear();
    let e = &at(&plate, &sky(|_, _| 1.0), &[DVec3::Y], PathOptions { samples: 4096, bounces: 2, seed: 3 })[0];
    let hemisphere = sh::zonal::phong(3, 0.0);
    let mut truth = ShRgb::zero(3);
    let mut y = [0.0; 16];
    for (d, l) in [(DVec3::Y, 1.0), (DVec3::NEG_Y, 0.5)] {
        sh::eval(3, d, &mut y);
        for c in 0..3 {
            for i in 0..16usize {
                truth.c[c][i] += l * (1.0 + c as f64) * hemisphere[i.isqrt()] * y[i];
            }
        }
    }
    // The plate ends 1e-4 below the horizon.
    let slack = 1e-3;
    for c in 0..3 {
        for i in 0..16 {
            let off = (e.light.c[c][i] - truth.c[c][i]).abs();
            assert!(off < 4.5 * e.variance.c[c][i].sqrt() + slack, "{c} {i} {off}");
        }
    }
    assert!((e.light.c[0][0] - 1.5 * 2.0 * PI / (4.0 * PI).sqrt()).abs() < 0.05);
}

/// The image at an unoccluded point is that of the light, box-filtered, whose sun is importance-sampled; it
/// contains the light that a plate reflects, and its harmonics equal those traced directly.
#[test]
fn images_hold_what_arrives() {
    let mut lights = sky(|i, j| if (i, j) == (20, 5) { 4000.0 } else { 0.2 + ((i * 7 + j * 3) % 11) as f32 });
    let truth = lights.environment.as_ref().expect("a sky").image.clone();
    let options = PathOptions { samples: 64, bounces: 2, seed: 5 };
    let open = image(&nothing(), &lights, DVec3::ZERO, 16, options);
    assert!(open.noise < 0.02, "{}", open.noise);
    for (got, want) in open.image.planes.iter().flatten().zip(truth.planes.iter().flatten()) {
        assert!((got - want).abs() < 0.05 * want, "{got} {want}");
    }
    lights
        .directionals
        .push(DirectionalLight { direction: DVec3::new(-1.0, 1.0, 0.5).normalize(), irradiance: [30.0; 3] });
    let mut plate = shapes::plane(1e4, 0.0, 1);
    plate.materials.clear();
    let harmonics =
        &at(&plate, &lights, &[DVec3::Y], PathOptions { samples: 1 << 15, bounces: 2, seed: 3 })[0];
    let got = sh::project(&image(&plate, &lights, DVec3::Y, 16, options).image, 3);
    let scale = harmonics.light.c[2][0];
    for (c, got) in got.c.iter().enumerate() {
        for (i, got) in got.iter().enumerate() {
            // A directional light is spread over its texel.
            assert!((got - harmonics.light.c[c][i]).abs() < 0.03 * scale, "{c} {i}: {got}");
        }
    }
}

#[test]
fn solids_and_threads() {
    let mesh = shapes::icosphere(2);
    let lights = sky(|i, j| (i + j) as f32);
    let points =
        [DVec3::ZERO, DVec3::new(0.0, 0.9, 0.1), DVec3::new(0.0, 1.2, 0.0), DVec3::new(3.0, 0.0, 1.0)];
    let options = PathOptions { samples: 64, ..PathOptions::default() };
    let all = at(&mesh, &lights, &points, options);
    assert_eq!(all.iter().map(ProbeEstimate::inside).collect::<Vec<_>>(), [true, true, false, false]);
    // A probe's numbers are its own.
    let first = at(&mesh, &lights, &points[..2], options);
    assert_eq!(all[..2], first[..]);
}

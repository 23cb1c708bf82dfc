//! The path tracer against closed forms and against the reference, by Z-tests.

use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::Task;
use steradian_brdf::SharedBrdf;
use steradian_light::{DirectionalLight, DiskLight, Environment, Lights, PointLight};
use steradian_reference::path::{PathEstimate, PathOptions, PathPoint, PathScene, trace_image, trace_points};
use steradian_reference::{Lookup, Reference};
use steradian_scene::{Bvh, Camera, Framing, Mesh, Surface, shapes};
use steradian_sphere::{Frame, Layout, SphereImage};

fn sky(w: usize, h: usize, f: impl Fn(usize, usize) -> f32) -> SphereImage {
    let mut image = SphereImage::new(Layout::LatLong, w, h);
    for (c, plane) in image.planes.iter_mut().enumerate() {
        for (k, v) in plane.iter_mut().enumerate() {
            *v = f(k % w, k / w) * (1.0 + c as f32);
        }
    }
    image
}

fn brdf(spec: &str) -> SharedBrdf {
    steradian_brdf::parse(spec).expect("a known model")
}

/// Within 4.5 standard deviations, or of rounding.
fn agrees(e: &PathEstimate, truth: [f64; 3], label: &str) {
    for c in 0..3 {
        let off = (e.rgb[c] - truth[c]).abs();
        assert!(off <= 4.5 * e.variance[c].sqrt() + 1e-5 * truth[c].abs(), "{label}: {e:?}, truth {truth:?}");
    }
}

/// A camera that sees the cube from −1 to 1.
fn cube_seen() -> Camera {
    let corner = |i: u32| glam::Vec3::from([i & 1, i >> 1 & 1, i >> 2].map(|b| 2.0 * b as f32 - 1.0));
    let points: Vec<_> = (0..8).map(corner).collect();
    Framing { fov_y: 0.6, ..Framing::default() }.camera(&points).expect("points")
}

#[test]
fn an_open_point_agrees_with_the_reference() {
    let mut lights = Lights::from(Environment { image: sky(64, 32, |i, j| ((i * 7 + j * 3) % 11) as f32) });
    lights.disks.push(DiskLight {
        direction: DVec3::new(0.3, 0.8, 0.2).normalize(),
        angular_radius: 0.05,
        radiance: [300.0; 3],
    });
    lights.directionals.push(DirectionalLight {
        direction: DVec3::new(-1.0, 1.0, 0.0).normalize(),
        irradiance: [1.0, 2.0, 3.0],
    });
    lights.points.push(PointLight { position: glam::Vec3::new(0.0, 3.0, 1.0), intensity: [9.0, 1.0, 0.0] });
    // Far from everything.
    let mesh =
        shapes::sphere(8).transformed(&glam::Affine3A::from_translation(glam::Vec3::new(0.0, -50.0, 0.0)));
    let bvh = Bvh::build(&mesh);
    let scene = PathScene {
        mesh: &mesh,
        bvh: &bvh,
        materials: &[],
        tint: None,
        lights: &lights,
        offset: PathScene::OFFSET,
    };
    let reference = Reference::new(&lights, Lookup::Constant, &Task::quiet()).expect("sound light");
    let frame = Frame::from_normal(DVec3::new(0.2, 1.0, -0.3).normalize());
    for spec in ["lambert:albedo=0.8/0.5/0.2", "ggx:alpha=0.3", "ggx:alpha=0.05", "ward:ax=0.1,ay=0.4"] {
        for degrees in [10.0_f64, 75.0] {
            let (s, c) = degrees.to_radians().sin_cos();
            let wo = frame.to_world(DVec3::new(0.6 * s, 0.8 * s, c));
            let brdf = brdf(spec);
            let point = PathPoint { position: DVec3::ZERO, frame, wo, brdf: brdf.as_ref() };
            let options = PathOptions { bounces: 1, samples: 20_000, seed: 5 };
            let e = trace_points(&scene, &[point], options, &Task::quiet()).expect("nobody cancels");
            let truth = reference.radiance(brdf.as_ref(), &frame, wo, Some(DVec3::ZERO), 1e-5);
            agrees(&e[0], truth.rgb, &format!("{spec} {degrees}"));
        }
    }
}

/// The inside of a ball of albedo ρ with a point light at its centre: every point receives E = I/R² from it,
/// and reflects ρE/π (1 + ρ + ρ² + …).
#[test]
fn an_integrating_sphere_sums_its_series() {
    let mut mesh: Mesh = shapes::sphere(64);
    mesh.normals.iter_mut().for_each(|n| *n = -*n);
    mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    mesh.tangents.clear();
    let bvh = Bvh::build(&mesh);
    let lights = Lights {
        points: vec![PointLight { position: glam::Vec3::ZERO, intensity: [1.0, 2.0, 0.0] }],
        ..Lights::default()
    };
    let materials = [brdf("lambert:albedo=0.8")];
    let tint = |_: &Surface| [0.625; 3];
    let scene = PathScene {
        mesh: &mesh,
        bvh: &bvh,
        materials: &materials,
        tint: Some(&tint),
        lights: &lights,
        offset: PathScene::OFFSET,
    };
    let camera = Camera::Pinhole {
        from: glam::Vec3::new(0.1, 0.0, 0.0),
        at: glam::Vec3::Z,
        up: glam::Vec3::Y,
        fov_y: 1.0,
    };
    for (bounces, series) in [(1, 1.0), (2, 1.5), (4, 1.875)] {
        let options = PathOptions { bounces, samples: 64, seed: 1 };
        let image = trace_image(&scene, &camera, 4, 4, options, &Task::quiet()).expect("nobody cancels");
        for p in &image.pixels {
            let l = 0.5 / PI * series;
            // The ball is a polyhedron: a few parts in a thousand.
            assert!(
                (p.rgb[0] / l - 1.0).abs() < 6e-3 && (p.rgb[1] / l - 2.0).abs() < 12e-3,
                "{bounces}: {p:?} {l}"
            );
            assert_eq!(p.rgb[2], 0.0);
        }
    }
}

#[test]
fn a_white_furnace_hides_what_reflects_everything() {
    let mesh = shapes::torus(1.0, 0.4, 48);
    let bvh = Bvh::build(&mesh);
    let lights = Lights::from(Environment { image: sky(8, 4, |_, _| 1.0) });
    let materials = [brdf("lambert:albedo=1")];
    let scene = PathScene {
        mesh: &mesh,
        bvh: &bvh,
        materials: &materials,
        tint: None,
        lights: &lights,
        offset: PathScene::OFFSET,
    };
    let camera = cube_seen();
    let options = PathOptions { bounces: 60, samples: 64, seed: 2 };
    let image = trace_image(&scene, &camera, 12, 12, options, &Task::quiet()).expect("nobody cancels");
    let mean = image.pixels.iter().map(|p| p.rgb[0]).sum::<f64>() / 144.0;
    let variance = image.pixels.iter().map(|p| p.variance[0]).sum::<f64>() / (144.0 * 144.0);
    // Light is lost where shading normals differ from the triangles'.
    assert!((mean - 1.0).abs() < 4.5 * variance.sqrt() + 4e-3, "{mean} {variance}");
}

#[test]
fn threads_and_seeds() {
    let mesh = shapes::torus(1.0, 0.4, 16);
    let bvh = Bvh::build(&mesh);
    let lights = Lights::from(Environment { image: sky(8, 4, |i, _| i as f32) });
    let materials: [Arc<_>; 1] = [brdf("ggx:alpha=0.4")];
    let scene = PathScene {
        mesh: &mesh,
        bvh: &bvh,
        materials: &materials,
        tint: None,
        lights: &lights,
        offset: PathScene::OFFSET,
    };
    let camera = cube_seen();
    let trace = |seed| {
        trace_image(&scene, &camera, 6, 5, PathOptions { bounces: 3, samples: 4, seed }, &Task::quiet())
            .expect("nobody cancels")
    };
    assert_eq!(trace(1), trace(1));
    assert_ne!(trace(1), trace(2));
    let stopped = Task::quiet().with_cancel(Arc::new(true.into()));
    assert!(trace_image(&scene, &camera, 6, 5, PathOptions::default(), &stopped).is_err());
}

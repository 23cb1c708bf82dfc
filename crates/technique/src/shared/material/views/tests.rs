use super::*;
use crate::shared::light::distant::DistantLight;
use crate::shared::trials::lights;
use glam::DVec3;
use steradian_light::Lights;
use steradian_prefilter::probe;
use steradian_reference::{Lookup, Reference, ReferencePoint};
use steradian_sphere::Frame;

fn brdf(spec: &str) -> steradian_brdf::SharedBrdf {
    steradian_brdf::parse(spec).unwrap()
}

/// Relative RMS over normals that face `view`, up to `limit` degrees, against the reference.
fn error(spec: &str, lights: &Lights, order: usize, limit: f64) -> f64 {
    let task = Task::quiet();
    let b = brdf(spec);
    let slices = Slices::of_order(&*b, [0.0; 3], order, &task).unwrap();
    let light = DistantLight::bake("views", lights, order, &task).unwrap();
    let view = DVec3::new(0.3, 0.5, -0.8).normalize();
    let image = ViewImage::new(&slices, &light.source().coefficients(order), view);
    let normals = (0..200).map(|k| probe::direction(k, 200));
    let points: Vec<ReferencePoint> = normals
        .filter(|n| n.dot(view) > limit.to_radians().cos())
        .map(|n| ReferencePoint { frame: Frame::from_normal(n), wo: view, position: None })
        .collect();
    let reference = Reference::new(lights, Lookup::Constant, &task).unwrap();
    let exact = reference.radiance_batch(&*b, &points, 1e-3, &task).unwrap();
    let got = points.iter().map(|p| image.towards(steradian_sphere::frame::reflect(view, p.frame.n)));
    probe::relative_rms(got.zip(exact.iter().map(|e| e.rgb)))
}

#[test]
fn an_image_is_the_integral() {
    for (spec, order, bound) in [
        ("lambert:albedo=0.8/0.5/0.2", 32, 1e-3),
        ("phong:n=30", 48, 5e-3),
        ("phong-map:n=10", 32, 1e-3),
        ("ggx:alpha=0.3,f0=0.9/0.6/0.3", 48, 5e-3),
        ("oren-nayar:sigma=0.5", 32, 2e-3),
    ] {
        for lights in [lights::studio(), lights::sunny()] {
            let e = error(spec, &lights, order, 88.0);
            assert!(e < bound, "{spec}: {e}");
        }
    }
}

/// Under constant light nothing but g_00 counts: the albedo.
#[test]
fn the_first_coefficient_is_the_albedo() {
    let slices = Slices::of_order(&*brdf("lambert:albedo=0.5"), [0.0; 3], 16, &Task::quiet()).unwrap();
    for j in [0, 7, 20, 32] {
        let albedo = f64::from(slices.at(j)[0][0]) * (4.0 * PI).sqrt();
        assert!((albedo - 0.5).abs() < 5e-6, "{j}: {albedo}");
    }
}

#[test]
fn the_order_follows_from_the_tolerance_and_lambert_splits_off_whole() {
    let task = Task::quiet();
    let of = |spec| {
        let b = brdf(spec);
        Slices::bake(&*b, lambertian_part(&*b), 0.01, 96, &task).unwrap()
    };
    let (sharp, smooth) = (of("phong-map:n=100"), of("phong-map:n=5"));
    assert!(smooth.order < sharp.order && sharp.missing < 1e-4, "{} {}", smooth.order, sharp.order);
    let lambert = of("lambert:albedo=0.8/0.5/0.2");
    assert!(lambert.g.iter().flatten().all(|g| g.abs() < 1e-7));
    assert!((lambert.diffuse[1] - 0.5 / PI).abs() < 1e-12);
}

use super::*;
use crate::{PointsBuf, find};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use steradian_base::ParamValues;
use steradian_light::DirectionalLight;

fn radiance(lights: &Lights, spec: &str, params: &[(&str, f64)], n: DVec3, wo: DVec3) -> [f64; 3] {
    let material = Material::new(steradian_brdf::parse(spec).unwrap());
    let values: ParamValues = params.iter().copied().collect();
    let t = find("phong-diffuse-maps").unwrap();
    let b = t.draft(lights, &material, None, &values, &Task::quiet()).unwrap();
    let mut q = PointsBuf::default();
    q.push(n.as_vec3(), Vec3::X, wo.as_vec3(), Vec3::ZERO);
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    rgb.map(|p| f64::from(p[0]))
}

/// STAR04 eq. 25 under constant light c: 2π k_s c/(N + 1).
#[test]
fn constant_light_gives_the_integral_of_the_lobe() {
    let n = DVec3::new(0.1, 0.2, 0.9).normalize();
    for exponent in [1.0, 7.5, 100.0, 3000.0] {
        let spec = format!("phong-map:n={exponent},scale=0.5");
        let got = radiance(&lights::furnace(), &spec, &[], n, n)[0];
        let expected = 0.5 * 2.0 * PI / (exponent + 1.0);
        assert!((got - expected).abs() < 1e-4 * expected, "{exponent}: {got} {expected}");
    }
}

/// Eq. 26 under constant light 1: (1 − F) k_d + F k_s 2π/(N + 1).
#[test]
fn the_blend_is_equation_26() {
    let n = DVec3::Z;
    let wo = DVec3::new(0.8, 0.0, 0.6);
    let params = [("k_s", 0.5), ("k_d", 0.7), ("f0", 0.04)];
    let got = radiance(&lights::furnace(), "phong-map:n=20", &params, n, wo)[0];
    let f = 0.04 + 0.96 * 0.4_f64.powi(5);
    let expected = (1.0 - f) * 0.7 + f * 0.5 * 2.0 * PI / 21.0;
    assert!((got - expected).abs() < 1e-3 * expected, "{got} {expected}");
}

/// A directional light of irradiance 1 gives (r·w)^N.
#[test]
fn a_directional_light_gives_the_lobe() {
    let direction = DVec3::new(0.1, 1.0, 0.2).normalize();
    let light = DirectionalLight { direction, irradiance: [1.0; 3] };
    let lights = Lights { directionals: vec![light], ..Lights::default() };
    for tilt in [0.0, 0.1, 0.3] {
        let n = (direction + direction.any_orthonormal_vector() * tilt).normalize();
        let got = radiance(&lights, "phong-map:n=30", &[], n, n)[2];
        let expected = n.dot(direction).powi(30);
        assert!((got - expected).abs() < 0.015, "{tilt}: {got} {expected}");
    }
}

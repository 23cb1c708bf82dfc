use super::*;
use crate::trial::Certified;
use crate::{AnyBake, PointsBuf, find};
use glam::{DVec3, Vec3};
use steradian_base::ParamValues;
use steradian_light::DirectionalLight;

fn bake(lights: &Lights) -> Box<dyn AnyBake> {
    let material = Material::new(steradian_brdf::parse("lambert:albedo=1").unwrap());
    find("sh-irradiance")
        .unwrap()
        .draft(lights, &material, None, &ParamValues::default(), &Task::quiet())
        .unwrap()
}

fn radiance(b: &dyn AnyBake, n: DVec3) -> f64 {
    let mut q = PointsBuf::default();
    q.push(n.as_vec3(), Vec3::X, n.as_vec3(), Vec3::ZERO);
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    f64::from(rgb[0][0])
}

/// Under a unit directional light the nine terms are p(x) = 1/4 + x/2 + (5/32)(3x² − 1), x = n·w (derived
/// from A_l (2l+1)/4π P_l): at most 9.375 % of the peak from ⟨x⟩₊, at x = 0; lowest −0.0396 at x = −8/15.
#[test]
fn a_directional_light_gives_the_polynomial() {
    let direction = DVec3::new(0.3, 0.8, -0.5).normalize();
    let light = DirectionalLight { direction, irradiance: [1.0; 3] };
    let lights = Lights { directionals: vec![light], ..Lights::default() };
    let b = bake(&lights);
    let side = direction.any_orthonormal_vector();
    let mut worst = 0.0_f64;
    for k in 0..=30 {
        let x = -1.0 + k as f64 / 15.0;
        let n = direction * x + side * (1.0 - x * x).sqrt();
        let e = radiance(&*b, n) * std::f64::consts::PI;
        let p = 0.25 + 0.5 * x + 5.0 / 32.0 * (3.0 * x * x - 1.0);
        assert!((e - p).abs() < 1e-6, "{x}: {e} {p}");
        worst = worst.max((e - x.max(0.0)).abs());
    }
    assert!((worst - 0.09375).abs() < 1e-6, "{worst}");
    // The certificate: √(Σ_{l>2} / Σ) of A_l² (2l+1).
    let a = |l: usize| -> f64 {
        [std::f64::consts::PI, 2.0 * std::f64::consts::PI / 3.0, std::f64::consts::PI / 4.0]
            .get(l)
            .map_or(0.0, |a| a * a * (2 * l + 1) as f64)
    };
    // ∫⟨x⟩₊² over the sphere is 2π/3 = Σ A_l² (2l+1)/4π.
    let all = 2.0 * std::f64::consts::PI / 3.0 * 4.0 * std::f64::consts::PI;
    let expected = (1.0 - (a(0) + a(1) + a(2)) / all).sqrt();
    let error = b.certified().error;
    assert!((error - expected).abs() < 0.003, "{error} {expected}");
}

/// A disk is its centre with bands damped; the mean irradiance over all normals is a quarter of the flux.
#[test]
fn a_disk_light_keeps_its_flux() {
    let disk = steradian_light::DiskLight { direction: DVec3::Y, angular_radius: 0.3, radiance: [2.0; 3] };
    let b = bake(&Lights { disks: vec![disk], ..Lights::default() });
    let n = 4000;
    let mean: f64 = (0..n)
        .map(|k| radiance(&*b, steradian_prefilter::probe::direction(k, n)) * std::f64::consts::PI / n as f64)
        .sum();
    let expected = 2.0 * disk.solid_angle() / 4.0;
    assert!((mean - expected).abs() < 1e-4 * expected, "{mean} {expected}");
}

#[test]
fn the_wrong_inputs_say_what_to_do() {
    let t = find("sh_irradiance").unwrap();
    let m = |s| Material::new(steradian_brdf::parse(s).unwrap());
    let e = t.bake(&Lights::default(), &m("ggx:alpha=0.2"), None, &ParamValues::default(), &Task::quiet());
    let e = e.err().unwrap();
    assert_eq!(e.to_string(), "sh_irradiance: takes lambert only, not ggx: use split_sum");
    assert_eq!(e.exit_code(), 2);
    let point = steradian_light::PointLight { position: Vec3::ZERO, intensity: [1.0; 3] };
    let lights = Lights { points: vec![point], ..Lights::default() };
    let e =
        t.bake(&lights, &m("lambert:albedo=1"), None, &ParamValues::default(), &Task::quiet()).err().unwrap();
    assert!(e.to_string().contains("point lights"));
    let e = ParamValues::from_iter([("bands", 3.0)]);
    assert!(t.bake(&Lights::default(), &m("lambert:albedo=1"), None, &e, &Task::quiet()).is_err());
}

/// The light turned by R at shading time is the light turned at bake time.
#[test]
fn turning_the_light_in_a_frame_is_baking_it_turned() {
    let at = |direction| Lights {
        directionals: vec![DirectionalLight { direction, irradiance: [1.0; 3] }],
        ..Lights::default()
    };
    let r = glam::DMat3::from_rotation_z(0.8) * glam::DMat3::from_rotation_x(0.3);
    let d = DVec3::new(0.1, 0.9, 0.4).normalize();
    let mut b = bake(&at(d));
    b.frame(&View { light_rotation: r.as_mat3(), ..View::default() });
    let turned = bake(&at(r * d));
    for k in 0..20 {
        let n = steradian_prefilter::probe::direction(k, 20);
        assert!((radiance(&*b, n) - radiance(&*turned, n)).abs() < 1e-6);
    }
}

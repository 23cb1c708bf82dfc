use super::*;
use crate::{PointsBuf, find};
use glam::{DVec3, Vec3};
use steradian_base::ParamValues;
use steradian_light::{DirectionalLight, DiskLight};

fn radiance(lights: &Lights, task: &Task, at: &[DVec3]) -> Vec<f64> {
    let material = Material::new(steradian_brdf::parse("lambert:albedo=1").unwrap());
    let t = find("diffuse_map").unwrap();
    let b = t.draft(lights, &material, None, &ParamValues::default(), task).unwrap();
    let mut q = PointsBuf::default();
    at.iter().for_each(|n| q.push(n.as_vec3(), Vec3::X, n.as_vec3(), Vec3::ZERO));
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; at.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    rgb[1].iter().map(|x| f64::from(*x)).collect()
}

/// A directional light of irradiance 1 gives ⟨n·w⟩/π; unlike nine coefficients, nothing below zero behind it.
#[test]
fn a_directional_light_gives_the_clamped_cosine() {
    let direction = DVec3::new(0.2, -0.7, 0.5).normalize();
    let light = DirectionalLight { direction, irradiance: [1.0; 3] };
    let lights = Lights { directionals: vec![light], ..Lights::default() };
    let n: Vec<_> = (0..500).map(|k| steradian_prefilter::probe::direction(k, 500)).collect();
    let got = radiance(&lights, &Task::quiet(), &n);
    let expected = |n: &DVec3| n.dot(direction).max(0.0) / std::f64::consts::PI;
    let square: f64 = n.iter().zip(&got).map(|(n, g)| (g - expected(n)).powi(2)).sum();
    let all: f64 = n.iter().map(|n| expected(n).powi(2)).sum();
    assert!((square / all).sqrt() < 3e-3, "{}", (square / all).sqrt());
    assert!(got.iter().all(|x| *x >= 0.0));
}

/// A disk of half angle ρ and radiance 1 overhead: E = π sin²ρ.
#[test]
fn a_disk_overhead_gives_pi_sin_squared() {
    for rho in [0.00465, 0.1, 0.8] {
        let disk = DiskLight { direction: DVec3::Y, angular_radius: rho, radiance: [1.0; 3] };
        let lights = Lights { disks: vec![disk], ..Lights::default() };
        let got = radiance(&lights, &Task::quiet(), &[DVec3::Y])[0];
        let expected = rho.sin().powi(2);
        assert!((got - expected).abs() < 2e-3 * expected, "{rho}: {got} {expected}");
    }
}

/// A tighter tolerance makes a finer map.
#[test]
fn the_tolerance_is_an_argument() {
    let n: Vec<_> = (0..64).map(|k| steradian_prefilter::probe::direction(k, 64)).collect();
    let at = |tolerance| radiance(&lights::studio(), &Task::quiet().with_tolerance(Some(tolerance)), &n);
    let (exact, coarse, fine) = (at(2e-4), at(0.03), at(2e-3));
    let error = |a: &[f64]| {
        let e: f64 = a.iter().zip(&exact).map(|(x, y)| (x - y).powi(2)).sum();
        (e / exact.iter().map(|y| y * y).sum::<f64>()).sqrt()
    };
    assert!(error(&coarse) < 0.03 && error(&fine) < 2.5e-3 && error(&fine) < error(&coarse));
}

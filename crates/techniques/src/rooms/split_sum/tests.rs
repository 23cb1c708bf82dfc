use super::*;
use crate::{AnyBake, PointsBuf, find};
use glam::{DVec3, Vec3};
use steradian_base::ParamValues;
use steradian_light::DirectionalLight;

fn bake(lights: &Lights, spec: &str, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    let material = Material::new(steradian_brdf::parse(spec).unwrap());
    let values: ParamValues = params.iter().copied().collect();
    find("split-sum").unwrap().draft(lights, &material, None, &values, &Task::quiet()).unwrap()
}

fn radiance(b: &dyn AnyBake, n: DVec3, wo: DVec3) -> [f64; 3] {
    let mut q = PointsBuf::default();
    q.push(n.as_vec3(), Vec3::X, wo.as_vec3(), Vec3::ZERO);
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    rgb.map(|p| f64::from(p[0]))
}

/// With f0 = 1 nothing is absorbed, and multiple scattering gives back all that single scattering loses.
#[test]
fn multiple_scattering_closes_the_white_furnace() {
    for alpha in [0.09, 0.49, 1.0] {
        let spec = format!("ggx:alpha={alpha},f0=1");
        let (single, multiple) =
            (bake(&lights::furnace(), &spec, &[]), bake(&lights::furnace(), &spec, &[("multiscatter", 1.0)]));
        for cosine in [1.0f64, 0.5, 0.1] {
            let wo = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
            let (s, m) = (radiance(&*single, DVec3::Z, wo)[0], radiance(&*multiple, DVec3::Z, wo)[0]);
            assert!(s < 1.0 - 0.01 * alpha && (m - 1.0).abs() < 2e-3, "{alpha} {cosine}: {s} {m}");
        }
    }
}

/// Levels at perceptual roughness k/(levels − 1) hold the kernel itself: a directional light of irradiance 1
/// shows it. At the peak K = D(1)/4/∫.
#[test]
fn a_level_of_the_chain_holds_the_kernel() {
    use steradian_prefilter::{GgxMirror, Zonal};
    let direction = DVec3::new(0.3, 0.2, 0.9).normalize();
    let light = DirectionalLight { direction, irradiance: [1.0; 3] };
    let lights = Lights { directionals: vec![light], ..Lights::default() };
    // Perceptual roughness 2/4: alpha = 0.25, f0 = 1, and at n = wo A + B is the albedo.
    let b = bake(&lights, "ggx:alpha=0.25,f0=1", &[("levels", 5.0)]);
    let albedo = steradian_brdf::dfg::ggx(1.0, 0.25);
    let kernel = GgxMirror::new(0.25);
    let peak = kernel.value(1.0) * (albedo.scale + albedo.bias);
    for tilt in [0.0, 0.1, 0.4] {
        let n = (direction + direction.any_orthonormal_vector() * tilt).normalize();
        let got = radiance(&*b, n, n)[0];
        let expected = kernel.value(n.dot(direction)) * (albedo.scale + albedo.bias);
        assert!((got - expected).abs() < 0.02 * peak, "{tilt}: {got} {expected}");
    }
}

#[test]
fn what_it_refuses_says_why() {
    let t = find("split_sum").unwrap();
    let refused = |spec: &str| (t.card().materials)(&*steradian_brdf::parse(spec).unwrap()).unwrap_err();
    assert!(refused("ggx:ax=0.1,ay=2").contains("up to 1"));
    assert!(refused("ggx:alpha=2").contains("up to 1"));
    assert!(refused("lambert:albedo=1").contains("sh_irradiance"));
}

use crate::local::{Content, LocalBake, Place, Plane};
use crate::shared::trials::specimens;
use crate::trial::local::{self, direction, single};
use crate::{Material, find_local};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::{ParamValues, Task};
use steradian_relight::polynomial::{Basis, evaluate};
use steradian_scene::surface::Planes;

fn bake(spec: &str, planes: Planes) -> Box<dyn LocalBake> {
    local::bake("polynomial_texture_map", spec, planes)
}

/// Without a map: the closed form of Lambert's law, off by an eighth of its RMS over lights uniform on the
/// hemisphere.
#[test]
fn lambert_has_its_closed_form() {
    let b = bake("lambert:albedo=0.8", Planes::default());
    let (mut squares, mut energy) = (0.0, 0.0);
    for k in 1..4000 {
        let wi = direction(k, 0.0);
        let want = 0.8 / PI * (9.0 / 8.0 - 15.0 / 16.0 * (1.0 - wi.z * wi.z));
        let got = f64::from(b.f_cos(single(wi), [0.0, 0.6, 0.8])[1]);
        assert!((got - want).abs() < 2e-3, "{k}: {got} {want}");
        squares += (got - 0.8 / PI * wi.z).powi(2);
        energy += (0.8 / PI * wi.z).powi(2);
    }
    assert!(((squares / energy).sqrt() - 0.125).abs() < 2e-3);
    assert!((b.certificate().error - 0.125).abs() < 0.01, "{}", b.certificate().error);
}

/// Shading evaluates a map's polynomials, clamped at 0, whatever the view; the mean over a footprint is that
/// of the coefficients.
#[test]
fn maps_are_evaluated_as_they_are() {
    let planes = specimens::planes(&[Plane::new("map", Content::Polynomials)]);
    let b = bake("lambert", planes);
    assert!(b.certificate().error < 1e-5, "{}", b.certificate().error);
    let side = specimens::SIDE as f64;
    for k in 0..300u32 {
        let (i, j) = ((7 * k % 48) as usize, (11 * k % 48) as usize);
        let uv = [(i as f64 + 0.5) / side, (j as f64 + 0.5) / side].map(|x| x as f32);
        let wi = direction(k, 0.01);
        let got = b.f_cos_at(Place { uv, footprint: 0.0 }, single(wi), single(direction(3 * k, 0.1)));
        for c in 0..3 {
            let all = specimens::polynomial(i, j);
            let a: [f64; 6] = std::array::from_fn(|k| all[k][c]);
            assert!((f64::from(got[c]) - evaluate(&a, wi).max(0.0) / PI).abs() < 1e-6, "{k}");
        }
        assert_eq!(b.f_cos_at(Place { uv, footprint: 0.0 }, single(-wi), [0.0, 0.0, 1.0]), [0.0; 3]);
    }
    let mean = b.f_cos_at(Place { uv: [0.5; 2], footprint: 1.0 }, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0]);
    let all = (0..48 * 48).map(|k| specimens::polynomial(k % 48, k / 48)[5][0]).sum::<f64>() / (48.0 * 48.0);
    assert!((f64::from(mean[0]) - all / PI).abs() < 1e-5);
}

fn bake_with(basis: &str, spec: &str, planes: Planes) -> Box<dyn LocalBake> {
    let t = find_local("polynomial_texture_map").expect("a technique");
    let params = ParamValues::parse(basis, t.params()).expect("parameters");
    let m = Material::new(steradian_brdf::parse(spec).expect("a spec")).with_textures(planes);
    t.bake(&m, None, &params, &Task::quiet()).expect("bakes")
}

/// Lambert's law is among the harmonics, and they follow other dependence on the light more closely than the
/// parabola.
#[test]
fn harmonics_follow_the_light_more_closely() {
    for basis in ["basis=sh9", "basis=sh16"] {
        let b = bake_with(basis, "lambert:albedo=0.8", Planes::default());
        assert!(b.certificate().error < 1e-5, "{basis}: {}", b.certificate().error);
        for k in 1..400 {
            let wi = direction(k, 0.0);
            let got = f64::from(b.f_cos(single(wi), [0.0, 0.6, 0.8])[1]);
            assert!((got - 0.8 / PI * wi.z).abs() < 1e-6, "{basis}: {k}: {got}");
        }
    }
    // Seen along its normal, under lights uniform on the hemisphere.
    let off = |basis: &str| {
        let spec = "blinn-phong-gl:kd=0.3,ks=0.5,n=10";
        let (b, brdf) =
            (bake_with(basis, spec, Planes::default()), steradian_brdf::parse(spec).expect("a spec"));
        let (mut squares, mut energy) = (0.0, 0.0);
        for k in 1..2000 {
            let (wi, up) = (direction(k, 0.0), DVec3::Z);
            let want = brdf.f_cos(wi, up)[0];
            squares += (f64::from(b.f_cos(single(wi), single(up))[0]) - want).powi(2);
            energy += want * want;
        }
        (squares / energy).sqrt()
    };
    let [six, nine, sixteen] = Basis::NAMES.map(|name| off(&format!("basis={name}")));
    println!("six {six:.4}, nine {nine:.4}, sixteen {sixteen:.4}");
    assert!(sixteen < 0.2 * nine && nine < six, "{six} {nine} {sixteen}");
}

/// Planes of harmonics are evaluated as they are; too few of them are refused.
#[test]
fn harmonics_of_maps_are_evaluated_as_they_are() {
    let side = specimens::SIDE as f64;
    let planes = specimens::planes(&[Plane::new("map", Content::Polynomials)]);
    for (basis, terms) in [("basis=sh9", 9), ("basis=sh16", 16)] {
        let b = bake_with(basis, "lambert", planes.clone());
        assert!(b.certificate().error < 1e-5, "{}", b.certificate().error);
        for k in 0..200u32 {
            let (i, j) = ((7 * k % 48) as usize, (11 * k % 48) as usize);
            let uv = [(i as f64 + 0.5) / side, (j as f64 + 0.5) / side].map(|x| x as f32);
            let (wi, all) = (direction(k, 0.01), specimens::polynomial(i, j));
            let got = b.f_cos_at(Place { uv, footprint: 0.0 }, single(wi), [0.0, 0.0, 1.0]);
            for c in 0..3 {
                let a: [f64; 16] = std::array::from_fn(|k| if k < terms { all[k][c] } else { 0.0 });
                assert!((f64::from(got[c]) - evaluate(&a, wi).max(0.0) / PI).abs() < 1e-6, "{basis}: {k}");
            }
        }
    }
    let mut six = Planes::default();
    for k in 0..6 {
        six = six.with(&format!("map.{k}"), specimens::texture(|_, _| [0.5; 3]));
    }
    let t = find_local("polynomial_texture_map").expect("a technique");
    let params = ParamValues::parse("basis=sh9", t.params()).expect("parameters");
    let m = Material::new(steradian_brdf::parse("lambert").expect("a spec")).with_textures(six);
    let e = t.bake(&m, None, &params, &Task::quiet()).err().expect("refused").to_string();
    assert!(e.contains("basis=sh9 needs 9 planes, not 6"), "{e}");
}

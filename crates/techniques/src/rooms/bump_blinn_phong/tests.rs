use crate::local::{LocalBake, Place};
use crate::shared::surface::bumps::{HEIGHT, NORMAL};
use crate::shared::trials::specimens;
use crate::trial::local::{direction, single};
use crate::{BakeError, Material, find_local};
use glam::Vec3;
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::{ParamValues, Task, Value};
use steradian_scene::surface::{Planes, Texture};

const SPEC: &str = "blinn-phong-gl:kd=0.5,ks=0.4,n=40";

fn try_bake(
    spec: &str,
    planes: Planes,
    params: &[(&'static str, Value)],
) -> Result<Box<dyn LocalBake>, BakeError> {
    let t = find_local("bump_blinn_phong").expect("a technique");
    let params: ParamValues = params.iter().cloned().collect();
    let material = Material::new(steradian_brdf::parse(spec).expect("a spec")).with_textures(planes);
    t.bake(&material, None, &params, &Task::quiet())
}

fn bake(spec: &str, planes: Planes, params: &[(&'static str, Value)]) -> Box<dyn LocalBake> {
    try_bake(spec, planes, params).expect("bakes")
}

fn bumpy() -> Planes {
    Planes::default().with(HEIGHT, specimens::texture(|i, j| [specimens::height(i, j); 3]))
}

/// Heights of 0, or of any one value, shade the bits of no heights, which are the equation's numbers.
#[test]
fn flat_heights_are_no_bumps() {
    let flat = Planes::default().with(HEIGHT, Arc::new(Texture::constant([0.0; 3])));
    let high = Planes::default().with(HEIGHT, specimens::texture(|_, _| [0.7; 3]));
    let none = bake(SPEC, Planes::default(), &[]);
    let all = [bake(SPEC, flat, &[]), bake(SPEC, high, &[])];
    let brdf = steradian_brdf::parse(SPEC).expect("a spec");
    for k in 0..300 {
        let (wi, wo) = (direction(3 * k, 0.01), direction(7 * k + 1, 0.05));
        let at = Place { uv: [0.13 * k as f32, 0.77 * k as f32], footprint: 0.01 * (k % 40) as f32 };
        let of = |b: &dyn LocalBake| b.f_cos_at(at, single(wi), single(wo));
        let got = of(&*none);
        for b in &all {
            assert_eq!(of(&**b).map(f32::to_bits), got.map(f32::to_bits), "{k}");
        }
        for (a, b) in got.iter().zip(brdf.f_cos(wi, wo)) {
            assert!((f64::from(*a) - b).abs() < 1e-6 * (1.0 + b), "{k}: {a} {b}");
        }
    }
    assert!(none.certificate().error < 1e-6 && none.normals().is_none() && all[1].normals().is_some());
}

/// The mean of the diffuse part over 2 × 2 texels is the filtered one, where none of them turns away, with
/// either of two ways of filtering the highlight.
#[test]
fn the_diffuse_part_filters_exactly() {
    let side = specimens::SIDE as f32;
    for filter in ["covariance", "toksvig"] {
        let b = bake("lambert:albedo=0.8", bumpy(), &[("filter", filter.into())]);
        for k in 0..200u32 {
            let (wi, wo) = (direction(3 * k, 0.8), direction(5 * k, 0.3));
            let [i, j] = [(7 * k) % 24, (11 * k) % 24].map(|x| 2.0 * x as f32);
            let at = |x: f32, y: f32, footprint: f32| {
                let place = Place { uv: [(i + x) / side, (j + y) / side], footprint };
                b.f_cos_at(place, single(wi), single(wo))[1]
            };
            let texels = [at(0.5, 0.5, 0.0), at(1.5, 0.5, 0.0), at(0.5, 1.5, 0.0), at(1.5, 1.5, 0.0)];
            let mean = texels.iter().sum::<f32>() / 4.0;
            let filtered = at(1.0, 1.0, 2.0 / side);
            assert!(
                texels.iter().all(|x| *x > 0.0) && (filtered - mean).abs() < 2e-6,
                "{k}: {filtered} {mean}"
            );
        }
    }
}

/// Filtered highlights of blocks of 4 × 4 texels: `covariance` has the smallest error, `mean` the largest.
#[test]
fn covariances_filter_highlights_best() {
    let error = |filter: &str| {
        let b = bake("blinn-phong-gl:n=60", bumpy(), &[("filter", filter.into()), ("relief", 0.04.into())]);
        b.certificate().figure("error over 4 x 4 texels").expect("measured")
    };
    let [covariance, toksvig, mean] = ["covariance", "toksvig", "mean"].map(error);
    println!("highlight of 4 x 4 texels: covariance {covariance:.3}, toksvig {toksvig:.3}, mean {mean:.3}");
    assert!(covariance < 0.8 * toksvig && toksvig < mean && covariance < 0.25);
}

/// Kilgard's ramp is half at n·l = 1/16, whole from 1/8 on; both end at the surface's own horizon.
#[test]
fn self_shadowing_is_a_step_or_a_ramp() {
    let [step, ramp] = ["step", "ramp"].map(|s| bake("lambert", bumpy(), &[("self_shadow", s.into())]));
    for k in 0..50 {
        let at = Place { uv: [0.1 * k as f32, 0.3], footprint: 0.0 };
        let of = |b: &dyn LocalBake, z: f32| {
            let (s, phi) = ((1.0 - z * z).sqrt(), k as f32);
            b.f_cos_at(at, [s * phi.cos(), s * phi.sin(), z], [0.0, 0.0, 1.0])[0]
        };
        assert!((of(&*ramp, 0.0625) - 0.5 * of(&*step, 0.0625)).abs() < 1e-6);
        assert_eq!(of(&*ramp, 0.5), of(&*step, 0.5));
        assert_eq!((of(&*step, -0.01), of(&*ramp, -0.01)), (0.0, 0.0));
    }
}

/// A normal map replaces the normals of the heights, and other light is shaded with it too.
#[test]
fn normal_maps_are_taken_as_they_are() {
    let n = Vec3::new(0.3, -0.4, 0.8).normalize();
    let tilted = Arc::new(Texture::constant(n.to_array()));
    let b = bake("lambert", bumpy().with(NORMAL, tilted), &[]);
    let wi = direction(5, 0.7);
    let got = b.f_cos_at(Place { uv: [0.2, 0.9], footprint: 0.0 }, single(wi), [0.0, 0.0, 1.0])[0];
    assert!((f64::from(got) - n.as_dvec3().dot(wi) / PI).abs() < 1e-6);
    let map = b.normals().expect("normals");
    assert!((map.sample(glam::Vec2::ZERO, 0.0).mean - n).length() < 1e-6);
}

#[test]
fn other_models_and_heights_without_numbers_are_refused() {
    let why = try_bake("ggx:alpha=0.3", Planes::default(), &[]).err().expect("refused").to_string();
    assert!(why.contains("takes blinn-phong-gl and lambert, not ggx"), "{why}");
    let broken = specimens::texture(|i, j| [if (i, j) == (3, 5) { f64::NAN } else { 0.0 }; 3]);
    let why = try_bake(SPEC, Planes::default().with(HEIGHT, broken), &[]).err().expect("refused").to_string();
    assert!(why.contains("height of texel (3, 5) is not finite"), "{why}");
}

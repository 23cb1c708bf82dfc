//! Tests of the bumps' shadows; those of reflections between bumps are in `bounces`.

mod bounces;

use crate::local::{LocalBake, Place};
use crate::shared::surface::bumps::HEIGHT;
use crate::shared::trials::specimens::{self, SIDE};
use crate::trial::local::{direction, single};
use crate::{Material, find_local};
use glam::DVec3;
use std::sync::Arc;
use steradian_base::{ParamValues, Task, Value};
use steradian_scene::surface::{Planes, Texture};

fn bake(spec: &str, planes: Planes, params: &[(&'static str, Value)]) -> Box<dyn LocalBake> {
    let t = find_local("bump_horizon").expect("a technique");
    let params: ParamValues = params.iter().cloned().collect();
    let material = Material::new(steradian_brdf::parse(spec).expect("a spec")).with_textures(planes);
    t.bake(&material, None, &params, &Task::quiet()).expect("bakes")
}

fn heights(f: impl Fn(usize, usize) -> f64) -> Planes {
    Planes::default().with(HEIGHT, specimens::texture(|i, j| [f(i, j); 3]))
}

fn detail(b: &dyn LocalBake, name: &str) -> f64 {
    b.certificate().figure(name).expect("measured")
}

/// Heights of 0 shade the bits of no heights, which are the model's own, whatever the horizon is kept as.
#[test]
fn flat_heights_are_no_bumps() {
    let spec = "ggx:alpha=0.3,f0=0.9/0.5/0.2";
    let (none, brdf) = (bake(spec, Planes::default(), &[]), steradian_brdf::parse(spec).expect("a spec"));
    for shadow in ["horizon", "ellipse", "none"] {
        let flat = Planes::default().with(HEIGHT, Arc::new(Texture::constant([0.0; 3])));
        let flat = bake(spec, flat, &[("shadow", shadow.into())]);
        for k in 0..200 {
            let (wi, wo) = (direction(3 * k, 0.001), direction(7 * k + 1, 0.002));
            let at = Place { uv: [0.13 * k as f32, 0.77 * k as f32], footprint: 0.01 * (k % 40) as f32 };
            let of = |b: &dyn LocalBake| b.f_cos_at(at, single(wi), single(wo));
            let got = of(&*none);
            assert_eq!(of(&*flat).map(f32::to_bits), got.map(f32::to_bits), "{shadow}: {k}");
            let exact = brdf.f_cos(wi.as_vec3().as_dvec3(), wo.as_vec3().as_dvec3());
            for (a, b) in got.iter().zip(exact) {
                assert!((f64::from(*a) - b).abs() < 1e-5 * (1e-3 + b), "{k}: {a} {b}");
            }
        }
    }
}

/// A symmetric groove's horizon is an ellipse: across it light arrives from the slope to its rim on, along it
/// all light does.
#[test]
fn a_grooves_ellipse_is_exact() {
    // Rims at column 0, the bottom in the middle: slope 1 with a relief of a half.
    let groove = |i: usize, _: usize| (2.0 * i as f64 / SIDE as f64 - 1.0).abs();
    let at = Place { uv: [(0.5 * SIDE as f32 + 0.5) / SIDE as f32, 0.3], footprint: 0.0 };
    for shadow in ["ellipse", "horizon"] {
        let params = [("shadow", shadow.into()), ("relief", 0.5.into()), ("azimuths", 64.0.into())];
        let b = bake("lambert", heights(groove), &params);
        let lit = |x: f64, y: f64| {
            let z = (1.0 - x * x - y * y).sqrt();
            // The bottom's normal is the surface's own.
            b.f_cos_at(at, single(DVec3::new(x, y, z)), [0.0, 0.0, 1.0])[0] > 0.0
        };
        let mut wrong = 0;
        for k in 0..2000u32 {
            let d = direction(k, 0.02);
            // Semi-axes 1/√2 across and 1 along: x²(1 + t²) + y² ≤ 1, t = 1.
            let inside = 2.0 * d.x * d.x + d.y * d.y;
            if (inside - 1.0).abs() > 0.02 {
                wrong += u32::from(lit(d.x, d.y) != (inside < 1.0));
            }
        }
        assert_eq!(wrong, 0, "{shadow}");
    }
}

/// A light whose disk the horizon halves is half seen, and hard light is all or nothing.
#[test]
fn wide_lights_have_soft_edges() {
    let wall = |i: usize, _: usize| if i == 40 { 1.0 } else { 0.0 };
    // Ten texels from the wall, as high as that.
    let relief = 10.0 / SIDE as f64;
    let at = Place { uv: [30.5 / SIDE as f32, 0.5 / SIDE as f32], footprint: 0.0 };
    let of = |width: f64, degrees: f64| {
        let params = [("width", width.into()), ("relief", relief.into()), ("azimuths", 64.0.into())];
        let b = bake("lambert", heights(wall), &params);
        let (s, c) = degrees.to_radians().sin_cos();
        f64::from(b.f_cos_at(at, [c as f32, 0.0, s as f32], [0.0, 0.0, 1.0])[0]) * std::f64::consts::PI / s
    };
    assert!((of(5.0, 45.0) - 0.5).abs() < 1e-3, "{}", of(5.0, 45.0));
    assert!((of(5.0, 50.1) - 1.0).abs() < 1e-5 && of(5.0, 39.9) == 0.0);
    assert!((of(0.0, 45.1) - 1.0).abs() < 1e-5 && of(0.0, 44.9) == 0.0);
    // 1 − (acos ½ − ½ √¾)/π of the disk is above a chord at half its radius.
    assert!((of(4.0, 47.0) - (1.0 - (1.0 / 3.0 - 0.75f64.sqrt() / std::f64::consts::TAU))).abs() < 1e-3);
}

/// More azimuths, fewer texels lit wrongly; the certificate says so.
#[test]
fn azimuths_converge_to_rays() {
    let of = |n: f64| {
        let b =
            bake("lambert", heights(specimens::height), &[("azimuths", n.into()), ("relief", 0.15.into())]);
        (detail(&*b, "lit wrongly"), b.certificate().error)
    };
    let (few, many) = (of(8.0), of(64.0));
    println!("8 azimuths: {few:?}, 64: {many:?}");
    assert!(many.0 < 0.3 * few.0 && many.1 < 0.6 * few.1 && few.0 < 0.05, "{few:?} {many:?}");
}

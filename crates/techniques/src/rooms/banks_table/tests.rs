use super::shade;
use super::table::{Model, Table};
use crate::local::LocalTechnique;
use crate::{Material, find_local};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::{ParamValues, Task};

const HAIR: Model = Model { n: 60.0, diffuse: [0.0; 3], specular: [1.0; 3] };

/// A direction of sin a = w·t, as high above the surface as it can be.
fn at(a: f64) -> [f32; 3] {
    [a.sin() as f32, 0.0, a.cos() as f32]
}

/// Largest error of cosᴺ(a + b)₊ between entries, over sines |l·t| ≤ `most`.
fn worst(t: &Table, most: f64) -> f64 {
    let count = 1500;
    let place = |k: usize| PI * ((k as f64 + 0.37) / f64::from(count as u32) - 0.5);
    let mut worst = 0.0_f64;
    for i in (0..count).filter(|i| place(*i).sin().abs() <= most) {
        // Around the ridge, and off it.
        for off in [0.0, 0.003, 0.01, 0.05, 0.13, 0.2, 0.4] {
            let (a, b) = (place(i), off - place(i));
            if b.abs() >= 0.5 * PI {
                continue;
            }
            let got = shade::f_cos(t, at(a), at(b)).map(f64::from)[0] / f64::from(at(a)[2]);
            worst = worst.max((got - (a + b).cos().max(0.0).powf(t.model.n)).abs());
        }
    }
    worst
}

/// Over angles the error is at most N h²/4 everywhere; over cosines it is 0.1 and more near |l·t| = 1.
#[test]
fn the_coordinate_decides_the_error() {
    let bound = |n: usize| 60.0 * (PI / (n - 1) as f64).powi(2) / 4.0;
    let of = |n, angles| worst(&Table::new(HAIR, n, angles), 1.0);
    for n in [128, 256] {
        let error = of(n, true);
        assert!(error <= 1.01 * bound(n) && error > 0.5 * bound(n), "{n}: {error:.2e}, {:.2e}", bound(n));
    }
    assert!((bound(256) - 2.28e-3).abs() < 1e-5);
    let (all, inner) = (of(256, false), worst(&Table::new(HAIR, 256, false), 0.9));
    assert!((0.15..0.25).contains(&all), "{all}");
    assert!(inner < 0.1 * all, "{inner}");
}

/// Entries on b = −a are 1, and between them the highlight is lower by no more than the bound.
#[test]
fn the_ridge_is_one() {
    let t = Table::new(HAIR, 256, true);
    for k in 0..256 {
        assert_eq!(t.grid.entry(k, 255 - k)[1], 1.0, "{k}");
    }
    let least = 1.0 - 60.0 * (PI / 255.0).powi(2) / 4.0;
    for k in 1..400 {
        let a = PI * (f64::from(k) / 400.0 - 0.5);
        let got = f64::from(shade::f_cos(&t, at(a), at(-a))[0] / at(a)[2]);
        assert!((least - 1e-5..=1.0 + 1e-6).contains(&got), "{a}: {got}");
    }
}

/// The diffuse part of eq. 33, and the whole in the local frame, against the formula.
#[test]
fn both_parts_are_those_of_the_equation() {
    let material = Material::new(steradian_brdf::parse("banks:n=30,scale=0.5").expect("a spec"));
    let t = find_local("banks_table").expect("a technique");
    let params: ParamValues = [("kd", 0.3)].into_iter().collect();
    let b = t.bake(&material, None, &params, &Task::quiet()).expect("bakes");
    assert!(b.certificate().error <= 1e-3, "{:?}", b.certificate());
    for k in 0..500 {
        let of = |j: usize, low: f64| {
            let (z, phi) = (low + (1.0 - low) * ((k * j) as f64 * 0.618).fract(), (k * j) as f64);
            let s = (1.0 - z * z).sqrt();
            DVec3::new(s * phi.cos(), s * phi.sin(), z)
        };
        let (wi, wo) = (of(3, 0.01), of(7, 0.05));
        let (a, b_) = (wi.x.asin(), wo.x.asin());
        let exact = wi.z * (0.3 * a.cos() + 0.5 * (a + b_).cos().max(0.0).powf(30.0));
        let got = b.f_cos(wi.as_vec3().to_array(), wo.as_vec3().to_array()).map(f64::from);
        assert!((got[1] - exact).abs() < 1.5e-3, "{k}: {got:?} {exact}");
    }
}

#[test]
fn other_fibres_are_refused_by_name() {
    for (spec, part) in [("kajiya-kay:s=9", "from above the surface"), ("lambert", "takes banks only")] {
        let brdf = steradian_brdf::parse(spec).expect(spec);
        let why = (super::BanksTable::CARD.materials)(&*brdf).expect_err("refused");
        assert!(why.contains(part), "{why}");
    }
}

use super::bake::covariance;
use crate::local::{LocalBake, Place};
use crate::shared::surface::bumps::HEIGHT;
use crate::shared::trials::specimens;
use crate::trial::local::{self, direction, single};
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_scene::surface::{Planes, Texture};

const SPECS: [&str; 6] = [
    "ward:ax=0.15,ay=0.4,rs=0.3,rd=0.4",
    "ward:ax=0.15,ay=0.4,rs=0.3,rd=0.4,variant=duer",
    "ward:ax=0.15,ay=0.4,rs=0.3,rd=0.4,variant=1992",
    "ggx:ax=0.2,ay=0.4,f0=0.9/0.7/0.4",
    "blinn-phong-gl:kd=0.5,ks=0.4,n=20",
    "lafortune:cx=-0.95,cy=-0.7,cz=0.9,n=15,ks=0.5/0.4/0.2,kd=0.3",
];

fn bake(spec: &str, planes: Planes) -> Box<dyn LocalBake> {
    local::bake("shift_variant", spec, planes)
}

fn constant(v: [f64; 3]) -> Arc<Texture> {
    Arc::new(Texture::constant(v.map(|x| x as f32)))
}

/// Constant textures are the plain model, the reflectance crate's own formula.
#[test]
fn constant_textures_are_the_plain_model() {
    for spec in SPECS {
        let brdf = steradian_brdf::parse(spec).expect("a spec");
        let b = bake(spec, Planes::default());
        assert!(b.certificate().error < 1e-5, "{spec}: {}", b.certificate().error);
        for k in 0..500 {
            let (wi, wo) = (direction(3 * k, 0.02), direction(7 * k + 1, 0.02));
            let at = Place { uv: [0.3, 0.1 * k as f32], footprint: 0.01 * k as f32 };
            let got = b.f_cos_at(at, single(wi), single(wo));
            for (a, want) in got.iter().zip(brdf.f_cos(wi, wo)) {
                assert!((f64::from(*a) - want).abs() < 2e-5 * (0.1 + want), "{spec}: {k}: {a} {want}");
            }
        }
    }
    let same = Planes::default()
        .with("widths", constant([0.2, 0.4, 0.0]))
        .with("specular", constant([0.9, 0.7, 0.4]))
        .with(HEIGHT, constant([0.3; 3]));
    let (plain, textured) = (bake(SPECS[3], Planes::default()), bake(SPECS[3], same));
    for k in 0..100 {
        let (wi, wo) = (single(direction(3 * k, 0.02)), single(direction(7 * k + 1, 0.02)));
        for (a, b) in plain.f_cos(wi, wo).iter().zip(textured.f_cos(wi, wo)) {
            assert!((a - b).abs() <= 1e-5 * (0.1 + a), "{k}: {a} {b}");
        }
    }
}

/// With equal widths the tangent has no effect, and a tangent turned by 90° with the widths swapped gives the
/// same bits.
#[test]
fn tangents_are_what_widths_make_of_them() {
    let at = Place::default();
    let of = |ax: f64, ay: f64, tangent: f64, spec: &str| {
        let planes =
            Planes::default().with("widths", constant([ax, ay, 0.0])).with("tangent", constant([tangent; 3]));
        bake(spec, planes)
    };
    for spec in &SPECS[..4] {
        let (round, turned) = (of(0.25, 0.25, 0.0, spec), of(0.25, 0.25, 0.3125, spec));
        let (one, swapped) = (of(0.25, 0.125, 0.1875, spec), of(0.125, 0.25, 0.6875, spec));
        let line = of(0.25, 0.125, 1.1875, spec);
        for k in 0..200 {
            let (wi, wo) = (single(direction(3 * k, 0.02)), single(direction(7 * k + 1, 0.02)));
            let bits = |b: &dyn LocalBake| b.f_cos_at(at, wi, wo).map(f32::to_bits);
            assert_eq!(bits(&*round), bits(&*turned), "{spec}: {k}");
            assert_eq!(bits(&*one), bits(&*swapped), "{spec}: {k}");
            assert_eq!(bits(&*one), bits(&*line), "{spec}: {k}");
        }
    }
    let [xx, xy, yy] = covariance([0.3, 0.3], 0.77);
    assert_eq!((xx, xy, yy), (0.5 * 0.3 * 0.3, 0.0, 0.5 * 0.3 * 0.3));
}

/// All that varies, against the models about the texels' normals and tangents; the certificate tries every
/// texel.
#[test]
fn texels_are_the_model_with_their_numbers() {
    for spec in SPECS {
        let exponents = spec.starts_with("blinn") || spec.starts_with("lafortune");
        let widths = |i: usize, j: usize| match exponents {
            true => [5.0 + ((i + j) % 30) as f64; 3],
            false => [0.1 + 0.01 * (i % 20) as f64, 0.2 + 0.01 * (j % 30) as f64, 0.0],
        };
        let planes = Planes::default()
            .with(HEIGHT, specimens::texture(|i, j| [specimens::height(i, j); 3]))
            .with("widths", specimens::texture(widths))
            .with("tangent", specimens::texture(|i, j| [((i * j) % 48) as f64 / 48.0; 3]))
            .with("lobe", specimens::texture(|i, j| [-1.0 + 0.01 * i as f64, 0.5 - 0.02 * j as f64, 0.9]))
            .with("specular", specimens::texture(|i, _| [0.3, 0.01 * i as f64, 0.5]))
            .with("albedo", specimens::texture(|_, j| [0.02 * j as f64 % 0.9, 0.1, 0.4]));
        let b = bake(spec, planes);
        assert!(b.certificate().error < 2e-4, "{spec}: {}", b.certificate().error);
    }
}

/// Lafortune's lobe: a tangent turned by 90° is Cx and Cy swapped, equal ones know no tangent, and other
/// lobes than one are refused.
#[test]
fn lobes_of_lafortune_turn_with_the_tangent() {
    let spec = SPECS[5];
    let of = |c: [f64; 3], tangent: f64| {
        bake(spec, Planes::default().with("lobe", constant(c)).with("tangent", constant([tangent; 3])))
    };
    let (one, swapped) = (of([-0.9, 0.3, 0.8], 0.125), of([0.3, -0.9, 0.8], 0.625));
    let (round, turned) = (of([-0.9, -0.9, 0.8], 0.0), of([-0.9, -0.9, 0.8], 0.3125));
    for k in 0..200 {
        let (wi, wo) = (single(direction(3 * k, 0.02)), single(direction(7 * k + 1, 0.02)));
        for (a, b) in [(&one, &swapped), (&round, &turned)] {
            for (x, y) in a.f_cos(wi, wo).iter().zip(b.f_cos(wi, wo)) {
                assert!((x - y).abs() <= 1e-5 * (0.1 + x), "{k}: {x} {y}");
            }
        }
    }
    let materials = crate::find_local("shift_variant").expect("a technique").card().materials;
    let refused =
        materials(&*steradian_brdf::parse("lafortune:@skin").expect("a spec")).expect_err("three lobes");
    assert!(refused.contains("lafortune_svbrdf"), "{refused}");
    // Normals that scatter under a footprint widen the lobe: less at its peak, more around it.
    let rough = |i: usize, _: usize| [0.5 + 0.5 * (i as f64 * 1.7).sin(); 3];
    let spec = "lafortune:cx=-1,cy=-1,cz=1,n=100,ks=1";
    let (flat, rough) = (
        bake(spec, Planes::default()),
        bake(spec, Planes::default().with(HEIGHT, specimens::texture(rough))),
    );
    let at = Place { uv: [0.5; 2], footprint: 1.0 };
    let of = |b: &dyn LocalBake, x: f64| {
        f64::from(b.f_cos_at(at, single(DVec3::new(x, 0.0, 1.0).normalize()), [0.0, 0.0, 1.0])[0])
    };
    assert!(of(&*rough, 0.0) < 0.9 * of(&*flat, 0.0) && of(&*rough, 0.5) > 2.0 * of(&*flat, 0.5));
}

/// White light gives no more than it sends, whatever varies: no view here gets more than 93 %. The rules of
/// 120² and 240² directions agree to 1e-3, so nothing is put down to the rule.
#[test]
fn white_surfaces_send_back_no_more_than_they_get() {
    for spec in ["ward:ax=0.2,ay=0.5,rs=1", "ggx:ax=0.2,ay=0.5,f0=1"] {
        let planes = Planes::default()
            .with("tangent", specimens::texture(|i, _| [i as f64 / 48.0; 3]))
            .with("widths", specimens::texture(|i, j| [0.2 + 0.005 * i as f64, 0.2 + 0.01 * j as f64, 0.0]));
        let b = bake(spec, planes);
        for k in 0..12u32 {
            let wo = single(direction(k, 0.1));
            let at = Place { uv: [0.083 * k as f32, 0.37 * k as f32], footprint: 0.02 * k as f32 };
            let sum = |n: usize| {
                let mut sum = 0.0;
                for a in 0..n {
                    for p in 0..n {
                        let (z, phi) = ((a as f64 + 0.5) / n as f64, 2.0 * PI * (p as f64 + 0.5) / n as f64);
                        let s = (1.0 - z * z).sqrt();
                        let wi = single(DVec3::new(s * phi.cos(), s * phi.sin(), z));
                        sum += f64::from(b.f_cos_at(at, wi, wo)[0]) * 2.0 * PI / (n * n) as f64;
                    }
                }
                sum
            };
            let [coarse, middle, fine] = [60, 120, 240].map(sum);
            println!("{spec}: {k}: {coarse:.5} {middle:.5} {fine:.6}");
            assert!(fine > 0.3 && fine <= 1.0, "{spec}: {k}: {coarse} {middle} {fine}");
            assert!((fine - middle).abs() < 1e-3, "{spec}: {k}: {middle} {fine}");
        }
    }
}

/// f(l, v) = f(v, l) at a texel.
#[test]
fn flat_texels_are_reciprocal() {
    let planes = Planes::default().with("tangent", specimens::texture(|i, _| [i as f64 / 48.0; 3]));
    for spec in [SPECS[0], SPECS[3]] {
        let b = bake(spec, planes.clone());
        for k in 0..100 {
            let (wi, wo) = (direction(3 * k, 0.1), direction(7 * k + 1, 0.1));
            let at = Place { uv: [0.017 * k as f32, 0.5], footprint: 0.0 };
            let of = |a: DVec3, b_: DVec3| f64::from(b.f_cos_at(at, single(a), single(b_))[1]) / a.z;
            assert!((of(wi, wo) - of(wo, wi)).abs() < 1e-4 * (0.1 + of(wi, wo)), "{spec}: {k}");
        }
    }
}

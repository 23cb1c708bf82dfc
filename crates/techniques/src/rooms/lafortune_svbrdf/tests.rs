use crate::find_local;
use crate::local::{LocalBake, Place};
use crate::shared::trials::specimens;
use crate::trial::local::{self, direction, single};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_scene::surface::Planes;

fn bake(spec: &str, planes: Planes) -> Box<dyn LocalBake> {
    local::bake("lafortune_svbrdf", spec, planes)
}

fn centre(i: usize, j: usize) -> Place {
    let at = |k: usize| (k as f32 + 0.5) / specimens::SIDE as f32;
    Place { uv: [at(i), at(j)], footprint: 0.0 }
}

/// C = (−1, −1, 1) is Phong's lobe about the mirror direction.
#[test]
fn phong_is_a_lobe() {
    let b =
        bake("lambert:albedo=0", Planes::default().with("rho_1", specimens::texture(|_, _| [0.5, 0.2, 1.0])));
    let sharp = Planes::default()
        .with("rho_1", specimens::texture(|_, _| [0.5, 0.2, 1.0]))
        .with("n_1", specimens::texture(|_, _| [30.0; 3]));
    let sharp = bake("lambert:albedo=0", sharp);
    for k in 0..400 {
        let (wi, wo) = (direction(3 * k, 0.01), direction(5 * k + 2, 0.02));
        let r = DVec3::new(-wo.x, -wo.y, wo.z).dot(wi).max(0.0);
        for (b, n) in [(&b, 1), (&sharp, 30)] {
            let got = b.f_cos_at(Place { uv: [0.3, 0.2], footprint: 0.3 }, single(wi), single(wo));
            for (g, rho) in got.iter().zip([0.5, 0.2, 1.0]) {
                assert!((f64::from(*g) - rho * r.powi(n) * wi.z).abs() < 2e-5, "{k} {n}");
            }
        }
    }
}

/// Every texel is the reflectance model with the texel's numbers.
#[test]
fn texels_are_the_model_with_their_numbers() {
    let rho_d = |i: usize, j: usize| [0.2 + 0.01 * i as f64, 0.3, 0.02 * j as f64 % 0.9];
    let c = |i: usize, j: usize| [-0.9, -0.7 - 0.005 * j as f64, 0.95 - 0.004 * i as f64];
    let n = |i: usize, j: usize| 3.0 + ((i * j) % 20) as f64;
    let planes = Planes::default()
        .with("rho_d", specimens::texture(rho_d))
        .with("rho_1", specimens::texture(|_, _| [0.4; 3]))
        .with("c_1", specimens::texture(c))
        .with("n_1", specimens::texture(|i, j| [n(i, j); 3]));
    let b = bake("lambert", planes);
    assert!(b.certificate().error < 1e-5, "{}", b.certificate().error);
    for k in 0..300u32 {
        let (i, j) = ((7 * k % 48) as usize, (11 * k % 48) as usize);
        let ([r, g, blue], [x, y, z]) = (rho_d(i, j), c(i, j));
        let spec = format!("lafortune:cx={x},cy={y},cz={z},n={},ks=0.4,kd={r}/{g}/{blue}", n(i, j));
        let brdf = steradian_brdf::parse(&spec).expect("a spec");
        let (wi, wo) = (direction(3 * k, 0.01), direction(5 * k + 2, 0.02));
        let got = b.f_cos_at(centre(i, j), single(wi), single(wo));
        for (a, want) in got.iter().zip(brdf.f_cos(wi, wo)) {
            assert!((f64::from(*a) - want).abs() < 1e-5, "{spec}: {a} {want}");
        }
    }
}

/// Lobes whose axes scatter average to a wider one, and keep their integral.
#[test]
fn scattered_axes_widen_lobes() {
    // Mirror and off-mirror lobes as a chequer board; texels without a lobe do not affect the average.
    let c =
        |i: usize, j: usize| if (i + j).is_multiple_of(2) { [-1.0, -1.0, 1.0] } else { [-0.9, -1.0, 1.0] };
    let planes = |c: &dyn Fn(usize, usize) -> [f64; 3]| {
        Planes::default()
            .with("rho_1", specimens::texture(|_, _| [1.0; 3]))
            .with("c_1", specimens::texture(c))
            .with("n_1", specimens::texture(|_, _| [30.0; 3]))
    };
    let b = bake("lambert:albedo=0", planes(&c));
    let wo = DVec3::new(0.6, 0.0, 0.8);
    let all = |place: &dyn Fn(usize, usize) -> Place, texels: usize| {
        let mut sum = 0.0;
        let n = 200;
        for a in 0..n {
            for k in 0..n {
                let (z, phi) = ((a as f64 + 0.5) / n as f64, 2.0 * PI * (k as f64 + 0.5) / n as f64);
                let s = (1.0 - z * z).sqrt();
                let wi = DVec3::new(s * phi.cos(), s * phi.sin(), z);
                let mean = (0..texels).map(|t| b.f_cos_at(place(t, 0), single(wi), single(wo))[0] / z as f32);
                sum += f64::from(mean.sum::<f32>()) / texels as f64 * 2.0 * PI / (n * n) as f64;
            }
        }
        sum
    };
    let filtered = all(&|_, _| Place { uv: [0.5; 2], footprint: 1.0 }, 1);
    let mean = all(&centre, 2);
    println!("a chequer board of two axes: {filtered:.4}, its texels {mean:.4}");
    assert!((filtered / mean - 1.0).abs() < 0.15, "{filtered} {mean}");
}

#[test]
fn other_models_are_refused() {
    let brdf = steradian_brdf::parse("ggx:alpha=0.2").expect("a spec");
    let why =
        (find_local("lafortune_svbrdf").expect("a technique").card().materials)(&*brdf).expect_err("refused");
    assert!(why.contains("takes lafortune and lambert, not ggx"), "{why}");
}

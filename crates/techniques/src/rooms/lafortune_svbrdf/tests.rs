use crate::local::{LocalBake, Place};
use crate::shared::trials::specimens;
use crate::trial::local::{self, direction, single};
use crate::{Material, find_local};
use glam::DVec3;
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_formats::TensorData;
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
    let b = local::bake_with("lafortune_svbrdf", "lambert", planes, &[("bits", 24.0)]);
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

fn figure(b: &dyn LocalBake, name: &str) -> f64 {
    b.certificate().figure(name).unwrap_or_else(|| panic!("no {name}"))
}

/// One to three lobes take 10, 17 and 24 bytes in 8 bits a number, in whole words, and levels a third more;
/// the error of f cos at the texels falls by about 2⁸ from 8 bits to 16.
#[test]
fn a_texel_takes_few_bytes() {
    let texels = 48 * 48 + 24 * 24 + 12 * 12 + 6 * 6 + 3 * 3 + 1;
    for (lobes, bytes) in [(1, 12), (2, 20)] {
        let names = ["rho_d", "rho_1", "c_1", "n_1", "rho_2", "c_2", "n_2"];
        let all = specimens::planes(&crate::shared::surface::cosine_lobes::PLANES);
        let some = names.iter().take(1 + 3 * lobes);
        let planes = some.fold(Planes::default(), |p, n| p.with(n, all.get(n).expect("an image").clone()));
        let errors = [8.0, 16.0, 24.0].map(|bits| {
            let b =
                local::bake_with("lafortune_svbrdf", "lambert:albedo=0", planes.clone(), &[("bits", bits)]);
            let a_texel = figure(&*b, "bytes a texel");
            assert_eq!(b.bytes() as f64, texels as f64 * a_texel + 8.0 * (3 + 7 * lobes) as f64);
            if bits == 8.0 {
                assert_eq!(a_texel, f64::from(bytes));
            }
            b.certificate().error
        });
        let auto = bake("lambert:albedo=0", planes);
        let kinds = ["bytes a texel", "bits of rho", "bits of C", "bits of n"].map(|n| figure(&*auto, n));
        let said = errors.map(|e| format!("{e:.1e}"));
        println!("{lobes} lobes: {said:?}; auto {kinds:?}: {:.1e}", auto.certificate().error);
        assert!(errors[0] < 0.01 && errors[1] < errors[0] / 100.0 && errors[2] < 2e-6, "{errors:?}");
        assert!(auto.certificate().error <= 0.01 && kinds[0] <= 24.0, "{kinds:?}");
    }
    // Channels with lobes of their own, as measured skin has them.
    let skin = bake("lafortune:@skin", Planes::default());
    assert_eq!(figure(&*skin, "bytes a texel"), 48.0);
}

/// Sharp lobes whose C varies take more bits, as the tolerance says.
#[test]
fn narrow_lobes_take_more_bits() {
    let c = |i: usize, j: usize| [-0.5 - 0.01 * i as f64, -1.0 + 0.01 * j as f64, 0.9];
    for (n, tolerance, want) in [(4.0, None, 8.0), (200.0, None, 16.0), (4.0, Some(1e-6), 24.0)] {
        let planes = Planes::default()
            .with("rho_1", specimens::texture(|_, _| [0.4; 3]))
            .with("c_1", specimens::texture(c))
            .with("n_1", specimens::texture(|_, _| [n; 3]));
        let black = steradian_brdf::parse("lambert:albedo=0").expect("a spec");
        let m = Material::new(black).with_textures(planes);
        let task = Task::quiet().with_tolerance(tolerance);
        let t = find_local("lafortune_svbrdf").expect("a technique");
        let b = t.bake(&m, None, &Default::default(), &task).expect("bakes");
        println!("n = {n}, tolerance {tolerance:?}: {:?}", b.certificate().details);
        assert!(b.certificate().error <= tolerance.unwrap_or(0.01), "{n}");
        assert_eq!(figure(&*b, "bits of C"), want, "{n} {tolerance:?}");
    }
}

/// A saved bake holds the integers in place of the images, and comes back to the bit; damaged ones are
/// refused.
#[test]
fn saved_lobes_come_back() {
    let planes = specimens::planes(&crate::shared::surface::cosine_lobes::PLANES);
    let b = bake("lambert", planes);
    let saved = b.save().expect("no mesh");
    let codes = saved.tensors.get("lobes.codes").expect("integers");
    assert!(codes.data.bytes() + 8 * 17 == b.bytes() && saved.tensors.len() == 3);
    let t = find_local("lafortune_svbrdf").expect("a technique");
    let again = t.load(&saved, b.brdf().clone()).expect("its own");
    assert!(again.is_textured() && again.bytes() == b.bytes());
    for k in 0..200 {
        let at = Place { uv: [0.013 * k as f32, 0.7 - 0.01 * k as f32], footprint: 0.002 * (k % 9) as f32 };
        let (wi, wo) = (single(direction(3 * k, 0.01)), single(direction(5 * k + 2, 0.02)));
        assert_eq!(b.f_cos_at(at, wi, wo), again.f_cos_at(at, wi, wo));
    }
    let refused = |change: &dyn Fn(&mut crate::tensors::TensorFile)| {
        let mut t = saved.clone();
        change(&mut t);
        find_local("lafortune_svbrdf").expect("a technique").load(&t, b.brdf().clone()).is_err()
    };
    let layout = |k: usize, v: u32| {
        refused(&move |t| {
            if let Some(TensorData::U32(words)) = t.tensors.get_mut("lobes.layout").map(|t| &mut t.data) {
                words[k] = v;
            }
        })
    };
    for (k, v) in [(0, 5), (0, 1), (1, 0), (1, 49), (2, u32::MAX), (3, 3), (5, 0), (6, 4), (8, 16), (8, 1)] {
        assert!(layout(k, v), "{k} {v}");
    }
    let range = |v: f32| {
        refused(&move |t| {
            if let Some(TensorData::F32(x)) = t.tensors.get_mut("lobes.ranges").map(|t| &mut t.data) {
                x[1] = v;
            }
        })
    };
    assert!([-1.0, f32::NAN, f32::INFINITY].into_iter().all(range));
    for name in ["lobes.ranges", "lobes.codes"] {
        assert!(refused(&|t| drop(t.tensors.remove(name))), "{name}");
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

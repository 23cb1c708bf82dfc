use super::fibre::Fibre;
use super::*;
use crate::PointsBuf;
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use steradian_base::{ParamValues, Params as _};
use steradian_light::Environment;
use steradian_sphere::{Layout, SphereImage};

/// The stack alone; its certificate's error is compared with the reference by the conformance suite.
fn baked(lights: &Lights, spec: &str, params: &[(&str, f64)]) -> ConeMaps {
    let task = Task::quiet().with_tolerance(Some(2e-3));
    let values: ParamValues = params.iter().copied().collect();
    let p = Params::from_values(&values).unwrap();
    let light = BanksEnv::light(lights, &p, &task).unwrap();
    let material = Reflectance::of(&Material::new(steradian_brdf::parse(spec).unwrap()));
    bake::make(&light, &Fibre::new(&material, p.mean_cosine), &p, &task).unwrap().0
}

fn shaded(b: &ConeMaps, points: &[[DVec3; 3]]) -> Vec<[f64; 3]> {
    let mut q = PointsBuf::default();
    points.iter().for_each(|[n, t, wo]| q.push(n.as_vec3(), t.as_vec3(), wo.as_vec3(), Vec3::ZERO));
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
    shade::shade(b, &LightRotation::default(), &q.as_points(), &mut Radiance::of(&mut rgb));
    (0..points.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from)).collect()
}

/// Normal, tangent and viewer at `theta` from the tangent.
fn at(t: DVec3, theta: f64) -> [DVec3; 3] {
    let t = t.normalize();
    let n = t.any_orthonormal_vector();
    [n, t, t * theta.cos() + n * theta.sin()]
}

fn tangents() -> Vec<DVec3> {
    (0..12).map(|k| steradian_prefilter::probe::direction(k, 12)).collect()
}

/// ∫ f(θ) dθ over 0 … π by the midpoint rule.
fn over(f: impl Fn(f64) -> f64) -> f64 {
    let n = 20_000;
    (0..n).map(|k| f(PI * (f64::from(k) + 0.5) / f64::from(n))).sum::<f64>() * PI / f64::from(n)
}

/// Eq. 33's factor as it is printed.
fn banks(n: f64, x: f64, y: f64) -> f64 {
    ((1.0 - x * x).max(0.0).sqrt() * (1.0 - y * y).max(0.0).sqrt() - x * y).max(0.0).powf(n)
}

/// Eq. 35, texel by texel.
#[test]
fn it_is_the_sum_over_the_light() {
    let light = lights::smooth();
    let image = &light.environment.as_ref().unwrap().image;
    let sum = |[_, t, wo]: [DVec3; 3], sign: f64| {
        let mut sum = [0.0; 3];
        for j in 0..image.height {
            let omega = image.layout.solid_angle(image.width, image.height, 0, 0, j);
            for i in 0..image.width {
                let d = image.layout.texel_direction(image.width, image.height, 0, i, j).unwrap();
                let f = banks(25.0, d.dot(t), sign * wo.dot(t)) * omega;
                (0..3).for_each(|c| sum[c] += f * f64::from(image.texel(0, i, j)[c]));
            }
        }
        sum
    };
    let points: Vec<_> =
        tangents().iter().zip(0..).map(|(t, k)| at(*t, 0.02 + 0.28 * f64::from(k))).collect();
    for (spec, sign) in [("banks-map:n=25", 1.0), ("kajiya-kay:s=25", -1.0)] {
        let got = shaded(&baked(&light, spec, &[]), &points);
        let exact: Vec<_> = points.iter().map(|p| sum(*p, sign)).collect();
        let error = steradian_prefilter::probe::relative_rms(got.iter().copied().zip(exact.iter().copied()));
        assert!(error < 4e-3, "{spec}: {error}");
    }
}

#[test]
fn constant_light_gives_the_integral_of_the_lobe() {
    for n in [0.5, 5.0, 60.0, 1000.0] {
        let b = baked(&lights::furnace(), &format!("banks-map:n={n},scale=0.5"), &[]);
        for theta in [0.1, 0.7, PI / 2.0, 2.0, 3.0] {
            let got = shaded(&b, &[at(DVec3::new(0.3, -0.4, 0.8), theta)])[0][1];
            let exact = 0.5 * 2.0 * PI * over(|a| banks(n, a.cos(), theta.cos()) * a.sin());
            // Relative to the brightest, across the tangent: the tolerance is of the whole.
            let most = 0.5 * 2.0 * PI * over(|a| a.sin().powf(n + 1.0));
            assert!((got - exact).abs() < 4e-3 * most, "{n} {theta}: {got} {exact}");
        }
    }
}

/// N → ∞: √(N/2π) times the map is the integral over the cone θ_i = π − θ_o.
#[test]
fn a_sharp_lobe_integrates_the_cone() {
    let light = |d: DVec3| 1.0 + 0.5 * d.x + 0.6 * d.y * d.z - 0.3 * d.z;
    let image = SphereImage::from_fn(Layout::LatLong, 256, 128, |d| [light(d) as f32; 3]);
    let mut before = f64::INFINITY;
    for n in [20.0, 200.0, 2000.0] {
        let b = baked(&Environment { image: image.clone() }.into(), &format!("banks-map:n={n}"), &[]);
        let mut worst = 0.0_f64;
        for t in tangents() {
            for theta in [0.6, 1.2, 1.9] {
                let p = at(t, theta);
                let (x, y) = p[1].any_orthonormal_pair();
                let ring = |k: i32| {
                    let (s, c) = (2.0 * PI * f64::from(k) / 64.0).sin_cos();
                    light(p[1] * -theta.cos() + (x * c + y * s) * theta.sin())
                };
                let cone = (0..64).map(ring).sum::<f64>() / 64.0 * 2.0 * PI * theta.sin();
                let got = shaded(&b, &[p])[0][0] * (n / (2.0 * PI)).sqrt();
                worst = worst.max((got / cone - 1.0).abs());
            }
        }
        // The next term of the kernel's expansion is of order 1/N; the tables have their tolerance.
        assert!(worst < before && worst < 4.0 / n + 0.012, "{n}: {worst}, before {before}");
        before = worst;
    }
}

/// Linear interpolation between slices: a quarter of the error with half the spacing.
#[test]
fn slices_converge_with_the_square_of_their_spacing() {
    let light = lights::studio();
    let points: Vec<_> =
        (0..300).map(|k| at(tangents()[k % 12], 0.1 + 2.9 * (k as f64 * 0.754_877_666).fract())).collect();
    let run = |slices: f64| {
        shaded(&baked(&light, "kajiya-kay:s=30", &[("slices", slices), ("size", 32.0)]), &points)
    };
    let fine = run(97.0);
    let error = |s| steradian_prefilter::probe::relative_rms(run(s).into_iter().zip(fine.iter().copied()));
    let (a, b, c) = (error(7.0), error(13.0), error(25.0));
    assert!((2.5..5.0).contains(&(a / b)) && (3.0..5.5).contains(&(b / c)), "{a} {b} {c}");
}

/// Kajiya and Kay's lobe is Banks's with the tangent reversed, seen from the same side.
#[test]
fn the_two_models_are_one_stack() {
    let light = lights::studio();
    let (a, b) = (baked(&light, "banks-map:n=30", &[]), baked(&light, "kajiya-kay:s=30", &[]));
    for t in tangents() {
        let [n, t, wo] = at(t, 1.0);
        let mirrored = n * (2.0 * n.dot(wo)) - wo;
        let (x, y) = (shaded(&a, &[[n, t, wo]])[0], shaded(&b, &[[n, t, mirrored]])[0]);
        assert!((0..3).all(|c| (x[c] - y[c]).abs() < 1e-5 * (1.0 + x[c])), "{x:?} {y:?}");
    }
}

/// Across wo·t = 0 the lookup changes from t to −t.
#[test]
fn it_is_continuous_where_the_tangent_turns() {
    let b = baked(&lights::studio(), "banks-map:n=40", &[]);
    for t in tangents() {
        let both = shaded(&b, &[at(t, PI / 2.0 - 1e-6), at(t, PI / 2.0 + 1e-6)]);
        assert!((0..3).all(|c| (both[0][c] - both[1][c]).abs() < 1e-3 * both[0][c] + 1e-4), "{both:?}");
    }
}

/// STAR04 7.3.6: "an object using this environment map does reflect light from behind it".
#[test]
fn light_from_behind_leaks_in() {
    let image = SphereImage::from_fn(Layout::LatLong, 128, 64, |d| [if d.z < 0.0 { 1.0 } else { 0.0 }; 3]);
    let b = baked(&Environment { image }.into(), "banks:n=30", &[]);
    let wo = DVec3::new(0.3, 0.0, 0.954).normalize();
    // The surface faces +Z, all light is behind it: half the ring is lit.
    let got = shaded(&b, &[[DVec3::Z, DVec3::X, wo]])[0][0];
    let whole = shaded(&baked(&lights::furnace(), "banks:n=30", &[]), &[[DVec3::Z, DVec3::X, wo]])[0][0];
    assert!((got / whole - 0.5).abs() < 0.01, "{got} of {whole}");
}

/// Effect of the cosine that eq. 35 drops: constant light shows the map's integral, or with the mean cosine
/// the model's albedo.
#[test]
fn the_mean_cosine_makes_constant_light_exact() {
    let p = at(DVec3::X, 1.1);
    let shade = |k| shaded(&baked(&lights::furnace(), "banks:n=30", &[("mean_cosine", k)]), &[p])[0][0];
    let map = 2.0 * PI * over(|a| banks(30.0, a.cos(), 1.1_f64.cos()) * a.sin());
    let model = 2.0 * over(|a| banks(30.0, a.cos(), 1.1_f64.cos()) * a.sin().powi(2));
    assert!((shade(0.0) - map).abs() < 3e-3 * map);
    assert!((shade(1.0) - model).abs() < 3e-3 * model);
}

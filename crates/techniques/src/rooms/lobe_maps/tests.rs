use super::*;
use crate::trial::Certified;
use crate::{AnyBake, PointsBuf, find};
use glam::{DVec2, DVec3, Vec3};
use std::sync::Arc;
use steradian_base::ParamValues;
use steradian_brdf::{Brdf, Domain, Info, Sample, SharedBrdf};

fn bake_in(slug: &str, lights: &Lights, brdf: SharedBrdf, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    let values: ParamValues = params.iter().copied().collect();
    find(slug).unwrap().draft(lights, &Material::new(brdf), None, &values, &Task::quiet()).unwrap()
}

fn bake(lights: &Lights, spec: &str, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    bake_in("lobe-maps", lights, steradian_brdf::parse(spec).unwrap(), params)
}

/// Normals over the sphere, views at cos θ_v = 1, 0.8 … 0.1.
fn points() -> PointsBuf {
    let mut q = PointsBuf::default();
    for k in 0..60 {
        let n = steradian_prefilter::probe::direction(k, 60).as_vec3();
        let t = n.any_orthonormal_vector();
        let c = [1.0, 0.8, 0.5, 0.25, 0.1][k % 5];
        q.push(n, t, n * c + t * (1.0f32 - c * c).sqrt(), Vec3::ZERO);
    }
    q
}

fn shade(b: &dyn AnyBake) -> Vec<[f64; 3]> {
    let q = points();
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    (0..q.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from)).collect()
}

fn difference(a: &dyn AnyBake, b: &dyn AnyBake) -> f64 {
    steradian_prefilter::probe::relative_rms(shade(a).into_iter().zip(shade(b)))
}

/// STAR04 eqs 30–31 with F = 1/(n·r): Phong's f = (r·wi)^N/(n·wi) is Phong's map.
#[test]
fn phong_is_reproduced_with_one_over_the_cosine() {
    for (light, n, stacks) in [(lights::studio(), 30, &[2.0, 3.0][..]), (lights::sunny(), 300, &[2.0])] {
        let spec = format!("phong-map:n={n},scale=1/0.7/0.2");
        let map = bake_in("phong-diffuse-maps", &light, steradian_brdf::parse(&spec).unwrap(), &[]);
        for &dimensions in stacks {
            let own = bake(&light, &spec, &[("dimensions", dimensions), ("axis", 0.0)]);
            let error = difference(&*own, &*map);
            assert!(error < 6e-3, "{n}, {dimensions}: {error}");
        }
    }
}

/// Eq. 26's Phong part as a reflectance: F(n·wo) (r·wi)^n.
#[derive(Debug)]
struct Glossy(SharedBrdf);

impl Brdf for Glossy {
    fn info(&self) -> &'static Info {
        self.0.info()
    }
    fn spec(&self) -> String {
        "glossy".into()
    }
    fn eval(&self, _: DVec3, _: DVec3) -> [f64; 3] {
        [0.0; 3]
    }
    fn f_cos(&self, wi: DVec3, wo: DVec3) -> [f64; 3] {
        self.0.f_cos(wi, wo).map(|f| f * (0.04 + 0.96 * (1.0 - wo.z).powi(5)))
    }
    fn domain(&self) -> Domain {
        Domain::Sphere
    }
    fn lobes(&self, wo: DVec3) -> Vec<steradian_brdf::Lobe> {
        self.0.lobes(wo)
    }
    fn sample(&self, _: DVec3, _: DVec2) -> Option<Sample> {
        None
    }
    fn pdf(&self, _: DVec3, _: DVec3) -> f64 {
        0.0
    }
}

/// The 2-D version is Phong's map with the Fresnel factor measured (STAR04 7.3.4).
#[test]
fn one_map_is_phongs_with_the_fresnel_factor_measured() {
    let phong = steradian_brdf::parse("phong-map:n=40").unwrap();
    let light = lights::studio();
    let own = bake_in("lobe-maps", &light, Arc::new(Glossy(phong.clone())), &[("dimensions", 2.0)]);
    let map = bake_in("phong-diffuse-maps", &light, phong, &[("f0", 0.04)]);
    let error = difference(&*own, &*map);
    assert!(error < 6e-3, "{error}");
}

/// STAR04 eq. 29 as printed, by brute force: p is the mean of f over the azimuth about r, n·r is outside the
/// integral.
#[test]
fn the_printed_equation_has_its_cosine_outside() {
    let brdf = steradian_brdf::parse("ggx:alpha=0.3,f0=0.8").unwrap();
    let light = lights::smooth();
    let image = &light.environment.as_ref().unwrap().image;
    let printed = [("axis", 0.0), ("cosine", 0.0), ("elevations", 33.0)];
    let (got, q) = (shade(&*bake_in("lobe-maps", &light, brdf.clone(), &printed)), points());
    let at = |v: &[Vec<f32>; 3], k: usize| DVec3::from_array(v.each_ref().map(|c| f64::from(c[k])));
    let mut pairs = Vec::new();
    for k in [0, 1, 2, 3, 6, 17, 23, 28] {
        let (n, wo) = (at(&q.n, k), at(&q.wo, k));
        let (c, r) = (n.dot(wo), 2.0 * n.dot(wo) * n - wo);
        let sine = (1.0 - c * c).max(0.0).sqrt();
        let local = DVec3::new(sine, 0.0, c);
        let axis = DVec3::new(-sine, 0.0, c);
        let (a, b) = axis.any_orthonormal_pair();
        let p = |psi: f64| {
            let f = |j: usize| {
                let (s, t) = (std::f64::consts::TAU * (j as f64 + 0.5) / 128.0).sin_cos();
                let wi = axis * psi.cos() + (a * t + b * s) * psi.sin();
                if wi.z > 0.0 { brdf.eval(wi, local)[0] } else { 0.0 }
            };
            (0..128).map(f).sum::<f64>() / 128.0
        };
        let table: Vec<f64> = (0..=512).map(|i| p(std::f64::consts::PI * f64::from(i) / 512.0)).collect();
        let mut sum = [0.0; 3];
        for j in 0..image.height {
            let omega = image.layout.solid_angle(image.width, image.height, 0, 0, j);
            for i in 0..image.width {
                let d = image.layout.texel_direction(image.width, image.height, 0, i, j).unwrap();
                let x = r.dot(d).clamp(-1.0, 1.0).acos() / std::f64::consts::PI * 512.0;
                let m = (x as usize).min(511);
                let p = table[m] + (table[m + 1] - table[m]) * (x - m as f64);
                (0..3).for_each(|k| sum[k] += c * p * omega * f64::from(image.texel(0, i, j)[k]));
            }
        }
        pairs.push((got[k], sum));
    }
    let error = steradian_prefilter::probe::relative_rms(pairs.into_iter());
    assert!(error < 0.01, "{error}");
}

/// STAR04 eq. 31 under constant light: n·r F ∫ p is n·r times the integral of f, which is more than the
/// albedo where lobes are cut by the horizon.
#[test]
fn one_printed_map_keeps_the_integral_of_f() {
    let brdf = steradian_brdf::parse("ggx:alpha=0.3,f0=0.8").unwrap();
    let printed = [("dimensions", 2.0), ("axis", 0.0), ("cosine", 0.0)];
    let got = shade(&*bake_in("lobe-maps", &lights::furnace(), brdf.clone(), &printed));
    for (k, c) in [1.0, 0.8, 0.5, 0.25, 0.1_f64].into_iter().enumerate() {
        let wo = DVec3::new((1.0 - c * c).sqrt(), 0.0, c);
        let mut sum = 0.0;
        for i in 0..800 {
            // z by the square, since f is steep at the horizon.
            let u = (f64::from(i) + 0.5) / 800.0;
            let z = u * u;
            for j in 0..800 {
                let (s, t) = (std::f64::consts::TAU * (f64::from(j) + 0.5) / 800.0).sin_cos();
                let side = (1.0 - z * z).sqrt();
                sum += 2.0 * u * brdf.eval(DVec3::new(side * t, side * s, z), wo)[0];
            }
        }
        let exact = c * sum * std::f64::consts::TAU / 640_000.0;
        assert!((got[k][0] - exact).abs() < 0.01 * exact, "{c}: {} {exact}", got[k][0]);
    }
}

/// As the lobe narrows, n·wi tends to n·r over it and its azimuth ceases to matter.
#[test]
fn the_error_goes_to_zero_as_the_lobe_narrows() {
    let params = [("elevations", 9.0)];
    let error = |n: f64| bake(&lights::smooth(), &format!("phong:n={n}"), &params).certified().error;
    let errors = [10.0, 100.0, 1000.0].map(error);
    // The maps themselves are within 0.005.
    assert!(errors[0] > 1.4 * errors[1] && errors[2] < 5e-3, "{errors:?}");
}

/// A stack, a leaning axis and a second lobe each pay.
#[test]
fn every_freedom_lowers_the_error() {
    let (light, nine) = (lights::studio(), ("elevations", 9.0));
    let error = |params: &[(&str, f64)]| bake(&light, "ggx:alpha=0.36,f0=1", params).certified().error;
    let printed = error(&[("dimensions", 2.0), ("axis", 0.0), nine]);
    let stack = error(&[("axis", 0.0), nine]);
    let leaning = error(&[nine]);
    let two = error(&[("dimensions", 2.0), ("lobes", 2.0), nine]);
    let all = [printed, stack, leaning, two];
    assert!(stack < printed && leaning < 0.6 * stack && two < 0.4 * printed, "{all:?}");
}

#[test]
fn what_it_refuses_says_why() {
    let t = find("lobe_maps").unwrap();
    let refused = |spec: &str| (t.card().materials)(&*steradian_brdf::parse(spec).unwrap()).unwrap_err();
    assert!(refused("ggx:ax=0.1,ay=0.2").contains("isotropic"));
    assert!(refused("kajiya-kay:s=8").contains("isotropic"));
    // Without its cosine it has no bound.
    let values = ParamValues::from_iter([("cosine", 0.0)]);
    for spec in ["phong:n=20", "phong-map:n=20", "microfacet:sigma=0.3"] {
        let m = Material::new(steradian_brdf::parse(spec).unwrap());
        let e = t.bake(&lights::furnace(), &m, None, &values, &Task::quiet()).err().unwrap();
        assert!(e.to_string().contains("cosine") && e.exit_code() == 2, "{spec}: {e}");
    }
}

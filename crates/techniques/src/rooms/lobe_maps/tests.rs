use super::*;
use crate::{AnyBake, PointsBuf, find};
use glam::{DVec2, DVec3, Vec3};
use std::sync::Arc;
use steradian_base::ParamValues;
use steradian_brdf::{Brdf, Domain, Info, Sample, SharedBrdf};

fn bake_in(slug: &str, lights: &Lights, brdf: SharedBrdf, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    let values = ParamValues(params.iter().map(|(k, v)| ((*k).to_string(), *v)).collect());
    find(slug).unwrap().bake(lights, &Material::new(brdf), None, &values, &Task::quiet()).unwrap()
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

/// As the lobe narrows, n·wi tends to n·r over it and its azimuth ceases to matter.
#[test]
fn the_error_goes_to_zero_as_the_lobe_narrows() {
    let params = [("elevations", 9.0)];
    let error = |n: f64| bake(&lights::smooth(), &format!("phong:n={n}"), &params).certificate().error;
    let errors = [10.0, 100.0, 1000.0].map(error);
    // The maps themselves are within 0.005.
    assert!(errors[0] > 1.5 * errors[1] && errors[2] < 5e-3, "{errors:?}");
}

/// A stack, a leaning axis and a second lobe each pay.
#[test]
fn every_freedom_lowers_the_error() {
    let (light, nine) = (lights::studio(), ("elevations", 9.0));
    let error = |params: &[(&str, f64)]| bake(&light, "ggx:alpha=0.36,f0=1", params).certificate().error;
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
}

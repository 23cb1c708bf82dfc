use super::bake::seen;
use super::*;
use crate::trial;
use crate::trial::Certified;
use steradian_base::{ParamValues, Params as _};

/// The factors and their report.
fn factors(lights: &Lights, spec: &str, params: &[(&str, f64)]) -> (Factors, Report) {
    let task = Task::quiet();
    let values: ParamValues = params.iter().copied().collect();
    let p = Params::from_values(&values).unwrap();
    let material = Material::new(steradian_brdf::parse(spec).unwrap());
    let light = FactoredLighting::light(lights, &p, &task).unwrap();
    bake::link(&light, &seen(&material, &task).unwrap(), &p, &task).unwrap()
}

/// The error that the certificate states.
fn error(lights: &Lights, spec: &str, params: &[(&str, f64)]) -> f64 {
    trial::bake("factored_lighting", lights, spec, params, None).certified().error
}

fn detail(c: &Report, name: &str) -> f64 {
    c.figure(name).unwrap()
}

/// RMS deviation of a factor's logarithm from its mean.
fn deviation(texels: &[[f32; 4]]) -> f64 {
    let n = (3 * texels.len()) as f64;
    let all = || texels.iter().flat_map(|t| t[..3].to_vec()).map(f64::from);
    let mean = all().sum::<f64>() / n;
    (all().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// Deviations of the factors over n, r and n·wo.
fn deviations(f: &Factors) -> [f64; 3] {
    [deviation(f.cubes[0].texels()), deviation(f.cubes[1].texels()), deviation(&f.line)]
}

#[test]
fn a_lambertian_surface_depends_on_n_alone() {
    let (f, c) = factors(&lights::smooth(), "lambert:albedo=0.8/0.5/0.2", &[]);
    let [n, r, e] = deviations(&f);
    assert!(n > 0.2 && r < 0.01 && e < 0.01, "{n} {r} {e}");
    assert!(detail(&c, "residual") < 0.005, "{c:?}");
}

#[test]
fn a_round_lobe_about_r_depends_on_r_alone() {
    let (f, c) = factors(&lights::smooth(), "phong-map:n=30", &[]);
    let [n, r, e] = deviations(&f);
    assert!(r > 0.2 && n < 0.015 && e < 0.015, "{n} {r} {e}");
    assert!(detail(&c, "residual") < 0.005, "{c:?}");
}

/// The factor over n·wo is the directional albedo.
#[test]
fn under_constant_light_it_depends_on_the_elevation_alone() {
    let spec = "ggx:alpha=0.25,f0=0.9/0.6/0.3";
    let (f, c) = factors(&lights::furnace(), spec, &[]);
    let [n, r, e] = deviations(&f);
    assert!(e > 0.01 && n < 0.005 && r < 0.005, "{n} {r} {e}");
    assert!(detail(&c, "residual") < 0.005, "{c:?}");
    let ratio = f64::from((f.line[47][2] - f.line[16][2]).exp());
    let albedo = |u: f64| {
        let d = steradian_brdf::dfg::ggx(u * u, 0.25);
        0.3 * d.scale + d.bias
    };
    let want = albedo(1.0) / albedo(16.0 / 47.0);
    assert!((ratio / want - 1.0).abs() < 0.02, "{ratio} {want}");
}

/// A sum of a function of n and one of r is no product: the residual says so.
#[test]
fn a_sum_of_lambert_and_phong_is_no_product() {
    let spec = "blinn-phong-gl:kd=0.4,ks=0.6,n=60";
    let (_, c) = factors(&lights::studio(), spec, &[]);
    assert!(detail(&c, "residual") > 0.03 && error(&lights::studio(), spec, &[]) > 0.03, "{c:?}");
}

/// Parameters that leave one map give that map alone.
#[test]
fn parameters_choose_the_factors() {
    let only_n = [("mirror", 0.0), ("elevation", 0.0)];
    let spec = "lambert:albedo=0.8/0.5/0.2";
    let (f, _) = factors(&lights::smooth(), spec, &only_n);
    assert!(f.used == [true, false, false, false] && f.cubes[1].size() == 1);
    let only_r = [("normal", 0.0), ("elevation", 0.0)];
    let [n, r] = [&only_n, &only_r].map(|only| error(&lights::smooth(), spec, only));
    assert!(n < 0.01 && r > 0.05, "{n} {r}");
    let small = ("size", 8.0);
    let with_wo = factors(&lights::studio(), "ggx:alpha=0.4,f0=1", &[("viewer", 1.0), small]).1;
    let without = factors(&lights::studio(), "ggx:alpha=0.4,f0=1", &[small]).1;
    assert!(detail(&with_wo, "residual") < detail(&without, "residual"), "{with_wo:?} {without:?}");
}

/// No factor at all leaves the mean; no light leaves nothing.
#[test]
fn limits() {
    let none = [("normal", 0.0), ("mirror", 0.0), ("elevation", 0.0)];
    let (f, _) = factors(&lights::furnace(), "lambert:albedo=0.5", &none);
    assert!((f.scale[0] - 0.5).abs() < 1e-3, "{:?}", f.scale);
    let (f, _) = factors(&Lights::default(), "lambert:albedo=0.5", &[]);
    assert_eq!((f.scale, error(&Lights::default(), "lambert:albedo=0.5", &[])), ([0.0; 3], 0.0));
}

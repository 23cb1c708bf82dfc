use super::icosahedron::vertex;
use super::*;
use crate::{AnyBake, PointsBuf, find};
use glam::{DVec3, Vec3};
use steradian_base::ParamValues;
use steradian_prefilter::probe;
use steradian_reference::{Lookup, Reference, ReferencePoint};
use steradian_sphere::Frame;

fn bake(lights: &Lights, spec: &str, params: &[(&str, f64)]) -> Box<dyn AnyBake> {
    let material = Material::new(steradian_brdf::parse(spec).unwrap());
    let values: ParamValues = params.iter().copied().collect();
    find("reflection-space-ibr").unwrap().draft(lights, &material, None, &values, &Task::quiet()).unwrap()
}

fn shade(b: &dyn AnyBake, points: &[ReferencePoint]) -> Vec<[f64; 3]> {
    let mut q = PointsBuf::default();
    for p in points {
        q.push(p.frame.n.as_vec3(), p.frame.t.as_vec3(), p.wo.as_vec3(), Vec3::ZERO);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; points.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    (0..points.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from)).collect()
}

/// Normals within 85° of `view`.
fn points(view: DVec3, n: usize) -> Vec<ReferencePoint> {
    let normals = (0..n).map(|k| probe::direction(k, n)).filter(|d| d.dot(view) > 0.087);
    normals.map(|d| ReferencePoint { frame: Frame::from_normal(d), wo: view, position: None }).collect()
}

fn error(b: &dyn AnyBake, lights: &Lights, spec: &str, points: &[ReferencePoint]) -> f64 {
    let reference = Reference::new(lights, Lookup::Constant, &Task::quiet()).unwrap();
    let brdf = steradian_brdf::parse(spec).unwrap();
    let exact = reference.radiance_batch(&*brdf, points, 1e-3, &Task::quiet()).unwrap();
    probe::relative_rms(shade(b, points).into_iter().zip(exact.iter().map(|e| e.rgb)))
}

/// wo = wo_i reproduces B_i, which is the integral itself, whatever the reflectance and however it is split.
#[test]
fn its_twelve_views_are_exact() {
    let lights = lights::studio();
    for (spec, split) in
        [("ggx:alpha=0.3,f0=0.9/0.6/0.3", 0.0), ("oren-nayar:sigma=0.5", 1.0), ("lambert:albedo=0.7", 0.0)]
    {
        let b = bake(&lights, spec, &[("diffuse_split", split)]);
        let points: Vec<_> = [0, 6, 11].iter().flat_map(|k| points(vertex(*k), 60)).collect();
        let e = error(&*b, &lights, spec, &points);
        assert!(e < 0.012, "{spec}: {e}");
    }
}

/// The negative control: a Lambertian surface depends on n, and the warp keeps r. Splitting it off cures it.
#[test]
fn lambert_is_wrong_as_published_and_right_when_split_off() {
    let lights = lights::studio();
    let spec = "lambert:albedo=0.8/0.5/0.2";
    let points: Vec<_> = (0..12).flat_map(|k| points(probe::direction(k, 12), 30)).collect();
    let of = |split: f64| error(&*bake(&lights, spec, &[("diffuse_split", split)]), &lights, spec, &points);
    let (published, split) = (of(0.0), of(1.0));
    assert!(published > 0.05, "{published}");
    assert!(split < 0.01, "{split}");
}

/// The warp that keeps n: right for reflectance that depends on n alone, exact at the twelve views, and wrong
/// for glossy reflectance, which depends on r.
#[test]
fn the_warp_may_keep_the_normal() {
    let lights = lights::studio();
    let by_n = [("warp", 0.0), ("diffuse_split", 0.0)];
    let points = |views: &[DVec3]| views.iter().flat_map(|v| points(*v, 30)).collect::<Vec<_>>();
    let between: Vec<_> = (0..12).map(|k| probe::direction(k, 12)).collect();
    let spec = "lambert:albedo=0.8/0.5/0.2";
    let lambert = error(&*bake(&lights, spec, &by_n), &lights, spec, &points(&between));
    assert!(lambert < 0.012, "{lambert}");
    let spec = "phong-map:n=30";
    let own = error(&*bake(&lights, spec, &by_n), &lights, spec, &points(&[vertex(0), vertex(7)]));
    assert!(own < 0.012, "{own}");
    let off = error(&*bake(&lights, spec, &by_n), &lights, spec, &points(&between));
    assert!(off > 0.2, "{off}");
}

/// B_i towards r = −wo_i is finite and within the range of its surroundings.
#[test]
fn the_singular_direction_holds_the_mean_around_it() {
    let b = bake(&lights::smooth(), "ggx:alpha=0.3,f0=1", &[]);
    let view = vertex(4);
    // Grazing views near wo_i with r near −wo_i.
    let near = |phi: f64, tilt: f64| {
        let side = view.any_orthonormal_vector();
        let n = side * phi.cos() + view.cross(side) * phi.sin();
        let n = (n + view * tilt).normalize();
        ReferencePoint { frame: Frame::from_normal(n), wo: view, position: None }
    };
    let values = |tilt| shade(&*b, &(0..16).map(|k| near(f64::from(k) * 0.39, tilt)).collect::<Vec<_>>());
    let (at, around) = (values(1e-3), values(0.05));
    let most = around.iter().map(|l| l[1]).fold(0.0, f64::max);
    assert!(at.iter().all(|l| l[1].is_finite() && l[1] >= 0.0 && l[1] < 2.0 * most), "{at:?} {around:?}");
}

#[test]
fn what_it_refuses_says_why() {
    let t = find("reflection_space_ibr").unwrap();
    let refused = (t.card().materials)(&*steradian_brdf::parse("ggx:ax=0.1,ay=0.2").unwrap()).unwrap_err();
    assert!(refused.contains("isotropic") && refused.contains("ggx"));
}

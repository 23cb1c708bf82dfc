use crate::View;
use crate::shared::trials::lights;
use crate::trial::Certified;
use crate::trial::{bake, detail, judged, points, shade, suns_turn_and_are_saved};
use glam::{Mat3, Vec3};
use steradian_prefilter::probe;
use steradian_reference::ReferencePoint;
use steradian_sphere::Frame;

const SPEC: &str = "ggx:alpha=0.36,f0=0.9/0.6/0.3";
const FIXED: [(&str, f64); 3] = [("p", 3.0), ("order", 16.0), ("size", 96.0)];

/// (5.14): local and global maps of the same orders are the same function.
#[test]
fn local_and_global_maps_agree() {
    let light = lights::studio();
    let local = bake("shrm", &light, SPEC, &[("p", 3.0), ("order", 16.0), ("size", 256.0)], None);
    let global = bake("shrm_global", &light, SPEC, &FIXED, None);
    for degrees in [0.0, 30.0, 60.0, 85.0] {
        let points = points(100, degrees);
        let pairs = shade(&*global, &points).into_iter().zip(shade(&*local, &points));
        let error = probe::relative_rms(pairs);
        assert!(error < 4e-3, "{degrees}: {error}");
    }
}

/// (5.35): for a far viewer the frame's one map is the sum of all, also under turned light.
#[test]
fn a_far_viewer_s_map_is_the_sum() {
    let light = lights::studio();
    let mut all = bake("shrm_global", &light, SPEC, &FIXED, None);
    let mut far = bake("shrm_global", &light, SPEC, &[&FIXED[..], &[("distant", 1.0)]].concat(), None);
    let forward = Vec3::new(0.3, -0.5, 0.8).normalize();
    let wo = -forward.as_dvec3();
    let seen = |k: usize| {
        let n = probe::direction(k, 200);
        ReferencePoint { frame: Frame::from_normal(if n.dot(wo) > 0.0 { n } else { -n }), wo, position: None }
    };
    // Towards the horizon n turns quicker than the texels of the map.
    let points: Vec<_> = (0..200).map(seen).filter(|p| p.frame.n.dot(wo) > 0.25).collect();
    for light_rotation in [Mat3::IDENTITY, Mat3::from_rotation_x(0.7) * Mat3::from_rotation_y(2.0)] {
        let view = View { forward, light_rotation, ..View::default() };
        all.frame(&view);
        far.frame(&view);
        assert!(far.gpu_frame().is_none() && far.gpu().tables[0].level.layers == 6);
        let error = probe::relative_rms(shade(&*far, &points).into_iter().zip(shade(&*all, &points)));
        assert!(error < 3e-3, "{error}");
    }
}

/// Harmonics of the view are one set of weights for all texels: the sum is exact.
#[test]
fn of_the_view_a_far_viewer_s_map_is_the_sum_to_rounding() {
    let light = lights::studio();
    let params = |distant: f64| [&FIXED[..], &[("of_view", 1.0), ("distant", distant)]].concat();
    let [mut all, mut far] = [0.0, 1.0].map(|d| bake("shrm_global", &light, SPEC, &params(d), None));
    let view = View { forward: Vec3::new(0.3, -0.5, 0.8).normalize(), ..View::default() };
    all.frame(&view);
    far.frame(&view);
    let wo = -view.forward.as_dvec3();
    let seen = |k: usize| {
        let n = probe::direction(k, 200);
        ReferencePoint { frame: Frame::from_normal(if n.dot(wo) > 0.0 { n } else { -n }), wo, position: None }
    };
    let points: Vec<_> = (0..200).map(seen).collect();
    let error = probe::relative_rms(shade(&*far, &points).into_iter().zip(shade(&*all, &points)));
    assert!(error < 1e-5, "{error}");
}

/// Strands need no frame about t: P + 1 cubes hold them as well as the local form does.
#[test]
fn strands_take_a_cube_for_each_p() {
    let light = lights::studio();
    let spec = "kajiya-kay:s=32";
    let b = bake("shrm_global", &light, spec, &[], None);
    let p = detail(&*b, "P");
    assert!(p > 5.0 && detail(&*b, "Q") == 0.0);
    assert_eq!(b.gpu().tables[0].level.layers, 6 * (p as usize + 1));
    let all: Vec<_> = [10.0, 40.0, 70.0].iter().flat_map(|v| points(40, *v)).collect();
    let error = judged(&[&*b], &light, spec, &all)[0];
    assert!(error < 0.05 && b.certified().error < 0.05, "{error} {}", b.certified().error);
}

/// The single map of the distant viewer leaves suns to exact shading too.
#[test]
fn suns_are_apart_from_cubes() {
    let light = lights::sunny();
    let mut b = bake("shrm_global", &light, SPEC, &[("lights", 1.0)], None);
    let error = judged(&[&*b], &light, SPEC, &points(60, 40.0))[0];
    assert!(error < 0.03, "{error}");
    suns_turn_and_are_saved(&mut *b);
    let mut far = bake("shrm_global", &light, SPEC, &[("lights", 1.0), ("distant", 1.0)], None);
    far.frame(&View { forward: Vec3::NEG_Z, ..View::default() });
    let p: Vec<_> = points(60, 40.0).into_iter().map(|p| towards_z(&p)).collect();
    let error = probe::relative_rms(shade(&*far, &p).into_iter().zip(shade(&*b, &p)));
    assert!(error < 0.02, "{error}");
}

/// The point turned so that it is seen from +z.
fn towards_z(p: &ReferencePoint) -> ReferencePoint {
    let r = glam::DQuat::from_rotation_arc(p.wo, glam::DVec3::Z);
    let frame = Frame { t: r * p.frame.t, b: r * p.frame.b, n: r * p.frame.n };
    ReferencePoint { frame, wo: glam::DVec3::Z, position: None }
}

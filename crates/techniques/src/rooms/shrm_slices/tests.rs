use super::*;
use crate::trial::Certified;
use crate::trial::{bake, detail, judged, points, suns_turn_and_are_saved};
use glam::DVec3;
use steradian_base::{ParamValues, Params as _};
use steradian_light::Environment;
use steradian_reference::ReferencePoint;
use steradian_sphere::{Frame, Layout, SphereImage};

#[test]
fn places_and_angles_are_inverse() {
    for degrees in [0.0f32, 3.0, 41.0, 77.7, 89.0] {
        let s = material::place(degrees.to_radians());
        let back = 89.5 * (1.0 - (1.0 - s) * (1.0 - s));
        assert!((back - degrees).abs() < 2e-3, "{degrees}: {back}");
    }
    assert_eq!(material::place(std::f32::consts::FRAC_PI_2), 1.0);
}

/// A radially symmetric lobe has one shape at every elevation: two slices of one map; Lambert's too, about n.
#[test]
fn symmetric_lobes_need_one_map_a_slice() {
    for spec in ["phong-normalized:s=30", "lambert:albedo=0.5"] {
        let b = bake("shrm_slices", &lights::smooth(), spec, &[], None);
        assert_eq!((detail(&*b, "components"), detail(&*b, "maps")), (1.0, 1.0), "{spec}");
    }
}

/// Against the reference, elevation by elevation up to 85°: within 3 %, better than the split sum and than
/// `shrm`.
#[test]
fn every_elevation_is_within_3_percent() {
    let spec = "ggx:alpha=0.36,f0=0.9/0.6/0.3";
    let light = lights::studio();
    let b = bake("shrm_slices", &light, spec, &[], Some(0.03));
    assert!(b.certified().error < 0.03);
    let [maps, split] = ["shrm", "split_sum"].map(|slug| bake(slug, &light, spec, &[], None));
    for degrees in [5.0, 40.0, 60.0, 75.0, 85.0] {
        let e = judged(&[&*b, &*maps, &*split], &light, spec, &points(60, degrees));
        assert!(e[0] < 0.03 && e[0] < e[1] && e[0] < e[2], "{degrees}: {e:?}");
    }
}

/// Under a sun the kernel itself must be represented: more orders, the same tolerance. Few frames see the
/// sun, so many are tried.
#[test]
fn a_small_sun_is_held_up_to_80_degrees() {
    let spec = "ggx:alpha=0.36,f0=0.9/0.6/0.3";
    let light = lights::sunny();
    let b = bake("shrm_slices", &light, spec, &[], Some(0.03));
    for degrees in [20.0, 60.0, 80.0] {
        let e = judged(&[&*b], &light, spec, &points(600, degrees))[0];
        assert!(e < 0.03, "{degrees}: {e}");
    }
}

/// Lamps that outshine all else are shaded exactly though maps of all light err less in the mean square:
/// beside their reflections, where that hardly looks, the maps ring.
#[test]
fn few_lights_that_outshine_the_rest_are_taken_out() {
    let spec = "ggx:alpha=0.1";
    let lamps = [DVec3::new(0.2, 0.9, 0.3), DVec3::new(-0.8, 0.3, 0.5)].map(DVec3::normalize);
    let radiance = |d: DVec3| {
        let lamp = lamps.iter().any(|l| d.angle_between(*l) < 0.06);
        if lamp { [3e3f32, 2.8e3, 2.6e3] } else { [0.2 + 0.1 * d.y as f32; 3] }
    };
    let image = SphereImage::from_fn(Layout::LatLong, 256, 128, radiance);
    let light = Lights::from(Environment { image });
    let b = bake("shrm_slices", &light, spec, &[], None);
    let maps = bake("shrm_slices", &light, spec, &[("lights", 0.0)], None);
    println!("{} lights, {} {}", detail(&*b, "lights"), b.certified().error, maps.certified().error);
    // A fifth to a half of a radian from a lamp's reflection.
    let beside = |p: &ReferencePoint| {
        let r = 2.0 * p.wo.dot(p.frame.n) * p.frame.n - p.wo;
        let off = lamps.map(|l| r.angle_between(l));
        off[0].min(off[1]) > 0.2 && off[0].min(off[1]) < 0.5
    };
    let near: Vec<ReferencePoint> = points(1000, 60.0).into_iter().filter(beside).collect();
    let e = judged(&[&*b, &*maps], &light, spec, &near);
    println!("{e:?} at {} points", near.len());
    assert!(detail(&*b, "lights") > 0.0 && near.len() > 50 && e[0] < 0.5 * e[1], "{e:?}");
}

/// A stricter tolerance costs no fewer bytes.
#[test]
fn bytes_follow_the_tolerance() {
    for (light, tolerances) in [(lights::studio(), [0.3, 0.03]), (lights::sunny(), [0.3, 0.1])] {
        let made = |t: &f64| bake("shrm_slices", &light, "microfacet:sigma=0.2", &[], Some(*t));
        let bytes: Vec<usize> = tolerances.iter().map(|t| made(t).bytes()).collect();
        assert!(bytes.is_sorted(), "{bytes:?}");
    }
}

#[test]
fn memory_bounds_the_maps_and_the_certificate_says_so() {
    let spec = "ggx:alpha=0.2,f0=0.9";
    let light = lights::studio();
    let values = ParamValues::default();
    let p = Params::from_values(&values).unwrap();
    let m = ShrmSlices::material(&Material::new(steradian_brdf::parse(spec).unwrap()), &p, &Task::quiet())
        .unwrap();
    let l = ShrmSlices::light(&light, &p, &Task::quiet()).unwrap();
    let linked = |mebibytes: f64| {
        let p = Params { mebibytes: Some(mebibytes), lights: Some(0), ..p.clone() };
        bake::link(&l, &m, &p, &Task::quiet()).unwrap()
    };
    let ((wide, wide_c), (narrow, narrow_c)) = (linked(96.0), linked(0.25));
    let bytes = |s: &SliceMaps| s.levels.iter().map(|l| l.maps.bytes()).sum::<usize>();
    assert!(bytes(&narrow) <= 1 << 18 && bytes(&narrow) < bytes(&wide));
    let error = |r: &Report| r.estimate.as_ref().unwrap().error;
    assert!(error(&narrow_c) > error(&wide_c));
    let small = Task::quiet().with_max_memory(1000);
    assert!(matches!(bake::link(&l, &m, &p, &small), Err(BakeError::Memory { .. })));
}

/// Where a lobe is cut by the horizon, under the hardest edge there is: the sun is shaded exactly, and turns
/// with the light.
#[test]
fn suns_are_exact_and_turn() {
    let spec = "microfacet:sigma=0.2";
    let light = lights::sunny();
    let mut b = bake("shrm_slices", &light, spec, &[], Some(0.03));
    for degrees in [60.0, 85.0] {
        let e = judged(&[&*b], &light, spec, &points(300, degrees))[0];
        assert!(e < 0.03, "{degrees}: {e}");
    }
    suns_turn_and_are_saved(&mut *b);
}

/// The horizon crosses a sun of a few texels, of which lobes that do not end there see a part: at points
/// where it does, seen from the opposite side.
#[test]
fn suns_keep_their_outline_at_the_horizon() {
    let spec = "blinn-phong-gl:n=20";
    let mut image = SphereImage::from_fn(Layout::LatLong, 128, 64, |d| [1.0 + 0.5 * d.x as f32; 3]);
    for (i, j, l) in [(40, 24, 9e3), (41, 24, 5e3), (40, 25, 2e3)] {
        let k = image.index(0, i, j);
        image.planes.iter_mut().for_each(|p| p[k] = l);
    }
    let turn = |u: f64| (std::f64::consts::TAU * u).sin_cos();
    let theta = std::f64::consts::PI * 24.6 / 64.0;
    let (s, c) = turn(40.6 / 128.0 - 0.5);
    let sun = DVec3::new(theta.sin() * c, theta.cos(), theta.sin() * s);
    let (a, b) = sun.any_orthonormal_pair();
    let point = |k: usize| {
        let (s, c) = turn(k as f64 * 0.569_840_291);
        let height = (8.0 * (k as f64 * 0.754_877_666).fract() - 4.0).to_radians();
        let n = (a * c + b * s) * height.cos() + sun * height.sin();
        let frame = Frame::from_normal_tangent(n, sun);
        let (s, c) = (85.0 + 4.0 * (k as f64 * 0.618_034).fract()).to_radians().sin_cos();
        ReferencePoint { frame, wo: frame.to_world(DVec3::new(-s, 0.0, c)), position: None }
    };
    let points: Vec<ReferencePoint> = (0..80).map(point).collect();
    let light = Lights::from(Environment::from_image(image));
    let [apart, whole] = [-1.0, 0.0].map(|n| bake("shrm_slices", &light, spec, &[("lights", n)], Some(0.03)));
    let e = judged(&[&*apart, &*whole], &light, spec, &points);
    assert!(e[0] < 0.03 && e[0] < 0.2 * e[1], "{e:?}");
}

/// The text of exactly shaded lights is a module of its own, next to the reflectance's.
#[test]
fn modules_with_lights_are_valid() {
    for spec in ["ggx:alpha=0.3", "lafortune:@skin", "sgd:gold-paint", "kajiya-kay:s=16"] {
        let b = bake(
            "shrm_slices",
            &lights::sunny(),
            spec,
            &[("lights", 3.0), ("size", 8.0), ("order", 24.0)],
            None,
        );
        let text = crate::gpu::module(&b.gpu());
        let module = naga::front::wgsl::parse_str(&text).map_err(|e| e.emit_to_string(&text));
        let flags = naga::valid::ValidationFlags::all();
        let valid = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty())
            .validate(&module.unwrap_or_else(|e| panic!("{spec}: {e}")));
        assert!(valid.is_ok() && text.contains("exact_brdf_value"), "{spec}: {:?}", valid.err());
    }
}

//! Closed forms of caps, and every model against the reference.

use super::rule::{Cap, rings};
use super::*;

use crate::PointsBuf;
use glam::Vec3;
use std::f64::consts::PI;
use steradian_base::Task;
use steradian_light::Environment;
use steradian_reference::{Lookup, Reference};
use steradian_scene::{Bvh, Mesh};
use steradian_sphere::{Layout, SphereImage};

#[test]
fn caps_have_their_solid_angle_and_their_irradiance() {
    for radius in [1e-3, 0.00465, 0.1, 0.6] {
        for n in [0, 1, 2, 4, 8, 16] {
            let cap = Cap { centre: DVec3::new(0.48, 0.6, 0.64), radius };
            let one = cap.polar(n, |_| [1.0; 3])[0];
            assert!((one / cap.solid_angle() - 1.0).abs() < 1e-12);
            // ∫ cos θ over a cap that is wholly visible: π sin²ρ (c·n).
            let e = cap.polar(n, |w| [w.z; 3])[0];
            if n > 0 {
                assert!((e / (PI * radius.sin().powi(2) * 0.64) - 1.0).abs() < 1e-12, "{radius} {n} {e}");
            }
        }
        // Half below the horizon: by symmetry half the solid angle, and 2/3 ρ³ of irradiance for small ρ.
        let cap = Cap { centre: DVec3::new(0.6, 0.8, 0.0), radius };
        let half = cap.strips(8, |_| [1.0; 3])[0];
        assert!((half / (0.5 * cap.solid_angle()) - 1.0).abs() < 1e-6, "{radius} {half}");
        let e = cap.strips(8, |w| [w.z; 3])[0];
        // Lambert 1760: the irradiance of a cap cut in half by the horizon is (ρ − sin ρ cos ρ).
        let exact = radius - radius.sin() * radius.cos();
        assert!((e / exact - 1.0).abs() < 1e-5, "{radius} {e} {exact}");
    }
}

#[test]
fn rules_grow_with_the_ratio() {
    assert_eq!(rings(0.001, false), Some(0));
    assert_eq!(rings(0.1, false), Some(1));
    assert_eq!(rings(0.1, true), Some(8));
    assert_eq!(rings(14.0, false), Some(16));
    assert_eq!(rings(40.0, true), None);
}

#[test]
fn suns_are_split_off_or_stay() {
    let lights = crate::shared::trials::lights::sunny();
    let (baked, direct) = split(&lights, Suns::Exact);
    assert!(baked.disks.is_empty() && direct.disks.len() == 1 && baked.environment.is_some());
    let (baked, direct) = split(&lights, Suns::Fold);
    assert!(baked.disks.len() == 1 && direct.is_empty());
}

const SPECS: &[&str] = &[
    "lambert:albedo=0.8/0.5/0.2",
    "oren-nayar:sigma=0.5",
    "oren-nayar:sigma=0.5,variant=full",
    "minnaert:k=0.6",
    "phong:n=2000",
    "phong-map:n=30",
    "phong-normalized:s=30",
    "blinn-phong:n=3000",
    "blinn-phong-gl:kd=0.3,ks=0.5,n=40",
    "microfacet:sigma=0.02",
    "cook-torrance:m=0.02,f0=0.9/0.7/0.3",
    "cook-torrance:m=0.2,g=smith",
    "ggx:alpha=0.0005",
    "ggx:alpha=0.003",
    "ggx:alpha=0.02",
    "ggx:alpha=0.3,scale=0.5/0.25/2",
    "ggx:ax=0.005,ay=0.2",
    "ward:ax=0.01,ay=0.1",
    "ashikhmin-shirley:nu=10,nv=10000,rd=0.2",
    "lafortune:@skin",
    "banks:n=4000",
    "kajiya-kay:s=300",
    "poulin-fournier:d=2,n=30",
    "poulin-fournier:d=3,h=0.4,kd=0.5,ks=0.3,n=300",
    "sgd:gold-metallic-paint",
    "abc:gold-metallic-paint",
];

/// Views and disks: on the lobe's ridge, next to it, far from it, across the horizon.
fn cases() -> Vec<(DVec3, DVec3)> {
    let mut out = Vec::new();
    for theta in [0.0f64, 0.5, 1.0, 1.4] {
        let wo = DVec3::new(theta.sin() * 0.6, theta.sin() * 0.8, theta.cos());
        let r = DVec3::new(-wo.x, -wo.y, wo.z);
        for off in [DVec3::ZERO, DVec3::new(0.002, 0.001, 0.0), DVec3::new(-0.02, 0.05, 0.01)] {
            out.push((wo, (r + off).normalize()));
        }
        out.push((wo, DVec3::new(0.3, -0.7, 0.5).normalize()));
        out.push((wo, DVec3::new(-0.6, -0.8, 0.002).normalize()));
        out.push((wo, DVec3::new(0.8, -0.6, -0.001).normalize()));
    }
    out
}

/// Relative to the largest radiance that the disk causes in any case.
#[test]
fn every_model_follows_the_reference() {
    let task = Task::quiet();
    let frame = Frame::from_normal(DVec3::Y);
    let mut report = Vec::new();
    for spec in SPECS {
        let brdf = steradian_brdf::parse(spec).expect(spec);
        for radius in [0.00465, 0.06] {
            let (mut top, mut worst) = (0.0f64, 0.0f64);
            for (wo, wi) in cases() {
                let d =
                    DiskLight { direction: frame.to_world(wi), angular_radius: radius, radiance: [1.0; 3] };
                let direct = Direct { disks: vec![d], ..Direct::default() };
                let lights = Lights { disks: vec![d], ..Lights::default() };
                let reference =
                    Reference::new(&lights, Lookup::Constant, &task).expect("sound").with_budget(400_000);
                let exact = reference.radiance(&*brdf, &frame, frame.to_world(wo), None, 1e-6);
                let got = direct.radiance(&*brdf, &frame, frame.to_world(wo), None);
                assert!(got.iter().all(|v| v.is_finite()), "{spec}");
                top = exact.rgb.iter().fold(top, |a, x| a.max(*x));
                let off = (0..3).map(|c| (got[c] - exact.rgb[c]).abs()).fold(0.0, f64::max);
                worst = worst.max((off - exact.error * exact.rgb[0].max(exact.rgb[1])).max(0.0));
            }
            report.push((worst / top, *spec, radius));
        }
    }
    report.sort_by(|a, b| b.0.total_cmp(&a.0));
    assert!(report[0].0 < 1e-3, "{:#?}", &report[..12]);
}

/// Texels are cells, also across the horizon and at the pole: models of every kind against the reference,
/// which integrates the image; relative to the largest radiance that a texel causes in any case.
#[test]
fn texels_follow_the_reference() {
    let task = Task::quiet();
    let frame = Frame::from_normal(DVec3::new(0.3, 0.8, -0.5).normalize());
    let mut report = Vec::new();
    for spec in SPECS.iter().step_by(3) {
        let brdf = steradian_brdf::parse(spec).expect(spec);
        for height in [16usize, 64] {
            let (mut top, mut worst) = (0.0f64, 0.0f64);
            for (wo, wi) in cases().into_iter().step_by(2).chain([(DVec3::Z, frame.to_local(DVec3::Y))]) {
                let (d, width) = (frame.to_world(wi), 2 * height);
                let column = ((0.5 + d.z.atan2(d.x) / (2.0 * PI)) * width as f64) as usize;
                let (i, j) = (column.min(width - 1), (d.y.acos() / PI * height as f64) as usize);
                let cell = CellLight { radiance: [1.0; 3], ..CellLight::texel(i, j, width, height) };
                let mut image = SphereImage::new(Layout::LatLong, width, height);
                let k = image.index(0, i, j);
                image.planes.iter_mut().for_each(|p| p[k] = 1.0);
                assert!((image.integral()[0] / cell.solid_angle() - 1.0).abs() < 1e-6);
                let lights = Lights::from(Environment { image });
                let reference =
                    Reference::new(&lights, Lookup::Constant, &task).expect("sound").with_budget(400_000);
                let exact = reference.radiance(&*brdf, &frame, frame.to_world(wo), None, 1e-5);
                let direct = Direct { cells: vec![cell], ..Direct::default() };
                let got = direct.radiance(&*brdf, &frame, frame.to_world(wo), None);
                top = exact.rgb.iter().fold(top, |a, x| a.max(*x));
                let off = (0..3).map(|c| (got[c] - exact.rgb[c]).abs()).fold(0.0, f64::max);
                worst = worst.max((off - exact.error * exact.rgb[0].max(exact.rgb[1])).max(0.0));
            }
            report.push((worst / top, *spec, height));
        }
    }
    report.sort_by(|a, b| b.0.total_cmp(&a.0));
    assert!(report[0].0 < 1e-3, "{report:#?}");
}

/// A texel straight above the mirror direction of a grazing view: the tail of D is as narrow there, across
/// the plane of incidence, as the half vector tilts fast.
#[test]
fn a_tail_above_a_grazing_ridge_is_narrow() {
    let n = DVec3::new(-0.950_971_9, 0.140_919_3, -0.275_307_3).normalize();
    let frame = Frame::from_normal_tangent(n, DVec3::new(0.066_982_9, -0.775_191_9, -0.628_164_6));
    let wo = frame.to_world(DVec3::new(0.828_315_5, 0.558_667_5, 0.042_237_5).normalize());
    let d = frame.to_world(DVec3::new(-0.819_167_3, -0.561_164_1, 0.118_573_8).normalize());
    let (width, height) = (128, 64);
    let column = ((0.5 + d.z.atan2(d.x) / (2.0 * PI)) * width as f64) as usize;
    let (i, j) = (column, (d.y.acos() / PI * height as f64) as usize);
    let mut image = SphereImage::new(Layout::LatLong, width, height);
    let k = image.index(0, i, j);
    image.planes.iter_mut().for_each(|p| p[k] = 1.0);
    let lights = Lights::from(Environment { image });
    let reference = Reference::new(&lights, Lookup::Constant, &Task::quiet()).expect("sound");
    let cell = CellLight { radiance: [1.0; 3], ..CellLight::texel(i, j, width, height) };
    for spec in ["abc:alum-bronze", "ggx:alpha=0.02,f0=1", "sgd:alum-bronze"] {
        let brdf = steradian_brdf::parse(spec).expect(spec);
        let exact = reference.radiance(&*brdf, &frame, wo, None, 1e-5).rgb;
        let direct = Direct { cells: vec![cell], ..Direct::default() };
        let got = direct.radiance(&*brdf, &frame, wo, None);
        (0..3).for_each(|c| assert!((got[c] / exact[c] - 1.0).abs() < 1e-3, "{spec}: {got:?} {exact:?}"));
    }
}

/// Views from 3° above the horizon to a hundredth of one, and suns about their mirror directions that the
/// horizon cuts or nearly cuts: lobes are as narrow there, across the plane of incidence, as n·wi + n·wo is
/// small. Relative to the largest radiance at that view.
#[test]
fn suns_at_the_horizon_follow_the_reference() {
    let task = Task::quiet();
    let frame = Frame::from_normal(DVec3::new(0.3, 0.8, -0.5).normalize());
    let mut report = Vec::new();
    for spec in [
        "cook-torrance:m=0.127,f0=0.25",
        "ggx:alpha=0.1,f0=0.9",
        "ggx:alpha=0.4",
        "blinn-phong:n=100",
        "ggx:ax=0.05,ay=0.3",
        "ggx:alpha=1e-4",
        "sgd:chrome-steel",
    ] {
        let brdf = steradian_brdf::parse(spec).expect(spec);
        for cosine in [0.05f64, 0.02, 7e-3, 2e-3, 2e-4] {
            let s = (1.0 - cosine * cosine).sqrt();
            let wo = frame.to_world(DVec3::new(0.6 * s, 0.8 * s, cosine));
            let (mut top, mut worst) = ([0.0f64; 2], [0.0f64; 2]);
            for (up, aside) in [(-0.016, 0.004), (0.0, 0.0), (0.01, 0.01), (0.03, -0.002)] {
                let azimuth = 0.8f64.atan2(0.6) + PI + aside;
                let wi: DVec3 = DVec3::new(azimuth.cos(), azimuth.sin(), up).normalize();
                let d = frame.to_world(wi);
                let disk = DiskLight { direction: d, angular_radius: 0.02, radiance: [1.0; 3] };
                let (width, height) = (128, 64);
                let column = ((0.5 + d.z.atan2(d.x) / (2.0 * PI)) * width as f64) as usize;
                let (i, j) = (column.min(width - 1), (d.y.acos() / PI * height as f64) as usize);
                let cell = CellLight { radiance: [1.0; 3], ..CellLight::texel(i, j, width, height) };
                let mut image = SphereImage::new(Layout::LatLong, width, height);
                let k = image.index(0, i, j);
                image.planes.iter_mut().for_each(|p| p[k] = 1.0);
                let cases = [
                    (
                        Direct { disks: vec![disk], ..Direct::default() },
                        Lights { disks: vec![disk], ..Lights::default() },
                    ),
                    (Direct { cells: vec![cell], ..Direct::default() }, Lights::from(Environment { image })),
                ];
                for (k, (direct, lights)) in cases.into_iter().enumerate() {
                    let reference = Reference::new(&lights, Lookup::Constant, &task)
                        .expect("sound")
                        .with_budget(2_000_000);
                    let exact = reference.radiance(&*brdf, &frame, wo, None, 1e-5);
                    let got = direct.radiance(&*brdf, &frame, wo, None)[0];
                    top[k] = top[k].max(exact.rgb[0]);
                    worst[k] = worst[k].max((got - exact.rgb[0]).abs() - exact.error * exact.rgb[0]);
                }
            }
            (0..2).for_each(|k| report.push((worst[k] / top[k], spec, cosine, ["disk", "texel"][k])));
        }
    }
    report.sort_by(|a, b| b.0.total_cmp(&a.0));
    let bound = |spec: &str| if spec.starts_with("sgd") { 5e-3 } else { 2e-3 };
    assert!(report.iter().all(|r| r.0 < bound(r.1)), "{:#?}", &report[..12]);
}

/// Half of a sun behind an edge; unoccluded lights, and occluded ones.
#[test]
fn rays_shadow_what_stands_behind_the_mesh() {
    // The half plane x > 0 one metre above the point.
    let positions = vec![
        Vec3::new(0.0, 1.0, -50.0),
        Vec3::new(0.0, 1.0, 50.0),
        Vec3::new(50.0, 1.0, 50.0),
        Vec3::new(50.0, 1.0, -50.0),
    ];
    let mesh = Mesh {
        normals: vec![Vec3::Y; 4],
        positions,
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        ..Mesh::default()
    };
    let bvh = Bvh::build(&mesh);
    let shadows = Some(Shadows { by: &bvh, offset: 1e-4, reference: false });
    let brdf = steradian_brdf::parse("lambert:albedo=0.5").expect("spec");
    let mut q = PointsBuf::default();
    q.push(Vec3::Y, Vec3::X, Vec3::Y, Vec3::ZERO);
    let shade = |d: &Direct, shadows| {
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0]);
        d.add_behind(shadows, &*brdf, &q.as_points(), &mut Radiance::of(&mut rgb));
        rgb[0][0]
    };
    let share = |d: Direct| shade(&d, shadows) / shade(&d, None);
    let disk = |x: f64| {
        let direction = DVec3::new(x, 1.0, 0.0).normalize();
        Direct {
            disks: vec![DiskLight { direction, angular_radius: 0.1, radiance: [1.0; 3] }],
            ..Direct::default()
        }
    };
    assert!((share(disk(0.0)) - 0.5).abs() < 0.04, "{}", share(disk(0.0)));
    assert_eq!((share(disk(-0.2)), share(disk(0.2))), (1.0, 0.0));
    let texel = |i: usize| Direct {
        cells: vec![CellLight { radiance: [1.0; 3], ..CellLight::texel(i, 4, 64, 32) }],
        ..Direct::default()
    };
    // Column 0 lies at −x, the middle ones at +x.
    assert_eq!((share(texel(0)), share(texel(32))), (1.0, 0.0));
    let to = |x: f64| DVec3::new(x, 1.0, 0.0).normalize();
    let sun = |x: f64| Direct {
        directionals: vec![DirectionalLight { direction: to(x), irradiance: [1.0; 3] }],
        ..Direct::default()
    };
    assert_eq!((share(sun(-0.1)), share(sun(0.1))), (1.0, 0.0));
    let point = |height: f32| Direct {
        points: vec![PointLight { position: Vec3::new(0.2, height, 0.0), intensity: [1.0; 3] }],
        ..Direct::default()
    };
    assert_eq!((share(point(0.9)), share(point(1.5))), (1.0, 0.0));
}

#[test]
fn directional_and_point_lights_are_products() {
    let brdf = steradian_brdf::parse("ggx:alpha=0.3").expect("spec");
    let to = Vec3::new(1.0, 2.0, 2.0);
    let point = PointLight { position: to, intensity: [9.0, 18.0, 27.0] };
    let sun = DirectionalLight { direction: DVec3::new(1.0, 2.0, 2.0) / 3.0, irradiance: [1.0, 2.0, 3.0] };
    let q = {
        let mut q = PointsBuf::default();
        q.push(Vec3::Y, Vec3::X, Vec3::new(0.6, 0.8, 0.0), Vec3::ZERO);
        q.push(Vec3::Y, Vec3::X, Vec3::new(0.6, -0.8, 0.0), Vec3::ZERO);
        q
    };
    let shade = |d: Direct| {
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![1.0; 2]);
        d.add(&*brdf, &q.as_points(), &mut Radiance::of(&mut rgb));
        rgb
    };
    let a = shade(Direct { points: vec![point], ..Direct::default() });
    let b = shade(Direct { directionals: vec![sun], ..Direct::default() });
    for c in 0..3 {
        assert!((a[c][0] - b[c][0]).abs() < 1e-6 && a[c][0] > 1.0, "{a:?} {b:?}");
        assert_eq!(a[c][1], 1.0);
    }
}

#[test]
fn distant_lights_turn_and_points_stay() {
    let disk = DiskLight { direction: DVec3::X, angular_radius: 0.1, radiance: [1.0; 3] };
    let point = PointLight { position: Vec3::X, intensity: [1.0; 3] };
    let d = Direct { disks: vec![disk], points: vec![point], ..Direct::default() };
    let view =
        View { light_rotation: glam::Mat3::from_rotation_y(0.5 * std::f32::consts::PI), ..View::default() };
    let t = d.turned(&view);
    assert!((t.disks[0].direction - DVec3::NEG_Z).length() < 1e-6 && t.points == d.points);
}

#[test]
fn wide_disks_are_skies() {
    let disk = |angular_radius: f64| DiskLight { direction: DVec3::Y, angular_radius, radiance: [1.0; 3] };
    let lights = Lights { disks: vec![disk(0.2), disk(1.0)], ..Lights::default() };
    let (baked, direct) = split(&lights, Suns::Exact);
    assert_eq!((baked.disks, direct.disks), (vec![disk(1.0)], vec![disk(0.2)]));
    let (baked, direct) = split(&lights, Suns::Fold);
    assert_eq!((baked.disks.len(), direct.disks.len()), (2, 0));
}

/// A point light near a surface, and on it: radiance is finite in single precision too.
#[test]
fn a_point_light_on_a_surface_gives_finite_radiance() {
    let brdf = steradian_brdf::parse("ggx:alpha=0.01").expect("spec");
    let mut q = PointsBuf::default();
    q.push(Vec3::Y, Vec3::X, Vec3::new(0.6, 0.8, 0.0), Vec3::ZERO);
    let mut seen = 0.0;
    for d in [0.0f32, 1e-30, 1e-20, 1e-10] {
        let position = Vec3::new(-0.6, 0.8, 0.0) * d;
        let points = vec![PointLight { position, intensity: [1e3, 9e29, -9e29] }; 3];
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0]);
        let direct = Direct { points, ..Direct::default() };
        direct.add(&*brdf, &q.as_points(), &mut Radiance::of(&mut rgb));
        assert!(rgb.iter().flatten().all(|x| x.is_finite()), "{d}: {rgb:?}");
        seen += rgb[0][0];
    }
    assert!(seen > 1e20);
}

use super::light::moment;
use super::*;
use crate::trial::Certified;
use crate::{AnyBake, PointsBuf, find};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use steradian_base::{ParamValues, Progress};
use steradian_brdf::fit::gaussian::{GaussianFit, GaussianLobe, HalfFit, Plan};
use steradian_brdf::model::lobes::Lobes;
use steradian_brdf::parse;

fn bake(lights: &Lights, spec: &str, params: &[(&str, f64)], task: &Task) -> Box<dyn AnyBake> {
    let values: ParamValues = params.iter().copied().collect();
    let material = Material::new(parse(spec).expect(spec));
    find("gaussian-lobes").expect("registered").draft(lights, &material, None, &values, task).expect("baked")
}

fn params() -> Params {
    Params::read(&ParamValues::default()).expect("defaults")
}

/// Normal, tangent and view of point k.
fn point(k: usize) -> [Vec3; 3] {
    let n = steradian_prefilter::probe::direction(k, 64).as_vec3();
    let t = n.any_orthonormal_vector();
    let c = [1.0, 0.9, 0.6, 0.3][k % 4];
    [n, t, n * c + t * (1.0f32 - c * c).sqrt()]
}

fn points() -> PointsBuf {
    let mut q = PointsBuf::default();
    for [n, t, wo] in (0..64).map(point) {
        q.push(n, t, wo, Vec3::ZERO);
    }
    q
}

fn shade(b: &dyn AnyBake) -> Vec<[f64; 3]> {
    let q = points();
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    (0..q.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from)).collect()
}

/// Phong's lobe of exponent n is the Gaussian of σ² = 1/n up to O(1/n): one lobe gives Phong's own map (eq.
/// 5).
#[test]
fn phong_by_one_lobe_is_phongs_map() {
    let (light, task) = (lights::smooth(), Task::quiet());
    let error = |n: f64| {
        let spec = format!("phong-normalized:s={n},scale=1/0.7/0.2");
        let own = bake(&light, &spec, &[("lobes", 1.0)], &task);
        let map = find("phong-diffuse-maps").expect("registered");
        let material = Material::new(parse(&spec).expect("spec"));
        let map = map.draft(&light, &material, None, &ParamValues::default(), &task).expect("baked");
        steradian_prefilter::probe::relative_rms(shade(&*own).into_iter().zip(shade(&*map)))
    };
    let errors = [20.0, 200.0].map(error);
    assert!(errors[0] < 0.02 && errors[1] < 5e-3, "{errors:?}");
}

/// Levels are chosen by second moments, and moments by the closed form.
#[test]
fn levels_mix_to_the_lobes_second_moment() {
    let task = Task::quiet();
    let light = Light::bake(&lights::furnace(), &params(), &task).expect("baked");
    assert!(light.sigmas[1..].windows(2).all(|w| (w[1] / w[0] - 2.0).abs() < 1e-12));
    let [narrow, wide] = light.range();
    for k in 0..100 {
        let sigma = narrow * (wide / narrow).powf(f64::from(k) / 99.0);
        let level = light.level(sigma);
        let (a, t) = (level as usize, level.fract());
        let b = (a + 1).min(light.sigmas.len() - 1);
        let mixed = (1.0 - t) * moment(light.sigmas[a]) + t * moment(light.sigmas[b]);
        assert!((mixed / moment(sigma) - 1.0).abs() < 1e-9, "{sigma}: {mixed}");
    }
    // 1 − ∫ cos θ G by quadrature.
    for sigma in [0.05, 0.3, 1.0f64] {
        let (mut sum, mut all) = (0.0, 0.0);
        for i in 0..20_000 {
            let x = -1.0 + (f64::from(i) + 0.5) / 10_000.0;
            let g = ((x - 1.0) / (sigma * sigma)).exp();
            sum += (1.0 - x) * g;
            all += g;
        }
        assert!((moment(sigma) / (sum / all) - 1.0).abs() < 1e-3, "{sigma}");
    }
}

#[derive(Default)]
struct Counted(AtomicUsize);

impl Progress for Counted {
    fn begin(&self, label: &str, _: u64) {
        self.0.fetch_add(usize::from(label == "prefilter"), Ordering::Relaxed);
    }
    fn advance(&self, _: u64) {}
    fn end(&self) {}
}

/// Neither another material nor a rotated light filters the light again.
#[test]
fn one_chain_serves_every_material() {
    let counted = Arc::new(Counted::default());
    let task = Task::quiet().with_progress(counted.clone());
    let light = lights::studio();
    let first = bake(&light, "ggx:alpha=0.2", &[], &task);
    assert_eq!(counted.0.load(Ordering::Relaxed), 1);
    for spec in ["sgd:chrome", "lambert:albedo=0.5", "abc:blue-acrylic"] {
        let other =
            first.preview(None, Some(&Material::new(parse(spec).expect(spec))), &task).expect("linked");
        assert_eq!(counted.0.load(Ordering::Relaxed), 1);
        let anew = bake(&light, spec, &[], &Task::quiet());
        assert_eq!(shade(&*other), shade(&*anew), "{spec}");
    }
}

/// A reflectance that already is a fit is used as it is.
#[test]
fn a_given_fit_is_not_fitted_again() {
    let source = parse("ggx:alpha=0.3,f0=0.8/0.5/0.2").expect("spec");
    let plan = Plan { lobes: 2, views: 9, ..Plan::default() };
    let fit = GaussianFit::new(&*source, plan, &Task::quiet()).expect("not cancelled");
    let brdf = Arc::new(Lobes::new("lobes:a.safetensors".into(), fit.clone()));
    let fitted = Fitted::new(&Material::new(brdf), &params(), &Task::quiet()).expect("taken");
    assert_eq!(fitted.fit, bake::Fit::Lobes(fit));
}

/// Turning the view by a quarter of a degree changes radiance by no larger steps than the light itself makes
/// ("temporally coherent", section 6 of the paper).
#[test]
fn views_follow_each_other_without_steps() {
    let (light, task) = (lights::studio(), Task::quiet());
    let b = bake(&light, "ggx:alpha=0.2,f0=0.9", &[], &task);
    let (n, t) = (Vec3::Y, Vec3::X);
    let mut q = PointsBuf::default();
    for k in 0..340 {
        let (s, c) = (0.25 * k as f32).to_radians().sin_cos();
        q.push(n, t, n * c + t * s, Vec3::ZERO);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    let largest = rgb[1].iter().copied().fold(0.0, f32::max);
    let step = rgb[1].windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
    assert!(step < 0.03 * largest, "{step} of {largest}");
}

/// Lookups along a stretched lobe against the integral of the lobe's closed form over the light.
#[test]
fn stretched_lobes_are_sums_of_lookups() {
    let (light, task) = (lights::smooth(), Task::quiet());
    let all = radiances(&light);
    let mut errors = Vec::new();
    for (sweep, taps) in [(0.0, 16.0), (0.1, 16.0), (0.4, 16.0), (0.4, 6.0), (0.4, 1.0)] {
        let lobe = GaussianLobe {
            angle: -0.2,
            sigma: 0.05,
            sweep,
            weight: [1.0, 0.7, 0.2],
            ..GaussianLobe::default()
        };
        let fit = GaussianFit::isotropic([0.0; 3], vec![vec![lobe]; 2]);
        let brdf = Arc::new(Lobes::new("lobes:a".into(), fit.clone()));
        let values: ParamValues = [("taps", taps)].into_iter().collect();
        let t = find("gaussian-lobes").expect("registered");
        let b = t.draft(&light, &Material::new(brdf), None, &values, &task).expect("baked");
        let want = (0..64).map(|k| {
            let [n, t, wo] = point(k).map(|v| v.as_dvec3());
            let local = |d: DVec3| DVec3::new(d.dot(t), d.dot(n.cross(t)), d.dot(n));
            let mut sum = [0.0; 3];
            for (d, l) in &all {
                let f = fit.f_cos(local(*d), local(wo));
                (0..3).for_each(|c| sum[c] += f[c] * l[c]);
            }
            sum
        });
        // Every fourth point is seen along its normal, where nothing says which way a lobe off it leans.
        let pairs = shade(&*b).into_iter().zip(want).enumerate().filter(|(k, _)| k % 4 > 0).map(|p| p.1);
        errors.push(steradian_prefilter::probe::relative_rms(pairs));
    }
    println!("{errors:.5?}");
    // Measured: 0.0018, 0.0016, 0.0057, 0.0125.
    assert!(errors.iter().zip([3e-3, 3e-3, 8e-3, 0.016]).all(|(e, most)| *e < most), "{errors:?}");
    assert!(errors[4] > 2.0 * errors[2], "one lookup is none of a stretched lobe: {errors:?}");
}

/// Lobes like those of brushed metal: two, off the plane of incidence, swept across the brushing.
pub(super) fn brushed() -> GaussianFit {
    let lobe = |theta: f64, phi: f64| {
        let wide = GaussianLobe {
            angle: -0.1 * theta,
            sigma: 0.4,
            weight: [0.1, 0.2, 0.1],
            ..GaussianLobe::default()
        };
        let streak = GaussianLobe {
            angle: -0.1 * theta,
            aside: 0.15 * theta * (2.0 * phi).sin(),
            sigma: 0.06,
            sweep: 0.3,
            turn: (0.5 * PI + phi).rem_euclid(PI),
            weight: [0.6, 0.5, 0.3],
        };
        vec![streak, wide]
    };
    let fit =
        GaussianFit { azimuths: 24, ..GaussianFit::isotropic([0.2, 0.1, 0.0], vec![Vec::new(); 8 * 24]) };
    let places = (0..8).flat_map(|i| (0..24).map(move |j| (i, j)));
    let views = places.map(|(i, j)| lobe(fit.theta(i), fit.phi(j))).collect();
    GaussianFit { views, ..fit }
}

/// Directions spread evenly, with the light's radiance times the solid angle of each.
fn radiances(light: &Lights) -> Vec<(DVec3, [f64; 3])> {
    let sky = light.environment.as_ref().expect("a sky");
    let n = 40_000;
    let of = |d: DVec3| (d, sky.radiance(d).map(|l| f64::from(l) * 4.0 * PI / n as f64));
    (0..n).map(|k| of(steradian_prefilter::probe::direction(k, n))).collect()
}

/// A point whose tangent lies anywhere, to see brushings from all sides.
fn brushed_point(k: usize) -> [Vec3; 3] {
    let [n, t, wo] = point(k);
    [n, glam::Quat::from_axis_angle(n, 0.7 * k as f32) * t, wo]
}

/// Lookups along the sweeps of anisotropic lobes against the integral of their closed form over the light; a
/// bake that was saved and loaded gives the same bits.
#[test]
fn lobes_beside_the_plane_are_sums_of_lookups() {
    let (light, task) = (lights::smooth(), Task::quiet());
    let all = radiances(&light);
    let brdf: Arc<dyn steradian_brdf::Brdf> = Arc::new(Lobes::new("lobes:a".into(), brushed()));
    let t = find("gaussian-lobes").expect("registered");
    let material = Material::new(brdf.clone());
    let b = t.draft(&light, &material, None, &ParamValues::default(), &task).expect("baked");
    let mut q = PointsBuf::default();
    (0..64).map(brushed_point).for_each(|[n, t, wo]| q.push(n, t, wo, Vec3::ZERO));
    let want = (0..64).map(|k| {
        let [n, t, wo] = brushed_point(k).map(|v| v.as_dvec3());
        let local = |d: DVec3| DVec3::new(d.dot(t), d.dot(n.cross(t)), d.dot(n));
        let mut sum = [0.0; 3];
        for (d, l) in &all {
            let f = brdf.f_cos(local(*d), local(wo));
            (0..3).for_each(|c| sum[c] += f[c] * l[c]);
        }
        sum
    });
    let rgb = radiance(&*b, &q);
    let shaded = (0..64).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from));
    let error = steradian_prefilter::probe::relative_rms(shaded.zip(want));
    println!("{error:.5}");
    assert!(error < 5e-3, "{error}");
    assert!(!b.varies().normals);
    assert_eq!(radiance(&*t.load(&b.save()).expect("loaded"), &q), rgb);
}

/// Lookups about half vectors against the fit integrated over the light; a bake that was saved and loaded
/// gives the same bits.
#[test]
fn half_vectors_are_sums_of_lookups() {
    let (light, task) = (lights::smooth(), Task::quiet());
    let all = radiances(&light);
    let brdf = parse("ggx:ax=0.15,ay=0.4,f0=0.9/0.6/0.3").expect("a spec");
    let fit = HalfFit::new(&*brdf, Plan::default(), 176, 1.0f64.to_radians(), &task).expect("nobody cancels");
    let t = find("gaussian-lobes").expect("registered");
    let material = Material::new(brdf);
    let b = t.draft(&light, &material, None, &ParamValues::default(), &task).expect("baked");
    let mut q = PointsBuf::default();
    (0..48).map(brushed_point).for_each(|[n, t, wo]| q.push(n, t, wo, Vec3::ZERO));
    let want = (0..48).map(|k| {
        let [n, t, wo] = brushed_point(k).map(|v| v.as_dvec3());
        let local = |d: DVec3| DVec3::new(d.dot(t), d.dot(n.cross(t)), d.dot(n));
        let (weights, wo) =
            (fit.at([local(wo).z.min(1.0).acos(), local(wo).y.atan2(local(wo).x)]), local(wo));
        let mut sum = [0.0; 3];
        for (w, h) in weights.iter().zip(&fit.half_vectors) {
            let (mean, lambda) = (2.0 * wo.dot(h.h) * h.h - wo, (h.sigma * h.sigma).recip());
            let peak = lambda / (-2.0 * PI * (-2.0 * lambda).exp_m1());
            for (d, l) in &all {
                let g = peak * (lambda * (local(*d).dot(mean) - 1.0)).exp();
                (0..3).for_each(|c| sum[c] += w[c] * g * l[c]);
            }
        }
        for (d, l) in &all {
            (0..3).for_each(|c| sum[c] += fit.diffuse[c] / PI * local(*d).z.max(0.0) * l[c]);
        }
        sum
    });
    let rgb = radiance(&*b, &q);
    let shaded = (0..48).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from));
    let error = steradian_prefilter::probe::relative_rms(shaded.zip(want));
    println!("{error:.5}");
    assert!(error < 5e-3, "{error}");
    assert!(!b.varies().normals);
    assert_eq!(radiance(&*t.load(&b.save()).expect("loaded"), &q), rgb);
}

/// The parameters of visibility, for a bake on a mesh, with small maps.
pub(super) fn seen_by(visibility: &str, bands: usize) -> ParamValues {
    let values = [("visibility_bands", bands as f64), ("precision", 2e-3), ("size", 16.0), ("sigma", 8.0)];
    let mut values: ParamValues = values.into_iter().collect();
    values.0.insert("visibility".into(), visibility.into());
    values
}

/// Every treatment of visibility.
fn treatments() -> impl Iterator<Item = (&'static str, usize)> {
    let of = |bands| [("published", bands), ("convolved", bands)];
    [("ambient", 2)].into_iter().chain((2..=4).flat_map(of))
}

pub(super) fn on_mesh(
    light: &Lights,
    material: &Material,
    g: Option<&Geometry>,
    values: &ParamValues,
) -> Box<dyn AnyBake> {
    let t = find("gaussian-lobes").expect("registered");
    t.draft(light, material, g, values, &Task::quiet()).expect("baked")
}

fn radiance(b: &dyn AnyBake, q: &PointsBuf) -> [Vec<f32>; 3] {
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    rgb
}

/// One round lobe about the mirror direction, without a diffuse part.
fn one_lobe(angle: f64, sigma: f64, sweep: f64) -> Material {
    let lobe = GaussianLobe { angle, sigma, sweep, weight: [1.0, 0.7, 0.2], ..GaussianLobe::default() };
    let fit = GaussianFit::isotropic([0.0; 3], vec![vec![lobe]; 2]);
    Material::new(Arc::new(Lobes::new("lobes:a".into(), fit)))
}

/// Where nothing is in the way, all treatments shade the bits that none shades, between vertices too.
#[test]
fn a_sphere_shades_as_without_visibility() {
    let mesh = Arc::new(steradian_scene::shapes::icosphere(2));
    let g = Geometry::new(mesh.clone(), crate::Sites::Vertices);
    let mut q = PointsBuf::default();
    for (k, corners) in mesh.triangles.iter().enumerate() {
        let w = [0.2, 0.5, 0.3];
        let n = (0..3).map(|c| mesh.normals[corners[c] as usize] * w[c]).sum::<Vec3>().normalize();
        let t = n.any_orthonormal_vector();
        let c = [1.0, 0.8, 0.4, 0.1, 0.02][k % 5];
        q.push(n, t, n * c + t * (1.0f32 - c * c).sqrt(), n);
        q.locate(glam::Vec2::ZERO, *corners, [w[1], w[2]]);
    }
    let material = Material::new(parse("dielectric:alpha=0.16,f0=0.04,albedo=0.6/0.3/0.1").expect("spec"));
    let light = lights::studio();
    let open = radiance(&*on_mesh(&light, &material, None, &seen_by("none", 4)), &q);
    assert!(open.iter().flatten().any(|l| *l > 0.0));
    for (visibility, bands) in treatments() {
        let b = on_mesh(&light, &material, Some(&g), &seen_by(visibility, bands));
        assert_eq!(radiance(&*b, &q), open, "{visibility} {bands}");
        let detail = |name: &str| b.certified().figure(name);
        assert_eq!(detail("visibility of lobes, mean"), Some(1.0));
        assert_eq!(detail("weight whose visibility was below 0 and is cut"), Some(0.0));
    }
}

/// A wall that blocks half of a point's surroundings: of lobes whose mean lies in its plane half is visible,
/// at any width and by any number of bands, and half of the sky's irradiance. Inside a closed box nothing is
/// visible.
#[test]
fn half_a_space_and_a_closed_one_are_closed_forms() {
    let wall = Arc::new(steradian_scene::shapes::cuboid([2.0, 2000.0, 2000.0], 1));
    // A point next to the wall, and one inside it.
    let (p, n) = ([Vec3::new(1.002, 0.0, 0.0), Vec3::ZERO], [Vec3::Y; 2]);
    let sites = Geometry::new(wall, crate::Sites::Points { p: p.into(), n: n.into() });
    let mut q = PointsBuf::default();
    for (site, p) in (0..).zip(p) {
        for k in 0..9 {
            let (s, c) = (0.17 * k as f32).sin_cos();
            q.push(Vec3::Y, Vec3::X, Vec3::new(0.0, c, s), p);
            q.locate(glam::Vec2::ZERO, [site; 3], [0.0; 2]);
        }
    }
    let light = lights::furnace();
    let lambert = Material::new(parse("lambert:albedo=0.8/0.5/0.2").expect("spec"));
    let turned = Material::new(Arc::new(Lobes::new("lobes:a".into(), brushed())));
    // Bands and treatments meet a narrow and a wide lobe; all others with most bands.
    let materials = [
        (one_lobe(0.1, 0.05, 0.0), true),
        (one_lobe(-0.2, 0.5, 0.4), true),
        (lambert, false),
        (turned, false),
    ];
    for (material, every) in materials {
        let open = radiance(&*on_mesh(&light, &material, None, &seen_by("none", 4)), &q);
        for (visibility, bands) in treatments() {
            if !every && bands < 4 {
                continue;
            }
            let b = on_mesh(&light, &material, Some(&sites), &seen_by(visibility, bands));
            for (seen, open) in radiance(&*b, &q).iter().zip(&open) {
                for (i, (l, o)) in seen.iter().zip(open).enumerate() {
                    let share = if i < 9 { 0.5 } else { 0.0 };
                    assert!(
                        (l - share * o).abs() < 0.02 * o,
                        "{visibility} {bands}: {l} of {o}, not {share}"
                    );
                }
            }
        }
    }
}

/// V at a mean, and V convolved with the lobe, of 3 bands of blocked coefficients against the harmonics and
/// against the lobe's own integral over them.
#[test]
fn visibility_is_the_harmonics_and_their_mean_under_the_lobe() {
    use steradian_sphere::sh;
    let n = DVec3::new(0.2, 0.9, -0.3).normalize();
    let mut b = [0.0f32; 16];
    (0..16).for_each(|i| b[i] = 0.05 * (1.7 * i as f32).sin());
    let (open, mut y) = (sh::zonal::phong(3, 0.0), [0.0; 16]);
    // Blocked, and seen by the open hemisphere, of a few bands.
    let mut of = |d: DVec3| {
        sh::eval(3, d, &mut y);
        let blocked: f64 = (0..16).map(|i| f64::from(b[i]) * y[i]).sum();
        [blocked, sh::zonal::value(&open, n.dot(d))]
    };
    let (count, single) = (40_000, |d: DVec3| d.as_vec3().to_array());
    for sigma in [0.05, 0.4, 1.0f64] {
        let lambda = (sigma * sigma).recip();
        let a = sh::zonal::gaussian(3, lambda);
        let zonal = [1, 2, 3, 3].map(|l| (a[l] / a[0]) as f32);
        for k in 0..20 {
            let d = steradian_prefilter::probe::direction(k, 40);
            let d = if d.dot(n) < 0.05 { (d - (d.dot(n) - 0.1) * n).normalize() } else { d };
            let [blocked, all] = of(d);
            let got = visibility::ratio::<4>(&b, single(n), [1.0; 4], single(d));
            assert!((f64::from(got) - (1.0 - blocked / all)).abs() < 1e-5, "{got}");
            let mut sum = [0.0; 3];
            for j in 0..count {
                let w = steradian_prefilter::probe::direction(j, count);
                let g = (lambda * (w.dot(d) - 1.0)).exp();
                let [blocked, all] = of(w);
                [g * blocked, g * all, g].iter().zip(&mut sum).for_each(|(x, s)| *s += x);
            }
            let got = visibility::ratio::<4>(&b, single(n), zonal, single(d));
            assert!((f64::from(got) - (1.0 - sum[0] / sum[1])).abs() < 1e-3, "{sigma}: {got}");
        }
    }
    // A lobe over the whole sphere sees the fraction of the hemisphere, a thin one V at its mean.
    let d = single((n + DVec3::new(0.3, 0.0, 0.5)).normalize());
    let wide = visibility::ratio::<4>(&b, single(n), [0.0; 4], d);
    assert!((wide - visibility::ratio::<1>(&b, single(n), [0.0; 4], d)).abs() < 1e-6);
}

/// Saved and loaded on a mesh that shadows itself; another material, and another light, as if baked anew.
#[test]
fn shadowed_bakes_are_saved_and_relinked() {
    let mesh = Arc::new(steradian_scene::shapes::torus(0.7, 0.3, 12));
    let g = Geometry::new(mesh.clone(), crate::Sites::Vertices);
    let mut q = PointsBuf::default();
    for (k, (p, n)) in mesh.positions.iter().zip(&mesh.normals).enumerate() {
        let t = n.any_orthonormal_vector();
        q.push(*n, t, (*n * 0.7 + t * 0.7).normalize(), *p);
        q.locate(glam::Vec2::ZERO, [k as u32; 3], [0.0; 2]);
    }
    let of = |spec: &str| Material::new(parse(spec).expect(spec));
    let (first, second) =
        (of("dielectric:alpha=0.16,f0=0.04,albedo=0.6/0.3/0.1"), of("sgd:gold-metallic-paint"));
    let t = find("gaussian_lobes").expect("registered");
    for (visibility, bands) in [("ambient", 4), ("published", 3), ("convolved", 4)] {
        let values = seen_by(visibility, bands);
        let b = on_mesh(&lights::studio(), &first, Some(&g), &values);
        let shaded = radiance(&*b, &q);
        let open = radiance(&*on_mesh(&lights::studio(), &first, None, &seen_by("none", 4)), &q);
        let sum = |rgb: &[Vec<f32>; 3]| rgb.iter().flatten().sum::<f32>();
        assert!(sum(&shaded) < 0.95 * sum(&open), "{} of {}", sum(&shaded), sum(&open));
        let loaded = t.load(&b.save()).expect("loaded");
        assert_eq!(radiance(&*loaded, &q), shaded, "{visibility}");
        let other = b.preview(Some(&lights::smooth()), Some(&second), &Task::quiet()).expect("linked");
        let anew = on_mesh(&lights::smooth(), &second, Some(&g), &values);
        assert_eq!(radiance(&*other, &q), radiance(&*anew, &q), "{visibility}");
        assert!(b.certified().metric.contains("paths"), "{}", b.certified().metric);
    }
    let e = t
        .draft(&lights::studio(), &first, None, &seen_by("published", 4), &Task::quiet())
        .err()
        .expect("no mesh");
    assert_eq!(e.to_string(), "gaussian_lobes: bakes per site of a mesh: give one (`mesh`)");
}

/// The texts for every treatment and number of bands are valid; with a diffuse part, with a turned lobe, and
/// with half vectors, those for none, for the mean and for most bands.
#[test]
fn shaders_of_visibility_are_valid() {
    let g = Geometry::new(Arc::new(steradian_scene::shapes::icosphere(0)), crate::Sites::Vertices);
    let turned = Material::new(Arc::new(Lobes::new("lobes:a".into(), brushed())));
    let lambert = Material::new(parse("lambert:albedo=0.5").expect("spec"));
    let halves = Material::new(parse("ggx:ax=0.3,ay=0.6").expect("spec"));
    let materials = [(one_lobe(0.0, 0.1, 0.0), true), (lambert, false), (turned, false), (halves, false)];
    for (material, every) in materials {
        for (visibility, bands) in treatments().chain([("none", 2)]) {
            if !every && (bands == 3 || visibility == "published") {
                continue;
            }
            let b = on_mesh(&lights::furnace(), &material, Some(&g), &seen_by(visibility, bands));
            let text = crate::gpu::module(&b.gpu());
            let module = naga::front::wgsl::parse_str(&text).map_err(|e| e.emit_to_string(&text));
            let flags = naga::valid::ValidationFlags::all();
            let valid = naga::valid::Validator::new(flags, naga::valid::Capabilities::empty())
                .validate(&module.unwrap_or_else(|e| panic!("{visibility} {bands}: {e}")));
            assert!(valid.is_ok(), "{visibility} {bands}: {:?}", valid.err());
        }
    }
}

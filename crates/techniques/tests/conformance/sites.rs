//! Techniques with sites where a mesh blocks light: a groove whose visibility has a closed form, and a ball
//! on a pedestal, compared with paths.

use super::harness::*;
use glam::{Affine3A, DMat3, DVec2, DVec3, Vec2, Vec3};
use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::Task;
use steradian_light::Lights;
use steradian_reference::path::{PathOptions, PathPoint, PathScene, trace_points};
use steradian_scene::{Bvh, Mesh, shapes};
use steradian_sphere::Frame;
use steradian_techniques::shared::trials::lights;
use steradian_techniques::{AnyBake, AnyTechnique, Check, Geometry, PointsBuf, Radiance, Sites};
use steradian_testkit::full;

/// Techniques that keep data at sites, and a mesh's shadows in them.
fn sited(check: Check) -> impl Iterator<Item = &'static dyn AnyTechnique> {
    techniques(check).filter(|t| t.card().needs.sites)
}

/// A point of a surface, a view of it, and where it lies among the sites.
#[derive(Clone, Copy)]
struct At {
    p: DVec3,
    frame: Frame,
    wo: DVec3,
    corners: [u32; 3],
    weights: [f32; 2],
}

/// Views all over the hemisphere down to 75° off the normal.
fn view(frame: &Frame, k: usize) -> DVec3 {
    let cosine = 1.0 - 0.74 * (k as f64 * 0.754_877_666 + 0.2).fract();
    let phi = 2.0 * PI * (k as f64 * 0.569_840_291 + 0.1).fract();
    let s = (1.0 - cosine * cosine).sqrt();
    frame.to_world(DVec3::new(s * phi.cos(), s * phi.sin(), cosine))
}

/// Radiance of a bake at these points.
fn shaded(b: &dyn AnyBake, points: &[At]) -> Vec<[f64; 3]> {
    let mut q = PointsBuf::with_capacity(points.len());
    for a in points {
        q.push(a.frame.n.as_vec3(), a.frame.t.as_vec3(), a.wo.as_vec3(), a.p.as_vec3());
        q.locate(Vec2::ZERO, a.corners, a.weights);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    (0..q.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from)).collect()
}

/// Two walls of width 1 that meet in the z axis at an angle and open towards +Y, far longer than they are
/// wide, turned.
struct Groove {
    /// Half of the angle between the walls.
    half: f64,
    turn: DMat3,
}

impl Groove {
    /// Half of its length.
    const LONG: f64 = 300.0;
    /// Distances from the bottom of the points that are looked at.
    const PLACES: usize = 10;
    const VIEWS: usize = 6;

    /// Unit vectors up the first wall and out of it.
    fn wall(&self) -> [DVec3; 2] {
        let (s, c) = self.half.sin_cos();
        [DVec3::new(s, c, 0.0), DVec3::new(-c, s, 0.0)]
    }

    /// The groove as a mesh with `strips` strips along each wall, and vertices at each place of `along`, in
    /// half lengths of the groove.
    fn mesh(&self, strips: usize, along: &[f64]) -> Mesh {
        let mut mesh = Mesh::default();
        for side in [1.0, -1.0] {
            let [up, n] = self.wall().map(|v| DVec3::new(side * v.x, v.y, v.z));
            let first = mesh.positions.len() as u32;
            for k in 0..=strips {
                for z in along {
                    let p = up * (k as f64 / strips as f64) + DVec3::Z * Self::LONG * *z;
                    mesh.positions.push((self.turn * p).as_vec3());
                    mesh.normals.push((self.turn * n).as_vec3());
                }
            }
            let row = along.len() as u32;
            for (k, j) in (0..strips as u32).flat_map(|k| (0..row - 1).map(move |j| (k, j))) {
                let [a, b] = [first + k * row + j, first + (k + 1) * row + j];
                mesh.triangles.extend([[a, b, a + 1], [a + 1, b, b + 1]]);
            }
        }
        mesh
    }

    /// Distances from the bottom, closer together there.
    fn places() -> impl Iterator<Item = f64> {
        (0..Self::PLACES).map(|k| ((k as f64 + 0.5) / Self::PLACES as f64).powi(2))
    }

    /// Points of the first wall as sites, and views of them.
    fn sites(&self) -> (Geometry, Vec<At>) {
        let [up, n] = self.wall().map(|v| self.turn * v);
        let frame = Frame::from_normal_tangent(n, up);
        let p: Arc<[Vec3]> = Self::places().map(|x| (up * x).as_vec3()).collect();
        let normals = p.iter().map(|_| n.as_vec3()).collect();
        let geometry =
            Geometry::new(Arc::new(self.mesh(1, &[-1.0, 1.0])), Sites::Points { p: p.clone(), n: normals });
        let at = |k: usize| {
            let site = k / Self::VIEWS;
            let (wo, corners) = (view(&frame, k), [site as u32; 3]);
            At { p: p[site].as_dvec3(), frame, wo, corners, weights: [0.0; 2] }
        };
        (geometry, (0..Self::PLACES * Self::VIEWS).map(at).collect())
    }

    /// The angle that the opposite wall subtends from the distance x: from the bottom up to its rim.
    fn blocked(&self, x: f64) -> f64 {
        let [up, n] = self.wall();
        let rim = DVec3::new(-up.x, up.y, 0.0) - x * up;
        rim.dot(n).atan2(-rim.dot(up))
    }

    /// Exact radiance of the points of [`Groove::sites`]: directions are visible above the angle of the
    /// opposite wall, so that the integrand is smooth.
    fn exact(&self, light: &Lights, spec: &str, points: &[At]) -> Vec<[f64; 3]> {
        const N: usize = 160;
        let image = &light.environment.as_ref().expect("an image").image;
        let brdf = material(spec).brdf;
        let [up, n] = self.wall();
        let places: Vec<f64> = Self::places().collect();
        let radiance = |a: &At| {
            let from = self.blocked(places[a.corners[0] as usize]);
            let wo = a.frame.to_local(a.wo);
            let mut sum = [0.0; 3];
            for k in 0..N * N {
                let u = DVec2::new((k % N) as f64 + 0.5, (k / N) as f64 + 0.5) / N as f64;
                let (angle, (s, c)) = (from + (PI - from) * u.x, (PI * u.y).sin_cos());
                let across = n * angle.sin() - up * angle.cos();
                let d = self.turn * (across * s + DVec3::Z * c);
                let f = brdf.f_cos(a.frame.to_local(d), wo);
                let l = image.nearest(d);
                let share = (PI - from) * PI * s / (N * N) as f64;
                (0..3).for_each(|i| sum[i] += share * f[i] * f64::from(l[i]));
            }
            sum
        };
        points.iter().map(radiance).collect()
    }
}

/// A right angle, and a narrow gorge.
const ANGLES: [f64; 2] = [90.0, 40.0];

fn groove(degrees: f64) -> Groove {
    Groove { half: 0.5 * degrees.to_radians(), turn: DMat3::IDENTITY }
}

/// Seen from the bottom, the opposite wall has the form factor (1 + cos α)/2, and in the mean over the wall 1
/// − sin(α/2): the checks below take these as exact.
#[test]
fn the_groove_has_its_form_factors() {
    for degrees in ANGLES {
        let g = groove(degrees);
        // Form factor of a strip between two angles from the plane of the observer: ½ (cos − cos).
        let seen = |x: f64| 0.5 * (1.0 - g.blocked(x).cos());
        assert!((seen(1e-9) - 0.5 * (1.0 + (2.0 * g.half).cos())).abs() < 1e-6, "{degrees}");
        let mean = (0..4000).map(|k| seen((f64::from(k) + 0.5) / 4000.0)).sum::<f64>() / 4000.0;
        assert!((mean - (1.0 - g.half.sin())).abs() < 1e-4, "{degrees}: {mean}");
        let (_, points) = g.sites();
        let exact = g.exact(&lights::furnace(), "lambert:albedo=1", &points);
        for (l, a) in exact.iter().zip(&points) {
            let x = a.p.length();
            assert!((l[0] - (1.0 - seen(x))).abs() < 2e-3, "{degrees} {x}: {}", l[0]);
        }
    }
}

/// Bakes with the usual parameters.
fn baked(t: &dyn AnyTechnique, light: &Lights, spec: &str, geometry: &Geometry) -> Box<dyn AnyBake> {
    t.draft(light, &material(spec), Some(geometry), &Default::default(), &Task::quiet())
        .expect("a mesh with sites")
}

/// Prints an error and its bound, and records a failure where it exceeds the bound.
fn judge(failures: &mut Vec<String>, name: String, error: f64, most: f64) {
    let line = format!("{name}: {error:.4} (at most {most:.4})");
    println!("{line}");
    if error.is_nan() || error > most {
        failures.push(line);
    }
}

/// On the walls of a groove the error is what certificates state, compared with visibility in closed form;
/// twice as much is allowed, since the views are others.
#[test]
fn a_groove_is_shaded_as_certificates_say() {
    let mut failures = Vec::new();
    for (degrees, (name, check)) in ANGLES
        .iter()
        .flat_map(|d| [("furnace", Check::Furnace), ("smooth", Check::ErrorBound)].map(|c| (*d, c)))
    {
        let (groove, light) = (groove(degrees), light(name));
        let (geometry, points) = groove.sites();
        // Techniques share specimens.
        let mut exact_of = BTreeMap::new();
        for t in sited(check) {
            for spec in t.card().specimens {
                let b = baked(t, &light, spec, &geometry);
                let exact = exact_of.entry(spec).or_insert_with(|| groove.exact(&light, spec, &points));
                let error = difference(&shaded(&*b, &points), exact);
                let what = format!("{}: {spec}: {name}: {degrees}°", t.card().slug);
                let exact = 2e-3;
                let stated = if error > exact { certified(&*b).error } else { 0.0 };
                judge(&mut failures, what, error, 2.0 * stated + exact);
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// A groove that is rotated together with its light looks the same.
#[test]
fn a_groove_turns_with_its_light() {
    let turn = DMat3::from_rotation_z(0.9) * DMat3::from_rotation_y(2.0) * DMat3::from_rotation_x(0.4);
    let still = groove(90.0);
    let light = light("smooth");
    let turned: Lights = light.environment.as_ref().expect("an image").rotated(turn).into();
    let mut failures = Vec::new();
    for t in sited(Check::Rotation) {
        let spec = t.card().specimens[0];
        let [a, b] =
            [(&still, &light), (&Groove { turn, ..groove(90.0) }, &turned)].map(|(groove, light)| {
                let (geometry, points) = groove.sites();
                shaded(&*baked(t, light, spec, &geometry), &points)
            });
        // The image is resampled, and rays are others.
        judge(&mut failures, format!("{}: turned", t.card().slug), difference(&a, &b), 0.012);
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// Light that the walls of a groove reflect to each other once, under a constant light, is the sum over
/// strips of their form factors.
#[test]
fn a_groove_reflects_what_its_form_factors_say() {
    const N: usize = 800;
    const ALBEDO: f64 = 0.8;
    // Wider than a right angle, so that vertices at the bottom, whose rays start off their own wall, lie in
    // front of the opposite one.
    let groove = groove(120.0);
    // Between vertices radiance is linear: strips and, where nothing changes, few stretches along them.
    let (_, points) = groove.sites();
    let mesh = Arc::new(groove.mesh(32, &[-1.0, -0.5, -0.1, -0.02, 0.02, 0.1, 0.5, 1.0]));
    let (p, n) = (points.iter().map(|a| a.p.as_vec3()), points.iter().map(|a| a.frame.n.as_vec3()));
    let geometry = Geometry::new(mesh, Sites::Points { p: p.collect(), n: n.collect() });
    let points: Vec<At> = (0..).zip(&points).map(|(k, a)| At { corners: [k; 3], ..*a }).collect();
    // Form factor of the opposite wall from its bottom to the distance y.
    let c = (2.0 * groove.half).cos();
    let seen = |x: f64, y: f64| 0.5 * (1.0 - (x - y * c) / (x * x + y * y - 2.0 * x * y * c).sqrt());
    let open = |x: f64| 1.0 - seen(x, 1.0);
    let exact = |a: &At| {
        let x = a.p.length();
        let end = |k: usize| k as f64 / N as f64;
        let strip = |k: usize| (seen(x, end(k + 1)) - seen(x, end(k))) * open(end(k) + 0.5 / N as f64);
        [ALBEDO * (open(x) + ALBEDO * (0..N).map(strip).sum::<f64>()); 3]
    };
    let exact: Vec<[f64; 3]> = points.iter().map(exact).collect();
    let reflects = |t: &&dyn AnyTechnique| t.params().iter().any(|p| p.name == "bounces");
    let mut tried = 0;
    let mut failures = Vec::new();
    for t in sited(Check::Furnace).filter(reflects) {
        let params = [("bounces", 2.0)].into_iter().collect();
        let of = material(&format!("lambert:albedo={ALBEDO}"));
        let b = t.bake(&lights::furnace(), &of, Some(&geometry), &params, &Task::quiet()).expect("a groove");
        let error = difference(&shaded(&*b, &points), &exact);
        judge(&mut failures, format!("{}: reflected", t.card().slug), error, 5e-3);
        tried += 1;
    }
    assert!(failures.is_empty(), "{failures:#?}");
    assert!(tried > 0 || std::env::var_os("STERADIAN_TECHNIQUES").is_some());
}

/// A ball on a pedestal on a plate.
fn pedestal() -> Mesh {
    let ball = shapes::icosphere(3).transformed(&Affine3A::from_translation(1.6 * Vec3::Y));
    let block = shapes::cuboid([1.4, 0.6, 1.4], 10).transformed(&Affine3A::from_translation(0.3 * Vec3::Y));
    Mesh::merged(&[ball, block, shapes::plane(5.0, 0.0, 24)])
}

/// Points all over a mesh, in triangles rather than at their corners, with a view each; those of the greatest
/// triangles are seldom more than others.
fn over(mesh: &Mesh, count: usize) -> Vec<At> {
    let fract = |k: usize, by: f64| (k as f64 * by + 0.37).fract();
    let at = |k: usize| {
        let corners = mesh.triangles[(fract(k, 0.618_033_989) * mesh.triangles.len() as f64) as usize];
        let (root, u) = (fract(k, 0.819_172_513).sqrt(), fract(k, 0.671_043_606));
        let w = [1.0 - root, root * (1.0 - u), root * u];
        let mix =
            |v: &[Vec3]| corners.iter().zip(w).map(|(c, w)| v[*c as usize].as_dvec3() * w).sum::<DVec3>();
        let frame = Frame::from_normal(mix(&mesh.normals).normalize());
        At {
            p: mix(&mesh.positions),
            frame,
            wo: view(&frame, k),
            corners,
            weights: [w[1] as f32, w[2] as f32],
        }
    };
    (0..count).map(at).collect()
}

/// On a pedestal scene the error is what certificates state, at other points and views than theirs, compared
/// with the path tracer; and a bake that was saved and loaded shades the same.
#[test]
fn a_ball_on_a_pedestal_is_shaded_as_certificates_say() {
    let mesh = pedestal();
    let (points, bvh) = (over(&mesh, 160), Bvh::build(&mesh));
    let geometry = Geometry::new(Arc::new(mesh), Sites::Vertices);
    let light = light("smooth");
    let (mut failures, mut traced) = (Vec::new(), BTreeMap::new());
    for t in sited(Check::ErrorBound) {
        let specimens = t.card().specimens;
        for spec in &specimens[..if full() { specimens.len() } else { 1 }] {
            let b = baked(t, &light, spec, &geometry);
            let brdf = material(spec).brdf;
            let (materials, offset) = (&[brdf.clone()][..], PathScene::OFFSET);
            let scene =
                PathScene { mesh: &geometry.mesh, bvh: &bvh, materials, tint: None, lights: &light, offset };
            let of = |a: &At| PathPoint { position: a.p, frame: a.frame, wo: a.wo, brdf: &*brdf };
            let paths: Vec<PathPoint<'_>> = points.iter().map(of).collect();
            let options = PathOptions { bounces: 1, samples: 1024, seed: 11 };
            // Techniques share specimens.
            let trace = || trace_points(&scene, &paths, options, &Task::quiet()).expect("nobody cancels");
            let paths = traced.entry(spec).or_insert_with(trace);
            let exact: Vec<[f64; 3]> = paths.iter().map(|e| e.rgb).collect();
            let [energy, noise] = paths.iter().fold([0.0; 2], |s, e| {
                [s[0] + e.rgb.iter().map(|x| x * x).sum::<f64>(), s[1] + e.variance.iter().sum::<f64>()]
            });
            let got = shaded(&*b, &points);
            let error = difference(&got, &exact);
            let stated = certified(&*b).error;
            let what = format!("{}: {spec}: pedestal", t.card().slug);
            judge(&mut failures, what, error, stated + 2.0 * (noise / energy).sqrt());
            let loaded = t.load(&b.save()).expect("its own bake");
            assert_eq!(shaded(&*loaded, &points), got, "{}: {spec}", t.card().slug);
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

//! Light from bump to bump: closed forms of grooves, and paths over real height maps.

use super::{bake, single};
use crate::local::{LocalBake, Place, texel};
use crate::rooms::bump_horizon::links::directions;
use crate::shared::surface::bumps::HEIGHT;
use crate::trial::local;
use crate::{Material, find_local};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;
use std::path::PathBuf;
use std::sync::Arc;
use steradian_base::{Task, Value};
use steradian_light::{DirectionalLight, Lights};
use steradian_reference::path::{PathOptions, PathPoint, PathScene, trace_points};
use steradian_relight::height::HeightField;
use steradian_scene::surface::{Planes, Texture};
use steradian_scene::{Bvh, Mesh};
use steradian_sphere::Frame;

fn plane(width: usize, height: usize, z: &[f32]) -> Planes {
    let t = Texture::new(width, height, &[z.to_vec(), z.to_vec(), z.to_vec()]).expect("texels");
    Planes::default().with(HEIGHT, Arc::new(t))
}

/// With w (n·d) = π/N all directions have the same weight, and the weights sum to π; the directions have the
/// moments of the cosine; and the directions that precede them in paths of two reflections are a permutation.
#[test]
fn directions_weigh_pi_together() {
    for count in [8, 50, 64, 256] {
        let all = directions(count);
        let weights: Vec<f64> = all.iter().map(|d| PI / count as f64 / f64::from(d.d[2])).collect();
        let moment = |f: &dyn Fn([f64; 3]) -> f64| -> f64 {
            all.iter().zip(&weights).map(|(d, w)| w * f(d.d.map(f64::from)) * f64::from(d.d[2])).sum()
        };
        assert!((moment(&|_| 1.0) - PI).abs() < 1e-6);
        let few = 2.0 / count as f64;
        assert!((moment(&|d| d[2]) - 2.0 * PI / 3.0).abs() < few, "{count}");
        assert!(
            (moment(&|d| d[0] * d[0]) - PI / 4.0).abs() < 3.0 * few && moment(&|d| d[1]).abs() < 3.0 * few
        );
        let mut before: Vec<usize> = all.iter().map(|d| d.before).collect();
        before.sort_unstable();
        assert!(before.into_iter().eq(0..count));
    }
}

/// Heights of one value have no links: the bits of `bounces=0`.
#[test]
fn flat_heights_reflect_nothing() {
    let of = |bounces: f64| {
        let flat = plane(8, 8, &[0.3; 64]);
        bake("ggx:alpha=0.3,f0=0.9/0.5/0.2", flat, &[("bounces", bounces.into())])
    };
    let (without, with) = (of(0.0), of(3.0));
    for k in 0..100 {
        let (wi, wo) = (local::direction(3 * k, 0.001), local::direction(7 * k + 1, 0.002));
        let at = Place { uv: [0.13 * k as f32, 0.77 * k as f32], footprint: 0.01 * (k % 40) as f32 };
        let bits = |b: &dyn LocalBake| b.f_cos_at(at, single(wi), single(wo)).map(f32::to_bits);
        assert_eq!(bits(&*without), bits(&*with), "{k}");
    }
}

/// Lambertian walls of a groove of opening α under light from above: in the mean the first bounce is ρ²EF,
/// F = 1 − sin(α/2). All bounces with direct light are about ρE/(1 − ρF), a formula that assumes equal
/// irradiance over a wall; the exact solution is within 1 % of it.
#[test]
fn a_grooves_bounces_have_their_closed_forms() {
    let (n, albedo) = (256usize, 0.8);
    let z: Vec<f32> = (0..n).map(|i| (2.0 * i as f32 / n as f32 - 1.0).abs()).collect();
    for slope in [0.5, 2.0] {
        let mean = |bounces: f64| {
            let params: [(&'static str, Value); 3] =
                [("relief", (0.5 * slope).into()), ("bounces", bounces.into()), ("directions", 256.0.into())];
            let b = bake(&format!("lambert:albedo={albedo}"), plane(n, 1, &z), &params);
            let at = |i: usize| Place { uv: [(i as f32 + 0.5) / n as f32, 0.5], footprint: 0.0 };
            // The walls, without rim and bottom.
            let walls = (1..n).filter(|i| *i != n / 2);
            let sum: f64 =
                walls.map(|i| f64::from(b.f_cos_at(at(i), [0.0, 0.0, 1.0], [0.0, 0.0, 1.0])[0])).sum();
            PI * sum / (n - 2) as f64
        };
        let cos = 1.0 / (1.0 + slope * slope).sqrt();
        let form = 1.0 - cos;
        let (direct, once, all) = (mean(0.0), mean(1.0), mean(4.0));
        assert!((direct - albedo * cos).abs() < 1e-5, "{slope}: {direct}");
        let want = albedo * albedo * cos * form;
        println!("slope {slope}: first bounce {:.5}, exact {want:.5}", once - direct);
        assert!((once - direct - want).abs() < 0.02 * want, "{slope}: {} {want}", once - direct);
        let even = albedo * cos / (1.0 - albedo * form);
        let cosine = (slope * slope - 1.0) / (slope * slope + 1.0);
        let means = local::groove(cosine);
        assert!((means[1] - form).abs() < 1e-3, "{slope}: {} {form}", means[1]);
        let sum = (0..5).map(|k| albedo.powi(k) * means[k as usize]).sum::<f64>();
        let want = albedo * cos * sum;
        println!("slope {slope}: four bounces {all:.5}, exact {want:.5}, alike {even:.5}");
        assert!((all - want).abs() < 0.01 * want, "{slope}: {all} {want}");
        assert!((all - even).abs() < 0.06 * even, "{slope}: {all} {even}");
    }
}

/// The heights, in texels, as a mesh of three periods each way with flat triangles: with interpolated
/// normals, views of a crease from the side would be black. The middle period begins at (0, 0).
fn relief(n: usize, z: &[f32]) -> Mesh {
    let at = |i: usize, j: usize| Vec3::new(i as f32 - n as f32, z[j % n * n + i % n], j as f32 - n as f32);
    let mut mesh = Mesh::default();
    for k in 0..9 * n * n {
        let (i, j) = (k % (3 * n), k / (3 * n));
        let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)];
        for t in [[a, c, d], [a, d, b]] {
            let first = mesh.positions.len() as u32;
            mesh.positions.extend(t);
            mesh.normals.extend([(t[1] - t[0]).cross(t[2] - t[0]).normalize(); 3]);
            mesh.triangles.push([first, first + 1, first + 2]);
        }
    }
    mesh
}

/// Real height maps with relief of 8 % of their side: two bounces by links against paths over the mesh of the
/// heights, the error by the number of directions. Texels and lights at random, lights 78 degrees off the
/// normal at most, views from above.
#[test]
fn two_bounces_on_real_height_maps_are_those_of_paths() {
    const POINTS: u32 = 256;
    const SPEC: &str = "lambert:albedo=0.8";
    let Some(dir) = steradian_testkit::data("meshes/textures") else { return };
    let names = ["rocks_NM_height.tga", "stones_NM_height.tga"];
    for name in names.into_iter().take(if steradian_testkit::full() { 2 } else { 1 }) {
        let file: PathBuf = dir.join(name);
        let raster =
            steradian_formats::read_image(&file, &steradian_formats::Limits::default()).expect("an image");
        let (n, z) = (raster.width, raster.channel("A").expect("height in alpha").to_vec());
        assert_eq!(n, raster.height);
        let heights: Vec<f32> = z.iter().map(|v| 0.08 * n as f32 * v).collect();
        let mesh = relief(n, &heights);
        let field = HeightField::new(n, n, heights.clone()).expect("finite");
        let bvh = Bvh::build(&mesh);
        let brdf = steradian_brdf::parse(SPEC).expect("a spec");
        // Tangent X, normal Y, bitangent −Z, as rows run downwards.
        let world = |d: DVec3| DVec3::new(d.x, d.z, -d.y);
        // Where bumps turn away from the viewer normals are bent, and paths end.
        let cases: Vec<(Place, [usize; 2], DVec3, DVec3)> = (0..POINTS)
            .filter_map(|k| {
                let (at, [i, j]) = texel(k, (n, n));
                let (light, view) = (local::direction(3 * k + 1, 0.2), local::direction(5 * k, 0.6));
                (field.normal(i, j).as_dvec3().dot(view) > 0.02).then_some((at, [i, j], light, view))
            })
            .collect();
        let traced = |bounces: u32, samples: u32| -> Vec<f64> {
            let one = |(k, c): (usize, &(Place, [usize; 2], DVec3, DVec3))| {
                let [i, j] = c.1;
                let normal = world(field.normal(i, j).as_dvec3());
                let position = DVec3::new(i as f64, f64::from(heights[j * n + i]), j as f64);
                let frame = Frame::from_normal_tangent(normal, DVec3::X);
                let light = DirectionalLight { direction: world(c.2), irradiance: [1.0; 3] };
                let lights = Lights { directionals: vec![light], ..Lights::default() };
                let scene = PathScene {
                    mesh: &mesh,
                    bvh: &bvh,
                    materials: std::slice::from_ref(&brdf),
                    tint: None,
                    lights: &lights,
                    offset: 1e-3,
                };
                let point = PathPoint { position, frame, wo: world(c.3), brdf: &*brdf };
                let options = PathOptions { bounces, samples, seed: k as u64 };
                trace_points(&scene, &[point], options, &Task::quiet()).expect("nobody cancels")[0].rgb[0]
            };
            cases.iter().enumerate().map(one).collect()
        };
        let (direct, whole) = (traced(1, 1), traced(3, 1024));
        let energy: f64 = whole.iter().map(|x| x * x).sum();
        let reflected: f64 = whole.iter().zip(&direct).map(|(a, b)| (a - b).powi(2)).sum();
        let t = find_local("bump_horizon").expect("a technique");
        println!("{name}: bounced light is {:.1} % of all (RMS)", 100.0 * (reflected / energy).sqrt());
        let all = [8.0, 64.0, 16.0, 32.0, 128.0, 256.0];
        for count in all.into_iter().take(if steradian_testkit::full() { all.len() } else { 2 }) {
            let of = |bounces: f64| -> Vec<f64> {
                let params: [(&'static str, Value); 4] = [
                    ("relief", 0.08.into()),
                    ("azimuths", 64.0.into()),
                    ("bounces", bounces.into()),
                    ("directions", count.into()),
                ];
                let material = Material::new(brdf.clone()).with_textures(plane(n, n, &z));
                let b =
                    t.bake(&material, None, &params.into_iter().collect(), &Task::quiet()).expect("bakes");
                cases.iter().map(|c| f64::from(b.f_cos_at(c.0, single(c.2), single(c.3))[0])).collect()
            };
            let (ours, first) = (of(2.0), of(0.0));
            let more = |k: usize| ours[k] - first[k];
            let off = |f: &dyn Fn(usize) -> f64| (0..cases.len()).map(|k| f(k).powi(2)).sum::<f64>();
            let bounced = off(&|k| more(k) - (whole[k] - direct[k]));
            let shadows = off(&|k| first[k] - direct[k]);
            let mean = (0..cases.len()).map(more).sum::<f64>()
                / whole.iter().zip(&direct).map(|(a, b)| a - b).sum::<f64>();
            println!(
                "{name}: {count} directions: bounced light errs by {:.2} % of all, {:.1} % of itself, its mean by {:.1} %; direct light errs by {:.1} %",
                100.0 * (bounced / energy).sqrt(),
                100.0 * (bounced / reflected).sqrt(),
                100.0 * (mean - 1.0),
                100.0 * (shadows / energy).sqrt(),
            );
            if count >= 64.0 {
                assert!((bounced / energy).sqrt() <= 0.05, "{name}: {count}");
            }
        }
    }
}

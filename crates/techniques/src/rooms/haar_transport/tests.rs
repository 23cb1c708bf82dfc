mod view;
mod weigh;

use super::choice::choose;
use super::*;
use crate::rooms::haar_transport::cube::Level;
use crate::rooms::haar_transport::light::transform;
use crate::rooms::haar_transport::transport::{Columns, Row, Scale};
use crate::{AnyBake, PointsBuf, Sites, find};
use glam::{DVec3, Mat3, Vec2};
use std::sync::Arc;
use steradian_base::ParamValues;
use steradian_light::DiskLight;
use steradian_scene::{Mesh, shapes};

const SIDE: usize = 16;

fn noise(n: usize) -> Vec<f32> {
    let mut random = steradian_sphere::sampling::Pcg32::new(5, 0);
    (0..n).map(|_| random.next_f64() as f32).collect()
}

fn all(wavelets: usize, choice: usize) -> Params {
    Params { size: 4, wavelets, choice, precision: 0.0, bounces: 1, bands: 5, fix: 0 }
}

/// Radiance of the vertices, each seen along its normal, with `params` of this technique or of another one.
fn at_vertices(slug: &str, light: &Lights, mesh: &Mesh, params: &[(&str, f64)], turn: Mat3) -> Vec<[f32; 3]> {
    at_vertices_with(slug, light, mesh, params.iter().copied().collect(), turn)
}

fn at_vertices_with(
    slug: &str,
    light: &Lights,
    mesh: &Mesh,
    params: ParamValues,
    turn: Mat3,
) -> Vec<[f32; 3]> {
    let material = Material::new(steradian_brdf::parse("lambert:albedo=0.5").unwrap());
    let geometry = Geometry::new(Arc::new(mesh.clone()), Sites::Vertices);
    let mut b: Box<dyn AnyBake> =
        find(slug).unwrap().draft(light, &material, Some(&geometry), &params, &Task::quiet()).unwrap();
    b.frame(&View { light_rotation: turn, ..View::default() });
    let mut q = PointsBuf::default();
    for (k, (n, p)) in mesh.normals.iter().zip(&mesh.positions).enumerate() {
        q.push(*n, n.any_orthonormal_vector(), *n, *p);
        q.locate(Vec2::ZERO, [k as u32; 3], [0.0; 2]);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    (0..q.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]]).collect()
}

fn off(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    let sum = |f: &dyn Fn(usize, usize) -> f32| -> f64 {
        (0..a.len()).flat_map(|i| (0..3).map(move |c| (i, c))).map(|(i, c)| f64::from(f(i, c)).powi(2)).sum()
    };
    (sum(&|i, c| a[i][c] - b[i][c]) / sum(&|i, c| b[i][c])).sqrt()
}

/// All wavelets and the whole transport are the product of texels, but for the eight bits.
#[test]
fn sums_over_wavelets_are_sums_over_texels() {
    let n = 6 * SIDE * SIDE;
    let t: Vec<f32> = noise(3 * n);
    let l = noise(n);
    let row = |k: usize| {
        let mut row = t[k * n..(k + 1) * n].to_vec();
        transform(&mut row, SIDE);
        Row::of(&row, SIDE, 0.0)
    };
    let rows: Vec<Row> = (0..3).map(row).collect();
    let transport = Columns::new(&rows, SIDE, Scale::Even);
    let mut light = l.clone();
    transform(&mut light, SIDE);
    let planes = [light.clone(), light.clone(), light];
    let chosen = choose(&planes, &vec![1.0; n], &all(n, 1));
    assert_eq!(chosen.others.len(), n - 6);
    let out = transport.apply(&chosen.scaling, &chosen.others);
    for k in 0..3 {
        let sum: f64 = t[k * n..(k + 1) * n].iter().zip(&l).map(|(t, l)| f64::from(t * l)).sum();
        assert!((f64::from(out[k][1]) / sum - 1.0).abs() < 1e-3, "{} {sum}", out[k][1]);
    }
}

/// Rows leave out the part of the length that the precision allows, and keep the largest coefficients.
#[test]
fn rows_keep_the_largest() {
    let mut all = noise(6 * SIDE * SIDE);
    transform(&mut all, SIDE);
    let length = |v: &mut dyn Iterator<Item = f32>| v.map(|x| f64::from(x).powi(2)).sum::<f64>();
    let whole = length(&mut all.iter().copied());
    for precision in [0.0, 0.05, 0.2] {
        let row = Row::of(&all, SIDE, precision * precision * whole);
        let kept = length(&mut row.scaling.iter().copied().chain(row.kept.iter().map(|k| k.1)));
        assert!(whole - kept <= precision * precision * whole * (1.0 + 1e-9));
        let least = row.kept.iter().map(|k| k.1.abs()).fold(f32::INFINITY, f32::min);
        let left = (0..all.len()).filter(|k| !k.is_multiple_of(SIDE * SIDE));
        let left = left.filter(|k| !row.kept.iter().any(|r| r.0 as usize == *k));
        assert!(left.map(|k| all[k].abs()).fold(0.0, f32::max) <= least);
    }
}

/// A constant light has six coefficients; one texel has one and three a level.
#[test]
fn lights_have_few_wavelets() {
    let norms = vec![1.0; 6 * SIDE * SIDE];
    let mut constant = vec![2.0; 6 * SIDE * SIDE];
    transform(&mut constant, SIDE);
    let planes = [constant.clone(), constant.clone(), constant];
    assert!(choose(&planes, &norms, &all(100, 1)).others.iter().all(|(_, l)| l[0].abs() < 1e-4));
    let mut texel = vec![0.0; 6 * SIDE * SIDE];
    texel[3 * SIDE * SIDE + 77] = 1.0;
    transform(&mut texel, SIDE);
    let planes = [texel.clone(), texel.clone(), texel];
    assert_eq!(choose(&planes, &norms, &all(100, 1)).others.len(), 3 * 4);
    // Choice by area puts the widest first.
    let widest = choose(&planes, &norms, &all(9, 2));
    assert!(widest.others.iter().all(|(k, _)| (*k as usize % (SIDE * SIDE)) < 2 * SIDE));
}

fn ring() -> Mesh {
    shapes::torus(0.7, 0.3, 24)
}

fn low_sun() -> Lights {
    let mut lights = lights::smooth();
    lights.disks.push(DiskLight {
        direction: DVec3::new(0.8, 0.5, 0.3).normalize(),
        angular_radius: 0.05,
        radiance: [400.0, 350.0, 300.0],
    });
    lights
}

/// The error falls as wavelets are added, and with 200 of them it is small, by whatever rule they are chosen.
#[test]
fn more_wavelets_are_nearer() {
    let (mesh, light) = (ring(), low_sun());
    let of = |n: f64, choice: &str| {
        let mut params: ParamValues = [("wavelets", n), ("precision", 0.0)].into_iter().collect();
        params.0.insert("choice".into(), choice.into());
        at_vertices_with("haar_transport", &light, &mesh, params, Mat3::IDENTITY)
    };
    let whole = of(98304.0, "transport");
    let errors: Vec<f64> = [12.0, 50.0, 200.0].iter().map(|n| off(&of(*n, "transport"), &whole)).collect();
    assert!(errors[0] > errors[1] && errors[1] > errors[2] && errors[2] < 0.02, "{errors:?}");
    for choice in ["magnitude", "area"] {
        let error = off(&of(200.0, choice), &whole);
        assert!(error < 0.08, "{choice}: {error}");
    }
}

/// The survey (7.5.1): wavelets make sharp shadows with about 100 coefficients, harmonics are better with
/// few.
#[test]
fn wavelets_win_under_a_sun_and_harmonics_under_a_smooth_sky() {
    let mesh = ring();
    let whole = |light: &Lights| {
        at_vertices(
            "haar_transport",
            light,
            &mesh,
            &[("wavelets", 98304.0), ("precision", 0.0)],
            Mat3::IDENTITY,
        )
    };
    let haar = |light: &Lights, n: f64| {
        at_vertices("haar_transport", light, &mesh, &[("wavelets", n)], Mat3::IDENTITY)
    };
    let sh = |light: &Lights, bands: f64| {
        let params = [("bands", bands), ("precision", 2e-3)];
        at_vertices("prt_diffuse", light, &mesh, &params, Mat3::IDENTITY)
    };
    let (sunny, smooth) = (low_sun(), lights::smooth());
    let (truth, soft) = (whole(&sunny), whole(&smooth));
    assert!(off(&haar(&sunny, 100.0), &truth) < 0.5 * off(&sh(&sunny, 6.0), &truth));
    assert!(off(&sh(&smooth, 3.0), &soft) < off(&haar(&smooth, 9.0), &soft));
}

/// The certificate by paths, and interreflected light: both equal those of harmonics, where these suffice.
#[test]
fn reflected_light_is_that_of_harmonics() {
    let (mesh, light) = (ring(), lights::quadratic());
    let params = [("bounces", 3.0)];
    let haar = at_vertices("haar_transport", &light, &mesh, &params, Mat3::IDENTITY);
    let sh = at_vertices("prt_diffuse", &light, &mesh, &params, Mat3::IDENTITY);
    assert!(off(&haar, &sh) < 0.02, "{}", off(&haar, &sh));
}

/// A quarter turn takes texels to texels.
#[test]
fn turned_light_is_that_of_a_turned_object() {
    let (mesh, light) = (ring(), low_sun());
    let turn = Mat3::from_rotation_y(std::f32::consts::FRAC_PI_2);
    let lit = at_vertices("haar_transport", &light, &mesh, &[], turn);
    let moved = mesh.transformed(&glam::Affine3A::from_mat3(turn.transpose()));
    let other = at_vertices("haar_transport", &light, &moved, &[], Mat3::IDENTITY);
    assert!(off(&lit, &other) < 0.04, "{}", off(&lit, &other));
}

#[test]
fn the_cube_gets_all_of_the_light() {
    let light = Light::bake(&low_sun()).unwrap();
    let cube = Level::new(32);
    let sum = |turn: Mat3| -> f64 {
        let planes = light.on_cube(&cube, turn);
        planes[0].iter().zip(&cube.omega).map(|(l, o)| f64::from(l * o)).sum()
    };
    let still = sum(Mat3::IDENTITY);
    let turned = sum(Mat3::from_rotation_x(0.7) * Mat3::from_rotation_z(2.0));
    assert!((turned / still - 1.0).abs() < 2e-3, "{still} {turned}");
}

//! Techniques made of photographs, against photographs that they were not made of: the path tracer on the
//! displaced mesh, with its parallax, masking and shadows.

use super::harness::material;
use glam::{DVec2, DVec3, Vec2};
use std::sync::Arc;
use steradian_base::{ParamValues, Task};
use steradian_reference::path::{Patch, PathOptions, photograph};
use steradian_relight::btf::{Btf, spread};
use steradian_relight::height::{HeightField, Pattern};
use steradian_relight::polynomial::Fit;
use steradian_scene::surface::{Planes, Texture};
use steradian_scene::{Bvh, Mesh};
use steradian_techniques::local::{LocalBake, Place};
use steradian_techniques::{Material, find_local};

/// Texels a side.
const SIDE: usize = 16;
/// Height of the relief over the side of the surface.
const RELIEF: f64 = 0.1;
const SPEC: &str = "lambert:albedo=0.7/0.5/0.3";

/// A weave whose texels are vertices, x to the right, y up.
struct Weave {
    mesh: Mesh,
    bvh: Bvh,
    plane: f64,
}

impl Weave {
    fn new() -> Self {
        let scale = (RELIEF * SIDE as f64) as f32;
        let z: Vec<f32> = Pattern::Weave.heights(SIDE).iter().map(|z| scale * z).collect();
        let plane = z.iter().map(|z| f64::from(*z)).sum::<f64>() / z.len() as f64;
        let field = HeightField::new(SIDE, SIDE, z).expect("finite");
        let mut mesh = Mesh::default();
        for j in 0..=SIDE {
            for i in 0..=SIDE {
                let z = field.at(i as i64, j as i64);
                mesh.positions.push(Vec2::new(i as f32, -(j as f32)).extend(z));
                mesh.normals.push(field.normal(i % SIDE, j % SIDE));
            }
        }
        for k in 0..SIDE * SIDE {
            let (i, j) = (k % SIDE, k / SIDE);
            let [a, b, c, d] =
                [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(|(i, j)| (j * (SIDE + 1) + i) as u32);
            mesh.triangles.extend([[a, c, d], [a, d, b]]);
        }
        Self { bvh: Bvh::build(&mesh), mesh, plane }
    }

    /// The pictures from a view under lights, `[texel][light]`: radiance under an irradiance of 1 across the
    /// light's direction. Direct light at the texels' middles, so that nothing is random.
    fn seen(&self, view: DVec3, lights: &[DVec3]) -> Vec<[f32; 3]> {
        let patch = Patch {
            mesh: &self.mesh,
            bvh: &self.bvh,
            period: DVec2::splat(SIDE as f64),
            corner: DVec2::new(-0.5, 0.5 - SIDE as f64),
            plane: self.plane,
            brdf: &*material(SPEC).brdf,
            tint: None,
            offset: 1e-3,
        };
        let options = PathOptions { bounces: 1, samples: 1, seed: 1 };
        photograph(&patch, (SIDE, SIDE), (view, 0), lights, options, &Task::quiet())
            .expect("nobody cancels")
            .rgb
    }
}

/// Directions between those of [`spread`]: as many, turned and less steep by half a step.
fn between(count: usize) -> Vec<DVec3> {
    let turn = glam::DQuat::from_rotation_z(0.61) * glam::DQuat::from_rotation_x(0.11);
    spread(count).into_iter().map(|d| turn * d).filter(|d| d.z > 0.25).collect()
}

/// Relative RMS error of a technique's radiance in the pictures of a view under lights.
fn error(b: &dyn LocalBake, weave: &Weave, views: &[DVec3], lights: &[DVec3]) -> f64 {
    let (mut squares, mut energy) = (0.0, 0.0);
    for view in views {
        let seen = weave.seen(*view, lights);
        for (k, want) in seen.iter().enumerate() {
            let (x, l) = (k / lights.len(), k % lights.len());
            let uv = [x % SIDE, x / SIDE].map(|i| (i as f32 + 0.5) / SIDE as f32);
            let single = |d: DVec3| d.as_vec3().to_array();
            let got = b.f_cos_at(Place { uv, footprint: 0.0 }, single(lights[l]), single(*view));
            for c in 0..3 {
                squares += f64::from(got[c] - want[c]).powi(2);
                energy += f64::from(want[c]).powi(2);
            }
        }
    }
    (squares / energy).sqrt()
}

fn bake(slug: &str, m: &Material, parameters: &str) -> Box<dyn LocalBake> {
    let t = find_local(slug).expect("a technique");
    let params = ParamValues::parse(parameters, t.params()).expect("parameters");
    t.bake(m, None, &params, &Task::quiet()).expect("bakes")
}

/// The sums of a basis of `N` functions that are fitted to the pictures of the view along the normal.
fn polynomials<const N: usize>(weave: &Weave, lights: &[DVec3]) -> Planes {
    let fit = Fit::<N>::new(lights).expect("lights all around");
    let seen = weave.seen(DVec3::Z, lights);
    let of = |x: usize, c: usize| {
        // White is 1.
        let values = seen[x * lights.len()..][..lights.len()].iter();
        fit.coefficients(values.map(|v| std::f64::consts::PI * f64::from(v[c])))
    };
    let all: Vec<[[f64; N]; 3]> = (0..SIDE * SIDE).map(|x| [0, 1, 2].map(|c| of(x, c))).collect();
    let plane = |k: usize| {
        let channels = [0, 1, 2].map(|c| all.iter().map(|a| a[c][k] as f32).collect());
        Arc::new(Texture::new(SIDE, SIDE, &channels).expect("texels"))
    };
    (0..N).fold(Planes::default(), |p, k| p.with(&format!("map.{k}"), plane(k)))
}

/// Polynomial texture maps of 48 photographs under lights between theirs: shadows have edges, which few
/// smooth functions of the light follow, and more of them follow better.
#[test]
fn polynomial_texture_maps_show_photographs_that_they_were_not_made_of() {
    let weave = Weave::new();
    let (lights, others) = (spread(48), between(48));
    let of = |basis: &str, planes: Planes| {
        let m = material(SPEC).with_textures(planes);
        let b = bake("polynomial_texture_map", &m, &format!("basis={basis}"));
        [&lights, &others].map(|l| error(&*b, &weave, &[DVec3::Z], l))
    };
    let six = of("biquadratic", polynomials::<6>(&weave, &lights));
    let nine = of("sh9", polynomials::<9>(&weave, &lights));
    let sixteen = of("sh16", polynomials::<16>(&weave, &lights));
    println!("PTM, own photographs and others: {six:.3?}, of nine {nine:.3?}, of sixteen {sixteen:.3?}");
    for (got, want) in [(six, PTM[0]), (nine, PTM[1]), (sixteen, PTM[2])] {
        for k in 0..2 {
            assert!((got[k] - want[k]).abs() < 0.1 * want[k], "{got:?} {want:?}");
        }
    }
}

/// Relative RMS errors, as measured: own photographs and others, by six, nine and sixteen functions.
const PTM: [[f64; 2]; 3] = [[0.098, 0.091], [0.055, 0.058], [0.044, 0.055]];

/// Bidirectional texture functions of few and of more directions, whole and compressed, at their own pairs of
/// directions and between these.
#[test]
fn bidirectional_texture_functions_show_photographs_that_they_were_not_made_of() {
    let weave = Weave::new();
    let mut errors = Vec::new();
    for count in [21, 81] {
        let all = spread(count);
        let mut btf = Btf::new((SIDE, SIDE), &all, &all, false).expect("directions above the surface");
        for (v, view) in all.iter().enumerate() {
            let seen = weave.seen(*view, &all);
            for l in 0..count {
                let plane = |c: usize| -> Vec<f32> {
                    seen.iter().skip(l).step_by(count).map(|x| std::f32::consts::PI * x[c]).collect()
                };
                let [r, g, b] = [0, 1, 2].map(plane);
                btf.set(v, l, [&r, &g, &b]).expect("a picture");
            }
        }
        let m = material(SPEC).with_apparent(Arc::new(btf));
        let own: Vec<DVec3> = all.iter().copied().filter(|d| d.z > 0.25).step_by(3).collect();
        let other: Vec<DVec3> = between(count).into_iter().step_by(3).collect();
        for parameters in ["method=local,clusters=8,components=6", "method=view,components=8"] {
            let b = bake("btf_pca", &m, parameters);
            errors.push([&own, &other].map(|d| error(&*b, &weave, d, d)));
        }
    }
    println!("BTF, own photographs and others: {errors:.3?}");
    for (got, want) in errors.iter().zip(BTF) {
        for k in 0..2 {
            assert!((got[k] - want[k]).abs() < 0.1 * want[k] + 5e-4, "{errors:?}");
        }
    }
}

/// Relative RMS errors, as measured: own photographs and others, of 21 directions by clusters and by views,
/// and of 81.
const BTF: [[f64; 2]; 4] = [[0.0148, 0.0875], [0.0002, 0.0877], [0.0260, 0.0595], [0.0330, 0.0587]];

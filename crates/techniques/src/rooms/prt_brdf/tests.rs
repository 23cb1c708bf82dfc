use super::*;
use crate::trial::Certified;
use crate::{AnyBake, PointsBuf, Sites, find};
use glam::{Mat3, Vec2, Vec3};
use std::sync::Arc;
use steradian_base::ParamValues;
use steradian_scene::{Mesh, shapes};
use steradian_sphere::Frame as Local;

const SPEC: &str = "ashikhmin-shirley:nu=12,nv=4";

fn bake(slug: &str, spec: &str, g: Option<&Geometry>, lights: &Lights) -> Box<dyn AnyBake> {
    let material = Material::new(steradian_brdf::parse(spec).unwrap());
    let t = find(slug).unwrap();
    // The default, 128 × 128 views, is 16 times as many.
    let few = [("lights", 0.0), ("size", 32.0)];
    let values: ParamValues =
        few.into_iter().filter(|(n, _)| t.params().iter().any(|p| p.name == *n)).collect();
    t.draft(lights, &material, g, &values, &Task::quiet()).unwrap()
}

/// The vertices of a mesh, each seen from its front.
fn vertices(mesh: &Mesh) -> PointsBuf {
    let mut q = PointsBuf::default();
    for (k, (p, n)) in mesh.positions.iter().zip(&mesh.normals).enumerate() {
        let t = Local::from_normal(n.as_dvec3()).t.as_vec3();
        let wo = (*n + 0.8 * Vec3::new((k as f32).sin(), 0.3, (1.7 * k as f32).cos())).normalize();
        q.push(*n, t, wo, *p);
        q.locate(Vec2::ZERO, [k as u32; 3], [0.0; 2]);
    }
    q
}

fn shade(b: &dyn AnyBake, q: &PointsBuf) -> [Vec<f32>; 3] {
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    rgb
}

/// Relative RMS difference.
fn off(a: &[Vec<f32>; 3], b: &[Vec<f32>; 3]) -> f64 {
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        (0..3).flat_map(|c| a[c].iter().zip(&b[c])).map(|(a, b)| f(f64::from(*a), f64::from(*b))).sum()
    };
    (sum(&|a, b| (a - b).powi(2)) / sum(&|_, b| b * b)).sqrt()
}

/// Two balls that shadow each other.
fn balls() -> Geometry {
    let one = shapes::icosphere(3);
    let mut other = one.clone();
    other.positions.iter_mut().for_each(|p| *p = 0.6 * *p + Vec3::new(1.4, 0.9, 0.2));
    Geometry::new(Arc::new(Mesh::merged(&[one, other])), Sites::Vertices)
}

/// A vertex of no triangle has no surface around it: it is dark, and no number of the bake is NaN.
#[test]
fn vertices_of_no_triangle_are_dark() {
    let mut mesh = shapes::icosphere(1);
    let vertex = mesh.positions.len();
    mesh.positions.push(Vec3::ONE);
    mesh.normals.push(Vec3::Y);
    let mesh = Arc::new(mesh);
    let bake = bake("prt_brdf", SPEC, Some(&Geometry::new(mesh.clone(), Sites::Vertices)), &lights::smooth());
    let rgb = shade(&*bake, &vertices(&mesh));
    assert!(
        rgb.iter().all(|plane| plane[vertex] == 0.0 && plane[..vertex].iter().all(|x| *x > 0.0)),
        "{rgb:?}"
    );
}

/// A ball sees nothing of itself: no shadow, and the room without transfer.
#[test]
fn in_the_open_it_is_the_table_alone() {
    let mesh = Arc::new(shapes::icosphere(2));
    let g = Geometry::new(mesh.clone(), Sites::Vertices);
    let q = vertices(&mesh);
    let light = lights::smooth();
    let first = [bake("sh_brdf", SPEC, None, &light), bake("prt_brdf", SPEC, Some(&g), &light)];
    for light in [light, lights::studio()] {
        let [alone, mut own] =
            first.each_ref().map(|b| b.preview(Some(&light), None, &Task::quiet()).unwrap());
        let e = off(&shade(&*own, &q), &shade(&*alone, &q));
        assert!(e < 2e-5, "{e}");
        // Turned light, by both.
        let view = View {
            light_rotation: Mat3::from_rotation_x(0.7) * Mat3::from_rotation_y(2.0),
            ..View::default()
        };
        own.frame(&view);
        let turned = alone.with_view(&view);
        assert!(off(&shade(&*own, &q), &shade(&*turned, &q)) < 2e-5);
    }
}

/// 16-bit numbers change radiance by little, between vertices too.
#[test]
fn sixteen_bits_are_enough() {
    let g = balls();
    let mut q = vertices(&g.mesh);
    for (k, t) in g.mesh.triangles.iter().enumerate().step_by(7) {
        let n = g.mesh.normals[t[0] as usize];
        q.push(n, Local::from_normal(n.as_dvec3()).t.as_vec3(), n, g.mesh.positions[t[0] as usize]);
        q.locate(Vec2::ZERO, *t, [0.3, 0.1 + 0.5 * (k as f32).sin().abs()]);
    }
    let spec = "ashikhmin-shirley:nu=24,nv=8,rs=0.9/0.6/0.3,rd=0.1/0.2/0.3";
    let of = |halves: f64| {
        let material = Material::new(steradian_brdf::parse(spec).unwrap());
        let values: ParamValues = [("halves", halves), ("size", 32.0)].into_iter().collect();
        let t = find("prt_brdf").unwrap();
        shade(&*t.draft(&lights::studio(), &material, Some(&g), &values, &Task::quiet()).unwrap(), &q)
    };
    let e = off(&of(1.0), &of(0.0));
    assert!(e < 1e-3, "{e}");
}

/// Under light of three bands a lambertian surface is that of transfer vectors, up to the bands of the cosine
/// beyond five.
#[test]
fn lambert_is_diffuse_transfer() {
    let (g, spec) = (balls(), "lambert:albedo=0.8/0.5/0.2");
    let q = vertices(&g.mesh);
    let [own, diffuse] =
        ["prt_brdf", "prt_diffuse"].map(|slug| shade(&*bake(slug, spec, Some(&g), &lights::quadratic()), &q));
    let alone = shade(&*bake("sh_brdf", spec, None, &lights::quadratic()), &q);
    let (e, shadow) = (off(&own, &diffuse), off(&alone, &diffuse));
    assert!(e < 0.02 && shadow > 5.0 * e, "{e} {shadow}");
}

/// The certificate holds shading against paths through the mesh; without shadows it would be worse.
#[test]
fn shadows_are_those_of_paths() {
    let g = balls();
    let b = bake("prt_brdf", SPEC, Some(&g), &lights::smooth());
    println!("{:?}", b.certified());
    assert!(b.certified().error < 0.08, "{}", b.certified().error);
    // Changing the reflectance keeps the transfer.
    let glossy = Material::new(steradian_brdf::parse("ggx:alpha=0.5,f0=0.9").unwrap());
    assert!(b.with_material(&glossy, &Task::quiet()).unwrap().certified().error < 0.1);
}

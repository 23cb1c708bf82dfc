use crate::local::{LocalFrame, LocalLights, LocalShading};
use crate::shared::trials::lights;
use crate::{Material, PointsBuf, Radiance, View, find_local};
use glam::{Vec2, Vec3, Vec4};
use steradian_base::{ParamValues, Task};
use steradian_brdf::parse;
use steradian_light::{Lights, PointLight};
use steradian_scene::{Mesh, shapes};

fn local(l: Lights) -> LocalLights {
    LocalLights { directionals: l.directionals, points: l.points }
}

const EYE: Vec3 = Vec3::new(1.0, 0.8, 3.0);

fn lit(rate: &str, spec: &str, lights: &LocalLights, mesh: &Mesh) -> Box<dyn LocalShading> {
    let t = find_local("vertex_analytic").expect("a technique");
    let params: ParamValues = [("rate", rate)].into_iter().collect();
    let material = Material::new(parse(spec).expect(spec));
    let b = t.bake(&material, None, &params, &Task::quiet()).expect("bakes");
    let view = View { eye: EYE, ..View::default() };
    b.lit(&LocalFrame { lights, view: &view, mesh: Some(mesh), shadowed: false })
        .expect("a mesh with normals")
}

fn shade(s: &dyn LocalShading, q: &PointsBuf) -> [Vec<f32>; 3] {
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
    s.add(None, &q.as_points(), &mut Radiance::of(&mut rgb));
    rgb
}

/// The corners of every triangle, or points in it.
fn points(mesh: &Mesh, weights: &[[f32; 2]]) -> PointsBuf {
    let mut q = PointsBuf::default();
    for &t in &mesh.triangles {
        for &[v, w] in weights {
            let mix = |x: &[Vec3]| {
                let [a, b, c] = t.map(|k| x[k as usize]);
                // At a corner the corner's own bits.
                if [v, w] == [0.0, 0.0] { a } else { a * (1.0 - v - w) + b * v + c * w }
            };
            let (p, n) = (mix(&mesh.positions), mix(&mesh.normals));
            let n = if [v, w] == [0.0, 0.0] { n } else { n.normalize() };
            let tangent = mesh.tangents.get(t[0] as usize).map_or(Vec4::ZERO, |t| *t).truncate();
            let tangent = if tangent == Vec3::ZERO {
                steradian_sphere::Frame::from_normal(n.as_dvec3()).t.as_vec3()
            } else {
                tangent
            };
            q.push(n, tangent, (EYE - p).normalize(), p);
            q.locate(Vec2::ZERO, t, [v, w]);
        }
    }
    q
}

/// At vertices both rates give the same bits.
#[test]
fn corners_are_what_every_point_is() {
    let mesh = shapes::icosphere(2);
    let q = points(&mesh, &[[0.0; 2]]);
    for light in [lights::near_point(), lights::three_directionals()] {
        let light = local(light);
        for spec in ["minnaert:k=0.65", "ggx:alpha=0.2,f0=0.9"] {
            let [vertex, pixel] = ["vertex", "pixel"].map(|rate| shade(&*lit(rate, spec, &light, &mesh), &q));
            assert!(pixel.iter().flatten().any(|x| *x > 0.0));
            for (a, b) in vertex.iter().flatten().zip(pixel.iter().flatten()) {
                assert_eq!(a.to_bits(), b.to_bits(), "{spec}");
            }
        }
    }
}

/// Half the length of edges is a quarter of the error, and the certificate says how much it is.
#[test]
fn the_error_falls_with_the_square_of_edges() {
    let light = local(Lights {
        points: vec![PointLight { position: Vec3::new(1.0, 3.0, 4.0), intensity: [30.0; 3] }],
        ..Lights::default()
    });
    // Where all is lit and seen, the radiance has no edges.
    let error = |n: u32| {
        let mesh = shapes::icosphere(n);
        let q = points(&mesh, &[[1.0 / 3.0; 2], [0.2, 0.5]]);
        let [vertex, pixel] = ["vertex", "pixel"].map(|rate| lit(rate, "lambert", &light, &mesh));
        let (got, exact) = (shade(&*vertex, &q), shade(&*pixel, &q));
        let to = Vec3::new(1.0, 3.0, 4.0).normalize();
        let (mut squares, mut energy) = (0.0, 0.0);
        for i in 0..q.len() {
            let n = Vec3::new(q.n[0][i], q.n[1][i], q.n[2][i]);
            if n.dot(to) > 0.5 && n.dot(EYE.normalize()) > 0.5 {
                squares += f64::from(got[0][i] - exact[0][i]).powi(2);
                energy += f64::from(exact[0][i]).powi(2);
            }
        }
        ((squares / energy).sqrt(), vertex.certificate().error)
    };
    let all = [3, 4, 5].map(error);
    for k in 0..2 {
        let ratio = all[k].0 / all[k + 1].0;
        assert!((3.6..4.4).contains(&ratio), "{all:?}");
        assert!(all[k].1 > all[k + 1].1 && all[k].1 < 0.1, "{all:?}");
    }
}

/// A highlight that lies inside a triangle is missed: less than a hundredth of it is seen, and the
/// certificate says so.
#[test]
fn a_highlight_inside_a_triangle_is_missed() {
    let side = 4.0;
    let corners = [Vec3::new(-side, 0.0, -side), Vec3::new(0.0, 0.0, side), Vec3::new(side, 0.0, -side)];
    let mesh = Mesh {
        positions: corners.to_vec(),
        normals: vec![Vec3::Y; 3],
        triangles: vec![[0, 1, 2]],
        ..Mesh::default()
    };
    // The mirror image of the eye about the middle of the triangle.
    let middle = corners.iter().sum::<Vec3>() / 3.0;
    let to = EYE - middle;
    let position = middle + Vec3::new(-to.x, to.y, -to.z);
    let light =
        LocalLights { points: vec![PointLight { position, intensity: [9.0; 3] }], ..LocalLights::default() };
    let q = points(&mesh, &[[1.0 / 3.0; 2]]);
    let shadings = ["vertex", "pixel"].map(|rate| lit(rate, "phong:n=2000", &light, &mesh));
    let [missed, seen] = shadings.each_ref().map(|s| shade(&**s, &q)[1][0]);
    assert!(seen > 0.1 && missed < 0.01 * seen, "{missed} of {seen}");
    assert!(shadings[0].certificate().error > 0.99);
}

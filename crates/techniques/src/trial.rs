//! Common code of the techniques' tests: bakes, points at one elevation, the reference.

pub mod local;

use crate::{AnyBake, Bake, Geometry, Material, Parts, PointsBuf, Radiance, Sites, Technique, View, find};
use glam::{DMat3, DVec3, Vec2, Vec3};
use std::f64::consts::PI;
use std::sync::Arc;
use steradian_base::{Certificate, ParamValues, Params, Task};
use steradian_light::Lights;
use steradian_prefilter::probe;
use steradian_reference::{Lookup, Reference, ReferencePoint};
use steradian_scene::Mesh;
use steradian_sphere::Frame;

/// Certificates of drafts, which most tests do not use and which take most of the time: measured where one is
/// asked for.
pub trait Certified {
    /// The certificate, measured now where it has not been.
    fn certified(&self) -> &Certificate;
}

impl Certified for dyn AnyBake + '_ {
    fn certified(&self) -> &Certificate {
        self.certify(&Task::quiet()).unwrap();
        self.certificate()
    }
}

/// A draft of technique `slug`.
pub fn bake(
    slug: &str,
    lights: &Lights,
    spec: &str,
    params: &[(&str, f64)],
    tolerance: Option<f64>,
) -> Box<dyn AnyBake> {
    let material = Material::new(steradian_brdf::parse(spec).unwrap());
    let values: ParamValues = params.iter().copied().collect();
    let task = Task::quiet().with_tolerance(tolerance);
    find(slug).unwrap().draft(lights, &material, None, &values, &task).unwrap()
}

/// A bake with its types, at the sites of a mesh. Nothing has measured its error.
pub fn typed<T: Technique>(lights: &Lights, spec: &str, g: &Geometry, values: &ParamValues) -> Bake<T> {
    let (params, task) = (T::Params::from_values(values).unwrap(), Task::quiet());
    let material = Material::new(steradian_brdf::parse(spec).unwrap());
    let light = T::light(lights, &params, &task).unwrap();
    let material = T::material(&material, &params, &task).unwrap();
    let transfer = T::transfer(Some(g), &material, &params, &task).unwrap();
    let parts = Parts::<T> { light: &light, material: &material, transfer: &transfer };
    let linked = T::link(parts, &params, &task).unwrap().0;
    Bake {
        params,
        light: Arc::new(light),
        material: Arc::new(material),
        transfer: Arc::new(transfer),
        linked,
        certificate: Certificate::exact(),
    }
}

/// A figure of a certificate.
pub fn detail(b: &dyn AnyBake, name: &str) -> f64 {
    b.certified().figure(name).unwrap_or_else(|| panic!("{name}"))
}

/// The error that a certificate states so many degrees from the normal.
pub fn stated(b: &dyn AnyBake, degrees: f64) -> f64 {
    b.certified().at(degrees.to_radians()).unwrap()
}

/// `n` points seen `degrees` off their normals.
pub fn points(n: usize, degrees: f64) -> Vec<ReferencePoint> {
    let (s, c) = degrees.to_radians().sin_cos();
    let point = |k: usize| {
        let frame = Frame::from_normal(probe::direction(k, n));
        let phi = 2.0 * PI * (k as f64 * 0.569_840_291 + 0.1).fract();
        let wo = frame.to_world(DVec3::new(s * phi.cos(), s * phi.sin(), c));
        ReferencePoint { frame, wo, position: None }
    };
    (0..n).map(point).collect()
}

/// Radiance of a bake at these points.
pub fn shade(b: &dyn AnyBake, points: &[ReferencePoint]) -> Vec<[f64; 3]> {
    let mut q = PointsBuf::with_capacity(points.len());
    for p in points {
        q.push(p.frame.n.as_vec3(), p.frame.t.as_vec3(), p.wo.as_vec3(), Vec3::ZERO);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![f32::NAN; points.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    (0..points.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]].map(f64::from)).collect()
}

/// Relative RMS errors of several bakes against the reference, at the same points.
pub fn judged(bakes: &[&dyn AnyBake], lights: &Lights, spec: &str, points: &[ReferencePoint]) -> Vec<f64> {
    let reference = Reference::new(lights, Lookup::Constant, &Task::quiet()).unwrap();
    let brdf = steradian_brdf::parse(spec).unwrap();
    let exact = reference.radiance_batch(&*brdf, points, 2e-3, &Task::quiet()).unwrap();
    let error = |b: &&dyn AnyBake| {
        probe::relative_rms(shade(*b, points).into_iter().zip(exact.iter().map(|e| e.rgb)))
    };
    bakes.iter().map(error).collect()
}

/// Suns that are shaded exactly rotate with the light, and are saved with what shades them.
pub fn suns_turn_and_are_saved(b: &mut dyn AnyBake) {
    assert!(detail(b, "lights") >= 1.0);
    let still = points(40, 70.0);
    let before = shade(b, &still);
    let r = DMat3::from_rotation_z(0.9) * DMat3::from_rotation_y(2.0);
    let turned = |p: &ReferencePoint| {
        let frame = Frame { t: r * p.frame.t, b: r * p.frame.b, n: r * p.frame.n };
        ReferencePoint { frame, wo: r * p.wo, position: None }
    };
    b.frame(&View { light_rotation: r.as_mat3(), ..View::default() });
    let after = shade(b, &still.iter().map(turned).collect::<Vec<_>>());
    let off = probe::relative_rms(after.into_iter().zip(before.clone()));
    assert!(off < 1e-3, "{off}");
    b.frame(&View::default());
    let again = find(b.card().slug).unwrap().load(&b.save()).unwrap();
    assert_eq!(shade(&*again, &still), before);
}

/// The vertices of a mesh as sites.
pub fn vertices(mesh: &Mesh) -> Geometry {
    Geometry::new(Arc::new(mesh.clone()), Sites::Vertices)
}

/// A draft of technique `slug` at the vertices of a mesh.
pub fn on_mesh(
    slug: &str,
    lights: &Lights,
    spec: &str,
    mesh: &Mesh,
    params: &[(&str, f64)],
) -> Box<dyn AnyBake> {
    let material = Material::new(steradian_brdf::parse(spec).unwrap());
    let params: ParamValues = params.iter().copied().collect();
    find(slug).unwrap().draft(lights, &material, Some(&vertices(mesh)), &params, &Task::quiet()).unwrap()
}

/// Radiance of all vertices, each seen along its normal.
pub fn at_vertices(b: &dyn AnyBake, mesh: &Mesh) -> Vec<[f32; 3]> {
    let mut q = PointsBuf::default();
    for (k, (n, p)) in mesh.normals.iter().zip(&mesh.positions).enumerate() {
        q.push(*n, n.any_orthonormal_vector(), *n, *p);
        q.locate(Vec2::ZERO, [k as u32; 3], [0.0; 2]);
    }
    let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![0.0; q.len()]);
    b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
    (0..q.len()).map(|i| [rgb[0][i], rgb[1][i], rgb[2][i]]).collect()
}

/// The largest difference of a channel.
pub fn farthest(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    a.iter().zip(b).flat_map(|(a, b)| (0..3).map(move |c| (a[c] - b[c]).abs())).fold(0.0, f32::max)
}

/// Points without sites are black, and none beyond the end is read.
pub fn points_without_sites_are_black(b: &dyn AnyBake) {
    let mut q = PointsBuf::default();
    q.push(Vec3::Y, Vec3::X, Vec3::Y, Vec3::ZERO);
    let shade = |q: &PointsBuf| {
        let mut rgb: [Vec<f32>; 3] = std::array::from_fn(|_| vec![1.0]);
        b.shade(&q.as_points(), &mut Radiance::of(&mut rgb));
        rgb[0][0]
    };
    assert_eq!(shade(&q), 0.0);
    q.locate(Vec2::ZERO, [u32::MAX; 3], [0.3; 2]);
    assert_eq!(shade(&q), 0.0);
}
